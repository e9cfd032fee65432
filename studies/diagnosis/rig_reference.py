"""Stiffness and curve of a tyre that were known before its recordings are diagnosed, and where they are read from."""

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.fits.campaign import fit_campaign
from tyre.fits.condition import FitSettings, keep_upright
from tyre.ground.errors import InputError
from tyre.ground.schema import anything, list_of, maybe, needed, number, read, table, text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.map_files import read_table
from tyre.measured.plausible import LARGEST, SMALLEST

LENGTH_SD = 0.1  # relative: the static C/K and the lag of a rolling tyre are not the same thing
PEAK, SHAPE, CURVATURE = 1.05, 1.4, 0.0  # of a curve of which only the slope is known; the peak in loads
ALIKE = 0.02  # relative difference of loads, or of pressures, that are the same condition

Value = tuple[float, float]


@dataclass(frozen=True)
class Curve:
    """The tyre at one condition, SI: (value, sd) of C, K, relaxation length, and Magic Formula coefficients."""

    load: float  # N
    pressure: float  # Pa
    cornering_stiffness: Value | None = None  # N/rad
    lateral_stiffness: Value | None = None  # N/m
    relaxation_length: Value | None = None  # m
    peak: float | None = None  # D of the Magic Formula, N; None: not known
    shape: float = SHAPE  # C of the Magic Formula, -
    curvature: float = CURVATURE  # E of the Magic Formula, -
    drum_radius: float | None = None  # m; None on a flat track

    @property
    def length(self) -> Value | None:
        """Relaxation length as given, else C/K; its sd holds what C/K leaves open."""
        if self.relaxation_length is not None:
            return self.relaxation_length
        if self.cornering_stiffness is None or self.lateral_stiffness is None:
            return None
        (c, c_sd), (k, k_sd) = self.cornering_stiffness, self.lateral_stiffness
        return c / k, c / k * math.sqrt((c_sd / c) ** 2 + (k_sd / k) ** 2 + LENGTH_SD**2)


@dataclass(frozen=True)
class Reference:
    """Curves of one tyre, and their origin in words."""

    curves: tuple[Curve, ...]  # one a load and pressure
    origin: str  # where they are from, in words, for the report
    tyre: str | None = None  # its name; None if the source names none

    def curve_at(self, load: float, pressure: float) -> Curve:
        """The curve for a ``load`` (N) and ``pressure`` (Pa): its own, else between loads, else of the nearest load."""
        same_pressure = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE]
        if not same_pressure:
            have = ", ".join(f"{p / PASCAL_PER_BAR:g}" for p in sorted({c.pressure for c in self.curves}))
            raise InputError(
                f"the reference ({self.origin}) has nothing at {pressure / PASCAL_PER_BAR:g} bar (it has {have} bar); "
                "stiffness is not extrapolated over pressure"
            )
        same_pressure.sort(key=lambda c: c.load)
        best = min(same_pressure, key=lambda c: abs(math.log(c.load / load)))
        lighter, heavier = [c for c in same_pressure if c.load < load], [c for c in same_pressure if c.load > load]
        if (ratio := max(best.load / load, load / best.load)) > 3.0 and not (lighter and heavier):
            raise InputError(
                f"the reference ({self.origin}) at {best.load:g} N says nothing of a recording at {load:g} N, "
                f"{ratio:.3g} times apart (at most 3); give one near that load, or mend the load's unit"
            )
        if abs(best.load / load - 1) < ALIKE or not lighter or not heavier:
            return best
        low, high = lighter[-1], heavier[0]
        share = math.log(load / low.load) / math.log(high.load / low.load)

        def between(a: Value | None, b: Value | None) -> Value | None:
            if a is None or b is None:
                return None
            value = math.exp((1 - share) * math.log(a[0]) + share * math.log(b[0]))
            return value, value * max(a[1] / a[0], b[1] / b[0])

        peak = None if low.peak is None or high.peak is None else (1 - share) * low.peak + share * high.peak
        return replace(
            low,
            load=load,
            peak=peak,
            cornering_stiffness=between(low.cornering_stiffness, high.cornering_stiffness),
            lateral_stiffness=between(low.lateral_stiffness, high.lateral_stiffness),
            relaxation_length=between(low.relaxation_length, high.relaxation_length),
        )

    def load_exponent(self, pressure: float) -> float | None:
        """d(ln C)/d(ln load) at a ``pressure`` (Pa); None with fewer than two loads."""
        same_pressure = [c for c in self.curves if abs(c.pressure / pressure - 1) < ALIKE and c.cornering_stiffness]
        loads = np.log([c.load for c in same_pressure])
        if len(same_pressure) < 2 or np.ptp(loads) < ALIKE:
            return None
        return float(
            np.polyfit(loads, np.log([c.cornering_stiffness[0] for c in same_pressure if c.cornering_stiffness]), 1)[0]
        )


