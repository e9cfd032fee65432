"""A model as a function of some of its numbers: matrices, their derivatives, and the model itself at any of them.

Numbers mean what they mean in the model file: masses move the wheel loads, and with the loads (and the pressures) what
a measured tyre gives, except where that is itself among the numbers.

>>> space = ModelSpace({"bicycle": "benchmark"}, ["speed", "c"])
>>> space.matrices([[5.0, 0.08], [6.0, 0.1]]).shape
(2, 4, 4)
"""

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.files.model_file import allows_unusual, build_model, refuse_absurd_values
from bicycle.impossible import impossible_bicycles
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from bicycle.parameter_key import WHEELS
from bicycle.parameters import UNITS, bodies, static_loads
from studies.model_axes.axis import SPEED, Axis, axis_of, base_value
from studies.model_axes.tyre_conditions import TyreConditions
from tyre.base.arrays import Array
from tyre.base.errors import InputError

MOVE_LOADS = frozenset(("w", "g", "mR", "mB", "mH", "mF", "xB", "xH"))
STEP = 1e-6  # of a number, for the slopes of what the tyres give


class ModelSpace:
    """A model as a function of some of its numbers.

    Parameters
    ----------
    content : mapping
        Of a model file, with absolute paths.
    keys : sequence of str
        As of :func:`studies.model_axes.axis.axis_of`, d of them.

    Raises
    ------
    InputError
        A key that the model does not have, that is given twice or moves what another one sets; a tyre's condition
        without a measured tyre; equations that switch at a speed.
    """

    def __init__(self, content: Mapping[str, Any], keys: Sequence[str]) -> None:
        self.content = content
        self.model = build_model(content)
        self.family = ModelFamily(self.model)
        self.evaluate = self.family.evaluate
        if self.evaluate.symbolic.switches:
            raise InputError("the equations of this model switch at a speed, which charts and designs do not cover")
        self.axes: tuple[Axis, ...] = tuple(axis_of(self.model, key) for key in keys)
        self.tyres = TyreConditions.of(content, self.model)
        conditions = [axis.key for axis in self.axes if axis.wheels]
        if conditions and self.tyres is None:
            raise InputError(f"{conditions[0]} needs a measured tyre in the model file (tyre, surface, pressure_bar)")
        self.entries = tuple(self._entries(axis) for axis in self.axes)
        every = [entry for entries in self.entries for entry in entries]
        twice = next((entry for entry in every if every.count(entry) > 1), None)
        if twice is not None:
            raise InputError(f"{', '.join(keys)}: {twice} is set twice; keep one of them")

    def _entries(self, axis: Axis) -> tuple[str, ...]:
        if axis.key == SPEED:
            return (SPEED,)
        return tuple(f"{axis.condition}.{wheel}" for wheel in axis.wheels) or self.family.entries(axis.key)

    @property
    def base(self) -> Array:
        """Values of the model as it stands (d,); NaN of the speed, and where rear and front differ."""
        return np.array([base_value(self.model, axis, self._condition(axis.condition)) for axis in self.axes])

    def _condition(self, name: str) -> dict[str, float]:
        return dict(getattr(self.tyres, name)) if self.tyres is not None and name else {}

    @cached_property
    def linear(self) -> LinearModel:
        """The linear model as it stands."""
        return self.model.linear_model()

    @cached_property
    def tyre_moves(self) -> tuple[bool, ...]:
        """Of each axis, whether what the tyres give moves with it."""
        return tuple(self.tyres is not None and (bool(axis.wheels) or axis.key in MOVE_LOADS) for axis in self.axes)

    def values(self, x: ArrayLike, changed: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Every parameter of the model, numbers or (m,) each.

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.
        changed : mapping of str to array_like, shape () or (m,), optional
            Further parameters that differ from those of the model, SI.
        """
        columns = np.atleast_2d(np.asarray(x, float)).T
        given: dict[str, Any] = dict(changed or {})
        for axis, entries, column in zip(self.axes, self.entries, columns, strict=True):
            if axis.key != SPEED and not axis.wheels:
                given |= dict.fromkeys(entries, column)
        values = self.family.values(given)
        if self.tyres is not None and (any(self.tyre_moves) or MOVE_LOADS & given.keys()):
            loads, bars = self.conditions(x, values)
            values |= {key: value for key, value in self.tyres.values(loads, bars).items() if key not in given}
        return values

    def conditions(self, x: ArrayLike, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Load (N) and pressure (bar) of the tyres by wheel; the model has tyres.

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.
        values : mapping of str to array_like, shape () or (m,)
            Parameters there, SI.
        """
        assert self.tyres is not None
        loads: dict[str, Any] = dict(zip(WHEELS, static_loads(bodies(values), values["w"], values["g"]), strict=True))
        bars: dict[str, Any] = dict(self.tyres.pressure_bar)
        for axis, column in zip(self.axes, np.atleast_2d(np.asarray(x, float)).T, strict=True):
            if axis.wheels:
                (bars if axis.condition == "pressure_bar" else loads).update(dict.fromkeys(axis.wheels, column))
        return loads, bars

    def _speeds(self, x: Array, speed: ArrayLike | None) -> Array:
        own = [axis.key for axis in self.axes]
        given = x[:, own.index(SPEED)] if SPEED in own else np.asarray(math.nan if speed is None else speed, float)
        return np.broadcast_to(given, len(x))

    def _pencil(self, x: Array, speeds: Array, values: Mapping[str, Any]) -> tuple[Array, Array, Any]:
        found = self.evaluate(values)
        n, scale = len(self.family.scale), self.family.scale
        mass = np.broadcast_to(found.mass, (len(x), n, n)) * scale
        dynamics = np.broadcast_to(found.dynamics(speeds), (len(x), n, n)) * scale
        return mass, dynamics, found

    def matrices(self, x: ArrayLike, speed: ArrayLike | None = None, changed: Mapping[str, Any] | None = None) -> Array:
        """Scaled state matrices (m, n, n), eigenvalues in 1/s.

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.
        speed : array_like, shape () or (m,), optional
            m/s, unless the speed is an axis.
        changed : mapping of str to array_like, optional
            As of :meth:`values`.
        """
        points = np.atleast_2d(np.asarray(x, float))
        mass, dynamics, _ = self._pencil(points, self._speeds(points, speed), self.values(points, changed))
        return np.asarray(np.linalg.solve(mass, dynamics))

    def matrices_and_slopes(self, x: ArrayLike, speed: ArrayLike | None = None) -> tuple[Array, Array]:
        """The matrices and their derivatives (m, d, n, n) with each axis.

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.
        speed : array_like, shape () or (m,), optional
            m/s, unless the speed is an axis.
        """
        points = np.atleast_2d(np.asarray(x, float))
        speeds, values = self._speeds(points, speed), self.values(points)
        mass, dynamics, found = self._pencil(points, speeds, values)
        matrix = np.linalg.solve(mass, dynamics)
        scale, right = self.family.scale, []
        for i, axis in enumerate(self.axes):
            if axis.key == SPEED:
                right.append(np.broadcast_to(found.dynamics.derivative(speeds), matrix.shape) * scale)
                continue
            total: Any = np.zeros_like(matrix)
            for key, slope in self._directions(points, i).items():
                change = self.evaluate.derivative(key, values)
                own = np.broadcast_to(change.dynamics(speeds), matrix.shape) * scale
                own = own - (np.broadcast_to(change.mass, matrix.shape) * scale) @ matrix
                total = total + np.asarray(slope)[..., None, None] * own
            right.append(total)
        return np.asarray(matrix), np.asarray(np.linalg.solve(mass[:, None], np.stack(right, 1)))

    def _directions(self, x: Array, i: int) -> dict[str, Any]:
        """Derivatives of parameters with axis number ``i``, in SI units per unit of the axis."""
        axis, tied = self.axes[i], self.model.tied
        own = [] if axis.wheels else list(self.entries[i])
        others = {entry for entries in self.entries for entry in entries}
        own += [follower for follower, leader in tied.items() if leader in own and follower not in others]
        found: dict[str, Any] = dict.fromkeys(own, 1.0)
        if self.tyre_moves[i]:
            assert self.tyres is not None
            step = STEP * np.maximum(np.abs(x[:, i]), 1e-3)
            ends = [self.values(x + sign * np.eye(len(self.axes))[i] * step[:, None]) for sign in (1, -1)]
            for key in self.tyres.given:
                if key not in others:
                    found[key] = (ends[0][key] - ends[1][key]) / (2 * step)
        return found

    def model_at(self, x: ArrayLike) -> Model:
        """The model at one point, checked like any other.

        Parameters
        ----------
        x : array_like, shape (d,)
            In the units of the axes.

        Raises
        ------
        InputError
            Numbers that bicycle or effects do not allow, or far outside of what is usual.
        """
        values = {key: float(np.ravel(value)[0]) for key, value in self.values([np.asarray(x, float)]).items()}
        if not allows_unusual(self.content):
            refuse_absurd_values(self.model, {
                axis.key: [float(value)] for axis, value in zip(self.axes, np.asarray(x, float), strict=True)
            })  # fmt: skip
        return self.family.with_values({k: v for k, v in values.items() if v != self.family.base[k]})

    def linear_at(self, x: ArrayLike, changed: Mapping[str, float] | None = None) -> LinearModel:
        """The linear model at one point, without the checks of bicycle and effects.

        Parameters
        ----------
        x : array_like, shape (d,)
            In the units of the axes.
        changed : mapping of str to float, optional
            As of :meth:`values`.
        """
        values = self.values([np.asarray(x, float)], changed)
        return self.family.linear_model({key: float(np.ravel(value)[0]) for key, value in values.items()})

    def inside(self, x: ArrayLike) -> NDArray[np.bool_]:
        """Whether the tyres are measured or interpolated at points, shape (m,).

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.
        """
        points = np.atleast_2d(np.asarray(x, float))
        if self.tyres is None:
            return np.ones(len(points), bool)
        return np.broadcast_to(self.tyres.inside(*self.conditions(points, self.values(points))), len(points))

    def refuse_impossible(self, x: ArrayLike) -> None:
        """Refuse points that make no bicycle, naming the first.

        Parameters
        ----------
        x : array_like, shape (m, d)
            In the units of the axes.

        Raises
        ------
        InputError
            A point that bicycle, effect or tyre does not allow.
        """
        points = np.atleast_2d(np.asarray(x, float))
        for i, axis in enumerate(self.axes):
            for end in (points[:, i].min(), points[:, i].max()):
                low, high = axis.bounds
                if not low <= end <= high:
                    raise InputError(
                        f"{axis.key} = {end:g} {axis.unit} is not possible; give values from {low:g} to {high:g}"
                    )
        values = self.values(points)
        for why, mask in impossible_bicycles({key: values[key] for key in UNITS}).items():
            raise InputError(f"{self._place(points[np.broadcast_to(mask, len(points)).argmax()])}: {why}")
        if self.tyres is not None and any(self.tyre_moves):
            self.tyres.check(*self.conditions(points, values))
        given = {key: value for key, value in values.items() if np.ndim(value)}
        refused = self.family.without_mass(given, len(points))
        if refused.any():
            raise InputError(f"{self._place(points[refused.argmax()])}: the mass matrix is not positive definite")
        for corner in np.unique(np.clip(points, points.min(0), points.max(0))[[0, -1]], axis=0):
            self.model_at(corner)

    def _place(self, point: Array) -> str:
        return ", ".join(f"{axis.key} = {value:g}" for axis, value in zip(self.axes, point, strict=True))
