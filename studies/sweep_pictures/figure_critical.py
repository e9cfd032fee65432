"""Critical speeds: how they are distributed by name, and for few bicycles or combinations, each of them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.output import write_csv
from studies.reporting.plotting import drawing, mode_look
from studies.sweep_pictures.quantities import CRITICAL, Limits, limits, without_limits
from studies.sweep_pictures.stored import Stored
from studies.sweeps.chunk import CHANGES
from tyre.base.arrays import Array

LEAST_FOR_BARS = 30  # bicycles
MOST_ROWS = 40  # combinations that fit a figure
BINS = 40
SHARES = (0.05, 0.25, 0.5, 0.75, 0.95)
OCCURRENCE = ("first", "second", "third", "fourth")


def draw_distributions(stored: Stored, target: Path) -> str:
    """Bars of the critical speeds of each name and direction; returns what is to be seen, in words.

    Parameters
    ----------
    stored : Stored
        With critical speeds of every sample.
    target : Path
        Without ending; the numbers go to ``.csv`` and ``_bins.csv``.
    """
    found = list(limits(stored))
    top = stored.sweep.max_speed
    count, none = int(stored.possible.sum()), without_limits(stored)
    title = f"Critical speeds up to {top:g} m/s of {stored.whose}; {none} of {count} possible ones have none"
    rows, bars = [], []
    columns = min(3, max(len(found), 1))
    lines = -(-len(found) // columns)
    with drawing(target, width=4.1 * columns + 0.4, height=2.5 * lines + 0.7) as canvas:
        every = canvas.subplots(lines, columns, squeeze=False)
        for axes, one in zip(every.flat, found, strict=False):
            bars += _bars(axes, one)
            axes.set_title(f"{one.words}\n{one.share_words()}", fontsize=8.5)
        for axes in list(every.flat)[len(found) :]:
            axes.set_visible(False)
        for axes in every[:, 0]:
            axes.set_ylabel("Bicycles")
        for column in range(columns):
            last = max(k for k in range(lines) if k * columns + column < len(found))
            every[last, column].set_xlabel("Critical speed, m/s")
        canvas.suptitle(stored.title(title, 4.1 * columns), x=0.01, ha="left", fontsize=9.5)
    for one in found:
        rows += summary(one)
    write_csv(pd.DataFrame(rows), target.with_name(f"{target.name}.csv"))
    write_csv(pd.DataFrame(bars), target.with_name(f"{target.name}_bins.csv"))
    return title


def summary(one: Limits) -> list[dict[str, Any]]:
    """A row for each occurrence of a critical speed: how many have it, and how it is distributed (m/s)."""
    found = []
    for k in range(one.speeds.shape[-1]):
        speeds = one.speeds[..., k][one.possible]
        held = speeds[np.isfinite(speeds)]
        if not held.size:
            continue
        quantiles = {f"q{100 * share:g}_m_s": float(np.quantile(held, share)) for share in SHARES}
        found.append(
            {"mode": one.mode, "as_speed_grows": one.change, "occurrence": k + 1, "bicycles": len(speeds),
             "have_it": held.size, "have_none": len(speeds) - held.size, "min_m_s": held.min(), **quantiles,
             "max_m_s": held.max(), "mean_m_s": held.mean(), "sd_m_s": held.std(ddof=1) if held.size > 1 else None}
        )  # fmt: skip
    return found


def _bars(axes: Any, one: Limits) -> list[dict[str, Any]]:
    held = [one.speeds[..., k][one.possible] for k in range(one.speeds.shape[-1])]
    held = [speeds[np.isfinite(speeds)] for speeds in held]
    held = [speeds for speeds in held if speeds.size]
    low, high = min(s.min() for s in held), max(s.max() for s in held)
    edge = max(1e-3, 1e-3 * high)
    edges = np.linspace(low, high, BINS + 1) if high - low > edge else np.array([low - edge, high + edge])
    look, below, found = mode_look(one.mode), np.zeros(len(edges) - 1), []
    for k, speeds in enumerate(held):
        counts, _ = np.histogram(speeds, edges)
        axes.bar(
            edges[:-1], counts, np.diff(edges), bottom=below, align="edge", color=look.colour, alpha=1 - 0.28 * k,
            hatch=("", "////", "....", "xxxx")[k], edgecolor="white", linewidth=0.3,
            label=OCCURRENCE[k] if len(held) > 1 else None,
        )  # fmt: skip
        below = below + counts
        found += [
            {"mode": one.mode, "as_speed_grows": one.change, "occurrence": k + 1, "from_m_s": edges[i],
             "to_m_s": edges[i + 1], "bicycles": int(counts[i])} for i in range(len(counts)) if counts[i]
        ]  # fmt: skip
    if len(held) > 1:
        axes.legend(title="crossing", title_fontsize=8)
    axes.set_ylim(0, 1.08 * below.max())
    return found


def draw_each(stored: Stored, target: Path) -> str:
    """Critical speeds of each combination of the grid, a row each; returns what is to be seen, in words.

    Parameters
    ----------
    stored : Stored
        With critical speeds of every sample or their quantiles, at most :data:`MOST_ROWS` combinations.
    target : Path
        Without ending; the numbers go to ``.csv``.
    """
    table = each_table(stored)
    names = stored.cell_names
    several = stored.reduced or stored.samples > 1
    top = stored.sweep.max_speed
    title = f"Critical speeds up to {top:g} m/s of {_each_of(stored)}"
    title += f"; mark: median, line: {_range_words(stored)}" if several else ""
    width = 8.6 + 0.06 * max(len(name) for name in names)
    with drawing(target, width=width, height=1.5 + 0.34 * len(names) + (0.25 if several else 0)) as canvas:
        axes = canvas.subplots()
        shown = list(dict.fromkeys(zip(table["mode"], table["as_speed_grows"], strict=True)))
        offsets = np.linspace(-0.25, 0.25, len(shown)) if several and len(shown) > 1 else np.zeros(len(shown))
        for (mode, change), offset in zip(shown, offsets, strict=True):
            rows = table[(table["mode"] == mode) & (table["as_speed_grows"] == change)]
            rows = rows[rows["have_it"] > 0]
            _marks(axes, rows, mode, change, float(offset), int(np.sum(possible_in(stored))), several=several)
        for row, words in _without(stored, table).items():
            axes.text(1.005, row, words, transform=axes.get_yaxis_transform(), fontsize=7.5, va="center", color="0.35")
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.set_xlabel("Critical speed, m/s")
        if shown:
            canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        canvas.suptitle(stored.title(title, width - 0.5), x=0.01, ha="left", fontsize=9.5)
    write_csv(table, target.with_name(f"{target.name}.csv"))
    return title


def _each_of(stored: Stored) -> str:
    per = stored.sweep.samples if stored.reduced else stored.samples
    what = "bicycles" if len(stored.sweep.axes) == 1 and stored.sweep.axes[0].name == "bicycle" else "combinations"
    if stored.cells == 1:
        return f"{per} bicycles" if per > 1 else "one bicycle"
    return f"{stored.cells} {what}" + (f", {per} samples each" if per > 1 else "")


def _range_words(stored: Stored) -> str:
    low, _, high = _quantiles(stored)
    return f"{100 * (high - low):g} % of those that have it"


def _quantiles(stored: Stored) -> tuple[float, float, float]:
    """Shares of the line's ends and the mark; of a reduced result those it holds, the outermost and nearest to 0.5."""
    if not stored.reduced:
        return 0.05, 0.5, 0.95
    held = stored.sweep.quantiles or ()
    return min(held), min(held, key=lambda share: abs(share - 0.5)), max(held)


