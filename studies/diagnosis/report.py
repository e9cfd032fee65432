"""The report of a diagnosis: Markdown, HTML, figures, verdict.json and corrected models in one folder."""

from collections.abc import Mapping
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model_file import SECTION
from studies.diagnosis.corrected_model import Corrected, corrected
from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.figures import MOST_SERIES, draw_all, residuals
from studies.diagnosis.findings import Findings, Predicted, find
from studies.diagnosis.labels import (
    fate,
    misfit,
    number,
    percent,
    rendered,
    said,
    sentence,
    titles,
    unit_of,
    without_number,
)
from studies.diagnosis.mistakes import GEOMETRY
from studies.diagnosis.residual import EFFECT, Residual
from studies.diagnosis.residual_figure import CAPTION, draw_torque
from studies.inference import OF, Fit, Judgement, Verdict
from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import page as html_page
from studies.reporting.output import json_text
from tyre.files import slugs, write_text

SECTIONS = {
    "places": "Where the gap is", "tried": "Hypotheses", "rules": "Rules",
    "still": "Parameters that stayed", "mimics": "Terms without a cause", "assumptions": "Assumptions",
}  # fmt: skip


def write_report(diagnosis: Diagnosis, folder: Path, findings: Findings | None = None) -> None:
    """Write ``report.md``, ``report.html``, ``verdict.json``, the figures and, of bicycles, the corrected models."""
    findings = findings or find(diagnosis)
    verdict = json_text(record(diagnosis, findings))  # before anything is written: with a NaN, nothing is
    folder.mkdir(parents=True, exist_ok=True)
    captions = draw_all(diagnosis, folder)
    if findings.torque is not None:
        draw_torque(findings.torque, folder / EFFECT)
        captions[EFFECT] = CAPTION
    made = corrected(diagnosis, findings.torque)
    for name, file in model_files(made).items():
        write_text(folder / file, made.texts[name])
    text = page(diagnosis, findings, captions, made)
    write_text(folder / "report.md", text)
    template = (Path(__file__).parent / "templates" / "page.html.j2").read_text(encoding="utf-8")
    title = f"What is missing: {diagnosis.kind.name}"
    html = html_page(template, title=title, text=text, extensions=("tables", "md_in_html"))
    write_text(folder / "report.html", html)
    write_text(folder / "verdict.json", f"{verdict}\n")


def model_files(made: Corrected) -> dict[str, str]:
    """File of each corrected model, by bicycle."""
    others = {name: f"model_{stem}.toml" for name, stem in slugs([name for name in made.texts if name]).items()}
    return {name: others.get(name, "model.toml") for name in made.texts}


def page(diagnosis: Diagnosis, findings: Findings, captions: Mapping[str, str], made: Corrected | None = None) -> str:
    """The report as Markdown, with ``captions`` of the figures that there are, by name."""
    verdict, kind = diagnosis.verdict, diagnosis.kind
    content = _common(diagnosis, findings, made or Corrected({}))
    far = [m for m in findings.moved if max(abs(m.shift), abs(m.alone)) > 0.5]
    near = [m for m in findings.moved if m not in far]
    gone = [anchor for anchor, rows in (("still", near), ("mimics", content["mimics"])) if not rows]
    names = titles(diagnosis)
    not_tried: dict[str, list[str]] = {}
    for name, reason in verdict.refused.items():
        not_tried.setdefault(reason, []).append(name)
    text = rendered(
        "report.md.j2", markdown=True, **content, name=kind.name, description=kind.description,
        source=kind.source, captions=captions, titles=list(names.values()), far=far, near=near,
        sections={anchor: title for anchor, title in SECTIONS.items() if anchor not in gone},
        sd_ratio=_sd_ratio(diagnosis), parts=_parts(diagnosis, findings), places=_places(diagnosis),
        tried=_tried(diagnosis), fates=fate(diagnosis), not_tried=not_tried,
        gaps={names[m]: gap for m, gap in verdict.held_out_gap.items() if m in names},
        absent="no gap to close" if verdict.held_out_gap["nominal"] is None else "not known, one run",
    )  # fmt: skip
    return text + made_by()


def terminal(diagnosis: Diagnosis, findings: Findings, place: str = "") -> str:
    """Text for the terminal; the report is at ``place``."""
    from tabulate import tabulate

    content = _common(diagnosis, findings, corrected(diagnosis, findings.torque))
    rows = [row[:-1] for row in content["named_rows"]]
    table = tabulate(rows, ["effect", "parameter", "value", "1 sd"], disable_numparse=True)
    gap = [
        [title, misfit(chi2), percent(share) if k else "-"]
        for k, (title, chi2, share) in enumerate(content["explained"])
    ]
    explained = tabulate(
        gap, ["model", f"chi^2 of {diagnosis.verdict.chi2['n']} values", "share explained"], disable_numparse=True
    )
    text = rendered(
        "terminal.txt.j2", **content, place=place, named_table=table, explained_table=explained
    ).replace("χ²", "chi^2")  # fmt: skip
    return "\n".join(line for line in text.splitlines() if line)


