"""Root locus in any parameter: tracked and named branches, and the values at which a root crosses the axis."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bicycle.model.eigen import NOISE, angular_frequency, damping_ratio, frequency_hz, oscillating
from bicycle.model.model import Model
from bicycle.parameters.bicycle import canonical
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import known_modes
from bicycle.stability.tracking import branch_crossings, follow_branches
from studies.model_space.axes import OF_THE_TYRE, SPEED, Axis
from studies.model_space.changed_model import ModelSpace
from studies.model_space.model_argument import choose
from studies.reporting.plotting import GREY, Look, drawing, hatch_extrapolated, mode_look
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import TINY, InputError, unknown
from tyre.ground.number_with_unit import typed_numbers

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class ParameterPath:
    """A model as a function of one of its numbers, at a speed (m/s) unless the speed is that number."""

    space: ModelSpace  # the model over that one number
    speed: float | None  # m/s; None: the number is the speed

    @property
    def axis(self) -> Axis:
        """The parameter that is varied."""
        return self.space.axes[0]

    def matrices(self, values: Array) -> Array:
        """Scaled state matrices (m, n, n) at values (m,)."""
        bad = self.space.family.without_mass(self.space.values(values[:, None]), len(values))
        if bad.any():
            key, first = self.axis.key, values[bad][0]
            raise InputError(f"{key} = {first:g}: the mass matrix is not positive definite; take another range")
        return self.space.matrices(values[:, None], self.speed)

    def model_and_speed(self, value: float) -> tuple[Model, float]:
        """The model at a value, checked like any other, and its speed (m/s)."""
        low, high = self.axis.bounds
        if self.axis.wheels and not low < value <= high:
            value_text = f"{self.axis.key} = {value:g} {self.axis.unit}"
            raise InputError(f"{value_text} is not possible; give values above {low:g} to {high:g}")
        return self.space.model_at([value]), value if self.speed is None else self.speed


def parameter_path(model_file: str | Path | Mapping[str, Any], key: str, *, speed: float | None) -> ParameterPath:
    """Path of ``key`` through a model file, or through the content of one with absolute paths."""
    content = model_file if isinstance(model_file, Mapping) else choose(str(model_file)).content
    parameter = ParameterKey.parse(canonical(key))
    if parameter.effect in OF_THE_TYRE:
        raise InputError(f"parameter {key!r}: {unknown('wheel', parameter.name, WHEELS)}")
    space = ModelSpace(content, [str(parameter)])
    if str(parameter) == SPEED:
        return ParameterPath(space, None)
    if speed is None:
        raise InputError(f"parameter {key!r}: give the --speed (m/s) at which it is varied")
    space.linear.check_speeds(speed)
    return ParameterPath(space, speed)


@dataclass(frozen=True)
class AxisCrossing:
    """A root crosses the imaginary axis at ``value``, ``destabilising`` or not with increasing value."""

    value: float  # in the unit of the parameter
    mode: str  # name, two joined by a plus where in doubt
    frequency_hz: float  # Hz; 0: a real root
    destabilising: bool  # True: unstable above ``value``
    extrapolated: bool = False  # True: a tyre is outside of its measured range


@dataclass(frozen=True)
class RootLocus:
    """Eigenvalues (m, n) in 1/s, a column a branch called ``names[i]``, at ``values`` (m,) of ``key`` in ``unit``."""

    key: str
    unit: str
    values: Array  # (m,), in ``unit``, rising
    eigenvalues: Complex  # (m, n), 1/s
    names: tuple[str, ...]  # n
    crossings: tuple[AxisCrossing, ...]  # values at which a root crosses the imaginary axis
    requested: NDArray[np.bool_]  # (m,), False: added by the tracking, not in tables
    measured: NDArray[np.bool_]  # (m,), True: tyres are within their measured range

    def __repr__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        crossings = [f"{one.mode} {one.value:.6g}{unit}" for one in self.crossings]
        return (
            f"<RootLocus over {self.key} {self.values[0]:g} to {self.values[-1]:g}{unit}: {len(self.values)} values, "
            f"{', '.join(dict.fromkeys(self.names))}\n"
            f" crossings of the imaginary axis: {', '.join(crossings) or 'none'}>"
        )

    @property
    def unstable_throughout(self) -> tuple[str, ...]:
        """Names of the modes with a root to the right of the imaginary axis at all values."""
        unstable = (self.eigenvalues.real > NOISE * np.abs(self.eigenvalues).max(1, keepdims=True)).all(0)
        return tuple(dict.fromkeys(name for name, always in zip(self.names, unstable, strict=True) if always))

    def frame(self) -> "pd.DataFrame":
        """A row per requested value and root with Im >= 0."""
        import pandas as pd

        upper = (self.eigenvalues.imag >= 0) & self.requested[:, None]
        root = self.eigenvalues[upper]
        row, branch = np.nonzero(upper)
        column = self.key if self.key.endswith(f"_{self.unit}") else f"{self.key}_{self.unit}"
        return pd.DataFrame(
            {
                column.replace("/", "_").replace(" ", "_"): self.values[row],
                "mode": np.array(self.names)[branch],
                "real_1_s": root.real,
                "imaginary_rad_s": root.imag,
                "frequency_Hz": frequency_hz(root),
                "damping_ratio": damping_ratio(oscillating(root)),
                "tyre_inside_measured_range": self.measured[row],
            }
        )


def parse_range(text: str, unit: str = "") -> Array:
    """Values (m,) in ``unit`` from a ``text`` ``start:stop`` (200 steps) or ``start:stop:step``, both ends included."""
    how = f"range {text!r}: give start:stop or start:stop:step with start < stop and step > 0, for example 0.05:0.25"
    numbers = typed_numbers(text.split(":"), unit)
    if len(numbers) not in (2, 3):
        raise InputError(how)
    start, stop = numbers[:2]
    step = numbers[2] if len(numbers) == 3 else (stop - start) / 200
    if not np.isfinite([start, stop, step]).all() or stop <= start or step <= 0:
        raise InputError(how)
    if (stop - start) / step > 100_000:
        raise InputError(f"range {text!r}: {(stop - start) / step:.0f} values are more than 100000; take a larger step")
    inner = start + step * np.arange(int(np.ceil((stop - start) / step * (1 - 1e-12))))
    values = np.append(inner, stop)
    if (np.diff(values) <= 0).any():
        raise InputError(f"range {text!r}: its values differ by less than sixteen digits; give a wider range")
    return values


def root_locus(path: ParameterPath, values: Array) -> RootLocus:
    """Track every root along increasing ``values`` of a parameter."""
    along_speed, base = path.axis.key == SPEED, float(path.space.base[0])
    for end in (values[0], values[-1]):
        model, speed = path.model_and_speed(float(end))
        model.linear_model().check_speeds(speed)
    # names are given within the range: for the model as it stands, or where modes differ along speed
    anchor = modes(path.space.linear, values[-1:]).anchor if along_speed else base
    anchor = (values[0] + values[-1]) / 2 if np.isnan(anchor) else anchor
    anchor = float(np.clip(anchor, values[0], values[-1]))
    model, speed = path.model_and_speed(anchor)
    modes(model.linear_model(), [speed])  # refuses a model too stiff to be followed
    grid, roots = follow_branches(path.matrices, np.union1d(values, [anchor]))
    names = _name_roots(path, anchor, roots[np.searchsorted(grid, anchor)])
    crossings = []
    for crossing in branch_crossings(path.matrices, grid, roots):
        root, mode = 1j * abs(crossing.root.imag), names[crossing.branch]
        if along_speed and crossing.value > 0:  # modes that meet lose the one name of a branch beyond the meeting
            (mode,) = _name_roots(path, crossing.value, np.array([root]))
        is_measured = bool(path.space.inside([[crossing.value]])[0])
        hertz = float(frequency_hz(root))
        crossings.append(AxisCrossing(crossing.value, mode, hertz, crossing.destabilising, not is_measured))
    requested, axis = np.isin(grid, values), path.axis
    return RootLocus(
        axis.key, axis.unit, grid, roots, names, tuple(crossings), requested, path.space.inside(grid[:, None])
    )


def _name_roots(path: ParameterPath, value: float, roots: Complex) -> tuple[str, ...]:
    """Name ``roots`` (n,), 1/s, by the nearest root of the named modes at a ``value`` of the parameter."""
    model, speed = path.model_and_speed(value)
    at_value = modes(model.linear_model(), [speed])
    named = [(name, root) for name in at_value.names for root in at_value.branch(name)[0] if not np.isnan(root)]
    distance = np.abs((roots.real + 1j * np.abs(roots.imag))[:, None] - np.array([root for _, root in named]))
    return tuple(named[k][0] for k in distance.argmin(1))


RATIOS = (0.05, 0.1, 0.2, 0.4, 0.7)
ARROWS = (0.3, 0.7)  # of the length of a branch in view
SHORTEST = 0.05  # of the width of the figure: shorter branches carry one arrow or none
UNSTABLE = "#f6dedb"
FASTER = 5.0  # times the fastest main mode, up to which the window follows a mode that the parameter moves


def draw_root_locus(locus: RootLocus, target: Path, *, title: str, max_frequency_hz: float | None = None) -> None:
    """Complex plane (upper half) on the left, real part and frequency against the parameter on the right."""
    with drawing(target, width=11.5, height=6.4) as canvas:
        grid = canvas.add_gridspec(2, 2, width_ratios=(1.7, 1))
        plane, real = canvas.add_subplot(grid[:, 0]), canvas.add_subplot(grid[0, 1])
        frequency = canvas.add_subplot(grid[1, 1], sharex=real)
        limits = _window(locus, max_frequency_hz)
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
        label, top = Axis(locus.key, locus.unit).title, frequency_hz(1j * limits[3])
        frequency.set(ylabel="Frequency, Hz", xlabel=label, ylim=(0, top))
        real.set_xlim(locus.values[0], locus.values[-1])
        real.tick_params(labelbottom=False)
        if not locus.measured.all():
            for axes in (real, frequency):
                axes.fill_between(
                    locus.values,
                    0,
                    1,
                    where=~locus.measured,
                    transform=axes.get_xaxis_transform(),
                    facecolor="none",
                    hatch="//",
                    edgecolor="0.8",
                    linewidth=0,
                    zorder=0.5,
                    label="tyre values extrapolated",
                )
            frequency.legend(loc="center right", fontsize=7.5, frameon=True, edgecolor="none")
        hatch_extrapolated(plane, extrapolated=not locus.measured.any())
        handles, labels = _legend(plane, locus)
        canvas.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))
        canvas.suptitle(title, x=0.01, ha="left")


def line_look(name: str) -> Look:
    """The look of the line of mode ``name``; some have another dash where there are no markers."""
    look = mode_look(name)
    return look._replace(line=look.bare or look.line)


def _window(locus: RootLocus, max_frequency_hz: float | None) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of the window: the main modes and those that the parameter moves.

    Real roots far left of it, and roots many times faster than the main modes, are cut off.
    """
    declared = known_modes()
    main = [name in declared and declared[name].main for name in locus.names]
    roots = locus.eigenvalues[:, main] if locus.eigenvalues[:, main].imag.any() else locus.eigenvalues
    moved = locus.eigenvalues[:, _moved_modes(locus)]
    if max_frequency_hz is None:
        crossing = max((float(angular_frequency(c.frequency_hz)) for c in locus.crossings), default=0.0)
        top = 1.15 * max(roots.imag.max() or np.abs(roots).max(), crossing)
        top = max(top, min(1.15 * moved.imag.max(initial=0.0), FASTER * top))
    else:
        top = float(angular_frequency(max_frequency_hz))
    visible = locus.eigenvalues[locus.eigenvalues.imag <= top].real
    left = min(max(1.08 * visible.min(), -0.75 * top), -0.1 * top)
    left = min(left, max(1.08 * moved[moved.imag > 0].real.min(initial=0.0), -1.5 * top))
    return left, max(1.25 * min(visible.max(), top), -0.15 * left), -0.035 * top, top


