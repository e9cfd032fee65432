"""Which hypotheses are to be told apart: by their probabilities and by the rule that failed."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference import UncertainParameter
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit
from studies.inference.parameter import Candidate
from studies.inference.verdict import AcceptanceCheck
from studies.missing_effect.leading import Standing, leading_two, settled, standing
from studies.missing_effect.plan.costs import Costs
from studies.missing_effect.plan.plan import Plan
from studies.missing_effect.plan.questions import chosen
from studies.missing_effect.plan.words import headline

LEAST = 0.1
NAMES = ("damper", "spring", "trail")
LIBRARY = {
    name: Candidate(name, (UncertainParameter("size", "1", {name: 1.0}, 0.0, 10.0, 0.0, size=True, least=LEAST),))
    for name in NAMES
}
DOUBLED = "survives doubling the uncertainty of the parameters"


def hypothesis(name, log_odds, *, size=5.0, chi2=10.0):
    """Its logarithm of the odds against nothing, the prior of one in three and of one in six compensated."""
    candidates = tuple(LIBRARY[part] for part in name.split("+") if part)
    log_evidence = log_odds + (np.log(3) if len(candidates) == 1 else np.log(6) if candidates else 0.0)
    p = len(candidates)
    unknowns = tuple(c.unknowns[0] for c in candidates)
    return Fit(candidates, unknowns, np.full(p, size), np.eye(p), np.zeros(10), np.zeros((10, p)), chi2, log_evidence)


def judged(word, final, *fits, failed=(), chi2=10.0, members=()):
    null = hypothesis("", 0.0, chi2=chi2)
    known = Hypotheses(null, fits, tuple(LIBRARY.values()))
    verdict = SimpleNamespace(
        verdict=word, equivalent=members or ((final,) if final else ()),
        checks=tuple(AcceptanceCheck(what, "", passed=False) for what in failed),
    )  # fmt: skip
    forward = SimpleNamespace(rows=SimpleNamespace(where=("here",) * 10))
    named = next((f for f in fits if f.name == final), null)
    return SimpleNamespace(hypotheses=known, final=named, verdict=verdict, forward=forward)


def names(found):
    return tuple(f.name for f in leading_two(found))


@pytest.mark.parametrize(("against", "rival"), [(9.0, ("spring",)), (9.5, ())])
def test_a_name_has_a_rival_only_within_ten_thousand_to_one(against, rival):
    """exp(9) is 8100, exp(9.5) is 13400."""
    found = judged("named", "damper", hypothesis("damper", 100.0), hypothesis("spring", 100.0 - against))
    assert names(found) == ("damper", *rival)
    assert settled(found).startswith("Nothing is open: no other hypothesis") == (not rival)
    assert [f.name for f in chosen(found)] == ["damper"]  # a plan asks for less than 20 : 1


@pytest.mark.parametrize(("against", "odds"), [(2.9, None), (3.1, 22.2), (9.0, 8103.0), (9.5, None)])
def test_a_name_stands_above_twenty_to_one_where_a_plan_asks_nothing(against, odds):
    """exp(2.9) is 18.2, exp(3.1) 22.2."""
    found = judged("named", "damper", hypothesis("damper", 100.0), hypothesis("spring", 100.0 - against))
    stands = standing(found)
    assert (stands is None) == (odds is None)
    if odds is not None:
        assert (stands.leader, stands.rival) == ("damper", "spring")
        assert stands.odds == pytest.approx(odds, rel=1e-3)
        assert str(stands) in headline(Plan((), (), 0.0, (), (), True, Costs(), verdict="named", standing=stands))
        assert len(chosen(found)) == 1
    assert standing(judged("class", "damper", *found.hypotheses.fits, members=("damper", "spring"))) is None
    assert standing(judged("tentative", "damper", *found.hypotheses.fits, failed=("a size that occurs",))) is None


def test_that_nothing_is_missing_stands_only_where_a_plan_does_not_ask_either():
    assert standing(judged("none", "", hypothesis("damper", -2.9))) is None
    assert len(chosen(judged("none", "", hypothesis("damper", -2.9)))) == 2
    far = standing(judged("none", "", hypothesis("damper", -4.0)))
    assert str(far) == "that nothing is missing stands at odds of 55 : 1 against its nearest rival, damper"
    assert [f.name for f in chosen(judged("none", "", hypothesis("damper", -4.0)))] == ["none"]


def test_a_plan_without_a_question_does_not_hide_the_rival_that_a_diagnosis_would_tell_apart():
    plan = Plan((), (), 0.0, (), (), True, Costs(), verdict="named", standing=Standing("a", "b + c", 384.0))
    assert headline(plan) == (
        "Nothing is open at odds of 20 : 1, so no further measurement is needed: a stands at odds of 380 : 1 against "
        "its nearest rival, b + c; `velotyre diagnose` says whether a measurement would make that surer."
    )
    assert plan.to_dict()["nearest_rival"] == {"leader": "a", "rival": "b + c", "odds": 384.0}
    assert Plan((), (), 0.0, (), (), True, Costs(), verdict="named").to_dict()["nearest_rival"] is None


def test_the_named_effect_with_a_further_one_of_no_size_is_no_rival():
    twin = hypothesis("damper+spring", 98.0, size=LEAST / 2)
    found = judged("named", "damper", hypothesis("damper", 100.0), twin)
    assert names(found) == ("damper",)
    assert "large enough to matter is within odds of 10000 : 1 of damper" in settled(found)
    assert names(judged("named", "damper", hypothesis("damper", 100.0), hypothesis("damper+spring", 98.0))) == (
        "damper", "damper+spring",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("failed", "rival"),
    [
        (DOUBLED, "none"),
        ("held-out log score improves", "none"),
        ("nothing left for terms without a cause, p > 0.01", "spring"),
        ("a size that occurs", "spring"),
    ],
)
def test_a_tentative_name_is_told_from_nothing_where_it_may_be_nothing(failed, rival):
    fits = hypothesis("damper", 16.0), hypothesis("spring", 12.0)
    found = judged("tentative", "damper", *fits, failed=(failed,))
    assert names(found) == ("damper", rival)
    assert settled(found) == ""


def test_a_tentative_name_without_a_rival_is_not_called_settled():
    found = judged("tentative", "damper", hypothesis("damper", 100.0), failed=("a size that occurs",))
    assert names(found) == ("damper",)
    assert settled(found).startswith("There are no two hypotheses to be told apart: no other")
    assert "Nothing is open" not in settled(found)


def test_where_nothing_is_named_the_two_most_probable_are_told_apart():
    assert names(judged("none", "", hypothesis("damper", -2.0), hypothesis("spring", -3.0))) == ("none", "damper")
    assert names(judged("none", "", hypothesis("damper", 2.0), hypothesis("spring", 1.0))) == ("damper", "spring")


@pytest.mark.parametrize(
    ("fits", "two", "words"),
    [
        (
            (hypothesis("damper", 90.0, chi2=99.0), hypothesis("spring", 80.0, chi2=99.0)),
            (),
            "No hypothesis of the lib",
        ),
        ((hypothesis("damper", 90.0), hypothesis("spring", 89.0)), ("damper", "spring"), ""),
        ((hypothesis("damper", 90.0), hypothesis("spring", 70.0)), ("damper",), "odds above 10000 : 1 against every"),
        ((hypothesis("damper", 90.0), hypothesis("spring", 89.0, chi2=99.0)), ("damper",), "no other hypothesis fits"),
        ((hypothesis("damper", 90.0, size=0.0), hypothesis("spring", 89.0)), ("spring",), "spring would fit, but"),
    ],
)
def test_of_an_unknown_gap_only_what_fits_is_told_apart_and_a_plan_decides_alike(fits, two, words):
    """chi^2 of 99 over 10 numbers is p = 1e-16."""
    found = judged("unknown", "", *fits, chi2=500.0)
    assert names(found) == two
    assert words in settled(found)
    assert bool(settled(found)) == (len(two) < 2)
    assert tuple(f.name for f in chosen(found)) == (two or ("none",))


def test_a_class_is_told_apart_by_its_members():
    fits = hypothesis("damper", 20.0), hypothesis("spring", 1.0)
    assert settled(judged("class", "damper", *fits, members=("damper", "spring"))) == ""
