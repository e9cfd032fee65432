"""Tyres of the main study: measured ones at the wheel loads of the bicycle, and the one of a model file."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bicycle.effects.effect import WHEELS
from bicycle.effects.effect_registry import effect_class
from bicycle.model.default_sd import CORNERING_STIFFNESS, EFFECT
from bicycle.model.wheel_tyres import EXTRAPOLATE, TYRE_KEYS, wheel_sources
from bicycle.parameters.bicycle import Bicycle
from studies.main_study.settings import LAW, Settings, Setup, Table
from tyre import TyreMap, TyreProperties, available_tyres, read_tyre
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.find_tyre import is_file_name
from tyre.measured.properties import TyreSource, out_of_reach, wheel_properties

# parameters of the model that a TyreCase gives, in its order
CONTACT = tuple(f"{LAW}.{name}.{wheel}" for wheel in WHEELS for name in ("cornering_stiffness", "relaxation_length"))
GIVEN = "as given"


class WheelTyre(NamedTuple):
    """Properties of the tyre of one wheel under its static load."""

    wheel: str  # rear or front
    cornering_stiffness: float  # N/rad
    cornering_stiffness_sd: float  # N/rad
    relaxation_length: float  # m
    relaxation_length_sd: float  # m
    properties: TyreProperties | None  # None: given as numbers

    @property
    def lateral_stiffness(self) -> float:
        """Lateral stiffness, N/m: cornering stiffness by relaxation length."""
        return self.cornering_stiffness / self.relaxation_length


@dataclass(frozen=True, eq=False)
class TyreCase:
    """One tyre condition on both wheels at their static loads."""

    name: str  # tyre, or rear / front tyre, and surface
    contact: Array  # (4,), N/rad and m: cornering stiffness and relaxation length, rear then front
    covariance: Array  # (4, 4) of ``contact``, in products of its units
    table: Table  # of the contact law, as a model file has it
    pressures_bar: tuple[float, ...]  # bar, rear and front; empty: none is known
    properties: tuple[TyreProperties, ...] = ()  # rear and front; empty for a tyre given as numbers
    tyre: str = ""  # the name without its surface
    surface: str = ""  # as the tyre's file names it; of the rear tyre
    packaged: bool = True  # False: a file of the user, or numbers of a model file
    synthetic: bool = False  # True: computed by a model, not measured
    width: float | None = None  # m, of the rear tyre; None: not known
    out_of_reach: bool = False  # True: a load or pressure is outside the measured range by more than its width

    @property
    def pressure_bar(self) -> float:
        """Inflation pressure, bar, the mean of the wheels; NaN if none is known."""
        return round(float(np.mean(self.pressures_bar)), 6) if self.pressures_bar else float("nan")

    @property
    def condition(self) -> str:
        """Pressure with its unit."""
        if not self.pressures_bar:
            return GIVEN
        rear, front = self.pressures_bar
        return f"{rear:g} bar" if rear == front else f"{rear:g} / {front:g} bar"

    @property
    def extrapolated(self) -> bool:
        """True if a wheel load or the pressure is outside the measured range."""
        return not all(p.inside for p in self.properties)

    @property
    def wheels(self) -> tuple[WheelTyre, WheelTyre]:
        """Properties of the tyres of rear and front wheel."""
        sds = np.sqrt(np.diag(self.covariance))
        rear, front = (
            WheelTyre(
                wheel,
                float(self.contact[2 * k]),
                float(sds[2 * k]),
                float(self.contact[2 * k + 1]),
                float(sds[2 * k + 1]),
                self.properties[k] if self.properties else None,
            )
            for k, wheel in enumerate(WHEELS)
        )
        return rear, front

    @property
    def surface_stated(self) -> bool:
        """False if the file of a wheel's tyre does not state the test surface."""
        return all(p.surface_stated for p in self.properties)

    def apply_to(self, setup: Setup) -> Setup:
        """Put measured pneumatic trail, twisting torque and camber stiffness of the tyre into the case ``setup``."""
        measured_values: dict[str, Any] = {}
        for name, field in (
            ("trail", "pneumatic_trail"),
            ("twisting", "twisting_stiffness"),
            ("camber_share", "camber_stiffness"),
        ):
            values = [getattr(p, field) for p in self.properties]
            if values and None not in values:
                loads = [p.load if name == "camber_share" else 1.0 for p in self.properties]
                measured_values[name] = tuple(float(v / load) for v, load in zip(values, loads, strict=True))
        return replace(setup, **measured_values)

    @property
    def order(self) -> float:
        """Pressure to sort by; a case without one comes first."""
        return self.pressure_bar if self.pressures_bar else 0.0


