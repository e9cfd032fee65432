"""Figures of a sweep: critical speeds by mode or one by one, and stability and modes along the speed."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.outputs import CHANGES, OUTPUTS, Output
from studies.reporting.output import write_csv
from studies.reporting.plotting import UNSTABLE, drawing, look, mode_look
from studies.sweep.stored import CRITICAL, Limits, ModeRows, Stored, limit_words, limits, mode_rows
from tyre.arrays import Array

if TYPE_CHECKING:
    import pandas as pd

LEAST_FOR_BARS, LEAST_FOR_BANDS = 30, 20  # bicycles; fewer are drawn one by one
MOST_ROWS, MOST_LINES, MOST_MODES = 40, 6, 4  # combinations in a figure; with a line of their own; modes in a figure
BLUE = "#123a6b"
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)
HATCHES = (("first", ""), ("second", "////"), ("third", "...."), ("fourth", "xxxx"))


@dataclass(frozen=True)
class Drawn:
    """Figures by name with their titles, and remarks on what was not drawn and why."""

    stored: Stored
    folder: Path
    figures: dict[str, str]
    remarks: list[str]

    def title(self, canvas: Any, name: str, text: str, width: float) -> None:
        """Write the title of figure ``name`` in lines of ``width`` inches."""
        canvas.suptitle(self.stored.title(text, width), x=0.01, ha="left", fontsize=9.5)
        self.figures[name] = text

    def table(self, name: str, rows: Any) -> None:
        """Write the numbers of a figure, a list of rows, a dict of columns or a list of tables."""
        import pandas as pd

        tables = isinstance(rows, list) and rows and isinstance(rows[0], pd.DataFrame)
        write_csv(pd.concat(rows) if tables else pd.DataFrame(rows), self.folder / f"{name}.csv")


def draw_distributions(drawn: Drawn, name: str) -> None:
    """Draw bars of the critical speeds of each name and direction; the numbers go to ``.csv`` and ``_bins.csv``."""
    stored = drawn.stored
    found = list(limits(stored))
    has = sum((np.isfinite(one.speeds).any(-1) for one in found), np.zeros_like(stored.possible))
    title = (
        f"Critical speeds up to {stored.sweep.max_speed:g} m/s of {stored.whose}; "
        f"{(stored.possible & ~has).sum()} of {stored.possible.sum()} possible ones have none"
    )
    bars, columns = [], min(3, max(len(found), 1))
    lines = -(-len(found) // columns)
    with drawing(drawn.folder / name, width=4.1 * columns + 0.4, height=2.5 * lines + 0.7) as canvas:
        every = canvas.subplots(lines, columns, squeeze=False)
        for axes, one in zip(every.flat, found, strict=False):
            bars += _bars(axes, one)
            number = np.isfinite(one.speeds).sum(-1)[one.possible]
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
    drawn.table(name, [row for one in found for row in _summary(one)])
    drawn.table(f"{name}_bins", bars)


def _summary(one: Limits) -> Iterator[dict[str, Any]]:
    """A row for each occurrence of a critical speed: how many have it, and how it is distributed (m/s)."""
    count = int(one.possible.sum())
    for k, held in enumerate(one.held):
        quantiles = {f"q{100 * share:g}_m_s": float(np.quantile(held, share)) for share in LEVELS}
        yield {
            "mode": one.mode, "as_speed_grows": one.change, "occurrence": k + 1, "bicycles": count,
            "have_it": held.size, "have_none": count - held.size, "min_m_s": held.min(), **quantiles,
            "max_m_s": held.max(), "mean_m_s": held.mean(), "sd_m_s": held.std(ddof=1) if held.size > 1 else None,
        }  # fmt: skip


def _bars(axes: Any, one: Limits) -> list[dict[str, Any]]:
    held = one.held
    low, high = min(s.min() for s in held), max(s.max() for s in held)
    edge = max(1e-3, 1e-3 * high)
    edges = np.linspace(low, high, 41) if high - low > edge else np.array([low - edge, high + edge])
    colour, below, found = mode_look(one.mode).colour, np.zeros(len(edges) - 1), []
    for k, speeds in enumerate(held):
        counts, _ = np.histogram(speeds, edges)
        axes.bar(
            edges[:-1], counts, np.diff(edges), bottom=below, align="edge", color=colour, alpha=1 - 0.28 * k,
            hatch=HATCHES[k][1], edgecolor="white", linewidth=0.3, label=HATCHES[k][0] if len(held) > 1 else None,
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


def draw_each(drawn: Drawn, name: str) -> None:
    """Draw critical speeds of each combination of the grid, a row each; the numbers go to ``.csv``."""
    stored = drawn.stored
    table, names = _each_table(stored), stored.cell_names
    several = stored.reduced or stored.samples > 1
    low, _, high = _range(stored)
    title = f"Critical speeds up to {stored.sweep.max_speed:g} m/s of {stored.whose}"
    if several:
        title += f"; mark: median, line: {100 * (high - low):g} % of those that have it"
    width = 8.6 + 0.06 * max(map(len, names))
    with drawing(drawn.folder / name, width=width, height=1.5 + 0.34 * len(names) + (0.25 if several else 0)) as canvas:
        axes = canvas.subplots()
        shown = list(dict.fromkeys(zip(table["mode"], table["as_speed_grows"], strict=True)))
        offsets = np.linspace(-0.25, 0.25, len(shown)) if several and len(shown) > 1 else np.zeros(len(shown))
        for (mode, change), offset in zip(shown, offsets, strict=True):
            rows = table[(table["mode"] == mode) & (table["as_speed_grows"] == change) & (table["have_it"] > 0)]
            _marks(axes, rows, mode, change, float(offset), int(np.sum(_possible_in(stored))), several=several)
        for row, words in _without(stored, table).items():
            axes.text(1.005, row, words, transform=axes.get_yaxis_transform(), fontsize=7.5, va="center", color="0.35")
        axes.set_yticks(range(len(names)), names, fontsize=8)
        axes.set(ylim=(len(names) - 0.4, -0.6), xlabel="Critical speed, m/s")
        if shown:
            canvas.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        drawn.title(canvas, name, title, width - 0.5)
    drawn.table(name, table)


def _range(stored: Stored) -> tuple[float, float, float]:
    """Shares of the line's ends and the mark; of a reduced result those it holds, the outermost and nearest to 0.5."""
    if not stored.reduced:
        return 0.05, 0.5, 0.95
    held = stored.sweep.quantiles or ()
    return min(held), min(held, key=lambda share: abs(share - 0.5)), max(held)


