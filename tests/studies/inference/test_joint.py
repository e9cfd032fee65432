"""Parts of one thing fitted together: lines y = level + slope x seen by instruments of their own (synthetic)."""

import re
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from studies import inference

N = 40
LEVEL = inference.UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0)


def candidate(name, sd=1.0, **rest):
    return inference.Candidate(
        name, (inference.UncertainParameter("size", "1", {name: 1.0}, 0.0, sd, size=True),), **rest
    )


SLOPE, BEND, OFFSET = candidate("slope"), candidate("bend"), candidate("offset", weight=0.5)
SHAPES = {"slope": lambda x: x, "bend": lambda x: x**2, "offset": np.ones_like}


@dataclass(frozen=True)
class Line(inference.Kind):
    """y = level + sizes of the candidates times their shapes, at x."""

    x: np.ndarray
    y: np.ndarray
    sd: float = 0.1
    candidates: tuple = (SLOPE, BEND, OFFSET)
    refused: dict = field(default_factory=dict)
    nuisances: tuple = (LEVEL,)

    @property
    def rows(self):
        n = len(self.x)
        return inference.Rows(("x",) * n, self.x, ("y",) * n, np.arange(n) % 4)

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones_like(self.x), *(SHAPES[c.identifier](self.x) for c in candidates)], 1)
        return (self.y - columns @ theta) / self.sd, -columns / self.sd


def part(name, low, high, *, slope=0.0, offset=0.0, seed=1, **rest):
    x = np.linspace(low, high, N)
    noise = 0.1 * np.random.default_rng(seed).standard_normal(N)
    return inference.Part(name, Line(x, 0.3 + slope * x + offset + noise, **rest), frozenset({"offset"}))


def joint(**second):
    return inference.Joint((part("near", 0, 1, slope=0.8), part("far", 1, 3, slope=0.8, seed=2, **second)))


def test_a_joint_fit_is_the_fit_of_all_rows_at_once():
    """One line through all points, by the normal equations with the prior."""
    forward = joint()
    found = inference.fit(forward, (SLOPE,))
    x = np.concatenate([p.kind.x for p in forward.parts])
    y = np.concatenate([p.kind.y for p in forward.parts])
    columns = np.stack([np.ones_like(x), x], 1) / 0.1
    expected = np.linalg.solve(columns.T @ columns + np.eye(2), columns.T @ (y / 0.1))
    np.testing.assert_allclose(found.theta, expected, rtol=1e-6)
    assert found.penalty == pytest.approx(found.theta @ found.theta)  # both priors are standard normal
    assert len(forward.nuisances) == 1
    np.testing.assert_allclose(found.covariance, np.linalg.inv(columns.T @ columns + np.eye(2)), rtol=1e-6)
    for one in forward.parts:  # information adds up: on a line an interval is nowhere wider than that of a part
        assert (found.covariance.diagonal() < inference.fit(one.kind, (SLOPE,)).covariance.diagonal()).all()


class Dear(Line):
    thorough = False


def test_a_joint_fit_begins_from_as_many_starts_as_its_dearest_part_allows():
    near, far = joint().parts
    dear = replace(far, kind=Dear(far.kind.x, far.kind.y))
    assert [inference.Joint((near, one)).thorough for one in (far, dear)] == [True, False]


def test_an_error_of_one_instrument_is_named_as_its_own_and_moves_no_other():
    verdict = inference.judge(joint(offset=0.5)).verdict
    assert verdict.verdict == "class"  # nobody can say which of two instruments is off
    assert set(verdict.equivalent) == {"slope+far/offset", "slope+near/offset"}
    forward = joint()
    assert [c.identifier for c in forward.candidates] == ["slope", "bend", "near/offset", "far/offset"]
    far = forward.candidates[-1]
    residual, jacobian = forward.residual((far,), np.array([0.0, 0.2]))
    assert not jacobian[forward.slices()[0], 1].any()
    assert (jacobian[forward.slices()[1], 1] != 0).all()
    np.testing.assert_allclose(residual[:N], forward.parts[0].kind.residual((), np.zeros(1))[0])


