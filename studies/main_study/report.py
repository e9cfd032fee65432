"""The report of the main study, Markdown and HTML: every sentence and number is computed from the results."""

from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.parameters import UNITS
from studies.main_study.cases import TyreCase
from studies.main_study.report_checks import check_table, check_words
from studies.main_study.report_numbers import plain_range, signed, table, with_sd
from studies.main_study.report_words import camber_words, label, printed, summary, tyre_changes
from studies.main_study.solve import COMPARED_MODES, Band, Result
from studies.main_study.study import CRITICAL, DAMPING, Study


def write_report(study: Study, folder: Path, *, paper_figures: Sequence[str]) -> tuple[Path, Path]:
    """Write report.md and report.html into ``folder``, beside the figures they show."""
    from jinja2 import Environment, StrictUndefined
    from markdown import markdown

    templates = Environment(undefined=StrictUndefined, keep_trailing_newline=True, autoescape=False)
    text = templates.from_string(_template("report.md.j2")).render(**context(study), paper_figures=paper_figures)
    body = markdown(text, extensions=["tables"])
    title = f"velotyre: {study.settings.bicycle.name}"
    page = templates.from_string(_template("report.html.j2")).render(title=title, body=body)
    markdown_file, html_file = folder / "report.md", folder / "report.html"
    markdown_file.write_text(text, encoding="utf-8")
    html_file.write_text(page, encoding="utf-8")
    return markdown_file, html_file


def context(study: Study) -> dict[str, Any]:
    """What the template shows."""
    settings = study.settings
    flexible = settings.setups[-1]
    front = settings.front
    return {
        "bicycle": settings.bicycle, "loads": settings.bicycle.static_loads, "setup_label": label(flexible),
        "speeds": f"modes from {settings.speeds[0]:g} to {settings.speeds[-1]:g} m/s, "
                  f"critical speeds up to {settings.max_speed:g} m/s",
        "report_speed": f"{settings.report_speed:g}",
        "tyre_changes": tyre_changes(study), "summary": summary(study),
        "uncertain": settings.uncertain, "band_table": band_table(study.of(flexible), settings.max_speed),
        "mode_table": mode_table(study.of(flexible)),
        "check_words": check_words(study), "check_table": check_table(study),
        "critical_parts": parts_table(study, CRITICAL, ", m/s", 3),
        "damping_parts": parts_table(study, DAMPING, "", 5),
        "camber": camber_words(study),
        "camber_assumed": " and ".join(f"{share:g} × load per radian" for share in settings.camber_shares if share),
        "front": f"a hinge across the steer axis, {front.joint_height:g} m above the ground, stiffness "
                 f"{front.stiffness:g} N m/rad, damping {front.damping:g} N m s/rad",
        "alternatives_intro": alternatives_intro(study), "alternatives": alternatives_table(study),
        "extrapolated": extrapolated_words(study.cases), "assumed": assumed(study),
        "tyre_table": tyre_table(study.cases), "notes": notes(study.cases),
        "setups": [(number, setup.label) for number, setup in enumerate(settings.setups, 1)],
    }  # fmt: skip


def band_table(results: list[Result], max_speed: float) -> str:
    """Unstable wobble and weave per tyre and pressure."""
    rows = [
        [
            r.case.name, f"{r.case.pressure_bar:g}", _bands(r.bands("wobble"), max_speed),
            _frequencies(r.bands("wobble")), _bands(r.bands("weave"), max_speed),
            "yes" if r.case.extrapolated else "no",
        ]
        for r in results
    ]  # fmt: skip
    return table(
        rows, ["tyre", "bar", "unstable wobble, m/s", "its frequency, Hz", "unstable weave, m/s", "extrapolated"]
    )


def mode_table(results: list[Result]) -> str:
    """Frequency and damping ratio of the compared modes per tyre and pressure."""
    rows = [
        [
            r.case.name, f"{r.case.pressure_bar:g}",
            *(
                with_sd(part[mode]) if mode in part else "-"
                for mode in COMPARED_MODES for part in (r.frequency, r.damping)
            ),
        ]
        for r in results
    ]  # fmt: skip
    head = [f"{mode} {what}" for mode in COMPARED_MODES for what in ("frequency, Hz", "damping ratio")]
    return table(rows, ["tyre", "bar", *head])


def parts_table(study: Study, quantity: str, unit: str, digits: int) -> str:
    """Decomposition of the last setup as a table; the printed numbers of a row add up."""
    rows = []
    for d in (d for d in study.decompositions if d.setup == study.settings.setups[-1]):
        for c in (c for c in d.changes if c.quantity == quantity):
            before, after, *parts = printed(c, digits)
            bars = f"{d.higher.pressure_bar:g} → {d.lower.pressure_bar:g}"
            rows.append([d.higher.name, c.name, bars, f"{before}", f"{after}", *map(signed, parts)])
    head = ["tyre", "what", "bar", f"before{unit}", f"after{unit}", "total", "relaxation length", "C", "interaction"]
    return table(rows, head) if rows else "No tyre has the same quantities at both pressures."


