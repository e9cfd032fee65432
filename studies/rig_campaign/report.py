"""What a campaign leaves behind: tidy tables, a tyre map, .tir files, figures and a report in words."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from studies.reporting.made_by import made_by
from studies.reporting.markdown_text import cell, code, plain
from tyre.base.csv_text import write_csv
from tyre.base.files import write_text
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.condition import ConditionResult
from tyre.campaigns.export import write_tables
from tyre.campaigns.repeatability import Repeatability
from tyre.estimate import Estimate

_N_PER_DEG = math.pi / 180.0


def write_campaign(
    campaign: Campaign, out: Path, *, wheel_radius: float = 0.34, every_recording: bool = False
) -> list[Path]:
    """Write all results of a campaign.

    Parameters
    ----------
    campaign : Campaign
    out : Path
        Gets ``conditions.csv``, ``recordings.csv``, ``conditions.json``, ``report.md``, ``figures/``, ``maps/``
        (tables for ``TyreMap.from_file``) and ``tir/``.
    wheel_radius : float
        m, for the .tir files.
    every_recording : bool
        Draw the residuals of every recording, not only of the worst ones.

    Returns
    -------
    list of Path
    """
    import pandas as pd

    from studies.rig_campaign.figures import save_figures

    out.mkdir(parents=True, exist_ok=True)
    written = [out / "conditions.csv", out / "recordings.csv", out / "conditions.json"]
    write_csv(written[0], pd.DataFrame([_condition_row(c) for c in campaign.conditions]))
    write_csv(written[1], pd.DataFrame(_recording_rows(campaign)))
    write_text(written[2], json.dumps(campaign.as_json(), indent=1, allow_nan=False) + "\n")
    maps, remarks = write_tables(campaign, out, wheel_radius=wheel_radius)
    figures = save_figures(campaign, out / "figures", every_recording=every_recording)
    report = out / "report.md"
    write_text(report, report_text(campaign, figures, remarks, out))
    return [*written, *maps, *figures, report]


def report_text(campaign: Campaign, figures: Sequence[Path], remarks: Sequence[str], out: Path) -> str:
    """The report as Markdown: tables, agreement of the routes, repeatability budget, skipped files, warnings.

    Parameters
    ----------
    campaign : Campaign
    figures : sequence of Path
        Below ``out``.
    remarks : sequence of str
        What could not be exported.
    out : Path
        Folder of the report.
    """
    from tabulate import tabulate

    lines = ["# Rig campaign", ""]
    if any(c.synthetic for c in campaign.conditions):
        lines += ["**SYNTHETIC: these recordings come from the rig simulator; nothing here was measured.**", ""]
    count = sum(
        len(c.sweeps) + len(c.steps) + (0 if c.borrowed_stiffness else len(c.pulls)) for c in campaign.conditions
    )
    lines += [f"{count} recordings, {len(campaign.conditions)} conditions. Intervals are 95 %.", ""]
    if campaign.skipped:
        lines += [f"## Skipped files ({len(campaign.skipped)})", ""]
        lines += [f"- {code(name)}: {plain(reason)}" for name, reason in campaign.skipped.items()] + [""]
    rows = [
        (
            cell(c.tyre),
            c.surface,
            f"{c.load:g}",
            f"{c.pressure / PASCAL_PER_BAR:g}",
            _text(c.cornering_stiffness, _N_PER_DEG, 2),
            _text(c.lateral_stiffness, 1e-3, 2) + (" (flat)" if c.borrowed_stiffness else ""),
            _text(c.relaxation_length, 1e3, 1),
            "-" if c.r_squared is None else f"{c.r_squared:.4f}",
            _text(c.pneumatic_trail, 1e3, 1),
        )
        for c in campaign.conditions
    ]
    heads = [
        "tyre",
        "surface",
        "load (N)",
        "bar",
        "C (N/deg)",
        "K (N/mm)",
        "relaxation length (mm)",
        "R²",
        "trail (mm)",
    ]
    lines += ["## Conditions", "", tabulate(rows, heads, tablefmt="pipe", disable_numparse=True), ""]
    lines += [
        "Only the product B C D, the cornering stiffness, is determined by a few degrees of slip; peak, shape and "
        "curvature in `recordings.csv` describe a curve and are not separately identified: do not compare them.",
        "",
    ]
    routes = [c for c in campaign.conditions if c.routes is not None]
    if routes:
        lines += ["## Relaxation length by several routes", ""]
        lines += [f"- {plain(c.label)}: {plain(c.routes.sentence)}" for c in routes if c.routes is not None] + [""]
    if campaign.curvature:
        lines += ["## Flat track against drum", ""]
        for item in campaign.curvature:
            spread = f" +- {item.exponent.sd:.2f} (sd)" if math.isfinite(item.exponent.sd) else ""
            lines.append(
                f"- {plain(item.tyre)}: C on the flat track is {100 * (item.ratio - 1):.1f} % above the drum over "
                f"{item.pairs} condition{'s' * (item.pairs != 1)}, an exponent of (1 + R/R_drum)^n of "
                f"{item.exponent.value:.2f}{spread}. Reported, not applied."
            )
        lines.append("")
    lines += [
        "## Repeatability budget",
        "",
        tabulate(_budget(campaign), ["source", "C (%)", "K (%)"], tablefmt="pipe"),
        "",
    ]
    warnings = [(c.label, text) for c in campaign.conditions for text in c.warnings]
    if warnings or remarks:
        lines += ["## Warnings", ""]
        lines += (
            [f"- {plain(label)}: {plain(text)}" for label, text in warnings]
            + [f"- {plain(text)}" for text in remarks]
            + [""]
        )
    if figures:
        lines += ["## Figures", ""] + [f"![{path.stem}]({path.relative_to(out).as_posix()})" for path in figures] + [""]
    return "\n".join(lines).rstrip() + made_by()


def _budget(campaign: Campaign) -> list[tuple[str, str, str]]:
    calibration = campaign.settings.calibration

    def one(pooled: Repeatability) -> str:
        origin = "assumed, no repeats"
        if pooled.measured:
            stated = f", and {pooled.dof - pooled.repeats:.0f} dof of the stated {100 * calibration.repeatability:g} %"
            origin = f"{pooled.repeats:.0f} dof of repeats, {pooled.conditions} conditions" + stated * (
                not pooled.refuted
            )
        return f"{100 * pooled.sd:.2f} ({origin})"

    return [
        (
            "one recording about its condition's mean",
            one(campaign.sweep_repeatability),
            one(campaign.pull_repeatability),
        ),
        ("force cell", f"{100 * calibration.force:.2f}", f"{100 * calibration.force:.2f}"),
        ("slip angle", f"{100 * calibration.slip:.2f}", "-"),
        ("dial gauges", "-", f"{100 * calibration.displacement:.2f}"),
        ("a condition (median sd)", _median(campaign, "cornering_stiffness"), _median(campaign, "lateral_stiffness")),
    ]


def _median(campaign: Campaign, name: str) -> str:
    estimates = [getattr(c, name) for c in campaign.conditions if getattr(c, name) is not None]
    return f"{100 * float(np.median([e.sd / e.value for e in estimates])):.2f}" if estimates else "-"


def _text(estimate: Estimate | None, factor: float, digits: int) -> str:
    if estimate is None:
        return "-"
    low, high = (factor * end for end in estimate.ci95)
    return f"{factor * estimate.value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _condition_row(c: ConditionResult) -> dict[str, Any]:
    row: dict[str, Any] = {
        "tyre": c.tyre,
        "surface": c.surface,
        "load_N": c.load,
        "pressure_bar": c.pressure / PASCAL_PER_BAR,
        "drum_radius_m": c.drum_radius,
    }
    for name, unit, factor, estimate in (
        ("cornering_stiffness", "N_per_deg", _N_PER_DEG, c.cornering_stiffness),
        ("lateral_stiffness", "N_per_mm", 1e-3, c.lateral_stiffness),
        ("relaxation_length", "mm", 1e3, c.relaxation_length),
        ("pneumatic_trail", "mm", 1e3, c.pneumatic_trail),
        ("relaxation_length_two_rates", "mm", 1e3, c.direct.get("two sweep rates")),
        ("relaxation_length_slip_step", "mm", 1e3, c.direct.get("slip step")),
    ):
        scaled = None if estimate is None else estimate.scaled(factor)
        row[f"{name}_{unit}"] = None if scaled is None else scaled.value
        row[f"{name}_sd_{unit}"] = None if scaled is None else scaled.sd
        row[f"{name}_low_{unit}"] = None if scaled is None else scaled.ci95[0]
        row[f"{name}_high_{unit}"] = None if scaled is None else scaled.ci95[1]
    for kind in ("slip_sweep", "pull_test", "slip_step"):
        row[f"{kind}_scatter_relative"] = c.scatter.get(kind)
    return row | {
        "r_squared": c.r_squared,
        "routes_p_value": None if c.routes is None else c.routes.p_value,
        "lateral_stiffness_from": "flat" if c.borrowed_stiffness else c.surface,
        "sweeps": len(c.sweeps),
        "pulls": len(c.pulls),
        "steps": len(c.steps),
        "synthetic": c.synthetic,
    }


def _recording_rows(campaign: Campaign) -> list[dict[str, Any]]:
    rows = {}
    for c in campaign.conditions:
        for item in (*c.sweeps, *c.pulls, *c.steps):
            rows[item.file] = {
                "file": item.file,
                "kind": item.kind,
                "tyre": item.condition.tyre,
                "surface": item.condition.surface,
                "load_N": item.condition.load,
                "pressure_bar": item.condition.pressure / PASCAL_PER_BAR,
                "quantity": {"slip_sweep": "C_Fy_N_per_rad", "pull_test": "K_y_N_per_m", "slip_step": "length_m"}[
                    item.kind
                ],
                "value": item.value,
                "fit_sd": item.fit_sd,
                "r_squared": item.r_squared,
                "slip_rate_rad_s": item.rate or None,
                **item.details,
                "notes": "; ".join(item.notes),
            }
    return [rows[name] for name in sorted(rows)]
