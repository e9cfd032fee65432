"""The modes of a model along speed: every eigenvalue in exactly one named branch.

>>> from bicycle import Model, load_bicycle
>>> found = modes(Model(load_bicycle("benchmark")).linear_model(), [4.0, 5.0])
>>> found.frequency("weave").round(3), found.damping_ratio("weave").round(3)
(array([0.49 , 0.711]), array([-0.133,  0.171]))
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.eigenvalues.oscillation import frequency_hz, pair_damping_ratio
from bicycle.linear_model import LinearModel
from bicycle.modal.events import ModeEvent
from bicycle.modal.naming import every_mode
from bicycle.modal.shapes import ModeShape, mode_shape
from bicycle.modal.speed_limits import check_trackable
from bicycle.modal.tracker import Tracker
from bicycle.model import Model, as_linear
from tyre.base.arrays import Array, Complex
from tyre.base.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


UNITS = {
    "speed_m_s": "m/s", "mode": "", "real_1_s": "1/s", "imaginary_rad_s": "rad/s", "frequency_Hz": "Hz",
    "damping_ratio": "1",
}  # fmt: skip
"""Columns of :meth:`Modes.to_dataframe`."""


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues along speed, tracked and named.

    Attributes
    ----------
    speeds : ndarray, shape (m,)
        In the order they were asked for, m/s.
    eigenvalues : ndarray, shape (m, n)
        1/s, at each speed sorted by real then imaginary part.
    branches : mapping of str to ndarray, shape (m, 2)
        Name -> values at each speed: one with im > 0 for a pair, two real ones after it has split (the larger first),
        NaN where there is none. Around speeds at which halves of two modes meet, their identity is lost: the roots of
        both are then listed under the joint name, "capsize+weave" (which may need more than two columns). It is given
        back where the roots are again as many pairs and single real roots as the modes.
    anchor : float
        Speed at which the names were given, m/s.
    """

    speeds: Array
    eigenvalues: Complex
    branches: Mapping[str, Complex]
    anchor: float
    model: LinearModel = field(repr=False)

    def __repr__(self) -> str:
        many = len(self.speeds)
        at = f"{many} speeds {self.speeds.min():g}-{self.speeds.max():g}" if many > 1 else f"{self.speeds[0]:g}"
        growth = {name: values.real.max() for name, values in self.branches.items() if (values.real > 0).any()}
        unstable = ", ".join(name for name in self.names if name in growth) or "none"
        return (
            f"<Modes at {at} m/s: {', '.join(self.names)}\n"
            f" unstable at one of them: {unstable}; largest real part {np.nanmax(self.eigenvalues.real):.3g} 1/s>"
        )

    @cached_property
    def events(self) -> tuple[ModeEvent, ...]:
        """Real roots that merge to a pair or come from one, modes that exchange character, jumps at a switch speed.

        Of the speeds between the lowest and the highest; computed when they are first asked for.
        """
        low, high = float(self.speeds.min()), float(self.speeds.max())
        every = Tracker.over(self.model, low, high).events
        return tuple(event for event in every if low <= event.speed <= high)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the modes that occur."""
        return tuple(self.branches)

    def branch(self, name: str) -> Complex:
        """Values (m, 2) of the mode called ``name``, 1/s.

        Raises
        ------
        InputError
            The model has no such mode.
        """
        if name not in self.branches:
            raise InputError(f"unknown mode {name!r}; this model has {', '.join(self.branches)}")
        return self.branches[name]

    def frequency(self, name: str) -> Array:
        """Damped frequency Im/(2 pi) of the mode ``name`` in Hz, shape (m,).

        0 where the roots are real, NaN where there is no such mode.
        """
        return frequency_hz(self.branch(name)[:, 0])

    def damping_ratio(self, name: str) -> Array:
        """Damping ratio of the mode ``name``, shape (m,).

        -Re/|lambda| of a pair, -(a + b) / (2 sqrt(a b)) of two real roots of one sign (above 1 in size), otherwise
        (one real root, roots of both signs, no such mode) NaN.
        """
        return pair_damping_ratio(*self.branch(name)[:, :2].T)

    def shape(self, name: str) -> ModeShape:
        """Magnitude and phase of lean, steer, yaw and lateral motion, of the first value of the branch ``name``."""
        return mode_shape(self.model, self.speeds, self.branch(name)[:, 0])

    def plot(self, axes: Any = None) -> tuple[Any, Any]:
        """Frequency and real part along speed; see :func:`bicycle.modal.figure.draw_modes`.

        Parameters
        ----------
        axes : two matplotlib axes, optional
            A new figure when not given.

        Returns
        -------
        frequency, real : matplotlib.axes.Axes
        """
        from bicycle.modal.figure import draw_modes

        return draw_modes(self, axes)

    def to_xarray(self) -> Any:
        """Labelled ``xarray.Dataset`` with units; see :func:`bicycle.modal.to_xarray.modes_to_xarray`."""
        from bicycle.modal.to_xarray import modes_to_xarray

        return modes_to_xarray(self)

    def to_dataframe(self) -> "pd.DataFrame":
        """A row per speed, mode and root; ``attrs["units"]`` has the unit of every column.

        Columns: ``speed_m_s``, ``mode``, ``real_1_s``, ``imaginary_rad_s``, ``frequency_Hz`` (damped, 0 for a real
        root), ``damping_ratio`` (as :meth:`damping_ratio`). A mode that has split into two real roots has two rows.
        """
        import pandas as pd

        columns: dict[str, list[Any]] = {name: [] for name in UNITS}
        ratios = {name: self.damping_ratio(name) for name in self.branches}
        for k in range(len(self.speeds)):
            for name, values in self.branches.items():
                for root in np.flatnonzero(~np.isnan(values[k])).tolist():
                    z = values[k, root]
                    row = (self.speeds[k], name, z.real, z.imag, abs(float(frequency_hz(z))), ratios[name][k])
                    for column, value in zip(columns.values(), row, strict=True):
                        column.append(value)
        found = pd.DataFrame(columns)
        found.attrs = {"units": dict(UNITS), "anchor_speed_m_s": self.anchor, "effects": list(self.model.effects)}
        return found

    def to_dict(self) -> dict[str, list[list[list[float]] | None]]:
        """JSON form: name -> for each speed a list of [re, im] in 1/s, or None where the mode is not there."""
        return {
            name: [[[z.real, z.imag] for z in row[~np.isnan(row)].tolist()] or None for row in values]
            for name, values in self.branches.items()
        }


def modes(model: Model | LinearModel, speeds: ArrayLike) -> Modes:
    """Eigenvalues, tracked and named, at speeds in any order.

    Names are given at an anchor speed that depends on the model alone and carried up and down by tracking, so what a
    root is called at one speed does not depend on the other speeds asked for. The pair that castering and a tyre's
    single real root form without relaxation (side_slip) is called wobble, and there is no castering then.

    Parameters
    ----------
    model : Model or LinearModel
    speeds : array_like, shape (m,)
        Forward speeds, m/s.

    Raises
    ------
    InputError
        No speeds, a speed that the model does not allow or that is too high (or, for a model singular at rest, too
        low) to be tracked, or a model too stiff to be computed.
    """
    model = as_linear(model)
    v = np.atleast_1d(model.check_speeds(speeds))
    if v.ndim != 1 or not v.size:
        raise InputError(f"speeds have shape {v.shape}; give one or more speeds in a row")
    check_trackable(model, v)
    tracker = Tracker.over(model, float(v.min()), float(v.max()))
    ordered = tracker.ordered(v)
    index, labels = tracker.labels(v, ordered)
    branches = _branches(model, ordered, index, labels, tracker.naming.names)
    return Modes(v, np.sort_complex(ordered), branches, tracker.naming.anchor, model)


def _branches(
    model: LinearModel, ordered: Complex, index: NDArray[np.intp], labels: Sequence[tuple[str, ...]],
    names: Sequence[str],
) -> dict[str, Complex]:  # fmt: skip
    shown = np.where(ordered.imag < 0, np.nan, ordered)  # a pair is shown by its upper half
    listed = [mode.name for mode in every_mode(model)]
    every = sorted({*names, *(name for case in labels for name in case)}, key=lambda name: _rank(name, listed))
    found = {name: np.full((len(ordered), 2), np.nan, complex) for name in every}
    for k, case in enumerate(labels):
        rows = np.flatnonzero(index == k)
        for name in set(case):
            columns = np.flatnonzero([label == name for label in case])
            values = shown[rows[:, None], columns]
            order = np.lexsort((-values.real, -values.imag), axis=1)  # pairs, then real roots; NaN last
            values = np.take_along_axis(values, order, 1)
            wanted = max(2, int((~np.isnan(values)).sum(1).max()))
            if found[name].shape[1] < wanted:
                padding = np.full((len(ordered), wanted - found[name].shape[1]), np.nan, complex)
                found[name] = np.hstack([found[name], padding])
            width = min(values.shape[1], wanted)
            found[name][rows, :width] = values[:, :width]
    return found


def _rank(name: str, order: Sequence[str]) -> tuple[int, int, str]:
    return name.count("+"), order.index(name) if name in order else len(order), name
