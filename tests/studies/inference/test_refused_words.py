"""What is said of a hypothesis that is more probable than the one that is named."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import account, identifiability
from studies.inference.account import _rule
from studies.inference.evidence import Hypotheses
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.reporting.sentences import beside_name


@pytest.mark.parametrize(
    ("odds", "words"),
    [(7.0, "not clearly more probable (7 : 1)"), (3e35, "3e+35 times as probable, but the data left out gain nothing")],
)
def test_clear_odds_are_not_called_unclear(odds, words):
    larger = SimpleNamespace(
        converged=True, candidates=("a", "b"), identifiers=frozenset("ab"), at_bound=list, negligible=list,
        implausible=list,
    )  # fmt: skip
    final = SimpleNamespace(candidates=("a",), identifiers=frozenset("a"))
    acceptance = SimpleNamespace(leader=None, final=final, checks=())
    known = SimpleNamespace(odds=lambda one, other: odds)
    assert words in _rule(None, known, acceptance, larger)


@pytest.mark.parametrize(
    ("odds", "words"),
    [(33.0, "33 times as probable as a, which was judged, but not clearly so"), (0.1, "not what was judged: a was")],
)
def test_where_nothing_is_named_the_one_that_was_judged_is_not_called_likelier(odds, words, monkeypatch):
    monkeypatch.setattr(account, "goodness_of_fit", lambda *_: 0.5)
    larger = SimpleNamespace(
        converged=True, candidates=("a", "b"), identifiers=frozenset("ab"), at_bound=list, negligible=list,
        implausible=list,
    )  # fmt: skip
    judged = SimpleNamespace(name="a", identifiers=frozenset("a"))
    acceptance = SimpleNamespace(leader=judged, final=SimpleNamespace(candidates=()), checks=())
    assert _rule(None, SimpleNamespace(odds=lambda one, other: odds), acceptance, larger).startswith(words)


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
    ("odds", "sizes", "unusual", "said"),
    [
        (1.7e17, ["luggage.mass", "rider_lean.stiffness"], 2,
         "more probable than what leads (1.7e+17 : 1), but not named, as more than one of its sizes seldom occurs "
         "(luggage.mass, rider_lean.stiffness)"),
        (50.0, ["luggage.mass"], 1, "of a size that seldom occurs (luggage.mass), which is named only where it expl"),
        (3.0, [], 0, "more probable than what leads (3 : 1), but not clearly so (above 20 : 1)"),
    ],
)  # fmt: skip
def test_one_that_is_more_probable_is_not_said_to_be_alike_but_why_it_is_not_named(
    odds, sizes, unusual, said, monkeypatch
):
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
