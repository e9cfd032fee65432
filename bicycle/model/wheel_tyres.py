"""Tyres at the wheels of a bicycle: what a model file names, and the parameters of effects that follow."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.effects.effect import WHEELS, Effect, Parameter
from bicycle.effects.effect_registry import effect_class, registry
from bicycle.equations.evaluation import evaluator
from bicycle.model.default_sd import CORNERING_STIFFNESS
from bicycle.parameters.bicycle import Bicycle, bodies, static_loads
from tyre.ground.errors import InputError, Note, is_number, shown
from tyre.ground.units import PASCAL_PER_BAR
from tyre.laws.formula_tyre import FormulaTyre
from tyre.maps.find_tyre import CHOICE, is_file_name, read_tyre
from tyre.measured.properties import (
    JointCovariance,
    JointProperties,
    TyreProperties,
    TyreSource,
    out_of_reach,
    wheel_properties,
)

TYRE_KEYS = ("tyre", "surface", "pressure_bar")
EXTRAPOLATE, CAMBER_MOMENT = "extrapolate", "camber_moment"
MOST_BAR = 20.0  # no bicycle tyre holds more; a pressure in kPa or Pa is caught here


def _condition(wheel: str, p: TyreProperties) -> str:
    pressure = "" if p.pressure != p.pressure else f" {p.pressure / PASCAL_PER_BAR:g} bar,"
    return f"{wheel} {p.load:.0f} N,{pressure} {p.origin}"


def tyre_notes(properties: Mapping[str, TyreProperties]) -> list[str]:
    """Notes of each wheel's tyre, one for both wheels where it is the same."""
    inside = all(p.inside for p in properties.values())
    places: dict[tuple[str, str], list[str]] = {}
    conditions: dict[str, list[str]] = {}
    for wheel, p in properties.items():
        subject, condition = f"{p.tyre} on {p.surface}", _condition(wheel, p)
        conditions.setdefault(subject, []).append(condition + ", synthetic" * p.synthetic)
        for note in p.notes:
            places.setdefault((subject, note), []).append(condition)
    return [
        Note(f"{subject} ({'; '.join(at)}): {note}", subject, "; ".join(conditions[subject]), inside=inside)
        for (subject, note), at in places.items()
    ]


