"""The plane of a chart, two numbers of a model over the unit square, and the marks in it."""

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.model.eigen import eigensystem, eigenvalues
from bicycle.model.wheel_tyres import tyre_loads
from bicycle.parameters.bicycle import canonical
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey
from bicycle.stability.naming import check_trackable, speed_unit
from studies.model_space.axes import SPEED, Axis, typical_range, unit_of
from studies.model_space.changed_model import ModelSpace
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import TINY, InputError
from tyre.ground.number_with_unit import typed_numbers
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.find_tyre import read_tyre
from tyre.maps.map_files import available_tyres
from tyre.measured.properties import out_of_reach

SLOW, FAST = 1.0, 25.0  # m/s, where no range of the speed is given
NOISE = 1e-9  # of the largest root: a real part smaller than this is zero
HOW = "give NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:log, for example front_compliance.stiffness=1000:10000"


@dataclass(frozen=True)
class Span:
    """An axis from ``low`` to ``high`` (in its unit), in equal steps or, if ``log``, in equal ratios."""

    axis: Axis  # key, unit and title of the number
    low: float  # in the unit of the axis
    high: float  # likewise
    log: bool = False  # True: equal ratios

    def at(self, share: Any) -> Any:
        """Values at each ``share`` of the way, 0 to 1, any shape."""
        if self.log:
            return self.low * (self.high / self.low) ** np.asarray(share)
        return self.low + (self.high - self.low) * np.asarray(share)

    def slope(self, share: Any) -> Any:
        """Derivative of the value with the ``share`` of the way, 0 to 1, any shape."""
        if self.log:
            return self.at(share) * np.log(self.high / self.low)
        return np.full(np.shape(share), self.high - self.low)

    def share(self, value: Any) -> Any:
        """Share of the way of each ``value``, any shape, in the unit of the axis."""
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                return np.log(np.asarray(value) / self.low) / np.log(self.high / self.low)
        return (np.asarray(value) - self.low) / (self.high - self.low)


def split_range(text: str) -> tuple[str, tuple[float, float] | None, bool]:
    """Split a ``text`` such as ``c=0.02:0.1:log`` or ``c``: name, range (unit of the axis) or None, equal ratios."""
    name, equals, range_text = text.partition("=")
    if not name or (equals and not range_text):
        raise InputError(f"axis {text!r}: {HOW}")
    if not equals:
        return name, None, False
    parts = range_text.split(":")
    log = len(parts) == 3 and parts[2] == "log"
    numbers = typed_numbers(parts[:2] if log else parts, unit_of(canonical(name)))
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise InputError(f"axis {text!r}: {HOW}; the range must be finite, LOW below HIGH (below {TINY:g} is 0)")
    low, high = numbers
    if log and low <= 0:
        raise InputError(f"axis {text!r}: equal ratios need a range above 0")
    return name, (low, high), log


class Look(NamedTuple):
    """Roots (m, n) in 1/s at m points, their derivatives (m, n, 2) with the shares of both axes, and the matrices."""

    values: Complex  # (m, n), 1/s
    gradients: Complex  # (m, n, 2), 1/s, with the shares
    matrices: Array  # (m, n, n), state matrices
    slopes: Array  # (m, 2, n, n), derivatives of the matrices with the shares


