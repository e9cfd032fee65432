"""Reasons for the place of a hypothesis, on hypotheses with their posteriors and held-out scores given."""

import math
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import Candidate, Hypotheses, UncertainParameter, equivalents, held_back, rule_against


class Hypothesis:
    """A hypothesis of effects called by one letter each; the null has none."""

    converged = admissible = physical = True
    unusual, objective = 0, 0.0
    at_bound = negligible = implausible = list

    def __init__(self, name):
        self.name, self.identifiers = name, frozenset(name)
        self.candidates = tuple(Candidate(c, ()) for c in name)


class Scored:
    """Hypotheses with their log posteriors and held-out scores, by name."""

    kind, odds = None, Hypotheses.odds

    def __init__(self, monkeypatch, told, *, possible=True, fits=0.5, white=0.5):
        self.made = {name: Hypothesis(name) for name in told}
        self.null, self.fits = self.made[""], [f for name, f in self.made.items() if name]
        self.log_posterior = lambda f: math.log(told[f.name][0])

        def score(_, f):
            return SimpleNamespace(log_score=told[f.name][1], possible=possible)

        monkeypatch.setattr(import_module("studies.inference.search"), "held_out", score)
        for f in self.made.values():
            f.goodness, f.fits_data = fits, fits > 0.01
        monkeypatch.setattr(import_module("studies.inference.search"), "whiteness", lambda *_: white)

    def find(self, identifiers):
        return next((f for f in self.made.values() if f.identifiers == identifiers), None)


WORSE = {"": (1e-9, -90.0), "a": (1.0, -50.0), "b": (1e-6, -80.0)}  # posterior, held-out score


@pytest.mark.parametrize(
    ("larger", "named", "unnamed", "why"),
    [
        ((7.0, -10.0), "more, not clear", "likelier than judged", "not clear"),
        ((3e35, -50.0), "more", "likelier than judged", "no gain"),
        ((3e35, -49.0), "more", "likelier than judged", "elsewhere"),
    ],
)
def test_of_two_reasons_the_one_that_holds_is_given(larger, named, unnamed, why, monkeypatch):
    """Of a hypothesis ab beside a, which is named or was judged and is not."""
    known = Scored(monkeypatch, WORSE | {"ab": larger})
    for final, key in (("a", named), ("", unnamed)):
        acceptance = SimpleNamespace(leader=known.made["a"], final=known.made[final], checks=(), members={})
        rule = rule_against(known, acceptance, known.made["ab"])
        assert rule.key == key
        assert rule.numbers["odds"] == pytest.approx(larger[0])
        assert f"{larger[0]:.2g}" in str(rule)
        assert key == "more, not clear" or rule.numbers["why"].key == why


@pytest.mark.parametrize(
    ("sizes", "odds", "key"),
    [(["b.x", "c.y"], 3e35, "two unusual"), ([], 3e35, "likelier than judged"), ([], 0.5, "another judged")],
)
def test_what_fits_beside_a_judged_one_that_it_does_not_contain_has_its_own_reason(sizes, odds, key, monkeypatch):
    known = Scored(monkeypatch, WORSE | {"b": (1.0, -80.0), "c": (1.0, -5.0), "bc": (odds, -10.0)})
    larger = known.made["bc"]
    larger.implausible, larger.unusual = lambda: sizes, len(sizes)
    acceptance = SimpleNamespace(leader=known.made["a"], final=known.null, checks=(), members={})
    assert rule_against(known, acceptance, larger).key == key


@pytest.mark.parametrize(
    ("told", "possible", "key"),
    [
        ({"ab": (3e35, 0.0)}, False, "one run"),
        ({"bc": (100.0, -10.0), "b": (50.0, -80.0), "c": (1.0, -80.0)}, True, "odds of one"),
        ({"bc": (100.0, -10.0), "b": (1.0, -80.0), "c": (1.0, -5.0)}, True, "no gain of one"),
        ({"bc": (100.0, -10.0), "b": (1.0, -80.0), "c": (1.0, -80.0)}, True, "elsewhere"),
    ],
)
def test_the_rule_that_keeps_a_hypothesis_back(told, possible, key, monkeypatch):
    known = Scored(monkeypatch, WORSE | told, possible=possible)
    assert held_back(known, known.made[next(iter(told))], known.made["a"]).key == key


def test_one_of_three_that_does_not_beat_nothing_is_given(monkeypatch):
    told = {"": (1e-3, -90.0), "c": (1e-3, -80.0), "a": (1.0, -80.0), "b": (1.0, -80.0)}
    known = Scored(monkeypatch, told | dict.fromkeys(("ab", "bc", "ac"), (1.0, -50.0)) | {"abc": (100.0, -10.0)})
    reason = held_back(known, known.made["abc"], known.made["ab"])
    assert (reason.key, reason.numbers["effect"]) == ("not alone", "c")