def _moved_modes(locus: RootLocus) -> NDArray[np.bool_]:
    """True (n,) for the root that the parameter moves most and for all that it moves by a quarter of their size.

    The speed moves every root; there the main modes are what is looked for.
    """
    if locus.key == SPEED:
        return np.zeros(len(locus.names), bool)
    extent = np.abs(locus.eigenvalues - locus.eigenvalues[0]).max(0)
    share = extent / np.maximum(np.abs(locus.eigenvalues).max(0), TINY)
    is_largest = extent >= extent.max() * (1 - 1e-9)
    return np.asarray((is_largest & (share >= 0.05)) | (share >= 0.25))


def _plane(axes: Any, limits: tuple[float, float, float, float]) -> None:
    from matplotlib.ticker import MaxNLocator

    left, right, bottom, top = limits
    words = {"xlabel": "Real part, 1/s (shaded: unstable)", "ylabel": "Imaginary part, rad/s"}
    axes.set(xlim=(left, right), ylim=(bottom, top), **words)
    axes.grid(False)
    axes.axvspan(0, right, color=UNSTABLE, zorder=0)
    axes.axvline(0, color="0.2", linewidth=1)
    axes.axhline(0, color="0.2", linewidth=0.6)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85}
    quiet = {"fontsize": 7.5, "color": GREY, "zorder": 1.5, "bbox": box, "ha": "center", "va": "center"}
    last_label = (0.0, 0.0)
    for ratio in RATIOS:
        slope = np.sqrt(1 - ratio**2) / ratio
        end = min(-0.93 * left, 0.97 * top / slope)
        label = (end / (right - left), end * slope / top)
        if max(abs(label[0] - last_label[0]) / 1.8, abs(label[1] - last_label[1])) < 0.04:
            continue  # no room for its label
        last_label = label
        axes.plot([0, -end], [0, end * slope], color="0.78", linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
        axes.text(-end, end * slope, f"ζ = {ratio:g}", **quiet)
    angle = np.linspace(0, np.pi / 2, 90)
    highest = 0.97 * float(frequency_hz(1j * top))
    for hertz in MaxNLocator(5, steps=[1, 2, 5, 10]).tick_values(0, highest)[1:-1]:
        radius = angular_frequency(hertz)
        axes.plot(-radius * np.sin(angle), radius * np.cos(angle), color="0.85", linewidth=0.7, zorder=1)
        right_of = {**quiet, "ha": "right", "bbox": {**box, "facecolor": UNSTABLE}}
        axes.text(0.98 * right, radius, f"{hertz:g} Hz", **right_of)


def _branch(
    locus: RootLocus, i: int, name: str, plane: Any, real: Any, frequency: Any, limits: tuple[float, ...]
) -> None:
    root, style = locus.eigenvalues[:, i], line_look(name)
    upper = np.where(root.imag >= 0, root, np.nan)
    line = {"color": style.colour, "linestyle": style.line}
    of_mode = locus.eigenvalues[:, [branch_name == name for branch_name in locus.names]]
    within = (
        (limits[0] <= of_mode.real) & (of_mode.real <= limits[1]) & (of_mode.imag >= 0) & (of_mode.imag <= limits[3])
    )
    label = name.replace("_", " ") + ("" if within.any() else " (out of view)")
    plane.plot(upper.real, upper.imag, label=label, zorder=3, **line)
    real.plot(locus.values, upper.real, **line)
    frequency.plot(locus.values, frequency_hz(oscillating(root)), **line)
    for k, marker in ((0, "x"), (-1, "o")):
        if root[k].imag >= 0:
            filled = {"markerfacecolor": "white", "markeredgewidth": 1.3} if marker == "o" else {"markeredgewidth": 1.6}
            plane.plot(root[k].real, root[k].imag, marker, color=style.colour, zorder=5, **filled)
    _arrows(plane, upper, style.colour, limits)


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
            "",
            (root.real[k], root.imag[k]),
            (root.real[k - 1], root.imag[k - 1]),
            zorder=4,
            arrowprops={"arrowstyle": "-|>", "color": colour, "mutation_scale": 13, "shrinkA": 0, "shrinkB": 0},
        )