def _common(diagnosis: Diagnosis, findings: Findings, made: Corrected) -> dict[str, Any]:
    """Values of both templates."""
    verdict = diagnosis.verdict
    first = diagnosis.kind.bicycles(diagnosis.final).get("", (None, diagnosis.final))[1]
    base = verdict.chi2["nominal"]
    explained = [
        (title, verdict.chi2[model], 1 - verdict.chi2[model] / base if base > 0 else 0.0)
        for model, title in titles(diagnosis).items()
    ]
    outside = [c.identifier for c in first.candidates if c.effect is None]
    return {
        "d": diagnosis, "v": verdict, "f": findings, "made": made, "files": model_files(made), "added": first.name,
        "left": [name for name in outside if name.rpartition(OF)[2] not in GEOMETRY],
        "covariance": f"[{SECTION}]" in made.texts.get("", ""), "named_rows": named_rows(diagnosis),
        "explained": explained, "predictors": predictors(diagnosis, findings.predicted),
        "mimics": [m for m in verdict.mimics if m.chi2 < verdict.chi2["final"]],
    }  # fmt: skip


# ---------------------------------------------------------------------- tables


def named_rows(judgement: Judgement) -> list[list[str]]:
    """Effect, parameter, value, one sd and what it does, of what is named."""
    table, tried = [], {c.identifier: c for c in (*judgement.kind.candidates, *judgement.final.candidates)}
    for e in judgement.verdict.effects:
        if not e.parameters:
            table.append([e.identifier, "-", without_number(tried[e.identifier]), "-", e.signature])
        for k, (name, (value, sd)) in enumerate(e.parameters.items()):
            unit = unit_of(e.units.get(name, "1"))
            sized = [f"{number(value, 4)}{unit}", f"± {number(sd, 2)}{unit}"]
            table.append([e.identifier if not k else "", name, *sized, e.signature if not k else ""])
    return table


def predictors(judgement: Judgement, found: tuple[Predicted, ...]) -> dict[str, str]:
    """The models that runs were predicted by, and their names; with a residual torque one more."""
    more = any("with_torque" in one.chi2 for one in found)
    return titles(judgement) | ({"with_torque": "and the residual torque"} if more else {})


def _parts(judgement: Judgement, findings: Findings) -> list[tuple[Any, int, list[float]]]:
    """Each part of joint data with its numbers and the chi^2 of the models."""
    models = residuals(judgement)
    slices = judgement.kind.slices() if findings.parts else []
    return [
        (part, rows.stop - rows.start, [float(r[rows] @ r[rows]) for r in models.values()])
        for part, rows in zip(findings.parts, slices, strict=True)
    ]


def _places(judgement: Judgement) -> list[tuple[str, int, list[float]]]:
    """Numbers and chi^2 of the models by series, by condition and by third of the speeds."""
    rows, models = judgement.kind.rows, residuals(judgement)
    series = np.array(rows.series)
    edges = np.quantile(rows.abscissa, [0, 1 / 3, 2 / 3, 1])
    if len(set(rows.series)) > MOST_SERIES:
        series = rows.channels
    groups = {str(name): series == name for name in dict.fromkeys(series.tolist())}
    for k, name in enumerate(rows.condition):
        groups[name] = rows.abscissa == k
    for low, high in pairwise(edges) if rows.one_axis else ():
        inside = (rows.abscissa >= low) & ((rows.abscissa < high) | (high == edges[-1]))
        if inside.any() and high > low:
            groups[f"{low:.3g} to {high:.3g} m/s"] = inside
    return [
        (name, int(inside.sum()), [float(r[inside] @ r[inside]) for r in models.values()])
        for name, inside in groups.items()
    ]


def _tried(judgement: Judgement) -> list[Fit]:
    """Hypotheses that are listed, most probable first."""
    known, posterior = judgement.hypotheses, judgement.hypotheses.posterior
    shown = [known.null, *known.best(1)[:40], *known.best(2)[:6], *known.best(3)[:4]]
    if judgement.final not in shown:
        shown.append(judgement.final)
    return sorted(shown, key=lambda f: -posterior[f.name])


def _sd_ratio(judgement: Judgement) -> float:
    """The largest ratio of a reported sd to that of the final fit alone; 1 if nothing is named."""
    final, ratios = judgement.final, [1.0]
    for c, e in zip(final.candidates, judgement.verdict.effects, strict=False):
        spread = np.sqrt(final.covariance.diagonal()[final.columns(c)])
        for (u, x), sd in zip(final.values(c), spread, strict=True):
            for name, factor in u.factors.items():
                own = factor * u.slope(float(x)) * float(sd)
                ratios += [e.parameters[name][1] / own] if own > 0 and name in e.parameters else []
    return max(ratios)


