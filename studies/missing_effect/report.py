"""The report of a diagnosis: Markdown, HTML and figures in one folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from bicycle.files.stated_covariance import SECTION
from studies.inference.identifiability import MORE_PROBABLE
from studies.inference.part import OF
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.figures import draw_all
from studies.missing_effect.motion.joint_measurement import of_first
from studies.missing_effect.motion.sensor_errors import GEOMETRY
from studies.missing_effect.reporting import sentences, tables
from studies.missing_effect.reporting.corrected_model import model_text, other_texts, why_none
from studies.missing_effect.reporting.findings import Findings, find
from studies.missing_effect.reporting.sentences import SAYS, plan_note
from studies.missing_effect.reporting.template import CLOSE, NAMED, OPEN, PAGE, SECTIONS, TEMPLATE
from studies.missing_effect.reporting.words import explains, listed, probability, said, titles
from studies.missing_effect.residual import words
from studies.missing_effect.residual.figure import caption, draw_torque
from studies.missing_effect.residual.kept import Kept
from studies.missing_effect.residual.terms import EFFECT
from studies.reporting.made_by import made_by
from studies.reporting.markdown_text import cells, plain, rendered
from studies.reporting.markdown_text import page as html_page
from studies.reporting.output import json_text
from tyre.base.errors import InputError
from tyre.base.files import slugs, write_text

__all__ = ["SAYS", "page", "record", "write_report"]

MOST_FURTHER = 8  # measurements that are proposed
MODEL = "model.toml"


def write_report(diagnosis: Diagnosis, folder: Path, findings: Findings | None = None) -> None:
    """Write ``report.md``, ``report.html``, ``verdict.json``, the figures and, of a bicycle, the corrected model.

    Parameters
    ----------
    diagnosis : Diagnosis
    folder : Path
        It is made where it does not exist.
    findings : Findings, optional
        Found here where they are not given, without judging variants.

    Raises
    ------
    InputError
        A number of the verdict is none; then nothing is written.
    """
    findings = findings or find(diagnosis)
    verdict = json_text(record(diagnosis, findings))  # before anything is written: with a NaN, nothing is
    folder.mkdir(parents=True, exist_ok=True)
    captions = draw_all(diagnosis, folder)
    if findings.kept is not None and draw_torque(findings.kept, folder / EFFECT):
        captions[EFFECT] = caption(findings.kept)
    text = page(diagnosis, findings, captions, corrected=_write_model(diagnosis, findings, folder / MODEL))
    write_text(folder / "report.md", text)
    title = f"What is missing: {diagnosis.measurement.name}"
    extensions = ("tables", "md_in_html")
    write_text(folder / "report.html", html_page(PAGE, title=title, text=text, extensions=extensions))
    write_text(folder / "verdict.json", f"{verdict}\n")


def page(diagnosis: Diagnosis, findings: Findings, captions: Mapping[str, str], *, corrected: str = "") -> str:
    """The report as Markdown.

    Parameters
    ----------
    diagnosis : Diagnosis
    findings : Findings
    captions : mapping of str to str
        Of the figures that there are, by name.
    corrected : str
        What to say of the corrected model.
    """
    content = _content(diagnosis, findings) | {"captions": captions, "corrected": Markup(corrected)}
    text = rendered(TEMPLATE, content)
    lines = [line.rstrip() for line in text.splitlines()]
    return "\n".join(line for k, line in enumerate(lines) if line or (k and lines[k - 1])).rstrip() + made_by()


def record(diagnosis: Diagnosis, findings: Findings) -> dict[str, Any]:
    """The JSON of ``velotyre diagnose``: the verdict of a ``diagnosis`` and its ``findings``."""
    verdict = diagnosis.verdict
    more = {
        "sentence": sentences.sentence(verdict), "reasons": dict(verdict.reasons),
        "refused_leaders": [
            {"hypothesis": name, "probability": share, "rule": rule} for name, share, rule in verdict.refused_leaders
        ],
    }  # fmt: skip
    odd = {"parts": [one.part for one in findings.odd], "sentence": sentences.odd_note(diagnosis, findings)}
    return {"odd_part": odd if findings.odd else None, **verdict.to_dict(), **more, **findings.to_dict()}


def _content(diagnosis: Diagnosis, findings: Findings) -> dict[str, Any]:
    verdict, measurement = diagnosis.verdict, diagnosis.measurement
    not_tried: dict[str, list[str]] = {}
    for name, reason in verdict.refused.items():
        not_tried.setdefault(reason, []).append(name)
    models = titles(diagnosis)
    absent = "no gap to close" if verdict.held_out_gap["nominal"] is None else "not known, one run"
    gaps = [
        f"{models[name]} {absent if value is None else format(value, '.2f')}"
        for name, value in verdict.held_out_gap.items()
        if name in models
    ]
    moved = tables.moved(diagnosis, findings.moved)
    mimics = [m for m in verdict.mimics if m.chi2 < verdict.chi2["final"]]
    gone = {"still": not moved[1], "mimics": not mimics}
    rows = Markup("\n".join(f"| {cells(row)} |" for row in tables.named(diagnosis)))
    note = Markup(plain(sentences.named_note(diagnosis)))
    return {
        "v": verdict, "f": findings, "name": measurement.name, "sentence": sentences.sentence(verdict),
        "description": measurement.description, "source": measurement.source, "said": said,
        "probability": probability, "closing": sentences.closing(diagnosis), "moved": moved,
        "went": [f"moved, {title}" for title in list(models.values())[1:]],
        "limits": tables.limited(findings.limits), "limits_note": sentences.limits_note(diagnosis),
        "further": findings.further[:MOST_FURTHER], "next_note": sentences.next_note(findings) + plan_note(diagnosis),
        "stability_note": sentences.stability_note(findings),
        "varied": tables.varied(findings.stability) if findings.stability else [], "gaps": ", ".join(gaps),
        "fitting": sentences.fitting(diagnosis), "parts": tables.by_place(diagnosis), "models": list(models.values()),
        "tried": tables.tried(diagnosis), "not_tried": not_tried, "mimics": mimics,
        "ahead": any(why.startswith(MORE_PROBABLE) for why in list(verdict.reasons.values())[1:]),
        "compared": explains(diagnosis.final), "close": Markup(CLOSE),
        "named_table": lambda: Markup(NAMED).format(rows=rows, note=note),
        "contents": [(anchor, title) for anchor, title in SECTIONS.items() if not gone.get(anchor)],
        "together": tables.together(diagnosis, findings.parts), "compared_parts": tables.compared(findings.parts),
        "parts_lines": sentences.parts_lines(diagnosis, findings), "odd_note": sentences.odd_note(diagnosis, findings),
        "unseen_note": sentences.unseen_note(findings),
        "predicted": tables.predicted(diagnosis, findings.predicted),
        "predictors": list(tables.predictors(diagnosis, findings.predicted).values()),
        "predicted_note": sentences.predicted_note(findings) if findings.predicted else "",
        "open": lambda anchor: Markup(OPEN).format(anchor=anchor, title=SECTIONS[anchor]),
        **_of_kept(findings.kept),
    }  # fmt: skip


def _of_kept(kept: Kept | None) -> dict[str, Any]:
    """What is said of what could not be named."""
    if kept is None:
        return {"without_torque": ""}
    said_of_it: dict[str, Any] = {
        "kept_note": words.sentence(kept), "kept_rows": words.coefficients(kept),
        "kept_amplitude": words.amplitude_note(kept.amplitude), "without_torque": "",
    }  # fmt: skip
    if kept.residual is not None:
        scale = kept.residual.scale
        said_of_it |= {
            "kept_speeds": f"{scale.middle:.3g} ± {scale.span:.3g} m/s",
            "kept_critical_note": words.critical_note(kept.critical),
            "kept_critical": words.critical_rows(kept.critical),
            "without_torque": ", without the residual torque",
        }
    return said_of_it


def _write_model(diagnosis: Diagnosis, findings: Findings, target: Path) -> str:
    """Write the corrected model of a bicycle; says so, or why there is none, and nothing of a tyre."""
    residual = findings.kept.residual if findings.kept is not None else None
    if none := why_none(diagnosis, residual):
        return plain(none)
    text = model_text(diagnosis, residual)
    if not text:
        return ""
    write_text(target, text)
    others = _write_others(diagnosis, target.parent)
    final = of_first(diagnosis.final)
    added = plain(explains(final)) if final.candidates else "nothing"
    outside = [c.identifier for c in final.candidates if c.effect is None]
    left = [name for name in outside if name.rpartition(OF)[2] not in GEOMETRY]
    errors = f" ({plain(', '.join(left))} lies in the measurement and is left out)" if left else ""
    kept = "" if residual is None else (
        f" Its values are those of the fit with what could not be named, which it holds as `{EFFECT}`."
    )  # fmt: skip
    if f"[{SECTION}]" in text:
        kept += f" It holds the covariance of all that was fitted, which `velotyre uncertainty {MODEL}` takes."
    return (
        f"[`{MODEL}`]({MODEL}) is the base model with its parameters adjusted and {added} added{errors}; every other "
        f"command reads it: `velotyre modes {MODEL} --speeds 2:10:1`.{kept}{others}"
    )


def _write_others(diagnosis: Diagnosis, folder: Path) -> str:
    """Write the corrected model of each further bicycle; says so, or why there is none."""
    try:
        texts = other_texts(diagnosis)
    except InputError as error:
        return f" There is no corrected model of the other bicycles: {plain(str(error))}"
    files = {name: f"model_{stem}.toml" for name, stem in slugs(texts).items()}
    for name, file in files.items():
        write_text(folder / file, texts[name])
    links = [f"[`{file}`]({file}) of {plain(name)}" for name, file in files.items()]
    return f" It is of the bicycle at the top; of the others there is {listed(links)}." if links else ""
