"""Results of a campaign: tidy tables, a tyre map, .tir files, figures and a report."""

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import code, render_file, write_page
from studies.rig_campaign import figures as drawn
from tyre.fits.campaign import Campaign, write_tables
from tyre.fits.condition import ConditionResult, Key, keep_upright
from tyre.ground.files import make_folder, write_text
from tyre.ground.text_table import write_csv
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.properties import Estimate

N_PER_DEG = math.pi / 180.0

# quantities whose truth the simulator writes: label, name in a result and in truth.json, factor and digits
SIMULATED = (
    ("C_α (N/deg)", "cornering_stiffness", "cornering_stiffness_N_per_rad", N_PER_DEG, 2),
    ("K_y (N/mm)", "lateral_stiffness", "lateral_stiffness_N_per_m", 1e-3, 2),
    ("σ (mm)", "relaxation_length", "relaxation_length_m", 1e3, 1),
)


def write_campaign(
    campaign: Campaign, out: Path, *, wheel_radius: float = 0.34, every_recording: bool = False
) -> list[Path]:
    """Write all results of a campaign into ``out``; return the files."""
    make_folder(out)
    written = [out / "conditions.csv", out / "recordings.csv", out / "conditions.json"]
    write_csv(written[0], campaign_table(campaign))
    write_csv(written[1], pd.DataFrame(_recording_rows(campaign)))
    write_text(written[2], json.dumps(campaign.as_json(), indent=1, allow_nan=False) + "\n")
    maps, remarks = write_tables(campaign, out, wheel_radius=wheel_radius)
    figures = drawn.save_figures(campaign, out / "figures", every_recording=every_recording)
    text = report_text(campaign, figures, remarks, out)
    return [*written, *maps, *figures, write_page(out, title=f"Rig campaign: {campaign.folder.name}", text=text)]


def campaign_table(campaign: Campaign) -> pd.DataFrame:
    """Table of the conditions of a campaign, a row each, in the units of the field."""
    return pd.DataFrame([_condition_row(c) for c in campaign.conditions])


def report_text(campaign: Campaign, figures: Sequence[Path], remarks: Sequence[str], out: Path) -> str:
    """Write the report as Markdown; ``figures`` lie below ``out``, ``remarks`` state what could not be exported."""
    conditions = campaign.conditions
    shares = {
        name: [e.sd / e.value for c in conditions if (e := getattr(c, name)) is not None]
        for name in ("cornering_stiffness", "lateral_stiffness")
    }
    medians = {
        name: 100 * float(np.median(relative_sd)) if relative_sd else None for name, relative_sd in shares.items()
    }
    borrowed = sum(len(c.pulls) for c in conditions if c.borrowed_stiffness)
    content = {
        "campaign": campaign,
        "conditions": conditions,
        "upright": keep_upright(conditions),
        "calibration": campaign.settings.calibration,
        "medians": medians,
        "remarks": remarks,
        "compared": against_truth(campaign),
        "warnings": grouped_warnings(conditions),
        "recordings": sum(len(c.sweeps) + len(c.steps) + len(c.pulls) for c in conditions) - borrowed,
        "figures": [(path.stem, path.relative_to(out).as_posix()) for path in figures],
    }
    filters = {"interval": interval, "code": code}
    return render_file("studies.rig_campaign", "report.md.j2", content, filters=filters).rstrip() + made_by()


MOST_NAMED = 3  # places of one warning that the report names; the tables beside it hold all


def grouped_warnings(conditions: Sequence[ConditionResult]) -> list[tuple[str, str]]:
    """Each warning once: the conditions or recordings that it is about, and its words."""
    of_conditions: dict[str, list[str]] = {}
    of_recordings: dict[str, list[str]] = {}
    for c in conditions:
        for warning in c.warnings:
            file = next((name for name in c.files if warning.startswith(f"{name}: ")), "")
            if file:
                of_recordings.setdefault(warning.removeprefix(f"{file}: "), []).append(file)
            else:
                of_conditions.setdefault(warning, []).append(c.label)
    recordings = {file for c in conditions for file in c.files}
    groups = (
        (of_conditions, len(conditions), "conditions", "conditions.json"),
        (of_recordings, len(recordings), "recordings", "recordings.csv"),
    )
    lines = []
    for warnings, count, noun, table in groups:
        for words, places in warnings.items():
            lines.append((_places(list(dict.fromkeys(places)), count, noun, table), words))
    return lines


