"""Critical speeds of every mode per tyre and pressure."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.main_study import Study
from studies.main_study_cases import TyreCase
from studies.plotting import drawing, extrapolated_note, mode_look


def draw_critical_speeds(study: Study, target: Path) -> Path:
    """A panel per front and camber thrust; filled: becomes unstable, hollow: stable; bars: one standard deviation."""
    setups = study.settings.setups
    rows = list(study.cases)
    with drawing(target, width=12.5, height=7.6) as canvas:
        grid = canvas.subplots(2, (len(setups) + 1) // 2, sharex=True, sharey=True, squeeze=False).ravel()
        shown: dict[str, Any] = {}
        for axes, setup in zip(grid, setups, strict=False):
            for row, result in enumerate(study.of(setup)):
                if result.case.extrapolated:
                    axes.axhspan(row - 0.5, row + 0.5, facecolor="none", edgecolor="0.85", hatch="//", zorder=0)
                for crossing in result.crossings:
                    style = mode_look(crossing.mode)
                    axes.errorbar(
                        crossing.speed, row, xerr=crossing.sd, color=style.colour, marker=style.marker, elinewidth=1.2,
                        markerfacecolor=style.colour if crossing.destabilising else "white", linestyle="none",
                    )  # fmt: skip
                    (shown[crossing.mode.replace("_", " ")],) = axes.plot([], [], style.marker, color=style.colour)
            axes.set_title(setup.label)
            axes.set_xlim(0, study.settings.max_speed)
        grid[0].set_yticks(np.arange(len(rows)), [row_label(case) for case in rows])
        grid[0].invert_yaxis()
        for axes in grid[-((len(setups) + 1) // 2) :]:
            axes.set_xlabel("Speed, m/s")
        canvas.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=max(len(shown), 1))
        note = extrapolated_note(any(case.extrapolated for case in rows))
        canvas.suptitle(
            f"{study.settings.bicycle.name}: critical speeds. Filled: becomes unstable as the speed grows, hollow: "
            f"becomes stable; bars: one standard deviation{note}", x=0.01, ha="left", fontsize=10,
        )  # fmt: skip
    return target


def row_label(case: TyreCase) -> str:
    """Tyre, surface and pressure in one line."""
    return f"{case.name}, {case.pressure_bar:g} bar"
