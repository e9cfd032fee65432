"""Numbers of effects as a model file writes them: plain, or text with a standard uncertainty, ``"5400(300)"``."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bicycle.effects.effect import DAMPING_RATIO, Effect
from bicycle.effects.effect_registry import effect_class
from bicycle.model.wheel_tyres import FROM_TYRE
from bicycle.parameters.parameter_covariance import MODEL_FILE, WHEELS, ParameterCovariance
from tyre.ground.number_with_sd import measured_number


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
    return {DAMPING_RATIO: ""} | {p.name: "" if p.unit == "1" else p.unit for p in kind.parameters}


def _plain(value: Any, where: str, name: str, unit: str, key: str, sd: dict[str, float]) -> Any:
    """Number of a text; its standard uncertainty is put into ``sd`` under ``key``."""
    if not isinstance(value, str) or value == FROM_TYRE:
        return value
    number = measured_number(value, where=where, key=name, si=unit)
    if number.sd is not None:
        sd[key] = number.sd
    return number.value


def effect_covariance(
    sd: Mapping[str, float], values: Mapping[str, float], ratios: Mapping[str, float]
) -> ParameterCovariance:
    """Covariance of parameters of effects with standard uncertainties ``sd``, of a model with ``values`` (SI).

    One number of both wheels has one error. That of a damping ratio, of an effect among ``ratios``, becomes that of
    the damping, which is proportional to it.
    """
    damping_per_ratio = {
        effect: values[f"{effect}.damping"] / ratio if ratio else 0.0 for effect, ratio in ratios.items()
    }
    rows: dict[str, dict[str, float]] = {}
    for key, spread in sd.items():
        effect, _, name = key.partition(".")
        if name == DAMPING_RATIO:  # the damping is proportional to it
            rows[key] = {f"{effect}.damping": spread * damping_per_ratio[effect]}
            continue
        rows[key] = {entry: spread for entry in (key, *(f"{key}.{wheel}" for wheel in WHEELS)) if entry in values}
    names = tuple(dict.fromkeys(name for row in rows.values() for name in row))
    factor = np.array([[row.get(name, 0.0) for row in rows.values()] for name in names]).reshape(len(names), len(rows))
    return ParameterCovariance(names, factor @ factor.T, origin=MODEL_FILE, of_file=names)
