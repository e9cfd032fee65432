"""Tables of a tyre rig: cornering stiffness on one surface, predicted from that of another.

C(load, pressure) of a reference table, interpolated in logarithms, predicts the other table; candidates are the
drum's curvature, C_drum = C_flat / (1 + R / R_drum)^n, and scales of force, slip angle, load and pressure.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Self

import numpy as np

from studies.diagnosis.figures import BEFORE_AFTER
from studies.inference.kind import Candidates, Figure, Kind, Prediction, Rows, Series
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.schema import path_key, read, table
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.contact_patch import log_curvature
from tyre.maps.map_files import read_table
from tyre.measured.tables import MeasuredTable
from tyre.rig.effects.tyre import DrumCurvature

WHEEL_RADIUS = 0.34  # m, for the drum's curvature


@dataclass(frozen=True, kw_only=True)
class TyreKind(Kind):
    """A measurement of a tyre; ``nuisances``, ``candidates`` and ``refused`` are filled by :meth:`ready`."""

    name: str = ""  # the file's name
    description: str = ""  # words of the file
    source: str = ""  # words of the file: who measured, and where it was published
    notes: tuple[str, ...] = ()  # assumptions in reading; of a kind that is ready, all of them
    nuisances: tuple[UncertainParameter, ...] = ()
    candidates: Candidates = ()
    refused: Mapping[str, str] = field(default_factory=dict)

    def with_model(self, model: Any) -> NoReturn:
        """Refuse a bicycle ``model``."""
        raise InputError("a measurement of a tyre has a reference tyre, no bicycle model; leave the model out")


REPEATABILITY = 0.02  # relative sd of one cornering stiffness (remounting, temperature); the tables state none
SCALES = {"force_scale": 0.02, "slip_angle_scale": 0.02, "load_scale": 0.02, "pressure_scale": 0.03}  # 1 sd
DRUM = "drum_curvature"


@dataclass(frozen=True, kw_only=True)
class TyreTables(TyreKind, kind="tyre_tables"):
    """Tables of one tyre: ``reference`` was known, ``measured`` is to be explained by it."""

    keys: ClassVar[Any] = table(path_key("reference", "TABLE.csv") | path_key("measured", "TABLE.csv"))
    missing: ClassVar[str] = "write [tyre_tables], reference and measured below it"
    reference: MeasuredTable
    measured: MeasuredTable
    # assumptions in reading
    notes: tuple[str, ...] = (f"repeatability of a cornering stiffness: {REPEATABILITY:.0%} on each surface",)

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "TyreTables":
        files = read(cls.keys, content, section="tyre_tables")
        reference, measured = (read_table(folder / files[key]) for key in ("reference", "measured"))
        return cls(**common, reference=reference, measured=measured)

    def __post_init__(self) -> None:
        if self.reference.tyre != self.measured.tyre:
            raise InputError(
                f"tables of two tyres, {self.reference.tyre!r} and {self.measured.tyre!r}; "
                "give one tyre on two surfaces"
            )
        for tyre in (self.reference, self.measured):
            if len(tyre.load) < 6:  # the reference is a quadratic in two variables
                raise InputError(
                    f"{tyre.tyre} on {tyre.surface}: {len(tyre.load)} conditions are too few; 6 are needed"
                )

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        for option, names in (("--without", without), ("--with", also)):
            refuse_unknown("effect", names, (*SCALES, DRUM), where=option)
        candidates = []
        for name, sd in SCALES.items():
            size = UncertainParameter("scale", "1", {name: 1.0}, 0.0, sd, -5 * sd, 5 * sd, size=True, least=0.002)
            candidates.append(Candidate(name, (size,)))
        if self.measured.drum_diameter:
            exponent = UncertainParameter("exponent", "1", {DRUM: 1.0}, 0.0, 0.6, 0.0, 3.0, size=True, least=0.02)
            candidates.append(Candidate(DRUM, (exponent,), signature=DrumCurvature.terms[0].signature))
        return replace(self, candidates=tuple(c for c in candidates if c.identifier not in without))

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """One row a condition; loads are held out in turn."""
        t, name = self.measured, "cornering stiffness"
        places = zip(t.load, t.pressure, strict=True)
        labels = tuple(f"{load:.0f} N, {pressure / PASCAL_PER_BAR:g} bar" for load, pressure in places)
        fold = np.unique(t.load, return_inverse=True)[1]
        return Rows(
            labels,
            t.load,
            (name,) * len(labels),
            fold,
            displays={name: Series(name, "natural logarithm", "load, N", logarithm=True)},
        )

    @property
    def data(self) -> tuple[Array, Array]:
        """Logarithms of the stiffness; the sd holds both tables."""
        stiffness = np.log(self.measured.cornering_stiffness)
        return stiffness, np.full(len(stiffness), np.sqrt(2) * REPEATABILITY)

    @cached_property
    def _slopes(self) -> dict[str, Array]:
        """d(ln C)/d(coordinate) of each candidate at every condition."""
        t, h = self.measured, 1e-3
        ones = np.ones(len(t.load))
        at = self._log_reference(t.load, t.pressure)
        slopes = {"force_scale": ones, "slip_angle_scale": -ones}
        slopes["load_scale"] = (self._log_reference(t.load * (1 + h), t.pressure) - at) / h
        slopes["pressure_scale"] = (self._log_reference(t.load, t.pressure * (1 + h)) - at) / h
        if t.drum_diameter:
            slopes[DRUM] = -ones * log_curvature(wheel_radius=WHEEL_RADIUS, drum_radius=t.drum_diameter / 2)
        return slopes

    def _log_reference(self, load: Array, pressure: Array) -> Array:
        """ln C of the reference, quadratic in ln(load) and ln(pressure): six coefficients."""
        r = self.reference

        def terms(x: Array, y: Array) -> Array:
            u, w = np.log(x / r.load.mean()), np.log(y / r.pressure.mean())
            return np.stack([np.ones_like(u), u, w, u * w, u * u, w * w], axis=-1)

        fitted = np.linalg.lstsq(terms(r.load, r.pressure), np.log(r.cornering_stiffness), rcond=None)[0]
        return np.asarray(terms(load, pressure) @ fitted)

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return self.value_and_jacobian(candidates, theta)[0]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> Prediction:
        t = self.measured
        slopes = np.array([self._slopes[c.identifier] for c in candidates]).reshape(-1, len(t.load)).T
        return self._log_reference(t.load, t.pressure) + slopes @ theta, slopes

    def figures(self) -> dict[str, Figure]:
        return {"before_after": BEFORE_AFTER}
