"""Which parameters an item of a sweep has: grid cell, draws and measured tyre put together, checked, as arrays."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effect import Effect, PerWheel
from bicycle.model import Model
from bicycle.model_file import TYRE_KEYS
from bicycle.parameters import UNITS, bodies, static_loads
from studies.sweeps.draws import normal, uniform
from studies.sweeps.spec import SPEED, TYRE_UNITS, WHEELS, Sweep
from studies.sweeps.tyre_table import TyreTable
from tyre.errors import InputError

Array = NDArray[np.float64]


TYRE_DRAWS = tuple(f"tyre {what} stiffness {wheel}" for wheel in WHEELS for what in ("cornering", "lateral"))


@dataclass(frozen=True, eq=False)
class Points:
    """Items of a sweep: ``values`` key -> float or array (m,), speeds (m, k) or (1, k), and tyre flags."""

    values: Mapping[str, Any]
    speeds: Array
    extrapolated: NDArray[np.bool_] | None

    def value(self, key: str, item: int) -> float:
        """One parameter of one item."""
        return number(self.values[key], item)


class ImpossibleItem(InputError):
    """An item of a sweep that cannot be computed: the sweep has to be changed."""

    def __init__(self, where: str, why: str) -> None:
        super().__init__(where, why)
        self.where, self.why = where, why

    def __str__(self) -> str:
        return f"sweep at {self.where}: {self.why}; narrow the grid or the distributions"


class Sampler:
    """Turns item numbers into parameters; made once per sweep and worker."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self.model = sweep.nominal
        self.nominal = self.model.parameters
        self.tied = self.model.tied
        tables = sweep.model.get("effects", {})
        self.contact = next((name for name, table in tables.items() if any(key in table for key in TYRE_KEYS)), None)

    @property
    def draws(self) -> dict[str, tuple[str, ...]]:
        """What is normally distributed, by what is measured together -> names of its independent standard normals."""
        found = {", ".join(group.names): group.names for group in self.sweep.normals}
        if self.sweep.tyre_covariance:
            found |= {f"tyre {what} stiffness": TYRE_DRAWS[k::2] for k, what in enumerate(("cornering", "lateral"))}
        return found

    def points(self, start: int, stop: int, draws: Mapping[str, Array] | None = None) -> Points:
        """Parameters of items ``start`` to ``stop`` - 1, from standard normal ``draws`` (m,) by name if given.

        Raises
        ------
        InputError
            Naming the item and the parameter that is not physically possible.
        """
        sweep = self.sweep
        *cell, sample = np.unravel_index(np.arange(start, stop), sweep.shape)
        given: dict[str, Any] = {
            axis.name: np.array(axis.values)[index] for axis, index in zip(sweep.axes, cell, strict=True)
        }
        first, last = int(sample.min()), int(sample.max()) + 1
        for group in sweep.normals:
            z = self._standard(group.names, sample, draws)
            for name, mean, row in zip(group.names, group.mean, group.factor, strict=True):
                with np.errstate(over="ignore", invalid="ignore"):  # refused below
                    given[name] = mean + sum(share * part for share, part in zip(row, z, strict=True))
        for one in sweep.uniforms:
            u = uniform(seed=sweep.seed, name=one.name, start=first, stop=last)
            given[one.name] = (one.low + (one.high - one.low) * u)[sample - first]
        speeds = np.atleast_2d(sweep.speeds) if SPEED not in given else given.pop(SPEED)[:, None]
        conditions = {key: given.pop(key) for key in list(given) if key.split(".")[0] in TYRE_UNITS}
        values = self.nominal | self._both_wheels(given)
        for follower, leader in self.tied.items():
            if follower not in given and leader in given:
                values[follower] = values[leader]
        points = Points(values, speeds, None)
        self._refuse_any(points, no_bicycle(values) | (speeds < 0).any(1), start, stop)  # before its loads meet a tyre
        if self.contact:
            tyre = self._standard(TYRE_DRAWS, sample, draws).T if sweep.tyre_covariance else None
            points = replace(points, extrapolated=self._fill_tyre(values, conditions, len(sample), tyre))
        self._refuse_any(points, self._no_effect(values, stop - start), start, stop)
        return points

    def variant(self, points: Points, item: int) -> Model:
        """The model of one item, checked like any other."""
        changes = {key: points.value(key, item) for key in points.values}
        bicycle = self.model.bicycle.replace(**{key: changes[key] for key in UNITS})
        return Model(bicycle, tuple(self._effect(effect, changes) for effect in self.model.effects))

    def _effect(self, effect: Effect, changes: Mapping[str, float]) -> Effect:
        table: dict[str, Any] = {}
        for parameter in effect.parameters:
            if f"{effect.identifier}.{parameter.entries()[0]}" not in self.tied:
                numbers = [changes[f"{effect.identifier}.{entry}"] for entry in parameter.entries()]
                table[parameter.name] = PerWheel(*numbers) if parameter.per_wheel else numbers[0]
        return type(effect)(**table)

    def _both_wheels(self, given: Mapping[str, Array]) -> dict[str, Array]:
        return {
            key: array
            for name, array in given.items()
            for key in ([name] if name in self.nominal else [f"{name}.{wheel}" for wheel in WHEELS])
        }

    def _standard(self, names: Sequence[str], sample: NDArray[np.intp], draws: Mapping[str, Array] | None) -> Array:
        if draws is not None:
            return np.array([draws[name] for name in names])
        first, last = int(sample.min()), int(sample.max()) + 1
        z = [normal(seed=self.sweep.seed, name=name, start=first, stop=last) for name in names]
        return np.array(z)[:, sample - first]

    def _fill_tyre(
        self, values: dict[str, Any], conditions: Mapping[str, Any], count: int, z: Array | None
    ) -> NDArray[np.bool_]:
        sweep, contact = self.sweep, str(self.contact)
        table = sweep.model["effects"][contact]
        loads = static_loads(bodies(values), values["w"], values["g"])
        choices = []
        for wheel, load in zip(WHEELS, loads, strict=True):
            found = {"load_N": load, "surface": ""} | {
                key: value[wheel] if isinstance(value, Mapping) else value
                for key, value in table.items()
                if key in TYRE_KEYS
            }
            for key in found:
                found[key] = conditions.get(f"{key}.{wheel}", conditions.get(key, found[key]))
            choices.append({key: np.broadcast_to(value, count) for key, value in found.items()})
        nominal_loads = [
            conditions.get(f"load_N.{w}", conditions.get("load_N", load)) for w, load in self._static_loads
        ]
        cornering, lateral, extrapolated = self._tyres.stiffnesses(choices, z, nominal_loads)
        for k, wheel in enumerate(WHEELS):
            for name, value in (
                ("cornering_stiffness", cornering[k]),
                ("relaxation_length", cornering[k] / lateral[k]),
            ):
                if f"{contact}.{name}.{wheel}" in values:
                    values[f"{contact}.{name}.{wheel}"] = value
        return extrapolated

    @cached_property
    def _static_loads(self) -> list[tuple[str, float]]:
        return list(zip(WHEELS, self.model.bicycle.static_loads, strict=True))

    @cached_property
    def _tyres(self) -> TyreTable:
        return TyreTable(self.sweep.relative_cornering_stiffness_sd)

    def _no_effect(self, values: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
        """Items with an effect parameter out of bounds, or the first that an effect's own condition refuses."""
        bad = np.zeros(count, bool)
        for effect in self.model.effects:
            for parameter in effect.parameters:
                for entry in parameter.entries():
                    value = np.asarray(values[f"{effect.identifier}.{entry}"])
                    bad |= ~((parameter.bounds[0] <= value) & (value <= parameter.bounds[1]))
        strict = [effect for effect in self.model.effects if type(effect).check is not Effect.check]
        if not strict or bad.any():
            return bad
        for item in range(count):
            changes = {key: number(value, item) for key, value in values.items()}
            try:
                for effect in strict:
                    self._effect(effect, changes).check(changes)
            except InputError:
                bad[item] = True
        return bad

    def _refuse_any(self, points: Points, bad: NDArray[np.bool_], start: int, stop: int) -> None:
        """Refuse the first bad item, counting all of them; the message is that of the bicycle or effect itself."""
        bad = np.broadcast_to(bad, stop - start)
        if not bad.any():
            return
        item = int(np.argmax(bad))
        speed = float(points.speeds[min(item, len(points.speeds) - 1)].min(initial=0.0))
        why = f"speed {speed:.4g} m/s is below 0" if speed < 0 else "the parameters make no bicycle"
        try:
            self.variant(points, item).linear_model()
        except InputError as error:
            why = str(error)
        self.refuse(item, start, f"{why}; {bad.sum()} of the {stop - start} bicycles looked at are impossible")

    def refuse(self, item: int, start: int, why: str) -> None:
        """Say which item is impossible and why."""
        *cell, sample = (int(i) for i in np.unravel_index(start + item, self.sweep.shape))
        where = [f"{axis.name} = {axis.values[i]}" for axis, i in zip(self.sweep.axes, cell, strict=True)]
        where += [f"sample {sample}"] if self.sweep.samples > 1 else []
        raise ImpossibleItem(", ".join(where) or "its only point", why)


def no_bicycle(p: Mapping[str, Any]) -> NDArray[np.bool_]:
    """True where the parameters, numbers or arrays, are no physical bicycle."""
    bad: Any = np.abs(p["lam"]) >= np.pi / 2
    for key in UNITS:
        bad = bad | ~np.isfinite(p[key])
    for key in ("mB", "mR", "mH", "mF", "IRyy", "IFyy", "IRxx", "IFxx", "IBxx", "IBzz", "IHxx", "IHzz"):
        bad = bad | ~(np.asarray(p[key]) >= 0)
    for key in ("w", "rR", "rF", "g"):
        bad = bad | ~(np.asarray(p[key]) > 0)
    with np.errstate(all="ignore"):
        for part in "BH":
            bad = bad | (p[f"I{part}xx"] * p[f"I{part}zz"] < p[f"I{part}xz"] ** 2)
        for load in static_loads(bodies(p), p["w"], p["g"]):
            bad = bad | ~(np.asarray(load) > 0)
    return np.asarray(bad)


def number(value: Any, item: int) -> float:
    """One number of a parameter that is a number or an array (m,)."""
    found = np.asarray(value)
    return float(found[item] if found.ndim else found)
