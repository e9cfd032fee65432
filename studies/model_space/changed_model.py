"""A model as a function of some of its numbers: matrices, derivatives, the model and its file at any of them.

Numbers mean what they mean in the model file: masses move the wheel loads, and with the loads (and the pressures) what
a measured tyre gives, except where that is itself among the numbers.

>>> space = ModelSpace({"bicycle": "benchmark"}, ["speed", "c"])
>>> space.matrices([[5.0, 0.08], [6.0, 0.1]]).shape
(2, 4, 4)
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.effects.sprung_joint import STAND_INS
from bicycle.files.bicycle_numbers import COVARIANCE, WORDS, model_table
from bicycle.model.model import Model, impossible_bicycles
from bicycle.model.model_family import ModelFamily
from bicycle.model.model_file import allows_unusual, build_model, refuse_absurd_values
from bicycle.model.state_space import LinearModel
from bicycle.model.wheel_tyres import EXTRAPOLATE, MOST_BAR, TYRE_KEYS, tyre_loads, values_of_tyres, wheel_sources
from bicycle.parameters.bicycle import UNITS, UNUSED
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey
from studies.model_space.axes import SPEED, Axis, axis_of, base_value, effect_parameter
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.properties import TyreSource, out_of_reach, parameters_of_effects

Conditions = Mapping[str, Any]  # by wheel, (m,) each
MOVE_LOADS = frozenset(("w", "g", "mR", "mB", "mH", "mF", "xB", "xH"))


def one_by_one(tyre: TyreSource, name: str, load: Array, pressure: Array) -> Array:
    """Property of a tyre at each load (N) and pressure (Pa), one by one where it takes no arrays; NaN where none."""
    conditions, at = np.unique(np.column_stack([load, pressure]), axis=0, return_inverse=True)
    return np.array([getattr(tyre.at(load=n, pressure=p, extrapolate=True), name) for n, p in conditions], float)[
        at.ravel()
    ]


@dataclass(frozen=True)
class TyreConditions:
    """The tyres of a model file: pressure and load as they stand, and the parameters of effects that they give."""

    sources: Mapping[str, TyreSource]  # wheel -> tyre
    pressure_bar: dict[str, float]  # wheel -> bar, as it stands
    load_N: dict[str, float]  # wheel -> N, as it stands
    properties_given: dict[str, str]  # parameter of an effect that the tyre gives -> property of the tyre
    extrapolate: bool  # True: beyond what was measured too

    @classmethod
    def of(cls, content: Mapping[str, Any], model: Model) -> "TyreConditions | None":
        """Tyres of the content of a model file with absolute paths, and its model; None if it names none."""
        tables = content.get("effects", {})
        law = next((table for table in tables.values() if "tyre" in table), None)
        if law is None:
            return None
        tyre, surface, bar = (
            {wheel: value[wheel] if isinstance(value, Mapping) else value for wheel in WHEELS}
            for value in map(law.get, TYRE_KEYS)
        )
        loads = dict(zip(WHEELS, map(float, tyre_loads(model.effects, model.parameters)), strict=True))
        pressures = {wheel: float(value) for wheel, value in bar.items()}
        extrapolate = bool(law.get(EXTRAPOLATE, False))
        return cls(wheel_sources(tyre, surface), pressures, loads, values_of_tyres(tables), extrapolate)

    def values(self, load_N: Conditions, pressure_bar: Conditions) -> dict[str, Array]:
        """Parameters of effects that the tyres give, by name, (m,) each."""
        parameters: dict[str, Array] = {}
        for wheel in WHEELS:
            of_wheel = {
                key: name for key, name in self.properties_given.items() if ParameterKey.parse(key).wheel == wheel
            }
            load, pressure = np.broadcast_arrays(
                np.atleast_1d(np.asarray(load_N[wheel], float)),
                np.atleast_1d(np.asarray(pressure_bar[wheel], float)) * PASCAL_PER_BAR,
            )
            properties = dict(self.sources[wheel].linear(load=load, pressure=pressure)) if of_wheel else {}
            properties = parameters_of_effects(properties, load=load) if of_wheel else properties
            for key, name in of_wheel.items():
                if name not in properties:
                    properties[name] = one_by_one(self.sources[wheel], name, load, pressure)
                parameters[key] = np.asarray(properties[name], float)
        return parameters

    def check(self, load_N: Conditions, pressure_bar: Conditions) -> None:
        """Refuse conditions that a tyre does not take."""
        for wheel, source in self.sources.items():
            loads, bars = np.atleast_1d(load_N[wheel]), np.atleast_1d(pressure_bar[wheel])
            ends = product({float(loads.min()), float(loads.max())}, {float(bars.min()), float(bars.max())})
            for load, bar in ends:
                free = bar != bar and source.default_pressure is not None
                if not ((free or 0 < bar <= MOST_BAR) and load > 0):
                    raise InputError(
                        f"{wheel} wheel at {load:g} N, {bar:g} bar: give loads above 0 N, and pressures above 0 and up "
                        f"to {MOST_BAR:g} bar"
                    )
                doubt = out_of_reach(source, load=load, pressure=bar * PASCAL_PER_BAR)
                if doubt and not self.extrapolate:
                    nearer = f"use a range closer to the tests, or allow extrapolation: --{EXTRAPOLATE}"
                    raise InputError(f"{wheel} wheel: {doubt}; {nearer}")
                source.at(load=load, pressure=bar * PASCAL_PER_BAR, extrapolate=True)

    def inside(self, load_N: Conditions, pressure_bar: Conditions) -> NDArray[np.bool_]:
        """Conditions (m,) at which both tyres are measured or interpolated."""
        good: Any = True
        for wheel, source in self.sources.items():
            for condition, (low, high) in (
                (load_N[wheel], source.load_range),
                (np.asarray(pressure_bar[wheel], float) * PASCAL_PER_BAR, source.pressure_range),
            ):
                value = np.asarray(condition, float)
                good = good & ~((value < low * (1 - 1e-9)) | (value > high * (1 + 1e-9)))
        return np.atleast_1d(np.asarray(good, bool))


class ModelSpace:
    """A model as a function of d of its numbers; points x (m, d) are in the units of these axes."""

    def __init__(self, content: Mapping[str, Any], keys: Sequence[str]) -> None:
        self.content = content
        self.model = build_model(content)
        self.family = ModelFamily(self.model)
        self.axes: tuple[Axis, ...] = tuple(axis_of(self.model, key) for key in keys)
        self.tyres = TyreConditions.of(content, self.model)
        conditions = [axis.key for axis in self.axes if axis.wheels]
        if conditions and self.tyres is None:
            raise InputError(f"{conditions[0]} needs a measured tyre in the model file (tyre, surface, pressure_bar)")
        self.entries = tuple(self._entries(axis) for axis in self.axes)
        all_entries = [entry for entries in self.entries for entry in entries]
        twice = next((entry for entry in all_entries if all_entries.count(entry) > 1), None)
        if twice is not None:
            raise InputError(f"{', '.join(keys)}: {twice} is set twice; keep one of them")
        self.evaluate = self.family.evaluate  # derives the equations: after all that is refused without them

    def refuse_switches(self) -> None:
        """Refuse a model whose equations switch at a speed, where derivatives are wanted."""
        if self.evaluate.symbolic.switches:
            raise InputError("the equations of this model switch at a speed, which charts and designs do not cover")

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
    def _moving(self) -> frozenset[str]:
        """Parameters that move load between the wheels."""
        of_effects = [key for e in self.model.effects if e.moves_load for key in e.values(self.model.bicycle.values)]
        return frozenset((*UNITS, *of_effects)) if of_effects else MOVE_LOADS

    @cached_property
    def tyre_moves(self) -> tuple[bool, ...]:
        """Axes along which what the tyres give moves."""
        return tuple(self.tyres is not None and (bool(axis.wheels) or axis.key in self._moving) for axis in self.axes)

    def values(self, x: ArrayLike, changed: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Every parameter of the model, numbers or (m,) each."""
        columns = np.atleast_2d(np.asarray(x, float)).T
        settings: dict[str, Any] = dict(changed or {})
        for axis, entries, column in zip(self.axes, self.entries, columns, strict=True):
            if axis.key != SPEED and not axis.wheels:
                settings |= dict.fromkeys(entries, column)
        values = self.family.values(settings)
        if self.tyres is not None and (any(self.tyre_moves) or self._moving & settings.keys()):
            loads, bars = self.conditions(x, values)
            values |= {key: value for key, value in self.tyres.values(loads, bars).items() if key not in settings}
        return values

    def conditions(self, x: ArrayLike, values: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Load (N) and pressure (bar) of the tyres by wheel; the model has tyres."""
        assert self.tyres is not None
        loads: dict[str, Any] = dict(zip(WHEELS, tyre_loads(self.model.effects, values), strict=True))
        bars: dict[str, Any] = dict(self.tyres.pressure_bar)
        for axis, column in zip(self.axes, np.atleast_2d(np.asarray(x, float)).T, strict=True):
            if axis.wheels:
                (bars if axis.condition == "pressure_bar" else loads).update(dict.fromkeys(axis.wheels, column))
        return loads, bars

    def _speeds(self, x: Array, speed: ArrayLike | None) -> Array:
        keys = [axis.key for axis in self.axes]
        speeds = x[:, keys.index(SPEED)] if SPEED in keys else np.asarray(math.nan if speed is None else speed, float)
        return np.broadcast_to(speeds, np.broadcast_shapes(speeds.shape, x.shape[:1]))

    def _pencil(self, speeds: Array, values: Mapping[str, Any]) -> tuple[Array, Array, Any]:
        pencil, scale = self.evaluate(values), self.family.scale
        shape = (len(speeds), len(scale), len(scale))
        return (
            np.broadcast_to(pencil.mass, shape) * scale,
            np.broadcast_to(pencil.dynamics(speeds), shape) * scale,
            pencil,
        )

    def matrices(self, x: ArrayLike, speed: ArrayLike | None = None, changed: Mapping[str, Any] | None = None) -> Array:
        """Scaled state matrices (m, n, n), eigenvalues in 1/s, of m points or of one at m speeds (m/s)."""
        points = np.atleast_2d(np.asarray(x, float))
        speeds, values = self._speeds(points, speed), self.values(points, changed)
        if self.evaluate.symbolic.switches:
            return self.family.state_matrices(values, speeds[:, None])[:, 0]
        mass, dynamics, _ = self._pencil(speeds, values)
        return np.asarray(np.linalg.solve(mass, dynamics))

    def matrices_and_slopes(self, x: ArrayLike, speed: ArrayLike | None = None) -> tuple[Array, Array]:
        """The matrices and their derivatives (m, d, n, n) with each axis."""
        points = np.atleast_2d(np.asarray(x, float))
        speeds, values = self._speeds(points, speed), self.values(points)
        mass, dynamics, pencil = self._pencil(speeds, values)
        matrix = np.linalg.solve(mass, dynamics)
        scale, right = self.family.scale, []
        for i, axis in enumerate(self.axes):
            if axis.key == SPEED:
                right.append(np.broadcast_to(pencil.dynamics.derivative(speeds), matrix.shape) * scale)
                continue
            total: Any = np.zeros_like(matrix)
            for key, slope in self._directions(points, i).items():
                change = self.evaluate.derivative(key, values)
                slope_of_key = np.broadcast_to(change.dynamics(speeds), matrix.shape) * scale
                slope_of_key = slope_of_key - (np.broadcast_to(change.mass, matrix.shape) * scale) @ matrix
                total = total + np.asarray(slope)[..., None, None] * slope_of_key
            right.append(total)
        return np.asarray(matrix), np.asarray(np.linalg.solve(mass[:, None], np.stack(right, 1)))

    def _directions(self, x: Array, i: int) -> dict[str, Any]:
        """Derivatives of parameters with axis number ``i``, in SI units per unit of the axis."""
        axis, tied = self.axes[i], self.model.tied
        moved_keys = [] if axis.wheels else list(self.entries[i])
        axis_entries = {entry for entries in self.entries for entry in entries}
        moved_keys += [
            follower for follower, leader in tied.items() if leader in moved_keys and follower not in axis_entries
        ]
        slopes: dict[str, Any] = dict.fromkeys(moved_keys, 1.0)
        if self.tyre_moves[i]:
            assert self.tyres is not None
            step = 1e-6 * np.maximum(np.abs(x[:, i]), 1e-3)
            steps = np.eye(len(self.axes))[i] * step[:, None]
            values = self.values(np.concatenate([x + steps, x - steps]))
            for key in [key for key in self.tyres.properties_given if key not in axis_entries]:
                ends = np.broadcast_to(values[key], 2 * len(x))
                slopes[key] = (ends[: len(x)] - ends[len(x) :]) / (2 * step)
        return slopes

    def numbers_at(self, x: ArrayLike, changed: Mapping[str, float] | None = None) -> dict[str, float]:
        """Every parameter of the model at one point."""
        values = self.values([np.asarray(x, float)], changed)
        return {key: float(np.ravel(value)[0]) for key, value in values.items()}

    def model_at(self, x: ArrayLike) -> Model:
        """The model at one point, checked like any other."""
        values = self.numbers_at(x)
        if not allows_unusual(self.content):
            refuse_absurd_values(
                self.model,
                {axis.key: [float(value)] for axis, value in zip(self.axes, np.asarray(x, float), strict=True)},
            )
        return self.family.with_values({k: v for k, v in values.items() if v != self.family.base[k]})

    def linear_at(self, x: ArrayLike, changed: Mapping[str, float] | None = None) -> LinearModel:
        """The linear model at one point, without the checks of bicycle and effects."""
        return self.family.linear_model(self.numbers_at(x, changed))

    def inside(self, x: ArrayLike) -> NDArray[np.bool_]:
        """Points (m,) at which the tyres are measured or interpolated."""
        points = np.atleast_2d(np.asarray(x, float))
        if self.tyres is None:
            return np.ones(len(points), bool)
        return np.broadcast_to(self.tyres.inside(*self.conditions(points, self.values(points))), len(points))

    def refuse_impossible(self, x: ArrayLike) -> None:
        """Refuse impossible points, naming the first."""
        points = np.atleast_2d(np.asarray(x, float))
        for i, axis in enumerate(self.axes):
            for end in (points[:, i].min(), points[:, i].max()):
                low, high = axis.bounds
                if not low <= end <= high:
                    place = f"{axis.key} = {end:g} {axis.unit}"
                    raise InputError(f"{place} is not possible; give values from {low:g} to {high:g}")
        values = self.values(points)
        for why, mask in impossible_bicycles({key: values[key] for key in UNITS}).items():
            raise InputError(f"{self._place(points[np.broadcast_to(mask, len(points)).argmax()])}: {why}")
        if self.tyres is not None and any(self.tyre_moves):
            self.tyres.check(*self.conditions(points, values))
        arrays = {key: value for key, value in values.items() if np.ndim(value)}
        without_mass = self.family.without_mass(arrays, len(points))
        if without_mass.any():
            raise InputError(f"{self._place(points[without_mass.argmax()])}: the mass matrix is not positive definite")
        for corner in np.unique(np.clip(points, points.min(0), points.max(0))[[0, -1]], axis=0):
            self.model_at(corner)

    def _place(self, point: Array) -> str:
        return ", ".join(f"{axis.key} = {value:g}" for axis, value in zip(self.axes, point, strict=True))


def changed_content(space: ModelSpace, x: ArrayLike) -> dict[str, Any]:
    """The content of the model file with other numbers for the axes; what is not changed stays as it stands there."""
    point = np.asarray(x, float)
    values = space.numbers_at(point)
    content = dict(space.content)
    tables = {name: dict(table) for name, table in content.get("effects", {}).items()}
    keys = [axis.key for axis in space.axes]
    if any(key in UNITS for key in keys):
        content["bicycle"] = _bicycle(space, {key for key in keys if key in UNITS}, values)
    changed = {ParameterKey.parse(entry).effect for entries in space.entries for entry in entries}
    if "" in changed:  # a hinge stays where the model had it while the bicycle changes
        changed = set(tables)
    tables = {
        name: _without_stand_ins(name, table, values) if name in changed else table for name, table in tables.items()
    }
    from_tyres = {} if space.tyres is None else space.tyres.properties_given
    if any(entry in from_tyres for entries in space.entries for entry in entries):
        tables = {name: _without_tyre(name, table, from_tyres, values) for name, table in tables.items()}
    for axis, entries, number in zip(space.axes, space.entries, point.tolist(), strict=True):
        if axis.wheels:
            law = next(table for table in tables.values() if "tyre" in table)
            old = law["pressure_bar"]
            by_wheel: dict[str, Any] = dict(old) if isinstance(old, Mapping) else dict.fromkeys(WHEELS, old)
            law["pressure_bar"] = _merge_wheels(by_wheel | dict.fromkeys(axis.wheels, number))
        elif axis.key not in UNITS:
            key = ParameterKey.parse(entries[0])
            tables[key.effect][key.name] = _value(key.effect, key.name, values)
    return content | ({"effects": tables} if tables else {})


def _bicycle(space: ModelSpace, changed: set[str], values: Mapping[str, float]) -> dict[str, Any]:
    bicycle = space.model.bicycle
    table = space.content["bicycle"]
    whole = model_table(replace(bicycle, values=dict(bicycle.values) | {key: values[key] for key in changed}))
    # a table that says it by other names (trail, z_up) would contradict the key that is changed
    keeps = isinstance(table, Mapping) and set(table) <= {*UNITS, *UNUSED, *WORDS, COVARIANCE}
    return dict(table) | {key: whole[key] for key in changed} if keeps else whole


def _value(effect: str, name: str, values: Mapping[str, float]) -> Any:
    if not effect_parameter(f"{effect}.{name}").per_wheel:
        return values[f"{effect}.{name}"]
    return _merge_wheels({wheel: values[f"{effect}.{name}.{wheel}"] for wheel in WHEELS})


def _without_stand_ins(effect: str, table: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """The table of an ``effect`` with numbers of its parameters in place of what stands for them."""
    numbers = {
        name: values[f"{effect}.{name}"] for key, (_, names) in STAND_INS.items() if key in table for name in names
    }
    return {key: value for key, value in table.items() if key not in STAND_INS} | numbers


def _merge_wheels(by_wheel: Mapping[str, Any]) -> Any:
    return by_wheel[WHEELS[0]] if by_wheel[WHEELS[0]] == by_wheel[WHEELS[1]] else dict(by_wheel)


def _without_tyre(
    name: str, table: Mapping[str, Any], from_tyres: Mapping[str, str], values: Mapping[str, float]
) -> dict[str, Any]:
    """The table of an effect with numbers in place of what its tyre gives."""
    numbers = {key: value for key, value in table.items() if key not in (*TYRE_KEYS, EXTRAPOLATE)}
    names = dict.fromkeys(ParameterKey.parse(key).name for key in from_tyres if ParameterKey.parse(key).effect == name)
    return numbers | {parameter: _value(name, parameter, values) for parameter in names}


def near_to(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The content with files that lie in ``folder``, or below, named from there."""
    changed, home = dict(content), folder.resolve()

    def name(value: Any) -> Any:
        path = Path(value) if isinstance(value, str) else None
        is_inside = path is not None and path.is_absolute() and path.is_relative_to(home)
        return path.relative_to(home).as_posix() if is_inside and path is not None else value

    changed["bicycle"] = name(content.get("bicycle"))
    tables = {key: dict(table) for key, table in content.get("effects", {}).items()}
    for table in tables.values():
        if "tyre" in table:
            tyre = table["tyre"]
            table["tyre"] = {w: name(file) for w, file in tyre.items()} if isinstance(tyre, Mapping) else name(tyre)
    return changed | ({"effects": tables} if tables else {})
