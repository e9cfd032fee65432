"""The tyres on the wheels of a bicycle: where they are found, and what they are at its static wheel loads."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bicycle.default_sd import CORNERING_STIFFNESS
from bicycle.effect import WHEELS
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError, is_number, shown
from tyre.base.notes import Note
from tyre.base.units import PASCAL_PER_BAR
from tyre.find_tyre import is_file_name, read_tyre
from tyre.joint_properties import JointProperties
from tyre.properties import TyreProperties
from tyre.tyre_source import TyreSource, out_of_reach
from tyre.wheels import wheel_properties

TYRE_KEYS = ("tyre", "surface", "pressure_bar")
EXTRAPOLATE = "extrapolate"
MOST_BAR = 20.0  # no bicycle tyre holds more; a pressure in kPa or Pa is caught here


def headline_of(properties: Mapping[str, TyreProperties]) -> tuple[str, str]:
    """The tyres of the wheels in words, and their conditions.

    Parameters
    ----------
    properties : mapping
        Of each wheel by its name.
    """
    names = dict.fromkeys(f"{p.tyre} on {p.surface}" for p in properties.values())
    return " / ".join(names), "; ".join(
        _condition(wheel, p) + ", synthetic" * p.synthetic for wheel, p in properties.items()
    )


def _condition(wheel: str, p: TyreProperties) -> str:
    return f"{wheel} {p.load:.0f} N, {p.pressure / PASCAL_PER_BAR:g} bar, {p.origin}"


def tyre_notes(properties: Mapping[str, TyreProperties]) -> list[str]:
    """What must be told of each wheel's tyre, once for both wheels where it is the same.

    Parameters
    ----------
    properties : mapping
        Of each wheel by its name.
    """
    inside = all(p.inside for p in properties.values())
    said: dict[tuple[str, str, str], list[str]] = {}
    conditions: dict[str, list[str]] = {}
    for wheel, p in properties.items():
        condition = _condition(wheel, p)
        conditions.setdefault(f"{p.tyre} on {p.surface}", []).append(condition + ", synthetic" * p.synthetic)
        for note in p.notes:
            said.setdefault((p.tyre, p.surface, note), []).append(condition)
    return [
        Note(f"{subject} ({'; '.join(at)}): {note}", subject, "; ".join(conditions[subject]), inside=inside)
        for (name, surface, note), at in said.items()
        for subject in [f"{name} on {surface}"]
    ]


def located(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The ``table`` of a contact law with the files of tyres, relative to ``folder``, made absolute."""
    tyre = table.get("tyre")
    if isinstance(tyre, Mapping):
        return dict(table) | {"tyre": {wheel: tyre_file(one, folder) for wheel, one in tyre.items()}}
    return dict(table) | ({"tyre": tyre_file(tyre, folder)} if "tyre" in table else {})


def tyre_file(tyre: Any, folder: Path) -> Any:
    """An absolute path where ``tyre`` is given by its file, relative to ``folder``; else what was given."""
    if not (isinstance(tyre, str) and is_file_name(tyre)):
        return tyre
    if "\0" in tyre:
        raise InputError(f"tyre = {tyre!r} is no file name; it holds a NUL character")
    return (folder / tyre).resolve().as_posix()


def wheel_sources(tyre: Mapping[str, Any], surface: Mapping[str, Any]) -> dict[str, TyreSource]:
    """The tyre of each wheel by ``tyre`` and ``surface``; without one, a packaged tyre is flat and a file has its own.

    Where its source states no standard deviation, the default one is assumed.
    """
    for name, choice in (("tyre", tyre), ("surface", surface)):
        for wheel, value in choice.items():
            if not isinstance(value, str) and not (name == "surface" and value is None):
                raise InputError(f"{name} = {value!r} of the {wheel} wheel must be a name in quotes")
    return {wheel: read_tyre(tyre[wheel], surface=surface[wheel]).assuming(CORNERING_STIFFNESS) for wheel in WHEELS}


def wheel_tyres(
    *, tyre: Any, surface: Any, pressure_bar: Any, bicycle: Bicycle, extrapolate: Any = False
) -> dict[str, TyreProperties]:
    """Properties of the tyres at each wheel's static load, by wheel. Arguments as :func:`joint_wheel_tyres`.

    Parameters
    ----------
    tyre, surface : str or mapping
        Names.
    pressure_bar : float or mapping, in bar
    bicycle : Bicycle
        Whose static wheel loads are taken.
    """
    tyres = joint_wheel_tyres(
        tyre=tyre, surface=surface, pressure_bar=pressure_bar, bicycle=bicycle, extrapolate=extrapolate
    )
    return dict(zip(WHEELS, tyres.properties, strict=True))


def joint_wheel_tyres(
    *, tyre: Any, surface: Any, pressure_bar: Any, bicycle: Bicycle, extrapolate: Any = False
) -> JointProperties:
    """Properties of the tyres of rear and front wheel at their static loads, with their joint covariance.

    Parameters
    ----------
    tyre, surface : str or {rear, front}
        Name or file; ``flat``, ``drum`` or None.
    pressure_bar : float or {rear, front}
        bar.
    bicycle : Bicycle
        Gives the loads.
    extrapolate : bool
        Let conditions pass that are out of reach of the tyre.

    Raises
    ------
    InputError
        A value that is not allowed, or a condition out of reach of the tyre, unless ``extrapolate`` is True.
    """
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
    for wheel, load in zip(WHEELS, bicycle.static_loads, strict=True):
        pressure = choices["pressure_bar"][wheel]
        if not is_number(pressure) or not 0 < pressure <= MOST_BAR:
            raise InputError(
                f"pressure_bar = {shown(pressure)} of the {wheel} wheel must be a number above 0 "
                f"and up to {MOST_BAR:g} bar"
            )
        beyond = out_of_reach(sources[wheel], load=load, pressure=pressure * PASCAL_PER_BAR)
        if beyond and not extrapolate:
            raise InputError(
                f"{wheel} wheel: {beyond}; take a bicycle and pressures nearer to the tests, or, if a guess will do, "
                f"{EXTRAPOLATE} = true in the table of the effect (--{EXTRAPOLATE} on the command line)"
            )
        conditions.append((load, pressure * PASCAL_PER_BAR))
    return wheel_properties([sources[wheel] for wheel in WHEELS], conditions)
