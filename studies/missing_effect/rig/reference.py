"""What was known of a tyre before its recordings are diagnosed: stiffness and curve at one or more conditions.

One of, in [rig.reference]: ``recordings`` (a folder, fitted here), ``campaign`` (the JSON of ``velotyre tyre fit``),
``table`` (a tyre table), or explicit [[rig.reference.conditions]].
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError, is_number, unknown
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import fit_campaign
from tyre.campaigns.recording import FitSettings
from tyre.fits.estimate import Calibration
from tyre.maps.table_io import read_table

TRACK = {"flat": "on a flat track", "drum": "on a drum"}
SOURCES = ("recordings", "campaign", "table", "conditions")
CONDITION_KEYS = (
    "load_N", "pressure_bar", "surface", "drum_radius_m",
    "cornering_stiffness_N_per_rad", "cornering_stiffness_sd_N_per_rad",
    "lateral_stiffness_N_per_m", "lateral_stiffness_sd_N_per_m", "relaxation_length_m", "relaxation_length_sd_m",
    "peak_N", "shape", "curvature",
)  # fmt: skip
LEAST = (  # of a tyre, in its load; below it is surely in another unit
    ("cornering_stiffness_N_per_rad", 1.0, "N/deg"), ("lateral_stiffness_N_per_m", 10.0, "N/mm"),
)  # fmt: skip
UNSTATED = 0.02  # relative sd of a stiffness whose source states none
LENGTH_SD = 0.1  # relative: the static C/K and the lag of a rolling tyre are not the same thing
PEAK, SHAPE, CURVATURE = 1.05, 1.4, 0.0  # of the curve where only its slope is known; the peak in loads
ALIKE = 0.02  # relative difference of loads, or of pressures, that are the same condition

Value = tuple[float, float]


@dataclass(frozen=True)
class Curve:
    """The tyre at one condition, SI: (value, sd) of C, K and relaxation length, and the Magic Formula's coefficients.

    ``drum_radius`` is None on a flat track; ``peak`` in N.
    """

    load: float
    pressure: float
    cornering_stiffness: Value | None = None
    lateral_stiffness: Value | None = None
    relaxation_length: Value | None = None
    peak: float | None = None
    shape: float = SHAPE
    curvature: float = CURVATURE
    drum_radius: float | None = None

    @property
    def length(self) -> Value | None:
        """Relaxation length as given, else C/K; its sd holds what C/K leaves open."""
        if self.relaxation_length is not None:
            value, sd = self.relaxation_length
            return value, sd
        if self.cornering_stiffness is None or self.lateral_stiffness is None:
            return None
        (c, c_sd), (k, k_sd) = self.cornering_stiffness, self.lateral_stiffness
        return c / k, c / k * math.sqrt((c_sd / c) ** 2 + (k_sd / k) ** 2 + LENGTH_SD**2)


@dataclass(frozen=True)
class Reference:
    """Curves of one tyre; ``origin`` says in words where they come from."""

    curves: tuple[Curve, ...]
    origin: str
    tyre: str | None = None

    def at(self, load: float, pressure: float) -> Curve:
        """The curve for a condition: its own, else between two loads (in logarithms), else that of the nearest load.

        Its ``load`` is the load for which its numbers hold.

        Raises
        ------
        InputError
            For a pressure that the reference does not have.
        """
        near = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE]
        if not near:
            have = ", ".join(f"{p / PASCAL_PER_BAR:g}" for p in sorted({c.pressure for c in self.curves}))
            raise InputError(
                f"the reference ({self.origin}) has nothing at {pressure / PASCAL_PER_BAR:g} bar (it has {have} bar); "
                "stiffness is not extrapolated over pressure"
            )
        near.sort(key=lambda c: c.load)
        best = min(near, key=lambda c: abs(math.log(c.load / load)))
        below, above = [c for c in near if c.load < load], [c for c in near if c.load > load]
        if abs(best.load / load - 1) < ALIKE or not below or not above:
            return best
        low, high = below[-1], above[0]
        share = math.log(load / low.load) / math.log(high.load / low.load)

        def between(a: Value | None, b: Value | None) -> Value | None:
            if a is None or b is None:
                return None
            value = math.exp((1 - share) * math.log(a[0]) + share * math.log(b[0]))
            return value, value * max(a[1] / a[0], b[1] / b[0])

        peak = None if low.peak is None or high.peak is None else (1 - share) * low.peak + share * high.peak
        return replace(
            low, load=load, peak=peak, cornering_stiffness=between(low.cornering_stiffness, high.cornering_stiffness),
            lateral_stiffness=between(low.lateral_stiffness, high.lateral_stiffness),
            relaxation_length=between(low.relaxation_length, high.relaxation_length),
        )  # fmt: skip

    def load_exponent(self, pressure: float) -> float | None:
        """d(ln C)/d(ln load) at a pressure; None with fewer than two loads."""
        near = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE and c.cornering_stiffness]
        loads = np.log([c.load for c in near])
        if len(near) < 2 or np.ptp(loads) < ALIKE:
            return None
        return float(np.polyfit(loads, np.log([c.cornering_stiffness[0] for c in near if c.cornering_stiffness]), 1)[0])


def read_reference(table: Any, folder: Path, calibration: Calibration) -> Reference:
    """The reference that [rig.reference] names.

    Raises
    ------
    InputError
        None or several sources, or a bad one.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"[rig]: reference = {table!r} must be a table: write [rig.reference] and a key below it")
    for key in table:
        if key not in (*SOURCES, "drum_radius_m"):
            raise InputError(f"[rig.reference]: {unknown('key', key, (*SOURCES, 'drum_radius_m'))}")
    given = [key for key in SOURCES if key in table]
    if len(given) != 1:
        raise InputError(f"[rig.reference] has {', '.join(given) or 'no source'}; give one of {', '.join(SOURCES)}")
    found = _of_source(table, given[0], folder, calibration)
    drum = _drum(table)
    other = next((c for c in found.curves if drum is not None and c.drum_radius != drum), None)
    if other is not None:
        says = f"a radius of {other.drum_radius:g} m" if other.drum_radius else "a flat track"
        raise InputError(f"[rig.reference]: drum_radius_m = {drum:g}, but {found.origin}: {says}; take one of them out")
    return found


