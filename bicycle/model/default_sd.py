"""One standard deviation of every parameter of a bicycle and its effects, and where it comes from.

What a file does not state is taken from one small table, for every study alike. Methods are those of Moore (2012),
Human Control of a Bicycle, ch. 3: tape measure, scales, suspension, torsional and compound pendulum. The sizes are
those of a careful workshop, a few times the standard deviations published there for the best measured bicycles.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bicycle.effects.effect import Parameter
from bicycle.model.model import Model
from bicycle.parameters.bicycle import UNITS, UNUSED
from bicycle.parameters.parameter_covariance import FILE, MODEL_FILE, TABLE, ParameterKey, entries_of
from tyre.ground.errors import InputError, is_number, shown, unknown

GIVEN, ASSUMED, EXACT = "given", "assumed", "exact"
ORIGINS = (GIVEN, TABLE, FILE, MODEL_FILE, ASSUMED, EXACT)

DEFAULTS = {
    key: (size, of, why)
    for keys, size, of, why in (
        ("w c", 0.003, "SI unit", "tape measure"),
        ("rR rF", 0.001, "SI unit", "rolled out over several turns"),
        ("xB zB xH zH", 0.01, "SI unit", "suspension, photographs"),
        ("lam", 0.01, "SI unit", "digital level"),
        ("mR mB mH mF", 0.005, "value", "scales"),
        ("IRxx IFxx IBxx IBzz IHxx IHzz", 0.05, "value", "torsional pendulum"),
        ("IBxz IHxz", 0.05, "xx and zz", "torsional pendulum at several angles"),
        ("IRyy IFyy", 0.02, "value", "compound pendulum"),
        ("g", 0.0, "SI unit", "known"),
    )
    for key in keys.split()
}
"""Key -> size of one sd, what it is relative to, and how a workshop measures: a bicycle of which only the values are
known."""

EFFECT = 0.1
"""sd over the value of an effect's parameter whose typical range gives no spread, as of a gain of either sign."""

CORNERING_STIFFNESS = 0.03
"""sd(C_alpha) / C_alpha of a tyre whose source states none, and as much of K_y: of a table four fifths of the variance
common to all conditions; of a formula (.tir, Pacejka-89) all of it.

The tables of Dell'Orto et al. scatter by 1.2 to 2.2 % about the smooth MF6.1 law (the rms misfit over nine conditions),
which is what a repeated condition would; load cell, temperature and the difference between two tyres of one make come
on top.
"""


@dataclass(frozen=True)
class Deviation:
    """One standard deviation (SI), its origin (one of ``ORIGINS``) and the reason where there is one."""

    sd: float  # one standard deviation, in the unit of the parameter (SI)
    origin: str  # one of :data:`ORIGINS`
    why: str = ""  # how a workshop measures it, or why it is 0; empty: as given or stated


UNSTATED = Deviation(0.0, EXACT, "not stated")


def standard_deviations(
    model: Model, given: Mapping[str, float] | None = None, *, assume: bool = True, typical: bool = True
) -> dict[str, Deviation]:
    """One standard deviation of every parameter: as given, else stated by its source, else from the table here.

    Without ``typical`` a parameter of an effect is known to a tenth, however wide its typical range.
    """
    values = model.parameters
    names = set(values) - set(UNUSED)
    given_sds: dict[str, float] = {}
    for name, sd in (given or {}).items():
        keys = entries_of(name, names)
        if not keys:
            raise InputError(f"standard deviation: {unknown('parameter', name, names)}")
        if not is_number(sd) or not 0 <= sd < math.inf:
            raise InputError(f"the standard deviation of {name} is {shown(sd)}; it must be finite and >= 0 (SI units)")
        given_sds |= dict.fromkeys(keys, float(sd))
    deviations = {}
    for key in values:
        if key in given_sds:
            _refuse_another_unit(model, key, given_sds[key])
            deviations[key] = (
                Deviation(given_sds[key], GIVEN) if given_sds[key] else Deviation(0.0, EXACT, "given as 0")
            )
        elif key in names and key not in model.tied:
            source = _stated_deviation(model, key)
            deviations[key] = source or (_default(model, values, key, typical=typical) if assume else UNSTATED)
    return deviations


