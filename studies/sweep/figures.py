"""Figures of a sweep: critical speeds by mode or one by one, and stability and modes along the speed."""

import itertools
import re
import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.model_space.outputs import CHANGES, OUTPUTS, Output
from studies.reporting.markdown_text import render_file
from studies.reporting.output import write_csv
from studies.reporting.plotting import UNSTABLE, drawing, look, mode_look
from studies.sweep.stored import CRITICAL, Limits, Stored, limit_words
from tyre.ground.arrays import Array

LEAST_FOR_BARS, LEAST_FOR_BANDS = 30, 20  # bicycles; fewer are drawn one by one
MOST_ROWS, MOST_LINES, MOST_MODES = 40, 6, 4  # combinations in a figure; with a line of their own; modes in a figure
BLUE, GROWTH = "#123a6b", OUTPUTS["largest_growth_rate"]
LEVELS: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)
HATCHES = (("first", ""), ("second", "////"), ("third", "...."), ("fourth", "xxxx"))


@dataclass
class Drawn:
    """Figures of a result so far: each that is drawn is added."""

    stored: Stored
    folder: Path  # into which figures and their tables are written
    figures: dict[str, str]  # name of a figure's files, without ending -> its title
    lacking: dict[str, Any]  # what was not drawn, by the keys of ``templates/remarks.txt.j2``

    @property
    def remarks(self) -> list[str]:
        """Lines on what was not drawn and why, and on bicycles that are impossible or extrapolated."""
        return render_file("studies.sweep", "remarks.txt.j2", vars(self), escaped=False).splitlines()

    def title(self, canvas: Any, name: str, text: str, width: float) -> None:
        """Write the title of figure ``name`` in lines of ``width`` inches, with what is true of all figures."""
        self.figures[name] = text
        if self.stored.extrapolated:
            text += f"\nTyre values extrapolated: {self.stored.extrapolated} of {self.stored.number}"
        lines = [wrapped(line, int(width / 0.083)) for line in text.splitlines()]
        canvas.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=9.5)

    def table(self, name: str, rows: Any) -> None:
        """Write the numbers of a figure: a table, a list of rows or tables, or a dict of columns."""
        tables = isinstance(rows, list) and rows and isinstance(rows[0], pd.DataFrame)
        write_csv(pd.concat(rows) if tables else pd.DataFrame(rows), self.folder / f"{name}.csv")


def wrapped(text: str, width: int) -> str:
    """Text in lines of at most ``width`` letters, names of parameters broken at their dots only."""
    spaced = re.sub(r"\.(?=[a-z])", ".\t", text)  # a tab is where a name may be broken
    lines = textwrap.wrap(spaced, width, break_long_words=False, expand_tabs=False, replace_whitespace=False)
    return "\n".join(line.replace("\t", "") for line in lines)