TRACK = {"flat": "on a flat track", "drum": "on a drum"}
SOURCES = ("recordings", "campaign", "table", "conditions")
SIZE = f"of at most {LARGEST:g}"
POSITIVE = number(least=SMALLEST, most=LARGEST, says=f"must be a number > 0, {SIZE} and at least {SMALLEST:g}")
NOT_NEGATIVE = number(least=0, most=LARGEST, says=f"must be a number >= 0, {SIZE}")
DRUM_RADIUS = number(least=0.2, says="must be a number >= 0.2")
SURFACE = 'write "flat", or "drum" together with drum_radius_m'
CONDITION = table(
    {
        needed("load_N"): POSITIVE,
        needed("pressure_bar"): POSITIVE,
        maybe("surface", "flat"): text(f"; {SURFACE}", allowed=("flat", "drum")),
        maybe("drum_radius_m"): DRUM_RADIUS,
        maybe("cornering_stiffness_N_per_rad"): POSITIVE,
        maybe("cornering_stiffness_sd_N_per_rad"): NOT_NEGATIVE,
        maybe("lateral_stiffness_N_per_m"): POSITIVE,
        maybe("lateral_stiffness_sd_N_per_m"): NOT_NEGATIVE,
        maybe("relaxation_length_m"): POSITIVE,
        maybe("relaxation_length_sd_m"): NOT_NEGATIVE,
        maybe("peak_N"): POSITIVE,
        maybe("shape"): POSITIVE,
        maybe("curvature"): number(least=-10, says="must be a number >= -10"),
    }
)
HOW = "must be tables: write conditions as [[rig.reference.conditions]] and keys below it"
REFERENCE = table(
    {maybe(key): text("must be a path in quotes") for key in SOURCES[:3]}
    | {maybe("conditions"): list_of(anything, HOW, least=1), maybe("drum_radius_m"): DRUM_RADIUS}
)


def _value_and_sd(content: Any) -> "Value | None":
    """Value and sd of one quantity by a fit."""
    if content is None:
        return None
    pair = table({needed("value"): number(), needed("sd"): number(endless=True)}, others=True)(content)
    return pair["value"], pair["sd"]


CAMPAIGN = table(
    {
        needed("conditions"): list_of(
            table(
                {
                    needed("tyre"): text(),
                    needed("surface"): text(),
                    needed("load_N"): POSITIVE,
                    needed("pressure_bar"): POSITIVE,
                    maybe("camber_deg", 0.0): number(),
                    needed("cornering_stiffness_N_per_rad"): _value_and_sd,
                    needed("lateral_stiffness_N_per_m"): _value_and_sd,
                    needed("relaxation_length_m"): _value_and_sd,
                },
                others=True,
            ),
            "must be a list of conditions",
            strict=False,
        )
    },
    others=True,
)
LEAST = (  # of a tyre, in its load; below it is surely in another unit
    ("cornering_stiffness_N_per_rad", 1.0, "N/deg"), ("lateral_stiffness_N_per_m", 10.0, "N/mm"),
)  # fmt: skip
UNSTATED = 0.02  # relative sd of a stiffness whose source states none


def read_reference(content: Any, folder: Path, settings: FitSettings) -> Reference:
    """The reference that [rig.reference] names."""
    chosen = read(REFERENCE, content, section="rig.reference")
    sources = [key for key in SOURCES if key in chosen]
    if len(sources) != 1:
        raise InputError(f"[rig.reference] has {', '.join(sources) or 'no source'}; give one of {', '.join(SOURCES)}")
    source, drum = sources[0], chosen.get("drum_radius_m")
    if source == "conditions":
        reference = _read_curves(chosen[source])
    elif source == "table":
        reference = _of_table(folder / chosen[source], drum)
    elif source == "campaign":
        reference = _campaign(folder / chosen[source], drum)
    else:
        campaign = fit_campaign(folder / chosen[source], settings=settings, jobs=1, progress=False)
        rows = [_row_from_fit(condition) for condition in keep_upright(campaign.conditions)]
        skipped = "; ".join(f"{name} left out: {why}" for name, why in campaign.skipped.items())
        origin = f"recordings in {campaign.folder.name}/" + (f" ({skipped})" if skipped else "")
        reference = _of_conditions(rows, origin, str(campaign.folder))
    contradicting = next((c for c in reference.curves if drum is not None and c.drum_radius != drum), None)
    if contradicting is not None:
        says = f"a radius of {contradicting.drum_radius:g} m" if contradicting.drum_radius else "a flat track"
        raise InputError(
            f"[rig.reference]: drum_radius_m = {drum:g}, but {reference.origin}: {says}; take one of them out"
        )
    return reference


def _of_table(path: Path, drum: float | None) -> Reference:
    """Reference from a table of a tyre over load and pressure; ``drum`` is a radius, m, if the table states none."""
    t = read_table(path)
    diameter = t.drum_diameter if t.surface == "drum" else None
    c_sd = t.cornering_stiffness_sd if t.cornering_stiffness_sd is not None else UNSTATED * t.cornering_stiffness
    k_sd = t.lateral_stiffness_sd if t.lateral_stiffness_sd is not None else UNSTATED * t.lateral_stiffness
    rows = zip(t.load, t.pressure, t.cornering_stiffness, c_sd, t.lateral_stiffness, k_sd, strict=True)
    if t.surface == "drum" and diameter is None and drum is None:
        raise InputError(f"{path}: a drum without drum_diameter_m; add it, or drum_radius_m in [rig.reference]")
    radius = diameter / 2 if diameter else drum
    curves = [
        Curve(f, p, (c, s), (k, ks or UNSTATED * k), drum_radius=radius if t.surface == "drum" else None)
        for f, p, c, s, k, ks in (map(float, row) for row in rows)
    ]
    return Reference(tuple(curves), f"table {path.name}, {TRACK[t.surface]}", t.tyre)