def _label_crossings(axes: Any, locus: RootLocus, limits: tuple[float, ...]) -> None:
    """Parameter values next to the stars, pushed apart where they would overlap."""
    gap, lowest = 0.045 * (limits[3] - limits[2]), -np.inf
    for crossing in sorted(locus.crossings, key=lambda c: c.frequency_hz):
        omega = float(angular_frequency(crossing.frequency_hz))
        height = max(omega + 0.3 * gap, lowest + gap)
        lowest = height
        axes.annotate(
            f"{crossing.value:.4g} {locus.unit}",
            (0, omega),
            (-0.025 * (limits[1] - limits[0]), height),
            ha="right",
            va="center",
            fontsize=8.5,
            zorder=7,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
        )


def _legend(axes: Any, locus: RootLocus) -> tuple[list[Any], list[str]]:
    handles = dict(sorted(zip(*axes.get_legend_handles_labels()[::-1], strict=True), key=lambda item: item[0]))
    marks = (("x", "start of the range"), ("o", "end"), *[("*", "crosses the axis")][: len(locus.crossings)])
    for marker, label in marks:
        face = "white" if marker == "o" else "black"
        (handles[label],) = axes.plot([], [], marker, color="black", markerfacecolor=face)
    return list(handles.values()), list(handles)
