"""The report of a diagnosis: Markdown, HTML, figures, verdict.json and corrected models in one folder."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from bicycle.model.model import Model
from bicycle.parameters.front_hinge import front_words
from bicycle.parameters.parameter_covariance import ParameterKey
from studies.diagnosis.corrected_model import Corrected, corrected
from studies.diagnosis.correction import correction
from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.figures import STORY, draw_story, residuals, titles_of_drawn_models
from studies.diagnosis.findings import Attempts, Findings, Predicted, find
from studies.diagnosis.labels import (
    ADJUSTED,
    BASE,
    fate,
    number,
    render,
    sentence,
    titles,
    to_sd,
    unit_of,
    without_number,
)
from studies.diagnosis.residual import EFFECT, Residual
from studies.diagnosis.residual_figure import CAPTION, draw_torque
from studies.inference import RULES, Judgement, Named, Verdict
from studies.inference.kind import Figure
from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import write_page
from studies.reporting.output import json_text
from tyre.ground.files import make_folder, slugs, write_text

MOST = 6  # rows of a table: verdict.json has all
STEPS = {"base": "nominal", "adjusted": "final", "without_effect": "nuisance_only", "effect_alone": "effect_alone"}
WITH_TORQUE = "with an unmodelled torque, " + ADJUSTED
"""Step of the misfit: the model that it is of."""


def write_report(diagnosis: Diagnosis, folder: Path, findings: Findings | None = None) -> None:
    """Write ``report.html``, ``verdict.json``, the figures and, of bicycles, the corrected models."""
    all_findings = find(diagnosis) if findings is None else findings
    verdict = json_text(record(diagnosis, all_findings))  # before anything is written: with a NaN, nothing is
    make_folder(folder)
    write_text(folder / "verdict.json", f"{verdict}\n")
    attempt = Attempts()
    captions = draw_all(diagnosis, all_findings, folder, attempt)
    models = attempt("corrected model", lambda: corrected(diagnosis, all_findings.torque), Corrected({}))
    for name, file in model_files(models).items():
        write_text(folder / file, models.texts[name])
    text = page(diagnosis, replace(all_findings, failed={**all_findings.failed, **attempt.failed}), captions, models)
    write_page(folder, title=f"Diagnosis: {diagnosis.kind.name}", text=text, extensions=("tables", "md_in_html"))


def draw_all(diagnosis: Diagnosis, findings: Findings, folder: Path, attempt: Attempts | None = None) -> dict[str, str]:
    """Draw the story, the figures of the kind of measurement and the unmodelled torque; name -> caption of each."""
    attempt = attempt or Attempts()
    figures: dict[str, Figure] = {}
    if (story := findings.story) is not None:
        figures["story"] = (lambda _, target: draw_story(story, _steps(diagnosis), target)), STORY
    figures |= diagnosis.kind.figures()
    if (torque := findings.torque) is not None:
        figures[EFFECT] = (lambda _, target: draw_torque(torque, target)), CAPTION
    captions = {}
    for name, (draw, caption) in figures.items():
        if attempt(f"figure {name}", partial(draw, diagnosis, folder / name), otherwise=False):
            captions[name] = caption
    return captions


def _steps(diagnosis: Diagnosis) -> dict[str, str]:
    """Name of each step of the story."""
    names = titles(diagnosis)
    steps = {step: names[model] for step, model in STEPS.items() if model in names}
    return {"adjusted": names.get("nuisance_only", BASE), "with_torque": WITH_TORQUE, **steps}


def model_files(models: Corrected) -> dict[str, str]:
    """File of each corrected model, by bicycle."""
    other_files = {name: f"model_{stem}.toml" for name, stem in slugs([name for name in models.texts if name]).items()}
    return {name: other_files.get(name, "model.toml") for name in models.texts}


def page(diagnosis: Diagnosis, findings: Findings, captions: Mapping[str, str], models: Corrected | None = None) -> str:
    """The report as Markdown, with ``captions`` of the figures that there are, by name."""
    kind, hypotheses = diagnosis.kind, diagnosis.hypotheses
    likely = [f for f, _ in hypotheses.probabilities][:MOST]
    text = render(
        "report.md.j2",
        markdown=True,
        **_content(diagnosis, findings, models or Corrected({})),
        name=kind.name,
        description=kind.description,
        source=kind.source,
        figures=_figures_by_place(captions),
        titles=list(titles_of_drawn_models(diagnosis).values()),
        tried=likely if diagnosis.final in likely else [*likely, diagnosis.final],
        fates=fate(diagnosis),
        far=[m for m in findings.moved if max(abs(m.shift), abs(m.alone)) > RULES.told_shift][:MOST],
        parts=_parts(diagnosis, findings),
        places=_places(diagnosis),
        not_tried=list(diagnosis.verdict.refused),
        most=MOST,
    )
    return text + made_by()


def _figures_by_place(captions: Mapping[str, str]) -> dict[str, list[tuple[str, str]]]:
    """Name and caption of each figure by the place in the page, with which its name begins."""
    return {
        place: [(name, caption) for name, caption in captions.items() if name.startswith(place)]
        for place in ("story", "before_after", EFFECT)
    }


def terminal(diagnosis: Diagnosis, findings: Findings, place: str = "") -> str:
    """Text for the terminal, at most 13 lines; the report is at ``place``."""
    models = Attempts()("corrected model", lambda: corrected(diagnosis, findings.torque), Corrected({}))
    file = quote(Path(place).with_name("model.toml").as_posix()) if place else ""
    text = render("terminal.txt.j2", **_content(diagnosis, findings, models), place=place, file=file)
    return "\n".join(line for line in text.splitlines() if line)


def _content(diagnosis: Diagnosis, findings: Findings, models: Corrected) -> dict[str, Any]:
    """Values of both templates."""
    verdict = diagnosis.verdict
    return {
        "d": diagnosis,
        "v": verdict,
        "f": findings,
        "s": findings.story,
        "c": correction(diagnosis, findings.torque),
        "made": models,
        "files": model_files(models),
        "width": max((len(name) for name in _steps(diagnosis).values()), default=0),
        "thing": "tyre" if diagnosis.kind.model is None else "bicycle",
        "named_rows": named_rows(diagnosis),
        "steps": _steps(diagnosis),
        "predictors": predictors(diagnosis, findings.predicted),
        "mimics": [m for m in verdict.mimics if m.chi2 < verdict.chi2["final"]],
    }


# ---------------------------------------------------------------------- tables


def named_rows(judgement: Judgement) -> list[list[str]]:
    """Effect, parameter, value, one sd and what it does, of what is named; no size that its sd exceeds."""
    table, candidates = [], {c.identifier: c for c in (*judgement.kind.candidates, *judgement.final.candidates)}
    for e in judgement.verdict.effects:
        if not e.parameters:
            table.append([e.identifier, "-", without_number(candidates[e.identifier]), "-", e.signature])
        words = _front_words(judgement.kind.model, e)
        for k, (name, (value, sd)) in enumerate(e.parameters.items()):
            plain = unit_of(e.units.get(name, "1"))
            unit = f"{plain} ({words[name]})" if name in words else plain
            sized = (
                [f"{to_sd(value, sd)}{unit}", f"± {number(sd, 2)}{plain}"]
                if sd < abs(value)
                else ["not determined", "-"]
            )
            table.append([e.identifier if not k else "", name, *sized, e.signature if not k else ""])
    return table


def _front_words(model: Model | None, named: Named) -> dict[str, str]:
    """Say what the fitted place and damping of a ``named`` front hinge mean on the bicycle of ``model``."""
    if model is None:
        return {}
    fitted = {f"{named.identifier}.{name}": value for name, (value, _) in named.parameters.items()}
    words = front_words({**model.bicycle.values, **fitted})
    return {ParameterKey.parse(key).name: text for key, text in words.items()}


def predictors(judgement: Judgement, predictions: tuple[Predicted, ...]) -> dict[str, str]:
    """The models that runs were predicted by, and their names; with an unmodelled torque one more."""
    single = predictions[0].single.replace("+", " + ") if predictions else ""
    names = titles(judgement) | {"single_effect": f"+ {single}, {ADJUSTED}", "with_torque": WITH_TORQUE}
    return {model: title for model, title in names.items() if any(model in p.chi2 for p in predictions)}


def _parts(judgement: Judgement, findings: Findings) -> list[tuple[Any, int, list[float]]]:
    """Each part of joint data with its numbers and the chi^2 of the models that are drawn."""
    models = residuals(judgement)
    slices = judgement.kind.slices() if findings.parts else []
    return [
        (part, rows.stop - rows.start, [float(r[rows] @ r[rows]) for r in models.values()])
        for part, rows in zip(findings.parts, slices, strict=True)
    ]


def _places(judgement: Judgement) -> list[tuple[str, int, list[float]]]:
    """Numbers and chi^2 of the models by channel, by condition and by third of the abscissa, the largest first."""
    rows, models = judgement.kind.rows, residuals(judgement)
    series = np.array(rows.series)
    edges = np.quantile(rows.abscissa, [0, 1 / 3, 2 / 3, 1])
    if len(set(rows.series)) > MOST:
        series = rows.channels
    groups = {str(name): series == name for name in dict.fromkeys(series.tolist())}
    for k, name in enumerate(rows.condition):
        groups[name] = rows.abscissa == k
    if rows.one_axis:
        for low, high in pairwise(edges):
            mask = (rows.abscissa >= low) & ((rows.abscissa < high) | (high == edges[-1]))
            if mask.any() and high > low:
                groups[f"{low:.3g} to {high:.3g} {rows.axis.rpartition(', ')[2]}"] = mask
    places = [
        (name, int(mask.sum()), [float(r[mask] @ r[mask]) for r in models.values()]) for name, mask in groups.items()
    ]
    return sorted(places, key=lambda row: -row[2][0])[:MOST]


# ---------------------------------------------------------------------- verdict.json


def record(diagnosis: Diagnosis, findings: Findings) -> dict[str, Any]:
    """The JSON of ``velotyre diagnose``: the verdict of a ``diagnosis`` and its ``findings``."""
    f, verdict = findings, diagnosis.verdict

    changes = correction(diagnosis, f.torque)

    def phrase(macro: str) -> str:
        return render("one.txt.j2", macro=macro, v=verdict, f=f, c=changes)

    search = {"search": "quick"} if diagnosis.quick else {}
    return {
        "gap": f.story and asdict(f.story.gap),
        "held_out": f.story and f.story.held_out and asdict(f.story.held_out),
        "where": f.where and f.where.to_dict(),
        "odd_part": {"parts": [removed.part for removed in f.odd], "sentence": phrase("odd")} if f.odd else None,
        **search,
        **verdict_record(verdict),
        "sentence": phrase("what"),
        "closest_alternative": f.alternative and asdict(f.alternative),
        "corrected": {
            "added": list(changes.added),
            "not_in_the_file": list(changes.left_out),
            "effects": [_effect_record(e) for e in changes.effects],
            "shifts": {m.name: m.shift for m in changes.moved},
        },
        "look_alikes": f.story and f.story.look_alikes and asdict(f.story.look_alikes),
        "moved": [
            {
                "parameter": m.name,
                "unit": m.unit,
                "prior": m.prior,
                "prior_sd": m.prior_sd,
                "value": m.value,
                "sd": m.sd,
                "shift_parameters_only": m.alone,
                "shift": m.shift,
            }
            for m in f.moved
        ],
        "upper_limits": [
            {
                "effect": u.identifier,
                "parameter": u.parameter,
                "unit": u.unit,
                "limit": dict(u.values),
                "kind": "at least" if u.least else "size at most" if u.two_sided else "at most",
                "limited_by_data": u.limited,
            }
            for u in f.limits
        ],
        "measure_next": {"between": list(f.between), "measurements": [asdict(s) for s in f.further]},
        "doubts": list(f.doubts),
        "parts": [
            {
                "part": p.part,
                "disagreement_sd": p.sd,
                "p": p.p,
                "contradicts": p.contradicts,
                "joint_fits": f.joint_fits,
                "effects": [{**asdict(c), "difference_sd": c.difference} for c in p.effects],
                "not_compared": list(p.unseen),
                "without_it": verdict_record(f.without[p.part].rest) if p.part in f.without else None,
            }
            for p in f.ranked
        ],
        "predicted": [_predicted_record(prediction) for prediction in f.predicted],
        "stability": None if f.stability is None else {"sentence": phrase("stability"), **f.stability.to_dict()},
        "unmodelled_torque": {"fitted": False, "why": f.no_torque} if f.no_torque else torque_record(f.torque),
        "failed_sections": dict(f.failed),
    }


def verdict_record(verdict: Verdict) -> dict[str, Any]:
    """A ``verdict`` with its sentence."""
    return {"verdict": verdict.verdict, "sentence": sentence(verdict), **verdict.to_dict()}


def _effect_record(effect: Named) -> dict[str, Any]:
    parameters = {name: {"value": value, "sd": sd} for name, (value, sd) in effect.parameters.items()}
    return {"identifier": effect.identifier, "parameters": parameters}


def _predicted_record(prediction: Predicted) -> dict[str, Any]:
    """JSON of the prediction of the held-out runs of one part."""
    return {
        "part": prediction.part,
        "runs": list(prediction.runs),
        "n": prediction.numbers,
        "chi2": {model: value if np.isfinite(value) else None for model, value in prediction.chi2.items()},
        "gap": prediction.gap,
        "rms": {channel: dict(models) for channel, models in prediction.rms.items()},
        "single_effect": prediction.single,
        "estimated_noise": {
            channel: {"taken": assumed_sd, "sample_to_sample": rough_sd}
            for channel, (assumed_sd, rough_sd) in prediction.noise.items()
        },
    }


def torque_record(torque: Residual | None) -> dict[str, Any] | None:
    """An unmodelled torque with its covariance; None if there is none."""
    if torque is None:
        return None
    names = (*torque.kept, *torque.dropped)
    first = len(torque.covariance) - len(names)
    return {
        "fitted": True,
        "name_of_a_cause": False,
        "effect": EFFECT,
        "middle_speed_m_s": torque.scale.middle,
        "speed_span_m_s": torque.scale.span,
        "coefficients": {
            name: {
                "value": value,
                "sd": torque.sd[name],
                "sd_alone": torque.sd_alone[name],
                "unit": torque.units[name],
                "gain_log_evidence": torque.gains.get(name, (None, None))[0],
                "gain_held_out": torque.gains.get(name, (None, None))[1],
            }
            for name, value in torque.values.items()
        },
        "left_at_zero": {name: {"sd": torque.sd[name]} for name in torque.dropped},
        "covariance": {"coefficients": list(names), "matrix": torque.covariance[first:, first:].tolist()},
        "changed": [asdict(change) for change in torque.list_changes()],
        "misfit": torque.fit.misfit,
        "goodness_of_fit_p": torque.p,
        "chi2": {"without": torque.named.chi2, "with": torque.fit.chi2},
        "held_out": {
            "gap_without": torque.before.gap,
            "gap_with": torque.after.gap,
            "chi2_without": torque.before.chi2,
            "chi2_with": torque.after.chi2,
            "log_score_gain": torque.after.log_score - torque.before.log_score,
        },
    }
