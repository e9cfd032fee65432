"""How well a bicycle and its effects are known: one standard deviation of every parameter and where it comes from.

What a file does not state is taken from one small table, for every study alike. Methods are those of Moore (2012),
Human Control of a Bicycle, ch. 3: tape measure, scales, suspension, torsional and compound pendulum. The sizes are
those of a careful workshop, a few times the standard deviations published there for the best measured bicycles.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bicycle.model import Model
from bicycle.parameter_key import ParameterKey, entries_of
from bicycle.parameters import UNITS, UNUSED
from tyre.base.errors import InputError, is_number, shown, unknown

GIVEN, TABLE, FILE, MODEL_FILE, ASSUMED, EXACT = ORIGINS = (
    "given", "tyre table", "bicycle file", "model file", "assumed", "exact"
)  # fmt: skip


@dataclass(frozen=True)
class Default:
    """One row of the table: the standard deviation of some keys, absolute or of the value, and how it is measured.

    ``of`` is ``SI unit`` (absolute), ``value``, or ``xx and zz`` (the geometric mean of the two moments of inertia).
    """

    keys: tuple[str, ...]
    size: float
    of: str
    why: str


DEFAULTS = (
    Default(("w", "c"), 0.003, "SI unit", "tape measure"),
    Default(("rR", "rF"), 0.001, "SI unit", "rolled out over several turns"),
    Default(("xB", "zB", "xH", "zH"), 0.01, "SI unit", "suspension, photographs"),
    Default(("lam",), 0.01, "SI unit", "digital level"),
    Default(("mR", "mB", "mH", "mF"), 0.005, "value", "scales"),
    Default(("IRxx", "IFxx", "IBxx", "IBzz", "IHxx", "IHzz"), 0.05, "value", "torsional pendulum"),
    Default(("IBxz", "IHxz"), 0.05, "xx and zz", "torsional pendulum at several angles"),
    Default(("IRyy", "IFyy"), 0.02, "value", "compound pendulum"),
    Default(("g",), 0.0, "SI unit", "known"),
)
"""Standard deviations of a bicycle of which only the values are known."""

EFFECT = 0.1
"""Of the value: parameters of effects, which are seldom measured on the bicycle at hand."""

CORNERING_STIFFNESS = 0.03
"""sd(C_Fy) / C_Fy of a tyre whose source states none: of a table independent between conditions; of a formula (.tir,
Pacejka-89) the same at all conditions, and as much of K_y.

The tables of Dell'Orto et al. scatter by 1.2 to 2.2 % about the smooth MF6.1 law (the rms misfit over nine conditions),
which is what a repeated condition would; load cell, temperature and the difference between two tyres of one make come
on top.
"""


MOST = {
    "m": (0.5, "mm"), "rad": (0.3, "degrees"), "kg": (100.0, "g"), "kg m^2": (100.0, "kg mm^2"),
    "m/s^2": (1.0, "mm/s^2"),
}  # fmt: skip
"""Standard deviations of a bicycle's parameters beyond which they are surely in another unit, by unit."""


@dataclass(frozen=True)
class Deviation:
    """One standard deviation (SI), its origin (one of ``ORIGINS``) and the reason where there is one to tell."""

    sd: float
    origin: str
    why: str = ""


def standard_deviations(
    model: Model, given: Mapping[str, float] | None = None, *, assume: bool = True
) -> dict[str, Deviation]:
    """One standard deviation of every parameter: as given, else stated by its source, else from the table here.

    Parameters
    ----------
    model : Model
    given : mapping
        1-sigma (SI) by key of the bicycle, ``effect.parameter`` (both wheels) or ``effect.parameter.wheel``; 0 is
        exact.
    assume : bool
        False counts what nobody states as exact.

    Returns
    -------
    dict
        Key -> :class:`Deviation`. A parameter that is tied to one of the bicycle follows it and is left out, unless a
        deviation of its own is given. Exact are a given or stated 0, gravity, and an effect at its neutral value.

    Raises
    ------
    InputError
        ``given`` names no parameter of the model, a number that is not finite and >= 0, or one that can only be in
        another unit.
    """
    values = model.parameters
    stated = _both_wheels(given or {}, values)
    for key, sd in stated.items():
        _refuse_absurd(model, key, sd)
    found = {}
    for key in values:
        if key in stated:
            found[key] = Deviation(stated[key], GIVEN) if stated[key] else Deviation(0.0, EXACT, "given as 0")
        elif key not in UNUSED and key not in model.tied:
            known = _stated(model, key)
            found[key] = known or (_default(model, values, key) if assume else Deviation(0.0, EXACT, "not stated"))
    return found


