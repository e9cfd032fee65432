"""Figures along the speed: stability in numbers of a bicycle, and the named modes."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd

from studies.model_space.outputs import OUTPUTS, Output
from studies.reporting.plotting import UNSTABLE, drawing, look, mode_look
from studies.sweep.figure_files import BLUE, LEVELS, MOST_LINES, Drawn, quantiles_of
from studies.sweep.stored import Stored
from tyre.ground.arrays import Array

LEAST_FOR_BANDS = 20  # bicycles; fewer are drawn one by one
MOST_MODES = 4  # in a figure
GROWTH = OUTPUTS["max_growth_rate"]


def draw_stability(drawn: Drawn) -> None:
    """Draw the share of unstable bicycles and every output of one number along the speed; numbers in ``.csv``."""
    name, stored, rows = "stability_along_speed", drawn.stored, list[pd.DataFrame]()
    outputs = [output for output in OUTPUTS.values() if output.along == "stability"]
    panels = {output: None if stored.reduced else stored.scalar(output) for output in outputs}
    panels = {o: v for o, v in panels.items() if v is not None or f"{o.name}_quantiles" in stored.data}
    tells = GROWTH in panels
    with drawing(drawn.folder / name, width=8.0, height=2.6 * (len(panels) + tells) + 0.6) as canvas:
        panel_axes = canvas.subplots(len(panels) + tells, 1, sharex=True, squeeze=False)[:, 0]
        if tells:
            rows.append(_draw_unstable_share(panel_axes[0], stored, panels[GROWTH]))
        for axes, (output, values) in zip(panel_axes[int(tells) :], panels.items(), strict=True):
            rows += _draw_panel(axes, stored, output, values, legend=axes is panel_axes[int(tells)])
            axes.set_ylabel(output.title)
        panel_axes[-1].set(xlabel="Speed, m/s", xlim=(stored.speeds.min(), stored.speeds.max()))
        drawn.title(canvas, name, f"Stability of {stored.whose}; shaded: unstable{_describe_lines(stored)}", 7.7)
    drawn.table(name, rows)


def draw_modes(drawn: Drawn) -> None:
    """Draw frequency, damping ratio and further outputs of the named modes, a column each; numbers in ``.csv``."""
    name, stored, rows = "modes_along_speed", drawn.stored, list[pd.DataFrame]()
    mode_outputs = [output for output in OUTPUTS.values() if output.along == "modes"]
    whole = "modes" in stored.data and not stored.reduced
    outputs = [output for output in mode_outputs if whole or output.name in stored.sweep.outputs]
    by_mode = stored.named
    if stored.reduced:
        count = f"{outputs[-1].name}_count"
        by_mode = {mode: {} for mode in stored.modes("mode") if stored.rows(count, mode=mode).any()}
    columns = [mode for mode in by_mode if _oscillates(stored, mode, by_mode[mode], outputs[0].name)][:MOST_MODES]
    width = max(2.9 * len(columns) + 0.5, 6.0)
    with drawing(drawn.folder / name, width=width, height=2.5 * len(outputs) + 1.0) as canvas:
        grid = canvas.subplots(len(outputs), max(len(columns), 1), sharex=True, squeeze=False)
        for column, mode in enumerate(columns):
            for line, output in enumerate(outputs):
                values = by_mode[mode].get(output.name)
                rows += _draw_panel(grid[line, column], stored, output, values, mode, legend=line + column == 0)
                grid[line, 0].set_ylabel(output.title[0].upper() + output.title[1:])
            grid[0, column].set_title(mode.replace("_", " "))
            grid[-1, column].set_xlabel("Speed, m/s")
        grid[0, 0].set_xlim(stored.speeds.min(), stored.speeds.max())
        not_drawn = ", ".join(mode for mode in by_mode if mode not in columns).replace("_", " ")
        title = f"Oscillating modes of {stored.whose}{_describe_lines(stored)}"
        if stored.reduced or not all(_as_lines(stored, x) for mode in columns for x in by_mode[mode].values()):
            title += ";\na band is drawn where at least half of the bicycles have the mode"
        title += f"; not drawn: {not_drawn}" if not_drawn else ""
        drawn.title(canvas, name, title, width - 0.3)
    drawn.table(name, rows)


def _describe_lines(stored: Stored) -> str:
    """Words on what lines and bands are, so that no critical speed is read between few speeds."""
    has_lines = stored.cells <= MOST_LINES
    lines = "\nlines and bands: the quantiles that [reduce] kept" if has_lines else "\ntoo many combinations for lines"
    marks = "; computed at the marks, straight lines between them" if _dots(stored.speeds) else ""
    return marks + lines * stored.reduced


def _as_lines(stored: Stored, values: Array) -> bool:
    """True if so few bicycles have a line each, and no band."""
    return values.size < LEAST_FOR_BANDS * len(stored.speeds)


def _oscillates(stored: Stored, mode: str, values: Mapping[str, Array], name: str) -> bool:
    """True if most bicycles have an oscillation of that name at some speed."""
    if stored.reduced:
        return bool((stored.rows(f"{name}_max", mode=mode) > 0).any())
    with np.errstate(invalid="ignore"):
        return bool(((np.abs(values[name]) > 0).mean((0, 1)) >= 0.5).any())


def _draw_unstable_share(axes: Any, stored: Stored, growth: Array | None) -> pd.DataFrame:
    speeds = stored.speeds
    if growth is None:
        count, unstable = (stored.rows(f"{GROWTH.name}_{statistic}")[:, 0] for statistic in ("count", "above_zero"))
    else:
        count, unstable = np.isfinite(growth).sum(1), (growth > 0).sum(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axes.plot(speeds, 100 * unstable.sum(0) / count.sum(0), color=BLUE, linewidth=2.2, label="all", **_dots(speeds))
        if 1 < stored.cells <= MOST_LINES and count.max() > 1:
            for cell, name in enumerate(stored.cell_names):
                axes.plot(
                    speeds,
                    100 * unstable[cell] / count[cell],
                    linewidth=1.0,
                    color=look(cell).colour,
                    marker=look(cell).marker,
                    markersize=4,
                    markevery=max(len(speeds) // 12, 1),
                    label=name,
                )
            axes.legend(fontsize=7.5, loc="best")
    axes.set(ylabel="Unstable, %", ylim=(-4, 104))
    return pd.DataFrame(
        {
            "quantity": "unstable",
            "mode": "",
            "speed_m_s": speeds,
            "unit": "share of those that have a value",
            "bicycles": count.sum(0),
            "share": unstable.sum(0) / np.maximum(count.sum(0), 1),
        }
    )


def _draw_panel(
    axes: Any, stored: Stored, output: Output, values: Array | None, mode: str = "", *, legend: bool
) -> list[pd.DataFrame]:
    """Draw bands, or lines of few bicycles, with the unstable side shaded; the numbers."""
    speeds, bands = stored.speeds, _tabulate_bands(stored, output, values, mode)
    colour = mode_look(mode).colour if mode else BLUE
    rows = None if values is None else values.reshape(-1, len(speeds))
    if values is not None and rows is not None and _as_lines(stored, values):
        axes.plot(speeds, rows.T, color=colour, linewidth=0.9, alpha=0.8, **_dots(speeds))
    elif len(bands) <= MOST_LINES:
        for number, band in enumerate(bands):
            _draw_band(axes, band, colour if len(bands) == 1 else look(number).colour)
        if legend:
            axes.legend(fontsize=7.5, loc="best")
    if rows is not None and len(rows) >= LEAST_FOR_BANDS and np.isfinite(rows).any():
        low, high = bands[0]["q5"].min(), bands[0]["q95"].max()
        room = 0.06 * (high - low) or 0.05 * (abs(high) or 1)  # the rest may lie far away
        axes.set_ylim(low - room, high + room)
    if output.unstable:
        axes.axhline(0, color="0.2", linewidth=0.8)
        low, high = axes.get_ylim()
        axes.axhspan(*((0, max(high, 1e-9)) if output.unstable > 0 else (min(low, 0), 0)), color=UNSTABLE, zorder=0)
        axes.set_ylim(low, None if mode else high)
    return [band.drop(columns=["shown"] if stored.reduced else ["shown", "combination"]) for band in bands]


def _draw_band(axes: Any, band: pd.DataFrame, colour: str) -> None:
    speeds, name = band["speed_m_s"], band["combination"].iloc[0]
    quantiles = band.filter(regex=r"^q\d")
    values = dict(sorted((float(str(key)[1:]) / 100, quantiles[key].where(band["shown"])) for key in quantiles))
    # ends of central bands, the widest first
    pairs = [(low, high) for low in values for high in values if low < 0.5 and abs(low + high - 1) < 1e-9]
    for k, (low, high) in enumerate(pairs):
        axes.fill_between(
            speeds,
            values[low],
            values[high],
            color=colour,
            alpha=0.16 + 0.14 * k,
            linewidth=0,
            label=None if name else f"{100 * (high - low):.3g} % of the bicycles",
        )
    for level in [0.5] if 0.5 in values else [] if pairs else values:
        label = name or ("median" if level == 0.5 else f"quantile {level:g}")
        axes.plot(speeds, values[level], color=colour, label=label, **_dots(speeds))


def _dots(speeds: Any) -> dict[str, Any]:
    """Marks at the speeds themselves if they are few: between them nothing is computed."""
    return {"marker": "o", "markersize": 3.5} if len(speeds) <= 15 else {}


def _tabulate_bands(stored: Stored, output: Output, values: Array | None, mode: str) -> list[pd.DataFrame]:
    """Quantiles along the speed as tables: all bicycles together, from values (cells, samples, speeds), else by cell.

    ``shown`` is true where half of the bicycles have the output.
    """
    shared = {"quantity": output.name, "mode": mode, "speed_m_s": stored.speeds, "unit": output.unit}
    if values is not None:
        flat = values.reshape(-1, values.shape[-1])
        levels, least = LEVELS, 0.5 * stored.possible.sum()
        tables: Iterable[tuple[str, Array, Array]] = [("", np.isfinite(flat).sum(0), quantiles_of(flat, LEVELS).T)]
    else:
        levels, least, place = stored.sweep.quantiles or (), 0.5 * stored.sweep.samples, {"mode": mode} if mode else {}
        statistics = (stored.rows(f"{output.name}_{statistic}", **place)[:, 0] for statistic in ("count", "quantiles"))
        tables = zip(stored.cell_names, *statistics, strict=True)
    return [
        pd.DataFrame(
            {
                "combination": name,
                **shared,
                "bicycles": count,
                **{f"q{100 * level:g}": quantiles[:, k] for k, level in enumerate(levels)},
                "shown": count >= least,
            }
        )
        for name, count, quantiles in tables
    ]
