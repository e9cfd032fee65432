"""The report of the main study, Markdown and HTML: every sentence and number is computed from the results."""

import math
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from bicycle.default_sd import CORNERING_STIFFNESS
from studies.main_study.answer import Answer, begins
from studies.main_study.bands import FASTER_THAN_WEAVE, KMH, WOBBLE, UncertainCriticalSpeed
from studies.main_study.cases import TyreCase
from studies.main_study.decompose import CRITICAL, DAMPING
from studies.main_study.figure_headline import assumed as world
from studies.main_study.published import compared
from studies.main_study.report_checks import check_table, check_words, exact_words, share_table
from studies.main_study.report_numbers import plain_range
from studies.main_study.report_tables import (
    band_table,
    hinge_table,
    lag_table,
    mode_table,
    parts_table,
    posture_table,
    published_table,
    tyre_table,
    weave_table,
    worlds_table,
)
from studies.main_study.settings import CAMBER_RANGE, CONTACT_LENGTH
from studies.main_study.solve import RIDDEN, Result
from studies.main_study.study import Study
from studies.reporting.made_by import made_by
from studies.reporting.markdown_text import page as html_page
from studies.reporting.markdown_text import rendered
from tyre.base.files import write_text
from tyre.base.units import PASCAL_PER_BAR


def write_report(study: Study, answer: Answer, folder: Path, *, paper_figures: Sequence[str]) -> tuple[Path, Path]:
    """Write report.md and report.html into ``folder``, beside the figures they show.

    ``paper_figures`` are the names of the redraws that were made.
    """
    source = _template("report.md.j2")
    titles = re.findall(r"^## (.+)$", source, re.MULTILINE)
    shown = context(study, answer) | {
        "paper_figures": paper_figures, "sections": [(title, anchor(title)) for title in titles if title != "Contents"],
    }  # fmt: skip
    text = rendered(source, shown).rstrip() + made_by()
    made = html_page(
        _template("report.html.j2"), title=f"velotyre: {study.settings.bicycle.name}", text=text,
        extensions=("tables", "toc"), extension_configs={"toc": {"slugify": lambda t, _: anchor(t)}},
    )  # fmt: skip
    markdown_file, html_file = folder / "report.md", folder / "report.html"
    write_text(markdown_file, text)
    write_text(html_file, made)
    return markdown_file, html_file


