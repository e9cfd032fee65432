"""Figures of the main study: unstable wobble and what moves it, damping, critical speeds, eigenvalues, root loci."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from bicycle.critical import CrossingIdentity
from bicycle.eigen import angular_frequency, frequency_hz
from bicycle.named_modes import Modes, modes
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
from tyre.arrays import Array

EDGES = (
    ("begins", CrossingIdentity(WOBBLE, destabilising=True)), ("ends", CrossingIdentity(WOBBLE, destabilising=False)),
)  # fmt: skip
PRESSURE_LINES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)))
PRESSURE_MARKERS = ("o", "s", "^", "D", "v")
REAL_RANGE = (-35.0, 9.0)  # 1/s; what lies further left is fast and well damped; a root locus shows twice as much
SMALL = {"fontsize": 8.5, "va": "center"}


def drawings(settings: Settings, folder: Path) -> list[Callable[[Study], Path]]:
    """List every figure of the study for ``folder``, each to be called with the study."""
    draws: list[Callable[[Study], Path]] = [
        partial(draw_headline, setup=settings.reference, target=folder / "headline"),
        partial(draw_headline, setup=settings.setups[1], target=folder / "wobble_hands_on"),
        partial(draw_damping, target=folder / "damping_ratio"),
        partial(draw_critical_speeds, target=folder / "critical_speeds"),
    ]
    for number, setup in enumerate(settings.setups, 1):
        draws.append(partial(draw_eigenvalues, setup=setup, target=folder / f"eigenvalues_{number}"))
        if setup.front:  # what a rigid front does to the roots is in the eigenvalues
            draws.append(partial(draw_speed_locus, setup=setup, target=folder / f"root_locus_{number}"))
    return draws


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


def paths(result: Result, speeds: Array) -> Modes:
    """Modes of a result at ``speeds`` (m/s, rising) and, ever closer, on both sides of every meeting of roots."""
    close = float(np.max(np.diff(speeds))) * np.concatenate([[1e-9], np.geomspace(1e-4, 1.0, 13)])
    meetings = [event.speed for event in result.modes.events if event.kind in ("merge", "split")]
    every = np.unique(np.concatenate([speeds, *(meeting + sign * close for meeting in meetings for sign in (-1, 1))]))
    return modes(result.modes.model, every[(every >= speeds[0]) & (every <= speeds[-1])])


def _top(results: list[Result]) -> float:
    """End of the interesting part of a figure, rad/s: a little above wobble and weave."""
    branches = [result.modes.branches[mode] for result in results for mode in COMPARED if mode in result.modes.branches]
    return 1.12 * float(max((np.nanmax(values.imag) for values in branches), default=100.0))


def draw_eigenvalues(study: Study, setup: Setup, target: Path) -> Path:
    """Draw real part and frequency against speed; a column per tyre and surface, a marker per mode."""
    speeds, width = study.settings.speeds, 3.125 * max(len(study.names), 4)
    with plotting.drawing(target, width=width, height=7.0) as canvas:
        grid = canvas.subplots(2, len(study.names), sharex=True, sharey="row", squeeze=False)
        shown: dict[str, Any] = {}
        grid[0, 0].set(ylabel="Real part, 1/s (shaded: unstable)", ylim=REAL_RANGE, xlim=(speeds[0], speeds[-1]))
        grid[1, 0].set(ylabel="Frequency, Hz", ylim=(0, _top(study.of(setup)) / angular_frequency(1.0)))
        for name, (real, frequency) in zip(study.names, grid.T, strict=True):
            for result in study.of(setup, name):
                number = study.conditions.index(result.case.condition)
                _draw_branches(real, frequency, paths(result, speeds), number, shown)
            real.axhspan(0, REAL_RANGE[1], color=UNSTABLE, zorder=0)
            real.set_title(fill(name, 18))
            frequency.set_xlabel("Speed, m/s")
            for axes in (real, frequency):
                hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in study.of(setup, name)))
        handles = {mode_words(mode): shown[mode] for mode in sorted(shown, key=lambda mode: mode.count("+"))}
        for number, condition in enumerate(study.conditions):
            (line,) = grid[0, 0].plot([], [], color="0.2", linestyle=PRESSURE_LINES[number % len(PRESSURE_LINES)])
            handles[condition] = line
        columns = plotting.legend_columns(list(handles), width=width)
        canvas.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)
        _title(canvas, study, f": {setup.label}", study.of(setup))
    return target


def _draw_branches(real: Any, frequency: Any, path: Modes, number: int, shown: dict[str, Any]) -> None:
    """Draw the lines of one pressure; markers sit at other places for each pressure."""
    for mode, values in path.branches.items():
        style = {"color": mode_look(mode).colour, "linewidth": 1.3, "markersize": 4.5, **mode_marker(mode)}
        every, line = (0.05 * (1 + number), 0.17), PRESSURE_LINES[number % len(PRESSURE_LINES)]
        for branch in values.T:
            oscillation = np.where(branch.imag > 0, frequency_hz(branch), np.nan)
            for axes, part in ((real, branch.real), (frequency, oscillation)):
                low, high = axes.get_ylim()
                seen = np.where((part > 2 * low - high) & (part < 2 * high - low), part, np.nan)
                if not np.isnan(seen).all():
                    axes.plot(path.speeds, seen, linestyle=line, markevery=every, **style)
                    if mode not in shown:
                        (shown[mode],) = real.plot([], [], linestyle="-", **style)


def draw_speed_locus(study: Study, setup: Setup, target: Path) -> Path:
    """Draw paths in the complex plane, coloured by speed, a panel per tyre and surface, a marker per pressure."""
    speeds, top = study.settings.speeds, _top(study.of(setup))
    found = {name: [(r.case.condition, paths(r, speeds)) for r in study.of(setup, name)] for name in study.names}
    rows = _real_modes([path for one in found.values() for _, path in one])
    height, window = 0.34 * len(rows), (2 * REAL_RANGE[0], 2 * REAL_RANGE[1])
    with plotting.drawing(target, width=3.125 * max(len(study.names), 4), height=5.2 + height) as canvas:
        ratios = {"height_ratios": (4.0, height + 0.1)}
        grid = canvas.subplots(2, len(found), sharex=True, sharey="row", squeeze=False, gridspec_kw=ratios)
        grid[0, 0].set(ylabel="Imaginary part, rad/s", xlim=window, ylim=(-0.02 * top, top))
        grid[1, 0].set(ylim=(len(rows) - 0.5, -0.5), ylabel="Real roots")
        grid[1, 0].set_yticks(range(len(rows)), [mode_words(mode) for mode in rows])
        for (plane, real), (name, results) in zip(grid.T, found.items(), strict=True):
            for condition, path in results:
                _draw_roots(plane, real, path, study.conditions.index(condition), rows, study, top)
            _name_paths(plane, [path for _, path in results], top)
            plane.set_title(fill(name, 18))
            real.set_xlabel("Real part, 1/s")
            for axes in (plane, real):
                axes.axvspan(0, window[1], color=UNSTABLE, zorder=0)
                axes.axvline(0, color="0.2", linewidth=1, zorder=1)
                hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in study.of(setup, name)))
        to_hertz = (lambda w: frequency_hz(1j * np.asarray(w)), angular_frequency)
        grid[0, -1].secondary_yaxis("right", functions=to_hertz).set_ylabel("Frequency, Hz")
        for number, condition in enumerate(study.conditions):
            marker = PRESSURE_MARKERS[number % len(PRESSURE_MARKERS)]
            grid[0, 0].scatter([], [], color="0.3", marker=marker, s=16, label=condition)
        handles, words = grid[0, 0].get_legend_handles_labels()
        canvas.legend(handles, words, loc="outside lower center", ncols=len(words))
        canvas.colorbar(grid[0, 0].collections[0], ax=grid, label="Speed, m/s", pad=0.01)
        _title(canvas, study, f": {setup.label}; shaded: unstable", study.of(setup))
    return target


def _real_modes(found: list[Modes]) -> list[str]:
    """Names of the modes with a root on the real axis in the window, in the order of the modes."""
    names = dict.fromkeys(
        name for path in found for name, values in path.branches.items()
        if ((values.imag == 0) & (values.real > 2 * REAL_RANGE[0])).any()
    )  # fmt: skip
    return sorted(names, key=lambda name: name.count("+"))


def _seen(root: Any, top: float) -> Any:
    """Mask of the oscillations inside the window, which ends at ``top``, rad/s."""
    return (root.imag > 0) & (root.real > 2 * REAL_RANGE[0]) & (root.real < 2 * REAL_RANGE[1]) & (root.imag < top)


def _draw_roots(plane: Any, real: Any, path: Modes, number: int, rows: list[str], study: Study, top: float) -> None:
    speeds, count = study.settings.speeds, len(study.conditions)
    style = {"s": 9, "cmap": "viridis", "linewidths": 0, "vmin": speeds[0], "vmax": speeds[-1], "zorder": 3,
             "marker": PRESSURE_MARKERS[number % len(PRESSURE_MARKERS)]}  # fmt: skip
    beside = 0.54 * (number / max(count - 1, 1) - 0.5)  # pressures from the middle of a row of real roots
    roots = np.concatenate([branch for values in path.branches.values() for branch in values.T])
    at = np.tile(path.speeds, len(roots) // len(path.speeds))
    on_axis = (roots.imag == 0) & (roots.real > 2 * REAL_RANGE[0]) & (roots.real < 2 * REAL_RANGE[1])
    there = on_axis | _seen(roots, top)
    plane.scatter(roots.real[there], roots.imag[there], c=at[there], **style)
    names = np.concatenate([np.repeat(mode, values.size) for mode, values in path.branches.items()])
    for row, mode in enumerate(rows):
        mine = on_axis & (names == mode)
        real.scatter(roots.real[mine], np.full(int(mine.sum()), row + beside), c=at[mine], **style)


def _name_paths(plane: Any, found: list[Modes], top: float) -> None:
    """Write names beside the fastest point of each stretch, pushed down if they overlap; the title names the unseen."""
    places: dict[str, list[tuple[str, float, float]]] = {}
    moving, shown = set(), set()
    for path in found:
        mine: dict[str, list[tuple[str, float, float]]] = {}
        for mode, values in path.branches.items():
            moving |= {mode} if (values.imag > 0).any() else set()
            shown |= {mode} if _seen(values, top).any() else set()
            root, seen = values[:, 0], _seen(values[:, 0], top)
            for k in np.flatnonzero(seen & ~np.append(seen[1:], False)):
                start = int(np.flatnonzero(~seen[:k]).max(initial=-1)) + 1
                if root[start : k + 1].imag.max() > 0.05 * top:
                    mine.setdefault(mode, []).append((mode, float(root[k].real), float(root[k].imag)))
        places = mine | places
    (low, high), (bottom, _) = plane.get_xlim(), plane.get_ylim()
    taken: list[tuple[float, float, float]] = []
    for mode, x, y in sorted((one for every in places.values() for one in every), key=lambda place: -place[2]):
        size, at = 0.027 * len(mode_words(mode)), (x - low) / (high - low)  # of the panel: a letter takes 0.027
        left = at + 0.03 if at + 0.03 + size < 1 else max(at - 0.03 - size, 0.02)
        height = min((y - bottom) / (top - bottom), 0.96)
        while any(left < end and start < left + size and abs(height - other) < 0.055 for start, end, other in taken):
            height -= 0.055 / 4  # a line takes 0.055
        taken.append((left, left + size, height))
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8}
        plane.text(left, height, mode_words(mode), transform=plane.transAxes, zorder=5, bbox=box, **SMALL)
    if moving - shown:
        words = "beyond the window:\n" + ",\n".join(map(mode_words, sorted(moving - shown)))
        plane.set_title(words, loc="right", fontsize=7, fontweight="normal", color="0.3")
