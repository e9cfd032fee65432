"""What is said where nothing is named: the figures are those of the hypotheses that it speaks of."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from studies.inference import sentence as module
from studies.inference.sentence import sentence
from studies.inference.verdict import Named

P = {"none": 1e-9, "a+b": 1e-7, "a+b+c": 1e-3, "a+b+d": 0.3}


@dataclass(frozen=True, eq=False)
class Fitted:
    name: str
    converged: bool
    chi2: float = 50.0
    mistakes: str = ""

    @property
    def candidates(self):
        return [SimpleNamespace(identifier=c, mistake=c in self.mistakes) for c in self.name.split("+")]

    def at_bound(self):
        return ()


def said_of(*names, refused=None, monkeypatch, stuck=()):
    made = {name: Fitted(name, name not in stuck) for name in names} | {"none": Fitted("none", True, 400.0)}
    monkeypatch.setattr(module, "goodness_of_fit", lambda _, fit: P[fit.name])
    known = SimpleNamespace(null=made["none"], best=lambda: [made[name] for name in names])
    judged = SimpleNamespace(verdict="unknown", leader=made["a+b"], final=made["none"], checks=())
    return sentence(SimpleNamespace(varied=True), known, judged, (), refused or {})


def test_the_most_probable_is_the_most_probable(monkeypatch):
    """The one that was judged has fewer effects than the one that leads the table beside the sentence."""
    said = said_of("a+b+c", "a+b", monkeypatch=monkeypatch)
    assert said.endswith(
        "nor does any hypothesis of the library; the most probable, a+b+c, takes chi^2 from 400 to 50 and leaves p = "
        "0.001."
    )


@pytest.mark.parametrize("stuck", [(), ("a+b+d",)])
def test_one_that_fits_and_is_refused_is_told_with_its_rule(monkeypatch, stuck):
    said = said_of(
        "a+b+d", "a+b+c", "a+b", refused={"a+b+d": "the data left out gain nothing"}, monkeypatch=monkeypatch,
        stuck=stuck,
    )  # fmt: skip
    if stuck:  # what did not converge is not judged
        assert said.endswith("the most probable, a+b+c, takes chi^2 from 400 to 50 and leaves p = 0.001.")
    else:
        assert said.endswith(
            ", nor does a+b, which was judged (p = 1e-07); a+b+d would in sum (p = 0.3), but is refused: the data left "
            "out gain nothing."
        )


def test_one_that_fits_is_told_though_it_is_less_probable_than_nothing(monkeypatch):
    said = said_of("a+b", "a+b+d", monkeypatch=monkeypatch)
    assert said.endswith(
        "a+b+d would in sum (p = 0.3), but is refused: it is less probable than that nothing is missing."
    )


@pytest.mark.parametrize(("count", "verb"), [(1, "is"), (2, "are")])
def test_one_is_missing_and_two_are(monkeypatch, count, verb):
    monkeypatch.setattr(module, "goodness_of_fit", lambda _, fit: P[fit.name])
    known = SimpleNamespace(null=Fitted("none", True), nothing=0.0)
    judged = SimpleNamespace(verdict="named", final=Fitted("a+b+d", True), members=())
    effects = tuple(Named(name, {"size": (1.0, 0.1)}, {"size": "m"}) for name in "ab"[:count])
    said = sentence(SimpleNamespace(), known, judged, effects, {})
    assert f"{effects[-1].identifier} (size 1 +- 0.1 m) {verb} missing, relative to this library: it explains" in said
    assert said.endswith("do not fit (p = 1e-09), P(nothing is missing) < 1e-99.")


@pytest.mark.parametrize(
    ("mistakes", "words"),
    [
        ("a", "b (size 1 +- 0.1 m) is missing and a (size 1 +- 0.1 m) is an error of the measurement or its file"),
        ("ab", "a (size 1 +- 0.1 m) and b (size 1 +- 0.1 m) are errors of the measurement or its file"),
    ],
)
def test_an_error_of_the_measurement_is_not_said_to_be_missing(monkeypatch, mistakes, words):
    monkeypatch.setattr(module, "goodness_of_fit", lambda *_: 0.3)
    known = SimpleNamespace(null=Fitted("none", True), nothing=0.0)
    judged = SimpleNamespace(verdict="named", final=Fitted("a+b", True, mistakes=mistakes), members=())
    effects = tuple(Named(name, {"size": (1.0, 0.1)}, {"size": "m"}) for name in "ab")
    said = sentence(SimpleNamespace(), known, judged, effects, {})
    assert said.startswith(f"{words}, relative to this library: it explains the data")


@pytest.mark.parametrize(
    ("mistakes", "words"),
    [
        ("", "An effect is missing; the most probable is"),
        ("a", "An effect is missing or the measurement or its file is wrong; the most probable is"),
        ("ac", "The measurement or its file is wrong; the most probable is"),
    ],
)
@pytest.mark.parametrize("refused", [{}, {"d": "at a bound"}])
def test_a_class_says_what_kind_its_members_are_and_leads_only_what_is_ahead(monkeypatch, mistakes, words, refused):
    """Of a class a and c; with one more probable that is refused, a is not the most probable."""
    monkeypatch.setattr(module, "goodness_of_fit", lambda *_: 0.3)
    members = tuple(Fitted(name, True, mistakes=mistakes) for name in "ac")
    known = SimpleNamespace(null=Fitted("none", True), nothing=0.0, odds=lambda *_: 2.0)
    judged = SimpleNamespace(verdict="class", final=members[0], members=members)
    said = sentence(SimpleNamespace(), known, judged, (Named("a", {}, {}),), refused)
    assert said.startswith(words.replace("the most probable is", "it is led by") if refused else words)


@pytest.mark.parametrize(
    ("probability", "digits", "words"),
    [
        (0.034, 2, "= 0.034"), (1e-7, 2, "= 1e-07"), (0.0, 2, "< 1e-99"), (1e-250, 3, "< 1e-99"), (1.0, 2, "> 0.99"),
        (0.9951, 2, "> 0.99"), (0.9951, 3, "= 0.995"), (0.99991, 3, "> 0.999"), (0.994, 2, "= 0.99"),
    ],
)  # fmt: skip
def test_nothing_is_printed_as_impossible_or_certain(probability, digits, words):
    assert module.printed(probability, digits) == words
