"""The same engine on tables of a tyre rig: cornering stiffness on one surface, predicted from that of another.

C(load, pressure) of a reference table, interpolated in logarithms, predicts the other table; candidates are the
drum's curvature, C_drum = C_flat / (1 + R / R_drum)^n, and what may be wrong with the rig: scales of force, slip angle,
load and pressure.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from studies.inference.forward import ForwardModel, Rows, Series
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.gap_figures import GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.rig.recordings import WHEEL_RADIUS, TyreMeasurement
from tyre.base.arrays import Array
from tyre.base.errors import InputError, refuse_unknown
from tyre.base.schema import path_key, read, table
from tyre.base.units import PASCAL_PER_BAR
from tyre.drum import log_curvature
from tyre.maps.table_io import read_table
from tyre.maps.tables import MeasuredTable
from tyre.rig.effects.drum_curvature import DrumCurvature

NO_TABLES = 'kind = "tyre_tables" needs a table: write [tyre_tables], reference and measured below it'
TABLES = table(path_key("reference", "TABLE.csv") | path_key("measured", "TABLE.csv"))
KEYS = TABLES.keys
FEWEST = 6  # conditions: the reference is a quadratic in two variables
REPEATABILITY = 0.02  # relative sd of one cornering stiffness (remounting, temperature); the tables state none
SCALES = {"force_scale": 0.02, "slip_angle_scale": 0.02, "load_scale": 0.02, "pressure_scale": 0.03}
"""Calibration errors of a rig, 1 sd."""

DRUM = "drum_curvature"
EFFECTS = (*SCALES, DRUM)


@dataclass(frozen=True)
class TablesForward(ForwardModel):
    """Logarithm of the cornering stiffness of ``measured``, predicted from ``reference`` (both of one tyre).

    Attributes
    ----------
    reference, measured : MeasuredTable
    without : tuple of str
        Effects that are not tried.
    """

    reference: MeasuredTable
    measured: MeasuredTable
    without: tuple[str, ...] = ()
    nuisances: tuple[UncertainParameter, ...] = ()
    notes: tuple[str, ...] = (f"repeatability of a cornering stiffness: {REPEATABILITY:.0%} on each surface",)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """The drum's curvature where there is a drum, and the rig's calibration."""
        found = [
            Candidate(
                name, (UncertainParameter("scale", "1", {name: 1.0}, 0.0, sd, -5 * sd, 5 * sd, size=True, least=0.002),)
            )
            for name, sd in SCALES.items()
        ]
        if self.measured.drum_diameter:
            exponent = UncertainParameter("exponent", "1", {DRUM: 1.0}, 0.0, 0.6, 0.0, 3.0, size=True, least=0.02)
            found.append(Candidate(DRUM, (exponent,), signature=DrumCurvature.terms[0].signature))
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
        return Rows(where, t.load, (name,) * len(where), fold, shown={name: Series(name, axis="load, N")})

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
            found[DRUM] = -one * log_curvature(wheel_radius=WHEEL_RADIUS, drum_radius=t.drum_diameter / 2)
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
        """(ln measured - ln predicted) / sd at ``theta`` (p,), ``slopes`` or not; the sd holds both tables."""
        t, sd = self.measured, np.sqrt(2) * REPEATABILITY
        columns = [self._slopes[c.identifier] for c in candidates]
        jacobian = np.stack(columns, 1) if columns else np.empty((len(t.load), 0))
        predicted = self._log_reference(t.load, t.pressure) + jacobian @ theta
        return (np.log(t.cornering_stiffness) - predicted) / sd, -jacobian / sd


@dataclass(frozen=True)
class TyreTables(TyreMeasurement):
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

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> TablesForward:
        """The forward model; effects in ``without`` are not tried, those in ``also`` are tried anyway.

        Raises
        ------
        InputError
            An effect in ``without`` or ``also`` that does not exist.
        """
        for option, names in (("--without", without), ("--with", also)):
            refuse_unknown("effect", names, EFFECTS, where=option)
        return TablesForward(self.reference, self.measured, without)

    def figures(self) -> dict[str, Figure]:
        """The gap."""
        return {"gap": GAP}

    def __post_init__(self) -> None:
        if self.reference.tyre != self.measured.tyre:
            raise InputError(
                f"tables of two tyres, {self.reference.tyre!r} and {self.measured.tyre!r}; "
                "give one tyre on two surfaces"
            )
        for tyre in (self.reference, self.measured):
            if len(tyre.load) < FEWEST:
                raise InputError(
                    f"{tyre.tyre} on {tyre.surface}: {len(tyre.load)} conditions are too few; {FEWEST} are needed"
                )


def read_tyre_tables(content: Any, folder: Path, **words: Any) -> TyreTables:
    """The measurement of a file with kind = "tyre_tables".

    Parameters
    ----------
    content : object
        Its table ``[tyre_tables]``.
    folder : Path
        Where the files that it names are.
    **words
        ``name``, ``description`` and ``source``.
    """
    files = read(TABLES, content, section="tyre_tables")
    reference, measured = (read_table(folder / files[key]) for key in KEYS)
    return TyreTables(reference, measured, **words)
