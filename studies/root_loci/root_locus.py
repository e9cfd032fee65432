"""Root locus in any parameter: tracked and named branches, and the values at which a root crosses the imaginary axis.

Neighbouring values are matched as neighbouring speeds are in :mod:`bicycle.modal.tracking`: by where the roots are
heading and by the bi-orthogonal modal assurance criterion, with the step halved until the match is beyond doubt.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bicycle.critical.completeness import NOISE
from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz, oscillating
from bicycle.modal.named_modes import modes
from bicycle.modal.parameter_branches import BranchCrossing, branch_crossings, follow_branches
from studies.root_loci.parameter_path import ParameterPath
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


NODES = 200
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

    @property
    def unstable_throughout(self) -> tuple[str, ...]:
        """Names of the modes with a root to the right of the imaginary axis at all values."""
        largest = np.abs(self.eigenvalues).max(1, keepdims=True)
        unstable = (self.eigenvalues.real > NOISE * largest).all(0)
        return tuple(dict.fromkeys(name for name, here in zip(self.names, unstable, strict=True) if here))

    def frame(self) -> "pd.DataFrame":
        """A row per requested value and root with Im >= 0."""
        import pandas as pd

        rows = []
        for value, roots, inside in zip(self.values, self.eigenvalues, self.inside, strict=True):
            for name, root in zip(self.names, roots, strict=True):
                if root.imag >= 0:
                    ratio, hertz = float(damping_ratio(oscillating(root))), float(frequency_hz(root))
                    rows.append([value, name, root.real, root.imag, hertz, ratio, inside])
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
    grid, roots = follow_branches(path.matrices, nodes)
    names = _names(path, anchor, roots[np.searchsorted(grid, anchor)])
    crossings = tuple(
        _completed(path, crossing, names[crossing.branch]) for crossing in branch_crossings(path.matrices, grid, roots)
    )
    return RootLocus(
        path.key, path.unit, grid, roots, names, crossings,
        np.isin(grid, asked), path.inside(grid),
    )  # fmt: skip


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


def _completed(path: ParameterPath, crossing: BranchCrossing, mode: str) -> AxisCrossing:
    """The crossing with what the tyre's range says and, along speed, the name that a list of modes gives there."""
    root = 1j * abs(crossing.root.imag)
    if path.key == "speed" and crossing.value > 0:  # modes that meet lose the one name of a branch beyond the meeting
        (mode,) = _names(path, crossing.value, np.array([root]))
    inside = bool(path.inside(np.array([crossing.value]))[0])
    return AxisCrossing(crossing.value, mode, float(frequency_hz(root)), crossing.destabilising, not inside)
