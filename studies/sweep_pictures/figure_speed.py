"""Along the speed: growth, damping and modes of all bicycles as bands, and the share that is unstable."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.output import write_csv
from studies.reporting.plotting import UNSTABLE, drawing, look, mode_look
from studies.sweep_pictures.quantities import ModeRows, growth_rates, mode_rows, smallest_damping
from studies.sweep_pictures.stored import Stored, speeds_of
from tyre.base.arrays import Array

LEAST_FOR_BANDS = 20  # bicycles; fewer are drawn one by one
MOST_LINES = 6  # combinations with a line of their own
MOST_MODES = 4
FEW_SPEEDS = 15
BANDS = ((0.05, 0.95), (0.25, 0.75))
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
BLUE = "#123a6b"
Quantiles = Mapping[float, Array]  # level -> (speeds,)


def draw_stability(stored: Stored, target: Path) -> str:
    """Share of unstable bicycles, largest growth rate and smallest damping ratio; returns what is to be seen.

    Parameters
    ----------
    stored : Stored
        With at least two speeds and one of these outputs.
    target : Path
        Without ending; the numbers go to ``.csv``.
    """
    speeds, rows = speeds_of(stored), list[pd.DataFrame]()
    growth = None if stored.reduced else growth_rates(stored)
    damping = None if stored.reduced else smallest_damping(stored)
    panels = [
        (name, unit, label, values)
        for name, unit, label, values in (
            ("largest_growth_rate", "1/s", "Largest growth rate, 1/s", growth),
            ("smallest_damping_ratio", "1", "Smallest damping ratio", damping),
        )
        if values is not None or f"{name}_quantiles" in stored.data
    ]
    tells = any(name == "largest_growth_rate" for name, *_ in panels)
    with drawing(target, width=8.0, height=2.6 * (len(panels) + tells) + 0.6) as canvas:
        every = canvas.subplots(len(panels) + tells, 1, sharex=True, squeeze=False)[:, 0]
        if tells:
            rows.append(_unstable(every[0], stored, speeds, growth))
        for axes, (name, unit, label, values) in zip(every[int(tells) :], panels, strict=True):
            rows += _panel(axes, stored, speeds, name, unit, values, legend=axes is every[int(tells)])
            axes.set_ylabel(label)
            axes.axhline(0, color="0.2", linewidth=0.8)
            low, high = axes.get_ylim()
            axes.axhspan(*((0, max(high, 1e-9)) if unit == "1/s" else (min(low, 0), 0)), color=UNSTABLE, zorder=0)
            axes.set_ylim(low, high)
        every[-1].set_xlabel("Speed, m/s")
        every[-1].set_xlim(speeds.min(), speeds.max())
        title = f"Stability of {_whose(stored)}" + ("; shaded: unstable" if panels else "")
        title += _between(speeds) + _how(stored)
        canvas.suptitle(stored.title(title, 7.7), x=0.01, ha="left", fontsize=9.5)
    write_csv(pd.concat(rows), target.with_name(f"{target.name}.csv"))
    return title


def draw_modes_along_speed(stored: Stored, target: Path) -> str:
    """Frequency and damping ratio of the named modes, a column each; returns what is to be seen.

    Parameters
    ----------
    stored : Stored
        With at least two speeds and one of modes, frequencies and damping_ratios.
    target : Path
        Without ending; the numbers go to ``.csv``.
    """
    speeds, rows = speeds_of(stored), list[pd.DataFrame]()
    every = _reduced_modes(stored) if stored.reduced else [(one.mode, one) for one in mode_rows(stored)]
    shown = [one for one in every if _oscillates(stored, *one)][:MOST_MODES]
    kinds = [kind for kind in ("frequency", "damping") if _has(stored, kind)]
    width = max(2.9 * len(shown) + 0.5, 6.0)
    with drawing(target, width=width, height=2.5 * len(kinds) + 1.0) as canvas:
        grid = canvas.subplots(len(kinds), max(len(shown), 1), sharex=True, squeeze=False)
        for column, (mode, one) in enumerate(shown):
            for line, kind in enumerate(kinds):
                axes = grid[line, column]
                name = {"frequency": "frequencies", "damping": "damping_ratios"}[kind]
                unit = "Hz" if kind == "frequency" else "1"
                values = None if one is None else getattr(one, kind)
                rows += _panel(axes, stored, speeds, name, unit, values, mode=mode, legend=line + column == 0)
                if kind == "damping":
                    axes.axhline(0, color="0.2", linewidth=0.8)
                    low = axes.get_ylim()[0]
                    axes.axhspan(min(low, 0), 0, color=UNSTABLE, zorder=0)
                    axes.set_ylim(low, None)
                if column == 0:
                    axes.set_ylabel("Frequency, Hz" if kind == "frequency" else "Damping ratio")
            grid[0, column].set_title(mode.replace("_", " "))
            grid[-1, column].set_xlabel("Speed, m/s")
        grid[0, 0].set_xlim(speeds.min(), speeds.max())
        left = [mode for mode, _ in every if mode not in [name for name, _ in shown]]
        title = f"Oscillating modes of {_whose(stored)}{_between(speeds)}{_how(stored)}"
        title += ";\na band is drawn where at least half of the bicycles have the mode" if _bands(stored) else ""
        title += f"; not drawn: {', '.join(left).replace('_', ' ')}" if left else ""
        canvas.suptitle(stored.title(title, width - 0.3), x=0.01, ha="left", fontsize=9.5)
    write_csv(pd.concat(rows), target.with_name(f"{target.name}.csv"))
    return title


def _whose(stored: Stored) -> str:
    if stored.reduced:
        per = stored.sweep.samples
        return f"{per} bicycles" + (f" in each of {stored.cells} combinations" if stored.cells > 1 else "")
    held = int(stored.possible.sum())
    words = stored.whose
    return words if held == stored.bicycles else f"the {held} possible of {words}"


def _how(stored: Stored) -> str:
    """What lines and bands are, where the legend has no room for it."""
    if not stored.reduced or (stored.cells == 1 and 0.5 in (stored.sweep.quantiles or ())):
        return ""
    if stored.cells > MOST_LINES:
        return "\nquantiles are not drawn, as there are too many combinations"
    levels = sorted(stored.sweep.quantiles or ())
    pairs = _pairs(levels)
    lines = ["median"] if 0.5 in levels else [] if pairs else [f"quantile {level:g}" for level in levels]
    bands = ", ".join(f"{100 * (high - low):.3g} %" for low, high in pairs)
    said = [f"lines: {', '.join(lines)}"] * bool(lines) + [f"bands: {bands} of the bicycles"] * bool(pairs)
    return f"\n{'; '.join(said)}"


def _bands(stored: Stored) -> bool:
    return stored.reduced or stored.bicycles >= LEAST_FOR_BANDS


def _has(stored: Stored, kind: str) -> bool:
    name = "frequencies" if kind == "frequency" else "damping_ratios"
    return f"{name}_quantiles" in stored.data or name in stored.data or ("modes" in stored.data and not stored.reduced)


def _reduced_modes(stored: Stored) -> list[tuple[str, ModeRows | None]]:
    names = [str(name) for name in stored.data["mode"].values]
    name = next(one for one in ("damping_ratios", "frequencies") if f"{one}_count" in stored.data)
    return [(mode, None) for mode in names if stored.reduced_rows(f"{name}_count", mode=mode).any()]


def _oscillates(stored: Stored, mode: str, one: ModeRows | None) -> bool:
    """Whether most bicycles have an oscillation of that name at some speed."""
    if one is None:
        name = next(n for n in ("frequencies", "damping_ratios") if f"{n}_max" in stored.data)
        return bool((stored.reduced_rows(f"{name}_max", mode=mode) > 0).any())
    values = one.frequency if one.frequency is not None else one.damping
    assert values is not None
    with np.errstate(invalid="ignore"):
        return bool(((np.abs(values) > 0).mean((0, 1)) >= 0.5).any())


def _unstable(axes: Any, stored: Stored, speeds: Array, growth: Array | None) -> pd.DataFrame:
    if growth is None:
        count = stored.reduced_rows("largest_growth_rate_count")
        above = stored.reduced_rows("largest_growth_rate_above_zero")
    else:
        count, above = np.isfinite(growth).sum(1), (growth > 0).sum(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axes.plot(speeds, 100 * above.sum(0) / count.sum(0), color=BLUE, linewidth=2.2, label="all", **_marks(speeds))
        if 1 < stored.cells <= MOST_LINES and count.max() > 1:
            for cell, name in enumerate(stored.cell_names):
                axes.plot(
                    speeds, 100 * above[cell] / count[cell], linewidth=1.0, color=look(cell).colour,
                    marker=look(cell).marker, markersize=4, markevery=max(len(speeds) // 12, 1), label=name,
                )  # fmt: skip
            axes.legend(fontsize=7.5, loc="best")
    axes.set_ylabel("Unstable, %")
    axes.set_ylim(-4, 104)
    return pd.DataFrame(
        {"quantity": "unstable", "mode": "", "speed_m_s": speeds, "unit": "share of those that have a value",
         "bicycles": count.sum(0), "share": above.sum(0) / np.maximum(count.sum(0), 1)}
    )  # fmt: skip


def _panel(
    axes: Any, stored: Stored, speeds: Array, name: str, unit: str, values: Array | None, mode: str = "",
    *, legend: bool,
) -> list[pd.DataFrame]:  # fmt: skip
    """Bands, or lines of few bicycles; the numbers."""
    colour = mode_look(mode).colour if mode else BLUE
    if values is None:
        return _reduced_panel(axes, stored, speeds, name, unit, mode, colour, legend=legend)
    flat = values.reshape(-1, len(speeds))
    has = np.isfinite(flat).sum(0)
    quantiles = {level: _quantile(flat, level) for level in LEVELS}
    if len(flat) < LEAST_FOR_BANDS:
        for row in flat:
            axes.plot(speeds, row, color=colour, linewidth=0.9, alpha=0.8, **_marks(speeds))
    else:
        drawn = has >= 0.5 * stored.possible.sum()
        _draw_bands(
            axes, speeds, {level: np.where(drawn, q, np.nan) for level, q in quantiles.items()}, colour, legend=legend
        )
    _limit(axes, quantiles, flat)
    return [_table(name, mode, unit, speeds, has, quantiles)]


def _reduced_panel(
    axes: Any, stored: Stored, speeds: Array, name: str, unit: str, mode: str, colour: str, *, legend: bool
) -> list[pd.DataFrame]:
    place = {"mode": mode} if mode else {}
    held = stored.reduced_rows(f"{name}_quantiles", **place)
    count = stored.reduced_rows(f"{name}_count", **place)
    found, names = [], stored.cell_names
    for cell in range(stored.cells):
        quantiles = {level: held[cell, :, k] for k, level in enumerate(stored.sweep.quantiles or ())}
        drawn = {q: np.where(count[cell] >= 0.5 * stored.sweep.samples, v, np.nan) for q, v in quantiles.items()}
        if stored.cells <= MOST_LINES:
            own = colour if stored.cells == 1 else look(cell).colour
            _draw_bands(axes, speeds, drawn, own, label=names[cell], legend=legend)
        table = _table(name, mode, unit, speeds, count[cell], quantiles)
        table.insert(0, "combination", names[cell])
        found.append(table)
    return found


def _draw_bands(
    axes: Any, speeds: Array, quantiles: Quantiles, colour: str, label: str = "", *, legend: bool = True
) -> None:
    levels = sorted(quantiles)
    pairs = _pairs(levels)
    for k, (low, high) in enumerate(pairs):
        axes.fill_between(
            speeds, quantiles[low], quantiles[_nearest(levels, high)], color=colour, alpha=0.16 + 0.14 * k, linewidth=0,
            label=f"{100 * (high - low):.3g} % of the bicycles" if not label else None,
        )  # fmt: skip
    middle = [level for level in levels if level == 0.5]
    for level in middle or ([] if pairs else levels):
        said = "median" if middle else f"quantile {level:g}"
        axes.plot(speeds, quantiles[level], color=colour, label=label or said, **_marks(speeds))
    if legend:
        axes.legend(fontsize=7.5, loc="best")


def _pairs(levels: Sequence[float]) -> list[tuple[float, float]]:
    """Quantiles that are the ends of a central band, the widest first."""
    return [(low, 1 - low) for low in levels if low < 0.5 and any(abs(low + other - 1) < 1e-9 for other in levels)]


def _marks(speeds: Array) -> dict[str, Any]:
    """Marks at the speeds themselves where they are few: between them nothing is computed."""
    return {"marker": "o", "markersize": 3.5} if len(speeds) <= FEW_SPEEDS else {}


def _between(speeds: Array) -> str:
    """What lines are between such marks, so that nobody reads a critical speed there."""
    return "; computed at the marks, straight lines between them" if _marks(speeds) else ""


def _nearest(levels: Sequence[float], level: float) -> float:
    return min(levels, key=lambda one: abs(one - level))


def _quantile(flat: Array, level: float) -> Array:
    found = np.full(flat.shape[1], np.nan)
    for k in range(flat.shape[1]):
        held = flat[np.isfinite(flat[:, k]), k]
        if held.size:
            found[k] = np.quantile(held, level)
    return found


def _limit(axes: Any, quantiles: Quantiles, flat: Array) -> None:
    """Keep the view to nine tenths of the bicycles where the rest lies far away."""
    if len(flat) < LEAST_FOR_BANDS or not np.isfinite(flat).any():
        return
    low, high = np.nanmin(quantiles[LEVELS[0]]), np.nanmax(quantiles[LEVELS[-1]])
    room = 0.06 * (high - low) or 0.05 * (abs(high) or 1)
    axes.set_ylim(low - room, high + room)


def _table(
    name: str, mode: str, unit: str, speeds: Array, has: Sequence[int] | Array, quantiles: Quantiles
) -> pd.DataFrame:
    columns = {f"q{100 * level:g}": values for level, values in quantiles.items()}
    return pd.DataFrame({"quantity": name, "mode": mode, "speed_m_s": speeds, "unit": unit, "bicycles": has, **columns})
