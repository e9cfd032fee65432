"""Table, lines, JSON and model file of a design."""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model.eigen import damping_ratio, frequency_hz
from bicycle.model.model_file import build_model
from studies.design.design import Design
from studies.model_space.changed_model import near_to
from studies.reporting.markdown_text import render_file

DESCRIPTION = "{} Changed by velotyre design: {}."
HEADERS = ["parameter", "unit", "now", "design", "change", "unit of cost", "limits", ""]


def rows(design: Design) -> list[list[Any]]:
    """A row per number that is varied."""
    problem, limits = design.problem, design.problem.limits
    held = {key for key, _, _ in design.at_limit}
    return [
        [
            axis.key,
            axis.unit,
            float(now),
            f"{after:.6g}",
            float(after - now),
            float(scale),
            f"{low:.4g} .. {high:.4g} ({why})",
            "at its limit" if axis.key in held else "",
        ]
        for axis, now, after, scale, low, high, why in zip(
            problem.space.axes,
            problem.start,
            design.after.x,
            problem.cost.scale,
            limits.low,
            limits.high,
            limits.why,
            strict=True,
        )
    ]


def lines(design: Design) -> list[str]:
    """Lines on what the design does, its active constraints and its robustness."""
    by_demand = {demand: [p for p in design.after.peaks if p.demand == demand] for demand in design.problem.demands}
    before = {p.demand: p.root.real for p in sorted(design.before.peaks, key=lambda p: p.root.real)}  # the last stays
    reached = {demand: max(peaks, key=lambda p: p.excess) for demand, peaks in by_demand.items() if peaks}
    return _render("lines", design, reached=reached, before=dict.fromkeys(by_demand, np.nan) | before)


def remarks(design: Design) -> list[str]:
    """Remarks on what else changed and was not asked for: modes that are unstable now, or more than before."""
    demanded, (before, after) = {demand.mode for demand in design.problem.demands}, design.unstable
    return _render("remarks", design, demanded=demanded, unstable_before=before, unstable_after=after)


def _render(name: str, design: Design, **more: Any) -> list[str]:
    content = {"design": design, "problem": design.problem, "after": design.after, **more}
    filters = {"hertz": lambda root: abs(float(frequency_hz(root))), "ratio": damping_ratio, "percent": _percent}
    return render_file("studies.design", f"{name}.txt.j2", content, escaped=False, filters=filters).splitlines()


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def model_text(design: Design, folder: Path, what: str) -> str:
    """Text of the corrected model file, for a ``folder``; ``what`` was asked for."""
    import tomli_w

    build_model(design.content)  # as every other command will
    content = near_to(design.content, folder)
    content["description"] = DESCRIPTION.format(content.get("description", ""), what).strip()
    first = {key: content.pop(key) for key in ("description", "bicycle", "allow_unusual") if key in content}
    tables = {"bicycle": first.pop("bicycle")}
    return tomli_w.dumps(first | tables | content)


def record(design: Design) -> dict[str, Any]:
    """The design as JSON-ready data."""
    problem, after, sure = design.problem, design.after, design.certainty
    limits = problem.limits
    return {
        "kept": after.kept,
        "cost": after.cost,
        "cost_in": problem.cost.kind,
        "speeds_m_s": [float(problem.speeds[0]), float(problem.speeds[-1])],
        "parameters": [
            {
                "key": axis.key,
                "unit": axis.unit,
                "now": float(problem.start[k]),
                "design": float(after.x[k]),
                "counts_as_one": float(problem.cost.scale[k]),
                "limits": [float(limits.low[k]), float(limits.high[k])],
                "limits_from": limits.why[k],
            }
            for k, axis in enumerate(problem.space.axes)
        ],
        "worst": [
            {
                "mode": p.demand.mode,
                "min_damping_ratio": p.demand.ratio,
                "speed_m_s": p.speed,
                "real_1_s": p.root.real,
                "imaginary_rad_s": p.root.imag,
                "excess_1_s": p.excess,
            }
            for p in after.peaks
        ],
        "binding": [{"mode": p.demand.mode, "speed_m_s": p.speed} for p in design.binding],
        "at_limit": [{"key": key, "limit": end} for key, end, _ in design.at_limit],
        "searches": {"agreed": design.agreed[0], "of": design.agreed[1]},
        "probability": None
        if sure is None
        else {
            "kept": sure.probability,
            "interval_95": list(sure.interval),
            "draws": sure.largest_misses.size + sure.unknown,
            "not_told": sure.unknown,
            "left_out": sure.refused,
        },
        "unstable_before": design.unstable[0],
        "unstable_after": design.unstable[1],
        "remarks": remarks(design),
    } | ({} if design.amplitude is None else {"largest_amplitude_deg": design.amplitude})
