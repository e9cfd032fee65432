"""Figure of critical speeds: bars of many bicycles, rows of the combinations of a grid."""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from studies.model_space.outputs import CHANGES
from studies.reporting.plotting import drawing, mode_look
from studies.sweep.figure_files import LEVELS, Drawn, quantiles_of
from studies.sweep.stored import CRITICAL, Limits, Stored, limit_words
from tyre.ground.arrays import Array

LEAST_FOR_BARS = 30  # bicycles
MOST_ROWS = 40  # combinations of the grid
HATCHES = (("first", ""), ("second", "////"), ("third", "...."), ("fourth", "xxxx"))


def draw_critical_speeds(drawn: Drawn) -> None:
    """Draw critical speeds (m/s): bars of many bicycles, and a row for each combination of a small grid."""
    stored = drawn.stored
    if not np.nansum(stored.rows(f"{CRITICAL}_count" if stored.reduced else CRITICAL)):
        drawn.lacking["critical"] = True
        return
    many = not stored.reduced and stored.bicycles >= LEAST_FOR_BARS
    if many:
        _draw_bars(drawn, "critical_speeds")
    if stored.cells > MOST_ROWS:
        drawn.lacking["rows"] = MOST_ROWS
    elif stored.cells > 1 or not many:
        _draw_rows(drawn, "critical_speeds_each")


