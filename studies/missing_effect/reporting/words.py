"""One name for each model and hypothesis, in figures, tables and sentences alike."""

import math
from collections.abc import Iterable

from studies.inference.fit import Fit
from studies.inference.judge import Judgement

BASE, ADJUSTED = "base model", "parameters only"
NO_NUMBERS = {"bias": "a constant in each run, integrated out"}
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
    """The models of a ``judgement`` that differ and what they are called: the last only where something is named."""
    found = {"nominal": BASE, "nuisance_only": ADJUSTED}
    if judgement.final is not judgement.hypotheses.null:
        found["final"] = f"with {explains(judgement.final)}"
    return found


def unit_of(unit: str) -> str:
    """A ``unit`` behind a number: nothing for a pure number."""
    return "" if unit == "1" else f" {unit}"


def probability(share: float) -> str:
    """A ``share`` between 0 and 1: two digits, as many nines as are needed, and no more of what is hopeless."""
    if 0.99 <= share < 1:
        return f"{share:.{-math.floor(math.log10(1 - share))}f}" if 1 - share > 1e-6 else "1"
    return f"{share:.2g}"


def values_of(hypothesis: Fit) -> str:
    """Sizes of the effects of a ``hypothesis`` with their units."""
    shown = []
    for c in hypothesis.candidates:
        if not c.unknowns:
            shown.append(f"{c.identifier}: {NO_NUMBERS.get(c.identifier, 'without a number of its own')}")
        for u, x in zip(c.unknowns, hypothesis.theta[hypothesis.columns(c)], strict=True):
            shown.append(f"{u.name} {float(u.value(x)):.3g}{unit_of(u.unit)}")
    return ", ".join(shown)