def test_an_effect_that_one_part_cannot_see_acts_on_the_others_alone():
    forward = joint(candidates=(SLOPE, OFFSET), refused={"bend": "not here"})
    assert forward.refused == {}
    _, jacobian = forward.residual((BEND,), np.array([0.0, 0.2]))
    assert jacobian[:N, 1].any()
    assert not jacobian[N:, 1].any()
    nowhere = inference.Joint((part("a", 0, 1, refused={"bend": "no"}, candidates=(SLOPE,)),))
    assert nowhere.refused == {"bend": "no"}


def test_an_effect_that_another_one_makes_possible_acts_on_the_part(monkeypatch):
    """A bend is refused alone and possible beside a slope."""
    forward = joint(candidates=(SLOPE, OFFSET), refused={"bend": "needs a slope"})
    monkeypatch.setattr(
        Line, "enabled_by", lambda self, kept: (BEND,) if self.refused and SLOPE in kept else (), raising=False
    )
    assert [c.identifier for c in forward.restrict_to_part(1, (SLOPE, BEND))[0]] == ["slope", "bend"]
    assert [c.identifier for c in forward.restrict_to_part(1, (BEND,))[0]] == []
    assert [c.identifier for c in forward.enabled_by((SLOPE,))] == ["bend"]


def test_parts_of_two_things_share_what_is_common_and_nothing_else():
    """Another thing has a level of its own and the slope of the first: 0.3 and 1.3 beside 0.8."""
    one, two = part("one", 0, 1, slope=0.8), part("two", 1, 3, slope=0.8, offset=1.0, seed=2)
    other = inference.Part("two", two.kind, two.own, "thing", frozenset({"slope"}))
    forward = inference.Joint((one, other))
    assert [u.name for u in forward.nuisances] == ["level", "thing/level"]
    names = [c.identifier for c in forward.candidates]
    assert names == ["slope", "bend", "one/offset", "thing/bend", "two/offset"]
    found = inference.fit(forward, (SLOPE,))
    assert found.theta[0] == pytest.approx(0.3, abs=0.15)
    assert found.theta[1] == pytest.approx(1.3, abs=0.15)
    assert found.theta[2] == pytest.approx(0.8, abs=0.1)
    bend = forward.candidates[3]
    assert bend.unknowns[0].sets == {"thing/bend": 1.0}  # never a number of the first thing
    _, jacobian = forward.residual((bend,), np.array([0.3, 1.3, 0.1]))
    assert not jacobian[:N, 2].any()
    assert jacobian[N:, 2].any()
    with pytest.raises(ValueError, match="give each a name"):
        inference.Joint((one, inference.Part("two", two.kind, thing="one")))


def test_what_was_said_of_the_whole_stays_when_its_noise_is_refined():
    forward = inference.Joint(joint().parts, joint_notes=("of two things",))
    assert forward.notes[0] == "of two things"
    assert forward.estimate_noise(inference.fit(forward)) is forward


def test_what_is_not_tried_is_not_tried_in_a_part_of_the_data_either(monkeypatch):
    monkeypatch.setattr(Line, "simplify", lambda self: replace(self, x=self.x[::2], y=self.y[::2]))
    forward = joint()
    assert [c.identifier for c in forward.with_candidates(forward.candidates[:1]).simplify().candidates] == ["slope"]


def test_rows_are_told_apart_by_their_part_and_folds_are_of_one_part():
    rows = joint().rows
    assert rows.places[0] == "near: x"
    assert rows.show("far: y").channel == "far: y"
    assert set(rows.fold[:N]).isdisjoint(rows.fold[N:])


class OnePlace(Line):
    """A part that looks at one place, which alone is no reason for a name."""

    varied = False