def each_table(stored: Stored) -> pd.DataFrame:
    """A row for each combination, name, direction and occurrence: low, median, high (m/s) and how many have it."""
    low, middle, high = _quantiles(stored)
    rows = []
    for mode in [str(name) for name in stored.data["crossing_mode"].values]:
        for change in CHANGES:
            place = {"crossing_mode": mode, "as_speed_grows": change}
            if stored.reduced:
                values = stored.reduced_rows(f"{CRITICAL}_quantiles", **place)
                held = list(stored.sweep.quantiles or ())
                three = np.stack([values[..., held.index(share)] for share in (low, middle, high)], -1)
                count = stored.reduced_rows(f"{CRITICAL}_count", **place)
            else:
                speeds = np.where(stored.possible[..., None], stored.rows(CRITICAL, **place), np.nan)
                three, count = _three(speeds, (low, middle, high)), np.isfinite(speeds).sum(1)
            for cell, k in np.argwhere(count > 0):
                rows.append(
                    {"combination": stored.cell_names[cell], "row": cell, "mode": mode, "as_speed_grows": change,
                     "occurrence": k + 1, "possible": possible_in(stored)[cell], "have_it": int(count[cell, k]),
                     **{f"q{100 * share:g}_m_s": three[cell, k, i] for i, share in enumerate((low, middle, high))}}
                )  # fmt: skip
    names = ["combination", "row", "mode", "as_speed_grows", "occurrence", "possible", "have_it"]
    return pd.DataFrame(rows, columns=None if rows else names)


