"""Root locus in any parameter: tracked and named branches, and the values at which a root crosses the imaginary axis.

Neighbouring values are matched as neighbouring speeds are in :mod:`bicycle.modal.tracking`: by where the roots are
heading and by the bi-orthogonal modal assurance criterion, with the step halved until the match is beyond doubt.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bicycle.modal.matching import Nodes, inverse, projected
from bicycle.modal.named_modes import modes
from bicycle.modal.tracking import in_branches, refine
from studies.root_loci.parameter_path import ParameterPath
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


NODES = 200
SMALLEST_STEP = 2.0**-26  # of the range
SLOPE_STEP = 1e-6  # of the range, for d(A)/d(parameter); slopes only say where roots are heading
MOST_VALUES = 100_000


@dataclass(frozen=True)
class AxisCrossing:
    """A root crosses the imaginary axis at ``value``, ``destabilising`` or not as it grows.

    ``extrapolated`` where the tyre's values there lie beyond its measured loads or pressures.
    """

    value: float
    mode: str
    frequency_hz: float
    destabilising: bool
    extrapolated: bool = False


@dataclass(frozen=True)
class RootLocus:
    """Eigenvalues (m, n) in 1/s, a column a branch called ``names[i]``, at ``values`` (m,) of ``key`` in ``unit``.

    ``asked`` (m,) marks the values of the requested grid; the others were put in between to follow the branches.
    ``inside`` (m,) is False where the tyre is extrapolated.
    """

    key: str
    unit: str
    values: Array
    eigenvalues: Complex
    names: tuple[str, ...]
    crossings: tuple[AxisCrossing, ...]
    asked: NDArray[np.bool_]
    inside: NDArray[np.bool_]

    def frame(self) -> "pd.DataFrame":
        """A row per requested value and root with Im >= 0."""
        import pandas as pd

        rows = []
        for value, roots, inside in zip(self.values, self.eigenvalues, self.inside, strict=True):
            for name, root in zip(self.names, roots, strict=True):
                if root.imag >= 0:
                    ratio = -root.real / abs(root) if root.imag > 0 else np.nan
                    rows.append([value, name, root.real, root.imag, root.imag / (2 * np.pi), ratio, inside])
        named = f"{self.key}_{self.unit}" if not self.key.endswith(f"_{self.unit}") else self.key
        columns = [named.replace("/", "_").replace(" ", "_"), "mode", "real_1_s", "imaginary_rad_s", "frequency_Hz"]
        table = pd.DataFrame(rows, columns=[*columns, "damping_ratio", "tyre_inside_measured_range"])
        return table[np.isin(table.iloc[:, 0], self.values[self.asked])]


def parse_range(text: str) -> Array:
    """Values (m,) from a ``text`` ``start:stop`` (200 steps) or ``start:stop:step``, both ends included.

    Raises
    ------
    InputError
        Text of another form, a range that is empty, or too many values.
    """
    how = f"range {text!r}: give start:stop or start:stop:step with start < stop and step > 0, for example 0.05:0.25"
    try:
        numbers = [float(part) for part in text.split(":")]
    except ValueError:
        raise InputError(how) from None
    if len(numbers) not in (2, 3) or not np.isfinite(numbers).all() or numbers[1] <= numbers[0]:
        raise InputError(how)
    start, stop = numbers[:2]
    step = numbers[2] if len(numbers) == 3 else (stop - start) / NODES
    if step <= 0:
        raise InputError(how)
    if (stop - start) / step > MOST_VALUES:
        raise InputError(
            f"range {text!r}: {(stop - start) / step:.0f} values are more than {MOST_VALUES}; take a larger step"
        )
    inner = start + step * np.arange(int(np.ceil((stop - start) / step * (1 - 1e-12))))
    return np.append(inner, stop)


def root_locus(path: ParameterPath, values: Array) -> RootLocus:
    """Track every root along increasing ``values`` of a parameter.

    A root that crosses the axis and comes back between two neighbouring values is not listed.

    Parameters
    ----------
    path : ParameterPath
    values : ndarray, shape (m,)
        Rising, in the unit of the parameter.

    Raises
    ------
    InputError
        A value that bicycle, effect or tyre does not allow.
    """
    for end in (values[0], values[-1]):
        model, speed = path.at(float(end))
        model.linear_model().check_speeds(speed)
    anchor = _anchor(path, values)
    nodes, asked = np.union1d(values, [anchor]), values
    grid, roots = follow(path.matrices, nodes)
    names = _names(path, anchor, roots[np.searchsorted(grid, anchor)])
    crossings = tuple(_completed(path, crossing) for crossing in _crossings(path.matrices, grid, roots, names))
    return RootLocus(
        path.key, path.unit, grid, roots, names, crossings,
        np.isin(grid, asked), path.inside(grid),
    )  # fmt: skip


def follow(matrices: Callable[[Array], Array], values: Array) -> tuple[Array, Complex]:
    """Values with those put in between, (m,), and eigenvalues (m, n), 1/s, one column a branch.

    Parameters
    ----------
    matrices : callable
        State matrices (k, n, n) at values (k,).
    values : ndarray, shape (k,)
        Of the parameter, rising.
    """
    low, high = values[0], values[-1]

    def compute(at: Array) -> Nodes:
        return _eigen(matrices, at, low, high)

    stretch, _ = in_branches(*refine(compute(values), compute, SMALLEST_STEP * (high - low)))
    return stretch.speeds, stretch.values


def _eigen(matrices: Callable[[Array], Array], values: Array, low: float, high: float) -> Nodes:
    """Eigenvalues, their slopes and vectors; one-sided differences at the ends of the range."""
    h = SLOPE_STEP * (high - low)
    ahead, behind = np.minimum(values + h, high), np.maximum(values - h, low)
    matrix, up, down = np.split(matrices(np.concatenate([values, ahead, behind])), 3)
    roots, right = np.linalg.eig(matrix)
    left = inverse(right)
    slopes = projected(left, (up - down) / (ahead - behind)[:, None, None], right)
    return Nodes(values, *(x.astype(complex) for x in (roots, slopes, right, left)))


def _anchor(path: ParameterPath, values: Array) -> float:
    """Where names are given: the model as it stands, or where modes are told apart along speed, within the range."""
    base = path.base
    if path.key == "speed":
        base = modes(path.at(values[-1])[0].linear_model(), values[-1:]).anchor
    return float(np.clip((values[0] + values[-1]) / 2 if np.isnan(base) else base, values[0], values[-1]))


def _names(path: ParameterPath, value: float, roots: Complex) -> tuple[str, ...]:
    model, speed = path.at(value)
    found = modes(model.linear_model(), [speed])
    named = [(name, root) for name in found.names for root in found.branch(name)[0] if not np.isnan(root)]
    distance = np.abs((roots.real + 1j * np.abs(roots.imag))[:, None] - np.array([root for _, root in named]))
    return tuple(named[k][0] for k in distance.argmin(1))


def _completed(path: ParameterPath, crossing: AxisCrossing) -> AxisCrossing:
    """The crossing with what the tyre's range says and, along speed, the name that a list of modes gives there."""
    value = crossing.value
    mode = crossing.mode
    if path.key == "speed" and value > 0:  # a branch has one name, but modes that meet lose theirs beyond the meeting
        (mode,) = _names(path, value, np.array([2j * np.pi * crossing.frequency_hz]))
    return replace(crossing, mode=mode, extrapolated=not path.inside(np.array([value]))[0])


def _crossings(
    matrices: Callable[[Array], Array], values: Array, roots: Complex, names: tuple[str, ...]
) -> tuple[AxisCrossing, ...]:
    found = []
    for k, i in np.argwhere((roots.real[:-1] > 0) != (roots.real[1:] > 0)):
        ends = roots[[k, k + 1], i]
        if (ends.imag < 0).any():
            continue

        def near(value: float, a: float = values[k], b: float = values[k + 1], ends: Complex = ends) -> complex:
            t = (value - a) / (b - a)
            candidates = np.linalg.eigvals(matrices(np.array([value]))[0])
            return complex(candidates[np.abs(candidates - (1 - t) * ends[0] - t * ends[1]).argmin()])

        sides = [near(value).real > 0 for value in values[[k, k + 1]]]
        if sides[0] == sides[1]:  # rounding moved a root that lies on the axis
            continue
        value = float(brentq(lambda x, near=near: near(x).real, values[k], values[k + 1], xtol=1e-14, rtol=1e-13))
        found.append(
            AxisCrossing(value, names[i], abs(near(value).imag) / (2 * np.pi), bool(ends[1].real > ends[0].real))
        )
    return tuple(sorted(found, key=lambda crossing: (crossing.value, crossing.frequency_hz)))
