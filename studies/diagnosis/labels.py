"""Names of models and hypotheses, and how numbers are shown: the same in figures, tables and sentences."""

import math
from collections.abc import Iterable
from typing import Any

from bicycle.effect import Effect
from studies.inference import RULES, Candidate, Fit, Judgement, Verdict
from studies.reporting.markdown_text import cell, cells, make_environment

BASE, ADJUSTED = "base model", "parameters only"


def said(hypothesis: str) -> str:
    """Name of a ``hypothesis`` of the engine (``a+b``, ``none``) in words."""
    return ADJUSTED if hypothesis == "none" else hypothesis.replace("+", " + ")


def listed(names: Iterable[str], last: str = "and") -> str:
    """Some ``names`` in a row, with an "and" before the last."""
    *most, end = names
    return f"{', '.join(most)} {last} {end}" if most else end


def titles(judgement: Judgement) -> dict[str, str]:
    """The models of a ``judgement`` that differ, and their names: without parameters or effects there are fewer."""
    found = {"nominal": BASE} | ({"nuisance_only": ADJUSTED} if judgement.kind.nuisances else {})
    if judgement.final is not judgement.hypotheses.null:
        found["final"] = f"with {said(judgement.final.name)}"
    return found


def unit_of(unit: str) -> str:
    """A ``unit`` behind a number: nothing for a pure number."""
    return "" if unit in ("", "1") else f" {unit}"


def probability(share: float) -> str:
    """A ``share`` between 0 and 1: two digits, or as many nines as are needed; never nothing."""
    if share < 1e-99:  # a number of the computer may be too small to hold it
        return "< 1e-99"
    if 0.99 <= share < 1:
        return f"{share:.{-math.floor(math.log10(1 - share))}f}" if 1 - share > 1e-6 else "1"
    return f"{share:.2g}"


def p_value(share: float, digits: int = 2) -> str:
    """A ``share`` behind its sign, never as impossible or certain: ``= 0.03``, ``< 1e-99``, ``> 0.99``."""
    if share < 1e-99:
        return "< 1e-99"
    rounded = f"{share:.{digits}g}"
    return f"> {1 - 10**-digits:g}" if rounded == "1" else f"= {rounded}"


def percent(share: float) -> str:
    """A ``share`` in per cent that is never rounded to all or nothing."""
    digits = 0
    while digits < 4 and 0 < share < 1 and float(f"{100 * share:.{digits}f}") in (0.0, 100.0):
        digits += 1
    return f"{100 * share:.{digits}f} %"


def number(value: float, digits: int) -> str:
    """A ``value`` with so many significant ``digits``, without an exponent from 1e-4 to 1e7."""
    if value == 0 or not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{digits}g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):.{max(places, 0)}f}"


def misfit(value: float) -> str:
    """A chi^2 ``value``: with a decimal if that counts."""
    return f"{value:.1f}" if value < 1e4 else f"{value:.0f}"


def without_number(candidate: Candidate) -> str:
    """Words for a ``candidate`` of which nothing is fitted: its stated sizes, or that it has no number."""
    effect, sizes = candidate.effect, []
    if isinstance(effect, type) and issubclass(effect, Effect):  # rigs have others
        every = [(p, entry, f"{effect.identifier}.{entry}") for p in effect.parameters for entry in p.entries()]
        sizes = [
            f"{entry} {number(candidate.fixed[key], 4)}{unit_of(p.unit)}"
            for p, entry, key in every if p.neutral is not None and key in candidate.fixed
        ]  # fmt: skip
    if sizes:
        return f"{', '.join(sizes)}, as stated: not fitted"
    integrated = {"bias": "a constant in each run", "drift": "a constant and a trend in each run"}
    own = integrated.get(candidate.identifier.rpartition("/")[2])
    return f"{own}, integrated out" if own else "without a number of its own"


def values_of(hypothesis: Fit) -> str:
    """Sizes of the effects of a ``hypothesis`` with their units."""
    shown = []
    for c in hypothesis.candidates:
        if not c.unknowns:
            shown.append(f"{c.identifier}: {without_number(c)}")
        shown += [f"{u.name} {number(float(u.value(x)), 3)}{unit_of(u.unit)}" for u, x in hypothesis.values(c)]
    return ", ".join(shown)


def fate(judgement: Judgement) -> dict[str, str]:
    """Outcome for the hypotheses of a ``judgement``, by the engine's name; nothing for those that are neither."""
    verdict, known, final = judgement.verdict, judgement.hypotheses, judgement.final
    found = dict.fromkeys(verdict.equivalent, "in the class")
    refused = {name: str(rule) for name, _, rule in verdict.refused_leaders}
    for f in known.fits:
        faults = [f"{name.partition('.')[0]} at its bound" for name in f.at_bound()]
        faults += [f"{name.partition('.')[0]} larger than occurs" for name in f.implausible()]
        faults += [] if f.converged else ["the fit did not converge"]
        if f.name in refused:
            found[f.name] = f"refused: {refused[f.name]}"
        elif faults and f.name not in found:
            found[f.name] = f"refused: {', '.join(faults)}"
    if verdict.equivalent:
        word = {"partial": "named in part", "tentative": "named, tentatively"}.get(verdict.verdict, "named")
        found[final.name] = "leads the class" if len(verdict.equivalent) > 1 and word == "named" else word
    elif verdict.verdict == "none":
        found[final.name] = "explains the data"
    return found


def _line(text: Any) -> Any:
    """A ``text`` of a template on one line, without repeated blanks."""
    return type(text)(" ".join(str(text).split()))


def term_name(name: str) -> str:
    """A coefficient of the residual torque in words: ``steer torque from lean rate, slope``."""
    torque, _, rest = name.partition("_from_")
    for degree in ("slope", "curve"):
        rest = rest.replace(f"_{degree}", f", {degree}")
    return f"{torque} torque from {rest.replace('_', ' ')}"


def rendered(template: str, *, markdown: bool = False, **content: Any) -> str:
    """A ``template`` of this room filled with the ``content``, escaped if it is ``markdown``, without empty ends."""
    from markupsafe import Markup

    environment = make_environment("studies.diagnosis", escaped=markdown, trim_blocks=True, lstrip_blocks=True)
    shown = (said, listed, unit_of, probability, p_value, percent, number, misfit, values_of, term_name, cells)
    environment.filters |= {filter_.__name__: filter_ for filter_ in shown}
    environment.filters |= {"line": _line, "cell": lambda text: Markup(cell(text))}
    environment.globals |= {"rules": RULES}
    lines = [line.rstrip() for line in environment.get_template(template).render(**content).splitlines()]
    return "\n".join(line for k, line in enumerate(lines) if line or (k and lines[k - 1])).strip()


def sentence(verdict: Verdict) -> str:
    """The ``verdict`` in words that its figures bear."""
    return rendered("one.txt.j2", macro="sentence", v=verdict, f=None)
