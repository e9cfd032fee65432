"""The same engine on tables of a tyre rig: cornering stiffness on one surface, predicted from that of another.

C(load, pressure) of a reference table, interpolated in logarithms, predicts the other table; candidates are the
drum's curvature, C_drum = C_flat / (1 + R / R_drum)^n, and what may be wrong with the rig: scales of force, slip angle,
load and pressure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from studies.inference.forward import Extra, Residual, Rows
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.rig.measurement import WHEEL_RADIUS
from tyre.base.arrays import Array
from tyre.base.errors import InputError, shown, unknown
from tyre.base.units import PASCAL_PER_BAR
from tyre.drum import log_curvature
from tyre.maps.table_io import read_table
from tyre.maps.tables import MeasuredTable

KEYS = ("reference", "measured")
TOP_KEYS = ("kind", "description", "source", "tyre_tables")
FEWEST = 6  # conditions: the reference is a quadratic in two variables
REPEATABILITY = 0.02  # relative sd of one cornering stiffness (remounting, temperature); the tables state none
SCALES = {"force_scale": 0.02, "slip_angle_scale": 0.02, "load_scale": 0.02, "pressure_scale": 0.03}
"""Calibration errors of a rig, 1 sd."""


@dataclass(frozen=True)
class TyreTables:
    """Tables of one tyre: ``reference`` was known, ``measured`` is to be explained by it.

    Raises
    ------
    InputError
        Tables of two tyres, or too few conditions.
    """

    reference: MeasuredTable
    measured: MeasuredTable
    name: str = "tyre_tables"
    description: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        if self.reference.tyre != self.measured.tyre:
            raise InputError(
                f"tables of two tyres, {self.reference.tyre!r} and {self.measured.tyre!r}; "
                "give one tyre on two surfaces"
            )
        for table in (self.reference, self.measured):
            if len(table.load) < FEWEST:
                raise InputError(
                    f"{table.tyre} on {table.surface}: {len(table.load)} conditions are too few; {FEWEST} are needed"
                )


def read_tyre_tables(content: Mapping[str, Any], path: Path) -> TyreTables:
    """The measurement of a file with kind = "tyre_tables"; paths are relative to it."""
    for key in content:
        if key not in TOP_KEYS:
            raise InputError(unknown("key", key, TOP_KEYS))
    files = content.get("tyre_tables")
    if not isinstance(files, Mapping):
        raise InputError('kind = "tyre_tables" needs a table: write [tyre_tables], reference and measured below it')
    for key in files:
        if key not in KEYS:
            raise InputError(f"[tyre_tables]: {unknown('key', key, KEYS)}")
    for key in KEYS:
        if not isinstance(files.get(key), str):
            what = f"{key} = {shown(files[key])} must be a path in quotes" if key in files else f"no {key}"
            raise InputError(f'[tyre_tables]: {what}; write {key} = "TABLE.csv"')
    reference, measured = (read_table(path.parent / files[key]) for key in KEYS)
    words = {key: content[key] for key in ("description", "source") if key in content}
    return TyreTables(reference, measured, path.stem, **words)


@dataclass(frozen=True)
class RigForward:
    """Logarithm of the cornering stiffness of ``measured``, predicted from ``reference`` (both of one tyre)."""

    reference: MeasuredTable
    measured: MeasuredTable
    without: tuple[str, ...] = ()
    nuisances: tuple[UncertainParameter, ...] = ()
    refused: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = (f"repeatability of a cornering stiffness: {REPEATABILITY:.0%} on each surface",)
    thorough = True

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """The drum's curvature where there is a drum, and the rig's calibration."""
        found = [
            Candidate(name, (UncertainParameter("scale", "1", {name: 1.0}, 0.0, sd, -5 * sd, 5 * sd, size=True),))
            for name, sd in SCALES.items()
        ]
        if self.measured.drum_diameter:
            exponent = UncertainParameter("exponent", "1", {"drum_curvature": 1.0}, 0.0, 0.6, 0.0, 3.0, size=True)
            found.append(Candidate("drum_curvature", (exponent,)))
        return tuple(c for c in found if c.identifier not in self.without)

    @cached_property
    def rows(self) -> Rows:
        """One row a condition; loads are held out in turn."""
        t = self.measured
        where = tuple(
            f"{load:.0f} N, {pressure / PASCAL_PER_BAR:g} bar"
            for load, pressure in zip(t.load, t.pressure, strict=True)
        )
        fold = np.unique(t.load, return_inverse=True)[1]
        name = "cornering stiffness"
        return Rows(where, t.load, (name,) * len(where), fold, axes={name: "load, N"})

    @cached_property
    def _slopes(self) -> dict[str, Array]:
        """d(ln C)/d(coordinate) of each candidate at every condition."""
        t, h = self.measured, 1e-3
        one = np.ones(len(t.load))
        found = {"force_scale": one, "slip_angle_scale": -one}
        at = self._log_reference(t.load, t.pressure)
        found["load_scale"] = (self._log_reference(t.load * (1 + h), t.pressure) - at) / h
        found["pressure_scale"] = (self._log_reference(t.load, t.pressure * (1 + h)) - at) / h
        if t.drum_diameter:
            found["drum_curvature"] = -one * log_curvature(wheel_radius=WHEEL_RADIUS, drum_radius=t.drum_diameter / 2)
        return found

    def _log_reference(self, load: Array, pressure: Array) -> Array:
        """ln C of the reference, quadratic in ln(load) and ln(pressure): six coefficients."""

        def terms(x: Array, y: Array) -> Array:
            u, w = np.log(x / self.reference.load.mean()), np.log(y / self.reference.pressure.mean())
            return np.stack([np.ones_like(u), u, w, u * w, u * u, w * w], axis=-1)

        r = self.reference
        fitted = np.linalg.lstsq(terms(r.load, r.pressure), np.log(r.cornering_stiffness), rcond=None)[0]
        return np.asarray(terms(load, pressure) @ fitted)

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(ln measured - ln predicted) / sd; the sd holds both tables."""
        t, sd = self.measured, np.sqrt(2) * REPEATABILITY
        columns = [self._slopes[c.identifier] for c in candidates]
        jacobian = np.stack(columns, 1) if columns else np.empty((len(t.load), 0))
        predicted = self._log_reference(t.load, t.pressure) + jacobian @ theta
        return (np.log(t.cornering_stiffness) - predicted) / sd, -jacobian / sd

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Zero: nothing is marginalised."""
        return 0.0

    def extras(self) -> tuple[Extra, ...]:
        """Calibrations that would separate scales from the drum: the bench tests of the engine say it."""
        return ()

    def predict(self, extra: Extra, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Array]:
        """Never asked: there are no extras."""
        raise NotImplementedError

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Any scales go together."""
        return True

    def further(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """None."""
        return ()

    def compared(self, residual: Array) -> tuple[Array, Array | None]:
        """Not drawn over speed."""
        return residual, None

    def phenomenological(self) -> tuple[Candidate, ...]:
        """None."""
        return ()

    def refined(self, best: Residual) -> "RigForward":
        """Itself."""
        return self


def tables_forward_model(tables: TyreTables, *, without: tuple[str, ...] = ()) -> RigForward:
    """The forward model of two tables; ``without`` names effects that are not tried."""
    for name in without:
        if name not in (*SCALES, "drum_curvature"):
            raise InputError(f"--without: {unknown('effect', name, (*SCALES, 'drum_curvature'))}")
    return RigForward(tables.reference, tables.measured, without)