def _draw_bars(drawn: Drawn, name: str) -> None:
    """Draw bars of the critical speeds of each name and direction; the numbers go to ``.csv`` and ``_bins.csv``."""
    stored = drawn.stored
    limits, count = stored.limits, int(stored.possible.sum())
    has = sum((np.isfinite(limit.speeds).any(-1) for limit in limits), np.zeros_like(stored.possible))
    title = (
        f"Critical speeds up to {stored.sweep.max_speed:g} m/s of {stored.whose}; "
        f"{(stored.possible & ~has).sum()} of {count} possible ones have none"
    )
    bars, columns = list[dict[str, Any]](), min(3, max(len(limits), 1))
    lines = -(-len(limits) // columns)
    with drawing(drawn.folder / name, width=4.1 * columns + 0.4, height=2.5 * lines + 0.7) as canvas:
        panels = canvas.subplots(lines, columns, squeeze=False)
        for axes, limit in zip(panels.flat, limits, strict=False):
            bars += _draw_histogram(axes, limit)
            number = np.isfinite(limit.speeds).sum(-1)[stored.possible]
            shares = f"{(number == 0).sum()} of {len(number)} have none, {(number > 1).sum()} several"
            axes.set_title(f"{limit.words}\n{shares}", fontsize=8.5)
        for axes in list(panels.flat)[len(limits) :]:
            axes.set_visible(False)
        for axes in panels[:, 0]:
            axes.set_ylabel("Bicycles")
        for column in range(columns):
            last = max(k for k in range(lines) if k * columns + column < len(limits))
            panels[last, column].set_xlabel("Critical speed, m/s")
        drawn.title(canvas, name, title, 4.1 * columns)
    drawn.table(name, [row for limit in limits for row in _summarise(limit, count)])
    drawn.table(f"{name}_bins", bars)


def _summarise(limit: Limits, count: int) -> Iterator[dict[str, Any]]:
    """A row for each occurrence of a critical speed: how many have it, and how it is distributed (m/s)."""
    for k, speeds in enumerate(limit.by_occurrence, 1):
        quantiles = {f"q{100 * share:g}_m_s": float(np.quantile(speeds, share)) for share in LEVELS}
        yield {
            "mode": limit.mode,
            "as_speed_grows": limit.change,
            "occurrence": k,
            "bicycles": count,
            "have_it": speeds.size,
            "have_none": count - speeds.size,
            "min_m_s": speeds.min(),
            **quantiles,
            "max_m_s": speeds.max(),
            "mean_m_s": speeds.mean(),
            "sd_m_s": speeds.std(ddof=1) if speeds.size > 1 else None,
        }


def _draw_histogram(axes: Any, limit: Limits) -> Iterator[dict[str, Any]]:
    """Draw critical speeds (m/s) of one mode and direction as stacked bars by occurrence; a row for each bar."""
    all_speeds = np.concatenate(limit.by_occurrence)
    low, high = all_speeds.min(), all_speeds.max()
    edge = max(1e-3, 1e-3 * high)
    edges = np.linspace(low, high, 41) if high - low > edge else np.array([low - edge, high + edge])
    counts = [np.histogram(speeds, edges)[0] for speeds in limit.by_occurrence]
    for k, (count, (label, hatch)) in enumerate(zip(counts, HATCHES, strict=False)):
        axes.bar(
            edges[:-1],
            count,
            np.diff(edges),
            bottom=np.sum(counts[:k], axis=0),
            align="edge",
            alpha=1 - 0.28 * k,
            color=mode_look(limit.mode).colour,
            hatch=hatch,
            edgecolor="white",
            linewidth=0.3,
            label=label if len(counts) > 1 else None,
        )
        for i in np.flatnonzero(count):
            yield {
                "mode": limit.mode,
                "as_speed_grows": limit.change,
                "occurrence": k + 1,
                "from_m_s": edges[i],
                "to_m_s": edges[i + 1],
                "bicycles": int(count[i]),
            }
    if len(counts) > 1:
        axes.legend(title="crossing", title_fontsize=8)
    axes.set_ylim(0, 1.08 * np.sum(counts, axis=0).max())


def _draw_rows(drawn: Drawn, name: str) -> None:
    """Draw critical speeds of each combination of the grid, a row each; the numbers go to ``.csv``."""
    stored, names = drawn.stored, drawn.stored.cell_names
    several = stored.reduced or stored.samples > 1
    levels = list(stored.sweep.quantiles or LEVELS)
    # ends of the line and its mark: of a reduced result the outermost quantiles, and the one nearest to 0.5
    ends = (min(levels), min(levels, key=lambda share: abs(share - 0.5)), max(levels))
    possible = np.asarray(stored.possible.sum(1))
    if stored.reduced:
        possible = np.full(stored.cells, stored.sweep.samples)
        if "impossible_above_zero" in stored.data:
            possible = possible - stored.rows("impossible_above_zero")[:, 0].astype(int)
    table = _tabulate_rows(stored, ends, possible)
    title = f"Critical speeds up to {stored.sweep.max_speed:g} m/s of {stored.whose}"
    title += f"; mark: median, line: {100 * (ends[2] - ends[0]):g} % of those that have it" * several
    width = 8.6 + 0.06 * max(map(len, names))
    with drawing(drawn.folder / name, width=width, height=1.5 + 0.34 * len(names) + (0.25 if several else 0)) as canvas:
        axes = canvas.subplots()
        groups = dict(tuple(table.groupby(["mode", "as_speed_grows"], sort=False)))
        offsets = np.linspace(-0.25, 0.25, len(groups)) if several and len(groups) > 1 else np.zeros(len(groups))
        for (key, rows), offset in zip(groups.items(), offsets, strict=True):
            mode, change = (str(part) for part in key)
            colour, marker = mode_look(mode).colour, mode_look(mode).marker
            have = rows[rows["occurrence"] == 1]["have_it"].sum()
            low, middle, high = (rows[f"q{100 * share:g}_m_s"] for share in ends)
            if several:
                axes.hlines(rows["row"] + offset, low, high, color=colour, linewidth=1.3)
            axes.plot(
                middle,
                rows["row"] + offset,
                marker,
                color=colour,
                linestyle="none",
                markersize=6.5,
                label=f"{limit_words(mode, change)} ({have} of {possible.sum()})",
                markerfacecolor=colour if change == CHANGES[0] else "white",
            )
        _write_counts(axes, table, possible)
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set(ylim=(len(names) - 0.4, -0.6), xlabel="Critical speed, m/s")
        canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        drawn.title(canvas, name, title, width - 0.5)
    drawn.table(name, table)


def _write_counts(axes: Any, table: pd.DataFrame, possible: Array) -> None:
    """Write next to each row how many of its ``possible`` (cells,) bicycles have a first critical speed, if not all."""
    for row, number in enumerate(possible):
        have = table[(table["row"] == row) & (table["occurrence"] == 1)]["have_it"].min()
        words = "all impossible" if not number else "none" if np.isnan(have) else f"{have} of {number}"
        axes.text(
            1.005,
            row,
            "" if have == number else words,
            transform=axes.get_yaxis_transform(),
            fontsize=7.5,
            va="center",
            color="0.35",
        )


def _tabulate_rows(stored: Stored, ends: Sequence[float], possible: Array) -> pd.DataFrame:
    """A row for each combination, name, direction and occurrence: low, median, high (m/s) and how many have it."""
    rows = list[dict[str, Any]]()
    for mode, change in itertools.product(map(str, stored.data["crossing_mode"].values), CHANGES):
        place = {"crossing_mode": mode, "as_speed_grows": change}
        if stored.reduced:
            at = [(stored.sweep.quantiles or ()).index(share) for share in ends]
            three = stored.rows(f"{CRITICAL}_quantiles", **place)[:, 0][..., at]
            count = stored.rows(f"{CRITICAL}_count", **place)[:, 0]
        else:
            speeds = np.where(stored.possible[..., None], stored.rows(CRITICAL, **place), np.nan)
            three, count = np.stack([quantiles_of(cell, ends).T for cell in speeds]), np.isfinite(speeds).sum(1)
        rows += [
            {
                "combination": stored.cell_names[cell],
                "row": cell,
                "mode": mode,
                "as_speed_grows": change,
                "occurrence": k + 1,
                "possible": possible[cell],
                "have_it": int(count[cell, k]),
                **{f"q{100 * share:g}_m_s": three[cell, k, i] for i, share in enumerate(ends)},
            }
            for cell, k in np.argwhere(count > 0)
        ]
    columns = ["combination", "row", "mode", "as_speed_grows", "occurrence", "possible", "have_it"]
    return pd.DataFrame(rows, columns=None if rows else columns)
