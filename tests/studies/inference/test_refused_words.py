"""What is said of a hypothesis that is more probable than the one that is named."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import acceptance as acceptance_module
from studies.inference import account, held_back, identifiability, search
from studies.inference.account import _rule
from studies.inference.evidence import Hypotheses
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.reporting.sentences import beside_name


class Named:
    """A hypothesis of effects called by one letter each; the null has none."""

    converged = admissible = True
    at_bound = negligible = implausible = list

    def __init__(self, name):
        self.name, self.identifiers = name, frozenset(name)
        self.candidates = tuple(Candidate(c, ()) for c in name)


class Scored:
    """Hypotheses with their log posteriors and held-out scores, by name."""

    odds = Hypotheses.odds

    def __init__(self, monkeypatch, told, *, possible=True):
        self.made = {name: Named(name) for name in told}
        self.null, self.fits = self.made[""], [f for name, f in self.made.items() if name]
        self.log_posterior = lambda f: math.log(told[f.name][0])
        for module in (held_back, search):
            monkeypatch.setattr(
                module, "held_out", lambda _, f: SimpleNamespace(log_score=told[f.name][1], possible=possible)
            )
        monkeypatch.setattr(account, "goodness_of_fit", lambda *_: 0.5)

    def find(self, identifiers):
        return next((f for f in self.made.values() if f.identifiers == identifiers), None)


WORSE = {"": (1e-9, -90.0), "a": (1.0, -50.0), "b": (1e-6, -80.0)}  # posterior, held-out score


@pytest.mark.parametrize(
    ("larger", "words"),
    [
        ((7.0, -10.0), "not clearly"),
        ((3e35, -50.0), "but the data left out gain nothing by it"),
        ((3e35, -49.0), "but not where the search ended, which goes from the best with so many effects to one more"),
    ],
)
@pytest.mark.parametrize("named", [True, False])
def test_of_two_reasons_the_one_that_holds_is_said(named, larger, words, monkeypatch):
    """Of a hypothesis ab beside a, which is named or was judged and is not; what is left out is each time another."""
    known = Scored(monkeypatch, WORSE | {"ab": larger})
    final = known.made["a" if named else ""]
    acceptance = SimpleNamespace(leader=known.made["a"], final=final, checks=(), reasons={})
    rule = _rule(None, known, acceptance, known.made["ab"])
    assert words in rule
    assert sum(reason in rule for reason in ("not clearly", "gain nothing", "where the search ended")) == 1
    assert f"{larger[0]:.2g}" in rule
    if not named:
        assert rule.startswith(f"{larger[0]:.2g} times as probable as a, which was judged, but ")


@pytest.mark.parametrize(
    ("sizes", "odds", "words"),
    [
        (["b.offset", "c.scale"], 3e35, "more than one of its sizes seldom occurs (b.offset, c.scale)"),
        ([], 3e35, "3e+35 times as probable as a, which was judged, but the data left out gain nothing by its b"),
        (["b.offset", "c.scale"], 0.5, "more than one of its sizes seldom occurs (b.offset, c.scale)"),
        ([], 0.5, "not what was judged: a was, which fails a rule"),
    ],
)  # fmt: skip
def test_what_fits_beside_a_judged_one_that_it_does_not_contain_has_its_own_reason(sizes, odds, words, monkeypatch):
    """Nothing is named, a was judged; bc fits and is more probable: that another was judged is no reason."""
    known = Scored(monkeypatch, WORSE | {"b": (1.0, -80.0), "c": (1.0, -5.0), "bc": (odds, -10.0)})
    larger = known.made["bc"]
    larger.implausible, larger.unusual = lambda: sizes, len(sizes)
    acceptance = SimpleNamespace(leader=known.made["a"], final=known.null, checks=(), reasons={})
    assert _rule(None, known, acceptance, larger) == words


def test_one_run_gives_no_gain_to_show_and_is_not_said_to_give_none(monkeypatch):
    known = Scored(monkeypatch, WORSE | {"ab": (3e35, 0.0)}, possible=False)
    assert held_back.held_back(None, known, known.made["ab"], known.made["a"]) == (
        "of one run nothing can be left out to show a gain"
    )


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"b": (50.0, -80.0)}, "c does not stand by its own odds (2 : 1; above 20 : 1 is clear)"),
        ({"c": (1.0, -5.0)}, "the data left out gain nothing by its b"),
        ({}, "not where the search ended"),
    ],
)
def test_the_effect_that_does_not_stand_is_named(told, words, monkeypatch):
    """bc, which does not contain the leader a."""
    known = Scored(monkeypatch, WORSE | {"b": (1.0, -80.0), "c": (1.0, -80.0), "bc": (100.0, -10.0)} | told)
    assert held_back.held_back(None, known, known.made["bc"], known.made["a"]).startswith(words)


@pytest.mark.parametrize(
    ("unusual", "white", "words"),
    [
        (1, 1e-9, "of a size that seldom occurs (b.mass), which is named only where it explains the data, and what it "
         "leaves is not white noise (p below 0.01)"),
        (2, 0.5, "more than one of its sizes seldom occurs (b.mass)"),
        (1, 0.5, "the data left out gain nothing by it"),
    ],
)  # fmt: skip
def test_an_unusual_size_is_the_reason_where_it_is(unusual, white, words, monkeypatch):
    """It fits in sum (p = 0.5), and gains nothing on what is left out: that is the rule only where the size is none."""
    known = Scored(monkeypatch, WORSE | {"ab": (3e35, -60.0)})
    larger = known.made["ab"]
    larger.implausible, larger.unusual = lambda: ["b.mass"], unusual
    monkeypatch.setattr(held_back, "whiteness", lambda *_: white)
    monkeypatch.setattr(held_back, "goodness_of_fit", lambda *_: 0.5)
    assert held_back.held_back(None, known, larger, known.made["a"]) == words


def test_one_of_three_that_does_not_beat_nothing_is_named(monkeypatch):
    told = {"": (1e-3, -90.0), "c": (1e-3, -80.0), "a": (1.0, -80.0), "b": (1.0, -80.0)}
    pairs = dict.fromkeys(("ab", "bc", "ac"), (1.0, -50.0))
    known = Scored(monkeypatch, told | pairs | {"abc": (100.0, -10.0)})
    assert held_back.held_back(None, known, known.made["abc"], known.made["ab"]) == (
        "c, one of three effects, is not clearly better than nothing by itself"
    )


def test_a_hypothesis_that_is_listed_twice_has_one_reason(monkeypatch):
    known = Scored(monkeypatch, WORSE | {"ab": (3e35, -50.0)})
    made = known.made
    acceptance = SimpleNamespace(leader=made["a"], final=made["a"], checks=(), reasons={"ab": "the reason"})
    assert _rule(None, known, acceptance, made["ab"]) == "the reason"


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({}, ""),
        ({"ab": (7.0, 0.0)}, " of those with 1 effect"),
        ({"": (7.0, 0.0)}, " of those with 1 effect"),
        ({"b": (7.0, 0.0)}, " of those that may be named"),
    ],
)
def test_the_leader_is_called_the_most_probable_of_what_it_is(told, words, monkeypatch):
    known = Scored(monkeypatch, WORSE | told)
    known.made["b"].admissible = False
    assert acceptance_module._among(known, known.made["a"]) == words


@pytest.mark.parametrize(
    ("odds", "words"),
    [
        (7.0, "one effect more, odds 7 : 1 for it: too few to add it"),
        (
            3e35,
            "more probable than what leads (3e+35 : 1), of one effect more, but the data left out gain nothing by it",
        ),
    ],
)
def test_odds_that_are_clear_are_not_too_few(odds, words, monkeypatch):
    known = Scored(monkeypatch, WORSE | {"ab": (odds, -50.0)})
    leader, larger = known.made["a"], known.made["ab"]
    monkeypatch.setattr(acceptance_module, "equivalents", lambda *_: {leader: "the most probable"})
    monkeypatch.setattr(acceptance_module, "likelier", lambda *_: [larger])
    monkeypatch.setattr(acceptance_module, "held_out", lambda *_: None)
    known.best = lambda count=None: [leader]
    wide = SimpleNamespace(best=lambda: [leader], nothing=1.0)
    monkeypatch.setattr(acceptance_module, "with_wider_nuisances", lambda *_: wide)
    members = acceptance_module._studied(None, known, leader).members
    assert members == {leader: "the most probable of those with 1 effect", larger: words}
    begin = "cannot be told apart from" if odds < 20 else "not ruled out is"
    assert beside_name(SimpleNamespace(reasons={"ab": members[larger]}), "ab") == f"{begin} ab: {words}"


def test_one_that_is_more_probable_than_any_number_says(monkeypatch):
    """Odds that are too small for a float once divided by zero."""

    class Known:
        odds = Hypotheses.odds
        null = None

        def best(self, _count):
            return [first, second]

        def log_posterior(self, fit):
            return fit.log

    class Fitted:
        candidates, admissible, physical, implausible, unusual = ("a",), True, True, list, 0

        def __init__(self, log):
            self.log, self.objective = log, -2 * log

    first, second = Fitted(-4000.0), Fitted(-10.0)
    monkeypatch.setattr(identifiability, "similarity", lambda *_: np.ones((1, 2)))
    known = Known()
    assert known.odds(first, second) == 0.0
    reason = identifiability.equivalents(None, known, first)[second]
    assert reason.startswith(f"more probable than what leads ({math.exp(700):.2g} : 1), but not where the search ended")


@pytest.mark.parametrize(
    ("odds", "sizes", "unusual", "fits", "said"),
    [
        (1.7e17, ["luggage.mass", "rider_lean.stiffness"], 2, 1e-9,
         "more probable than what leads (1.7e+17 : 1), but not named, as more than one of its sizes seldom occurs "
         "(luggage.mass, rider_lean.stiffness)"),
        (50.0, ["luggage.mass"], 1, 1e-9, "of a size that seldom occurs (luggage.mass), which is named only where it "
         "explains the data, and it does not fit (p below 0.01)"),
        (50.0, ["luggage.mass"], 1, 0.5, "more probable than what leads (50 : 1), but not where the search ended"),
        (3.0, [], 0, 0.5, "more probable than what leads (3 : 1), but not clearly so (above 20 : 1)"),
    ],
)  # fmt: skip
def test_one_that_is_more_probable_is_not_said_to_be_alike_but_why_it_is_not_named(
    odds, sizes, unusual, fits, said, monkeypatch
):
    """That a size seldom occurs is the reason where it does not explain the data; else another rule is."""
    monkeypatch.setattr(held_back, "goodness_of_fit", lambda *_: fits)
    monkeypatch.setattr(held_back, "whiteness", lambda *_: 0.5)
    leader = Fitted(0, [])
    one = Fitted(unusual, sizes)
    monkeypatch.setattr(identifiability, "similarity", lambda *_: np.ones((1, 2)))
    known = SimpleNamespace(
        null=None, best=lambda _count: [one, leader], odds=lambda a, b: odds if a is one else 1 / odds
    )
    reasons = identifiability.equivalents(None, known, leader)
    assert said in reasons[one]
    assert reasons[leader] == ("the most probable of a size that occurs" if sizes else "where the search ended")
    verdict = SimpleNamespace(reasons={"b": reasons[one]})
    assert beside_name(verdict, "b") == f"not ruled out is b: {reasons[one]}"


class Fitted:
    """A fit with so many ``unusual`` effects and these ``sizes`` that seldom occur."""

    candidates, admissible, objective = (Candidate("a", ()),), True, 0.0

    def __init__(self, unusual, sizes):
        self.unusual, self.physical, self.implausible = unusual, not sizes, lambda: sizes
        self.columns = lambda candidate: slice(0, 0)


@pytest.mark.parametrize(
    ("objective", "sizes", "leading", "member"),
    [
        (1.0, (), (), True),  # a fit as good
        (40.0, (), (), False),  # neither odds nor fit
        (1.0, ("b.scale",), (), False),  # of an unusual size beside an ordinary one
        (1.0, ("b.scale",), ("a.scale",), True),  # both unusual
    ],
)
def test_what_does_the_same_and_fits_as_well_is_a_member_whatever_the_odds(
    objective, sizes, leading, member, monkeypatch
):
    """The volume of a prior alone (odds of a million) tells nothing apart that moves the data alike."""
    leader, other = Fitted(0, leading), Fitted(0, sizes)
    other.objective = objective
    known = SimpleNamespace(null=None, best=lambda count: [leader, other], odds=lambda one, two: 1e6)
    monkeypatch.setattr(identifiability, "similarity", lambda _forward, _null, fits: np.ones((len(fits),) * 2))
    assert (other in identifiability.equivalents(None, known, leader)) is member


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
    leader, other = Fitted(0, ()), Fitted(0, ())
    other.candidates = (Candidate("arms", unknowns),)
    other.theta, other.covariance = np.array(sizes), 0.1**2 * np.eye(len(sizes))
    other.columns = lambda candidate: slice(0, len(sizes))
    known = SimpleNamespace(null=None, best=lambda count: [leader, other], odds=lambda one, two: 1e3)
    monkeypatch.setattr(identifiability, "similarity", lambda _forward, _null, fits: np.ones((len(fits),) * 2))
    assert (other in identifiability.equivalents(None, known, leader)) is member
    assert other in identifiability.equivalents(
        None, SimpleNamespace(**vars(known) | {"odds": lambda a, b: 10}), leader
    )
