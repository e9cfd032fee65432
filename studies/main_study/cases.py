"""The tyres of the main study: measured ones at the bicycle's wheel loads, and the one that a model file gives."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.default_sd import CORNERING_STIFFNESS, EFFECT
from bicycle.effect import WHEELS, effect_class
from bicycle.files.wheel_tyres import EXTRAPOLATE, TYRE_KEYS, wheel_sources
from bicycle.parameters import Bicycle
from studies.main_study.settings import Settings, Table
from tyre import TyreMap, TyreProperties, available_tyres, read_tyre
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.find_tyre import is_file_name
from tyre.tyre_source import TyreSource, out_of_reach
from tyre.wheels import wheel_properties

CONTACT = tuple(
    f"relaxation_length.{name}.{wheel}" for wheel in WHEELS for name in ("cornering_stiffness", "relaxation_length")
)
"""Parameters of the model that a :class:`TyreCase` gives, in its order."""
GIVEN = "as given"
USED = np.ix_([0, 2, 3, 5], [0, 2, 3, 5])  # C and relaxation length among C, K, relaxation length of two wheels


@dataclass(frozen=True, eq=False)
class TyreCase:
    """One tyre condition on both wheels at their static loads.

    ``contact`` (4,) is cornering stiffness (N/rad) and relaxation length (m), rear then front; ``covariance`` (4, 4) is
    theirs, with what the two wheels share. ``table`` is the case as the table of a contact law in a model file.
    ``properties`` are those of rear and front wheel where a measured tyre gave them, ``width`` (m) is the tyre's, and
    it is ``out_of_reach`` where a load or pressure is farther outside the measured ones than their range is wide.
    """

    name: str
    contact: Array
    covariance: Array
    table: Table
    pressures_bar: tuple[float, ...]
    properties: tuple[TyreProperties, ...] = ()
    tyre: str = ""
    surface: str = ""
    packaged: bool = True
    synthetic: bool = False
    width: float | None = None
    out_of_reach: bool = False

    @property
    def pressure_bar(self) -> float:
        """Inflation pressure, bar, the mean of the wheels; NaN where none is known."""
        return round(float(np.mean(self.pressures_bar)), 6) if self.pressures_bar else float("nan")

    @property
    def condition(self) -> str:
        """The pressure in words."""
        if not self.pressures_bar:
            return GIVEN
        rear, front = self.pressures_bar
        return f"{rear:g} bar" if rear == front else f"{rear:g} / {front:g} bar"

    @property
    def extrapolated(self) -> bool:
        """True where a wheel load or the pressure is outside the measured range."""
        return not all(one.inside for one in self.properties)


@dataclass(frozen=True, eq=False)
class Cases:
    """What is studied, and what could not be: conditions in words with the reason.

    The question is about the tyre of the first case, and about that case where a model file gives it.
    """

    found: tuple[TyreCase, ...]
    left_out: tuple[str, ...]


def tyre_cases(settings: Settings) -> Cases:
    """The tyre in question first, then every packaged tyre, each on its surfaces and at each pressure.

    A condition about which a tyre's table says nothing (a stiffness that extrapolates to zero) is left out and told.

    Raises
    ------
    InputError
        A file that cannot be read or is no tyre table, two tables with the same name and surface, or nothing is left.
    """
    found: list[TyreCase] = []
    left_out: list[str] = []
    if settings.contact is not None:
        found += given_cases(settings.contact, settings.bicycle, settings.pressures)
    for source, measured, packaged in measured_tyres(settings.tyres):
        if not settings.pressures and not measured.pressures.size:
            left_out.append(f"{measured.label}: its file states no pressure; give some")
        for pressure in settings.pressures or [one / PASCAL_PER_BAR for one in measured.pressures]:
            table = {"tyre": source, "surface": measured.surface, "pressure_bar": round(float(pressure), 9),
                     EXTRAPOLATE: True}  # fmt: skip
            try:
                found.append(measured_case(table, dict.fromkeys(WHEELS, measured), settings.bicycle, packaged=packaged))
            except InputError as error:
                left_out.append(f"{measured.tyre} {measured.surface} at {pressure:g} bar: {error}")
    if not found:
        raise InputError("no tyre can be studied: " + "; ".join(left_out))
    return Cases(tuple(subject_first(once(found))), tuple(left_out))


def once(found: Sequence[TyreCase]) -> list[TyreCase]:
    """Every condition once: a model file may name one at which a table is studied anyway.

    Raises
    ------
    InputError
        Two different tyres have the same name and surface.
    """
    kept: dict[tuple[str, str], TyreCase] = {}
    sources: dict[str, set[Any]] = {}
    for case in found:
        source = set(per_wheel(case.table.get("tyre")))
        if sources.setdefault(case.name, source) != source:
            file = next(one for one in sources[case.name] if is_file_name(one))
            raise InputError(f"{file}: there is another {case.name}; rename the tyre in its .toml")
        kept.setdefault((case.name, case.condition), case)
    return list(kept.values())


def subject_first(found: Sequence[TyreCase]) -> Iterator[TyreCase]:
    """The tyre in question, with all its pressures, before the others."""
    name = found[0].name
    yield from (case for case in found if case.name == name)
    yield from (case for case in found if case.name != name)


def measured_tyres(files: Sequence[str]) -> Iterator[tuple[str, TyreSource, bool]]:
    """Source as in a model file, map, and whether it is packaged: those of ``files``, then all that are packaged."""
    packaged: list[tuple[str, TyreSource]] = [
        (name, TyreMap.load(name, surface=on).assuming(CORNERING_STIFFNESS))
        for name, surfaces in available_tyres().items()
        for on in surfaces
    ]
    seen = {(one.tyre, one.surface) for _, one in packaged}
    for file in files:
        if not is_file_name(file):
            raise InputError(
                f"tyre {file!r} is no file of a tyre table (.csv), .tir or Pacejka-89 file; the packaged tyres are "
                "studied anyway"
            )
        measured = read_tyre(Path(file).resolve().as_posix()).assuming(CORNERING_STIFFNESS)
        if (measured.tyre, measured.surface) in seen:
            raise InputError(
                f"{file}: there is another {measured.tyre} {measured.surface}; rename the tyre in its .toml"
            )
        seen.add((measured.tyre, measured.surface))
        yield Path(file).resolve().as_posix(), measured, False
    for name, measured in packaged:
        yield name, measured, True


def measured_case(table: Table, tyres: Mapping[str, TyreSource], bicycle: Bicycle, *, packaged: bool) -> TyreCase:
    """A measured tyre, or one on each wheel, at the wheel loads.

    Parameters
    ----------
    table : Table
        Of a model file: tyre, surface and pressure, each for both wheels or {rear, front}.
    tyres : mapping of str to TyreSource
        By the tyre as the table names it.
    bicycle : Bicycle
        Whose wheel loads are taken.
    packaged : bool
        Whether the tyre comes with velotyre; a user's file is called by its name.

    Raises
    ------
    InputError
        A condition about which the table says nothing.
    """
    bars = [float(one) for one in per_wheel(table["pressure_bar"])]
    at = [(load, bar * PASCAL_PER_BAR) for load, bar in zip(bicycle.static_loads, bars, strict=True)]
    rear, front = (tyres[wheel] for wheel in WHEELS)
    joint = wheel_properties([rear, front], at)
    properties, covariance = joint.properties, joint.covariance[USED]
    for one, p in zip((rear, front), properties, strict=True):
        if math.isnan(p.relaxation_length):
            raise InputError(
                f"{one.label} holds no lateral stiffness, so no relaxation length, which the main study is about; add "
                "what a pull test gives to its file (lateral_stiffness_N_per_mm of a Pacejka-89 set, LATERAL_STIFFNESS "
                "of a .tir file)"
            )
    names = list(dict.fromkeys(named(one) for one in (rear, front)))
    return TyreCase(
        f"{' / '.join(names)} {rear.surface}", joint_mean(*properties), covariance, table, (bars[0], bars[1]),
        properties, " / ".join(names), rear.surface, packaged, any(one.synthetic for one in (rear, front)),
        rear.width,
        any(out_of_reach(one, load=load, pressure=p) for one, (load, p) in zip((rear, front), at, strict=True)),
    )  # fmt: skip


def named(measured: TyreSource) -> str:
    """Name of a tyre, and whether its values are synthetic."""
    said = "synthetic" in measured.tyre.lower()
    return measured.tyre + (" (synthetic)" if measured.synthetic and not said else "")


def given_cases(table: Table, bicycle: Bicycle, pressures: Sequence[float]) -> Iterator[TyreCase]:
    """The tyre of a model file as it is there and, where it was measured, at further ``pressures`` (bar)."""
    yield given_case(table, bicycle)
    if "tyre" in table:
        for bar in pressures:
            yield given_case({**table, "pressure_bar": bar}, bicycle)


def given_case(table: Table, bicycle: Bicycle) -> TyreCase:
    """The tyre of a model file: measured, or numbers with the standard deviation that is assumed for effects.

    Raises
    ------
    InputError
        Something is missing or wrong, in the words of the model file.
    """
    if "tyre" not in table:
        effect = effect_class("relaxation_length")(**table)
        values = effect.values(bicycle.values)
        contact = np.array([values[key] for key in CONTACT])
        covariance = np.diag((EFFECT * contact) ** 2)
        return TyreCase("tyre of the model file", contact, covariance, dict(table), (), (), "model file", "", False)
    tyre, surface = (dict(zip(WHEELS, per_wheel(table.get(key)), strict=True)) for key in ("tyre", "surface"))
    return measured_case(
        {key: table[key] for key in TYRE_KEYS if key in table} | {EXTRAPOLATE: True},  # random wheel loads lie around
        wheel_sources(tyre, surface),
        bicycle,
        packaged=not any(map(is_file_name, tyre.values())),
    )


def per_wheel(value: Any) -> tuple[Any, Any]:
    """A ``value`` for both wheels, or {rear, front}, as rear and front; in any unit."""
    return (value["rear"], value["front"]) if isinstance(value, Mapping) else (value, value)


def joint_mean(rear: TyreProperties, front: TyreProperties) -> Array:
    """Cornering stiffness and relaxation length of both wheels, shape (4,), in the order of ``CONTACT``."""
    return np.array([value for p in (rear, front) for value in (p.cornering_stiffness, p.relaxation_length)])
