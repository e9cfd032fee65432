"""The headline: speeds of unstable wobble per tyre and pressure, how far they may move, and what moves them."""

import math
from pathlib import Path
from textwrap import fill
from typing import Any

from bicycle.critical.critical_speed import CriticalSpeed, CrossingIdentity
from studies.main_study.bands import KMH, WEAVE, WOBBLE
from studies.main_study.decompose import Change
from studies.main_study.plausible import Plausible
from studies.main_study.settings import Setup
from studies.main_study.solve import Result
from studies.main_study.study import Study
from studies.reporting.plotting import EXTRAPOLATED, drawing, look

EDGES = (
    ("begins", CrossingIdentity(WOBBLE, destabilising=True)), ("ends", CrossingIdentity(WOBBLE, destabilising=False)),
)  # fmt: skip
PARTS = ("relaxation length", "cornering stiffness", "interaction")
GROUP_GAP = 0.9
THICK = 0.5
LIFT, MARK_DROP, OUTER_DROP = 0.12, 0.36, 0.24  # bars sit above the middle of a row, the rest below them
NOWHERE = "no unstable wobble in any case"
CAPTION = 100  # letters in a line
LEGEND_DROP, MARGIN = 0.5, 1.4  # inches: the legend below the axes, and what is above and below these
ROOM = 1.27  # of the fastest speed, for what is written at the end of a bar
NUMBER = 1.04  # of the fastest speed, where the number of an edge begins at the latest


def draw_headline(study: Study, setup: Setup, target: Path) -> Path:
    """Left: bands of unstable wobble in one world; right: how lower pressure moves their two edges, and why.

    The right side is left out where no band has an edge at both pressures. Goes into ``target``.
    """
    explained = bool(changes(study, setup))
    columns = 2 if explained else 1
    rows = len(study.of(setup)) + GROUP_GAP * len(study.names)
    width, height = (11.5 if explained else 8.5), 1.9 + 0.27 * rows
    with drawing(target, width=width, height=height) as canvas:
        ratios = {"width_ratios": (1.7, 1)[:columns]}
        grid = canvas.subplots(1, columns, squeeze=False, gridspec_kw=ratios)[0]
        draw_bands(grid[0], study, setup)
        if explained:
            draw_parts(grid[1], study, setup)
        canvas.suptitle(title(study, setup), x=0.01, ha="left", fontsize=13 if explained else 11, fontweight="bold")
    return target


def title(study: Study, setup: Setup) -> str:
    """What is shown, and on which bicycle."""
    found = any(result.span(study.settings.fastest) for result in study.of(setup))
    what = "Where wobble is unstable" if found else "No unstable wobble on any tyre studied"
    return f"{what}: {study.settings.bicycle.name}"


def assumed(study: Study, setup: Setup) -> str:
    """The world, and whether its front is assumed."""
    said = " (assumed)" if setup.front and not setup.front.given else ""
    return f"{setup.label}{said}"


def changes(study: Study, setup: Setup) -> list[Change]:
    """Every change of an edge of an unstable band that can be split into its parts."""
    found = [study.decomposition(setup, name) for name in study.names]
    return [change for d in found if d for _, key in EDGES if (change := d.change(key))]


