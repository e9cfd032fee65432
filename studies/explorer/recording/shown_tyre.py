"""What the page shows of a fitted tyre: stiffnesses and relaxation length with their intervals, by condition."""

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from studies.explorer.recording.panels import Curve, Panel, entry
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.condition import ConditionResult
from tyre.estimate import Estimate

PER_DEGREE = float(np.pi / 180)
QUANTITIES: dict[str, tuple[str, str, float, Callable[[ConditionResult], Estimate | None]]] = {
    "C": ("cornering stiffness C", "N/deg", PER_DEGREE, lambda c: c.cornering_stiffness),
    "K": ("lateral stiffness K", "N/mm", 1e-3, lambda c: c.lateral_stiffness),
    "relaxation": ("relaxation length", "mm", 1e3, lambda c: c.relaxation_length),
}
"""Words, unit, factor from SI, and where it stands."""

IMAGES = {"carpet": "Side force over slip, shifted by the load", "stiffness": "Stiffnesses over the load",
          "flat_drum": "Flat track against drum", "residuals": "Slip sweep: measured, fitted and the rest",
          "pull": "Pull test: measured and fitted", "repeatability": "Repeats about their mean"}  # fmt: skip
"""Figures of the command by what their names begin with."""


def tyre_shown(found: Campaign, folder: Path) -> dict[str, Any]:
    """What the page shows of a campaign.

    Parameters
    ----------
    found : Campaign
    folder : Path
        Of what the command wrote.
    """
    count = sum(len(c.sweeps) + len(c.steps) + (0 if c.borrowed_stiffness else len(c.pulls)) for c in found.conditions)
    tables = [
        {"words": "Fitted tyre, 95 % intervals", "columns": _columns(), "rows": [_row(c) for c in found.conditions]},
        {"words": "Relaxation length by several routes", "columns": ["condition", "agreement"],
         "rows": [[c.label, c.routes.sentence] for c in found.conditions if c.routes is not None]},
        {"words": "Recordings that were left out", "columns": ["recording", "why"],
         "rows": [[name, why] for name, why in found.skipped.items()]},
        {"words": "Warnings", "columns": ["condition", "warning"],
         "rows": [[c.label, words] for c in found.conditions for words in c.warnings]},
    ]  # fmt: skip
    figures = [path.relative_to(folder).as_posix() for path in sorted((folder / "figures").rglob("*.png"))]
    maps = [path.relative_to(folder.parent).as_posix() for path in sorted((folder / "maps").glob("*.csv"))]
    return {
        "sentence": _sentence(found, count),
        "closing": [f"{name} was left out: {why}" for name, why in found.skipped.items()],
        "figures": [one for name in QUANTITIES if (one := _over_load(found, name)) is not None],
        "images": [{"file": name, "words": _words(name)} for name in figures],
        "tables": [one for one in tables if one["rows"]],
        "tyres": maps,
    }


def _sentence(found: Campaign, count: int) -> str:
    many = len(found.conditions)
    synthetic = sum(c.synthetic for c in found.conditions)
    made = (
        "SYNTHETIC, nothing here was measured: "
        if synthetic == many
        else f"{synthetic} of {many} conditions SYNTHETIC: "
    )
    made = made if synthetic else ""
    said = []
    for words, unit, factor, of in QUANTITIES.values():
        values = [one.scaled(factor) for c in found.conditions if (one := of(c)) is not None]
        if len(values) == 1:
            low, high = values[0].ci95
            said.append(f"{words} {values[0].value:.4g} {unit} ({low:.4g} to {high:.4g})")
        elif values:
            low, high = min(one.value for one in values), max(one.value for one in values)
            said.append(f"{words} from {low:.4g} to {high:.4g} {unit}")
    recordings = f"{count} recording{'s' * (count != 1)} of {many} condition{'s' * (many != 1)}"
    left = f", {len(found.skipped)} left out" if found.skipped else ""
    return f"{made}{recordings}{left}: {'; '.join(said) or 'nothing could be measured'}."


def _columns() -> list[str]:
    found = ["tyre", "surface", "load N", "pressure bar"]
    for words, unit, _, _ in QUANTITIES.values():
        found += [f"{words} {unit}", "from", "to"]
    return [*found, "R²", "sweeps", "pulls", "steps"]


def _row(c: ConditionResult) -> list[Any]:
    found: list[Any] = [c.tyre, c.surface, c.load, c.pressure / PASCAL_PER_BAR]
    for _, _, factor, of in QUANTITIES.values():
        one = of(c)
        found += [None] * 3 if one is None else [one.scaled(factor).value, *one.scaled(factor).ci95]
    counts = [len(c.sweeps), 0 if c.borrowed_stiffness else len(c.pulls), len(c.steps)]
    return [
        None if isinstance(cell, float) and not np.isfinite(cell) else cell for cell in (*found, c.r_squared, *counts)
    ]


def _over_load(found: Campaign, name: str) -> dict[str, Any] | None:
    """A quantity over the load, a curve for each tyre, surface and pressure; None where it was not measured."""
    words, unit, factor, of = QUANTITIES[name]
    curves: dict[str, list[tuple[float, Estimate]]] = defaultdict(list)
    several = len({(c.tyre, c.surface) for c in found.conditions}) > 1
    for c in found.conditions:
        one = of(c)
        if one is not None:
            who = f"{c.tyre}, {c.surface}, " if several else ""
            curves[f"{who}{c.pressure / PASCAL_PER_BAR:g} bar"].append((c.load, one.scaled(factor)))
    if not curves:
        return None
    drawn = []
    for number, (label, points) in enumerate(curves.items()):
        points.sort(key=lambda point: point[0])
        half = [one.ci95[1] - one.value for _, one in points]
        drawn.append(
            Curve(label, number, [load for load, _ in points], [one.value for _, one in points],
                  "lines+markers", half)
        )  # fmt: skip
    title = words.removesuffix(f" {name}").capitalize()
    panel = Panel("", "load, N", f"{words}, {unit}", drawn)
    return entry(f"tyre-{name}", title, f"{title} over the load", [panel], columns=1, note="Bars: 95 % intervals.")


def _words(name: str) -> str:
    said = next((words for key, words in IMAGES.items() if Path(name).stem.startswith(key)), "Figure")
    return f"{said} ({name})"
