"""Critical speeds of every mode per tyre and pressure."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.main_study.cases import TyreCase
from studies.main_study.settings import Setup
from studies.main_study.study import Study
from studies.reporting.plotting import (
    EXTRAPOLATED,
    drawing,
    extrapolated_note,
    legend_columns,
    mode_look,
    mode_marker,
    mode_words,
)

WIDTH = 12.5
SPREAD = 0.56  # of a row: the modes lie one above the other


def draw_critical_speeds(study: Study, target: Path) -> Path:
    """A panel per world into ``target``; filled: becomes unstable, hollow: stable; bars: one standard deviation."""
    setups = study.settings.setups
    rows = list(study.cases)
    crossed = list(dict.fromkeys(c.mode for result in study.results for c in result.crossings))
    heights = dict(zip(crossed, SPREAD * np.linspace(-0.5, 0.5, len(crossed)), strict=True))
    with drawing(target, width=WIDTH, height=8.6) as canvas:
        grid = canvas.subplots(2, (len(setups) + 1) // 2, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, setup in zip(grid, setups, strict=False):
            _panel(axes, study, setup, heights)
        grid[0].set_yticks(np.arange(len(rows)), [row_label(case) for case in rows])
        grid[0].set_ylim(len(rows) - 0.4, -0.6)
        for axes in grid[-((len(setups) + 1) // 2) :]:
            axes.set_xlabel("Speed, m/s")
        shown: dict[str, Any] = {}
        for mode in crossed:
            (shown[mode_words(mode)],) = grid[0].plot([], [], linestyle="none", color=mode_look(mode).colour,
                                                      **mode_marker(mode))  # fmt: skip
        for words, face in (("filled: becomes unstable as the speed grows", "0.3"), ("hollow: becomes stable", "none")):
            (shown[words],) = grid[0].plot([], [], "o", color="0.3", markerfacecolor=face)
        columns = legend_columns(list(shown), width=WIDTH)
        canvas.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=columns)
        note = extrapolated_note(extrapolated=any(case.extrapolated for case in rows))
        canvas.suptitle(
            f"{study.settings.bicycle.name}: critical speeds; bars: one standard deviation of tyre and bicycle (thick: "
            f"of the tyre data alone){note}",
            x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
    return target


def _panel(axes: Any, study: Study, setup: Setup, heights: dict[str, float]) -> None:
    for row, result in enumerate(study.result(setup, case) for case in study.cases):
        if result is None:
            continue
        if result.case.extrapolated:
            axes.axhspan(row - 0.5, row + 0.5, facecolor="none", linewidth=0, zorder=0, **EXTRAPOLATED)
        axes.axhline(row + 0.5, color="0.88", linewidth=0.6, zorder=0)
        for crossing in result.crossings:
            style = mode_marker(crossing.mode)
            if not crossing.destabilising:
                style["markerfacecolor"] = "white"
            if crossing.tyre_sd != crossing.sd:
                axes.errorbar(crossing.speed, row + heights[crossing.mode], xerr=crossing.tyre_sd, linestyle="none",
                              color=mode_look(crossing.mode).colour, elinewidth=3.5, alpha=0.6)  # fmt: skip
            axes.errorbar(
                crossing.speed, row + heights[crossing.mode], xerr=crossing.sd, color=mode_look(crossing.mode).colour,
                elinewidth=1.2, linestyle="none", **style,
            )  # fmt: skip
    axes.grid(visible=False, axis="y")
    axes.set_title(setup.label)
    axes.set_xlim(0, study.settings.max_speed)


def row_label(case: TyreCase) -> str:
    """Tyre, surface and pressure in one line."""
    return f"{case.name}, {case.condition}"
