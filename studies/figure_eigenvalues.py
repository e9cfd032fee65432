"""Eigenvalues of named modes against speed, and their path in the complex plane."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.main_study import Study
from studies.main_study_cases import Setup
from studies.main_study_solve import Result
from studies.plotting import drawing, extrapolated_note, hatch_extrapolated, mode_look

PRESSURE_LINES = ("-", (0, (5, 2)), (0, (1, 1.2)))
PRESSURE_MARKERS = ("o", "s", "^")
REAL_RANGE = (-35.0, 9.0)  # 1/s; what lies further left is fast and well damped
HEADROOM = 1.12


def draw_eigenvalues(study: Study, setup: Setup, target: Path) -> Path:
    """Real and imaginary part against speed; a column per tyre and surface, a colour per mode, a line per pressure."""
    speeds = study.settings.speeds
    with drawing(target, width=12.5, height=6.6) as canvas:
        grid = canvas.subplots(2, len(study.names), sharex=True, sharey="row", squeeze=False)
        lines: dict[str, Any] = {}
        for column, name in enumerate(study.names):
            real, imaginary = grid[:, column]
            results = study.of(setup, name)
            for number, result in enumerate(results):
                for mode, values in result.modes.branches.items():
                    style = {"color": mode_look(mode).colour, "linestyle": PRESSURE_LINES[number % 3], "linewidth": 1.4}
                    for branch in values[: len(speeds)].T:
                        real.plot(speeds, branch.real, **style)
                        imaginary.plot(speeds, np.where(branch.imag > 0, branch.imag, np.nan), **style)
                    (lines[mode.replace("_", " ")],) = real.plot([], [], color=mode_look(mode).colour)
            real.axhspan(0, REAL_RANGE[1], color="#f6dedb", zorder=0)
            real.set_title(name)
            imaginary.set_xlabel("Speed, m/s")
            for axes in (real, imaginary):
                hatch_extrapolated(axes, any(result.case.extrapolated for result in results))
        grid[0, 0].set(ylabel="Real part, 1/s (shaded: unstable)", ylim=REAL_RANGE, xlim=(speeds[0], speeds[-1]))
        grid[1, 0].set(ylabel="Imaginary part, rad/s", ylim=(0, highest_wobble(study.of(setup)) * HEADROOM))
        for number, result in enumerate(study.of(setup, study.names[0])):
            (line,) = grid[0, 0].plot([], [], color="0.2", linestyle=PRESSURE_LINES[number % 3])
            lines[f"{result.case.pressure_bar:g} bar"] = line
        canvas.legend(lines.values(), lines.keys(), loc="outside lower center", ncols=len(lines))
        note = extrapolated_note(any(result.case.extrapolated for result in study.of(setup)))
        canvas.suptitle(f"{study.settings.bicycle.name}: {setup.label}{note}", x=0.01, ha="left")
    return target


def draw_root_locus(study: Study, setup: Setup, target: Path) -> Path:
    """Eigenvalues in the complex plane, coloured by speed; a panel per tyre and surface, a marker per pressure."""
    speeds = study.settings.speeds
    with drawing(target, width=12.5, height=4.9) as canvas:
        row = canvas.subplots(1, len(study.names), sharex=True, sharey=True, squeeze=False)[0]
        row[0].set(ylabel="Imaginary part, rad/s", xlim=(2 * REAL_RANGE[0], 2 * REAL_RANGE[1]),
                   ylim=(0, highest_wobble(study.of(setup)) * HEADROOM))  # fmt: skip
        for axes, name in zip(row, study.names, strict=True):
            results = study.of(setup, name)
            ends = [(0, results[0]), (len(results) - 1, results[-1])] if len(results) > 1 else [(0, results[0])]
            for number, result in ends:
                for mode, values in result.modes.branches.items():
                    for branch in values[: len(speeds)].T:
                        shown = branch.imag > 0
                        axes.scatter(
                            branch.real[shown], branch.imag[shown], c=speeds[shown], s=11, cmap="viridis", linewidths=0,
                            vmin=speeds[0], vmax=speeds[-1], marker=PRESSURE_MARKERS[number % 3],
                        )  # fmt: skip
                    if number == 0:
                        _name_mode(axes, mode, values[: len(speeds), 0])
                axes.scatter([], [], color="0.3", marker=PRESSURE_MARKERS[number % 3], s=16,
                             label=f"{result.case.pressure_bar:g} bar")  # fmt: skip
            axes.axvline(0, color="0.2", linewidth=1)
            axes.set_title(name)
            axes.set_xlabel("Real part, 1/s")
            hatch_extrapolated(axes, any(result.case.extrapolated for result in results))
        handles, labels = row[0].get_legend_handles_labels()
        canvas.legend(handles, labels, loc="outside lower center", ncols=len(labels))
        canvas.colorbar(axes.collections[0], ax=row, label="Speed, m/s", pad=0.01)
        note = extrapolated_note(any(result.case.extrapolated for result in study.of(setup)))
        canvas.suptitle(f"{study.settings.bicycle.name}: {setup.label}{note}", x=0.01, ha="left")
    return target


def highest_wobble(results: list[Result]) -> float:
    """Largest imaginary part of wobble and weave, rad/s: where the interesting part of a figure ends."""
    parts = [
        np.nanmax(result.modes.branches[mode].imag)
        for result in results for mode in ("wobble", "weave") if mode in result.modes.branches
    ]  # fmt: skip
    return float(max(parts, default=100.0))


def _name_mode(axes: Any, mode: str, branch: Any) -> None:
    """Write the name of a mode at the fast end of its path, else at the slow end, where that lies in the picture."""
    path = branch[branch.imag > 0]
    if len(path) < len(branch) // 3:
        return
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    for end, shift, align in ((path[-1], (7, -2), "left"), (path[0], (-4, 6), "right")):
        if low < end.real < high and bottom < end.imag < top:
            axes.annotate(
                mode.replace("_", " "), (end.real, end.imag), shift, textcoords="offset points", fontsize=8.5, ha=align,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8},
            )  # fmt: skip
            return