def _places(places: Sequence[str], count: int, noun: str, table: str) -> str:
    if len(places) <= MOST_NAMED:
        return "; ".join(places)
    return f"all {count} {noun}" if len(places) == count else f"{len(places)} of {count} {noun} (see {table})"


def against_truth(campaign: Campaign) -> list[dict[str, Any]]:
    """Compare C_alpha, K_y and sigma of a simulated campaign with its truth.json, a row each; empty without one."""
    file = campaign.folder / "truth.json"
    if not file.is_file():
        return []
    try:
        truth = {
            Key(t["tyre"], t["surface"], round(t["load_N"], 1), round(1e3 * t["pressure_bar"])): t
            for t in json.loads(file.read_text(encoding="utf-8"))["conditions"]
        }
    except (ValueError, KeyError, TypeError):  # of another program
        return []
    rows = list[dict[str, Any]]()
    for c in campaign.conditions:
        if not c.synthetic or c.camber != 0.0:  # the simulator runs upright wheels
            continue
        true = truth.get(Key(c.tyre, c.surface, c.load, round(c.pressure / 100.0)), {})
        rows += [
            {
                "label": c.label,
                "quantity": label,
                "true": f"{factor * true[key]:.{digits}f}",
                "fitted": interval(fitted, factor, digits),
                "error": 100.0 * (fitted.value / true[key] - 1.0),
                "inside": fitted.covers(true[key]),
            }
            for label, name, key, factor, digits in SIMULATED
            if (fitted := getattr(c, name)) is not None and key in true
        ]
    return rows


def interval(estimate: Estimate | None, factor: float, digits: int) -> str:
    """Print an estimate with its 95 % interval."""
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
        "camber_deg": c.camber / N_PER_DEG,
        "drum_radius_m": c.drum_radius,
    }
    for name, unit, factor, estimate in (
        ("cornering_stiffness", "N_per_deg", N_PER_DEG, c.cornering_stiffness),
        ("lateral_stiffness", "N_per_mm", 1e-3, c.lateral_stiffness),
        ("relaxation_length", "mm", 1e3, c.relaxation_length),
        ("pneumatic_trail", "mm", 1e3, c.pneumatic_trail),
        ("relaxation_length_two_rates", "mm", 1e3, c.direct.get("two sweep rates")),
        ("relaxation_length_slip_step", "mm", 1e3, c.direct.get("slip step")),
        ("camber_stiffness", "N_per_deg", N_PER_DEG, c.camber_stiffness),
        ("twisting_stiffness", "N_m_per_deg", N_PER_DEG, c.twisting_stiffness),
    ):
        scaled = None if estimate is None else estimate.scaled(factor)
        numbers = (None,) * 4 if scaled is None else (scaled.value, scaled.sd, *scaled.ci95)
        row |= dict(zip((f"{name}{part}_{unit}" for part in ("", "_sd", "_low", "_high")), numbers, strict=True))
    row |= {
        f"{kind}_scatter_relative": c.scatter.get(kind) for kind in ("slip_sweep", "lateral_stiffness", "slip_step")
    }
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
    quantities = {"slip_sweep": "C_alpha_N_per_rad", "lateral_stiffness": "K_y_N_per_m", "slip_step": "sigma_m"}
    rows = {
        item.file: {
            "file": item.file,
            "kind": item.kind,
            "tyre": item.condition.tyre,
            "surface": item.condition.surface,
            "load_N": item.condition.load,
            "pressure_bar": item.condition.pressure / PASCAL_PER_BAR,
            "camber_deg": item.condition.camber / N_PER_DEG,
            "quantity": quantities[item.kind],
            "value": item.value,
            "fit_sd": item.fit_sd,
            "r_squared": item.r_squared,
            "slip_rate_rad_s": item.rate or None,
            **item.details,
            "notes": "; ".join(item.notes),
        }
        for c in campaign.conditions
        for item in (*c.sweeps, *c.pulls, *c.steps)
    }
    return [rows[name] for name in sorted(rows)]
