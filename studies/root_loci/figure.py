"""Root locus as a figure: complex plane with damping-ratio grid, and real part and frequency against the parameter."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.oscillation import angular_frequency, frequency_hz, oscillating
from bicycle.modal.known_modes import known_modes
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import UNITS
from studies.reporting.plotting import GREY, Look, drawing, hatch_extrapolated, mode_look
from studies.root_loci.root_locus import RootLocus
from tyre.base.arrays import Array

RATIOS = (0.05, 0.1, 0.2, 0.4, 0.7)
ARROWS = (0.3, 0.7)  # of the length of a branch in view
SHORTEST = 0.05  # of the width of the figure: shorter branches carry one arrow or none
UNSTABLE = "#f6dedb"


def draw_root_locus(locus: RootLocus, target: Path, *, title: str, max_frequency_hz: float | None = None) -> Path:
    """Complex plane (upper half) on the left, real part and frequency against the parameter on the right.

    Shown up to ``max_frequency_hz`` (Hz), by default a little above weave, wobble, capsize, what effects declare as
    ``main`` modes, and every crossing.

    Parameters
    ----------
    locus : RootLocus
    target : Path
        Without ending.
    title : str
    max_frequency_hz : float, optional
    """
    with drawing(target, width=11.5, height=6.4) as canvas:
        grid = canvas.add_gridspec(2, 2, width_ratios=(1.7, 1))
        plane, real = canvas.add_subplot(grid[:, 0]), canvas.add_subplot(grid[0, 1])
        frequency = canvas.add_subplot(grid[1, 1], sharex=real)
        limits = _limits(locus, max_frequency_hz)
        _plane(plane, limits)
        for i, name in enumerate(locus.names):
            if (locus.eigenvalues[:, i].imag < 0).all():
                continue  # the lower half of a pair
            _branch(locus, i, name, plane, real, frequency, limits)
        for crossing in locus.crossings:
            style = {"marker": "*", "color": "black", "markersize": 10, "linestyle": "none", "zorder": 6}
            plane.plot(0, angular_frequency(crossing.frequency_hz), **style)
            real.plot(crossing.value, 0, **style)
            frequency.plot(crossing.value, crossing.frequency_hz, **style)
        _label_crossings(plane, locus, limits)
        real.axhspan(0, 1e6, color=UNSTABLE, zorder=0)
        real.set(ylabel="Real part, 1/s", ylim=(max(limits[0], -limits[3] / 3), limits[1]))
        frequency.set(
            ylabel="Frequency, Hz", xlabel=f"{_said(locus.key)}, {locus.unit}", ylim=(0, frequency_hz(1j * limits[3]))
        )
        real.set_xlim(locus.values[0], locus.values[-1])
        real.tick_params(labelbottom=False)
        for axes in (real, frequency):
            _hatch_outside(axes, locus)
        if not locus.inside.all():
            frequency.legend(loc="center right", fontsize=7.5, frameon=True, edgecolor="none")
        hatch_extrapolated(plane, extrapolated=not locus.inside.any())
        handles, labels = _legend(plane, locus)
        canvas.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
        canvas.suptitle(title, x=0.01, ha="left")
    return target


def line_look(name: str) -> Look:
    """The look of the line of mode ``name``; some have another dash then, which markers would tell apart."""
    look = mode_look(name)
    return look._replace(line=look.bare or look.line)


def _limits(locus: RootLocus, max_frequency_hz: float | None) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of the window; real roots far left of it are cut off."""
    known = known_modes()
    main = [name in known and known[name].main for name in locus.names]
    roots = locus.eigenvalues[:, main] if locus.eigenvalues[:, main].imag.any() else locus.eigenvalues
    top = (
        1.15 * (roots.imag.max() or np.abs(roots).max())
        if max_frequency_hz is None
        else float(angular_frequency(max_frequency_hz))
    )
    if max_frequency_hz is None:
        top = max(top, 1.15 * max((float(angular_frequency(c.frequency_hz)) for c in locus.crossings), default=0.0))
    below = locus.eigenvalues[locus.eigenvalues.imag <= top].real
    left = min(max(1.08 * below.min(), -0.75 * top), -0.1 * top)
    return left, max(1.25 * min(below.max(), top), -0.15 * left), -0.035 * top, top