def draw_distributions(drawn: Drawn, name: str) -> None:
    """Draw bars of the critical speeds of each name and direction; the numbers go to ``.csv`` and ``_bins.csv``."""
    stored = drawn.stored
    found, count = stored.limits, int(stored.possible.sum())
    has = sum((np.isfinite(one.speeds).any(-1) for one in found), np.zeros_like(stored.possible))
    title = (
        f"Critical speeds up to {stored.sweep.max_speed:g} m/s of {stored.whose}; "
        f"{(stored.possible & ~has).sum()} of {count} possible ones have none"
    )
    bars, columns = list[dict[str, Any]](), min(3, max(len(found), 1))
    lines = -(-len(found) // columns)
    with drawing(drawn.folder / name, width=4.1 * columns + 0.4, height=2.5 * lines + 0.7) as canvas:
        every = canvas.subplots(lines, columns, squeeze=False)
        for axes, one in zip(every.flat, found, strict=False):
            bars += _bars(axes, one)
            number = np.isfinite(one.speeds).sum(-1)[stored.possible]
            shares = f"{(number == 0).sum()} of {len(number)} have none, {(number > 1).sum()} several"
            axes.set_title(f"{one.words}\n{shares}", fontsize=8.5)
        for axes in list(every.flat)[len(found) :]:
            axes.set_visible(False)
        for axes in every[:, 0]:
            axes.set_ylabel("Bicycles")
        for column in range(columns):
            last = max(k for k in range(lines) if k * columns + column < len(found))
            every[last, column].set_xlabel("Critical speed, m/s")
        drawn.title(canvas, name, title, 4.1 * columns)
    drawn.table(name, [row for one in found for row in _summary(one, count)])
    drawn.table(f"{name}_bins", bars)


def _summary(one: Limits, count: int) -> Iterator[dict[str, Any]]:
    """A row for each occurrence of a critical speed: how many have it, and how it is distributed (m/s)."""
    for k, held in enumerate(one.held, 1):
        quantiles = {f"q{100 * share:g}_m_s": float(np.quantile(held, share)) for share in LEVELS}
        yield {
            "mode": one.mode,
            "as_speed_grows": one.change,
            "occurrence": k,
            "bicycles": count,
            "have_it": held.size,
            "have_none": count - held.size,
            "min_m_s": held.min(),
            **quantiles,
            "max_m_s": held.max(),
            "mean_m_s": held.mean(),
            "sd_m_s": held.std(ddof=1) if held.size > 1 else None,
        }


def _bars(axes: Any, one: Limits) -> Iterator[dict[str, Any]]:
    """Draw the bars; a row for each."""
    every = np.concatenate(one.held)
    low, high = every.min(), every.max()
    edge = max(1e-3, 1e-3 * high)
    edges = np.linspace(low, high, 41) if high - low > edge else np.array([low - edge, high + edge])
    counts = [np.histogram(speeds, edges)[0] for speeds in one.held]
    for k, (here, (label, hatch)) in enumerate(zip(counts, HATCHES, strict=False)):
        axes.bar(
            edges[:-1],
            here,
            np.diff(edges),
            bottom=np.sum(counts[:k], axis=0),
            align="edge",
            alpha=1 - 0.28 * k,
            color=mode_look(one.mode).colour,
            hatch=hatch,
            edgecolor="white",
            linewidth=0.3,
            label=label if len(counts) > 1 else None,
        )
        for i in np.flatnonzero(here):
            yield {
                "mode": one.mode,
                "as_speed_grows": one.change,
                "occurrence": k + 1,
                "from_m_s": edges[i],
                "to_m_s": edges[i + 1],
                "bicycles": int(here[i]),
            }
    if len(counts) > 1:
        axes.legend(title="crossing", title_fontsize=8)
    axes.set_ylim(0, 1.08 * np.sum(counts, axis=0).max())


def draw_each(drawn: Drawn, name: str) -> None:
    """Draw critical speeds of each combination of the grid, a row each; the numbers go to ``.csv``."""
    stored, names = drawn.stored, drawn.stored.cell_names
    several = stored.reduced or stored.samples > 1
    held = list(stored.sweep.quantiles or LEVELS)
    # ends of the line and its mark: of a reduced result the outermost quantiles, and the one nearest to 0.5
    ends = (min(held), min(held, key=lambda share: abs(share - 0.5)), max(held))
    possible = np.asarray(stored.possible.sum(1))
    if stored.reduced:
        possible = np.full(stored.cells, stored.sweep.samples)
        if "impossible_above_zero" in stored.data:
            possible = possible - stored.rows("impossible_above_zero")[:, 0].astype(int)
    table = _each_table(stored, ends, possible)
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
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set(ylim=(len(names) - 0.4, -0.6), xlabel="Critical speed, m/s")
        canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        drawn.title(canvas, name, title, width - 0.5)
    drawn.table(name, table)


def _each_table(stored: Stored, ends: Sequence[float], possible: Array) -> pd.DataFrame:
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
            three, count = np.stack([_quantiles(cell, ends).T for cell in speeds]), np.isfinite(speeds).sum(1)
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


def _quantiles(values: Array, levels: Sequence[float]) -> Array:
    """Quantiles (levels, k) of the finite ones of values (m, k); NaN where there is none."""
    return pd.DataFrame(np.where(np.isfinite(values), values, np.nan)).quantile(list(levels)).to_numpy()


def _bands(stored: Stored, output: Output, values: Array | None, mode: str) -> list[pd.DataFrame]:
    """Quantiles along the speed as tables: all bicycles together, from values (cells, samples, speeds), else by cell.

    ``shown`` is true where half of the bicycles have the output.
    """
    shared = {"quantity": output.name, "mode": mode, "speed_m_s": stored.speeds, "unit": output.unit}
    if values is not None:
        flat = values.reshape(-1, values.shape[-1])
        levels, least = LEVELS, 0.5 * stored.possible.sum()
        tables: Iterable[tuple[str, Array, Array]] = [("", np.isfinite(flat).sum(0), _quantiles(flat, LEVELS).T)]
    else:
        levels, least, place = stored.sweep.quantiles or (), 0.5 * stored.sweep.samples, {"mode": mode} if mode else {}
        held = (stored.rows(f"{output.name}_{what}", **place)[:, 0] for what in ("count", "quantiles"))
        tables = zip(stored.cell_names, *held, strict=True)
    return [
        pd.DataFrame(
            {
                "combination": name,
                **shared,
                "bicycles": count,
                **{f"q{100 * level:g}": each[:, k] for k, level in enumerate(levels)},
                "shown": count >= least,
            }
        )
        for name, count, each in tables
    ]


def draw_stability(drawn: Drawn, name: str) -> None:
    """Draw the share of unstable bicycles and every output of one number along the speed; numbers in ``.csv``."""
    stored, rows = drawn.stored, list[pd.DataFrame]()
    along = [output for output in OUTPUTS.values() if output.along == "stability"]
    panels = {output: None if stored.reduced else stored.scalar(output) for output in along}
    panels = {o: v for o, v in panels.items() if v is not None or f"{o.name}_quantiles" in stored.data}
    tells = GROWTH in panels
    with drawing(drawn.folder / name, width=8.0, height=2.6 * (len(panels) + tells) + 0.6) as canvas:
        every = canvas.subplots(len(panels) + tells, 1, sharex=True, squeeze=False)[:, 0]
        if tells:
            rows.append(_unstable(every[0], stored, panels[GROWTH]))
        for axes, (output, values) in zip(every[int(tells) :], panels.items(), strict=True):
            rows += _panel(axes, stored, output, values, legend=axes is every[int(tells)])
            axes.set_ylabel(output.title)
        every[-1].set(xlabel="Speed, m/s", xlim=(stored.speeds.min(), stored.speeds.max()))
        drawn.title(canvas, name, f"Stability of {stored.whose}; shaded: unstable{_notes(stored)}", 7.7)
    drawn.table(name, rows)


def draw_modes_along_speed(drawn: Drawn, name: str) -> None:
    """Draw frequency, damping ratio and further outputs of the named modes, a column each; numbers in ``.csv``."""
    stored, rows = drawn.stored, list[pd.DataFrame]()
    shown = [one for one in OUTPUTS.values() if one.along == "modes"]
    whole = "modes" in stored.data and not stored.reduced
    outputs = [one for one in shown if whole or one.name in stored.sweep.outputs]
    every = stored.named
    if stored.reduced:
        count = f"{outputs[-1].name}_count"
        every = {mode: {} for mode in stored.modes("mode") if stored.rows(count, mode=mode).any()}
    columns = [mode for mode in every if _oscillates(stored, mode, every[mode], outputs[0].name)][:MOST_MODES]
    width = max(2.9 * len(columns) + 0.5, 6.0)
    with drawing(drawn.folder / name, width=width, height=2.5 * len(outputs) + 1.0) as canvas:
        grid = canvas.subplots(len(outputs), max(len(columns), 1), sharex=True, squeeze=False)
        for column, mode in enumerate(columns):
            for line, output in enumerate(outputs):
                values = every[mode].get(output.name)
                rows += _panel(grid[line, column], stored, output, values, mode, legend=line + column == 0)
                grid[line, 0].set_ylabel(output.title[0].upper() + output.title[1:])
            grid[0, column].set_title(mode.replace("_", " "))
            grid[-1, column].set_xlabel("Speed, m/s")
        grid[0, 0].set_xlim(stored.speeds.min(), stored.speeds.max())
        left = ", ".join(mode for mode in every if mode not in columns).replace("_", " ")
        title = (
            f"Oscillating modes of {stored.whose}{_notes(stored)};\na band is drawn where at least half of the "
            f"bicycles have the mode{left and '; not drawn: '}{left}"
        )
        drawn.title(canvas, name, title, width - 0.3)
    drawn.table(name, rows)


def _notes(stored: Stored) -> str:
    """Words on what lines and bands are, so that nobody reads a critical speed between few speeds."""
    few = stored.cells <= MOST_LINES
    lines = "\nlines and bands: the quantiles that [reduce] kept" if few else "\ntoo many combinations for lines"
    marks = "; computed at the marks, straight lines between them" if _dots(stored.speeds) else ""
    return marks + lines * stored.reduced


def _oscillates(stored: Stored, mode: str, values: Mapping[str, Array], name: str) -> bool:
    """True if most bicycles have an oscillation of that name at some speed."""
    if stored.reduced:
        return bool((stored.rows(f"{name}_max", mode=mode) > 0).any())
    with np.errstate(invalid="ignore"):
        return bool(((np.abs(values[name]) > 0).mean((0, 1)) >= 0.5).any())


def _unstable(axes: Any, stored: Stored, growth: Array | None) -> pd.DataFrame:
    speeds = stored.speeds
    if growth is None:
        count, above = (stored.rows(f"{GROWTH.name}_{what}")[:, 0] for what in ("count", "above_zero"))
    else:
        count, above = np.isfinite(growth).sum(1), (growth > 0).sum(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axes.plot(speeds, 100 * above.sum(0) / count.sum(0), color=BLUE, linewidth=2.2, label="all", **_dots(speeds))
        if 1 < stored.cells <= MOST_LINES and count.max() > 1:
            for cell, name in enumerate(stored.cell_names):
                axes.plot(
                    speeds,
                    100 * above[cell] / count[cell],
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
            "share": above.sum(0) / np.maximum(count.sum(0), 1),
        }
    )


def _panel(
    axes: Any, stored: Stored, output: Output, values: Array | None, mode: str = "", *, legend: bool
) -> list[pd.DataFrame]:
    """Draw bands, or lines of few bicycles, with the unstable side shaded; the numbers."""
    speeds, bands = stored.speeds, _bands(stored, output, values, mode)
    colour = mode_look(mode).colour if mode else BLUE
    rows = None if values is None else values.reshape(-1, len(speeds))
    if rows is not None and len(rows) < LEAST_FOR_BANDS:
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
    held = band.filter(regex=r"^q\d")
    values = dict(sorted((float(str(key)[1:]) / 100, held[key].where(band["shown"])) for key in held))
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