def located(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The ``table`` of a contact law with the files of tyres, relative to ``folder``, made absolute.

    ``camber_moment`` becomes part of the file names; a pressure that is not given is the one that the tyres hold.
    """
    if "tyre" not in table:
        return dict(table)
    located_table = {key: value for key, value in table.items() if key != CAMBER_MOMENT}
    choice = f"{CHOICE}{table[CAMBER_MOMENT]}" if CAMBER_MOMENT in table else ""
    tyres = table["tyre"] if isinstance(table["tyre"], Mapping) else dict.fromkeys(WHEELS, table["tyre"])
    located_table["tyre"] = {
        w: f"{tyre_file(tyre, folder)}{choice}" if choice else tyre_file(tyre, folder) for w, tyre in tyres.items()
    }
    if "pressure_bar" not in table and all(isinstance(tyre, str) for tyre in located_table["tyre"].values()):
        pressures = {wheel: read_tyre(tyre).default_pressure for wheel, tyre in located_table["tyre"].items()}
        if None not in pressures.values():
            located_table["pressure_bar"] = {wheel: (p or 0.0) / PASCAL_PER_BAR for wheel, p in pressures.items()}
            if not isinstance(table["tyre"], Mapping):
                located_table["pressure_bar"] = located_table["pressure_bar"][WHEELS[0]]
    if not isinstance(table["tyre"], Mapping):
        located_table["tyre"] = located_table["tyre"][WHEELS[0]]
    return located_table


def tyre_file(tyre: Any, folder: Path) -> Any:
    """An absolute path where ``tyre`` is given by its file, relative to ``folder``; else what was given."""
    if not (isinstance(tyre, str) and is_file_name(tyre)):
        return tyre
    if "\0" in tyre:
        raise InputError(f"tyre = {tyre!r} is no file name; it holds a NUL character")
    return (folder / tyre).resolve().as_posix()


def wheel_sources(tyre: Mapping[str, Any], surface: Mapping[str, Any]) -> dict[str, TyreSource]:
    """The tyre of each wheel by ``tyre`` and ``surface``; by default flat, or that of the file."""
    for name, choice in (("tyre", tyre), ("surface", surface)):
        for wheel, value in choice.items():
            if not isinstance(value, str) and not (name == "surface" and value is None):
                raise InputError(f"{name} = {value!r} of the {wheel} wheel must be a name in quotes")
    return {wheel: read_tyre(tyre[wheel], surface=surface[wheel]).assuming(CORNERING_STIFFNESS) for wheel in WHEELS}


def tyre_loads(effects: Iterable[Effect], values: Mapping[str, Any]) -> tuple[Any, Any]:
    """Loads of the bicycle's wheels at rest (N, rear first), moved by those of the effects that move load.

    ``values`` are numbers or (m,) each, SI, of the bicycle and of these effects.
    """
    kinds = tuple(type(effect) for effect in effects if effect.moves_load)
    if not kinds:
        return static_loads(bodies(values), values["w"], values["g"])
    return evaluator((*kinds, effect_class("no_slip"))).wheel_loads(values)[:2]


def joint_wheel_tyres(
    *,
    tyre: Any,
    surface: Any,
    pressure_bar: Any,
    bicycle: Bicycle,
    extrapolate: Any = False,
    effects: Iterable[Effect] = (),
) -> JointProperties:
    """Properties of the tyres of rear and front wheel at their loads, with their joint covariance."""
    if not isinstance(extrapolate, bool):
        raise InputError(f"{EXTRAPOLATE} = {shown(extrapolate)} must be true or false")
    choices = {}
    for name, value in (("tyre", tyre), ("surface", surface), ("pressure_bar", pressure_bar)):
        per_wheel = value if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
        if set(per_wheel) != set(WHEELS):
            raise InputError(f"{name} has the keys {', '.join(map(str, per_wheel))}; give rear and front, or one value")
        choices[name] = per_wheel
    sources = wheel_sources(choices["tyre"], choices["surface"])
    conditions = []
    values = dict(bicycle.values)
    for effect in effects:
        values |= effect.values(bicycle.values)
    for wheel, load in zip(WHEELS, tyre_loads(effects, values), strict=True):
        pressure = choices["pressure_bar"][wheel]
        none = pressure != pressure and sources[wheel].default_pressure is not None  # its values have no pressure
        if not none and not (is_number(pressure) and 0 < pressure <= MOST_BAR):
            raise InputError(
                f"pressure_bar = {shown(pressure)} of the {wheel} wheel must be a number above 0 "
                f"and up to {MOST_BAR:g} bar"
            )
        refusal = out_of_reach(sources[wheel], load=load, pressure=pressure * PASCAL_PER_BAR)
        if refusal and not extrapolate:
            raise InputError(
                f"{wheel} wheel: {refusal}; use a bicycle and pressures closer to the tests, or allow extrapolation: "
                f"{EXTRAPOLATE} = true in the table of the effect (--{EXTRAPOLATE} on the command line)"
            )
        conditions.append((load, pressure * PASCAL_PER_BAR))
    return wheel_properties([sources[wheel] for wheel in WHEELS], conditions)


def wheel_curves(effects: Mapping[str, Any]) -> dict[str, tuple[FormulaTyre, float]]:
    """Tyres of the contact law that hold full curves, and their pressures (Pa), by wheel; {} unless both do."""
    table = next((table for table in effects.values() if isinstance(table, Mapping) and "tyre" in table), None)
    if table is None:
        return {}
    choices: dict[str, Any] = {
        key: value if isinstance(value := table.get(key), Mapping) else dict.fromkeys(WHEELS, value)
        for key in ("tyre", "surface", "pressure_bar")
    }
    curves = {}
    for wheel, source in wheel_sources(choices["tyre"], choices["surface"]).items():
        if not isinstance(source, FormulaTyre):
            return {}
        pressure = choices["pressure_bar"][wheel] * PASCAL_PER_BAR
        try:
            source.lateral_force(slip_angle=0.0, load=source.loads[0], pressure=pressure)
        except InputError:
            return {}
        curves[wheel] = source, pressure
    return curves


TRAIL = "pneumatic_trail"
FROM_TYRE = "tyre"
"""Value of a parameter that the tyre of the contact law gives."""


@dataclass(frozen=True)
class MountedTyres:
    """The tyres of a model: the contact law that names them, and their properties per wheel."""

    law: str  # identifier of the contact law that names them
    properties: Mapping[str, TyreProperties]  # wheel, rear and front -> what its tyre holds at its load and pressure
    # of both wheels, with their covariance; None: only which parameters they give is asked
    joint: JointProperties | None = None

    def covariance(self, kind: type[Effect], from_tyre: Sequence[tuple[Parameter, tuple[str, ...]]]) -> JointCovariance:
        """Covariance of the values that the tyres give an effect, as far as it is known or assumed."""
        assert self.joint is not None
        names = {
            f"{p.tyre}.{row}": f"{kind.identifier}.{p.name}.{wheel}"
            for row, wheel in enumerate(WHEELS)
            for p, wheels in from_tyre
            if wheel in wheels
        }
        covariance = self.joint.joint
        return covariance.renamed({name: parameter for name, parameter in names.items() if name in covariance.names})

    def values(self, kind: type[Effect], parameter: Parameter, wheels: Iterable[str]) -> dict[str, float]:
        """Values of a parameter that the tyres of these wheels hold."""
        values = {wheel: getattr(self.properties[wheel], parameter.tyre) for wheel in wheels}
        for wheel, value in values.items():
            if value is None or value != value:
                p, (low, high) = self.properties[wheel], parameter.typical
                raise InputError(
                    f"effect {kind.identifier!r}: {p.tyre} on {p.surface} holds no "
                    f"{parameter.tyre.replace('_', ' ')}; give {parameter.name} a number ({parameter.unit}, typical "
                    f"{low:g} .. {high:g}){' or take side_slip' if kind.slot == 'contact law' else ''}"
                )
        return values


def mounted_tyres(tables: Mapping[str, Mapping[str, Any]], folder: Path, bicycle: Bicycle) -> MountedTyres | None:
    """The tyres that the effects of a model file name; None where none does.

    A tyre is the name of a packaged one, or a file: a table such as ``velotyre tyre fit`` writes, a .tir file or
    Pacejka-89 coefficients. Conditions farther outside its loads or pressures than their range is wide are refused
    unless the table has ``extrapolate = true``.
    """
    mounted: MountedTyres | None = None
    for identifier, table in tables.items():
        if not any(key in table for key in TYRE_KEYS):
            continue
        kind = effect_class(identifier)
        where = f"effect {kind.identifier!r}"
        if kind.slot != "contact law" or not kind.parameters:
            raise InputError(f"{where} does not take a tyre; only side_slip and relaxation_length do")
        if mounted is not None:
            raise InputError(
                f"effects {mounted.law!r} and {identifier!r} exclude each other: both are the contact law of the "
                "model; keep one"
            )
        table = located(table, folder)
        for key in ("tyre", "pressure_bar"):
            if key not in table:
                raise InputError(
                    f"{where}: {key} is missing; a measured tyre needs tyre and pressure_bar (and surface)"
                )
        joint = joint_wheel_tyres(
            tyre=table["tyre"],
            surface=table.get("surface"),
            pressure_bar=table["pressure_bar"],
            bicycle=bicycle,
            extrapolate=table.get(EXTRAPOLATE, False),
            effects=[kind(**tables[name]) for name in tables if (kind := effect_class(name)).moves_load],
        )
        mounted = MountedTyres(identifier, dict(zip(WHEELS, joint.properties, strict=True)), joint)
    return mounted


def with_tyre_values(
    kind: type[Effect], table: Mapping[str, Any], tyres: MountedTyres | None, present: Mapping[str, Any]
) -> tuple[dict[str, Any], JointCovariance, list[str]]:
    """The table of an effect with numbers where a tyre gives them, their covariance, and names with an assumed sd."""
    is_law, where = tyres is not None and tyres.law == kind.identifier, f"effect {kind.identifier!r}"
    filled = {
        key: value for key, value in table.items() if not is_law or key not in (*TYRE_KEYS, EXTRAPOLATE, CAMBER_MOMENT)
    }
    assumed: list[str] = []
    from_tyre = list(_taken_from_tyre(kind, table, tyres))
    for parameter, wheels in from_tyre:
        if tyres is None:
            raise InputError(
                f'{where}: {parameter.name} = "{FROM_TYRE}" needs a tyre: give '
                "[effects.relaxation_length] or [effects.side_slip] a tyre and pressure_bar"
            )
        if parameter.tyre_beside and parameter.tyre_beside not in present:
            raise InputError(
                f'{where}: {parameter.name} = "{FROM_TYRE}" is the moment of the tyre in addition to '
                f"that of {parameter.tyre_beside}; add [effects.{parameter.tyre_beside}] or give a number"
            )
        value = table.get(parameter.name)
        values = dict(value) if isinstance(value, Mapping) else {}
        filled[parameter.name] = values | tyres.values(kind, parameter, wheels)
        for wheel in wheels:
            p = tyres.properties[wheel]
            sd_is_stated = {
                "cornering_stiffness": p.cornering_stiffness_sd_stated,
                "relaxation_length": p.lateral_stiffness_sd_stated,
            }
            if not sd_is_stated.get(parameter.tyre, True):
                assumed.append(f"{kind.identifier}.{parameter.name}.{wheel}")
    for parameter in kind.parameters:
        missing = parameter.tyre and parameter.default is None and parameter.name not in filled
        if missing and tyres is not None and _holds(tyres, parameter):
            raise InputError(
                f'{where}: {parameter.name} is missing; give a number ({parameter.unit}), or "{FROM_TYRE}" for what '
                "the tyre holds"
            )
    covariance = tyres.covariance(kind, from_tyre) if tyres is not None and from_tyre else JointCovariance()
    return filled, covariance, assumed


def unused_offers(tyres: MountedTyres, present: Mapping[str, Any]) -> list[str]:
    """Notes on a trail that was measured with the tyre and that no effect of the model takes."""
    if any(p.pneumatic_trail_sd is None for p in tyres.properties.values()):
        return []
    values = ", ".join(f"{wheel} {p.pneumatic_trail:.4g}" for wheel, p in tyres.properties.items())
    subject = " / ".join(dict.fromkeys(f"{p.tyre} on {p.surface}" for p in tyres.properties.values()))
    headline = "; ".join(_condition(w, p) + ", synthetic" * p.synthetic for w, p in tyres.properties.items())
    return [
        Note(
            f"{subject}: {parameter.name} for the effect {kind.identifier} was measured too, {values} "
            f'({parameter.unit}), but is not used; [effects.{kind.identifier}] with {parameter.name} = "{FROM_TYRE}" '
            "takes it",
            subject,
            headline,
            inside=all(p.inside for p in tyres.properties.values()),
        )
        for kind in registry().values()
        for parameter in kind.parameters
        if parameter.tyre == TRAIL and kind.identifier not in present
    ]


def values_of_tyres(tables: Mapping[str, Any]) -> dict[str, str]:
    """Parameters of a model file that its tyres give: ``effect.name.wheel`` -> property of `TyreProperties`."""
    law = next((name for name, table in tables.items() if any(key in table for key in TYRE_KEYS)), None)
    tyres = None if law is None else MountedTyres(law, {})
    return {
        f"{identifier}.{parameter.name}.{wheel}": parameter.tyre
        for identifier, table in tables.items()
        for parameter, wheels in _taken_from_tyre(effect_class(identifier), table, tyres)
        for wheel in wheels
    }


def _taken_from_tyre(
    kind: type[Effect], table: Mapping[str, Any], tyres: MountedTyres | None
) -> Iterator[tuple[Parameter, tuple[str, ...]]]:
    """Parameters that a table takes from the tyre, and of which wheels."""
    named = {parameter.name: parameter for parameter in kind.parameters}
    is_law = tyres is not None and tyres.law == kind.identifier
    for name, value in table.items():
        by_wheel = value if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
        wheels = tuple(wheel for wheel in WHEELS if by_wheel.get(wheel) == FROM_TYRE)
        if name in named and wheels and not is_law:
            if not named[name].tyre:
                raise InputError(
                    f'effect {kind.identifier!r}: {name} = "{FROM_TYRE}", but a tyre does not hold it; give a number '
                    f"({named[name].unit})"
                )
            yield named[name], wheels
    if not is_law:
        return
    for parameter in kind.parameters:
        if parameter.tyre and table.get(parameter.name, FROM_TYRE) == FROM_TYRE:
            yield parameter, WHEELS
        elif parameter.tyre and tyres is not None and _holds(tyres, parameter):
            raise InputError(
                f"effect {kind.identifier!r}: give either tyre, surface and pressure_bar or {parameter.name}, not both"
            )


def _holds(tyres: MountedTyres, parameter: Parameter) -> bool:
    values = [getattr(properties, parameter.tyre) for properties in tyres.properties.values()]
    return any(value is not None and value == value for value in values)