def _plane(axes: Any, limits: tuple[float, float, float, float]) -> None:
    left, right, bottom, top = limits
    axes.set(
        xlim=(left, right),
        ylim=(bottom, top),
        xlabel="Real part, 1/s (shaded: unstable)",
        ylabel="Imaginary part, rad/s",
    )
    axes.grid(False)
    axes.axvspan(0, right, color=UNSTABLE, zorder=0)
    axes.axvline(0, color="0.2", linewidth=1)
    axes.axhline(0, color="0.2", linewidth=0.6)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    quiet = {"fontsize": 7.5, "color": GREY, "zorder": 1.5, "bbox": box, "ha": "center", "va": "center"}
    taken = (0.0, 0.0)
    for ratio in RATIOS:
        slope = np.sqrt(1 - ratio**2) / ratio
        end = min(-0.93 * left, 0.97 * top / slope)
        here = (end / (right - left), end * slope / top)
        if max(abs(here[0] - taken[0]) / 1.8, abs(here[1] - taken[1])) < 0.04:
            continue  # no room for its label
        taken = here
        axes.plot([0, -end], [0, end * slope], color="0.78", linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
        axes.text(-end, end * slope, f"ζ = {ratio:g}", **quiet)
    angle = np.linspace(0, np.pi / 2, 90)
    for hertz in _round_steps(0.97 * float(frequency_hz(1j * top))):
        radius = angular_frequency(hertz)
        axes.plot(-radius * np.sin(angle), radius * np.cos(angle), color="0.85", linewidth=0.7, zorder=1)
        axes.text(
            0.98 * right, radius, f"{hertz:g} Hz", **{**quiet, "ha": "right", "bbox": {**box, "facecolor": UNSTABLE}}
        )


def _branch(
    locus: RootLocus, i: int, name: str, plane: Any, real: Any, frequency: Any, limits: tuple[float, ...]
) -> None:
    root, style = locus.eigenvalues[:, i], line_look(name)
    shown = np.where(root.imag >= 0, root, np.nan)
    line = {"color": style.colour, "linestyle": style.line}
    visible = any(_in(one, limits) for one in locus.eigenvalues[:, [other == name for other in locus.names]].flat)
    label = name.replace("_", " ") + ("" if visible else " (out of view)")
    plane.plot(shown.real, shown.imag, label=label, zorder=3, **line)
    real.plot(locus.values, shown.real, **line)
    frequency.plot(locus.values, frequency_hz(oscillating(root)), **line)
    for k, marker in ((0, "x"), (-1, "o")):
        if root[k].imag >= 0:
            filled = {"markerfacecolor": "white", "markeredgewidth": 1.3} if marker == "o" else {"markeredgewidth": 1.6}
            plane.plot(root[k].real, root[k].imag, marker, color=style.colour, zorder=5, **filled)
    _arrows(plane, shown, style.colour, limits)


def _arrows(axes: Any, root: NDArray[np.complex128], colour: str, limits: tuple[float, ...]) -> None:
    """Arrow heads in the direction in which the parameter grows, at fixed shares of the visible length."""
    left, right, bottom, top = limits
    x, y = (root.real - left) / (right - left), (root.imag - bottom) / (top - bottom)
    visible = np.isfinite(x) & (x > 0) & (x < 1) & (y < 1)
    step = np.where(visible[1:] & visible[:-1], np.hypot(np.diff(x), np.diff(y)), 0.0)
    length = np.concatenate([[0.0], np.cumsum(np.nan_to_num(step))])
    if length[-1] < SHORTEST:
        return
    for share in ARROWS if length[-1] > 4 * SHORTEST else (0.5,):
        k = int(np.clip(np.searchsorted(length, share * length[-1]), 1, len(root) - 1))
        axes.annotate(
            "", (root.real[k], root.imag[k]), (root.real[k - 1], root.imag[k - 1]), zorder=4,
            arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 13, "shrinkA": 0, "shrinkB": 0},
        )  # fmt: skip


def _label_crossings(axes: Any, locus: RootLocus, limits: tuple[float, ...]) -> None:
    """Parameter values beside the stars, pushed apart where they would overlap."""
    gap, lowest = 0.045 * (limits[3] - limits[2]), -np.inf
    for crossing in sorted(locus.crossings, key=lambda c: c.frequency_hz):
        omega = float(angular_frequency(crossing.frequency_hz))
        height = max(omega + 0.3 * gap, lowest + gap)
        lowest = height
        axes.annotate(
            f"{crossing.value:.4g} {locus.unit}", (0, omega), (-0.025 * (limits[1] - limits[0]), height),
            ha="right", va="center", fontsize=8.5, zorder=7,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
        )  # fmt: skip


def _legend(axes: Any, locus: RootLocus) -> tuple[list[Any], list[str]]:
    found = dict(sorted(zip(*axes.get_legend_handles_labels()[::-1], strict=True), key=lambda item: item[0]))
    marks = (("x", "start of the range"), ("o", "end"), *[("*", "crosses the axis")][: len(locus.crossings)])
    for marker, label in marks:
        (found[label],) = axes.plot(
            [], [], marker, color="black", markerfacecolor="white" if marker == "o" else "black"
        )
    return list(found.values()), list(found)


def _hatch_outside(axes: Any, locus: RootLocus) -> None:
    """Hatch the values at which the tyre is extrapolated."""
    if locus.inside.all():
        return
    axes.fill_between(
        locus.values, 0, 1, where=~locus.inside, transform=axes.get_xaxis_transform(), facecolor="none", hatch="//",
        edgecolor="0.8", linewidth=0, zorder=0.5, label="tyre values extrapolated",
    )  # fmt: skip


def _said(key: str) -> str:
    """``relaxation_length.relaxation_length.front`` -> "Relaxation length front"."""
    own = ParameterKey.parse(key)
    parts = (own.effect, own.name.removesuffix("_bar").removesuffix("_N"), own.wheel)
    text = " ".join(dict.fromkeys(part for part in parts if part)).replace("_", " ")
    return text if text in UNITS else text[0].upper() + text[1:]


def _in(root: complex, limits: tuple[float, ...]) -> bool:
    return bool(limits[0] <= root.real <= limits[1] and 0 <= root.imag <= limits[3])


def _round_steps(highest: float) -> Array:
    """Frequencies in round steps up to ``highest`` Hz, about five of them."""
    rough = highest / 5
    base = 10.0 ** np.floor(np.log10(rough))
    step = base * min((1, 2, 5, 10), key=lambda m: abs(np.log(m * base / rough)))
    return np.arange(1, int(highest / step + 1e-9) + 1) * step
