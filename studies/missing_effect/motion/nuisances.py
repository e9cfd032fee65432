"""How well the bicycle is known: the unknowns that float in every fit, and their prior standard deviations."""

import math
from collections.abc import Mapping

from bicycle.effect import WHEELS
from bicycle.model import Model
from bicycle.parameters import UNITS, UNUSED
from studies.missing_effect.engine.unknown import Unknown
from tyre.errors import InputError, is_number, shown, unknown

LENGTH = {"w": 0.003, "c": 0.003, "rR": 0.001, "rF": 0.001, "xB": 0.01, "zB": 0.01, "xH": 0.01, "zH": 0.01}
"""Default standard deviation of lengths (m): a tape measure, and mass centres by suspension."""

TILT = 0.01  # rad
MASS = 0.005  # relative
INERTIA = 0.05  # relative, torsional pendulum and frame geometry
SPIN = 0.02  # relative, compound pendulum
MOST = {"m": (0.5, "mm"), "rad": (0.3, "degrees"), "kg": (100.0, "g"), "kg m^2": (100.0, "kg mm^2")}
"""Standard deviations of a bicycle's parameters beyond which they are surely in another unit, by unit."""

TYRE = 0.1  # relative, parameters of the effects that the base model contains


def defaults(values: Mapping[str, float]) -> dict[str, float]:
    """Documented standard deviations of a bicycle of which only the values are known (SI)."""
    sd = {**LENGTH, "lam": TILT, "g": 0.0}
    sd |= {key: MASS * values[key] for key in ("mR", "mB", "mH", "mF")}
    sd |= {key: INERTIA * values[key] for key in ("IRxx", "IFxx", "IBxx", "IBzz", "IHxx", "IHzz")}
    sd |= {key: SPIN * values[key] for key in ("IRyy", "IFyy")}
    for frame in ("B", "H"):
        sd[f"I{frame}xz"] = INERTIA * math.sqrt(values[f"I{frame}xx"] * values[f"I{frame}zz"])
    return sd


def nuisances(model: Model, given: Mapping[str, float]) -> tuple[tuple[Unknown, ...], tuple[str, ...]]:
    """Unknowns of the base model with prior sd: as given, else of the bicycle file, else the documented default.

    Parameters
    ----------
    model : Model
    given : mapping
        1-sigma by key of the bicycle, or ``effect.parameter`` (both wheels) or ``effect.parameter.wheel``; 0 fixes it.

    Returns
    -------
    unknowns, notes : tuples
        Without those that are fixed; the notes say which defaults were taken.
    """
    values = model.parameters
    spread = _spread(given, values)
    chosen, assumed = {}, []
    fallback = defaults(values)
    for key in values:
        if key in spread:
            chosen[key] = spread[key]
        elif key in UNITS and key in model.bicycle.sd:
            chosen[key] = model.bicycle.sd[key]
        elif key in UNITS or "." in key:
            chosen[key] = fallback[key] if key in UNITS else TYRE * abs(values[key])
            assumed += [key] if chosen[key] else []
    notes: tuple[str, ...] = ()
    if assumed:
        notes = (f"no uncertainty given for {', '.join(assumed)}: documented defaults are used (1 sigma)",)
    found = [Unknown(key, UNITS.get(key, ""), {key: 1.0}, values[key], sd) for key, sd in chosen.items() if sd > 0]
    return tuple(found), notes


def _spread(given: Mapping[str, float], values: Mapping[str, float]) -> dict[str, float]:
    spread: dict[str, float] = {}
    for key, sd in given.items():
        keys = [key] if key in values else [f"{key}.{wheel}" for wheel in WHEELS if f"{key}.{wheel}" in values]
        if key in UNUSED:
            raise InputError(f"[uncertainty]: {key} has no part in lateral motion; take it out")
        if not keys:
            raise InputError(f"[uncertainty]: {unknown('parameter', key, set(values) - set(UNUSED))}")
        if not is_number(sd) or not 0 <= sd < math.inf:
            raise InputError(
                f"[uncertainty]: {key} = {shown(sd)} must be a standard deviation >= 0 in SI units (0 fixes it)"
            )
        most, other = MOST.get(UNITS.get(key, ""), (math.inf, ""))
        if sd > most:
            raise InputError(f"[uncertainty]: {key} = {sd:g} is more than {most:g} {UNITS[key]}; is it in {other}?")
        spread |= dict.fromkeys(keys, float(sd))
    return spread
