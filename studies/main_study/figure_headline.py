"""The headline: speeds of unstable wobble per measured tyre and pressure, and what moves their edges."""

from pathlib import Path
from typing import Any

from studies.main_study.cases import Setup
from studies.main_study.solve import Crossing, Result
from studies.main_study.study import Change, Study
from studies.plotting import EXTRAPOLATED, drawing, look

WOBBLE, WEAVE = "wobble", "weave"
EDGES = (("begins", f"{WOBBLE} unstable above"), ("ends", f"{WOBBLE} stable above"))
PARTS = ("relaxation length", "cornering stiffness", "interaction")
GROUP_GAP = 0.9
THICK = 0.54
LIFT, MARK_DROP = 0.08, 0.38  # bars sit above the middle of a row, weave's circles below them
NOWHERE = "no unstable wobble in any case"


def draw_headline(study: Study, setups: list[Setup], target: Path) -> Path:
    """A row per setup. Left: bands of unstable wobble; right: how lower pressure moves their two edges, and why.

    The right side is left out where no band has an edge at both pressures.
    """
    explained = [setup for setup in setups if changes(study, setup)]
    columns = 2 if explained else 1
    width, height = (11.5, 0.9 + 4.9 * len(setups)) if explained else (8.5, 4.6 * len(setups))
    with drawing(target, width=width, height=height) as canvas:
        ratios = {"width_ratios": (1.7, 1)[:columns]}
        grid = canvas.subplots(len(setups), columns, squeeze=False, gridspec_kw=ratios, sharex="col")
        for row, setup in zip(grid, setups, strict=True):
            draw_bands(row[0], study, setup)
            if setup in explained:
                draw_parts(row[1], study, setup)
            elif explained:
                row[1].set_axis_off()
            for axes in row:
                axes.tick_params(labelbottom=True)
        canvas.suptitle(title(study, setups), x=0.01, ha="left", fontsize=13 if explained else 11, fontweight="bold")
    return target


def title(study: Study, setups: list[Setup]) -> str:
    """What is shown, on which bicycle, and that the front is assumed."""
    front = ", with an assumed flexible front" if all(setup.front for setup in setups) else ""
    found = any(result.bands(WOBBLE) for setup in setups for result in study.of(setup))
    what = "Where wobble is unstable, by measured tyre" if found else "No unstable wobble on any measured tyre"
    return f"{what}: {study.settings.bicycle.name}{front}"


def changes(study: Study, setup: Setup) -> list[Change]:
    """Every change of an edge of an unstable band that can be split into its parts."""
    found = [study.decomposition(setup, name) for name in study.names]
    return [change for d in found if d for _, key in EDGES if (change := d.change(key))]


def draw_bands(axes: Any, study: Study, setup: Setup) -> None:
    """Bars from onset to end of unstable wobble; the pale ends are one standard deviation."""
    height, ticks = 0.0, {}
    results = study.of(setup)
    bands = [band for r in results for band in r.bands(WOBBLE)]
    edges = [c.speed + c.sd for band in bands for c in (band.start, band.end) if c]
    limit = min(max([study.settings.speeds[-1], *(edge * 1.06 for edge in edges)]), study.settings.max_speed)
    for number, name in enumerate(study.names):
        axes.text(0.004 * limit, height - 0.64, name, fontweight="bold", va="center",
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6})  # fmt: skip
        for result in study.of(setup, name):
            if result.case.extrapolated:
                axes.axhspan(height - 0.5, height + 0.5, facecolor="none", linewidth=0, zorder=0, **EXTRAPOLATED)
            _bar(axes, result, height - LIFT, look(number).colour, limit, alone=bool(bands))
            for crossing in result.crossings:
                if crossing.mode == WEAVE and crossing.speed < limit:
                    _weave_mark(axes, crossing, height + (MARK_DROP if bands else 0))
            ticks[height] = f"{result.case.pressure_bar:g} bar"
            height += 1
        height += GROUP_GAP
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set(xlim=(0, limit), ylim=(height - GROUP_GAP - 0.4, -1.0), xlabel="Speed, m/s")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title(f"{'Unstable wobble' if bands else NOWHERE.capitalize()}: {setup.label}", fontsize=9)
    words = caption(study, results, limit, banded=bool(bands))
    axes.text(0.0, -0.12, words, transform=axes.transAxes, ha="left", va="top", fontsize=7.5, color="0.3")


def caption(study: Study, results: list[Result], limit: float, *, banded: bool) -> str:
    """Explains the marks that are there, and no others."""
    weave = [c for r in results for c in r.crossings if c.mode == WEAVE and c.speed < limit]
    circles = [
        words for words, there in (
            ("stable (hollow)", any(not c.destabilising for c in weave)),
            ("unstable (filled)", any(c.destabilising for c in weave)),
        ) if there
    ]  # fmt: skip
    parts = [
        f"pale ends: ± one standard deviation of {study.settings.uncertain}" if banded else "",
        f"circles: weave becomes {', '.join(circles)}" if circles else "",
        "hatched: tyre values extrapolated" if any(r.case.extrapolated for r in results) else "",
    ]
    return "; ".join(part for part in parts if part)


def _bar(axes: Any, result: Result, height: float, colour: str, limit: float, *, alone: bool) -> None:
    """One case; where other cases have a band, one without says so."""
    bands = result.bands(WOBBLE)
    for band in bands:
        low = band.start.speed if band.start else 0.0
        high = band.end.speed if band.end else limit
        axes.barh(height, high - low, left=low, height=THICK, color=colour, alpha=0.85, linewidth=0)
        for edge, align, shift in ((band.start, "right", -3), (band.end, "left", 3)):
            if edge:
                sides = {"left": edge.speed - edge.sd, "height": THICK, "linewidth": 0}
                axes.barh(height, 2 * edge.sd, color="white", alpha=0.55, **sides)
                axes.barh(height, 2 * edge.sd, color=colour, alpha=0.25, **sides)
                outside = edge.speed + (edge.sd if shift > 0 else -edge.sd)
                axes.annotate(f"{edge.speed:.1f}", (outside, height), (shift, 0), textcoords="offset points", ha=align,
                              va="center", fontsize=8.5)  # fmt: skip
    if alone and not bands:
        axes.text(0.35 * limit, height, "no unstable wobble", va="center", fontsize=8.5, color="0.35", style="italic")


def _weave_mark(axes: Any, crossing: Crossing, height: float) -> None:
    face = "black" if crossing.destabilising else "white"
    axes.plot(crossing.speed, height, "o", color="black", markerfacecolor=face, markersize=3.8, zorder=4)


def draw_parts(axes: Any, study: Study, setup: Setup) -> None:
    """Stacked bars: change of each edge of the band at the lower pressure, by what causes it."""
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
                pressures.add(f"{found.higher.pressure_bar:g} to {found.lower.pressure_bar:g} bar")
            else:
                axes.text(0, height, " not at both pressures", va="center", fontsize=8, color="0.35", style="italic")
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
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.45, -0.1), ncols=len(PARTS), fontsize=8,
                columnspacing=1.0)  # fmt: skip


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