def anchor(title: str) -> str:
    """What a link to the section ``title`` ends in, as Markdown viewers make it."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower().replace("'", "").replace("?", "").replace(".", "")).strip("-")


def context(study: Study, answer: Answer) -> dict[str, Any]:
    """What the template shows."""
    settings = study.settings
    return {
        "question": answer.question, "sentences": answer.sentences, "why": answer.why,
        "headline_words": f"Speeds of unstable wobble, {settings.reference.label}",
        "world_label": world(study, settings.reference).capitalize(), "band_table": band_table(study),
        "fastest": f"{settings.fastest:g}", "fastest_kmh": f"{KMH * settings.fastest:.0f}",
        "ridden": f"{RIDDEN[0]:g} to {RIDDEN[1]:g}", "counted_as_wobble": counted_as_wobble(study),
        "worlds_table": worlds_table(study), "hinge_intro": hinge_intro(study),
        "hinge_table": hinge_table(study),
        "lag_words": lag_words(study), "lag_table": lag_table(study), "posture_words": posture_words(study),
        "posture_table": posture_table(study), "published_table": published_table(study),
        "published_words": published_words(study), "report_speed": f"{settings.report_speed:g}",
        "critical_parts": parts_table(study, CRITICAL, ", m/s", 3), "damping_parts": parts_table(study, DAMPING, "", 5),
        "mode_table": mode_table(study.of(settings.reference)), "weave_table": weave_table(study),
        "exact_words": exact_words(study), "share_table": share_table(study),
        "check_words": check_words(study), "check_table": check_table(study), "assumed": assumed(study),
        "extrapolated": extrapolated_words(study.cases), "left_out": left_out(study),
        "tyre_sources": tyre_sources(study.cases), "tyre_table": tyre_table(study.cases), "notes": notes(study.cases),
        "setups": [(k, setup.label, setup.front is not None) for k, setup in enumerate(settings.setups, 1)],
    }  # fmt: skip


def counted_as_wobble(study: Study) -> str:
    """Say which oscillations count as wobble, where tracking cannot tell."""
    others = {c.mode for r in study.results for c in _edges(r, study.settings.fastest) if c.mode != WOBBLE}
    if not others:
        return ""
    names = "; ".join(sorted(name.replace("+", " or ").replace("_", " ") for name in others))
    return (
        f"What could as well be another mode by its tracking ({names}) counts as wobble at {FASTER_THAN_WEAVE:g} Hz or "
        "more."
    )


def _edges(result: Result, limit: float) -> list[UncertainCriticalSpeed]:
    """Ends of the bands of unstable wobble that begin up to ``limit`` (m/s)."""
    return [edge for band in result.bands(limit) for edge in (band.start, band.end) if edge]


def hinge_intro(study: Study) -> str:
    """What is varied around."""
    return (
        f"One thing is changed at a time, on {study.focus.name} ({study.focus.condition}), around "
        f"{study.settings.reference.label}. Ranked "
        f"by the change of the least damping ratio of wobble at {RIDDEN[0]:g} to {RIDDEN[1]:g} m/s (below zero: it "
        f"grows)."
    )


def lag_words(study: Study) -> str:
    """The wavelength of wobble in relaxation lengths, case by case."""
    if CONTACT_LENGTH in study.settings.further:
        return "The tyres are no single lag here: the model file gives them a contact with a length."
    found = []
    for r in study.of(study.settings.reference):
        for edge in _edges(r, study.settings.fastest):
            wave = edge.speed / edge.frequency_hz
            found.append((wave / float(r.case.contact[3]), wave, edge, r.case))
    if not found:
        return "There is no unstable wobble whose wavelength could be compared with the relaxation length."
    least, wave, edge, case = min(found, key=lambda one: one[0])
    return (
        "The model answers slip with a first-order lag over one relaxation length. That is a fair description of "
        f"wavelengths many times longer. The shortest wobble at an edge of a band here is {wave:.2f} m long "
        f"({case.name}, {case.condition}, {edge.speed:.1f} m/s), {least:.1f} relaxation lengths of the front tyre. "
        "Below, the tyre "
        "in question is a stretched string in contact over a length (effect contact_length), with the same measured "
        "cornering and lateral stiffness."
    )


def posture_words(study: Study) -> str:
    """How much the posture moves wobble, beside the pressure."""
    if not study.postures:
        return "This bicycle has no rider whose posture could be changed here (see velotyre run --rider)."
    damping = [one.end.least.damping_ratio for one in study.postures if one.end and one.end.least]
    words = f"The same rider in other postures, on {study.focus.name} ({study.focus.condition}) at the loads of each."
    if len(damping) > 1:
        words += f" The least damping ratio changes by {max(damping) - min(damping):.3f} between them"
        pressure = next((one for one in study.hinges if one.what == "pressure"), None)
        words += f", by {pressure.size:.3f} between the pressures of this tyre." if pressure else "."
    return words


def hands_on_words(study: Study) -> str:
    """How many of the random bicycles with plausible fronts and arms wobble with hands on."""
    result = study.result(study.settings.setups[1], study.focus)
    outer = study.outer(result) if result else None
    onset = outer.likely("onset") if outer else None
    if result is None or outer is None or onset is None or result.span(study.settings.fastest):
        return ""
    return (
        f" Hands on, the bicycle of this study does not wobble up to {study.settings.fastest:g} m/s "
        f"({study.focus.condition}), "
        f"but of {outer.count} with plausible fronts and arms {begins(outer, *onset)}."
    )


def published_words(study: Study) -> str:
    """How many of the comparable ranges agree, and the likely reasons where not."""
    every = [one for one in compared(study) if one.ours is not None]
    inside = sum(one.verdict == "inside" for one in every)
    partly = sum(one.verdict == "partly inside" for one in every)
    words = f"Of {len(every)} ranges that can be compared, ours lie inside {inside}, partly inside {partly}."
    words += hands_on_words(study)
    hands = [one for one in every if one.finding.hands == "on" and one.verdict == "outside"]
    if hands:
        words += (
            " Hands on, the arms of this study are a lumped inertia, spring and damper at the steering; the papers "
            "have arms with joints on a moving body, so that frequency and shape differ."
        )
    lengths = [one for one in every if one.finding.quantity == "relaxation_length_mm" and one.verdict == "outside"]
    if lengths:
        words += (
            " The relaxation lengths of this study are other than those measured on asphalt; what a longer one does is "
            "what less air does, more of it."
        )
    return words


def extrapolated_words(cases: Sequence[TyreCase]) -> str:
    """Name every condition that lies outside the measurements, or say that none does."""
    outside = [
        f"{case.name}, {wheel} wheel at {p.load:.0f} N, {p.pressure / PASCAL_PER_BAR:g} bar"
        for case in cases for wheel, p in zip(("rear", "front"), case.properties, strict=False) if not p.inside
    ]  # fmt: skip
    if not outside:
        return "Nothing is extrapolated: wheel loads and pressures lie inside what was measured."
    lines = "\n".join(f"- {line}" for line in outside)
    return (
        "These tyre values lie outside the measured loads or pressures; what depends on them is hatched in the figures "
        f"and marked in the tables:\n\n{lines}{guessed(cases)}"
    )


def guessed(cases: Sequence[TyreCase]) -> str:
    """Which tyres are extrapolated so far that their values are guesses."""
    far = dict.fromkeys(case.name for case in cases if case.out_of_reach)
    if not far:
        return ""
    return (
        f"\n\nOf {', '.join(far)} some loads or pressures are farther outside than the measured range is wide: what "
        "stands here for them is a guess."
    )


def left_out(study: Study) -> str:
    """What could not be computed."""
    if not study.left_out:
        return "Nothing is left out."
    return "Left out, because it could not be computed:\n\n" + "\n".join(f"- {line}" for line in study.left_out)


def assumed(study: Study) -> list[str]:
    """Assumptions of this run."""
    settings = study.settings
    front, arms = settings.front, settings.arms
    lines = [
        f"Flexible front, {'as the model file gives it' if front.given else 'assumed'}: {front.words}.",
        f"Hands on the bar, {'as the model file gives them' if arms.given else 'assumed'}: {arms.inertia:g} kg m², "
        f"{arms.stiffness:g} N m/rad, {arms.damping:g} N m s/rad at the steering; hands off: nothing.",
        "Plausible fronts: " + ", ".join(
            f"{name.replace('_', ' ')} {low:g} to {high:g}" for name, (low, high) in vars(settings.ranges).items()
        ) + " (SI units; hinge as a shift).",
    ]  # fmt: skip
    if "camber_thrust" not in settings.further:
        lines.append(
            f"Camber stiffness {settings.camber_share:g} × static load per radian on both wheels, lagging with the "
            f"slip force; measured: {CAMBER_RANGE[0]:g} to {CAMBER_RANGE[1]:g} (Dressel 2013)."
        )
    lines += [f"{name} as the model file gives it." for name in settings.further]
    lines += [
        "The rear frame with whatever it carries is one rigid body.",
        length_words(study.cases),
        "A value between measured conditions adds the misfit of a smooth law to its uncertainty.",
        *(
            f"No {what}." for name, what in (
                ("pneumatic_trail", "aligning moment"), ("aerodynamic_drag", "aerodynamic drag"),
                ("wheel_compliance", "wheel compliance: the laboratory's rim was stiff, and a spoked wheel in series "
                 "would lengthen the relaxation length"),
            ) if name not in settings.further
        ),
        *(f"Warning of the bicycle's data: {warning}" for warning in settings.bicycle.warnings),
    ]  # fmt: skip
    return lines


def length_words(cases: Sequence[TyreCase]) -> str:
    """How sure the relaxation lengths are, and what their standard deviations are made of."""
    sds = [1e3 * math.sqrt(case.covariance[k, k]) for case in cases for k in (1, 3)]
    return (
        "The paper's 3 mm is one standard deviation of its relaxation lengths, carried by the lateral stiffness; the "
        f"{100 * CORNERING_STIFFNESS:g} % assumed of a cornering stiffness whose table states none, and the way "
        "between measured conditions, add to it: "
        f"{plain_range(sds, '.1f')} mm at the loads of this bicycle."
    )


def tyre_sources(cases: Sequence[TyreCase]) -> str:
    """Whose tyres these are."""
    packaged = list(dict.fromkeys(case.name for case in cases if case.packaged))
    own = list(dict.fromkeys(case.name for case in cases if not case.packaged))
    words = []
    if own:
        words.append(f"{', '.join(own)}: yours.")
    if packaged:
        words.append(f"{', '.join(packaged)}: tables of Dell'Orto, Ballo, Mastinu & Gobbi.")
    return " ".join(words)


def notes(cases: Sequence[TyreCase]) -> list[str]:
    """What the tyre data say about themselves, each once per tyre and surface."""
    lines = {f"{case.name}: {note}": None for case in cases for p in case.properties for note in p.notes}
    return list(lines)


def _template(name: str) -> str:
    return resources.files("studies.main_study").joinpath("templates", name).read_text(encoding="utf-8")
