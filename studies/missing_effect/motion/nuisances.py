"""How well the bicycle is known: the unknowns that float in every fit, and their prior standard deviations."""

import math
from collections.abc import Mapping

from bicycle.default_sd import ASSUMED, standard_deviations
from bicycle.effect import Parameter, registry
from bicycle.model import Model
from bicycle.parameter_key import ParameterKey, entries_of
from bicycle.parameters import UNITS, UNUSED
from studies.inference.parameter import UncertainParameter
from tyre.base.errors import InputError, is_number, shown, unknown

FINEST, TINIEST = 1e-9, 1e-12  # of the value, and in SI: a smaller stated sd is lost in rounding


def nuisances(model: Model, given: Mapping[str, float]) -> tuple[tuple[UncertainParameter, ...], tuple[str, ...]]:
    """Unknowns of the base model with prior sd, those of :func:`bicycle.default_sd.standard_deviations`.

    Parameters
    ----------
    model : Model
    given : mapping
        1-sigma (SI) by key of the bicycle, ``effect.parameter`` (both wheels) or ``effect.parameter.wheel``; 0 fixes
        it.

    Returns
    -------
    unknowns, notes : tuples
        Without those that are fixed; the notes say which defaults were taken.
    """
    values = model.parameters
    _check(given, values, model)
    deviations = standard_deviations(model, given)
    followers: dict[str, list[str]] = {}
    for follower, leader in model.tied.items():
        followers.setdefault(leader, []).extend([] if follower in deviations else [follower])
    assumed = [key for key, deviation in deviations.items() if deviation.origin == ASSUMED]
    notes: tuple[str, ...] = ()
    if assumed:
        notes = (f"no uncertainty given for {', '.join(assumed)}: documented defaults are used (1 sigma)",)
    found = [
        UncertainParameter(
            key,
            _unit(model, key),
            dict.fromkeys((key, *followers.get(key, ())), 1.0),
            values[key],
            deviation.sd,
            *_bounds(model, key),
        )
        for key, deviation in deviations.items()
        if deviation.sd > 0
    ]
    return tuple(found), notes


def _declared(model: Model, key: str) -> Parameter | None:
    own = ParameterKey.parse(key)
    effects = (effect for effect in model.effects if effect.identifier == own.effect)
    return next((p for effect in effects for p in effect.parameters if p.name == own.name), None)


def _unit(model: Model, key: str) -> str:
    declared = _declared(model, key)
    return declared.unit if declared else UNITS.get(key, "")


def _bounds(model: Model, key: str) -> tuple[float, float]:
    """What an effect declares, so that a lag does not become a lead; the bicycle's own go where the data take them."""
    declared = _declared(model, key)
    return declared.bounds if declared else (-math.inf, math.inf)


def _check(given: Mapping[str, float], values: Mapping[str, float], model: Model) -> None:
    present = {effect.identifier for effect in model.effects}
    for key, sd in given.items():
        absent, _, name = key.partition(".")
        if name and absent in registry() and absent not in present:
            size = name.partition(".")[0]
            raise InputError(
                f"[uncertainty]: unknown parameter {key!r}: the base model has no {absent}; if it is there, write "
                f"[effects.{absent}] {size} = VALUE beside [uncertainty] {key} = {shown(sd)}, and take "
                f"[candidates.{absent}] out, whose values are taken as exact; otherwise take {key} out of [uncertainty]"
            )
        if key in UNUSED:
            raise InputError(f"[uncertainty]: {key} has no part in lateral motion; take it out")
        if not entries_of(key, values):
            raise InputError(f"[uncertainty]: {unknown('parameter', key, set(values) - set(UNUSED))}")
        if not is_number(sd) or not 0 <= sd < math.inf:
            raise InputError(
                f"[uncertainty]: {key} = {shown(sd)} must be a standard deviation >= 0 in SI units (0 fixes it)"
            )
        least = FINEST * max((abs(values[entry]) for entry in entries_of(key, values)), default=0.0)
        if 0 < sd < max(least, TINIEST):
            raise InputError(
                f"[uncertainty]: {key} = {sd:g} is below {max(least, TINIEST):.2g}, a billionth of its value, which no "
                "measurement reaches; give its standard deviation, or 0, which fixes it"
            )