@pytest.mark.parametrize(("near", "far", "varied"), [(100.0, 102.0, False), (100.0, 110.0, True), (0.01, 0.012, True)])
def test_parts_look_at_different_things_where_their_places_differ_by_more_than_a_twentieth(near, far, varied):
    """Each looks at one place; it is the share that counts, not the unit."""
    parts = [inference.Part(f"at {x:g}", OnePlace(np.full(N, x), np.zeros(N))) for x in (near, far)]
    assert inference.Joint(tuple(parts)).varied is varied


def test_parts_that_agree_do_not_contradict_and_one_that_does_not_is_found():
    """The far part has another slope: 0.8 and 1.1, with sd of 0.05 and 0.03."""
    same = inference.parts_against_rest(joint(), inference.fit(joint(), (SLOPE,)))
    assert not any(p.contradicts for p in same)
    other = inference.Joint((part("near", 0, 1, slope=0.8), part("far", 1, 3, slope=1.2, seed=2)))
    found = {p.part: p for p in inference.parts_against_rest(other, inference.fit(other, (SLOPE,)))}
    assert found["far"].contradicts
    assert found["far"].sd > 3
    (slope,) = found["far"].effects
    assert slope.own == pytest.approx(1.2, abs=0.15)
    assert slope.rest == pytest.approx(0.8, abs=0.25)
    assert slope.difference > 2


def test_false_contradictions_are_as_rare_as_said():
    """p is uniform where all parts are of one line: 150 draws, 5 sd of a binomial about 10 %."""
    values = []
    for seed in range(150):
        forward = inference.Joint(
            (part("a", 0, 1, slope=0.8, seed=[seed, 1]), part("b", 1, 3, slope=0.8, seed=[seed, 2]))
        )
        found = inference.fit(forward, (SLOPE,))
        values.append(inference.disagreement(found, forward.slices()[1])[0])
    assert np.mean(np.array(values) < 0.1) == pytest.approx(0.1, abs=5 * np.sqrt(0.09 / 150))


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ((), "give each a name"),
        ((part("a", 0, 1), part("a", 0, 1)), "give each a name"),
        (
            (part("a", 0, 1), part("b", 0, 1, nuisances=(inference.UncertainParameter("level", "1", {}, 0.0, 2.0),))),
            r"b: level = 0 \+- 2, in another part 0 \+- 1; one thing has one prior",
        ),
    ],
)
def test_parts_that_make_no_whole_are_refused(parts, words):
    with pytest.raises(ValueError, match=words):
        inference.Joint(parts)


@pytest.mark.parametrize("known", [0.95, 1.05])
def test_what_the_others_hardly_know_counts_as_the_least_that_the_docstring_says(known):
    """Two unknowns of posterior sd 1; of the second the others know ``known`` times that least, the part the rest.

    By the others alone the second is c / a farther off, of variance 1 + (1 - a) / a, where c is what the part leaves.
    """
    (least,) = map(float, re.findall(r"at least (\S+) as well as the best", inference.disagreement.__doc__))
    own, left = 1 - known * least, 1e-5
    joint = SimpleNamespace(jacobian=np.array([[0.0, np.sqrt(own)]]), residual=np.array([left]), covariance=np.eye(2))
    p, sd = inference.disagreement(joint, slice(0, 1))
    counted = max(known, 1.0) * least
    assert sd == pytest.approx(left * np.sqrt(1 + own / counted), rel=1e-6)
    assert p == pytest.approx(2 * norm.sf(sd), rel=1e-6)


def test_a_nuisance_of_another_thing_sets_the_numbers_of_that_thing_alone():
    """Two bicycles: the mass of the second is never set on the first, and that of an instrument stays its part's."""
    one = part("one", 0, 1)
    other = replace(part("other", 0, 1), thing="second")
    shared = replace(other, common=frozenset({"level"}))
    gauge = replace(one, own=frozenset({"level"}))
    found = {name: p.nuisance(LEVEL) for name, p in (("one", one), ("other", other), ("shared", shared),
                                                     ("gauge", gauge))}  # fmt: skip
    assert {name: (u.name, set(u.sets)) for name, u in found.items()} == {
        "one": ("level", {"level"}),
        "other": ("second/level", {"second/level"}),
        "shared": ("level", {"level"}),
        "gauge": ("one/level", {"level"}),
    }
    assert all((u.centre, u.scale) == (LEVEL.centre, LEVEL.scale) for u in found.values())


