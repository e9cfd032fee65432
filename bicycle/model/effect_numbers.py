"""Numbers of effects as a model file writes them: plain, or text with a standard uncertainty, ``"5400(300)"``."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import effect_class
from bicycle.effects.sprung_joint import STAND_INS
from bicycle.model.wheel_tyres import FROM_TYRE
from bicycle.parameters.parameter_covariance import MODEL_FILE, WHEELS, ParameterCovariance
from tyre.ground.number_with_sd import measured_number

STEP = 1e-4
"""Step of a numerical derivative, as a share of the number."""


def plain_effects(tables: Mapping[str, Mapping[str, Any]]) -> tuple[dict[str, dict[str, Any]], dict[str, float]]:
    """Separate the tables of effects into plain numbers and their standard uncertainties.

    Parameters
    ----------
    tables : mapping
        Identifier of an effect -> its table; numbers SI, or text such as ``"5400(300)"`` or ``"5400 +/- 6 %"``, also
        in ``{rear = .., front = ..}``.

    Returns
    -------
    tables : dict
        The same with numbers in place of such text; names of tyres and whatever else is text stay.
    sd : dict
        ``effect.name``, or ``effect.name.wheel`` -> standard uncertainty, in the unit of the parameter. One number of
        both wheels stands under ``effect.name``.

    Raises
    ------
    InputError
        An unknown effect, text that is no number, another unit, a negative standard uncertainty.
    """
    plain: dict[str, dict[str, Any]] = {}
    sd: dict[str, float] = {}
    for identifier, table in tables.items():
        units = _units(effect_class(identifier))
        plain[identifier] = dict(table)
        for name, value in table.items():
            if name not in units:
                continue
            where, key = f"effect {identifier!r}", f"{identifier}.{name}"
            if isinstance(value, Mapping):
                per_wheel = {}
                for wheel, number in value.items():
                    per_wheel[wheel] = _plain(number, where, f"{name}.{wheel}", units[name], f"{key}.{wheel}", sd)
                plain[identifier][name] = per_wheel
            else:
                plain[identifier][name] = _plain(value, where, name, units[name], key, sd)
    return plain, sd


def _units(kind: type[Effect]) -> dict[str, str]:
    """SI unit of each parameter of an effect, empty where it has none."""
    declared = (*kind.parameters, *(p for p, _ in STAND_INS.values()))
    return {p.name: "" if p.unit == "1" else p.unit for p in declared}


def _plain(value: Any, where: str, name: str, unit: str, key: str, sd: dict[str, float]) -> Any:
    """Number of a text; its standard uncertainty is put into ``sd`` under ``key``."""
    if not isinstance(value, str) or value == FROM_TYRE:
        return value
    number = measured_number(value, where=where, key=name, si=unit)
    if number.sd is not None:
        sd[key] = number.sd
    return number.value


def effect_covariance(
    sd: Mapping[str, float], values: Mapping[str, float], effects: Sequence[Effect]
) -> ParameterCovariance:
    """Covariance of parameters of effects with standard uncertainties ``sd``, of a model with ``values`` (SI).

    One number of both wheels has one error. A damping ratio or a height above the hub that an effect was given becomes
    parameters that share its error, to first order.
    """
    with_stand_ins = {effect.identifier: effect for effect in effects if effect.stand_ins}
    rows: dict[str, dict[str, float]] = {}
    for key, spread in sd.items():
        identifier, _, name = key.partition(".")
        if identifier in with_stand_ins:
            slopes = _slopes(with_stand_ins[identifier], name, values)
            rows[key] = {entry: spread * slope for entry, slope in slopes.items() if slope}
            continue
        rows[key] = {entry: spread for entry in (key, *(f"{key}.{wheel}" for wheel in WHEELS)) if entry in values}
    names = tuple(dict.fromkeys(name for row in rows.values() for name in row))
    factor = np.array([[row.get(name, 0.0) for row in rows.values()] for name in names]).reshape(len(names), len(rows))
    return ParameterCovariance(names, factor @ factor.T, origin=MODEL_FILE, of_file=names)


def _slopes(effect: Effect, name: str, values: Mapping[str, float]) -> dict[str, float]:
    """Derivative of every parameter of an ``effect`` by the given number ``name``, by central differences.

    A number at the end of what is possible, such as a damping ratio of 0, is moved to one side.
    """
    number = effect.table[name]
    step = STEP * (abs(number) or 1.0)
    sides = []
    for moved in (number - step, number + step) if number else (number, number + step):
        sides.append((moved, type(effect)(**effect.table | {name: moved}).values(values)))
    (low, before), (high, after) = sides
    return {key: (after[key] - before[key]) / (high - low) for key in before}