def draw_bands(axes: Any, study: Study, setup: Setup) -> None:
    """Bars from onset to end of unstable wobble on ``axes``; pale ends: one sd; lines: plausible fronts."""
    height, ticks = 0.0, {}
    results = study.of(setup)
    fastest = study.settings.fastest
    limit = ROOM * fastest
    unstable = any(r.span(fastest) for r in results)
    for number, name in enumerate(study.names):
        axes.text(0.004 * limit, height - 0.66, name, fontweight="bold", va="center",
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
        for result in study.of(setup, name):
            if result.case.extrapolated:
                axes.axhspan(height - 0.5, height + 0.5, facecolor="none", linewidth=0, zorder=0, **EXTRAPOLATED)
            _bar(axes, result, height - LIFT, look(number).colour, fastest, alone=unstable)
            outer = study.outer(result)
            if outer:
                _outer(axes, outer, height + OUTER_DROP, look(number).colour, fastest)
            for crossing in result.crossings:
                if crossing.mode == WEAVE and crossing.speed < fastest and crossing.oscillatory:
                    _weave_mark(axes, crossing, height + MARK_DROP)
            ticks[height] = result.case.condition
            height += 1
        height += GROUP_GAP
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set(xlim=(0, limit), ylim=(height - GROUP_GAP - 0.4, -1.0), xlabel="Speed, m/s")
    axes.secondary_xaxis("top", functions=(lambda v: KMH * v, lambda v: v / KMH)).set_xlabel("km/h", fontsize=8)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    heading = "Unstable wobble" if unstable else NOWHERE.capitalize() + f" up to {fastest:g} m/s"
    axes.set_title(f"{heading}: {assumed(study, setup)}", fontsize=9)
    words = caption(study, results)
    axes.text(0.0, -0.55 / (0.27 * (height + 2)), words, transform=axes.transAxes, ha="left", va="top", fontsize=7.5,
              color="0.3")  # fmt: skip


def caption(study: Study, results: list[Result]) -> str:
    """Explains the marks that are there, and no others."""
    fastest = study.settings.fastest
    weave = [c for r in results for c in r.crossings if c.mode == WEAVE and c.speed < fastest and c.oscillatory]
    circles = [
        words for words, there in (
            ("stable (hollow)", any(not c.destabilising for c in weave)),
            ("unstable (filled)", any(c.destabilising for c in weave)),
        ) if there
    ]  # fmt: skip
    outer = [one for r in results if (one := study.outer(r))]
    first = [
        "pale ends: ± one standard deviation of tyre and bicycle" if any(r.span(fastest) for r in results) else "",
        f"circles: weave becomes {', '.join(circles)}" if circles else "",
        "hatched: tyre values extrapolated" if any(r.case.extrapolated for r in results) else "",
    ]
    second: list[str] = []
    if any(one.without < one.count for one in outer):
        second.append(
            f"thin lines: where nine of ten of those of {outer[0].count} random bicycles with plausible fronts that\n"
            "wobble have onset and end"
        )
    if any(one.without for one in outer):
        second.append(f"at the right: how many of these {outer[0].count} do not wobble up to {fastest:g} m/s")
    lines = [line for line in ("; ".join(part for part in first if part), *second) if line]
    return "\n".join(fill(line.replace("\n", " "), CAPTION) for line in lines)


def _bar(axes: Any, result: Result, height: float, colour: str, fastest: float, *, alone: bool) -> None:
    """One case; where other cases have a band, one without says so."""
    bands = result.bands(fastest)
    for band in bands:
        low = band.start.speed if band.start else 0.0
        high = band.end.speed if band.end and band.end.speed <= fastest else fastest
        axes.barh(height, high - low, left=low, height=THICK, color=colour, alpha=0.85, linewidth=0)
        if high == fastest:
            axes.text(high, height, " ▸", va="center", fontsize=9, color=colour)
        for edge, align, shift in ((band.start, "right", -3), (band.end, "left", 3)):
            if edge and edge.speed <= fastest:
                sides = {"left": edge.speed - edge.sd, "height": THICK, "linewidth": 0}
                axes.barh(height, 2 * edge.sd, color="white", alpha=0.55, **sides)
                axes.barh(height, 2 * edge.sd, color=colour, alpha=0.25, **sides)
                side = edge.speed + (edge.sd if shift > 0 else -edge.sd)
                outside = min(side, NUMBER * fastest) if shift > 0 else max(side, 0.045 * fastest)
                axes.annotate(f"{edge.speed:.1f}", (outside, height), (shift, 0), textcoords="offset points", ha=align,
                              va="center", fontsize=8.5)  # fmt: skip
    if alone and not bands:
        axes.text(0.35 * fastest, height, "no unstable wobble", va="center", fontsize=8.5, color="0.35", style="italic")


def _outer(axes: Any, outer: Plausible, height: float, colour: str, fastest: float) -> None:
    """Where onset and end are for plausible fronts, and how many of them do not wobble."""
    for edge in ("onset", "end"):
        ends = outer.likely(edge)
        if ends:
            low, high = ends
            axes.plot([low, min(high, fastest)], [height, height], color=colour, linewidth=1.2, zorder=3)
            for end in (low, high):
                if not math.isclose(end, fastest):
                    axes.plot([end, end], [height - 0.09, height + 0.09], color=colour, linewidth=1.2, zorder=3)
    if outer.without:
        words = f"{outer.without} without"
        axes.text(ROOM * fastest, height - OUTER_DROP, words, fontsize=7.5, color="0.35", ha="right", va="center")


def _weave_mark(axes: Any, crossing: CriticalSpeed, height: float) -> None:
    face = "black" if crossing.destabilising else "white"
    axes.plot(crossing.speed, height, "o", color="black", markerfacecolor=face, markersize=3.8, zorder=4)


def draw_parts(axes: Any, study: Study, setup: Setup) -> None:
    """Stacked bars on ``axes``: change of each edge of the band at the lower pressure, by what causes it."""
    from matplotlib.patches import Patch

    height, ticks = 0.0, {}
    low, high = -0.5, 0.5
    pressures = set()
    for number, name in enumerate(study.names):
        found = study.decomposition(setup, name)
        axes.text(0.02, height - 0.72, name, fontweight="bold", va="center", transform=axes.get_yaxis_transform())
        for what, key in EDGES:
            change = found.change(key) if found else None
            ticks[height] = what
            if found and change:
                if found.higher.extrapolated or found.lower.extrapolated:
                    axes.axhspan(height - 0.5, height + 0.5, facecolor="none", linewidth=0, zorder=0, **EXTRAPOLATED)
                reached = _stack(axes, change, height, look(number).colour)
                low, high = min(low, reached[0]), max(high, reached[1])
                pressures.add(f"{found.higher.condition} to {found.lower.condition}")
            else:
                axes.text(
                    0.5, height, "not at both pressures", va="center", ha="center", fontsize=8, color="0.35",
                    style="italic", transform=axes.get_yaxis_transform(),
                )  # fmt: skip
            height += 1
        height += GROUP_GAP + 0.5
    axes.axvline(0, color="0.2", linewidth=1)
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set(
        xlim=(low - 0.16 * (high - low), high + 0.16 * (high - low)),
        ylim=(height - GROUP_GAP - 0.9, -1.2),
        xlabel="Change of speed, m/s",
    )
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title("Why: change from " + " and ".join(sorted(pressures)), fontsize=9)
    handles = [Patch(label=part, **style) for part, style in zip(PARTS, _part_styles("0.35"), strict=True)]
    below = -LEGEND_DROP / (axes.figure.get_figheight() - MARGIN)
    axes.legend(
        handles=handles, loc="upper center", bbox_to_anchor=(0.45, below), ncols=len(PARTS), fontsize=8,
        columnspacing=1.0,
    )  # fmt: skip


def _stack(axes: Any, change: Change, height: float, colour: str) -> tuple[float, float]:
    """Draw one stacked bar and the total; returns how far it reaches to both sides, m/s."""
    ends = {True: 0.0, False: 0.0}
    values = (change.length_part, change.stiffness_part, change.interaction)
    for value, style in zip(values, _part_styles(colour), strict=True):
        axes.barh(height, value, left=ends[value > 0], height=0.62, **style)
        ends[value > 0] += value
    side = change.total > 0
    axes.annotate(f"{change.total:+.1f}", (ends[side], height), (4 if side else -4, 0), textcoords="offset points",
                  ha="left" if side else "right", va="center", fontsize=8.5)  # fmt: skip
    return ends[False], ends[True]


def _part_styles(colour: str) -> list[dict[str, Any]]:
    """Full colour, dotted white, and grey: apart in print too, and from the hatching of extrapolated values."""
    return [
        {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8},
        {"facecolor": "white", "edgecolor": colour, "linewidth": 1.0, "hatch": "...."},
        {"facecolor": "0.75", "edgecolor": "0.5", "linewidth": 0.8},
    ]
