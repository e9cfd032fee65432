"""Paths of the eigenvalues in the complex plane as the speed grows, with the real roots spread out by mode."""

from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import angular_frequency, frequency_hz
from bicycle.modal.named_modes import Modes
from studies.main_study.figure_eigenvalues import HEADROOM, REAL_RANGE, TITLE, highest_wobble, panels_width
from studies.main_study.paths import paths
from studies.main_study.settings import Setup
from studies.main_study.study import Study
from studies.reporting.plotting import UNSTABLE, drawing, extrapolated_note, hatch_extrapolated, mode_words
from tyre.base.arrays import Array

PRESSURE_MARKERS = ("o", "s", "^", "D", "v")
WINDOW = (2 * REAL_RANGE[0], 2 * REAL_RANGE[1])
SPREAD = 0.27  # of the outer pressures from the middle of a row of real roots
AXIS = 0.05  # of the height of the window: lower paths are not named in it
CHARACTER, LINE = 0.027, 0.055  # of the panel, what a letter and a line of a label take


def draw_speed_locus(study: Study, setup: Setup, target: Path) -> Path:
    """Complex plane into ``target``, coloured by speed, a panel per tyre and surface, a marker per pressure.

    Below each panel the roots on the real axis, a row per mode; what never enters the window is named in its title.
    """
    speeds = study.settings.speeds
    found = {name: [(r.case.condition, paths(r, speeds)) for r in study.of(setup, name)] for name in study.names}
    rows = real_modes([path for one in found.values() for _, path in one])
    height = 0.34 * len(rows)
    with drawing(target, width=panels_width(study), height=5.2 + height) as canvas:
        grid = canvas.subplots(
            2, len(found), sharex=True, sharey="row", squeeze=False, gridspec_kw={"height_ratios": (4.0, height + 0.1)}
        )
        top = highest_wobble(study.of(setup)) * HEADROOM
        grid[0, 0].set(ylabel="Imaginary part, rad/s", xlim=WINDOW, ylim=(-0.02 * top, top))
        grid[1, 0].set(ylim=(len(rows) - 0.5, -0.5), ylabel="Real roots")
        grid[1, 0].set_yticks(range(len(rows)), [mode_words(mode) for mode in rows])
        for (plane, real), (name, results) in zip(grid.T, found.items(), strict=True):
            labels: list[tuple[str, float, float]] = []
            for condition, path in results:
                number = study.conditions.index(condition)
                _plane(plane, path, number, speeds, top)
                _real(real, path, number, rows, speeds, 2 * SPREAD * (number / max(len(study.conditions) - 1, 1) - 0.5))
                written = {mode for mode, _, _ in labels}
                labels += [place for place in label_places(path, top) if place[0] not in written]
            _write(plane, labels)
            unseen = unseen_modes([path for _, path in results], top)
            plane.set_title(fill(name, TITLE))
            if unseen:
                words = "beyond the window:\n" + ",\n".join(mode_words(mode) for mode in unseen)
                plane.set_title(words, loc="right", fontsize=7, fontweight="normal", color="0.3")
            real.set_xlabel("Real part, 1/s")
            for axes in (plane, real):
                axes.axvspan(0, WINDOW[1], color=UNSTABLE, zorder=0)
                axes.axvline(0, color="0.2", linewidth=1, zorder=1)
                hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in study.of(setup, name)))
        hertz = grid[0, -1].secondary_yaxis(
            "right", functions=(lambda w: frequency_hz(1j * np.asarray(w)), angular_frequency)
        )
        hertz.set_ylabel("Frequency, Hz")
        for number, condition in enumerate(study.conditions):
            marker = PRESSURE_MARKERS[number % len(PRESSURE_MARKERS)]
            grid[0, 0].scatter([], [], color="0.3", marker=marker, s=16, label=condition)
        handles, words = grid[0, 0].get_legend_handles_labels()
        canvas.legend(handles, words, loc="outside lower center", ncols=len(words))
        canvas.colorbar(grid[0, 0].collections[0], ax=grid, label="Speed, m/s", pad=0.01)
        note = extrapolated_note(extrapolated=any(result.case.extrapolated for result in study.of(setup)))
        canvas.suptitle(f"{study.settings.bicycle.name}: {setup.label}; shaded: unstable{note}", x=0.01, ha="left")
    return target


