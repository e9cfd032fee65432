"""Parameters of many bicycles at once: values of the grid, random draws, and what the tyres give."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effects.effect import Effect
from bicycle.model.default_sd import CORNERING_STIFFNESS
from bicycle.model.model import Model, impossible_bicycles
from bicycle.model.model_family import ModelFamily
from bicycle.model.wheel_tyres import MOST_BAR, TYRE_KEYS, tyre_loads, values_of_tyres
from bicycle.parameters.bicycle import BOUNDS, UNITS
from bicycle.parameters.parameter_covariance import WHEELS, ParameterKey
from studies.model_space.axes import bounds_of
from studies.model_space.changed_model import one_by_one
from studies.model_space.sampling import BoundedDraws, Refused, normal, uniform
from studies.sweep.specification import BICYCLE, SPEED, TYRE_UNITS, ImpossibleItem, Sweep, name_group
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.find_tyre import read_tyre
from tyre.measured import properties
from tyre.measured.properties import TyreSource

NO_TYRE = "the tyre's table does not cover the load or pressure"
BLOCKS = (np.array([0, 2]), np.array([1, 3]))  # cornering stiffness of both wheels, lateral stiffness of both
USED = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])  # C and K among C, K, relaxation length of two wheels
STIFFNESSES = ("cornering_stiffness", "lateral_stiffness")
Choice = Mapping[str, NDArray[Any]]  # tyre, surface, pressure_bar, load_N of one wheel, (m,) each


class TyreTable:
    """Tyres by name and surface, kept in memory."""

    def __init__(self, relative_cornering_stiffness_sd: float) -> None:
        self.map = cache(
            lambda tyre, surface: read_tyre(tyre, surface=surface).assuming(relative_cornering_stiffness_sd)
        )
        self.factor = lru_cache(4096)(self._factor)  # a sampled pressure makes one for each item

    def values(
        self,
        wheels: Sequence[Choice],
        other_properties: Sequence[Sequence[str]],
        z: Array | None,
        nominal_loads: Sequence[Any],
        refused: Refused,
        *,
        linear: bool = False,
        share: float = 1.0,
    ) -> tuple[list[dict[str, Array]], NDArray[np.bool_]]:
        """Evaluate the tyres of both wheels: properties (m,) by name, SI, and where an item's tyre is extrapolated."""
        count = len(wheels[0]["load_N"])
        names = (*STIFFNESSES, *properties.MEASURED_BESIDE)
        by_wheel = [{name: np.full(count, np.nan) for name in names} for _ in wheels]
        outside = np.zeros(count, bool)
        conditions = [(wheel["load_N"].astype(float), wheel["pressure_bar"] * PASCAL_PER_BAR) for wheel in wheels]
        groups = self._group_tyres(wheels)
        for k, rows, tyre in groups:
            _mark(tyre, *conditions[k], rows, refused)

        for k, rows, tyre in groups:
            # a refused item is read at the first condition of the table: its numbers are not used
            bad, (loads, pressures) = refused.mask[rows], conditions[k]
            n = np.where(bad, tyre.loads[0] if len(tyre.loads) else loads[rows], loads[rows])
            p = np.where(bad, tyre.pressures[0] if len(tyre.pressures) else pressures[rows], pressures[rows])
            interpolated = tyre.linear(load=n, pressure=p)
            for name, values in by_wheel[k].items():
                if name in interpolated:
                    values[rows] = interpolated[name]
                elif name in other_properties[k]:
                    values[rows] = one_by_one(tyre, name, n, p)
            for value, (low, high) in ((n, tyre.load_range), (p, tyre.pressure_range)):
                outside[rows] |= (value < low * (1 - 1e-9)) | (value > high * (1 + 1e-9))

        if z is not None:
            deviation = self._relative(wheels, z, nominal_loads, refused, linear=linear)
            for column, (of_wheel, name) in enumerate(product(by_wheel, STIFFNESSES)):
                of_wheel[name] *= 1 + share * deviation[:, column]
        for of_wheel, (load, _) in zip(by_wheel, conditions, strict=True):
            of_wheel["relaxation_length"] = of_wheel["cornering_stiffness"] / of_wheel["lateral_stiffness"]
            of_wheel |= properties.parameters_of_effects(of_wheel, load=load)
        return by_wheel, outside

    def _group_tyres(self, wheels: Sequence[Choice]) -> list[tuple[int, NDArray[np.intp], TyreSource]]:
        """Items of the same tyre and surface: number of the wheel, their indices, the tyre."""
        groups = []
        for k, wheel in enumerate(wheels):
            for rows in _group_equal(wheel["tyre"], wheel["surface"]):
                tyre, surface = str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]])
                groups.append((k, rows, self.map(tyre, surface)))
        return groups

    def _relative(
        self, wheels: Sequence[Choice], z: Array, nominal_loads: Sequence[Any], refused: Refused, *, linear: bool
    ) -> Array:
        """Relative deviations (m, 4) of C and K, rear then front; 0 where an item is refused."""
        columns = [
            (wheel["tyre"], wheel["surface"], wheel["pressure_bar"], np.broadcast_to(load, len(z)))
            for wheel, load in zip(wheels, nominal_loads, strict=True)
        ]
        result = np.zeros_like(z)
        for rows in _group_equal(*columns[0], *columns[1]):
            at = rows[0]
            pair = [(str(t[at]), str(s[at]), float(p[at]), float(n[at])) for t, s, p, n in columns]
            used = rows[~refused.mask[rows]]
            try:
                joint = self.factor(*pair) if used.size else []
            except InputError as error:  # at the loads of the unvaried bicycle
                joint = []
                refused.add(NO_TYRE, np.isin(np.arange(len(z)), used), str(error))
            for block, draws in joint:
                drawn = np.ascontiguousarray(z[np.ix_(used, block)].T)
                result[np.ix_(used, block)] = (draws.linear(drawn) if linear else draws(drawn)).T - 1
        return result

    def _factor(self, *wheels: tuple[str, str, float, float]) -> list[tuple[NDArray[np.intp], BoundedDraws]]:
        """Draws of C and K of both wheels, rear then front, relative to their values, with the places they take."""
        maps = [self.map(tyre, surface) for tyre, surface, *_ in wheels]
        joint = properties.wheel_properties(
            maps, [(load, pressure * PASCAL_PER_BAR) for _, _, pressure, load in wheels]
        )
        mean = np.array([value for p in joint.properties for value in (p.cornering_stiffness, p.lateral_stiffness)])
        relative = joint.covariance[USED] / np.outer(mean, mean)
        relative[~np.isfinite(relative)] = 0.0  # of a tyre that holds no lateral stiffness
        cornering, lateral = BLOCKS
        root, shared = _square_root(relative[np.ix_(cornering, cornering)]), relative[np.ix_(lateral, cornering)]
        lateral_covariance = relative[np.ix_(lateral, lateral)]
        if not shared.any():
            return [(cornering, _positive(root)), (lateral, _positive(_square_root(lateral_covariance)))]
        carried = shared @ np.linalg.pinv(root).T
        whole = np.block([[root, np.zeros((2, 2))], [carried, _square_root(lateral_covariance - carried @ carried.T)]])
        return [(np.concatenate(BLOCKS), _positive(whole))]