def _stated_deviation(model: Model, key: str) -> Deviation | None:
    """Deviation that a source states: the bicycle's file, the tyre's table, or a number without a spread."""
    if key in model.bicycle.sd:
        sd = model.bicycle.sd[key]
        return Deviation(sd, FILE) if sd else Deviation(0.0, EXACT, "stated as 0")
    if model.covariance.origin_of(key) == MODEL_FILE and model.sd.get(key) == 0:
        return Deviation(0.0, EXACT, "stated as 0")
    if model.sd.get(key) and key not in model.assumed_sd:
        return Deviation(model.sd[key], model.covariance.origin_of(key) if key in model.covariance.names else TABLE)
    if key == "g":
        return Deviation(0.0, EXACT, "known")
    declared = _find_parameter(model, key)
    if declared is not None and declared.chosen:
        return Deviation(0.0, EXACT, "chosen")
    off = declared is not None and declared.neutral is not None and model.parameters[key] == declared.neutral
    return Deviation(0.0, EXACT, "switched off") if off else None


def _find_parameter(model: Model, key: str) -> Parameter | None:
    parameter = ParameterKey.parse(key)
    of_effect = (p for e in model.effects if e.identifier == parameter.effect for p in e.parameters)
    return next((p for p in of_effect if p.name == parameter.name), None)


def _default(model: Model, values: Mapping[str, float], key: str, *, typical: bool) -> Deviation:
    if key in UNITS:
        size, of, why = DEFAULTS[key]
        if of == "xx and zz":
            size *= math.sqrt(values[f"{key[:2]}xx"] * values[f"{key[:2]}zz"])
        sd = size * abs(values[key]) if of == "value" else size
    elif model.sd.get(key):  # of a measured tyre whose source states none
        of = " of either stiffness" if ParameterKey.parse(key).name == "relaxation_length" else ""
        sd, why = model.sd[key], f"{CORNERING_STIFFNESS:.0%}{of}, the tyre's source states none"
    else:
        sd, why = _of_typical_range(_find_parameter(model, key) if typical else None, values[key])
    return Deviation(sd, ASSUMED, why) if sd else Deviation(0.0, EXACT, "its value is 0")


def _of_typical_range(declared: Parameter | None, value: float) -> tuple[float, str]:
    """One sd (SI) of a ``value`` that was not measured, and the reason; a written value is no better than a default."""
    sd = None if declared is None else declared.assumed_sd(value)
    if sd is None or declared is None:
        return EFFECT * abs(value), f"{EFFECT:.0%} of the value"
    low, high = declared.typical
    return sd, f"{low:g} .. {high:g}{'' if declared.unit == '1' else ' ' + declared.unit} is typical"


def _refuse_another_unit(model: Model, key: str, sd: float) -> None:
    """Refuse a standard deviation of which no measurement, and no guess, is so bad: it is in another unit."""
    declared = _find_parameter(model, key)
    if key in UNITS:
        unit = UNITS[key]
        most, likely_unit = {
            "m": (0.5, "mm"),
            "rad": (0.3, "degrees"),
            "kg": (100.0, "g"),
            "kg m^2": (100.0, "kg mm^2"),
            "m/s^2": (1.0, "mm/s^2"),
        }[unit]
        if sd > most:
            raise InputError(
                f"the standard deviation of {key} = {sd:g} is more than {most:g} {unit}; is it in {likely_unit}?"
            )
    elif declared is not None and sd > max(declared.typical[1] - declared.typical[0], abs(model.parameters[key])):
        (low, high), unit = declared.typical, "" if declared.unit == "1" else f" {declared.unit}"
        raise InputError(
            f"the standard deviation of {key} is {sd:g}{unit}, more than the value and more than its usual values "
            f"{low:g} .. {high:g}{unit} differ; is it in another unit?"
        )
