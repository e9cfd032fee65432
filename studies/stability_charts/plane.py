"""The plane of a chart: two numbers of a model, each over a range that is the unit interval of what is computed."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import eigensystem
from bicycle.eigenvalues.solvers import eigenvalues
from bicycle.modal.naming import speed_unit
from bicycle.modal.speed_limits import check_trackable
from studies.model_axes.axis import SPEED, Axis, typical_range
from studies.model_axes.model_space import ModelSpace
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR

SLOW, FAST = 1.0, 25.0  # m/s, where no range of the speed is given
REST = 1e-3  # of sqrt(g w): slower is rest, where undamped pairs lie on the axis
NOISE = 1e-9  # of the largest root: a real part smaller than this is zero
HOW = "give NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:log, for example front_compliance.stiffness=1000:10000"


@dataclass(frozen=True)
class Span:
    """An axis from ``low`` to ``high`` (in its unit), in equal steps or, if ``log``, in equal ratios."""

    axis: Axis
    low: float
    high: float
    log: bool = False

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
    """Name, range and whether in equal ratios, of a ``text`` such as ``c=0.02:0.1`` or ``c``.

    Raises
    ------
    InputError
        Text of another form, or a range that is empty.
    """
    name, equals, rest = text.partition("=")
    if not name or (equals and not rest):
        raise InputError(f"axis {text!r}: {HOW}")
    if not equals:
        return name, None, False
    parts = rest.split(":")
    log = len(parts) == 3 and parts[2] == "log"
    try:
        low, high = (float(part) for part in (parts[:2] if log else parts))
    except ValueError:
        raise InputError(f"axis {text!r}: {HOW}") from None
    if not (np.isfinite([low, high]).all() and low < high):
        raise InputError(f"axis {text!r}: the range must be finite and rise, {HOW}")
    if log and low <= 0:
        raise InputError(f"axis {text!r}: equal ratios need a range above 0")
    return name, (low, high), log


class Look(NamedTuple):
    """Roots (m, n) in 1/s at m points, their derivatives (m, n, 2) with the shares of both axes, and the matrices."""

    values: Complex
    gradients: Complex
    matrices: Array
    slopes: Array


class Plane:
    """Two axes of a model.

    Parameters
    ----------
    space : ModelSpace
        With these two axes.
    spans : pair of Span
    speed : float, optional
        m/s; where no axis is the speed.
    """

    def __init__(self, space: ModelSpace, spans: tuple[Span, Span], speed: float | None = None) -> None:
        self.space, self.spans, self.speed = space, spans, speed

    @classmethod
    def of(cls, content: Any, x: str, y: str, *, speed: float | None = None) -> "Plane":
        """The plane of two axes as they are written.

        Parameters
        ----------
        content : mapping
            Of a model file, with absolute paths.
        x, y : str
            As of :func:`split_range`; without a range, what is usual is taken.
        speed : float, optional
            m/s; where no axis is the speed.

        Raises
        ------
        InputError
            An axis or range that the model does not allow, two equal axes, or a speed too few or too many.
        """
        given = [split_range(text) for text in (x, y)]
        names = [name for name, _, _ in given]
        if names[0] == names[1]:
            raise InputError(f"both axes are {names[0]}; give two different ones")
        if SPEED in names and speed is not None:
            raise InputError(f"--speed {speed:g} is given, but the speed is an axis; leave --speed out")
        if SPEED not in names and speed is None:
            raise InputError("no axis is the speed: give the --speed (m/s) of the chart, or --x speed")
        space = ModelSpace(content, names)
        spans = [_span(space, axis, ends, log=log) for axis, (_, ends, log) in zip(space.axes, given, strict=True)]
        plane = cls(space, (spans[0], spans[1]), speed)
        plane._check()
        return plane

    def _check(self) -> None:
        ends = self.x(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]))
        names = [axis.key for axis in self.space.axes]
        speeds = ends[:, names.index(SPEED)] if SPEED in names else np.full(1, float(self.speed or 0.0))
        self.space.linear.check_speeds(speeds)
        self.space.refuse_impossible(self.x(lattice(np.linspace(0, 1, 9), np.linspace(0, 1, 9))))
        for end in ends:
            check_trackable(self.space.linear_at(end), np.unique(speeds))

    def x(self, shares: Array) -> Array:
        """Values (m, 2) in the units of the axes.

        Parameters
        ----------
        shares : ndarray, shape (m, 2)
            0 to 1 along each axis.
        """
        return np.stack([span.at(shares[:, i]) for i, span in enumerate(self.spans)], -1)

    def speeds(self, shares: Array) -> Array:
        """Speed (m,) in m/s at points given as shares (m, 2), 0 to 1.

        Parameters
        ----------
        shares : ndarray, shape (m, 2)
        """
        for i, span in enumerate(self.spans):
            if span.axis.key == SPEED:
                return np.asarray(span.at(shares[:, i]))
        return np.full(len(shares), float(self.speed or 0.0))

    def look(self, shares: Array) -> Look:
        """Roots and their derivatives at points.

        Parameters
        ----------
        shares : ndarray, shape (m, 2)
            0 to 1 along each axis.
        """
        matrices, slopes = self.space.matrices_and_slopes(self.x(shares), self.speed)
        slopes = slopes * np.stack([span.slope(shares[:, i]) for i, span in enumerate(self.spans)], -1)[..., None, None]
        values, right, left = eigensystem(matrices)
        gradients = np.stack([((left @ slopes[:, i]).swapaxes(1, 2) * right).sum(1) for i in (0, 1)], -1)
        return Look(values, gradients, matrices, slopes)

    def unstable(self, shares: Array) -> NDArray[np.intp]:
        """Number of unstable roots (m,) at points.

        Parameters
        ----------
        shares : ndarray, shape (m, 2)
            0 to 1 along each axis.
        """
        roots = eigenvalues(self.space.matrices(self.x(shares), self.speed))
        return np.asarray((roots.real > NOISE * np.abs(roots).max(1, keepdims=True)).sum(1))


def lattice(first: Array, second: Array) -> Array:
    """Points of a grid (k l, 2), the second axis running fastest.

    Parameters
    ----------
    first, second : ndarray, shape (k,) and (l,)
        0 to 1 along each axis.
    """
    return np.stack(np.meshgrid(first, second, indexing="ij"), -1).reshape(-1, 2)


def speed_of_rest(space: ModelSpace) -> float:
    """The lowest speed of a chart, m/s.

    Parameters
    ----------
    space : ModelSpace
    """
    return REST * speed_unit(space.linear)


def _span(space: ModelSpace, axis: Axis, given: tuple[float, float] | None, *, log: bool) -> Span:
    low, high = usual_range(space, axis) if given is None else given
    if axis.key == SPEED:
        rest = speed_of_rest(space)
        if low < 0:
            raise InputError(f"speed {low:g} m/s is not allowed; give speeds >= 0 m/s")
        low = max(low, rest)
        if high <= low:
            raise InputError(f"speed up to {high:g} m/s: nothing moves below {rest:.2g} m/s; give a range of speeds")
    return Span(axis, low, high, log)


def usual_range(space: ModelSpace, axis: Axis) -> tuple[float, float]:
    """The range of an axis where none is given: what is measured of a tyre, what is typical of all else.

    Parameters
    ----------
    space : ModelSpace
    axis : Axis

    Returns
    -------
    tuple of float
        In the unit of the axis.
    """
    if axis.key == SPEED:
        return SLOW, FAST
    if not axis.wheels:
        return typical_range(space.model, axis)
    assert space.tyres is not None
    sources = [space.tyres.sources[wheel] for wheel in axis.wheels]
    if axis.condition == "load_N":
        low, high = max(s.load_range[0] for s in sources), min(s.load_range[1] for s in sources)
    else:
        low = max(s.pressure_range[0] for s in sources) / PASCAL_PER_BAR
        high = min(s.pressure_range[1] for s in sources) / PASCAL_PER_BAR
    if not (0 < low < high < np.inf):
        raise InputError(f"{axis.key}: the tyre states no range; give one, {axis.key}=LOW:HIGH")
    return low, high