def test_what_did_not_converge_is_not_named():
    kind = part("a", 0, 2, slope=1.0).kind
    found = inference.judge(replace(kind, candidates=(SLOPE, BEND)))
    assert inference.accept(found.hypotheses, found.final).verdict == found.verdict.verdict == "named"
    refused = inference.accept(found.hypotheses, replace(found.final, converged=False))
    assert refused.verdict == "unknown"
    assert refused.final.candidates == ()
    assert [(check.passed, check.figure) for check in refused.checks if check.rule == "converged"] == [(False, "no")]


# ---- the odd one: a part of the line was measured at another level


def long(name, seed, *, level=0.3, kink=0.0, low=0.0):
    """A part of the line 0.8 x over an interval of 2, of which slope and level are all that is asked."""
    made = part(name, low, low + 2, slope=0.8, offset=level - 0.3, seed=seed, candidates=(SLOPE,))
    bent = made.kind.y + kink * np.abs(made.kind.x - low - 1)
    return inference.Part(name, replace(made.kind, y=bent))


def told(*parts):
    """The joint verdict of some ``parts``, each against the others, and what is said without each."""
    judged = inference.judge(inference.Joint(parts))
    against, together = inference.parts_against_rest(judged.kind, judged.final), inference.fits(judged.verdict)
    names = [p.part for p in against if p.contradicts or not together]
    return judged, {p.part: p for p in against}, inference.without_each(judged.kind, names, single_out=not together)


THREE = long("near", 1), long("other", 2, level=0.9), long("far", 3, low=1.0)


@pytest.fixture(scope="module")
def three():
    return told(*THREE)


def test_the_part_without_which_everything_else_fits_is_the_first(three):
    """The slope of the others is that of one straight line through their points, by the normal equations."""
    judged, against, without = three
    assert judged.verdict.goodness_of_fit_p < 1e-9
    assert [one.part for one in without.values() if one.clear] == ["other"]
    assert against["other"].contradicts
    assert next(iter(without)) == "other"
    assert set(without) == {"near", "other", "far"}
    assert not any(inference.fits(without[name].rest) for name in ("near", "far"))
    x, y = (np.concatenate([getattr(p.kind, of) for p in (THREE[0], THREE[2])]) for of in "xy")
    columns = np.stack([np.ones(2 * N), x], 1) / 0.1
    _, slope = np.linalg.solve(columns.T @ columns + np.eye(2), columns.T @ (y / 0.1))
    (effect,) = without["other"].rest.effects
    assert effect.parameters["size"][0] == pytest.approx(slope, rel=1e-4)
    assert inference.fits(without["other"].alone)


def test_a_part_that_does_not_fit_by_itself_either_is_judged_so():
    _, _, without = told(THREE[0], long("bent", 2, level=0.9, kink=0.5), THREE[2])
    assert without["bent"].clear
    assert not inference.fits(without["bent"].alone)


def test_of_two_parts_that_each_fit_neither_is_singled_out():
    _, _, without = told(*THREE[:2])
    assert {one.part for one in without.values() if one.clear} == {"near", "other"}
    assert [one.alone.verdict for one in without.values()] == ["named", "named"]


def test_parts_that_fit_together_accuse_none():
    judged, _, without = told(*THREE[::2])
    assert (inference.fits(judged.verdict), without) == (True, {})


def test_a_clear_verdict_is_one_that_fits_without_a_reservation():
    for word, p, clear in (("named", 0.02, True), ("tentative", 0.5, False), ("named", 0.01, False)):
        assert inference.WithoutOne("a", SimpleNamespace(verdict=word, goodness_of_fit_p=p)).clear is clear
