"""Read the reference of a rig measurement.

One of, in [rig.reference]: ``recordings`` (a folder, fitted here), ``campaign`` (the JSON of ``velotyre tyre fit``),
``table`` (a tyre table), or explicit [[rig.reference.conditions]].
"""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from studies.missing_effect.rig.reference import ALIKE, CURVATURE, LENGTH_SD, SHAPE, Curve, Reference, Value
from tyre.base.errors import InputError, is_number, unknown
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


def read_reference(table: Any, folder: Path, calibration: Calibration) -> Reference:
    """The reference that [rig.reference] names.

    Parameters
    ----------
    table : mapping
        What is written there.
    folder : Path
        Paths are relative to it.
    calibration : Calibration
        Of the rig, for recordings that are fitted here.

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
    (source,), drum = given, _drum(table)
    if source == "conditions":
        reference = _of_conditions_in_file(table[source])
    elif not isinstance(table[source], str):
        raise InputError(f"[rig.reference]: {source} = {table[source]!r} must be a path in quotes")
    elif source == "table":
        reference = _of_table(folder / table[source], drum)
    elif source == "campaign":
        reference = _of_campaign(folder / table[source], drum)
    else:
        reference = _of_recordings(folder / table[source], calibration)
    other = next((c for c in reference.curves if drum is not None and c.drum_radius != drum), None)
    if other is not None:
        says = f"a radius of {other.drum_radius:g} m" if other.drum_radius else "a flat track"
        raise InputError(
            f"[rig.reference]: drum_radius_m = {drum:g}, but {reference.origin}: {says}; take one of them out"
        )
    return reference


def _of_conditions_in_file(conditions: Any) -> Reference:
    if not isinstance(conditions, list) or not conditions:
        raise InputError("[rig.reference]: write conditions as [[rig.reference.conditions]] and keys below it")
    curves = tuple(_explicit(row, k) for k, row in enumerate(conditions, 1))
    for k, curve in enumerate(curves, 1):
        for j, other in enumerate(curves[: k - 1], 1):
            if abs(curve.load / other.load - 1) < ALIKE and abs(curve.pressure / other.pressure - 1) < ALIKE:
                raise InputError(
                    f"[[rig.reference.conditions]] number {k}: load and pressure of number {j} again; keep one"
                )
    return Reference(curves, "values in the file")


def _of_table(path: Path, drum: float | None) -> Reference:
    t = read_table(path)
    diameter = t.drum_diameter if t.surface == "drum" else None
    c_sd = t.cornering_stiffness_sd if t.cornering_stiffness_sd is not None else UNSTATED * t.cornering_stiffness
    rows = zip(
        t.load, t.pressure, t.cornering_stiffness, c_sd, t.lateral_stiffness, t.lateral_stiffness_sd, strict=True
    )
    if t.surface == "drum" and diameter is None and drum is None:
        raise InputError(f"{path}: a drum without drum_diameter_m; add it, or drum_radius_m in [rig.reference]")
    radius = diameter / 2 if diameter else drum
    curves = [
        Curve(f, p, (c, s), (k, ks or UNSTATED * k), drum_radius=radius if t.surface == "drum" else None)
        for f, p, c, s, k, ks in (map(float, row) for row in rows)
    ]
    return Reference(tuple(curves), f"table {path.name}, {TRACK[t.surface]}", t.tyre)


def _of_recordings(path: Path, calibration: Calibration) -> Reference:
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


def _of_campaign(path: Path, drum: float | None) -> Reference:
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
                float(c["load_N"]), 1e5 * float(c["pressure_bar"]), stiffness, lateral, length, drum_radius=radius
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
        _number(row, "load_N", where), 1e5 * _number(row, "pressure_bar", where),
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