def _square_root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0)))


def _positive(root: Array) -> BoundedDraws:
    return BoundedDraws(np.ones(len(root)), root, [(0.0, math.inf)] * len(root))


def _mark(tyre: TyreSource, load: Array, pressure: Array, rows: NDArray[np.intp], refused: Refused) -> None:
    """Mark the items whose load (N) or pressure (Pa) the tyre refuses, with its own message for the first."""
    bad, words = np.zeros_like(refused.mask), ""
    pieces = [rows[~refused.mask[rows]]] if (~refused.mask[rows]).any() else []
    while pieces:  # where a corner of the conditions of some is refused, each is asked by itself
        rows_here = pieces.pop()
        try:
            _check_corners(tyre, load[rows_here], pressure[rows_here])
        except InputError as error:
            if len(rows_here) > 1:
                pieces += list(rows_here[::-1, None])
            else:
                bad[rows_here], words = True, words or str(error)
    refused.add(NO_TYRE, bad, words)


def _check_corners(tyre: TyreSource, load: Array, pressure: Array) -> None:
    if pressure.max() > MOST_BAR * PASCAL_PER_BAR:
        bar = pressure.max() / PASCAL_PER_BAR
        raise InputError(f"pressure_bar = {bar:g} must be a number above 0 and up to {MOST_BAR:g} bar")
    for corner in {(a, b) for a in (load.min(), load.max()) for b in (pressure.min(), pressure.max())}:
        tyre.at(load=corner[0], pressure=corner[1], extrapolate=True)