def real_modes(found: list[Modes]) -> list[str]:
    """Names of the modes with a root on the real axis in the window, in the order of the modes."""
    names = dict.fromkeys(name for path in found for name in path.branches)
    return [
        name for name in sorted(names, key=lambda name: name.count("+"))
        if any(
            (_on_axis(path.branches[name]) & (path.branches[name].real > WINDOW[0])).any()
            for path in found if name in path.branches
        )
    ]  # fmt: skip


def _on_axis(values: Any) -> Any:
    return (values.imag == 0) & ~np.isnan(values.real)


def _scatter(axes: Any, x: Any, y: Any, at: Array, number: int, speeds: Array) -> None:
    axes.scatter(
        x, y, c=at, s=9, cmap="viridis", linewidths=0, vmin=speeds[0], vmax=speeds[-1], zorder=3,
        marker=PRESSURE_MARKERS[number % len(PRESSURE_MARKERS)],
    )  # fmt: skip


def _plane(axes: Any, path: Modes, number: int, speeds: Array, top: float) -> None:
    roots = np.concatenate([branch for values in path.branches.values() for branch in values.T])
    at = np.tile(path.speeds, len(roots) // len(path.speeds))
    there = (_on_axis(roots) & (roots.real > WINDOW[0]) & (roots.real < WINDOW[1])) | _seen(roots, top)
    _scatter(axes, roots.real[there], roots.imag[there], at[there], number, speeds)


def _real(axes: Any, path: Modes, number: int, rows: list[str], speeds: Array, beside: float) -> None:
    for row, mode in enumerate(rows):
        for branch in path.branches[mode].T if mode in path.branches else ():
            there = _on_axis(branch) & (branch.real > WINDOW[0]) & (branch.real < WINDOW[1])
            height = np.full(int(there.sum()), row + beside)
            _scatter(axes, branch.real[there], height, path.speeds[there], number, speeds)


def unseen_modes(found: list[Modes], top: float) -> list[str]:
    """Oscillations of the paths ``found`` that never enter the window up to ``top``, rad/s."""
    moving = {mode for path in found for mode, values in path.branches.items() if (values.imag > 0).any()}
    shown = {mode for path in found for mode, values in path.branches.items() if _seen(values, top).any()}
    return sorted(moving - shown)


def label_places(path: Modes, top: float) -> list[tuple[str, float, float]]:
    """Mode and place of every name to write: the fastest point of each stretch of an oscillation inside the window.

    The window ends at ``top``, rad/s. A stretch that hugs the real axis is named there, by its row of real roots.
    """
    places = []
    for mode, values in path.branches.items():
        root = values[:, 0]
        seen = _seen(root, top)
        for k in np.flatnonzero(seen & ~np.append(seen[1:], False)):
            start = int(np.flatnonzero(~seen[:k]).max(initial=-1)) + 1
            if root[start : k + 1].imag.max() > AXIS * top:
                places.append((mode, float(root[k].real), float(root[k].imag)))
    return places


def _seen(root: Any, top: float) -> Any:
    return (root.imag > 0) & (root.real > WINDOW[0]) & (root.real < WINDOW[1]) & (root.imag < top)


def _write(axes: Any, labels: list[tuple[str, float, float]]) -> None:
    """Names beside their paths, pushed down where they would overlap."""
    (low, high), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    taken: list[tuple[float, float, float]] = []
    for mode, x, y in sorted(labels, key=lambda place: -place[2]):
        words = mode_words(mode)
        size, at = CHARACTER * len(words), (x - low) / (high - low)
        left = at + 0.03 if at + 0.03 + size < 1 else max(at - 0.03 - size, 0.02)
        height = min((y - bottom) / (top - bottom), 0.96)
        while any(left < end and start < left + size and abs(height - other) < LINE for start, end, other in taken):
            height -= LINE / 4
        taken.append((left, left + size, height))
        axes.text(
            left, height, words, transform=axes.transAxes, fontsize=8.5, va="center", zorder=5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.8},
        )  # fmt: skip