@pytest.mark.parametrize(
    ("unusual", "fits", "white", "key"),
    [
        (1, 1e-9, 0.5, "unusual misfit"), (1, 0.5, 1e-9, "unusual not white"), (2, 0.5, 0.5, "two unusual"),
        (1, 0.5, 0.5, "no gain"),
    ],
)  # fmt: skip
def test_an_unusual_size_is_the_reason_if_it_is(unusual, fits, white, key, monkeypatch):
    """It gains nothing on what is left out: that is the rule only if the size is none."""
    known = Scored(monkeypatch, WORSE | {"ab": (3e35, -60.0)}, fits=fits, white=white)
    larger = known.made["ab"]
    larger.implausible, larger.unusual = lambda: ["b.mass"], unusual
    assert held_back(known, larger, known.made["a"]).key == key


def compared(odds, leader, other, monkeypatch):
    """Reason of another hypothesis in the class of a leader at ``odds`` of the leader against it."""
    monkeypatch.setattr(
        import_module("studies.inference.judge"), "similarity", lambda _f, _n, fits: np.ones((len(fits),) * 2)
    )
    known = SimpleNamespace(
        kind=None,
        null=None,
        best=lambda count: [leader, other],
        odds=lambda one, two: odds if one is leader else 1 / odds,
    )
    return equivalents(known, leader).get(other)


@pytest.mark.parametrize(("odds", "why"), [(1 / 3.0, "not clear"), (1 / 50.0, "elsewhere"), (0.0, "elsewhere")])
def test_one_that_is_more_probable_says_why_it_is_not_named(odds, why, monkeypatch):
    """Odds that are too small for a float as well."""

    class Likely(Hypothesis):
        log = -10.0

    leader, other = Likely("a"), Likely("b")
    leader.log = -10.0 + (math.log(odds) if odds else -4000.0)
    monkeypatch.setattr(
        import_module("studies.inference.judge"), "similarity", lambda _f, _n, fits: np.ones((len(fits),) * 2)
    )

    class Known:
        kind, null, odds = None, None, Hypotheses.odds

        def best(self, count):
            return [leader, other]

        def log_posterior(self, f):
            return f.log

    reason = equivalents(Known(), leader)[other]
    assert (reason.key, reason.numbers["why"].key) == ("ahead", why)


@pytest.mark.parametrize(
    ("objective", "unusual", "leading", "member"),
    [
        (1.0, 0, 0, True),  # a fit as good
        (40.0, 0, 0, False),  # neither odds nor fit
        (1.0, 1, 0, False),  # of an unusual size beside an ordinary one
        (1.0, 1, 1, True),  # both unusual
    ],
)
def test_what_does_the_same_and_fits_as_well_is_a_member_whatever_the_odds(
    objective, unusual, leading, member, monkeypatch
):
    """The volume of a prior alone (odds of a million) tells nothing apart that moves the data alike."""
    leader, other = Hypothesis("a"), Hypothesis("b")
    other.objective, other.physical, leader.physical = objective, not unusual, not leading
    for f in (leader, other):
        f.columns = lambda candidate: slice(0, 0)
    assert (compared(1e6, leader, other, monkeypatch) is not None) is member


@pytest.mark.parametrize(
    ("sizes", "member"),
    [
        ((2.0, 0.3), True),  # 3 sd of its own above its bound
        ((2.0, 0.05), False),  # may as well be nothing: then it is the leader by another name
        ((-2.0, -1.95), False),  # likewise at its other bound
        ((2.0,), True),  # one size, of which the verdict is
    ],
)
def test_an_effect_that_the_data_ask_for_in_part_is_no_member_beside_that_part(sizes, member, monkeypatch):
    """Arms of a rider whose inertia is 0.05 +- 0.1 are a damper; were they likely, their odds would say so."""
    bounds = {"lowest": 0.0} if sizes[0] > 0 else {"highest": -1.9}
    unknowns = tuple(UncertainParameter(f"size {k}", "1", {}, 0.0, 1.0, size=True, **bounds) for k in range(len(sizes)))
    leader, other = Hypothesis("a"), Hypothesis("b")
    other.candidates = (Candidate("arms", unknowns),)
    other.theta, other.covariance = np.array(sizes), 0.1**2 * np.eye(len(sizes))
    other.columns = lambda candidate: slice(0, len(sizes))
    assert (compared(1e3, leader, other, monkeypatch) is not None) is member
    assert compared(10.0, leader, other, monkeypatch).key == "close"