def stiffness_warnings(warnings: Sequence[str], relative_cornering_stiffness_sd: float) -> tuple[str, ...]:
    """``warnings`` of a model file with what a sweep assumes of C_alpha in place of the default."""
    plain, assumed = map(properties.stiffness_note, (CORNERING_STIFFNESS, relative_cornering_stiffness_sd))
    return tuple(warning.replace(plain, assumed) for warning in warnings)


def _group_equal(*columns: NDArray[Any]) -> list[NDArray[np.intp]]:
    """Group rows that are equal in every column (m,): the indices of each group."""
    code = np.zeros(len(columns[0]), np.intp)
    for column in columns:
        if any(column.strides):  # else one value, broadcast
            values, at = np.unique(column, return_inverse=True)
            code = np.unique(code * len(values) + at, return_inverse=True)[1]
    order = np.argsort(code, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(code[order])) + 1)


TYRE_DRAWS = tuple(f"tyre {stiffness} stiffness {wheel}" for wheel in WHEELS for stiffness in ("cornering", "lateral"))


@dataclass(frozen=True, eq=False)
class Points:
    """Parameters of items by key, SI, a number or (m,) each; speeds (m, k) or (1, k) in m/s; and tyre flags (m,)."""

    values: Mapping[str, Any]  # a number, or (m,)
    speeds: Array  # (m, k) or, alike for all, (1, k), m/s
    nominal: Mapping[str, float]  # parameter -> value of the model file, SI
    refused: Refused  # items that are impossible, with the reasons
    # (m,), True outside of a tyre's measured range; None: no tyre is read
    extrapolated: NDArray[np.bool_] | None = field(default=None)

    def value(self, key: str, item: int) -> float:
        """The parameter ``key`` (SI) of the item with index ``item``."""
        value = self.values[key]
        return float(value[item] if np.ndim(value) else value)

    @property
    def harmless(self) -> "Points":
        """Items with the nominal bicycle in place of those that are refused."""
        bad = self.refused.mask
        if not bad.any():
            return self
        values = {key: np.where(bad, self.nominal[key], value) for key, value in self.values.items()}
        speeds = np.where(bad[:, None], 1.0, self.speeds) if len(self.speeds) > 1 else self.speeds
        return Points(values, speeds, self.nominal, Refused(len(bad)), self.extrapolated)


