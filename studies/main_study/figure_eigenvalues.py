"""Eigenvalues of named modes against speed."""

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import angular_frequency, frequency_hz
from studies.main_study.paths import paths
from studies.main_study.settings import Setup
from studies.main_study.solve import Result
from studies.main_study.study import Study
from studies.reporting.plotting import (
    UNSTABLE,
    drawing,
    extrapolated_note,
    hatch_extrapolated,
    legend_columns,
    mode_look,
    mode_marker,
    mode_words,
)

PRESSURE_LINES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1.5, 1, 1.5)), (0, (3, 1, 1, 1, 1, 1)))
REAL_RANGE = (-35.0, 9.0)  # 1/s; what lies further left is fast and well damped
HEADROOM = 1.12
MARKS = (0.05, 0.17)  # first marker and distance, of the diagonal of a panel
PANEL = 3.125  # inches, one of at least four
TITLE = 18  # letters in a line


def panels_width(study: Study) -> float:
    """Width (inches) of a figure with a panel per tyre and surface."""
    return PANEL * max(len(study.names), 4)


def draw_eigenvalues(study: Study, setup: Setup, target: Path) -> Path:
    """Real part and frequency against speed into ``target``; a column per tyre and surface, a marker per mode."""
    speeds = study.settings.speeds
    width = panels_width(study)
    with drawing(target, width=width, height=7.0) as canvas:
        grid = canvas.subplots(2, len(study.names), sharex=True, sharey="row", squeeze=False)
        shown: dict[str, Any] = {}
        grid[0, 0].set(ylabel="Real part, 1/s (shaded: unstable)", ylim=REAL_RANGE, xlim=(speeds[0], speeds[-1]))
        top = highest_wobble(study.of(setup)) * HEADROOM / angular_frequency(1.0)
        grid[1, 0].set(ylabel="Frequency, Hz", ylim=(0, top))
        for column, name in enumerate(study.names):
            real, frequency = grid[:, column]
            results = study.of(setup, name)
            for result in results:
                _draw(real, frequency, result, speeds, study.conditions.index(result.case.condition), shown)
            real.axhspan(0, REAL_RANGE[1], color=UNSTABLE, zorder=0)
            real.set_title(fill(name, TITLE))
            frequency.set_xlabel("Speed, m/s")
            for axes in (real, frequency):
                hatch_extrapolated(axes, extrapolated=any(result.case.extrapolated for result in results))
        handles = {mode_words(mode): shown[mode] for mode in sorted(shown, key=lambda mode: mode.count("+"))}
        for number, condition in enumerate(study.conditions):
            (line,) = grid[0, 0].plot([], [], color="0.2", linestyle=PRESSURE_LINES[number % len(PRESSURE_LINES)])
            handles[condition] = line
        columns = legend_columns(list(handles), width=width)
        canvas.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)
        note = extrapolated_note(extrapolated=any(result.case.extrapolated for result in study.of(setup)))
        canvas.suptitle(f"{study.settings.bicycle.name}: {setup.label}{note}", x=0.01, ha="left")
    return target


def _draw(real: Any, frequency: Any, result: Result, speeds: Any, number: int, shown: dict[str, Any]) -> None:
    """Lines of one pressure; markers sit at other places for each pressure."""
    path = paths(result, speeds)
    for mode, values in path.branches.items():
        if np.isnan(values.real).all():
            continue
        style = {"color": mode_look(mode).colour, "linewidth": 1.3, "markersize": 4.5, **mode_marker(mode)}
        every, line = (MARKS[0] * (1 + number), MARKS[1]), PRESSURE_LINES[number % len(PRESSURE_LINES)]
        for branch in values.T:
            for axes, part in ((real, branch.real), (frequency, frequency_hz(branch))):
                inside = np.where(branch.imag > 0, part, np.nan) if axes is frequency else part
                low, high = axes.get_ylim()
                seen = np.where((inside > 2 * low - high) & (inside < 2 * high - low), inside, np.nan)
                if not np.isnan(seen).all():
                    axes.plot(path.speeds, seen, linestyle=line, markevery=every, **style)
                    if mode not in shown:
                        (shown[mode],) = real.plot([], [], linestyle="-", **style)


def highest_wobble(results: list[Result]) -> float:
    """Largest imaginary part of wobble and weave, rad/s: where the interesting part of a figure ends."""
    parts = [
        np.nanmax(result.modes.branches[mode].imag)
        for result in results for mode in ("wobble", "weave") if mode in result.modes.branches
    ]  # fmt: skip
    return float(max(parts, default=100.0))