class Plane:
    """Two numbers of a model over the unit square, at a ``speed`` (m/s) unless it is one of them."""

    def __init__(self, space: ModelSpace, spans: tuple[Span, Span], speed: float | None = None) -> None:
        self.space, self.spans, self.speed = space, spans, speed

    @classmethod
    def of(cls, content: Any, x: str, y: str, *, speed: float | None = None) -> "Plane":
        """Make the plane of two axes written as NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:log, at ``speed`` (m/s)."""
        parsed = [split_range(text) for text in (x, y)]
        names = [canonical(name) for name, _, _ in parsed]
        if names[0] == names[1]:
            raise InputError(f"both axes are {names[0]}; give two different ones")
        if SPEED in names and speed is not None:
            raise InputError(f"--speed {speed:g} is given, but the speed is an axis; leave --speed out")
        if SPEED not in names and speed is None:
            raise InputError("no axis is the speed: give the --speed (m/s) of the chart, or --x speed")
        space = ModelSpace(content, names)
        space.refuse_switches()
        spans = [_span(space, axis, ends, log=log) for axis, (_, ends, log) in zip(space.axes, parsed, strict=True)]
        plane = cls(space, (spans[0], spans[1]), speed)
        corners = lattice(np.array([0.0, 1.0]), np.array([0.0, 1.0]))
        speeds = plane.speeds(corners)
        space.linear.check_speeds(speeds)
        space.refuse_impossible(plane.x(lattice(np.linspace(0, 1, 9), np.linspace(0, 1, 9))))
        for end in plane.x(corners):
            check_trackable(space.linear_at(end), np.unique(speeds))
        return plane

    def x(self, shares: Array) -> Array:
        """Convert ``shares`` (m, 2), 0 to 1, to values (m, 2) in the units of the axes."""
        return np.stack([span.at(shares[:, i]) for i, span in enumerate(self.spans)], -1)

    def speeds(self, shares: Array) -> Array:
        """Speed (m,) in m/s at points given as shares (m, 2), 0 to 1."""
        for i, span in enumerate(self.spans):
            if span.axis.key == SPEED:
                return np.asarray(span.at(shares[:, i]))
        return np.full(len(shares), float(self.speed or 0.0))

    def scale(self, shares: Array) -> Array:
        """Derivatives (m, 2) of the values with the shares of the axes."""
        return np.stack([span.slope(shares[:, i]) for i, span in enumerate(self.spans)], -1)

    def look(self, shares: Array) -> Look:
        """Compute roots and their derivatives at points given as shares (m, 2), 0 to 1."""
        matrices, slopes = self.space.matrices_and_slopes(self.x(shares), self.speed)
        slopes = slopes * self.scale(shares)[..., None, None]
        values, right, left = eigensystem(matrices)
        gradients = np.stack([((left @ slopes[:, i]).swapaxes(1, 2) * right).sum(1) for i in (0, 1)], -1)
        return Look(values, gradients, matrices, slopes)

    def unstable(self, shares: Array) -> NDArray[np.intp]:
        """Count the unstable roots (m,) at points given as shares (m, 2), 0 to 1."""
        roots = eigenvalues(self.space.matrices(self.x(shares), self.speed))
        return np.asarray((roots.real > NOISE * np.abs(roots).max(1, keepdims=True)).sum(1))


def lattice(first: Array, second: Array) -> Array:
    """List the points (k l, 2) of a grid of ``first`` (k,) and ``second`` (l,), the second running fastest."""
    return np.stack(np.meshgrid(first, second, indexing="ij"), -1).reshape(-1, 2)


def speed_of_rest(space: ModelSpace) -> float:
    """Lowest speed of a chart, m/s: below it undamped pairs lie on the imaginary axis at any value."""
    return 1e-3 * speed_unit(space.linear)  # of sqrt(g w): slower is rest, where undamped pairs lie on the axis


def _span(space: ModelSpace, axis: Axis, span: tuple[float, float] | None, *, log: bool) -> Span:
    low, high = usual_range(space, axis) if span is None else span
    if axis.key == SPEED:
        slowest = speed_of_rest(space)
        if low < 0:
            raise InputError(f"speed {low:g} m/s is not allowed; give speeds >= 0 m/s")
        low = max(low, slowest)
        if high <= low:
            raise InputError(f"speed up to {high:g} m/s: nothing moves below {slowest:.2g} m/s; give a range of speeds")
    return Span(axis, low, high, log)


