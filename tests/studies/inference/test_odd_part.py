"""Parts of one line, of which one was measured at another level (synthetic): the odd one is singled out."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import (
    Candidate,
    Joint,
    Kind,
    Part,
    Rows,
    UncertainParameter,
    WithoutOne,
    fits,
    judge,
    parts_against_rest,
    without_each,
)

N, SD = 40, 0.1
LEVEL = UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0)
SLOPE = Candidate("slope", (UncertainParameter("size", "1", {"slope": 1.0}, 0.0, 1.0, size=True),))


@dataclass(frozen=True)
class Line(Kind):
    """y = level + slope x."""

    x: np.ndarray
    y: np.ndarray
    candidates: tuple = (SLOPE,)
    nuisances: tuple = (LEVEL,)

    @property
    def rows(self):
        return Rows(("x",) * N, self.x, ("y",) * N, np.arange(N) % 4)

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones(N), *([self.x] if candidates else [])], 1)
        return (self.y - columns @ theta) / SD, -columns / SD


def part(name, seed, *, level=0.3, kink=0.0, low=0.0):
    x = np.linspace(low, low + 2, N)
    noise = SD * np.random.default_rng(seed).standard_normal(N)
    return Part(name, Line(x, level + 0.8 * x + kink * np.abs(x - low - 1) + noise))


def found(*parts):
    """The joint verdict of some ``parts``, each against the others, and what is said without each."""
    judged = judge(Joint(parts))
    against, together = parts_against_rest(judged.kind, judged.final), fits(judged.verdict)
    names = [p.part for p in against if p.contradicts or not together]
    return judged, {p.part: p for p in against}, without_each(judged.kind, names, single_out=not together)


THREE = part("near", 1), part("other", 2, level=0.9), part("far", 3, low=1.0)


@pytest.fixture(scope="module")
def three():
    return found(*THREE)


def test_the_part_without_which_everything_else_fits_is_the_first(three):
    """The slope of the others is that of one straight line through their points, by the normal equations."""
    judged, against, without = three
    assert judged.verdict.goodness_of_fit_p < 1e-9
    assert [one.part for one in without.values() if one.clear] == ["other"]
    assert against["other"].contradicts
    assert next(iter(without)) == "other"
    assert set(without) == {"near", "other", "far"}
    assert not any(fits(without[name].rest) for name in ("near", "far"))
    x, y = (np.concatenate([getattr(p.kind, of) for p in (THREE[0], THREE[2])]) for of in "xy")
    columns = np.stack([np.ones(2 * N), x], 1) / SD
    _, slope = np.linalg.solve(columns.T @ columns + np.eye(2), columns.T @ (y / SD))
    (effect,) = without["other"].rest.effects
    assert effect.parameters["size"][0] == pytest.approx(slope, rel=1e-4)
    assert fits(without["other"].alone)


def test_a_part_that_does_not_fit_by_itself_either_is_judged_so():
    _, _, without = found(THREE[0], part("bent", 2, level=0.9, kink=0.5), THREE[2])
    assert without["bent"].clear
    assert not fits(without["bent"].alone)


def test_of_two_parts_that_each_fit_neither_is_singled_out():
    _, _, without = found(*THREE[:2])
    assert {one.part for one in without.values() if one.clear} == {"near", "other"}
    assert [one.alone.verdict for one in without.values()] == ["named", "named"]


def test_parts_that_fit_together_accuse_none():
    judged, _, without = found(*THREE[::2])
    assert (fits(judged.verdict), without) == (True, {})


def test_a_clear_verdict_is_one_that_fits_without_a_reservation():
    for word, p, clear in (("named", 0.02, True), ("tentative", 0.5, False), ("named", 0.01, False)):
        assert WithoutOne("a", SimpleNamespace(verdict=word, goodness_of_fit_p=p)).clear is clear
