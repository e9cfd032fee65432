"""Fits that converge or say so, compared across nested hypotheses; on forward models of a line or two (synthetic)."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from studies import inference

X = np.linspace(0.0, 1.0, 30)
LEVEL = inference.UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0)


def candidate(name, **rest):
    return inference.Candidate(
        name, (inference.UncertainParameter("size", "1", {name: 1.0}, 0.0, 1.0, size=True, **rest),)
    )


@dataclass(frozen=True)
class Waves(inference.Kind):
    """data = level + size x, for each candidate; ``broken`` is no number."""

    readings: np.ndarray
    candidates: tuple
    varied: bool = True
    nuisances: tuple = (LEVEL,)
    rows: inference.Rows = field(default_factory=lambda: inference.Rows(("x",) * 30, X, ("x",) * 30, np.arange(30) % 5))

    def residual(self, candidates, theta, *, slopes=True):
        computed, columns = np.full(30, theta[0]), [np.ones(30)]
        for c, size in zip(candidates, theta[1:], strict=True):
            if c.identifier == "broken":
                return np.full(30, np.nan), np.full((30, len(theta)), np.nan)
            computed = computed + size * X
            columns.append(X)
        return (self.readings - computed) / 0.1, -np.stack(columns, 1) / 0.1


def data(size, *, seed=2):
    return 0.3 + size * X + 0.1 * np.random.default_rng(seed).standard_normal(30)


def test_a_fit_that_is_no_number_is_said_and_never_judged():
    verdict = inference.judge(Waves(data(0.8), (candidate("slope"), candidate("broken")))).verdict
    assert (verdict.verdict, verdict.equivalent) == ("named", ("slope",))
    assert verdict.posterior["broken"] == 0.0
    assert any("not judged, as not computable: broken" in w for w in verdict.warnings)
    (said,) = (w for w in verdict.warnings if "not computable" in w)
    assert "broken (no finite number for 30 of 30, the first in " in said


def test_what_absorbs_much_is_tried_only_where_nothing_else_explains():
    slope, gusts = candidate("slope"), replace(candidate("gusts"), absorbs=True)  # of one shape: else a class
    assert inference.judge(Waves(data(0.8), (gusts,))).verdict.equivalent == ("gusts",)
    assert inference.judge(Waves(data(0.8), (slope, gusts))).verdict.equivalent == ("slope",)


@dataclass(frozen=True)
class ManyReadings(inference.Kind):
    """Readings of a level alone, sd 1 (synthetic): so many that a fit is dear."""

    readings: np.ndarray
    candidates: tuple = ()
    nuisances: tuple = (LEVEL,)

    @property
    def rows(self):
        n = len(self.readings)
        return inference.Rows(("x",) * n, np.arange(n) % 5.0, ("x",) * n, np.arange(n) % 5)

    def residual(self, candidates, theta, *, slopes=True):
        n = len(self.readings)
        return self.readings - theta[0], np.full((n, 1), -1.0) if slopes else np.empty((n, 0))


@pytest.mark.parametrize(("level", "verdict"), [(0.5, "none"), (50.0, "unknown")])
def test_much_data_are_judged_though_the_library_is_empty(level, verdict):
    """All effects may be left out by request; 50 is that many prior sd from the level that is stated."""
    readings = level + np.random.default_rng(4).standard_normal(8_001)
    kind = ManyReadings(readings * (1.0 if verdict == "none" else np.linspace(0.5, 1.5, 8_001)))
    assert kind.costly
    found = inference.judge(kind)
    assert found.verdict.verdict == verdict
    assert found.hypotheses.required_decrease == pytest.approx(2 * math.log(40))  # of one rival, odds of 20


@pytest.mark.parametrize("n", [8_000, 8_001])
def test_more_than_8_000_numbers_are_much(n):
    """As docs/measurement_files.md says."""
    rows = inference.Rows(("x",) * n, np.zeros(n), ("x",) * n, np.zeros(n, int))
    assert replace(Waves(data(0.8), ()), rows=rows).costly == (n > 8_000)


def test_one_condition_is_no_evidence_for_a_name():
    verdict = inference.judge(Waves(data(0.8), (candidate("slope"),), varied=False)).verdict
    assert (verdict.verdict, verdict.effects) == ("unknown", ())
    assert ("varied", "one") in [(c.rule, c.figure) for c in verdict.failed]


def test_what_is_too_small_to_matter_is_not_named():
    assert inference.judge(Waves(data(0.8), (candidate("slope", least=0.5),))).verdict.equivalent == ("slope",)
    small = inference.judge(Waves(data(0.8), (candidate("slope", least=1.5),))).verdict
    assert (small.verdict, small.effects) == ("unknown", ())
    assert ("matters", "slope", False) in [(c.rule, c.figure, c.passed) for c in small.checks]
    assert small.refused_leaders[0][0] == "slope"


@pytest.mark.parametrize(("smallest", "word"), [(0.6, "named"), (1.2, "unknown")])
def test_what_is_surely_smaller_than_what_occurs_is_not_named(smallest, word):
    """The size is found as 0.8 with an sd of 0.06."""
    verdict = inference.judge(Waves(data(0.8), (candidate("slope", smallest=smallest),))).verdict
    assert verdict.verdict == word
    (check,) = (c for c in verdict.checks if c.rule == "occurs")
    assert (check.figure, check.passed) == (("yes", True) if word == "named" else ("slope.size", False))


@pytest.mark.parametrize("size", [5.0, 8.0])
def test_an_unusual_size_that_explains_the_data_is_tentative_and_not_shrunk(size):
    """Beyond three prior sd; the prior of what seldom occurs is five times as wide, so it pulls little."""
    verdict = inference.judge(Waves(data(size), (candidate("slope"),))).verdict
    assert verdict.verdict == "tentative"
    value, sd = verdict.effects[0].parameters["size"]
    columns = np.stack([np.ones(30), X], 1) / 0.1
    precision = columns.T @ columns + np.diag([1.0, 1 / 25])  # textbook normal equations
    expected = np.linalg.solve(precision, columns.T @ data(size) / 0.1)[1]
    assert (value, sd) == pytest.approx((expected, math.sqrt(np.linalg.inv(precision)[1, 1])), rel=1e-3)


def test_a_larger_hypothesis_never_fits_worse():
    waves = Waves(data(0.0), tuple(map(candidate, ("slope", "other"))))
    known = inference.fit_singles(waves, lambda what: None)
    for f in known.fits:
        assert f.objective <= known.null.objective + 1e-3


@dataclass(frozen=True)
class Winding(Waves):
    """The truth is 3 sd away, and the way there is a narrow winding valley: size = 2 sin(6 level)."""

    thorough: bool = False

    def residual(self, candidates, theta, *, slopes=True):
        rows, jacobian = np.zeros(30), np.zeros((30, len(theta)))
        rows[1:], jacobian[1:, 0] = 30 * (theta[0] - 3), 30
        size = theta[1] if candidates else 2.0
        rows[0] = 300 * (size - 2 * np.sin(6 * theta[0]))
        jacobian[0] = 300 * np.array([-12 * np.cos(6 * theta[0]), *np.ones(len(theta) - 1)])
        return rows, jacobian


def test_where_nothing_fits_what_was_given_up_as_poor_is_fitted_to_its_end():
    forward = Winding(data(0.0), (winding := candidate("winding"),))
    assert inference.fit(forward, (winding,), turns=inference.ROUGH).objective > 1e3
    (found,) = inference.fit_singles(forward, lambda what: None).fits
    assert found.converged
    assert found.objective < 100
    assert found.theta == pytest.approx([3.0, 2 * math.sin(18.0)], abs=0.01)


@dataclass(frozen=True)
class Tones(Waves):
    """data = level + sin(8 size x) for "tone", + size x^2 for "other": each size has a minimum near some others."""

    def residual(self, candidates, theta, *, slopes=True):
        computed, columns = np.full(30, theta[0]), [np.ones(30)]
        for c, size in zip(candidates, theta[1:], strict=True):
            tone = c.identifier == "tone"
            computed = computed + (np.sin(8 * size * X) if tone else size * X**2)
            columns.append(8 * X * np.cos(8 * size * X) if tone else X**2)
        return (self.readings - computed) / 0.1, -np.stack(columns, 1) / 0.1


def test_no_effect_is_kept_because_the_rest_stopped_in_a_minimum_of_its_own():
    tone, other = candidate("tone"), candidate("other")
    forward = Tones(data(0.0) + np.sin(8 * 1.5 * X), (tone, other))
    stuck = inference.fit(forward, (tone,), starts=[np.array([0.0, 2.5])])
    pair = inference.fit(forward, (tone, other), starts=[np.array([0.3, 1.5, 0.0])])
    assert stuck.converged
    assert stuck.objective > 100 > pair.objective
    _, leader = inference.drop_unsupported(inference.Hypotheses(inference.fit(forward), (stuck, pair), forward), pair)
    assert leader.name == "tone"
    assert leader.theta[1] == pytest.approx(1.5, abs=0.05)


SHAPES = {"wave": np.sin(12 * X), "square": X**2, "cube": X**3, "quart": X**4}
THREE = ("wave", "square", "cube")


@dataclass(frozen=True)
class Shapes(Waves):
    """data = level + size shape, for each candidate."""

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones(30), *(SHAPES[c.identifier] for c in candidates)], 1)
        return (self.readings - columns @ theta) / 0.1, -columns / 0.1


def quiet(what):
    pass


def test_what_is_far_behind_an_explanation_is_left_as_it_is():
    forward = Shapes(data(0.0) + 2 * SHAPES["wave"], tuple(candidate(name) for name in THREE))
    known = inference.fit_singles(forward, quiet)
    wave, square, cube = known.fits
    assert known.drop_hopeless(known.fits) == [wave]
    unexplained = inference.Hypotheses(known.null, (square, cube), known.kind)
    assert unexplained.drop_hopeless(unexplained.fits) == [square, cube]


def test_a_parent_far_behind_is_enlarged_only_by_what_closes_half_of_the_gap():
    forward = Shapes(data(0.0) + 2 * SHAPES["wave"], tuple(candidate(name) for name in THREE))
    known = inference.fit_singles(forward, quiet)
    wave, square, _ = known.fits
    pair = inference.fit(forward, (forward.candidates[1], forward.candidates[2]))
    assert wave.objective + 100 < pair.objective < square.objective - 4  # it gains, but far from enough
    found = {f.name for f in inference.expand(known, [wave, square], quiet).fits}
    assert "square+cube" not in found
    assert "square+wave" in found
    alone = inference.Hypotheses(known.null, known.fits[1:], known.kind)
    assert "square+cube" in {f.name for f in inference.expand(alone, [square], quiet).fits}


@dataclass(frozen=True)
class Unheard(Shapes):
    """Nobody states the noise: its sd is what a hypothesis leaves."""

    sd: float = 0.1

    def residual(self, candidates, theta, *, slopes=True):
        residual, jacobian = super().residual(candidates, theta, slopes=slopes)
        return 0.1 / self.sd * residual, 0.1 / self.sd * jacobian

    def estimate_noise(self, best):
        return replace(self, sd=self.sd * float(np.sqrt(np.mean(best.residual**2))))


def test_what_a_second_effect_explains_is_not_taken_for_noise():
    """True noise 0.1; what the better single effect leaves is three times as large."""
    truth = data(0.0) + SHAPES["square"] + 0.5 * SHAPES["wave"]
    found = inference.judge(Unheard(truth, (candidate("wave"), candidate("square"))))
    assert (found.verdict.verdict, found.verdict.equivalent) == ("named", ("wave+square",))
    assert found.kind.sd == pytest.approx(0.1, rel=0.25)  # 30 rows: 13 %
    columns = np.stack([np.ones(30), SHAPES["wave"], SHAPES["square"]], 1) / 0.1
    wave, square = np.sqrt(np.linalg.inv(columns.T @ columns + np.eye(3)).diagonal()[1:])  # textbook normal equations
    assert [e.parameters["size"][1] for e in found.verdict.effects] == pytest.approx([wave, square], rel=0.25)


def test_the_most_probable_effect_is_enlarged_where_its_size_seldom_occurs_and_it_does_not_fit_alone():
    """Five prior sd of "square" with a "wave"; two of sizes that occur fit worse, and are enlarged as well."""
    truth = data(0.0) + 5 * SHAPES["square"] + 0.5 * SHAPES["wave"]
    wide = (replace(c, unknowns=(replace(c.unknowns[0], scale=3.0),)) for c in map(candidate, ("cube", "quart")))
    fitted = []
    verdict = inference.judge(
        Shapes(truth, (candidate("wave"), candidate("square"), *wide)), progress=fitted.append
    ).verdict
    assert "square+wave" in fitted
    assert (verdict.verdict, verdict.equivalent) == ("tentative", ("square+wave",))


def test_a_fit_goes_on_where_a_small_promise_was_a_slow_beginning():
    """6.2 of 10009 are to be gained, but the first step promises 0.06: min of (3 - z^2)^2 + z^2 is 2.75."""

    def evaluate(z, *, slopes):
        return np.array([100.0, 3 - z[0] ** 2]), np.array([[0.0], [-2 * z[0]]])

    end = inference.minimise(evaluate, np.array([0.05]), np.full(1, -9.0), np.full(1, 9.0), np.ones(2, bool))
    assert end.converged
    assert end.objective == pytest.approx(10002.75, abs=1e-2)


def test_what_cannot_move_on_has_not_converged():
    """A residual whose derivative is wrong: it promises much and gives nothing."""

    def evaluate(z, *, slopes):
        return np.array([3.0 + z[0] ** 2]), np.array([[-1.0]])

    end = inference.minimise(evaluate, np.zeros(1), np.full(1, -9.0), np.full(1, 9.0), np.ones(1, bool))
    assert not end.converged
    assert inference.fit(Waves(data(0.5), (c := candidate("slope"),)), (c,)).converged


@dataclass(frozen=True)
class Detour(Waves):
    """As much as size (size - 0.5) of a slope: from a small size every step leads to nothing, from a usual one not.

    Others are waves by the number of their periods.
    """

    thorough: bool = False

    def residual(self, candidates, theta, *, slopes=True):
        computed, columns = np.full(30, theta[0]), [np.ones(30)]
        for c, size in zip(candidates, theta[1:], strict=True):
            slope = c.identifier == "slope"
            wave = 4 * X if slope else np.cos(2 * np.pi * float(c.identifier) * X)
            computed = computed + (size * (size - 0.5) if slope else size) * wave
            columns.append((2 * size - 0.5) * wave if slope else wave)
        return (self.readings - computed) / 0.1, -np.stack(columns, 1) / 0.1


def test_an_effect_that_shrank_to_nothing_is_tried_from_a_typical_size_where_nothing_fits():
    slope, waves = candidate("slope", lowest=0.01), [candidate(str(periods)) for periods in range(2, 9)]
    forward = Detour(data(2.0), (slope, *waves))
    small = inference.fit(forward, (slope,), starts=[np.array([0.3, 0.05])])
    assert small.sizes_at_bound() == ["slope.size"]
    found = inference.fit_singles(forward, lambda what: None).find(frozenset({"slope"}))
    assert found.theta[1] == pytest.approx(1.0, abs=0.05)  # 4 (1 - 0.5) = 2


class Excluding(Shapes):
    """Of wave and square one at most."""

    def compatible(self, candidates):
        return not {"wave", "square"} <= {c.identifier for c in candidates}


@pytest.mark.parametrize("astray", [True, False])
def test_an_effect_that_was_lost_alone_takes_the_place_of_one_that_imitates_it(astray):
    """The truth is wave and cube, and wave by itself stopped on the way from parameters that went astray."""
    forward = Excluding(data(0.0) + SHAPES["wave"] + SHAPES["cube"], tuple(candidate(name) for name in THREE))
    known, names = inference.fit_singles(forward, quiet), []
    wave, square, cube = known.fits
    lost = replace(wave, converged=False, objective=1e6, log_evidence=-5e5)
    pair = inference.fit(forward, (square.candidates[0], cube.candidates[0]))
    begun = inference.Hypotheses(replace(known.null, converged=not astray), (lost, square, cube, pair), known.kind)
    found, leader = inference.exchange_effect(begun, pair, names.append)
    if not astray:
        assert (found, leader, names) == (begun, pair, [])
        return
    assert names == ["cube+wave"]
    assert leader.identifiers == {"wave", "cube"}
    assert leader.converged
    assert leader.theta == pytest.approx([0.3, 1.0, 1.0], abs=0.3)


@dataclass(frozen=True)
class Valley(inference.Kind):
    """data = level + u x + steep (v - u^2) x^2 cos 9 x: the sizes u and v lie in a narrow curved valley (synthetic)."""

    readings: np.ndarray
    candidates: tuple
    steep: float = 8_000.0
    varied: bool = True
    nuisances: tuple = (LEVEL,)
    rows: inference.Rows = field(default_factory=lambda: inference.Rows(("x",) * 30, X, ("x",) * 30, np.arange(30) % 5))

    def residual(self, candidates, theta, *, slopes=True):
        computed, columns, across = np.full(30, theta[0]), [np.ones(30)], self.steep * X**2 * np.cos(9 * X)
        for u, v in theta[1:].reshape(-1, 2):
            computed = computed + u * X + across * (v - u**2)
            columns += [X - 2 * u * across, across]
        return (self.readings - computed) / 0.1, -np.stack(columns, 1) / 0.1


@pytest.mark.parametrize("u", [3.0, 4.0, 5.0])
def test_the_most_probable_effect_is_fitted_until_it_converges(u):
    """The first fits of a search end early; what has not converged may not be named."""
    sizes = (("u", 3.0), ("v", 9.0))
    bent = inference.Candidate(
        "bent", tuple(inference.UncertainParameter(k, "1", {k: 1.0}, 0.0, sd, size=True) for k, sd in sizes)
    )
    kind = Valley(0.3 + u * X + 0.1 * np.random.default_rng(1).standard_normal(30), (bent,))
    assert not inference.fit(kind, (bent,), turns=inference.ROUGH).converged
    assert inference.judge(kind).verdict.verdict == "named"
