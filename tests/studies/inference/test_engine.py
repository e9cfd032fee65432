"""The engine on forward models of a line or two: evidence against integrals taken by brute force, numerical edges."""

import math
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad, quad
from scipy.linalg import expm
from scipy.stats import multivariate_normal
from threadpoolctl import threadpool_info, threadpool_limits

from bicycle import Model, load_bicycle
from bicycle.identification import Run
from studies import inference
from studies.diagnosis import Histories, diagnose, read_measurement
from tyre.ground import data_root

X = np.linspace(0.0, 1.0, 9)
BASE = inference.UncertainParameter("level", "1", {"level": 1.0}, 0.3, 0.4)


def candidate(name, *, scale=0.5, lowest=-math.inf):
    return inference.Candidate(
        name, (inference.UncertainParameter("size", "1", {name: 1.0}, 0.0, scale, lowest, size=True),)
    )


def shape(name, size):
    """Synthetic: what an effect adds to the data, and its derivative."""
    if name == "slope":
        return size * X, X
    if name == "bend":
        return size * (X**2 + 0.4), X**2 + 0.4
    return np.expm1(size * X), X * np.exp(size * X)  # growth


@dataclass(frozen=True)
class Toy(inference.Kind):
    """data = level + effect, noise sd 1 in units of ``noise``."""

    readings: np.ndarray
    noise: float
    candidates: tuple
    nuisances: tuple = (BASE,)
    rows: inference.Rows = field(default_factory=lambda: inference.Rows(("x",) * 9, X, ("x",) * 9, np.arange(9) % 3))

    def residual(self, candidates, theta, *, slopes=True):
        computed, columns = np.full(9, theta[0]), [np.ones(9)]
        for c, size in zip(candidates, theta[1:], strict=True):
            added, slope = shape(c.identifier, size)
            computed, columns = computed + added, [*columns, slope]
        return (self.readings - computed) / self.noise, -np.stack(columns, 1) / self.noise


def toy(truth, noise, *candidates, level=0.5):
    rng = np.random.default_rng(4)
    return Toy(level + shape(*truth)[0] + noise * rng.standard_normal(9), noise, candidates)


def normal(x, centre, sd):
    return math.exp(-(((x - centre) / sd) ** 2) / 2) / (sd * math.sqrt(2 * math.pi))


def integral(problem, c=None):
    """ln of the likelihood averaged over the prior, on the area where it lives; no code of the engine."""

    def likelihood(level, size=0.0):
        computed = level + (shape(c.identifier, size)[0] if c else 0.0)
        return math.exp(-float((((problem.readings - computed) / problem.noise) ** 2).sum()) / 2)

    if c is None:
        return math.log(quad(lambda a: likelihood(a) * normal(a, 0.3, 0.4), -1.5, 2.5, epsrel=1e-9, epsabs=0)[0])
    scale, low = c.unknowns[0].scale, max(c.unknowns[0].lowest, -4.0)
    doubled = 2.0 if low == 0 else 1.0  # a prior cut off at zero
    found, _ = dblquad(
        lambda level, size: doubled * likelihood(level, size) * normal(level, 0.3, 0.4) * normal(size, 0.0, scale),
        low, 4.0, -1.5, 2.5, epsrel=1e-7, epsabs=0,
    )  # fmt: skip
    return math.log(found)


@pytest.mark.parametrize(("truth", "noise", "c", "exact"), [
    (("slope", 0.6), 0.2, candidate("slope"), 1e-3),  # linear: Laplace is exact, up to where the fit stops
    (("slope", 0.3), 0.2, candidate("slope", lowest=0.0), 1e-3),  # cut off at zero, within the posterior's width
    (("slope", -0.3), 0.2, candidate("slope", lowest=0.0), 1e-3),  # the fit is held at the bound
    (("slope", -1.0), 0.15, candidate("slope", lowest=0.0), 1e-3),  # and pushed against it
    (("growth", 0.5), 0.1, candidate("growth"), 0.02),  # curved: Laplace is an approximation
    (("growth", 0.5), 0.3, candidate("growth", scale=1.0), 0.1),
])  # fmt: skip
def test_laplace_evidence_against_the_integral(truth, noise, c, exact):
    problem = toy(truth, noise, c)
    assert inference.fit(problem, (c,)).log_evidence == pytest.approx(integral(problem, c), abs=exact)
    assert inference.fit(problem).log_evidence == pytest.approx(integral(problem), abs=1e-3)


def test_posterior_is_that_of_the_integrals():
    """Half for nothing, the other half shared: the probabilities from brute force."""
    c = candidate("slope"), candidate("bend", lowest=0.0), candidate("growth", scale=1.0)
    problem = toy(("slope", 0.35), 0.2, *c)
    weights = np.exp([integral(problem), *(integral(problem, one) - math.log(3) for one in c)])
    found = inference.fit_singles(problem, lambda what: None).posterior
    for name, expected in zip(("none", "slope", "bend", "growth"), weights / weights.sum(), strict=True):
        assert found[name] == pytest.approx(expected, abs=0.01)
    assert 0.1 < found["none"] < 0.9


