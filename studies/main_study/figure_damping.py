"""Damping ratio of wobble and weave against inflation pressure, with its uncertainty."""

from pathlib import Path
from typing import Any

from studies.main_study.solve import COMPARED_MODES, Result
from studies.main_study.study import Study
from studies.reporting.plotting import UNSTABLE, drawing, extrapolated_note, hatch_extrapolated, look


def draw_damping(study: Study, target: Path) -> Path:
    """A row per mode, a column per setup, a line per tyre and surface, as ``target``; bands: one standard deviation."""
    setups = study.settings.setups
    with drawing(target, width=12.5, height=6.4) as canvas:
        grid = canvas.subplots(len(COMPARED_MODES), len(setups), sharex=True, squeeze=False)
        for row, mode in enumerate(COMPARED_MODES):
            for axes, setup in zip(grid[row], setups, strict=True):
                for number, name in enumerate(study.names):
                    mine = [r for r in study.of(setup, name) if mode in r.damping and r.case.pressures_bar]
                    if mine:
                        _line(axes, mine, mode, number, name)
                hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in study.of(setup)))
                if row == 0:
                    axes.set_title(setup.label.replace(", ", ",\n"), fontsize=8.5)
            _same_scale(list(grid[row]))
            grid[row, 0].set_ylabel(f"{mode.capitalize()}: damping ratio")
        for axes in grid[-1]:
            axes.set_xlabel("Inflation pressure, bar")
            axes.set_xticks(sorted({case.pressure_bar for case in study.cases if case.pressures_bar}))
        handles, labels = max((axes.get_legend_handles_labels() for axes in grid.flat), key=lambda pair: len(pair[1]))
        canvas.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        note = extrapolated_note(extrapolated=any(case.extrapolated for case in study.cases))
        canvas.suptitle(
            f"{study.settings.bicycle.name} at {study.settings.report_speed:g} m/s; bands: one standard deviation of "
            f"tyre and bicycle (darker: of the tyre data alone); shaded: unstable{note}", x=0.01, ha="left",
        )  # fmt: skip
    return target


def _line(axes: Any, found: list[Result], mode: str, number: int, name: str) -> None:
    pressures = [r.case.pressure_bar for r in found]
    ratios = [r.damping[mode] for r in found]
    style = look(number)
    sds = [[r.sd for r in ratios], [r.tyre_sd for r in ratios]]
    for sd in sds if sds[0] != sds[1] else sds[:1]:
        axes.fill_between(
            pressures, [r.value - one for r, one in zip(ratios, sd, strict=True)],
            [r.value + one for r, one in zip(ratios, sd, strict=True)], color=style.colour, alpha=0.2, linewidth=0,
        )  # fmt: skip
    axes.plot(pressures, [r.value for r in ratios], label=name, **style.plot)


def _same_scale(panels: list[Any]) -> None:
    """One scale for panels to compare; the unstable part, if it is in the picture, is shaded."""
    low = min(axes.get_ylim()[0] for axes in panels)
    high = max(axes.get_ylim()[1] for axes in panels)
    for axes in panels:
        if low < 0:
            axes.axhspan(low, min(0.0, high), color=UNSTABLE, zorder=0)
        axes.set_ylim(low, high)
