"""Which parameters an item of a sweep has: grid cell, draws and measured tyre put together, checked, as arrays."""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.effect import Effect
from bicycle.files.tyre_values import values_of_tyres
from bicycle.files.wheel_tyres import TYRE_KEYS
from bicycle.impossible import impossible_bicycles
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from bicycle.parameter_key import WHEELS, ParameterKey
from bicycle.parameters import bodies, static_loads
from studies.sampling.bounded_draws import BoundedDraws
from studies.sampling.draws import normal, uniform
from studies.sampling.refused import Refused
from studies.sweeps.many_bicycles import BICYCLE, ManyBicycles
from studies.sweeps.spec import SPEED, TYRE_UNITS, ImpossibleItem, Sweep, bounds_of, together
from studies.sweeps.tyre_table import TyreTable
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.properties import FOLLOWS_FROM

TYRE_DRAWS = tuple(f"tyre {what} stiffness {wheel}" for wheel in WHEELS for what in ("cornering", "lateral"))


@dataclass(frozen=True, eq=False)
class Points:
    """Items of a sweep: ``values`` key -> float or array (m,), speeds (m, k) or (1, k), and tyre flags.

    ``refused`` are those that make no bicycle; ``nominal`` are the values of one that does.
    """

    values: Mapping[str, Any]
    speeds: Array
    nominal: Mapping[str, float]
    refused: Refused
    extrapolated: NDArray[np.bool_] | None = field(default=None)

    def value(self, key: str, item: int) -> float:
        """The parameter ``key`` (SI) of the item with index ``item``."""
        return number(self.values[key], item)

    @property
    def harmless(self) -> "Points":
        """The same items with the nominal bicycle in place of those that are refused."""
        bad = self.refused.mask
        if not bad.any():
            return self
        values = {key: np.where(bad, self.nominal[key], value) for key, value in self.values.items()}
        speeds = np.where(bad[:, None], 1.0, self.speeds) if len(self.speeds) > 1 else self.speeds
        return Points(values, speeds, self.nominal, Refused.none(len(bad)), self.extrapolated)