def _each_table(stored: Stored) -> "pd.DataFrame":
    """A row for each combination, name, direction and occurrence: low, median, high (m/s) and how many have it."""
    import pandas as pd

    shares, rows, names, possible = _range(stored), [], stored.cell_names, _possible_in(stored)
    for mode in [str(name) for name in stored.data["crossing_mode"].values]:
        for change in CHANGES:
            place = {"crossing_mode": mode, "as_speed_grows": change}
            if stored.reduced:
                values = stored.reduced_rows(f"{CRITICAL}_quantiles", **place)
                held = list(stored.sweep.quantiles or ())
                three = np.stack([values[..., held.index(share)] for share in shares], -1)
                count = stored.reduced_rows(f"{CRITICAL}_count", **place)
            else:
                speeds = np.where(stored.possible[..., None], stored.rows(CRITICAL, **place), np.nan)
                three = np.stack([_quantiles(cell, shares).T for cell in speeds])
                count = np.isfinite(speeds).sum(1)
            for cell, k in np.argwhere(count > 0):
                rows.append(
                    {"combination": names[cell], "row": cell, "mode": mode, "as_speed_grows": change,
                     "occurrence": k + 1, "possible": possible[cell], "have_it": int(count[cell, k]),
                     **{f"q{100 * share:g}_m_s": three[cell, k, i] for i, share in enumerate(shares)}}
                )  # fmt: skip
    columns = ["combination", "row", "mode", "as_speed_grows", "occurrence", "possible", "have_it"]
    return pd.DataFrame(rows, columns=None if rows else columns)


