"""The marginal likelihood of a window by dense covariances: y ~ N(0, s^2 (K + X P X')), the prior of log s even."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag, expm, solve_continuous_lyapunov, toeplitz
from scipy.optimize import minimize
from scipy.special import gammaln
from scipy.stats import norm

from bicycle.identification import decay_evidence as module
from bicycle.identification import decay_noise
from bicycle.identification.decay_estimate import _quantiles
from bicycle.identification.decay_evidence import Evidence, basis
from bicycle.identification.decay_guesses import noise_floor
from bicycle.identification.decay_least_squares import log_sum
from bicycle.identification.decay_noise import Driving
from bicycle.identification.decay_posterior import POINTS, WIDER, _proposal, prepared
from bicycle.identification.decay_window import SHARES, window
from bicycle.identification.free_decay import identify
from bicycle.identification.recording import read_run
from bicycle.identification.run import Run

MODES = np.array([[-0.8, 4.5]])
NEAR = np.array([[[-0.7, 4.6]], [[-0.9, 4.4]]])  # points at which it is asked for
RATES = np.array([1.3, 0.9])


@pytest.fixture
def seen():
    rng, t = np.random.default_rng(3), np.arange(0, 2.0, 0.05)
    wave = np.exp(complex(*MODES[0]) * t)
    channels = {
        "roll_rate_rad_s": wave.real + 0.2 * np.exp(-1.2 * t) + 0.05 * rng.standard_normal(t.size),
        "steer_rad": ((0.4 - 0.3j) * wave).real + 0.1 + 0.03 * rng.standard_normal(t.size),
    }
    return window(Run("r.csv", 5.0, t, channels, {}), 0.0, 10.0)


def dense(y, covariance, design, prior):
    whole = covariance + design @ prior @ design.T
    sign, logdet = np.linalg.slogdet(whole)
    assert sign > 0
    left = y @ np.linalg.solve(whole, y)
    return gammaln(y.size / 2) - 0.5 * (y.size * np.log(np.pi * left) + logdet)


def designs(w, drift, rates):
    """Columns (n, h) at each point, and the prior covariance of their amplitudes in units of the signal, by channel."""
    waves = basis(NEAR, w.time, rates)
    sizes = module.KINDS[drift]
    kept = len(sizes)
    for k in range(len(NEAR)):
        own = waves[k].T @ waves[k] / len(w.time)
        blocks = [np.linalg.inv(own[:2, :2]) * module.AMPLITUDE**2]
        blocks += [[[module.REAL**2 / own[2, 2]]]] if rates is not None else []
        level = np.maximum(1.0, np.abs(w.signals.mean(0)))
        priors = [
            block_diag(*blocks, *[[[(sd * (size if not j else 1)) ** 2]] for j, sd in enumerate(sizes)])
            for size in level
        ]
        yield np.hstack([waves[k], w.drift[:, :kept]]), priors


CASES = pytest.mark.parametrize(
    ("drift", "rates"),
    [
        ("none", None),
        ("parabola", None),
        ("parabola/10", None),
        ("exponential", RATES),
        ("parabola-exponential/3", RATES),
    ],
)


@CASES
def test_noise_of_the_sensors(seen, drift, rates):
    noise = noise_floor(seen, MODES)
    found = Evidence(seen, drift, noise).log(NEAR, rates)
    for k, (design, priors) in enumerate(designs(seen, drift, rates)):
        total = 0.0
        for channel, prior in enumerate(priors):
            y, own, lags = seen.signals[:, channel], prior / noise[channel] ** 2, np.arange(len(seen.time))
            each = [dense(y, toeplitz(phi**lags), design, own) for phi in seen.colours]
            total += np.log(np.mean(np.exp(np.array(each) - max(each)))) + max(each)
        assert found[k] == pytest.approx(total, abs=1e-6)


@pytest.mark.parametrize("drift", ["none", "constant", "parabola"])
def test_a_drift_and_noise_without_any_mode(seen, drift):
    """What the odds for an oscillation are taken against."""
    noise, kept = noise_floor(seen, MODES), len(module.KINDS[drift])
    total = 0.0
    for channel, y in enumerate(seen.signals.T):
        level = max(1.0, abs(y.mean()))
        sizes = [(sd * (1 if j else level) / noise[channel]) ** 2 for j, sd in enumerate(module.KINDS[drift])]
        lags, design = np.arange(len(seen.time)), seen.drift[:, :kept]
        each = [dense(y, toeplitz(phi**lags), design, np.diag(sizes)) for phi in seen.colours]
        total += np.log(np.mean(np.exp(np.array(each) - max(each)))) + max(each)
    assert Evidence(seen, drift, noise).log(np.empty((1, 0, 2)))[0] == pytest.approx(total, abs=1e-6)


@CASES
@pytest.mark.parametrize("phase", [0.0, 2.0])
def test_modes_that_the_ground_drives(seen, drift, rates, phase):
    """One disturbance moves all channels by the phasors of the mode: a covariance of all samples at once."""
    noise, shaken = noise_floor(seen, MODES), Driving.of(seen, MODES).at([phase])
    n, channels = seen.signals.shape
    solved = Evidence(seen, drift, noise, shaken).solved(NEAR, rates)
    own, shared = solved.own, solved.driven
    whole = np.hstack([basis(MODES[None], seen.time)[0], seen.drift])
    phasors = np.linalg.lstsq(whole, seen.signals, rcond=None)[0][:2].T @ [1, -1j]
    size = np.mean(np.exp(2 * MODES[0, 0] * seen.time))
    lag = seen.time[:, None] - seen.time
    root = complex(*MODES[0])
    later = np.exp(root * np.abs(lag))  # dz = root z dt + g dw: covariances of z with conj(z) and with z
    squeezed = -root.real / abs(root) * np.exp(1j * phase)

    def between(a, b):
        forward = (a * b.conjugate() * later + a * b * squeezed * later).real / 2
        back = (b * a.conjugate() * later + a * b * squeezed * later).real / 2
        return np.where(lag >= 0, forward, back) * size

    blocks = [[between(a, b) for b in phasors] for a in phasors]
    white = np.diag(np.repeat(shaken.level**2, n))
    constant = (channels - 1) / 2 * np.log(np.pi / n) - channels * np.log(len(seen.colours)) - np.log(len(SHARES))
    for k, (design, priors) in enumerate(designs(seen, drift, rates)):
        for number, share in enumerate(SHARES):
            y, x = seen.signals.T.ravel(), np.kron(np.eye(channels), design)
            expected = dense(y, white + share**2 * np.block(blocks), x, block_diag(*priors)) + constant
            assert shared.log[k, number] == pytest.approx(
                expected, abs=0.02
            )  # directions that do next to nothing are left out
    total = log_sum(np.swapaxes(own.log, 0, 1)).sum(-1)
    both = np.logaddexp(total, log_sum(shared.log.T)) - np.log(2)
    assert Evidence(seen, drift, noise, shaken).log(NEAR, rates) == pytest.approx(both)


def test_whether_something_drives_the_motion_may_be_told(seen):
    """Told yes: driven noise alone, its level even, not its logarithm. Told no: none. Else from even odds."""
    noise = noise_floor(seen, MODES)
    told = replace(seen, driven=SHARES / SHARES.sum())
    opened, sure = (Evidence(w, "none", noise, Driving.of(w, MODES).at([0.0])).solved(NEAR) for w in (seen, told))
    even = np.log(SHARES / SHARES.sum()) - np.log(1 / len(SHARES))
    assert sure.driven.log == pytest.approx(opened.driven.log + even)
    assert sure.log() == pytest.approx(log_sum(sure.driven.log.T))
    assert sure.chances_driven().sum(1) == pytest.approx([1, 1])
    odds = np.exp(log_sum(opened.driven.log.T) - log_sum(np.swapaxes(opened.own.log, 0, 1)).sum(-1))
    assert opened.chances_driven().sum(1) == pytest.approx(odds / (1 + odds))
    assert prepared(replace(seen, driven=0 * SHARES), MODES[0][None])[0].driven is None


def test_driven_modes_of_many_cycles_are_circular_and_those_of_few_are_not():
    """Paths of long windows against the covariance of dz = root z dt + g dw: of its circular part, or of both.

    They are straight between 16 or 4 places a cycle.
    """
    for root, length in ((complex(-0.3, 12.0), 15.0), (complex(-0.6, 4.0), 4.0)):
        t = np.linspace(0, length, 400)
        assert t.size > decay_noise.NODES
        paths = decay_noise._paths(t, root, 1.0, 1e6)
        later = np.exp(root * np.abs(t[:, None] - t))
        circular = np.where(t[:, None] >= t, later, later.conj())  # E z(t) conj(z(u))
        assert np.abs(paths @ paths.conj().T - circular).max() < 0.05
        turned = paths @ paths.T  # E z(t) z(u)
        few = root.imag * length < 2 * np.pi * 15
        assert np.abs(turned - few * -root.real / abs(root) * later).max() < 0.05


def test_of_two_maxima_a_slow_and_a_quick_real_mode_the_higher_is_found():
    """The quick one is three nats higher; from the best start alone the slow one was found, four sd from it."""
    run = read_run(Path(__file__).with_name("growing_weave.csv"), 4.15)
    found = identify(run, drift="exponential", thorough=False).estimate.best
    best = found.evidence.log(found.best[None], found.best_rate)[0]
    for rate in (0.16, 0.3, 0.6, 1.0, 1.4, 1.8, 2.4):

        def minus_log(x, rate=rate):
            return -found.evidence.log(x[None, None], np.array([rate]))[0]

        other = minimize(minus_log, [0.72, 1.86], method="Nelder-Mead", options={"xatol": 1e-5, "fatol": 1e-4})
        assert best > -other.fun - 0.01


@pytest.mark.parametrize("push", [np.array([0.0, 1.0]), np.array([0.4, -1.3])])
def test_the_covariance_of_driven_modes_is_that_of_their_stochastic_equation(push):
    """x' = A x + G w: covariance of x by scipy's solution of Lyapunov's equation, seen by two channels."""
    root, t = complex(-1.2, 5.0), np.arange(0, 1.5, 0.05)
    a = np.array([[0.0, 1.0], [-(abs(root) ** 2), 2 * root.real]])
    stationary = solve_continuous_lyapunov(a, -np.outer(push, push))
    values, left = np.linalg.eig(a.T)
    row = left[:, np.argmin(np.abs(values - root))]  # z = row x has z' = root z + row G w
    _, right = np.linalg.eig(a)
    column = right[:, np.argmin(np.abs(np.linalg.eigvals(a) - root))]
    column = 2 * column / (row @ column)  # x = Re(column z)
    strength = float((row @ stationary @ row.conj()).real)
    phase = float(np.angle(row @ stationary @ row))
    paths = decay_noise._paths(t, root, 1.0, 1e6) * np.sqrt(strength)
    shown = np.concatenate([(c * paths * np.exp(0.5j * phase)).real for c in column])
    moved = [[step(a, one, other, stationary) for other in t] for one in t]
    expected = np.array(moved).transpose(2, 0, 3, 1).reshape(shown.shape[0], -1)
    scale = np.sqrt(np.outer(*2 * [np.repeat(np.diag(stationary), len(t))]))
    assert shown @ shown.T / scale == pytest.approx(expected / scale, abs=1e-6)


def step(a, one, other, stationary):
    """E x(one) x(other)'."""
    if one >= other:
        return expm(a * (one - other)) @ stationary
    return stationary @ expm(a.T * (other - one))


@pytest.mark.parametrize(("size", "points"), [(2, POINTS), (3, 2 * POINTS), (4, 4 * POINTS)])
def test_the_points_give_a_normal_distribution_its_own_standard_deviation(size, points):
    """95 % intervals in many directions through unit normals of as many dimensions, by the weights of the points."""
    z, density = _proposal(size, points)
    x = WIDER * z
    weights = np.exp(-0.5 * (x**2).sum(1) - density)
    weights /= weights.sum()
    directions = np.random.default_rng(3).standard_normal((300, size))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ends = np.array([_quantiles(x @ u, weights) for u in directions])
    sd = (ends[:, 1] - ends[:, 0]) / (2 * norm.ppf(0.975))
    assert abs(sd.mean() - 1) < 0.02
    assert sd.std() < 0.05
    assert abs(ends.mean()) < 0.05