def alternatives_table(study: Study) -> str:
    """Unstable wobble with other fronts, both pressures side by side."""
    rows: dict[str, list[str]] = {}
    for a in study.alternatives:
        top = f"beyond {study.settings.max_speed:g}" if a.end is None else f"{a.end:.1f}"
        band = "none" if a.onset is None and a.end is None else f"{a.onset or 0:.1f} – {top}"
        rows.setdefault(a.what, [a.what]).append(band)
    head = [f"{p:g} bar: unstable wobble, m/s" for p in dict.fromkeys(a.case.pressure_bar for a in study.alternatives)]
    return table(list(rows.values()), ["front", *head])


def alternatives_intro(study: Study) -> str:
    """Which tyre and camber thrust the table of other fronts is for."""
    case, share = study.alternatives[0].case, study.settings.camber_shares[-1]
    return (
        f"For {case.name} with a flexible front and camber thrust {share:g} × load, from the first onset to the last "
        "end of unstable wobble:"
    )


def tyre_table(cases: Iterable[TyreCase]) -> str:
    """Tyre numbers at the wheel loads."""
    rows = []
    for case in cases:
        for wheel, p in (("rear", case.rear), ("front", case.front)):
            rows.append([
                case.name, f"{case.pressure_bar:g}", wheel, f"{p.load:.0f}", f"{np.radians(p.cornering_stiffness):.1f}",
                f"{p.lateral_stiffness / 1e3:.1f}",
                f"{1e3 * p.relaxation_length:.1f} ± {1e3 * p.relaxation_length_sd:.1f}", p.origin,
            ])  # fmt: skip
    return table(rows, ["tyre", "bar", "wheel", "load, N", "C, N/deg", "K, N/mm", "relaxation length, mm", "origin"])


def extrapolated_words(cases: Sequence[TyreCase]) -> str:
    """Name every condition that lies outside the measurements, or say that none does."""
    outside = [
        f"{case.name}, {wheel} wheel at {p.load:.0f} N, {case.pressure_bar:g} bar"
        for case in cases for wheel, p in (("rear", case.rear), ("front", case.front)) if not p.inside
    ]  # fmt: skip
    if not outside:
        return "Nothing: both wheel loads and all pressures lie inside the measured range."
    lines = "\n".join(f"- {line}" for line in outside)
    return (
        "These tyre values lie outside the measured loads or pressures; what depends on them is hatched in the figures "
        f"and marked in the tables:\n\n{lines}"
    )


def assumed(study: Study) -> list[str]:
    """Assumptions of this run."""
    shares = [share for share in study.settings.camber_shares if share]
    return [
        "The paper's 3 mm is one standard deviation of the relaxation length; it is carried by the lateral stiffness.",
        "A value between measured conditions adds the misfit of a smooth law to its uncertainty.",
        *(
            f"Camber stiffness {share:g} × static load per radian on both wheels, lagging with the slip force."
            for share in shares
        ),
        bicycle_sd(study),
        "Stiffness, damping and place of the flexible front; rigid front otherwise.",
        "The rear frame with whatever it carries is one rigid body and nothing holds the handlebar.",
        "No aligning moment, no aerodynamic drag, no wheel compliance.",
        "The laboratory's rim was stiff; a spoked wheel in series would lengthen the relaxation length.",
        *(f"Warning of the bicycle's data: {warning}" for warning in study.settings.bicycle.warnings),
    ]  # fmt: skip


def bicycle_sd(study: Study) -> str:
    """Which parameters of the bicycle the standard deviations hold."""
    stated = study.settings.stated_sd
    if not stated:
        return (
            "The bicycle's parameters count as exact, because its file states no standard deviations: every ± and "
            "every band is of the tyre data alone."
        )
    exact = [key for key in UNITS if key not in stated]
    rest = f"; {', '.join(exact)} count as exact" if exact else ""
    return f"The bicycle's file states standard deviations of {', '.join(stated)}, taken as independent{rest}."


def notes(cases: Iterable[TyreCase]) -> list[str]:
    """What the tyre data say about themselves, each once per tyre and surface."""
    lines = {f"{case.name}: {note}": None for case in cases for p in (case.rear, case.front) for note in p.notes}
    return list(lines)


def _bands(bands: Sequence[Band], max_speed: float) -> str:
    if not bands:
        return "none"
    words = []
    for band in bands:
        low = with_sd(band.start) if band.start else "0"
        high = with_sd(band.end) if band.end else f"beyond {max_speed:g}"
        words.append(f"{low} – {high}")
    return "; ".join(words)


def _frequencies(bands: Sequence[Band]) -> str:
    values = [edge.frequency_hz for band in bands for edge in (band.start, band.end) if edge]
    return plain_range(values, ".1f") if values else "-"


def _template(name: str) -> str:
    return resources.files("studies.main_study").joinpath("templates", name).read_text(encoding="utf-8")
