"""Names of models and hypotheses, and how numbers are shown: the same in figures, tables and sentences."""

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any

from bicycle.effects.effect import Effect
from studies.inference import RULES, Candidate, Judgement, Moved, Verdict
from studies.inference.verdict import FAR_AHEAD
from studies.reporting.markdown_text import cell, cells, make_environment

BASE, ADJUSTED = "base model", "parameters re-estimated"


def said(hypothesis: str) -> str:
    """Name of a ``hypothesis`` of the engine (``a+b``, ``none``) in words."""
    return ADJUSTED if hypothesis == "none" else hypothesis.replace("+", " + ")


def listed(names: Iterable[str], last: str = "and") -> str:
    """Some ``names`` in a row, with an "and" before the last."""
    *most, end = names
    return f"{', '.join(most)} {last} {end}" if most else end


def plain_name(hypothesis: str, titles_: Mapping[str, str]) -> str:
    """Name of a ``hypothesis``, each effect with its plain name (``titles_`` by identifier) before it if it has one."""
    effects = hypothesis.split("+")
    return " + ".join(f"{titles_[effect]} ({effect})" if effect in titles_ else said(effect) for effect in effects)


def alternatives(hypotheses: Sequence[str], last: str = "or", titles_: Mapping[str, str] | None = None) -> str:
    """Plain names of ``hypotheses`` in a row; of more than three, two and how many more there are."""
    names = [plain_name(hypothesis, titles_ or {}) for hypothesis in hypotheses]
    return listed(names, last) if len(names) <= 3 else f"{', '.join(names[:2])} {last} {len(names) - 2} more"


def titles(judgement: Judgement) -> dict[str, str]:
    """The models of a ``judgement`` that differ, in the order of the story, and their names."""
    labels, final, null = {"nominal": BASE}, judgement.final, judgement.hypotheses.null
    if final is null:
        return labels | ({"nuisance_only": ADJUSTED} if judgement.kind.nuisances else {})
    nuisances = bool(judgement.kind.nuisances)
    count = len(final.candidates)
    name = said(final.name) if len(final.name) < 25 else f"{count} effect{'s' if count > 1 else ''}"
    labels |= {"effect_alone": f"+ {name} alone"} if judgement.alone is not None and nuisances else {}
    labels["final"] = f"+ {name}, {ADJUSTED}" if nuisances else f"+ {name}"
    return labels | ({"nuisance_only": f"without {name}, {ADJUSTED}"} if nuisances else {})


PARAMETERS = {"c": "trail", "lam": "steer axis tilt", "w": "wheelbase", "mB": "mass of frame and rider"}


def as_moved(m: Moved) -> dict[str, str]:
    """Value now, stated value and stated sd of a parameter and their unit, to the digits that the sd bears.

    In mm or degrees where these are more familiar.
    """
    factor, unit = 1.0, m.unit
    if unit == "m" and max(abs(m.value), abs(m.prior)) < 0.2:
        factor, unit = 1e3, "mm"
    elif unit == "rad":
        factor, unit = math.degrees(1.0), "deg"
    sd = factor * m.prior_sd
    new_value, stated_value = (to_sd(factor * x, sd) for x in (m.value, m.prior))
    return {"now": new_value, "stated": stated_value, "sd": number(sd, 2), "unit": unit_of(unit)}


def bar(value: float, most: float) -> str:
    """A bar of signs for a chi^2 ``value`` per data point on a logarithmic scale from noise (1) to ``most``."""
    return "#" * max(1, round(40 * math.log(max(value, 1.0)) / math.log(max(most, 10.0))))


def unit_of(unit: str) -> str:
    """A ``unit`` behind a number: nothing for a pure number."""
    return "" if unit in ("", "1") else f" {unit}"


def percent(share: float) -> str:
    """A ``share`` of a discrepancy in whole percent; a smaller one than that in words."""
    return f"{100 * share:.0f} %" if share == 0 or share >= 0.01 else "less than 1 %"


def upper_first(text: str) -> str:
    """A ``text`` with a capital at its beginning; the rest as it is."""
    return text[:1].upper() + text[1:]


def probability(share: float) -> str:
    """A ``share`` between 0 and 1: two digits, or as many nines as are needed; never nothing."""
    if share < 1e-99:  # a number of the computer may be too small to hold it
        return "< 1e-99"
    if 0.99 <= share < 1:
        return f"{share:.{-math.floor(math.log10(1 - share))}f}" if 1 - share > 1e-6 else "1"
    return f"{share:.2g}"


def compared(share: float) -> str:
    """A probability after the name of it: ``= 0.04`` or ``< 1e-99``."""
    shown = probability(share)
    return shown if shown.startswith("<") else f"= {shown}"


