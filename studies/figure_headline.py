"""The headline: speeds of unstable wobble per measured tyre and pressure, and what moves their edges."""

from pathlib import Path
from typing import Any

from studies.main_study import Change, Study
from studies.main_study_cases import Setup
from studies.main_study_solve import Crossing, Result
from studies.plotting import EXTRAPOLATED_HATCH, drawing, look

WOBBLE, WEAVE = "wobble", "weave"
EDGES = (("begins", f"{WOBBLE} unstable above"), ("ends", f"{WOBBLE} stable above"))
PARTS = ("relaxation length", "cornering stiffness", "interaction")
GROUP_GAP = 0.9


def draw_headline(study: Study, setups: list[Setup], target: Path) -> Path:
    """A row per setup. Left: bands of unstable wobble; right: how lower pressure moves their two edges, and why."""
    with drawing(target, width=11.5, height=0.9 + 4.9 * len(setups)) as canvas:
        grid = canvas.subplots(len(setups), 2, squeeze=False, gridspec_kw={"width_ratios": (1.7, 1)}, sharex="col")
        for (bands, parts), setup in zip(grid, setups, strict=True):
            draw_bands(bands, study, setup)
            draw_parts(parts, study, setup)
        title = f"Where the bicycle {study.settings.bicycle.name} wobbles, by measured tyre and pressure"
        canvas.suptitle(title, x=0.01, ha="left", fontsize=13, fontweight="bold")
    return target


def draw_bands(axes: Any, study: Study, setup: Setup) -> None:
    """Bars from onset to end of unstable wobble; the shaded ends are one standard deviation of the tyre data."""
    height, ticks = 0.0, {}
    bands = [band for r in study.of(setup) for band in r.bands(WOBBLE)]
    edges = [c.speed + c.sd for band in bands for c in (band.start, band.end) if c]
    limit = min(max([study.settings.speeds[-1], *(edge * 1.06 for edge in edges)]), study.settings.max_speed)
    for number, name in enumerate(study.names):
        axes.text(0.004 * limit, height - 0.62, name, fontweight="bold", va="center")
        for result in study.of(setup, name):
            _bar(axes, result, height, look(number).colour, limit)
            ticks[height] = f"{result.case.pressure_bar:g} bar"
            height += 1
        height += GROUP_GAP
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set(xlim=(0, limit), ylim=(height - GROUP_GAP - 0.4, -1.0), xlabel="Speed, m/s")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title(f"Unstable wobble: {setup.label}", fontsize=9)
    extrapolated = any(r.case.extrapolated for r in study.of(setup))
    extrapolated = any(r.case.extrapolated for r in study.of(setup))
    axes.text(
        0.0, -0.12, "pale ends: ± one standard deviation of the tyre data; circles: weave becomes stable (hollow), "
        "unstable (filled)" + ("\ncrossed: tyre values extrapolated" if extrapolated else ""),
        transform=axes.transAxes, ha="left", va="top", fontsize=7.5, color="0.3",
    )  # fmt: skip


def _bar(axes: Any, result: Result, height: float, colour: str, limit: float) -> None:
    hatch = EXTRAPOLATED_HATCH if result.case.extrapolated else None
    bands = result.bands(WOBBLE)
    for band in bands:
        low = band.start.speed if band.start else 0.0
        high = band.end.speed if band.end else limit
        axes.barh(height, high - low, left=low, height=0.62, color=colour, alpha=0.85, hatch=hatch, edgecolor="white",
                  linewidth=0)  # fmt: skip
        for edge, align, shift in ((band.start, "right", -3), (band.end, "left", 3)):
            if edge:
                axes.barh(height, 2 * edge.sd, left=edge.speed - edge.sd, height=0.62, color="white", alpha=0.55)
                axes.barh(height, 2 * edge.sd, left=edge.speed - edge.sd, height=0.62, color=colour, alpha=0.25)
                outside = edge.speed + (edge.sd if shift > 0 else -edge.sd)
                axes.annotate(f"{edge.speed:.1f}", (outside, height), (shift, 0), textcoords="offset points", ha=align,
                              va="center", fontsize=8.5)  # fmt: skip
    if not bands:
        words = "no unstable wobble" + (" (extrapolated)" if result.case.extrapolated else "")
        axes.text(0.35 * limit, height, words, va="center", fontsize=8.5, color="0.35", style="italic")
    for crossing in result.crossings:
        if crossing.mode == WEAVE and crossing.speed < limit:
            _weave_mark(axes, crossing, height)


def _weave_mark(axes: Any, crossing: Crossing, height: float) -> None:
    face = "black" if crossing.destabilising else "white"
    axes.plot(crossing.speed, height + 0.31, "o", color="black", markerfacecolor=face, markersize=4, zorder=4)


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
                hatch = EXTRAPOLATED_HATCH if found.higher.extrapolated or found.lower.extrapolated else None
                reached = _stack(axes, change, height, look(number).colour, hatch)
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
    axes.set_title("Why: from " + " and ".join(sorted(pressures)) if pressures else "Why", fontsize=9.5)
    handles = [Patch(label=part, **style) for part, style in zip(PARTS, _part_styles("0.35"), strict=True)]
    axes.legend(
        handles=handles,
        loc="upper center",
        bbox_to_anchor=(0.45, -0.1),
        ncols=len(PARTS),
        fontsize=8,
        columnspacing=1.0,
    )


def _stack(axes: Any, change: Change, height: float, colour: str, hatch: str | None) -> tuple[float, float]:
    """Draw one stacked bar and the total; returns how far it reaches to both sides, m/s."""
    ends = {True: 0.0, False: 0.0}
    values = (change.length_part, change.stiffness_part, change.interaction)
    for value, style in zip(values, _part_styles(colour), strict=True):
        if hatch:
            style["hatch"] = hatch
        axes.barh(height, value, left=ends[value > 0], height=0.62, **style)
        ends[value > 0] += value
    side = change.total > 0
    axes.annotate(f"{change.total:+.1f}", (ends[side], height), (4 if side else -4, 0), textcoords="offset points",
                  ha="left" if side else "right", va="center", fontsize=8.5)  # fmt: skip
    return ends[False], ends[True]


def _part_styles(colour: str) -> list[dict[str, Any]]:
    """Full colour, outlined white, and grey: apart in print too."""
    return [
        {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8},
        {"facecolor": "white", "edgecolor": colour, "linewidth": 1.0, "hatch": "////"},
        {"facecolor": "0.75", "edgecolor": "0.5", "linewidth": 0.8},
    ]
