"""Values of a model file's tyres, put into the tables of its effects."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effect import WHEELS, Effect, Parameter, effect_class, registry
from bicycle.files.wheel_tyres import EXTRAPOLATE, TYRE_KEYS, headline_of, joint_wheel_tyres, located
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError
from tyre.base.notes import Note
from tyre.joint_properties import QUANTITIES, JointProperties
from tyre.properties import TyreProperties

TRAIL = "pneumatic_trail"
FROM_TYRE = "tyre"
"""Value of a parameter that is to be what the tyre of the contact law holds."""


@dataclass(frozen=True)
class MountedTyres:
    """The tyres of a model: the contact law that names them, and their properties per wheel."""

    law: str
    properties: Mapping[str, TyreProperties]
    joint: JointProperties | None = None

    def covariance(self, kind: type[Effect], asked: Sequence[tuple[Parameter, tuple[str, ...]]]) -> ParameterCovariance:
        """Of the values of an effect that the tyres give and whose uncertainty is known or assumed.

        Parameters
        ----------
        kind : type of Effect
        asked : sequence of (Parameter, wheels)
            What it takes, and of which wheels.
        """
        assert self.joint is not None
        taken = [(wheel, p) for wheel in WHEELS for p, wheels in asked if wheel in wheels and p.tyre in QUANTITIES]
        places = [3 * WHEELS.index(wheel) + QUANTITIES.index(p.tyre) for wheel, p in taken]
        chosen, spread = np.ix_(places, places), self.joint.joint.variance_spread or ()
        covariance = ParameterCovariance(
            tuple(f"{kind.identifier}.{p.name}.{wheel}" for wheel, p in taken), self.joint.covariance[chosen],
            tuple(part[chosen] for part in spread),
        )  # fmt: skip
        trails = self.joint.trails
        for parameter, wheels in asked if trails is not None else ():
            if parameter.tyre == TRAIL and trails is not None:
                rows = [WHEELS.index(wheel) for wheel in wheels]
                here = np.ix_(rows, rows)
                covariance = covariance.and_also(ParameterCovariance(
                    tuple(f"{kind.identifier}.{parameter.name}.{wheel}" for wheel in wheels),
                    trails.covariance[here], tuple(part[here] for part in trails.variance_spread),
                ))  # fmt: skip
        return covariance

    def values(self, kind: type[Effect], parameter: Parameter, wheels: Iterable[str]) -> dict[str, float]:
        """What the tyres of these wheels hold of a parameter.

        Parameters
        ----------
        kind : subclass of Effect
            The effect.
        parameter : Parameter
            Of it.
        wheels : iterable of str
            ``rear``, ``front``.

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


@dataclass(frozen=True)
class FilledTable:
    """The table of an effect with values of the tyres.

    Attributes
    ----------
    table : dict
        Without the keys of a tyre; with numbers where a tyre gives them.
    covariance : ParameterCovariance
        Of the values filled in.
    assumed : tuple of str
        Those of its names whose source states no standard deviation: ``CORNERING_STIFFNESS`` of
        :mod:`bicycle.default_sd` stands for it.
    """

    table: dict[str, Any]
    covariance: ParameterCovariance
    assumed: tuple[str, ...]


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
        joint = joint_wheel_tyres(
            tyre=table["tyre"], surface=table.get("surface"), pressure_bar=table["pressure_bar"], bicycle=bicycle,
            extrapolate=table.get(EXTRAPOLATE, False),
        )  # fmt: skip
        found = MountedTyres(identifier, dict(zip(WHEELS, joint.properties, strict=True)), joint)
    return found


def with_tyre_values(
    kind: type[Effect], table: Mapping[str, Any], tyres: MountedTyres | None, present: Mapping[str, Any]
) -> FilledTable:
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
    FilledTable
    """
    filled = {key: value for key, value in table.items() if key not in (*TYRE_KEYS, EXTRAPOLATE)}
    if tyres is None or tyres.law != kind.identifier:
        filled = dict(table)
    assumed: list[str] = []
    asked = list(_asked(kind, table, tyres))
    for parameter, wheels in asked:
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
            if not _stated(tyres.properties[wheel], parameter.tyre):
                assumed.append(f"{kind.identifier}.{parameter.name}.{wheel}")
    for parameter in kind.parameters:
        missing = parameter.tyre and parameter.default is None and parameter.name not in filled
        if missing and tyres is not None and _holds(tyres, parameter):
            raise InputError(
                f"effect {kind.identifier!r}: {parameter.name} is missing; give a number ({parameter.unit}), or "
                f'"{FROM_TYRE}" for what the tyre holds'
            )
    covariance = tyres.covariance(kind, asked) if tyres is not None and asked else ParameterCovariance()
    return FilledTable(filled, covariance, tuple(assumed))


def unused_offers(tyres: MountedTyres, present: Mapping[str, Any]) -> list[str]:
    """Notes on a trail that was measured with the tyre and that no effect of the model takes.

    Parameters
    ----------
    tyres : MountedTyres
    present : mapping
        Effects of the model, by identifier.
    """
    joint = tyres.joint
    if joint is None or joint.trails is None:
        return []
    values = ", ".join(f"{wheel} {p.pneumatic_trail:.4g}" for wheel, p in tyres.properties.items())
    return [
        Note(
            f"{subject}: {parameter.name} for the effect {kind.identifier} was measured too, {values} "
            f'({parameter.unit}), but is not used; [effects.{kind.identifier}] with {parameter.name} = "{FROM_TYRE}" '
            "takes it", subject, headline, inside=all(p.inside for p in joint.properties),
        )
        for kind in registry().values()
        for parameter in kind.parameters
        if parameter.tyre == TRAIL and kind.identifier not in present
        for subject, headline in [headline_of(tyres.properties)]
    ]  # fmt: skip


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