def _possible_in(stored: Stored) -> Array:
    """Number of possible bicycles of each combination."""
    if not stored.reduced:
        return np.asarray(stored.possible.sum(1))
    if "impossible_above_zero" not in stored.data:
        return np.full(stored.cells, stored.sweep.samples)
    return stored.sweep.samples - stored.reduced_rows("impossible_above_zero").astype(int)


def _quantiles(values: Array, levels: Sequence[float]) -> Array:
    """Quantiles (levels, k) of the finite ones of values (m, k); NaN where there is none."""
    held = [column[np.isfinite(column)] for column in values.T]
    return np.array([np.quantile(one, levels) if one.size else np.full(len(levels), np.nan) for one in held]).T


def _marks(axes: Any, rows: Any, mode: str, change: str, offset: float, count: int, *, several: bool) -> None:
    style, unstable = mode_look(mode), change == CHANGES[0]
    have = rows[rows["occurrence"] == 1]["have_it"].sum()
    label = f"{limit_words(mode, change)} ({have} of {count})"
    held = [rows[name].to_numpy() for name in map(str, rows) if name.startswith("q")]
    height = rows["row"].to_numpy() + offset
    if several:
        axes.hlines(height, held[0], held[-1], color=style.colour, linewidth=1.3)
    axes.plot(
        held[len(held) // 2], height, style.marker, color=style.colour, linestyle="none", markersize=6.5, label=label,
        markerfacecolor=style.colour if unstable else "white",
    )  # fmt: skip


def _without(stored: Stored, table: Any) -> dict[int, str]:
    """Rows of combinations that have no critical speed, or have some of them in a part of the samples only."""
    found = {}
    for cell, possible in enumerate(_possible_in(stored)):
        have = table[(table["row"] == cell) & (table["occurrence"] == 1)]["have_it"] if len(table) else []
        if not possible or not len(have):
            found[cell] = "none" if possible else "all impossible"
        elif min(have) < possible:
            found[cell] = f"{min(have)} of {possible}"
    return found


@dataclass(frozen=True, eq=False)
class Band:
    """Quantiles (speeds,) of an output by level, of the ``count`` (speeds,) bicycles that have it."""

    combination: str
    count: Array
    quantiles: Mapping[float, Array]
    shown: Any
    rows: Array | None


def _bands(stored: Stored, output: Output, values: Array | None, mode: str) -> list[Band]:
    """All bicycles together, from values (cells, samples, speeds); of a reduced result each combination."""
    if values is not None:
        flat = values.reshape(-1, values.shape[-1])
        count = np.isfinite(flat).sum(0)
        quantiles = dict(zip(LEVELS, _quantiles(flat, LEVELS), strict=True))
        return [Band("", count, quantiles, count >= 0.5 * stored.possible.sum(), flat)]
    place = {"mode": mode} if mode else {}
    held = stored.reduced_rows(f"{output.name}_quantiles", **place)
    counts = stored.reduced_rows(f"{output.name}_count", **place)
    return [
        Band(
            name, counts[cell], {q: held[cell, :, k] for k, q in enumerate(stored.sweep.quantiles or ())},
            counts[cell] >= 0.5 * stored.sweep.samples, None,
        )
        for cell, name in enumerate(stored.cell_names)
    ]  # fmt: skip


def draw_stability(drawn: Drawn, name: str) -> None:
    """Draw the share of unstable bicycles and every output of one number along the speed; numbers in ``.csv``."""
    stored, panels, rows = drawn.stored, [], list["pd.DataFrame"]()
    for output in OUTPUTS.values():
        if output.along == "stability":
            values = None if stored.reduced else stored.scalar(output)
            if values is not None or f"{output.name}_quantiles" in stored.data:
                panels.append((output, values))
    growth = [values for output, values in panels if output.name == "largest_growth_rate"]
    tells = bool(growth)
    with drawing(drawn.folder / name, width=8.0, height=2.6 * (len(panels) + tells) + 0.6) as canvas:
        every = canvas.subplots(len(panels) + tells, 1, sharex=True, squeeze=False)[:, 0]
        if tells:
            rows.append(_unstable(every[0], stored, growth[0]))
        for axes, (output, values) in zip(every[int(tells) :], panels, strict=True):
            rows += _panel(axes, stored, output, values, legend=axes is every[int(tells)])
            axes.set_ylabel(output.title)
        every[-1].set(xlabel="Speed, m/s", xlim=(stored.speeds.min(), stored.speeds.max()))
        drawn.title(canvas, name, f"Stability of {stored.whose}; shaded: unstable{_notes(stored)}", 7.7)
    drawn.table(name, rows)


def draw_modes_along_speed(drawn: Drawn, name: str) -> None:
    """Draw frequency, damping ratio and further outputs of the named modes, a column each; numbers in ``.csv``."""
    stored, rows = drawn.stored, list["pd.DataFrame"]()
    shown = [one for one in OUTPUTS.values() if one.along == "modes"]
    held = {*stored.sweep.outputs} if stored.reduced or "modes" not in stored.data else {one.name for one in shown}
    outputs = [one for one in shown if one.name in held]
    every = list(mode_rows(stored))
    if stored.reduced:
        count = f"{outputs[-1].name}_count"
        every = [ModeRows(m, {}) for m in stored.modes("mode") if stored.reduced_rows(count, mode=m).any()]
    columns = [one for one in every if _oscillates(stored, one, outputs)][:MOST_MODES]
    width = max(2.9 * len(columns) + 0.5, 6.0)
    with drawing(drawn.folder / name, width=width, height=2.5 * len(outputs) + 1.0) as canvas:
        grid = canvas.subplots(len(outputs), max(len(columns), 1), sharex=True, squeeze=False)
        for column, one in enumerate(columns):
            for line, output in enumerate(outputs):
                values = one.values.get(output.name)
                rows += _panel(grid[line, column], stored, output, values, one.mode, legend=line + column == 0)
                if column == 0:
                    grid[line, 0].set_ylabel(output.title[0].upper() + output.title[1:])
            grid[0, column].set_title(one.mode.replace("_", " "))
            grid[-1, column].set_xlabel("Speed, m/s")
        grid[0, 0].set_xlim(stored.speeds.min(), stored.speeds.max())
        left = ", ".join(one.mode for one in every if one not in columns).replace("_", " ")
        title = (
            f"Oscillating modes of {stored.whose}{_notes(stored)};\na band is drawn where at least half of the "
            f"bicycles have the mode{left and '; not drawn: '}{left}"
        )
        drawn.title(canvas, name, title, width - 0.3)
    drawn.table(name, rows)


def _notes(stored: Stored) -> str:
    """Words on what lines and bands are, so that nobody reads a critical speed between few speeds."""
    kept = "lines and bands: the quantiles that [reduce] kept"
    lines = kept if stored.cells <= MOST_LINES else "too many combinations for lines"
    marks = "; computed at the marks, straight lines between them" if _dots(stored.speeds) else ""
    return marks + (f"\n{lines}" if stored.reduced else "")


def _oscillates(stored: Stored, one: ModeRows, outputs: Sequence[Output]) -> bool:
    """True if most bicycles have an oscillation of that name at some speed."""
    if stored.reduced:
        return bool((stored.reduced_rows(f"{outputs[0].name}_max", mode=one.mode) > 0).any())
    with np.errstate(invalid="ignore"):
        return bool(((np.abs(one.values[outputs[0].name]) > 0).mean((0, 1)) >= 0.5).any())


def _unstable(axes: Any, stored: Stored, growth: Array | None) -> "pd.DataFrame":
    import pandas as pd

    speeds = stored.speeds
    if growth is None:
        count = stored.reduced_rows("largest_growth_rate_count")
        above = stored.reduced_rows("largest_growth_rate_above_zero")
    else:
        count, above = np.isfinite(growth).sum(1), (growth > 0).sum(1)
    with np.errstate(invalid="ignore", divide="ignore"):
        axes.plot(speeds, 100 * above.sum(0) / count.sum(0), color=BLUE, linewidth=2.2, label="all", **_dots(speeds))
        if 1 < stored.cells <= MOST_LINES and count.max() > 1:
            for cell, name in enumerate(stored.cell_names):
                axes.plot(
                    speeds, 100 * above[cell] / count[cell], linewidth=1.0, color=look(cell).colour,
                    marker=look(cell).marker, markersize=4, markevery=max(len(speeds) // 12, 1), label=name,
                )  # fmt: skip
            axes.legend(fontsize=7.5, loc="best")
    axes.set(ylabel="Unstable, %", ylim=(-4, 104))
    return pd.DataFrame(
        {"quantity": "unstable", "mode": "", "speed_m_s": speeds, "unit": "share of those that have a value",
         "bicycles": count.sum(0), "share": above.sum(0) / np.maximum(count.sum(0), 1)}
    )  # fmt: skip


def _panel(
    axes: Any, stored: Stored, output: Output, values: Array | None, mode: str = "", *, legend: bool
) -> "list[pd.DataFrame]":
    """Draw bands, or lines of few bicycles, with the unstable side shaded; the numbers."""
    import pandas as pd

    speeds, found = stored.speeds, []
    bands = _bands(stored, output, values, mode)
    for number, band in enumerate(bands):
        colour = mode_look(mode).colour if mode else BLUE
        if band.rows is not None and len(band.rows) < LEAST_FOR_BANDS:
            for row in band.rows:
                axes.plot(speeds, row, color=colour, linewidth=0.9, alpha=0.8, **_dots(speeds))
        elif len(bands) <= MOST_LINES:
            colour = colour if len(bands) == 1 else look(number).colour
            _draw_band(axes, speeds, band, colour, legend=legend)
        if band.rows is not None and len(band.rows) >= LEAST_FOR_BANDS and band.count.any():
            low, high = np.nanmin(band.quantiles[LEVELS[0]]), np.nanmax(band.quantiles[LEVELS[-1]])
            room = 0.06 * (high - low) or 0.05 * (abs(high) or 1)  # the rest may lie far away
            axes.set_ylim(low - room, high + room)
        columns = {f"q{100 * level:g}": quantile for level, quantile in band.quantiles.items()}
        table = pd.DataFrame({"quantity": output.name, "mode": mode, "speed_m_s": speeds, "unit": output.unit,
                              "bicycles": band.count, **columns})  # fmt: skip
        if stored.reduced:
            table.insert(0, "combination", band.combination)
        found.append(table)
    if output.unstable:
        axes.axhline(0, color="0.2", linewidth=0.8)
        low, high = axes.get_ylim()
        axes.axhspan(*((0, max(high, 1e-9)) if output.unstable > 0 else (min(low, 0), 0)), color=UNSTABLE, zorder=0)
        axes.set_ylim(low, None if mode else high)
    return found


def _draw_band(axes: Any, speeds: Array, band: Band, colour: str, *, legend: bool) -> None:
    levels, name = sorted(band.quantiles), band.combination
    values = {level: np.where(band.shown, one, np.nan) for level, one in band.quantiles.items()}
    # ends of central bands, the widest first
    pairs = [(low, 1 - low) for low in levels if low < 0.5 and any(abs(low + other - 1) < 1e-9 for other in levels)]
    for k, (low, high) in enumerate(pairs):
        upper = min(levels, key=lambda level: abs(level - high))
        axes.fill_between(
            speeds, values[low], values[upper], color=colour, alpha=0.16 + 0.14 * k, linewidth=0,
            label=None if name else f"{100 * (high - low):.3g} % of the bicycles",
        )  # fmt: skip
    middle = [level for level in levels if level == 0.5]
    for level in middle or ([] if pairs else levels):
        label = name or ("median" if middle else f"quantile {level:g}")
        axes.plot(speeds, values[level], color=colour, label=label, **_dots(speeds))
    if legend:
        axes.legend(fontsize=7.5, loc="best")


def _dots(speeds: Array) -> dict[str, Any]:
    """Marks at the speeds themselves if they are few: between them nothing is computed."""
    return {"marker": "o", "markersize": 3.5} if len(speeds) <= 15 else {}