def _of_source(table: Mapping[str, Any], source: str, folder: Path, calibration: Calibration) -> Reference:
    if source == "conditions":
        if not isinstance(table[source], list) or not table[source]:
            raise InputError("[rig.reference]: write conditions as [[rig.reference.conditions]] and keys below it")
        curves = tuple(_explicit(row, k) for k, row in enumerate(table[source], 1))
        for k, curve in enumerate(curves, 1):
            for j, other in enumerate(curves[: k - 1], 1):
                if abs(curve.load / other.load - 1) < ALIKE and abs(curve.pressure / other.pressure - 1) < ALIKE:
                    raise InputError(
                        f"[[rig.reference.conditions]] number {k}: load and pressure of number {j} again; keep one"
                    )
        return Reference(curves, "values in the file")
    if not isinstance(table[source], str):
        raise InputError(f"[rig.reference]: {source} = {table[source]!r} must be a path in quotes")
    path, drum = folder / table[source], _drum(table)
    if source == "table":
        t = read_table(path)
        diameter = t.drum_diameter if t.surface == "drum" else None
        c_sd = t.cornering_stiffness_sd if t.cornering_stiffness_sd is not None else UNSTATED * t.cornering_stiffness
        rows = zip(
            t.load, t.pressure, t.cornering_stiffness, c_sd, t.lateral_stiffness, t.lateral_stiffness_sd, strict=True
        )
        if t.surface == "drum" and diameter is None and drum is None:
            raise InputError(f"{path}: a drum without drum_diameter_m; add it, or drum_radius_m in [rig.reference]")
        radius = diameter / 2 if diameter else drum
        found = [
            Curve(f, p, (c, s), (k, ks or UNSTATED * k), drum_radius=radius if t.surface == "drum" else None)
            for f, p, c, s, k, ks in (map(float, row) for row in rows)
        ]
        return Reference(tuple(found), f"table {path.name}, {TRACK[t.surface]}", t.tyre)
    if source == "campaign":
        return _campaign(path, drum)
    campaign = fit_campaign(path, settings=FitSettings(calibration), jobs=1, progress=False)
    return _of_conditions([_fitted(c) for c in campaign.conditions], f"recordings in {path.name}/", str(path))


Row = tuple[str, str, Curve]


def _of_conditions(rows: list[Row], origin: str, where: str) -> Reference:
    """One tyre on one surface."""
    for what, names in (("tyres", {tyre for tyre, _, _ in rows}), ("surfaces", {surface for _, surface, _ in rows})):
        if len(names) > 1:
            raise InputError(f"{where}: a reference of {len(names)} {what}, {', '.join(sorted(names))}; give one")
    return Reference(
        tuple(curve for _, _, curve in rows),
        f"{origin}, {TRACK[rows[0][1]]}",
        rows[0][0],
    )