class Sampler:
    """Turns item numbers into parameters; made once per sweep and worker."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self.model = sweep.nominal
        self.family = ModelFamily(self.model)
        self.nominal = self.model.parameters
        self.tied = self.model.tied
        tables = sweep.model.get("effects", {})
        self.taken = values_of_tyres(tables)
        self.contact = next((name for name, table in tables.items() if any(key in table for key in TYRE_KEYS)), None)

    @property
    def draws(self) -> dict[str, tuple[str, ...]]:
        """What is normally distributed, by what is measured together -> names of its independent standard normals."""
        found = {together(group.names): group.names for group in self.sweep.normals}
        found |= {key: (key,) for key in self._many.sampled}
        if self.sweep.tyre_covariance:
            found |= {f"tyre {what} stiffness": TYRE_DRAWS[k::2] for k, what in enumerate(("cornering", "lateral"))}
        return found

    def points(
        self,
        start: int,
        stop: int,
        draws: Mapping[str, Array] | None = None,
        *,
        linear: bool = False,
        share: float = 1.0,
    ) -> Points:
        """Parameters of items number ``start`` to ``stop`` - 1, from standard normal ``draws`` (m,) if given.

        Draws stay within what is physically possible (:mod:`studies.sampling.bounded_draws`); a ``share`` < 1 (no unit)
        goes only that part of the way from the mean to them. ``linear`` instead takes mean + factor z, whatever the
        bounds, and the middle of what is uniform: with draws of zero it is the mean of everything. What is impossible
        is marked, not refused.
        """
        sweep, count = self.sweep, stop - start
        *cell, sample = np.unravel_index(np.arange(start, stop), sweep.shape)
        given: dict[str, Any] = {
            axis.name: np.array(axis.values)[index] for axis, index in zip(sweep.axes, cell, strict=True)
        }
        first, last = int(sample.min()), int(sample.max()) + 1
        for group, joint in zip(sweep.normals, self._joint, strict=True):
            z = self._standard(group.names, sample, draws)
            with np.errstate(over="ignore", invalid="ignore"):  # marked below
                drawn = joint.linear(z) if linear else joint(z)
                drawn = drawn if share == 1 else joint.mean[:, None] + share * (drawn - joint.mean[:, None])
            given |= dict(zip(group.names, drawn, strict=True))
        names = given.pop(BICYCLE, None)
        if names is not None:
            given |= self._many.parameters(
                names, lambda key: self._standard((key,), sample, draws)[0], linear=linear, share=share
            )
        for one in sweep.uniforms:
            u = (
                np.full(last - first, 0.5)
                if linear
                else uniform(seed=sweep.seed, name=one.name, start=first, stop=last)
            )
            given[one.name] = (one.low + (one.high - one.low) * u)[sample - first]
        speeds = np.atleast_2d(sweep.speeds) if SPEED not in given else given.pop(SPEED)[:, None]
        conditions = {key: given.pop(key) for key in list(given) if ParameterKey.parse(key).name in TYRE_UNITS}
        values = self.family.values(given)
        points = Points(values, speeds, self.nominal, Refused.none(count))
        for why, mask in impossible_bicycles(values).items():
            points.refused.add(why, mask)
        points.refused.add("a speed below 0", np.asarray((speeds < 0).any(1)))
        if self.contact:
            tyre = self._standard(TYRE_DRAWS, sample, draws).T if sweep.tyre_covariance else None
            apart = Refused.none(count) if linear else points.refused  # a slope at a bound takes a step beyond it
            found = self._fill_tyre(
                points,
                conditions,
                {entry for key in given for entry in self.family.entries(key)},
                tyre,
                apart,
                names,
                linear=linear,
                share=share,
            )
            points = replace(points, extrapolated=found)
            for why, mask in apart.reasons.items() if linear else ():
                points.refused.add(why, mask, apart.examples[why])
        if share == 1:  # conditions of effects need a look at each item
            self._mark_effects(points)
        if not points.refused.mask.all():
            why = "the mass matrix is not positive definite"
            points.refused.add(why, self.family.without_mass(points.harmless.values, count))
        return points

    def centres(self) -> "Sampler":
        """A sampler with one item for each cell of the grid; ``points(..., mean of everything)`` are its bicycles."""
        found = copy(self)
        found.sweep = replace(self.sweep, samples=1)
        return found

    def zeros(self, count: int) -> dict[str, Array]:
        """Draws of zero, a number ``count`` of each."""
        return {name: np.zeros(count) for names in self.draws.values() for name in names}

    @property
    def notes(self) -> tuple[str, ...]:
        """What cannot be drawn as stated, in words."""
        found = (
            note for g, joint in zip(self.sweep.normals, self._joint, strict=True) for note in joint.notes(g.names)
        )
        return tuple(dict.fromkeys(found))

    @cached_property
    def _joint(self) -> tuple[BoundedDraws, ...]:
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
        self, points: Points, conditions: Mapping[str, Any], given: Collection[str], z: Array | None,
        refused: Refused, names: Any, *, linear: bool, share: float,
    ) -> NDArray[np.bool_]:  # fmt: skip
        sweep, contact, values = self.sweep, str(self.contact), points.values
        table, count = sweep.model["effects"][contact], len(refused.mask)
        loads = static_loads(bodies(values), values["w"], values["g"])
        choices = []
        unvaried: list[tuple[str, Any]]
        unvaried = self._static_loads if names is None else list(zip(WHEELS, self._many.loads(names), strict=True))
        for (wheel, nominal), load in zip(unvaried, loads, strict=True):
            choice = {"load_N": np.where(refused.mask, nominal, load), "surface": ""} | {
                key: value[wheel] if isinstance(value, Mapping) else value
                for key, value in table.items()
                if key in TYRE_KEYS
            }
            for key in choice:
                choice[key] = conditions.get(f"{key}.{wheel}", conditions.get(key, choice[key]))
            choices.append({key: np.broadcast_to(value, count) for key, value in choice.items()})
        nominal_loads = [conditions.get(f"load_N.{w}", conditions.get("load_N", load)) for w, load in unvaried]
        taken = {key: name for key, name in self.taken.items() if key not in given}
        wanted = [_fields([name for key, name in taken.items() if ParameterKey.parse(key).wheel == w]) for w in WHEELS]
        found, extrapolated = self._tyres.values(choices, wanted, z, nominal_loads, refused, linear=linear, share=share)
        for key, name in taken.items():
            values[key] = found[WHEELS.index(ParameterKey.parse(key).wheel)][name]  # type: ignore[index]
        return extrapolated

    @cached_property
    def _many(self) -> ManyBicycles:
        return ManyBicycles(self.sweep.bicycles, self.sweep.bicycle_sd)

    @cached_property
    def _static_loads(self) -> list[tuple[str, float]]:
        return list(zip(WHEELS, self.model.bicycle.static_loads, strict=True))

    @cached_property
    def _tyres(self) -> TyreTable:
        return TyreTable(self.sweep.relative_cornering_stiffness_sd)

    def _mark_effects(self, points: Points) -> None:
        """Mark items with an effect parameter out of bounds, and those that an effect's own condition refuses."""
        values, refused = points.values, points.refused
        for effect in self.model.effects:
            for parameter in effect.parameters:
                (low, high), name = parameter.bounds, effect.identifier
                for entry in parameter.entries():
                    value = np.asarray(values[f"{name}.{entry}"])
                    refused.add(f"{name}.{entry} outside {low:g} .. {high:g}", ~((low <= value) & (value <= high)))
        for effect in self.model.effects:
            if type(effect).check is not Effect.check:
                self._mark_checked(effect, values, refused)

    def _mark_checked(self, effect: Effect, values: Mapping[str, Any], refused: Refused) -> None:
        bad, said = np.zeros(len(refused.mask), bool), ""
        for item in np.flatnonzero(~refused.mask):
            changes = {key: number(value, int(item)) for key, value in values.items()}
            try:
                self.family.effect_with(effect, changes).check(changes)
            except InputError as error:
                bad[item], said = True, said or str(error)
        refused.add(f"a condition of effect {effect.identifier!r}", bad, said)

    def refuse_any(self, points: Points, start: int, *, where: str = "") -> None:
        """Refuse the first impossible item, counting all; the message is that of the bicycle or effect itself.

        Parameters
        ----------
        start : int
            Number of the first item.
        where : str, optional
            Added to the place of the item.

        Raises
        ------
        ImpossibleItem
            Naming the item and the parameter that is not physically possible.
        """
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
        """Say ``why`` item number ``item`` after number ``start`` is impossible; ``where`` is added to its place."""
        *cell, sample = (int(i) for i in np.unravel_index(start + item, self.sweep.shape))
        names = [f"{axis.name} = {axis.values[i]}" for axis, i in zip(self.sweep.axes, cell, strict=True)]
        names += [f"sample {sample}"] if self.sweep.samples > 1 else []
        names += [where] if where else []
        raise ImpossibleItem(", ".join(names) or "its only point", why)


def _fields(names: Sequence[str]) -> list[str]:
    """Fields of a tyre's properties that others follow from, too."""
    return [*names, *(field for name, field in FOLLOWS_FROM.items() if name in names)]


def number(value: Any, item: int) -> float:
    """Number ``item`` of a ``value`` that is a number or an array (m,)."""
    found = np.asarray(value)
    return float(found[item] if found.ndim else found)
