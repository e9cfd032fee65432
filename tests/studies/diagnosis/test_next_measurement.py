"""Which hypotheses are to be told apart: by their probabilities and by the rule that failed."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import leading_two
from studies.inference import AcceptanceCheck, Candidate, Fit, Hypotheses, UncertainParameter

LEAST = 0.1
NAMES = ("damper", "spring", "trail")
LIBRARY = {
    name: Candidate(name, (UncertainParameter("size", "1", {name: 1.0}, 0.0, 10.0, 0.0, size=True, least=LEAST),))
    for name in NAMES
}


def hypothesis(name, log_odds, *, size=5.0, chi2=10.0):
    """Its logarithm of the odds against nothing, the prior of one in three and of one in six compensated."""
    candidates = tuple(LIBRARY[part] for part in name.split("+") if part)
    log_evidence = log_odds + (np.log(3) if len(candidates) == 1 else np.log(6) if candidates else 0.0)
    p = len(candidates)
    unknowns = tuple(c.unknowns[0] for c in candidates)
    return Fit(candidates, unknowns, np.full(p, size), np.eye(p), np.zeros(10), np.zeros((10, p)), chi2, log_evidence)


def judged(word, final, *fits, failed=(), chi2=10.0, members=()):
    null = hypothesis("", 0.0, chi2=chi2)
    known = Hypotheses(null, fits, SimpleNamespace(library=tuple(LIBRARY.values())))
    verdict = SimpleNamespace(
        verdict=word, equivalent=members or ((final,) if final else ()),
        failed=tuple(AcceptanceCheck(what, "", passed=False) for what in failed),
    )  # fmt: skip
    forward = SimpleNamespace(rows=SimpleNamespace(places=("here",) * 10))
    named = next((f for f in fits if f.name == final), null)
    return SimpleNamespace(hypotheses=known, final=named, verdict=verdict, kind=forward)


def names(found):
    return tuple(f.name for f in leading_two(found))


@pytest.mark.parametrize(("against", "rival"), [(9.0, ("spring",)), (9.5, ())])
def test_a_name_has_a_rival_only_within_ten_thousand_to_one(against, rival):
    """exp(9) is 8100, exp(9.5) is 13400."""
    found = judged("named", "damper", hypothesis("damper", 100.0), hypothesis("spring", 100.0 - against))
    assert names(found) == ("damper", *rival)


def test_the_named_effect_with_a_further_one_of_no_size_is_no_rival():
    twin = hypothesis("damper+spring", 98.0, size=LEAST / 2)
    found = judged("named", "damper", hypothesis("damper", 100.0), twin)
    assert names(found) == ("damper",)
    assert names(judged("named", "damper", hypothesis("damper", 100.0), hypothesis("damper+spring", 98.0))) == (
        "damper", "damper+spring",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("failed", "rival"),
    [("wide_priors", "none"), ("predicts", "none"), ("nothing_left", "spring"), ("usual_size", "spring")],
)
def test_a_tentative_name_is_told_from_nothing_where_it_may_be_nothing(failed, rival):
    fits = hypothesis("damper", 16.0), hypothesis("spring", 12.0)
    found = judged("tentative", "damper", *fits, failed=(failed,))
    assert names(found) == ("damper", rival)


def test_a_tentative_name_may_have_no_rival():
    found = judged("tentative", "damper", hypothesis("damper", 100.0), failed=("usual_size",))
    assert names(found) == ("damper",)


def test_where_nothing_is_named_the_two_most_probable_are_told_apart():
    assert names(judged("none", "", hypothesis("damper", -2.0), hypothesis("spring", -3.0))) == ("none", "damper")
    assert names(judged("none", "", hypothesis("damper", 2.0), hypothesis("spring", 1.0))) == ("damper", "spring")


@pytest.mark.parametrize(("fits", "two"), [
    ((hypothesis("damper", 90.0, chi2=99.0), hypothesis("spring", 80.0, chi2=99.0)), ()),
    ((hypothesis("damper", 90.0), hypothesis("spring", 89.0)), ("damper", "spring")),
    ((hypothesis("damper", 90.0), hypothesis("spring", 70.0)), ("damper",)),
    ((hypothesis("damper", 90.0), hypothesis("spring", 89.0, chi2=99.0)), ("damper",)),
    ((hypothesis("damper", 90.0, size=0.0), hypothesis("spring", 89.0)), ("spring",)),
])  # fmt: skip
def test_of_an_unknown_gap_only_what_fits_is_told_apart(fits, two):
    """chi^2 of 99 over 10 numbers is p = 1e-16."""
    assert names(judged("unknown", "", *fits, chi2=500.0)) == two