@pytest.mark.parametrize("family", ["", "a lag of the sensor"])
def test_an_error_needs_one_law(family):
    """Two mistakes of one family that explain the data only together are a law that is neither of them."""
    laws = [replace(candidate(name), weight=0.5, family=family) for name in ("slope", "bend")]
    readings = shape("slope", 0.9)[0] - shape("bend", 0.9)[0]
    verdict = inference.judge(Toy(readings + toy(("slope", 0.0), 0.01).readings, 0.01, tuple(laws))).verdict
    assert verdict.verdict == ("unknown" if family else "named")
    (check,) = (check for check in verdict.checks if check.rule == "one_law")
    assert (check.figure, check.passed) == (("a lag of the sensor", False) if family else ("yes", True))


def test_held_out_score_is_the_conditional_density():
    """Each fold given the others under the joint normal distribution of all data: linear, so exact."""
    problem = toy(("slope", 0.6), 0.2, c := candidate("slope"))
    columns = np.stack([0.4 * np.ones(9), 0.5 * X], 1) / 0.2
    mean, joint = np.full(9, 0.3) / 0.2, np.eye(9) + columns @ columns.T
    y, expected = problem.readings / 0.2, 0.0
    for k in range(3):
        out = np.arange(9) % 3 == k
        gain = joint[np.ix_(out, ~out)] @ np.linalg.inv(joint[np.ix_(~out, ~out)])
        covariance = joint[np.ix_(out, out)] - gain @ joint[np.ix_(~out, out)]
        expected += multivariate_normal.logpdf(y[out], mean[out] + gain @ (y - mean)[~out], covariance)
    assert inference.held_out(problem, inference.fit(problem, (c,))).log_score == pytest.approx(expected, abs=1e-3)


def test_a_covariance_that_rounding_left_indefinite_is_scored():
    """Singular by construction: two parameters known only by their sum."""
    covariance = np.array([[1.0, -1.0 - 1e-12], [-1.0 - 1e-12, 1.0]])
    j, r = np.array([[1.0, 1.0], [2.0, 1.0]]), np.array([0.3, -1.2])
    spread = np.eye(2) + np.outer([0, 1], [0, 1])  # j (1, -1)' = (0, 1)
    assert inference.log_normal(r, j, covariance) == pytest.approx(multivariate_normal.logpdf(r, cov=spread), abs=1e-6)


def test_blas_keeps_to_one_thread(monkeypatch):
    """The matrices are small: with two threads on a busy machine a diagnosis takes ten times longer."""
    seen = []

    def judge(*arguments, **keywords):
        seen.extend(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")
        raise InterruptedError

    monkeypatch.setattr(import_module("studies.diagnosis.diagnose"), "judge", judge)
    measurement = read_measurement(Path(str(data_root().joinpath("measured", "kooijman2008.toml"))))
    with threadpool_limits(2, user_api="blas"), pytest.raises(InterruptedError):
        diagnose(measurement)
    assert set(seen) == {1}


# Meijaard, Papadopoulos, Ruina & Schwab (2007), section 4: canonical matrices of the benchmark bicycle
M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
K0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
K2 = np.array([[0, 76.59734589573222], [0, 2.65431523794604]])
C1 = np.array([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])


def test_an_unknown_start_is_integrated_out():
    """Against the dense normal distribution of lean rate and steer, from the published matrices and expm.

    Yaw has its own initial state, which neither channel sees: it must not count.
    """
    speed, step, n = 5.0, 0.05, 40
    inverse = np.linalg.inv(M)
    a = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ (9.81 * K0 + speed**2 * K2), -inverse @ (speed * C1)]])
    states = np.array([expm(a * step * k) for k in range(n)])
    noise = {"roll_rate_rad_s": 0.03, "steer_rad": 0.01}
    free = np.concatenate([states[:, 2] / 0.03, states[:, 1] / 0.01])  # (2 n, 4), whitened
    covariance = np.eye(2 * n) + free @ np.diag([0.5, 0.5, 3.0, 3.0]) ** 2 @ free.T  # rad, rad/s: documented prior
    rng = np.random.default_rng(8)
    white = free @ [0.05, -0.02, 0.4, 0.1] + rng.standard_normal(2 * n)
    channels = {"roll_rate_rad_s": 0.03 * white[:n], "steer_rad": 0.01 * white[n:]}
    run = Run("a", speed, step * np.arange(n), channels, {})
    forward = Histories(name="own", model=Model(load_bicycle("benchmark")), runs=(run,), noise_sd=noise).prepare()
    theta = np.array([u.centre for u in forward.nuisances])
    residual, _ = forward.residual((), theta)
    assert residual @ residual == pytest.approx(white @ np.linalg.solve(covariance, white), rel=1e-6)
    assert forward.log_determinant((), theta) == pytest.approx(np.linalg.slogdet(covariance)[1], abs=1e-6)


def test_together_each_candidate_begins_at_all_its_starts_and_one_with_fewer_stays_at_its_last():
    """0.05 and 0.7 of the prior sd of 0.5, of either sign where both are possible; the level at its mean."""
    one_sided, either = candidate("slope", lowest=0.0), candidate("bend")
    expected = [[0.3, 0.025, 0.025], [0.3, 0.35, 0.35], [0.3, 0.35, -0.025], [0.3, 0.35, -0.35]]
    np.testing.assert_allclose(
        inference.default_starts(toy(("slope", 1.0), 0.1), (one_sided, either)), expected, rtol=1e-12
    )