def number(value: float, digits: int) -> str:
    """A ``value`` with so many significant ``digits``, without an exponent from 1e-4 to 1e7."""
    if value == 0 or not 1e-4 <= abs(value) < 1e7:
        return f"{value:.{digits}g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{round(value, places):.{max(places, 0)}f}"


def to_sd(value: float, sd: float) -> str:
    """A ``value`` to the second digit of its ``sd``, as :func:`number` prints that; to three digits without one."""
    if not (math.isfinite(sd) and sd > 0):
        return number(value, 3)
    places = 1 - math.floor(math.log10(sd))
    if 1e-4 <= sd < 1e7:
        return f"{round(value, places) + 0.0:.{max(places, 0)}f}"  # no -0
    digits = places + math.floor(math.log10(abs(value))) + 1 if value else 1
    return f"{value:.{max(digits, 1)}g}"


def shift(value: float) -> str:
    """A shift in standard uncertainties, with its sign unless it prints as zero."""
    return f"{value:+.1f}" if abs(value) >= 0.05 else "0.0"


def misfit(value: float) -> str:
    """A chi^2 ``value``: with a decimal if that counts."""
    return f"{value:.1f}" if value < 1e4 else f"{value:.0f}"


def without_number(candidate: Candidate) -> str:
    """Words for a ``candidate`` of which nothing is fitted: its stated sizes, or that it has no number."""
    effect, sizes = candidate.effect, []
    if isinstance(effect, type) and issubclass(effect, Effect):  # rigs have others
        entries = [(p, entry, f"{effect.identifier}.{entry}") for p in effect.parameters for entry in p.entries()]
        sizes = [
            f"{entry} {number(candidate.fixed[key], 4)}{unit_of(p.unit)}"
            for p, entry, key in entries
            if p.neutral is not None and key in candidate.fixed
        ]
    if sizes:
        return f"{', '.join(sizes)}, as stated: not fitted"
    integrated = {"bias": "a constant in each run", "drift": "a constant and a trend in each run"}
    integrated_words = integrated.get(candidate.identifier.rpartition("/")[2])
    return f"{integrated_words}, integrated out" if integrated_words else "without a parameter"


def fate(judgement: Judgement) -> dict[str, str]:
    """Outcome for the hypotheses of a ``judgement``, by the engine's name; nothing for those without one."""
    verdict = judgement.verdict
    refusals = {name: str(rule) for name, _, rule in verdict.refused_leaders}
    for f in judgement.hypotheses.fits:
        faults = [*f.sizes_at_bound(), *f.sizes_beyond_usual()]
        if not f.converged:
            faults.append("did not converge")
        if faults:
            refusals.setdefault(f.name, ", ".join(dict.fromkeys(faults)))
    outcomes = {name: f"refused: {why}" for name, why in refusals.items()} | dict.fromkeys(
        verdict.equivalent, "not ruled out"
    )
    if verdict.verdict not in ("unknown", "partial"):
        outcomes[judgement.final.name] = "leads" if verdict.equivalent else "explains the data"
    return outcomes


def _line(text: Any) -> Any:
    """A ``text`` of a template on one line, without repeated blanks."""
    return type(text)(" ".join(str(text).split()))


def term_name(name: str) -> str:
    """A coefficient of the unmodelled torque in words: ``steer torque from lean rate, slope``."""
    torque, _, state = name.partition("_from_")
    for degree in ("slope", "curve"):
        state = state.replace(f"_{degree}", f", {degree}")
    return f"{torque} torque from {state.replace('_', ' ')}"


def render(template: str, *, markdown: bool = False, **content: Any) -> str:
    """Fill a ``template`` of this package with the ``content``, escaped if it is ``markdown``, without empty ends."""
    text = _environment(markdown=markdown).get_template(template).render(**content)
    lines = [line.rstrip() for line in text.splitlines()]
    return "\n".join(line for k, line in enumerate(lines) if line or (k and lines[k - 1])).strip()


@cache  # a template takes longer to compile than to fill
def _environment(*, markdown: bool) -> Any:
    from markupsafe import Markup

    environment = make_environment("studies.diagnosis", escaped=markdown, trim_blocks=True, lstrip_blocks=True)
    names = (said, listed, plain_name, alternatives, term_name, upper_first)
    filters = (*names, unit_of, probability, compared, percent, number, to_sd, shift, misfit, cells, as_moved, bar)
    environment.filters |= {filter_.__name__: filter_ for filter_ in filters}
    environment.filters |= {"line": _line, "cell": lambda text: Markup(cell(text))}
    environment.globals |= {"rules": RULES, "parameters": PARAMETERS, "far_ahead": FAR_AHEAD, "most_similar": 3}
    return environment


def sentence(verdict: Verdict) -> str:
    """The ``verdict`` as a sentence."""
    return render("one.txt.j2", macro="sentence", v=verdict, f=None)
