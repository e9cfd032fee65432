"""Reasons for the place of a hypothesis, on hypotheses with their posteriors and held-out scores given."""

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import Candidate, UncertainParameter, equivalents, reason_against, rule_against


class Hypothesis:
    """A hypothesis of effects called by one letter each; the null has none."""

    converged = admissible = physical = True
    seldom_count, objective, fits_data = 0, 0.0, True
    sizes_at_bound = effects_too_small = sizes_beyond_usual = list

    def __init__(self, name):
        self.name, self.identifiers = name, frozenset(name)
        self.candidates = tuple(Candidate(c, ()) for c in name)


@pytest.mark.parametrize(("fields", "key"), [
    ({"converged": False}, "not converged"), ({"sizes_at_bound": lambda: ["a.x"]}, "at bound"),
    ({"effects_too_small": lambda: ["a"]}, "too small"), ({"seldom_count": 2}, "two unusual"),
    ({"sizes_beyond_usual": lambda: ["a.x"], "fits_data": False}, "unusual misfit"),
    ({"sizes_beyond_usual": lambda: ["a.x"], "white": 1e-9}, "unusual not white"), ({"name": ""}, "nothing"),
    ({"white": 1e-9, "odds": 3e35}, "elsewhere"),
    ({"fits_data": False}, "misfit"), ({"odds": 7.0}, "not clear"), ({"odds": 3e35}, "elsewhere"),
])  # fmt: skip
def test_the_first_fault_of_what_is_not_named_is_its_reason(fields, key, monkeypatch):
    given = {"name": "a", "white": 0.5, "odds": 100.0} | fields
    hypothesis = Hypothesis(given.pop("name"))
    white, odds = given.pop("white"), given.pop("odds")
    monkeypatch.setattr(import_module("studies.inference.search"), "whiteness", lambda *_: white)
    known = SimpleNamespace(kind=None, odds=lambda f, leader: odds)
    for name, value in given.items():
        setattr(hypothesis, name, value)
    nothing = Hypothesis("")
    acceptance = SimpleNamespace(leader=Hypothesis("b"), final=nothing, checks=(), members={})
    reason = rule_against(known, acceptance, hypothesis) if key != "misfit" else reason_against(known, hypothesis, None)
    assert reason.key == key
    assert str(reason)


def compared(odds, leader, other, monkeypatch):
    """Reason of another hypothesis in the class of a leader at ``odds`` of the leader against it."""
    monkeypatch.setattr(
        import_module("studies.inference.judge"), "similarity", lambda _f, _n, fits: np.ones((len(fits),) * 2)
    )
    known = SimpleNamespace(
        kind=None, null=leader, fits=(), rank=lambda count: [leader, other],
        odds=lambda one, two: odds if one is leader else 1 / odds,
    )  # fmt: skip
    return equivalents(known, leader).get(other)


@pytest.mark.parametrize(("objective", "unusual", "leading", "member"), [
    (1.0, 0, 0, True),  # a fit as good
    (40.0, 0, 0, False),  # neither odds nor fit
    (1.0, 1, 0, False),  # of an unusual size beside an ordinary one
    (1.0, 1, 1, True),  # both unusual
])  # fmt: skip
def test_what_does_the_same_and_fits_as_well_is_a_member_whatever_the_odds(
    objective, unusual, leading, member, monkeypatch
):
    """The volume of a prior alone (odds of a million) tells nothing apart that moves the data alike."""
    leader, other = Hypothesis("a"), Hypothesis("b")
    other.objective, other.physical, leader.physical = objective, not unusual, not leading
    for f in (leader, other):
        f.columns = lambda candidate: slice(0, 0)
    assert (compared(1e6, leader, other, monkeypatch) is not None) is member


@pytest.mark.parametrize(("sizes", "member"), [
    ((2.0, 0.3), True),  # 3 sd of its own above its bound
    ((2.0, 0.05), False),  # may as well be nothing: then it is the leader by another name
    ((-2.0, -1.95), False),  # likewise at its other bound
    ((2.0,), True),  # one size, of which the verdict is
])  # fmt: skip
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