# ---------------------------------------------------------------------- verdict.json


def record(diagnosis: Diagnosis, findings: Findings) -> dict[str, Any]:
    """The JSON of ``velotyre diagnose``: the verdict of a ``diagnosis`` and its ``findings``."""
    f, verdict = findings, diagnosis.verdict

    def told(macro: str) -> str:
        return rendered("one.txt.j2", macro=macro, v=verdict, f=f)

    return {
        "odd_part": {"parts": [one.part for one in f.odd], "sentence": told("odd")} if f.odd else None,
        **verdict_record(verdict),
        "moved": [
            {
                "parameter": m.name, "unit": m.unit, "prior": m.prior, "prior_sd": m.prior_sd, "value": m.value,
                "sd": m.sd, "shift_parameters_only": m.alone, "shift": m.shift,
            }
            for m in f.moved
        ],
        "upper_limits": [
            {
                "effect": u.identifier, "parameter": u.parameter, "unit": u.unit, "limit": dict(u.values),
                "kind": "at least" if u.least else "size at most" if u.two_sided else "at most",
                "limited_by_data": u.limited,
            }
            for u in f.limits
        ],
        "measure_next": {
            "between": list(f.between), "measurements": [asdict(s) for s in f.further],
            "nothing_to_tell_apart": told("settled"), "uncertainty_doubled": f.doubled,
            "stands": None if f.standing is None else asdict(f.standing) | {
                end: "no missing effect" if name == "none" else said(name)
                for end, name in (("leader", f.standing.leader), ("rival", f.standing.rival))
            },
        },
        "doubts": list(f.doubts),
        "parts": [
            {
                "part": p.part, "disagreement_sd": p.sd, "p": p.p, "contradicts": p.contradicts,
                "joint_fits": f.joint_fits,
                "effects": [{**asdict(c), "difference_sd": c.difference} for c in p.effects],
                "not_compared": list(p.unseen),
                "without_it": verdict_record(f.without[p.part].rest) if p.part in f.without else None,
            }
            for p in f.ranked
        ],
        "predicted": [_predicted_record(one) for one in f.predicted],
        "stability": None if f.stability is None else {"sentence": told("stability"), **f.stability.to_dict()},
        "residual_torque": {"fitted": False, "why": f.no_torque} if f.no_torque else torque_record(f.torque),
    }  # fmt: skip


def verdict_record(verdict: Verdict) -> dict[str, Any]:
    """A ``verdict`` with its sentence."""
    return {"verdict": verdict.verdict, "sentence": sentence(verdict), **verdict.to_dict()}


def _predicted_record(one: Predicted) -> dict[str, Any]:
    return {
        "part": one.part, "runs": list(one.runs), "n": one.numbers,
        "chi2": {model: value if np.isfinite(value) else None for model, value in one.chi2.items()},
        "gap": one.gap, "rms": {channel: dict(models) for channel, models in one.rms.items()},
        "estimated_noise": {
            channel: {"taken": taken, "sample_to_sample": rough} for channel, (taken, rough) in one.noise.items()
        },
    }  # fmt: skip


def torque_record(torque: Residual | None) -> dict[str, Any] | None:
    """A residual torque with its covariance; None if there is none."""
    if torque is None:
        return None
    names = (*torque.kept, *torque.dropped)
    first, units = len(torque.covariance) - len(names), {u.name: u.unit for u in torque.fit.unknowns}
    return {
        "fitted": True, "name_of_a_cause": False, "effect": EFFECT,
        "middle_speed_m_s": torque.scale.middle, "speed_span_m_s": torque.scale.span,
        "coefficients": {
            name: {
                "value": value, "sd": torque.sd[name], "sd_alone": torque.sd_alone[name], "unit": units[name],
                "gain_log_evidence": torque.gains.get(name, (None, None))[0],
                "gain_held_out": torque.gains.get(name, (None, None))[1],
            }
            for name, value in torque.values.items()
        },
        "left_at_zero": {name: {"sd": torque.sd[name]} for name in torque.dropped},
        "covariance": {"coefficients": list(names), "matrix": torque.covariance[first:, first:].tolist()},
        "changed": [asdict(one) for one in torque.changed()],
        "misfit": torque.fit.misfit, "goodness_of_fit_p": torque.p,
        "chi2": {"without": torque.beside.chi2, "with": torque.fit.chi2},
        "held_out": {
            "gap_without": torque.before.gap, "gap_with": torque.after.gap,
            "chi2_without": torque.before.chi2, "chi2_with": torque.after.chi2,
            "log_score_gain": torque.after.log_score - torque.before.log_score,
        },
    }  # fmt: skip
