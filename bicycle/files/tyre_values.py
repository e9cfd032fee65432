"""Values of a model file's tyres, put into the tables of its effects."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.effect import WHEELS, Effect, Parameter, effect_class
from bicycle.files.wheel_tyres import EXTRAPOLATE, TYRE_KEYS, located, wheel_tyres
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError
from tyre.properties import TyreProperties

FROM_TYRE = "tyre"
"""Value of a parameter that is to be what the tyre of the contact law holds."""


@dataclass(frozen=True)
class MountedTyres:
    """The tyres of a model: the contact law that names them, and their properties per wheel."""

    law: str
    properties: Mapping[str, TyreProperties]

    def values(self, kind: type[Effect], parameter: Parameter, wheels: Iterable[str]) -> dict[str, float]:
        """What the tyres of these wheels hold of a parameter.

        Raises
        ------
        InputError
            A tyre holds nothing of it; the message says what to give.
        """
        found = {}
        for wheel in wheels:
            properties = self.properties[wheel]
            value = getattr(properties, parameter.tyre)
            if value is None or value != value:
                low, high = parameter.typical
                raise InputError(
                    f"effect {kind.identifier!r}: {properties.tyre} on {properties.surface} holds no "
                    f"{parameter.tyre.replace('_', ' ')}; give {parameter.name} a number ({parameter.unit}, typical "
                    f"{low:g} .. {high:g}){' or take side_slip' * (kind.slot == 'contact law')}"
                )
            found[wheel] = value
        return found


def mounted_tyres(tables: Mapping[str, Mapping[str, Any]], folder: Path, bicycle: Bicycle) -> MountedTyres | None:
    """The tyres that the effects of a model file name; None where none does.

    A tyre is the name of a packaged one, or a file: a table such as ``velotyre tyre fit`` writes, a .tir file or
    Pacejka-89 coefficients. Conditions farther outside its loads or pressures than their range is wide are refused
    unless ``extrapolate = true`` stands in the table.

    Parameters
    ----------
    tables : mapping
        Identifier of an effect -> its table.
    folder : Path
        What files are relative to.
    bicycle : Bicycle
        Its static wheel loads are those of the tyres.
    """
    found: MountedTyres | None = None
    for identifier, table in tables.items():
        if not any(key in table for key in TYRE_KEYS):
            continue
        kind = effect_class(identifier)
        if kind.slot != "contact law" or not kind.parameters:
            raise InputError(
                f"effect {kind.identifier!r} does not take a tyre; only side_slip and relaxation_length do"
            )
        if found is not None:
            raise InputError(
                f"effects {found.law!r} and {identifier!r} exclude each other: both are the contact law of the model; "
                "keep one"
            )
        for key in ("tyre", "pressure_bar"):
            if key not in table:
                raise InputError(
                    f"effect {kind.identifier!r}: {key} is missing; a measured tyre needs tyre and pressure_bar (and "
                    "surface)"
                )
        table = located(table, folder)
        properties = wheel_tyres(
            tyre=table["tyre"], surface=table.get("surface"), pressure_bar=table["pressure_bar"], bicycle=bicycle,
            extrapolate=table.get(EXTRAPOLATE, False),
        )  # fmt: skip
        found = MountedTyres(identifier, properties)
    return found


def with_tyre_values(
    kind: type[Effect], table: Mapping[str, Any], tyres: MountedTyres | None, present: Mapping[str, Any]
) -> tuple[dict[str, Any], dict[str, float], list[str]]:
    """The table of an effect with the values of the tyres in it.

    Parameters
    ----------
    kind : type of Effect
    table : mapping
        As it stands in the model file.
    tyres : MountedTyres, optional
        The tyres of the model.
    present : mapping
        Effects of the model, by identifier.

    Returns
    -------
    table : dict
        Without the keys of a tyre; with numbers where a tyre gives them.
    sd : dict
        One standard deviation of each value filled in whose tyre states one, by parameter key.
    assumed : list of str
        Those of its keys whose source states none: ``CORNERING_STIFFNESS`` of :mod:`bicycle.default_sd` stands for it.
    """
    filled = {key: value for key, value in table.items() if key not in (*TYRE_KEYS, EXTRAPOLATE)}
    if tyres is None or tyres.law != kind.identifier:
        filled = dict(table)
    sd: dict[str, float] = {}
    assumed: list[str] = []
    for parameter, wheels in _asked(kind, table, tyres):
        if tyres is None:
            raise InputError(
                f'effect {kind.identifier!r}: {parameter.name} = "{FROM_TYRE}" needs a tyre: give '
                "[effects.relaxation_length] or [effects.side_slip] a tyre and pressure_bar"
            )
        if parameter.tyre_beside and parameter.tyre_beside not in present:
            raise InputError(
                f'effect {kind.identifier!r}: {parameter.name} = "{FROM_TYRE}" is what the moment of the tyre has '
                f"beside that of {parameter.tyre_beside}; add [effects.{parameter.tyre_beside}] or give a number"
            )
        given = table.get(parameter.name)
        values = dict(given) if isinstance(given, Mapping) else {}
        filled[parameter.name] = values | tyres.values(kind, parameter, wheels)
        for wheel in wheels:
            properties, key = tyres.properties[wheel], f"{kind.identifier}.{parameter.name}.{wheel}"
            deviation = getattr(properties, f"{parameter.tyre}_sd", None)
            if deviation is not None:
                sd[key] = deviation
            if not _stated(properties, parameter.tyre):
                assumed.append(key)
    for parameter in kind.parameters:
        missing = parameter.tyre and parameter.default is None and parameter.name not in filled
        if missing and tyres is not None and _holds(tyres, parameter):
            raise InputError(
                f"effect {kind.identifier!r}: {parameter.name} is missing; give a number ({parameter.unit}), or "
                f'"{FROM_TYRE}" for what the tyre holds'
            )
    return filled, sd, assumed


def values_of_tyres(tables: Mapping[str, Any]) -> dict[str, str]:
    """Parameters of a model file that its tyres give: ``effect.name.wheel`` -> property of `TyreProperties`.

    Parameters
    ----------
    tables : mapping
        Identifier of an effect -> its table.
    """
    law = next((name for name, table in tables.items() if any(key in table for key in TYRE_KEYS)), None)
    tyres = None if law is None else MountedTyres(law, {})
    return {
        f"{identifier}.{parameter.name}.{wheel}": parameter.tyre
        for identifier, table in tables.items()
        for parameter, wheels in _asked(effect_class(identifier), table, tyres)
        for wheel in wheels
    }


def _asked(
    kind: type[Effect], table: Mapping[str, Any], tyres: MountedTyres | None
) -> Iterator[tuple[Parameter, tuple[str, ...]]]:
    """Parameters that a table takes from the tyre, and of which wheels."""
    named = {parameter.name: parameter for parameter in kind.parameters}
    mine = tyres is not None and tyres.law == kind.identifier
    for name, value in table.items():
        each = value if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
        wheels = tuple(wheel for wheel in WHEELS if each.get(wheel) == FROM_TYRE)
        if name in named and wheels and not mine:
            if not named[name].tyre:
                raise InputError(
                    f'effect {kind.identifier!r}: {name} = "{FROM_TYRE}", but a tyre does not hold it; give a number '
                    f"({named[name].unit})"
                )
            yield named[name], wheels
    for parameter in kind.parameters if mine else ():
        if parameter.tyre and table.get(parameter.name, FROM_TYRE) == FROM_TYRE:
            yield parameter, WHEELS
        elif parameter.tyre and tyres is not None and _holds(tyres, parameter):
            raise InputError(
                f"effect {kind.identifier!r}: give either tyre, surface and pressure_bar or {parameter.name}, not both"
            )


def _holds(tyres: MountedTyres, parameter: Parameter) -> bool:
    values = [getattr(properties, parameter.tyre) for properties in tyres.properties.values()]
    return any(value is not None and value == value for value in values)


def _stated(properties: TyreProperties, name: str) -> bool:
    """Whether the source states a standard deviation where there is one."""
    return {
        "cornering_stiffness": properties.cornering_stiffness_sd_stated,
        "relaxation_length": properties.lateral_stiffness_sd_stated,
    }.get(name, True)