Row = tuple[str, str, Curve]


def _of_conditions(rows: list[Row], origin: str, location: str) -> Reference:
    """One tyre on one surface."""
    for plural, names in (("tyres", {tyre for tyre, _, _ in rows}), ("surfaces", {surface for _, surface, _ in rows})):
        if len(names) > 1:
            raise InputError(f"{location}: a reference of {len(names)} {plural}, {', '.join(sorted(names))}; give one")
    return Reference(tuple(curve for _, _, curve in rows), f"{origin}, {TRACK[rows[0][1]]}", rows[0][0])


def _row_from_fit(condition: Any) -> Row:
    """A condition of a fitted campaign, its curve that of the first sweep (coefficients are never averaged)."""
    c, k, length = condition.cornering_stiffness, condition.lateral_stiffness, condition.relaxation_length
    shape = condition.sweeps[0].details if condition.sweeps else {}
    curve = Curve(
        condition.load,
        condition.pressure,
        None if c is None else (c.value, c.sd),
        None if k is None else (k.value, k.sd),
        None if length is None else (length.value, math.hypot(length.sd, LENGTH_SD * length.value)),
        shape.get("peak_N"),
        shape.get("shape", SHAPE),
        shape.get("curvature", CURVATURE),
        condition.drum_radius,
    )
    return condition.tyre, condition.surface, curve


def _campaign(path: Path, drum: float | None) -> Reference:
    """Reference from the JSON of a fitted campaign, at the least camber; ``drum`` is the radius, m."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON: {error}") from None
    conditions = read(CAMPAIGN, content, where=f"{path}: not the JSON of `velotyre tyre fit --json`")["conditions"]
    if not conditions:
        raise InputError(f"{path}: holds no conditions")
    rows: list[Row] = []
    least = min(abs(c["camber_deg"]) for c in conditions)
    for c in (c for c in conditions if abs(c["camber_deg"]) == least):
        length, on_drum = c["relaxation_length_m"], c["surface"] == "drum"
        if length is not None:
            length = length[0], math.hypot(length[1], LENGTH_SD * length[0])
        if on_drum and drum is None:
            raise InputError(f"{path}: a campaign on a drum; add drum_radius_m in [rig.reference]")
        stiffness, lateral = c["cornering_stiffness_N_per_rad"], c["lateral_stiffness_N_per_m"]
        pressure = PASCAL_PER_BAR * c["pressure_bar"]
        curve = Curve(c["load_N"], pressure, stiffness, lateral, length, drum_radius=drum if on_drum else None)
        rows.append((c["tyre"], c["surface"], curve))
    return _of_conditions(rows, f"campaign {path.name}", str(path))


def _read_curves(rows: list[Any]) -> Reference:
    """Reference from the values in the measurement file itself, one curve per condition."""
    curves: list[Curve] = []
    for row in rows:
        location = f"[[rig.reference.conditions]] number {len(curves) + 1}"
        curve = _condition(row, location)
        for place, earlier in enumerate(curves, 1):
            if abs(curve.load / earlier.load - 1) < ALIKE and abs(curve.pressure / earlier.pressure - 1) < ALIKE:
                raise InputError(f"{location}: load and pressure of number {place} again; keep one")
        curves.append(curve)
    return Reference(tuple(curves), "values in the file")


def _condition(content: Any, location: str) -> Curve:
    """Curve of one condition in the measurement file; ``location`` says which, in errors."""
    row = read(CONDITION, content, where=location)
    if (row["surface"] == "drum") != ("drum_radius_m" in row):
        raise InputError(f"{location}: surface = {row['surface']!r}; {SURFACE}")
    for key, share, kind in LEAST:
        least = share * row["load_N"]
        if row.get(key, least) < least:
            raise InputError(
                f"{location}: {key} = {row[key]:g} is below {least:g}, too soft for a tyre; is it in {kind}?"
            )

    def pair(name: str, unit: str, relative: float) -> Value | None:
        key, sd_key = f"{name}_{unit}", f"{name}_sd_{unit}"
        if key not in row and sd_key in row:
            raise InputError(f"{location}: {sd_key} without {key}")
        return (row[key], row.get(sd_key, relative * row[key])) if key in row else None

    return Curve(
        row["load_N"],
        PASCAL_PER_BAR * row["pressure_bar"],
        pair("cornering_stiffness", "N_per_rad", UNSTATED),
        pair("lateral_stiffness", "N_per_m", UNSTATED),
        pair("relaxation_length", "m", LENGTH_SD),
        row.get("peak_N"),
        row.get("shape", SHAPE),
        row.get("curvature", CURVATURE),
        row.get("drum_radius_m"),
    )