@dataclass(frozen=True, eq=False)
class Cases:
    """Conditions that are studied, and those that cannot be, each with the reason."""

    studied: tuple[TyreCase, ...]  # by tyre and surface, that of the model file first
    left_out: tuple[str, ...]  # tyre, condition and reason, a sentence each


def tyre_cases(settings: Settings) -> Cases:
    """Gather the conditions of the tyre in question; without one those of every packaged tyre on its surfaces.

    Pressures that were asked for take the place of that of the model file and of the measured ones.
    """
    cases: list[TyreCase] = []
    left_out: list[str] = []
    contact = settings.contact
    if contact is not None and "tyre" not in contact and settings.pressures:
        pressures = ",".join(f"{bar:g}" for bar in settings.pressures)
        raise InputError(
            f"--pressures {pressures}: the model file states the tyre by numbers, [effects.{LAW}], those of one "
            "pressure; write tyre and pressure_bar there, or remove --pressures"
        )
    if contact is not None:
        asked = [{**contact, "pressure_bar": bar} for bar in settings.pressures] if "tyre" in contact else []
        cases += [given_case(table, settings.bicycle) for table in asked or [dict(contact)]]
    refused: dict[tuple[str, str], list[str]] = {}  # tyre on a surface and reason -> its pressures
    for source, measured in _measured_tyres(settings):
        if not settings.pressures and not measured.pressures.size:
            left_out.append(f"{measured.label}: its file states no pressure; give --pressures")
        for pressure in settings.pressures or [p / PASCAL_PER_BAR for p in measured.pressures]:
            table = {
                "tyre": source,
                "surface": measured.surface,
                "pressure_bar": round(float(pressure), 9),
                EXTRAPOLATE: True,
            }
            try:
                packaged = not is_file_name(source)
                cases.append(_measured_case(table, (measured, measured), settings.bicycle, packaged=packaged))
            except InputError as error:
                refused.setdefault((f"{measured.tyre} {measured.surface}", str(error)), []).append(f"{pressure:g}")
    left_out += [f"{tyre} at {', '.join(pressures)} bar: {why}" for (tyre, why), pressures in refused.items()]
    if not cases:
        raise InputError("no tyre can be studied: " + "; ".join(left_out))
    by_condition: dict[tuple[str, str], TyreCase] = {}  # a model file may name a pressure that was measured
    for case in cases:
        by_condition.setdefault((case.name, case.condition), case)
    studied = sorted(by_condition.values(), key=lambda case: case.name != cases[0].name)
    return Cases(tuple(studied), tuple(left_out))


def given_case(table: Table, bicycle: Bicycle) -> TyreCase:
    """Read the tyre of a model file: measured, or numbers with the standard deviation that is assumed for effects."""
    if "tyre" not in table:
        values = effect_class(LAW)(**table).values(bicycle.values)
        contact = np.array([values[key] for key in CONTACT])
        covariance = np.diag((EFFECT * contact) ** 2)
        return TyreCase(
            "tyre of the model file", contact, covariance, dict(table), (), tyre="model file", packaged=False
        )
    tyre, surface = (dict(zip(WHEELS, _per_wheel(table.get(key)), strict=True)) for key in ("tyre", "surface"))
    sources = wheel_sources(tyre, surface)
    return _measured_case(
        {key: table[key] for key in TYRE_KEYS if key in table} | {EXTRAPOLATE: True},  # wheel loads are sampled
        (sources[WHEELS[0]], sources[WHEELS[1]]),
        bicycle,
        packaged=not any(map(is_file_name, tyre.values())),
    )