class Sampler:
    """Turns item numbers into parameters; made once per sweep and worker."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self._bicycles = _Bicycles(sweep.bicycles, sweep.bicycle_sd)
        self._tyres = TyreTable(sweep.relative_cornering_stiffness_sd)
        self.model = sweep.nominal
        self.family = ModelFamily(self.model)
        self.nominal = self.model.parameters
        self.tied = self.model.tied
        tables = sweep.model.get("effects", {})
        self.tyre_values = values_of_tyres(tables)
        self.contact = next((name for name, table in tables.items() if any(key in table for key in TYRE_KEYS)), None)

    @property
    def draws(self) -> dict[str, tuple[str, ...]]:
        """Names of the independent standard normal numbers, by what is measured together."""
        draws = {name_group(group.names): group.names for group in self.sweep.normals}
        draws |= {key: (key,) for key in self._bicycles.sampled}
        if self.sweep.tyre_covariance:
            draws |= {
                f"tyre {stiffness} stiffness": TYRE_DRAWS[k::2] for k, stiffness in enumerate(("cornering", "lateral"))
            }
        return draws

    def points(
        self,
        start: int,
        stop: int,
        draws: Mapping[str, Array] | None = None,
        *,
        linear: bool = False,
        share: float = 1.0,
    ) -> Points:
        """Parameters of items number ``start`` to ``stop`` - 1, from standard normal ``draws`` (m,) if given."""
        sweep, count = self.sweep, stop - start
        *cell, sample = np.unravel_index(np.arange(start, stop), sweep.shape)
        parameters: dict[str, Any] = {
            axis.name: np.array(axis.values)[index] for axis, index in zip(sweep.axes, cell, strict=True)
        }
        first, last = int(sample.min()), int(sample.max()) + 1
        for group, joint in zip(sweep.normals, self.joint, strict=True):
            z = self._standard(group.names, sample, draws)
            with np.errstate(over="ignore", invalid="ignore"):  # marked below
                drawn = joint.linear(z) if linear else joint(z)
                drawn = drawn if share == 1 else joint.mean[:, None] + share * (drawn - joint.mean[:, None])
            parameters |= dict(zip(group.names, drawn, strict=True))
        names = parameters.pop(BICYCLE, None)
        if names is not None:
            parameters |= self._bicycles.parameters(
                names, lambda key: self._standard((key,), sample, draws)[0], linear=linear, share=share
            )
        for spread in sweep.uniforms:
            middle = np.full(last - first, 0.5)
            u = middle if linear else uniform(seed=sweep.seed, name=spread.name, start=first, stop=last)
            parameters[spread.name] = (spread.low + (spread.high - spread.low) * u)[sample - first]
        speeds = np.atleast_2d(sweep.speeds) if SPEED not in parameters else parameters.pop(SPEED)[:, None]
        conditions = {
            key: parameters.pop(key) for key in list(parameters) if ParameterKey.parse(key).name in TYRE_UNITS
        }
        values = self.family.values(parameters)
        points = Points(values, speeds, self.nominal, Refused(count))
        for why, mask in impossible_bicycles(values).items():
            points.refused.add(why, mask)
        points.refused.add("a speed below 0", np.asarray((speeds < 0).any(1)))
        if self.contact:
            tyre = self._standard(TYRE_DRAWS, sample, draws).T if sweep.tyre_covariance else None
            tyre_refused = Refused(count) if linear else points.refused  # a slope at a bound takes a step beyond it
            varied_entries = {entry for key in parameters for entry in self.family.entries(key)}
            extrapolated = self._fill_tyre(
                points, conditions, varied_entries, tyre, tyre_refused, names, linear=linear, share=share
            )
            points = replace(points, extrapolated=extrapolated)
            if linear:
                for why, mask in tyre_refused.reasons.items():
                    points.refused.add(why, mask, tyre_refused.examples[why])
        if share == 1:  # conditions of effects need a look at each item
            self._mark_effects(points)
        if not points.refused.mask.all():
            why = "the mass matrix is not positive definite"
            points.refused.add(why, self.family.without_mass(points.harmless.values, count))
        return points

    def centres(self) -> "Sampler":
        """A sampler with one item for each cell of the grid; ``points(..., mean of everything)`` are its bicycles."""
        centres = copy(self)
        centres.sweep = replace(self.sweep, samples=1)
        return centres

    def zeros(self, count: int) -> dict[str, Array]:
        """Draws of zero, a number ``count`` of each."""
        return {name: np.zeros(count) for names in self.draws.values() for name in names}

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on what cannot be drawn as stated."""
        groups = zip(self.sweep.normals, self.joint, strict=True)
        return tuple(dict.fromkeys(note for group, joint in groups for note in joint.notes(group.names)))

    @cached_property
    def joint(self) -> tuple[BoundedDraws, ...]:
        """Draws of each group of jointly normal parameters."""
        return tuple(
            BoundedDraws(group.mean, group.factor, [bounds_of(self.model, name) for name in group.names])
            for group in self.sweep.normals
        )

    def variant(self, points: Points, item: int) -> Model:
        """The model of the item with index ``item``, checked like any other."""
        changed = self.family.with_values({key: points.value(key, item) for key in points.values})
        return Model(changed.bicycle, changed.effects)  # notes and sd are of the nominal one

    def _standard(self, names: Sequence[str], sample: NDArray[np.intp], draws: Mapping[str, Array] | None) -> Array:
        if draws is not None:
            return np.array([draws[name] for name in names])
        first, last = int(sample.min()), int(sample.max()) + 1
        z = [normal(seed=self.sweep.seed, name=name, start=first, stop=last) for name in names]
        return np.array(z)[:, sample - first]

    def _fill_tyre(
        self,
        points: Points,
        conditions: Mapping[str, Any],
        varied_entries: Collection[str],
        z: Array | None,
        refused: Refused,
        names: Any,
        *,
        linear: bool,
        share: float,
    ) -> NDArray[np.bool_]:
        """Fill in what the tyres give, except ``given``; True where an item's tyre is extrapolated."""
        values, count = points.values, len(refused.mask)
        table = self.sweep.model["effects"][str(self.contact)]
        loads, effects = tyre_loads(self.model.effects, values), self.model.effects
        unvaried: Sequence[Any] = (
            tyre_loads(effects, self.model.parameters) if names is None else self._bicycles.loads(names, self.model)
        )
        choices, nominal_loads, other_properties = [], [], []
        properties_of_keys = {key: name for key, name in self.tyre_values.items() if key not in varied_entries}
        for wheel, nominal, load in zip(WHEELS, unvaried, loads, strict=True):
            choice = {"load_N": np.where(refused.mask, nominal, load), "surface": ""} | {
                key: value[wheel] if isinstance(value, Mapping) else value
                for key, value in table.items()
                if key in TYRE_KEYS
            }
            for key in choice:
                choice[key] = conditions.get(f"{key}.{wheel}", conditions.get(key, choice[key]))
            choices.append({key: np.broadcast_to(value, count) for key, value in choice.items()})
            nominal_loads.append(conditions.get(f"load_N.{wheel}", conditions.get("load_N", nominal)))
            names_of_wheel = [
                name for key, name in properties_of_keys.items() if ParameterKey.parse(key).wheel == wheel
            ]
            other_properties.append(
                [*names_of_wheel, *(field for name, field in properties.FOLLOWS_FROM.items() if name in names_of_wheel)]
            )
        properties_of_wheels, extrapolated = self._tyres.values(
            choices, other_properties, z, nominal_loads, refused, linear=linear, share=share
        )
        for key, name in properties_of_keys.items():
            values[key] = properties_of_wheels[WHEELS.index(ParameterKey.parse(key).wheel)][name]  # type: ignore[index]
        return extrapolated

    def _mark_effects(self, points: Points) -> None:
        """Mark items with an effect parameter out of bounds, and those that an effect's own condition refuses."""
        values, refused = points.values, points.refused
        for effect in self.model.effects:
            for parameter in effect.parameters:
                (low, high), name = parameter.bounds, effect.identifier
                for entry in parameter.entries():
                    value = np.asarray(values[f"{name}.{entry}"])
                    refused.add(f"{name}.{entry} outside {low:g} .. {high:g}", ~((low <= value) & (value <= high)))
        checked = [effect for effect in self.model.effects if type(effect).check is not Effect.check]
        count = len(refused.mask)
        columns = {key: np.broadcast_to(value, count).tolist() for key, value in values.items()} if checked else {}
        for effect in checked:
            bad, message = np.zeros(len(refused.mask), bool), ""
            for item in np.flatnonzero(~refused.mask):
                changes = {key: column[item] for key, column in columns.items()}
                try:
                    self.family.effect_with(effect, changes).check(changes)
                except InputError as error:
                    bad[item], message = True, message or str(error)
            refused.add(f"a condition of effect {effect.identifier!r}", bad, message)

    def refuse_any(self, points: Points, start: int, *, where: str = "") -> None:
        """Refuse the first impossible item, counting all, in the words of the bicycle or effect itself."""
        bad = points.refused.mask
        if not bad.any():
            return
        item = int(np.argmax(bad))
        why = next(points.refused.sentence(why) for why, mask in points.refused.reasons.items() if mask[item])
        try:
            self.variant(points, item).linear_model()
        except InputError as error:
            why = str(error)
        self.refuse(item, start, f"{why}; {bad.sum()} of the {len(bad)} bicycles looked at are impossible", where=where)

    def refuse(self, item: int, start: int, why: str, *, where: str = "") -> None:
        """Refuse item number ``item`` after number ``start``, with the reason; ``where`` is added to its place."""
        *cell, sample = (int(i) for i in np.unravel_index(start + item, self.sweep.shape))
        names = [f"{axis.name} = {axis.values[i]}" for axis, i in zip(self.sweep.axes, cell, strict=True)]
        if self.sweep.samples > 1:
            names.append(f"sample {sample}")
        if where:
            names.append(where)
        raise ImpossibleItem(", ".join(names) or "its only point", why)


