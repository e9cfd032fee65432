"""Figures of the main study: unstable wobble and what moves it, damping, critical speeds."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from bicycle.critical import CrossingIdentity
from studies.main_study.compare import Change, Plausible
from studies.main_study.result import COMPARED, WEAVE, WOBBLE, Result
from studies.main_study.settings import Settings, Setup
from studies.main_study.study import Study
from studies.reporting import plotting
from studies.reporting.plotting import (
    EXTRAPOLATED,
    UNSTABLE,
    hatch_extrapolated,
    look,
    mode_look,
    mode_marker,
    mode_words,
)

EDGES = (
    ("begins", CrossingIdentity(WOBBLE, destabilising=True)), ("ends", CrossingIdentity(WOBBLE, destabilising=False)),
)  # fmt: skip
SMALL = {"fontsize": 8.5, "va": "center"}


def drawings(settings: Settings, folder: Path) -> list[Callable[[Study], Path]]:
    """List every figure of the study for ``folder``, each to be called with the study."""
    return [
        partial(draw_headline, setup=settings.reference, target=folder / "headline"),
        partial(draw_headline, setup=settings.setups[1], target=folder / "wobble_hands_on"),
        partial(draw_damping, target=folder / "damping_ratio"),
        partial(draw_critical_speeds, target=folder / "critical_speeds"),
    ]


def _title(canvas: Any, study: Study, text: str, results: Sequence[Result]) -> None:
    note = "; hatched: tyre values extrapolated" if any(r.case.extrapolated for r in results) else ""
    canvas.suptitle(f"{study.settings.bicycle.name}{text}{note}", x=0.01, ha="left", fontsize=10)


def _hatch_row(axes: Any, height: float, *, extrapolated: bool) -> None:
    if extrapolated:
        axes.axhspan(height - 0.5, height + 0.5, facecolor="none", linewidth=0, zorder=0, **EXTRAPOLATED)


def draw_headline(study: Study, setup: Setup, target: Path) -> Path:
    """Draw bands of unstable wobble in one world, and beside them how lower pressure moves their edges, and why."""
    found = [study.decomposition(setup, name) for name in study.names]
    explained = any(d.change(key) for d in found if d for _, key in EDGES)
    rows = len(study.of(setup)) + 0.9 * len(study.names)
    width, ratios = (11.5, (1.7, 1)) if explained else (8.5, (1,))
    with plotting.drawing(target, width=width, height=1.9 + 0.27 * rows) as canvas:
        grid = canvas.subplots(1, len(ratios), squeeze=False, gridspec_kw={"width_ratios": ratios})[0]
        unstable = any(result.span(study.settings.fastest) for result in study.of(setup))
        _draw_bands(grid[0], study, setup, unstable=unstable)
        if explained:
            _draw_parts(grid[1], study, setup)
        what = "Where wobble is unstable" if unstable else "No unstable wobble on any tyre studied"
        canvas.suptitle(f"{what}: {study.settings.bicycle.name}", x=0.01, ha="left", fontsize=12, fontweight="bold")
    return target


def _draw_bands(axes: Any, study: Study, setup: Setup, *, unstable: bool) -> None:
    """Draw bars from onset to end of unstable wobble; pale ends: one sd; thin lines: plausible fronts."""
    height, ticks, fastest = 0.0, {}, study.settings.fastest
    limit = 1.27 * fastest  # room for what is written at the end of a bar
    for number, name in enumerate(study.names):
        colour = look(number).colour
        axes.text(0.004 * limit, height - 0.66, name, fontweight="bold", va="center",
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
        for result in study.of(setup, name):
            _hatch_row(axes, height, extrapolated=result.case.extrapolated)
            _draw_bar(axes, result, height - 0.12, colour, fastest)
            if unstable and not result.bands(fastest):
                axes.text(0.35 * fastest, height - 0.12, "no unstable wobble", color="0.35", style="italic", **SMALL)
            outer = study.outer(result)
            if outer:
                _draw_outer(axes, outer, height + 0.24, colour, fastest)
            for c in result.crossings:
                if c.mode == WEAVE and c.speed < fastest and c.oscillatory:
                    face = "black" if c.destabilising else "white"
                    axes.plot(c.speed, height + 0.36, "o", color="black", markerfacecolor=face, ms=3.8, zorder=4)
            ticks[height] = result.case.condition
            height += 1
        height += 0.9
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set(xlim=(0, limit), ylim=(height - 1.3, -1.0), xlabel="Speed, m/s")
    axes.secondary_xaxis("top", functions=(lambda v: 3.6 * v, lambda v: v / 3.6)).set_xlabel("km/h", fontsize=8)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    heading = "Unstable wobble" if unstable else f"No unstable wobble in any case up to {fastest:g} m/s"
    assumed = " (assumed)" if setup.front and not setup.front.given else ""
    axes.set_title(f"{heading}: {setup.label}{assumed}", fontsize=9)
    lines = "\n".join(fill(line, 100) for line in _marks(study, setup, unstable=unstable))
    axes.text(0.0, -0.55 / (0.27 * (height + 2)), lines, transform=axes.transAxes, va="top", fontsize=7.5, color="0.3")


def _marks(study: Study, setup: Setup, *, unstable: bool) -> list[str]:
    """Explain the marks that are there, and no others."""
    fastest, results = study.settings.fastest, study.of(setup)
    weave = [c for r in results for c in r.crossings if c.mode == WEAVE and c.speed < fastest and c.oscillatory]
    circles = ["stable (hollow)"] if any(not c.destabilising for c in weave) else []
    circles += ["unstable (filled)"] if any(c.destabilising for c in weave) else []
    outer = [one for r in results if (one := study.outer(r))]
    first = ["pale ends: ± one standard deviation of tyre and bicycle"] if unstable else []
    first += [f"circles: weave becomes {', '.join(circles)}"] if circles else []
    first += ["hatched: tyre values extrapolated"] if any(r.case.extrapolated for r in results) else []
    lines = ["; ".join(first)]
    if any(one.without < one.count for one in outer):
        lines.append(
            f"thin lines: where nine of ten of those of {outer[0].count} random bicycles with plausible fronts that "
            "wobble have onset and end"
        )
    if any(one.without for one in outer):
        lines.append(f"at the right: how many of these {outer[0].count} do not wobble up to {fastest:g} m/s")
    return [line for line in lines if line]


def _draw_bar(axes: Any, result: Result, height: float, colour: str, fastest: float) -> None:
    for band in result.bands(fastest):
        low = band.start.speed if band.start else 0.0
        high = band.end.speed if band.end and band.end.speed <= fastest else fastest
        axes.barh(height, high - low, left=low, height=0.5, color=colour, alpha=0.85, linewidth=0)
        if high == fastest:
            axes.text(high, height, " ▸", va="center", fontsize=9, color=colour)
        for edge, align, side in ((band.start, "right", -1), (band.end, "left", 1)):
            if edge and edge.speed <= fastest:
                for shade, alpha in (("white", 0.55), (colour, 0.25)):
                    axes.barh(height, 2 * edge.sd, left=edge.speed - edge.sd, height=0.5, linewidth=0, color=shade,
                              alpha=alpha)  # fmt: skip
                place = np.clip(edge.speed + side * edge.sd, 0.045 * fastest, 1.04 * fastest)
                axes.annotate(f"{edge.speed:.1f}", (place, height), (3 * side, 0), textcoords="offset points", ha=align,
                              **SMALL)  # fmt: skip


def _draw_outer(axes: Any, outer: Plausible, height: float, colour: str, fastest: float) -> None:
    """Draw where onset and end are for plausible fronts, and how many of them do not wobble."""
    for edge in ("onset", "end"):
        for low, high in filter(None, [outer.likely(edge)]):
            axes.plot([low, min(high, fastest)], [height, height], color=colour, linewidth=1.2, zorder=3)
            for end in (low, high):
                if not math.isclose(end, fastest):
                    axes.plot([end, end], [height - 0.09, height + 0.09], color=colour, linewidth=1.2, zorder=3)
    if outer.without:
        axes.text(1.27 * fastest, height - 0.24, f"{outer.without} without", fontsize=7.5, color="0.35", ha="right",
                  va="center")  # fmt: skip


def _draw_parts(axes: Any, study: Study, setup: Setup) -> None:
    """Draw stacked bars: change of each edge of the band at the lower pressure, by what causes it."""
    from matplotlib.patches import Patch

    height, ticks, reached = 0.0, {}, [-0.5, 0.5]
    pressures = set()
    for number, name in enumerate(study.names):
        found = study.decomposition(setup, name)
        axes.text(0.02, height - 0.72, name, fontweight="bold", va="center", transform=axes.get_yaxis_transform())
        for what, key in EDGES:
            change = found.change(key) if found else None
            ticks[height] = what
            if found and change:
                _hatch_row(axes, height, extrapolated=found.higher.extrapolated or found.lower.extrapolated)
                reached += _stack(axes, change, height, look(number).colour)
                pressures.add(f"{found.higher.condition} to {found.lower.condition}")
            else:
                axes.text(0.5, height, "not at both pressures", ha="center", color="0.35", style="italic",
                          transform=axes.get_yaxis_transform(), **SMALL)  # fmt: skip
            height += 1
        height += 1.4
    axes.axvline(0, color="0.2", linewidth=1)
    axes.set_yticks(list(ticks), list(ticks.values()))
    low, high = min(reached), max(reached)
    room = 0.16 * (high - low)
    axes.set(xlim=(low - room, high + room), ylim=(height - 1.8, -1.2), xlabel="Change of speed, m/s")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title("Why: change from " + " and ".join(sorted(pressures)), fontsize=9)
    names = ("relaxation length", "cornering stiffness", "interaction")
    handles = [Patch(label=part, **style) for part, style in zip(names, _part_styles("0.35"), strict=True)]
    below = -0.5 / (axes.figure.get_figheight() - 1.4)  # inches below the axes
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.45, below), ncols=3, fontsize=8, columnspacing=1)


def _stack(axes: Any, change: Change, height: float, colour: str) -> list[float]:
    """Draw one stacked bar and the total; return how far it reaches to both sides, m/s."""
    ends = {True: 0.0, False: 0.0}
    values = (change.length_part, change.stiffness_part, change.interaction)
    for value, style in zip(values, _part_styles(colour), strict=True):
        axes.barh(height, value, left=ends[value > 0], height=0.62, **style)
        ends[value > 0] += value
    side = change.total > 0
    axes.annotate(f"{change.total:+.1f}", (ends[side], height), (4 if side else -4, 0), textcoords="offset points",
                  ha="left" if side else "right", **SMALL)  # fmt: skip
    return list(ends.values())


def _part_styles(colour: str) -> list[dict[str, Any]]:
    """Full colour, dotted white, and grey: apart in print too, and from the hatching of extrapolated values."""
    return [
        {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8},
        {"facecolor": "white", "edgecolor": colour, "linewidth": 1.0, "hatch": "...."},
        {"facecolor": "0.75", "edgecolor": "0.5", "linewidth": 0.8},
    ]


def draw_damping(study: Study, target: Path) -> Path:
    """Draw damping ratios against pressure: a row per mode, a column per setup; bands: one standard deviation."""
    setups = study.settings.setups
    with plotting.drawing(target, width=12.5, height=6.4) as canvas:
        grid = canvas.subplots(len(COMPARED), len(setups), sharex=True, sharey="row", squeeze=False)
        for row, mode in zip(grid, COMPARED, strict=True):
            for axes, setup in zip(row, setups, strict=True):
                for number, name in enumerate(study.names):
                    mine = [r for r in study.of(setup, name) if mode in r.damping and r.case.pressures_bar]
                    if mine:
                        _draw_ratios(axes, mine, mode, number, name)
                hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in study.of(setup)))
                if mode == COMPARED[0]:
                    axes.set_title(setup.label.replace(", ", ",\n"), fontsize=8.5)
            low, high = row[0].get_ylim()
            for axes in row:
                if low < 0:
                    axes.axhspan(low, min(0.0, high), color=UNSTABLE, zorder=0)
                axes.set_ylim(low, high)
            row[0].set_ylabel(f"{mode.capitalize()}: damping ratio")
        for axes in grid[-1]:
            axes.set_xlabel("Inflation pressure, bar")
            axes.set_xticks(sorted({case.pressure_bar for case in study.cases if case.pressures_bar}))
        handles, labels = max((axes.get_legend_handles_labels() for axes in grid.flat), key=lambda pair: len(pair[1]))
        canvas.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        text = (
            f" at {study.settings.report_speed:g} m/s; bands: one standard deviation of tyre and bicycle (darker: of "
            "the tyre data alone); shaded: unstable"
        )
        _title(canvas, study, text, study.results)
    return target


def _draw_ratios(axes: Any, found: list[Result], mode: str, number: int, name: str) -> None:
    pressures = [r.case.pressure_bar for r in found]
    ratios = [r.damping[mode] for r in found]
    values, style = np.array([r.value for r in ratios]), look(number)
    sds = [[r.sd for r in ratios], [r.tyre_sd for r in ratios]]
    for sd in sds if sds[0] != sds[1] else sds[:1]:
        axes.fill_between(pressures, values - sd, values + sd, color=style.colour, alpha=0.2, linewidth=0)
    axes.plot(pressures, values, label=name, **style.plot)


def draw_critical_speeds(study: Study, target: Path) -> Path:
    """Draw a panel per world; filled: becomes unstable, hollow: becomes stable; bars: one standard deviation."""
    setups, rows = study.settings.setups, study.cases
    crossed = list(dict.fromkeys(c.mode for result in study.results for c in result.crossings))
    heights = dict(zip(crossed, np.linspace(-0.28, 0.28, len(crossed)), strict=True))  # modes lie one above the other
    columns = (len(setups) + 1) // 2
    with plotting.drawing(target, width=12.5, height=8.6) as canvas:
        grid = canvas.subplots(2, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, setup in zip(grid, setups, strict=False):
            for row, result in enumerate(study.result(setup, case) for case in rows):
                if result:
                    _draw_crossings(axes, result, row, heights)
            axes.grid(visible=False, axis="y")
            axes.set_title(setup.label)
            axes.set_xlim(0, study.settings.max_speed)
        grid[0].set_yticks(np.arange(len(rows)), [f"{case.name}, {case.condition}" for case in rows])
        grid[0].set_ylim(len(rows) - 0.4, -0.6)
        for axes in grid[-columns:]:
            axes.set_xlabel("Speed, m/s")
        shown: dict[str, Any] = {}
        for mode in crossed:
            style = {"linestyle": "none", "color": mode_look(mode).colour, **mode_marker(mode)}
            (shown[mode_words(mode)],) = grid[0].plot([], [], **style)
        for words, face in (("filled: becomes unstable as the speed grows", "0.3"), ("hollow: becomes stable", "none")):
            (shown[words],) = grid[0].plot([], [], "o", color="0.3", markerfacecolor=face)
        ncols = plotting.legend_columns(list(shown), width=12.5)
        canvas.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=ncols)
        text = ": critical speeds; bars: one standard deviation of tyre and bicycle (thick: of the tyre data alone)"
        _title(canvas, study, text, study.results)
    return target


def _draw_crossings(axes: Any, result: Result, row: int, heights: dict[str, float]) -> None:
    _hatch_row(axes, row, extrapolated=result.case.extrapolated)
    axes.axhline(row + 0.5, color="0.88", linewidth=0.6, zorder=0)
    for c in result.crossings:
        style = {"linestyle": "none", "color": mode_look(c.mode).colour}
        marker = mode_marker(c.mode) | ({} if c.destabilising else {"markerfacecolor": "white"})
        if c.tyre_sd != c.sd:
            axes.errorbar(c.speed, row + heights[c.mode], xerr=c.tyre_sd, elinewidth=3.5, alpha=0.6, **style)
        axes.errorbar(c.speed, row + heights[c.mode], xerr=c.sd, elinewidth=1.2, **style, **marker)