def possible_in(stored: Stored) -> Array:
    """How many bicycles of each combination are possible."""
    if not stored.reduced:
        return np.asarray(stored.possible.sum(1))
    if "impossible_above_zero" not in stored.data:
        return np.full(stored.cells, stored.sweep.samples)
    return stored.sweep.samples - stored.reduced_rows("impossible_above_zero").astype(int)


def _three(speeds: Array, levels: Sequence[float]) -> Array:
    found = np.full((len(speeds), speeds.shape[-1], 3), np.nan)
    for cell in range(len(speeds)):
        for k in range(speeds.shape[-1]):
            held = speeds[cell, :, k]
            held = held[np.isfinite(held)]
            if held.size:
                found[cell, k] = np.quantile(held, levels)
    return found


def _marks(axes: Any, rows: pd.DataFrame, mode: str, change: str, offset: float, count: int, *, several: bool) -> None:
    look = mode_look(mode)
    filled = look.colour if change == CHANGES[0] else "white"
    words = "unnamed modes" if mode == "other" else mode.replace("_", " ")
    first = rows[rows["occurrence"] == 1]
    label = f"{words}: {'unstable' if change == CHANGES[0] else 'stable'} above ({first['have_it'].sum()} of {count})"
    low, middle, high = (rows[name].to_numpy() for name in [name for name in map(str, rows) if name.startswith("q")])
    height = rows["row"].to_numpy() + offset
    if several:
        axes.hlines(height, low, high, color=look.colour, linewidth=1.3)
    axes.plot(
        middle, height, look.marker, color=look.colour, markerfacecolor=filled, markersize=6.5, linestyle="none",
        label=label,
    )  # fmt: skip


def _without(stored: Stored, table: pd.DataFrame) -> dict[int, str]:
    """Rows of combinations that have no critical speed, or have some of them in a part of the samples only."""
    found = {}
    for cell, possible in enumerate(possible_in(stored)):
        rows = table[(table["row"] == cell) & (table["occurrence"] == 1)] if len(table) else table
        if not possible:
            found[cell] = "all impossible"
        elif not len(rows):
            found[cell] = "none"
        elif possible > 1:
            parts = [
                f"{mode.replace('_', ' ')} {'un' if change == CHANGES[0] else ''}stable {have} of {possible}"
                for mode, change, have in zip(rows["mode"], rows["as_speed_grows"], rows["have_it"], strict=True)
                if have < possible
            ]
            found |= {cell: "; ".join(parts)} if parts else {}
    return found
