"""What a change costs, and how far each number may go."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bicycle.default_sd import standard_deviations
from bicycle.parameters import POSITIVE, TYPICAL, UNITS
from studies.model_axes.axis import SPEED, typical_range
from studies.model_axes.model_space import ModelSpace
from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown
from tyre.base.units import PASCAL_PER_BAR

BY_COST, BY_SD, RELATIVE = "stated costs", "standard deviations", "shares of the value"
STRICTLY = 1e-6  # of a value that must be positive: its lowest


@dataclass(frozen=True)
class Limits:
    """Lowest and highest value (d,) of each number in its unit, and what sets the two."""

    low: Array
    high: Array
    why: tuple[str, ...]


@dataclass(frozen=True)
class Cost:
    """``scale`` (d,), the change of each number that counts as one, in its unit; ``kind`` says what that is."""

    scale: Array
    kind: str

    def of(self, change: Array) -> float:
        """Cost of a ``change`` (d,) in the units of the numbers: the root of the sum of squares."""
        return float(np.linalg.norm(change / self.scale))


def base_of(space: ModelSpace) -> Array:
    """The numbers as they stand (d,), in their units.

    Parameters
    ----------
    space : ModelSpace

    Raises
    ------
    InputError
        The speed or a load among them, or a number that differs between the wheels.
    """
    for axis, value in zip(space.axes, space.base, strict=True):
        if axis.key == SPEED or axis.condition == "load_N":
            raise InputError(f"--vary {axis.key}: it is no number of the model file; vary what the bicycle is made of")
        if math.isnan(value):
            raise InputError(
                f"--vary {axis.key}: rear and front differ; vary {axis.key}.rear, {axis.key}.front or both"
            )
        if not math.isfinite(value):
            raise InputError(f"--vary {axis.key}: its value is infinite; give the model a finite one to start from")
    return space.base


def limits_of(space: ModelSpace, given: Mapping[str, tuple[float, float]]) -> Limits:
    """How far each number may go: as given, else what is measured of a tyre, else what is typical and possible.

    Parameters
    ----------
    space : ModelSpace
    given : mapping of str to (float, float)
        Lowest and highest value by key, in its unit.

    Raises
    ------
    InputError
        A key that is not varied, or limits that are impossible or leave out the value that the model has.
    """
    keys = [axis.key for axis in space.axes]
    for key in given:
        if key not in keys:
            raise InputError(f"--limits: {unknown('varied parameter', key, keys)}")
    low, high, why = [], [], []
    for axis, base in zip(space.axes, space.base, strict=True):
        if axis.key in given:
            ends, reason = given[axis.key], "given"
            if not (axis.bounds[0] <= ends[0] <= ends[1] <= axis.bounds[1]):
                raise InputError(
                    f"--limits {axis.key}={ends[0]:g}:{ends[1]:g}: possible are {axis.bounds[0]:g} to "
                    f"{axis.bounds[1]:g} {axis.unit}"
                )
            if not ends[0] <= base <= ends[1]:
                raise InputError(f"--limits {axis.key}: the model's {base:g} {axis.unit} is not between them")
        elif axis.wheels:
            assert space.tyres is not None
            ranges = [space.tyres.sources[wheel].pressure_range for wheel in axis.wheels]
            ends = (max(r[0] for r in ranges) / PASCAL_PER_BAR, min(r[1] for r in ranges) / PASCAL_PER_BAR)
            reason = "measured"
            if not math.isfinite(ends[1]):
                ends, reason = (0.5 * base, min(1.5 * base, axis.bounds[1])), "half as much again"
        else:
            ends, reason = (TYPICAL[axis.key] if axis.key in UNITS else typical_range(space.model, axis)), "typical"
        if axis.key not in given and not ends[0] <= base <= ends[1]:
            reason += ", and the model's value"
        if axis.key in POSITIVE:
            ends = (max(ends[0], STRICTLY * base), ends[1])
        low.append(max(min(ends[0], base), axis.bounds[0]))
        high.append(min(max(ends[1], base), axis.bounds[1]))
        why.append(reason)
    return Limits(np.array(low), np.array(high), tuple(why))


def cost_of(space: ModelSpace, costs: Mapping[str, float], sd: Mapping[str, float], *, assume: bool = False) -> Cost:
    """What a change counts: stated costs, else standard deviations where all are known, else shares of the value.

    Parameters
    ----------
    space : ModelSpace
    costs : mapping of str to float
        Cost of a change by one unit, by key.
    sd : mapping of str to float
        Further standard deviations, SI.
    assume : bool
        Whether what nobody states has a default standard deviation.

    Raises
    ------
    InputError
        A cost of what is not varied, a varied number without a cost, or a cost that is not above 0.
    """
    keys = [axis.key for axis in space.axes]
    for key in costs:
        if key not in keys:
            raise InputError(f"--cost: {unknown('varied parameter', key, keys)}")
    missing = [key for key in keys if key not in costs]
    if costs and missing:
        raise InputError(f"--cost: {', '.join(missing)} has none; give a cost to every varied parameter, or to none")
    if costs:
        if min(costs.values()) <= 0:
            raise InputError("--cost: a change must cost more than 0; keep a parameter out of --vary or limit it")
        return Cost(np.array([1 / costs[key] for key in keys]), BY_COST)
    known = standard_deviations(space.model, sd, assume=assume)
    stated = [_deviation(known, entries) for entries in space.entries]
    if all(stated):
        return Cost(np.array(stated), BY_SD)
    return Cost(np.array([_usual(space, i) for i in range(len(keys))]), RELATIVE)


def _deviation(known: Mapping[str, object], entries: Sequence[str]) -> float:
    found = [float(getattr(known.get(entry), "sd", 0.0)) for entry in entries]
    return max(found)


def _usual(space: ModelSpace, i: int) -> float:
    """The size of a number, or of what is typical of it where it is 0."""
    base = abs(float(space.base[i]))
    return base or max(map(abs, typical_range(space.model, space.axes[i])))