def _measured_tyres(settings: Settings) -> Iterator[tuple[str, TyreSource]]:
    """Yield name or file, and map: of the tyre in question at its measured pressures, or of all packaged tyres."""
    if settings.contact is not None:
        tyres = {_per_wheel(settings.contact.get(key)) for key in ("tyre", "surface")}
        alike = "tyre" in settings.contact and all(rear == front for rear, front in tyres)
        names = [_per_wheel(settings.contact["tyre"])[0]] if alike and not settings.pressures else []
        surface = _per_wheel(settings.contact.get("surface"))[0]
    else:
        names = [settings.tyre] if settings.tyre else []
        surface = settings.surface
    for tyre in names:
        place = Path(tyre).resolve().as_posix() if is_file_name(tyre) else tyre
        measured = read_tyre(place, surface=surface).assuming(CORNERING_STIFFNESS)
        if settings.contact is None or measured.pressures.size:
            yield place, measured
    if settings.contact is None and not settings.tyre:
        for name, surfaces in available_tyres().items():
            for measured_surface in surfaces:
                yield name, TyreMap.load(name, surface=measured_surface).assuming(CORNERING_STIFFNESS)


def _measured_case(table: Table, tyres: tuple[TyreSource, TyreSource], bicycle: Bicycle, *, packaged: bool) -> TyreCase:
    """Evaluate the tyres of rear and front wheel at the wheel loads and the pressure of the ``table``."""
    rear, front = tyres
    bars = [float(bar) for bar in _per_wheel(table["pressure_bar"])]
    conditions = [(load, bar * PASCAL_PER_BAR) for load, bar in zip(bicycle.static_loads, bars, strict=True)]
    joint = wheel_properties([rear, front], conditions)
    names: dict[str, None] = {}
    for tyre, p in zip(tyres, joint.properties, strict=True):
        if math.isnan(p.relaxation_length):
            raise InputError(
                f"{tyre.label} has no lateral stiffness, so no relaxation length, which the main study requires; add "
                "the result of a lateral stiffness test to its file (lateral_stiffness_N_per_mm of a Pacejka-89 set, "
                "LATERAL_STIFFNESS of a .tir file), or state cornering_stiffness and relaxation_length in a model file"
            )
        marked = tyre.synthetic and "synthetic" not in tyre.tyre.lower()
        names[tyre.tyre + (" (synthetic)" if marked else "")] = None
    name = " / ".join(names)
    used = [0, 2, 3, 5]  # C and relaxation length among C, K, relaxation length of two wheels
    contact = []
    for p in joint.properties:
        contact += [p.cornering_stiffness, p.relaxation_length]
    return TyreCase(
        f"{name} {rear.surface}",
        np.array(contact),
        joint.covariance[np.ix_(used, used)],
        table,
        (bars[0], bars[1]),
        joint.properties,
        tyre=name,
        surface=rear.surface,
        packaged=packaged,
        synthetic=any(tyre.synthetic for tyre in tyres),
        width=rear.width,
        out_of_reach=any(
            out_of_reach(tyre, load=load, pressure=pressure)
            for tyre, (load, pressure) in zip(tyres, conditions, strict=True)
        ),
    )


def _per_wheel(value: Any) -> tuple[Any, Any]:
    """Read the rear and front value of a key that holds one for both wheels or a table of two."""
    return (value["rear"], value["front"]) if isinstance(value, Mapping) else (value, value)