def _fitted(condition: Any) -> Row:
    """A condition of a fitted campaign, its curve that of the first sweep (coefficients are never averaged)."""
    c, k, length = condition.cornering_stiffness, condition.lateral_stiffness, condition.relaxation_length
    shape = condition.sweeps[0].details if condition.sweeps else {}
    curve = Curve(
        condition.load, condition.pressure,
        None if c is None else (c.value, c.sd), None if k is None else (k.value, k.sd),
        None if length is None else (length.value, math.hypot(length.sd, LENGTH_SD * length.value)),
        shape.get("peak_N"), shape.get("shape", SHAPE), shape.get("curvature", CURVATURE), condition.drum_radius,
    )  # fmt: skip
    return condition.tyre, condition.surface, curve


def _campaign(path: Path, drum: float | None) -> Reference:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {error}") from None
    rows: list[Row] = []
    try:
        for c in content["conditions"]:
            pairs = []
            for key in ("cornering_stiffness_N_per_rad", "lateral_stiffness_N_per_m", "relaxation_length_m"):
                pairs.append(None if c[key] is None else (float(c[key]["value"]), float(c[key]["sd"])))
            stiffness, lateral, length = pairs
            if length is not None:
                length = length[0], math.hypot(length[1], LENGTH_SD * length[0])
            if c["surface"] == "drum" and drum is None:
                raise InputError(f"{path}: a campaign on a drum; add drum_radius_m in [rig.reference]")
            radius = drum if c["surface"] == "drum" else None
            curve = Curve(
                float(c["load_N"]),
                PASCAL_PER_BAR * float(c["pressure_bar"]),
                stiffness,
                lateral,
                length,
                drum_radius=radius,
            )
            rows.append((str(c["tyre"]), str(c["surface"]), curve))
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not the JSON of `velotyre tyre fit --json` ({error!r})") from None
    if not rows:
        raise InputError(f"{path}: holds no conditions")
    return _of_conditions(rows, f"campaign {path.name}", str(path))


def _drum(table: Mapping[str, Any]) -> float | None:
    return _number(table, "drum_radius_m", "[rig.reference]", low=0.2) if "drum_radius_m" in table else None


def _explicit(row: Any, number: int) -> Curve:
    where = f"[[rig.reference.conditions]] number {number}"
    if not isinstance(row, Mapping):
        raise InputError(f"{where}: {row!r} must be a table")
    for key in row:
        if key not in CONDITION_KEYS:
            raise InputError(f"{where}: {unknown('key', key, CONDITION_KEYS)}")
    for key in ("load_N", "pressure_bar"):
        if key not in row:
            raise InputError(f"{where}: {key} is missing")
    surface = row.get("surface", "flat")
    if surface not in ("flat", "drum") or (surface == "drum") != ("drum_radius_m" in row):
        raise InputError(f'{where}: surface = {surface!r}; write "flat", or "drum" together with drum_radius_m')

    for key, share, kind in LEAST:
        if is_number(row.get(key)) and is_number(row["load_N"]) and 0 < row[key] < share * row["load_N"]:
            least = share * row["load_N"]
            raise InputError(f"{where}: {key} = {row[key]:g} is below {least:g}, too soft for a tyre; is it in {kind}?")

    def pair(name: str, unit: str, relative: float) -> Value | None:
        key, sd_key = f"{name}_{unit}", f"{name}_sd_{unit}"
        if key not in row:
            if sd_key in row:
                raise InputError(f"{where}: {sd_key} without {key}")
            return None
        value = _number(row, key, where)
        return value, _number(row, sd_key, where, zero=True) if sd_key in row else relative * value

    return Curve(
        _number(row, "load_N", where), PASCAL_PER_BAR * _number(row, "pressure_bar", where),
        pair("cornering_stiffness", "N_per_rad", UNSTATED), pair("lateral_stiffness", "N_per_m", UNSTATED),
        pair("relaxation_length", "m", LENGTH_SD), _number(row, "peak_N", where) if "peak_N" in row else None,
        _number(row, "shape", where) if "shape" in row else SHAPE,
        _number(row, "curvature", where, low=-10.0) if "curvature" in row else CURVATURE,
        _number(row, "drum_radius_m", where, low=0.2) if surface == "drum" else None,
    )  # fmt: skip


def _number(row: Mapping[str, Any], key: str, where: str, *, low: float = 0.0, zero: bool = False) -> float:
    value = row[key]
    if not is_number(value) or not math.isfinite(value) or value < low or (value == 0 and low == 0 and not zero):
        raise InputError(f"{where}: {key} = {value!r} must be a number {'>=' if zero or low else '>'} {low:g}")
    return float(value)