def _stated(model: Model, key: str) -> Deviation | None:
    """What a source says: the bicycle's file, the tyre's table, or that a number has no spread."""
    if key in model.bicycle.sd:
        sd = model.bicycle.sd[key]
        return Deviation(sd, FILE) if sd else Deviation(0.0, EXACT, "stated as 0")
    if model.covariance.origin == MODEL_FILE and model.sd.get(key) == 0:
        return Deviation(0.0, EXACT, "stated as 0")
    if model.sd.get(key) and key not in model.assumed_sd:
        return Deviation(model.sd[key], model.covariance.origin if key in model.covariance.names else TABLE)
    if key == "g":
        return Deviation(0.0, EXACT, "known")
    return Deviation(0.0, EXACT, "switched off") if _switched_off(model, key) else None


def _default(model: Model, values: Mapping[str, float], key: str) -> Deviation:
    if key in UNITS:
        row = next(row for row in DEFAULTS if key in row.keys)
        sd, why = row.size * _scale(row, values, key), row.why
    elif model.sd.get(key):  # of a measured tyre whose source states none
        of = " of either stiffness" if ParameterKey.parse(key).name == "relaxation_length" else ""
        sd, why = model.sd[key], f"{CORNERING_STIFFNESS:.0%}{of}, the tyre's source states none"
    else:
        sd, why = EFFECT * abs(values[key]), f"{EFFECT:.0%} of the value"
    return Deviation(sd, ASSUMED, why) if sd else Deviation(0.0, EXACT, "its value is 0")


def _scale(row: Default, values: Mapping[str, float], key: str) -> float:
    if row.of == "value":
        return abs(values[key])
    frame = key[:2]
    return math.sqrt(values[f"{frame}xx"] * values[f"{frame}zz"]) if row.of == "xx and zz" else 1.0


def _switched_off(model: Model, key: str) -> bool:
    own = ParameterKey.parse(key)
    neutral = next((p.neutral for e in model.effects if e.identifier == own.effect for p in e.parameters
                    if p.name == own.name), None)  # fmt: skip
    return neutral is not None and model.parameters[key] == neutral


def _refuse_absurd(model: Model, key: str, sd: float) -> None:
    """Refuse a standard deviation of which no measurement, and no guess, is so bad: it is in another unit."""
    if key in UNITS:
        most, other = MOST[UNITS[key]]
        if sd > most:
            raise InputError(
                f"the standard deviation of {key} = {sd:g} is more than {most:g} {UNITS[key]}; is it in {other}?"
            )
        return
    own = ParameterKey.parse(key)
    known = [p for e in model.effects if e.identifier == own.effect for p in e.parameters if p.name == own.name]
    for p in known:
        low, high = p.typical
        if sd > max(high - low, abs(model.parameters[key])):
            unit = "" if p.unit == "1" else f" {p.unit}"
            raise InputError(
                f"the standard deviation of {key} is {sd:g}{unit}, more than the value and more than its usual values "
                f"{low:g} .. {high:g}{unit} differ; is it in another unit?"
            )


def _both_wheels(given: Mapping[str, float], values: Mapping[str, float]) -> dict[str, float]:
    found: dict[str, float] = {}
    for key, sd in given.items():
        keys = entries_of(key, set(values) - set(UNUSED))
        if not keys:
            raise InputError(f"standard deviation: {unknown('parameter', key, set(values) - set(UNUSED))}")
        if not is_number(sd) or not 0 <= sd < math.inf:
            raise InputError(f"the standard deviation of {key} is {shown(sd)}; it must be finite and >= 0 (SI units)")
        found |= dict.fromkeys(keys, float(sd))
    return found