class _Bicycles:
    """Bicycles of a table: parameters by name and key, SI, and the standard deviations sampled around them."""

    def __init__(self, values: Mapping[str, Mapping[str, float]], sd: Mapping[str, Mapping[str, float]]) -> None:
        self.values, self.sd = values, sd
        self.sampled = tuple(key for key in UNITS if any(key in sd_of_bicycle for sd_of_bicycle in sd.values()))

    def parameters(
        self, names: NDArray[np.str_], standard: Callable[[str], Array], *, linear: bool, share: float
    ) -> dict[str, Array]:
        """Every parameter of items with these bicycles; ``standard`` gives standard normal numbers (m,) of a key."""
        parameters = {key: _look_up(names, {bicycle: of[key] for bicycle, of in self.values.items()}) for key in UNITS}
        for key in self.sampled:
            z = standard(key)
            for bicycle in np.unique(names):
                sd, rows, mean = self.sd[bicycle].get(key, 0.0), names == bicycle, self.values[bicycle][key]
                if sd:
                    joint = BoundedDraws((mean,), ((sd,),), [BOUNDS[key]])
                    drawn = joint.linear(z[None, rows]) if linear else joint(z[None, rows])
                    parameters[key][rows] = mean + share * (drawn[0] - mean)
        return parameters

    def loads(self, names: NDArray[np.str_], model: Model) -> tuple[Array, Array]:
        """Static wheel loads (N) before anything is drawn, rear and front."""
        loads = {bicycle: tyre_loads(model.effects, {**model.parameters, **v}) for bicycle, v in self.values.items()}
        rear, front = (
            {bicycle: float(wheel_loads[wheel]) for bicycle, wheel_loads in loads.items()} for wheel in (0, 1)
        )
        return _look_up(names, rear), _look_up(names, front)


def _look_up(names: NDArray[np.str_], value: Mapping[str, float]) -> Array:
    bicycles, place = np.unique(names, return_inverse=True)
    return np.array([value[str(bicycle)] for bicycle in bicycles], dtype=np.float64)[place]