def usual_range(space: ModelSpace, axis: Axis) -> tuple[float, float]:
    """Choose the range of an axis, in its unit, where none is stated: measured of a tyre, else typical."""
    if axis.key == SPEED:
        return SLOW, FAST
    if not axis.wheels:
        return typical_range(space.model, axis)
    assert space.tyres is not None
    sources = [space.tyres.sources[wheel] for wheel in axis.wheels]
    if axis.condition == "load_N":
        low = max(s.load_range[0] for s in sources)
        high = min(s.load_range[1] for s in sources)
    else:
        low = max(s.pressure_range[0] for s in sources) / PASCAL_PER_BAR
        high = min(s.pressure_range[1] for s in sources) / PASCAL_PER_BAR
    if not (0 < low < high < np.inf):
        raise InputError(f"{axis.key}: the tyre states no range; give one, {axis.key}=LOW:HIGH")
    return low, high


MODEL, PRESSURE, LOAD, TYRE = "model", "measured pressure", "measured load", "measured tyre"
OF_A_TYRE = ("cornering_stiffness", "relaxation_length")  # parameters of contact laws that are properties of a tyre


@dataclass(frozen=True)
class Mark:
    """A point, or a line where one coordinate is NaN, in the units of the axes; ``kind`` begins with one above."""

    kind: str  # MODEL, PRESSURE or LOAD; TYRE and the wheel whose load it has
    label: str  # words beside the mark
    x: float  # in the unit of the first axis; NaN: a line at ``y``
    y: float  # in the unit of the second axis; NaN: a line at ``x``


def marks(plane: Plane) -> list[Mark]:
    """Everything to be marked that lies within the ranges of a chart."""
    space, base = plane.space, plane.space.base.tolist()
    candidates = [Mark(MODEL, "the model as it stands", *base)]
    for i, axis in enumerate(space.axes):
        sources = [space.tyres.sources[wheel] for wheel in axis.wheels] if space.tyres is not None else []
        for source in {tyre.label: tyre for tyre in sources if not tyre.synthetic}.values():
            bars = axis.condition == "pressure_bar"
            kind, values = (PRESSURE, source.pressures / PASCAL_PER_BAR) if bars else (LOAD, source.loads)
            for value in values.tolist():
                place = [value if k == i else coordinate for k, coordinate in enumerate(base)]
                candidates.append(Mark(kind, f"{source.tyre} {value:g} {axis.unit}", *place))
    candidates += _tyres(space, base)
    within_ranges = []
    for mark in dict.fromkeys(candidates):
        within = [s.low <= x <= s.high for s, x in zip(plane.spans, (mark.x, mark.y), strict=True) if not math.isnan(x)]
        if within and all(within):
            within_ranges.append(mark)
    return within_ranges


def _tyres(space: ModelSpace, base: list[float]) -> list[Mark]:
    """Mark packaged and named tyres, at the load of their wheel, on axes that are properties of a tyre."""
    keys = [ParameterKey.parse(axis.key) for axis in space.axes]
    properties = [key.name if key.effect and key.name in OF_A_TYRE else "" for key in keys]
    if not any(properties) or (all(properties) and keys[0].wheel != keys[1].wheel):
        return []
    wheel = next(key.wheel for key, name in zip(keys, properties, strict=True) if name) or WHEELS[1]
    load = dict(zip(WHEELS, tyre_loads(space.model.effects, space.model.parameters), strict=True))[wheel]
    sources = [] if space.tyres is None else list(space.tyres.sources.values())
    marks = []
    for name in available_tyres():
        with suppress(InputError):  # not measured on a flat surface
            sources.append(read_tyre(name, surface="flat"))
    for source in {tyre.label: tyre for tyre in sources if not tyre.synthetic}.values():
        for pressure in source.pressures.tolist():
            if not out_of_reach(source, load=load, pressure=pressure):
                condition = source.at(load=load, pressure=pressure)
                x, y = (
                    getattr(condition, name) if name else value for name, value in zip(properties, base, strict=True)
                )
                is_missing = [name and (v is None or math.isnan(v)) for name, v in zip(properties, (x, y), strict=True)]
                if not any(is_missing) and x is not None and y is not None:
                    label = f"{source.tyre} {pressure / PASCAL_PER_BAR:g} bar"
                    marks.append(Mark(f"{TYRE}, {wheel} wheel's load", label, float(x), float(y)))
    return marks
