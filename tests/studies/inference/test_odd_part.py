"""Parts of one line, of which one was measured at another level (synthetic): the odd one is singled out."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import Candidate, ForwardModel, Rows, UncertainParameter, judge
from studies.inference.contradiction import parts_against_rest
from studies.inference.joint import JointForward, Part
from studies.inference.odd_part import WithoutOne, _order, fits, odd_ones
from studies.missing_effect.reporting.findings import Findings, _without
from studies.missing_effect.reporting.sentences import first_lines, odd_note, parts_lines

N, SD = 40, 0.1
LEVEL = UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0)
SLOPE = Candidate("slope", (UncertainParameter("size", "1", {"slope": 1.0}, 0.0, 1.0, size=True),))


@dataclass(frozen=True)
class Line(ForwardModel):
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
    """The joint verdict of some ``parts``, and what is found about them."""
    judged = judge(JointForward(parts))
    against = parts_against_rest(judged.forward, judged.final)
    without = _without(judged, against)
    return judged, Findings((), (), (), (), (), parts=against, without=without, joint_fits=fits(judged.verdict))


THREE = part("near", 1), part("other", 2, level=0.9), part("far", 3, low=1.0)


@pytest.fixture(scope="module")
def three():
    return found(*THREE)


def test_the_part_without_which_everything_else_fits_is_the_first(three):
    """The slope of the others is that of one straight line through their points, by the normal equations."""
    judged, findings = three
    assert judged.verdict.goodness_of_fit_p < 1e-9
    assert [one.part for one in findings.odd] == ["other"]
    assert next(iter(findings.without)) == findings.ranked[0].part == "other"
    assert set(findings.without) == {"near", "other", "far"}
    assert not any(fits(findings.without[name].rest) for name in ("near", "far"))
    x, y = (np.concatenate([getattr(p.forward, of) for p in (THREE[0], THREE[2])]) for of in "xy")
    columns = np.stack([np.ones(2 * N), x], 1) / SD
    _, slope = np.linalg.solve(columns.T @ columns + np.eye(2), columns.T @ (y / SD))
    (effect,) = findings.odd[0].rest.effects
    assert effect.parameters["size"][0] == pytest.approx(slope, rel=1e-4)


def test_it_is_said_before_anything_else_and_what_the_part_says_by_itself(three):
    judged, findings = three
    first, second, *others = first_lines(SimpleNamespace(**vars(judged)), findings, "")
    assert first.startswith(f"Without other everything else fits ({2 * N} of {3 * N} numbers): named: slope (size ")
    assert " other does not fit with that, though it fits by itself: named: slope (size " in first
    assert "Was other measured in another set-up" in first
    assert second == f"all parts together: unknown: {judged.verdict.sentence}"  # nothing is hidden
    assert others[0].startswith("All parts together do not fit (p < 1e-99): how far ")
    assert "does not say which one is the odd one" in others[0]
    assert others[1].startswith("other contradicts the rest by ")
    p = findings.odd[0].rest.goodness_of_fit_p
    assert others[1].endswith(f"without it: everything else fits (p = {p:.2g}), see the first line.")
    assert {line.split()[0] for line in others[2:4]} == {"near", "far"}


def test_a_part_that_does_not_fit_by_itself_either_is_told_so():
    judged, findings = found(THREE[0], part("bent", 2, level=0.9, kink=0.5), THREE[2])
    assert "bent does not fit with that, nor does it fit by itself: unknown" in odd_note(judged, findings)


def test_of_two_parts_that_each_fit_neither_is_singled_out():
    judged, findings = found(*THREE[:2])
    said = odd_note(judged, findings)
    assert {one.part for one in findings.odd} == {"near", "other"}
    assert [one.alone.verdict for one in findings.odd] == ["named", "named"]
    names = [one.part for one in findings.odd]
    assert f"Without {names[1]} everything else fits, too (40 of 80 numbers): named" in said
    assert f"Which of {names[0]} and {names[1]} is the odd one these data do not say" in said
    assert "by itself" not in said  # of two, one by itself is what is left without the other


def test_parts_that_fit_together_accuse_none():
    judged, findings = found(*THREE[::2])
    assert (findings.joint_fits, findings.without, odd_note(judged, findings)) == (True, {}, "")
    assert first_lines(judged, findings, "")[0].startswith("named: slope")
    assert parts_lines(judged, findings) == ["Beside slope no part contradicts the others."]


def test_a_clear_verdict_comes_before_a_better_fit_and_what_no_number_tells_by_what_remains():
    def one(name, word, p, chi2):
        return WithoutOne(name, SimpleNamespace(verdict=word, goodness_of_fit_p=p, chi2=chi2))

    left = {"final": 50.0, "penalty": 0.0, "n": 10}
    every = [
        one("a", "unknown", 0.0, left), one("b", "tentative", 0.5, left), one("c", "none", 0.02, left),
        one("d", "unknown", 0.0, left | {"final": 30.0, "penalty": 10.0}), one("e", "named", 0.01, left),
    ]  # fmt: skip
    assert [w.part for w in sorted(every, key=_order)] == ["c", "b", "e", "d", "a"]
    assert [w.part for w in odd_ones({w.part: w for w in every})] == ["c"]
