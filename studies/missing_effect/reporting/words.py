"""One name for each model and hypothesis, in figures, tables and sentences alike."""

import math
from collections.abc import Iterable

from bicycle.effect import Effect
from studies.inference.fit import Fit
from studies.inference.judge import Judgement
from studies.inference.parameter import Candidate
from studies.inference.sentence import LEAST

BASE, ADJUSTED = "base model", "parameters only"
NO_NUMBERS = {
    "bias": "a constant in each run, integrated out", "drift": "a constant and a trend in each run, integrated out"
}  # fmt: skip
"""Effects without a number of their own, and what to say instead."""


def said(hypothesis: str) -> str:
    """Name of a ``hypothesis`` of the engine (``a+b``, ``none``) in words."""
    return ADJUSTED if hypothesis == "none" else hypothesis.replace("+", " + ")


def explains(hypothesis: Fit) -> str:
    """The same of a fitted ``hypothesis``."""
    return said(hypothesis.name)


def listed(names: Iterable[str]) -> str:
    """Some ``names`` in a row, with an "and"."""
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def titles(judgement: Judgement) -> dict[str, str]:
    """The models of a ``judgement`` that differ, and their names: without parameters or effects there are fewer."""
    found = {"nominal": BASE} | ({"nuisance_only": ADJUSTED} if judgement.forward.nuisances else {})
    if judgement.final is not judgement.hypotheses.null:
        found["final"] = f"with {explains(judgement.final)}"
    return found


def unit_of(unit: str) -> str:
    """A ``unit`` behind a number: nothing for a pure number."""
    return "" if unit in ("", "1") else f" {unit}"


def probability(share: float) -> str:
    """A ``share`` between 0 and 1: two digits, or as many nines as are needed; never nothing."""
    if share < LEAST:  # a number of the computer may be too small to hold it
        return f"< {LEAST:g}"
    if 0.99 <= share < 1:
        return f"{share:.{-math.floor(math.log10(1 - share))}f}" if 1 - share > 1e-6 else "1"
    return f"{share:.2g}"


def percent(share: float) -> str:
    """A ``share`` in per cent that is never rounded to all or nothing."""
    digits = 0
    while digits < 4 and 0 < share < 1 and float(f"{100 * share:.{digits}f}") in (0.0, 100.0):
        digits += 1
    return f"{100 * share:.{digits}f} %"


def number(value: float, digits: int) -> str:
    """A ``value`` with so many significant ``digits``, without an exponent from a thousandth to a million."""
    if value == 0 or not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{digits}g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):.{max(places, 0)}f}"


def misfit(value: float) -> str:
    """A chi^2 ``value``: with a decimal where it counts."""
    return f"{value:.1f}" if value < 1e4 else f"{value:.0f}"


def without_number(candidate: Candidate) -> str:
    """What to say of a ``candidate`` of which nothing is fitted: its stated sizes, or that it has no number."""
    effect, sizes = candidate.effect, []
    if isinstance(effect, type) and issubclass(effect, Effect):  # rigs have others
        every = [(p, entry, f"{effect.identifier}.{entry}") for p in effect.parameters for entry in p.entries()]
        sizes = [
            f"{entry} {number(candidate.fixed[key], 4)}{unit_of(p.unit)}"
            for p, entry, key in every if p.neutral is not None and key in candidate.fixed
        ]  # fmt: skip
    if sizes:
        return f"{', '.join(sizes)}, as stated: not fitted"
    return NO_NUMBERS.get(candidate.identifier.rpartition("/")[2], "without a number of its own")


def values_of(hypothesis: Fit) -> str:
    """Sizes of the effects of a ``hypothesis`` with their units."""
    shown = []
    for c in hypothesis.candidates:
        if not c.unknowns:
            shown.append(f"{c.identifier}: {without_number(c)}")
        for u, x in zip(c.unknowns, hypothesis.theta[hypothesis.columns(c)], strict=True):
            shown.append(f"{u.name} {number(float(u.value(x)), 3)}{unit_of(u.unit)}")
    return ", ".join(shown)
