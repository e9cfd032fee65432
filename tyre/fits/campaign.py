"""A campaign: recordings of many conditions, each fitted and kept in a cache, compared and exported."""

import hashlib
import json
import os
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, dataclass, replace
from functools import cache
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from tyre.fits.condition import (
    ConditionResult,
    FitSettings,
    RecordingSummary,
    Repeatability,
    check_plausible,
    combine_campaign,
    keep_upright,
    refuse_infinite,
)
from tyre.fits.lateral_stiffness import fit_lateral_stiffness
from tyre.fits.recording_files import read_events
from tyre.fits.relaxation import fit_slip_step, is_slip_step
from tyre.fits.sidecar import file_and_sidecar
from tyre.fits.slip_sweep import fit_slip_sweep
from tyre.formats import FORMATS
from tyre.formats.channel_map import ChannelMap
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import clear_of_killed_runs, files_below, hold_folder, make_folder, read_toml, slugs, write_text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.ground.workers import worker_pool
from tyre.maps.contact_patch import log_curvature
from tyre.maps.map_files import write_table
from tyre.measured.properties import Estimate
from tyre.measured.tables import CommonCalibration, MeasuredColumn, MeasuredTable
from tyre.recordings.recording import Condition, LateralStiffnessTest, RigRun
from tyre.recordings.run_checks import preflight

OWN = (".csv", ".tdx")
"""Endings that need no channel map if they hold velotyre's or TYDEX's names."""


Points = dict[str, list[float]]


def summarise(
    path: Path, *, name: str, settings: FitSettings, cache_folder: Path | None, channel_map: ChannelMap | None = None
) -> list[tuple[str, RecordingSummary | str]]:
    """Fit every event of one file, or take its fits (by name, or why there is none) from the cache."""
    try:
        cache_file = None if cache_folder is None else cache_folder / f"{_key(path, settings, channel_map)}.fit"
        fits = None if cache_file is None else _read_kept(cache_file)
        if fits is None:
            fits = [_fit_event(event, run, path, settings) for event, run in read_events(path, channel_map).items()]
            if cache_file is not None:
                content = json.dumps(fits)
                write_text(cache_file, f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}\n")
    except InputError as error:
        return [(name, str(error))]
    outcomes: list[tuple[str, RecordingSummary | str]] = []
    for fit in fits:
        called = f"{name}#{fit['event']}" if fit["event"] else name
        outcomes.append((called, _summary_of(fit, called, cache_file) if fit["summary"] else fit["problem"]))
    return outcomes


def points_of(summary: RecordingSummary) -> dict[str, Any]:
    """Return the points of a fitted recording for a figure, from the cache; empty if none were kept."""
    fits = None if summary.cache is None else _read_kept(summary.cache)
    points: dict[str, Any] = next((fit["points"] for fit in fits or () if fit["event"] == summary.event), {})
    return {key: np.array(value) for key, value in points.items()}


def _fit_event(
    event: str, recording: RigRun | LateralStiffnessTest, path: Path, settings: FitSettings
) -> dict[str, Any]:
    """Fit one event, or say why not, as plain values."""
    try:
        summary, points = fit_read(recording, path, name=event, settings=settings)
        return {"event": event, "summary": asdict(summary), "points": points}
    except InputError as error:
        problem = str(error)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra: numbers that no fit can go through
        problem = f"{path}: cannot be fitted ({type(error).__name__}: {error})"
    return {"event": event, "summary": None, "problem": problem}


def _summary_of(fit: dict[str, Any], name: str, cache: Path | None) -> RecordingSummary:
    """Make the summary of a ``fit`` in plain values for a recording called ``name`` whose fits ``cache`` holds."""
    table = fit["summary"]
    replaced = {
        "condition": Condition(**table["condition"]),
        "notes": tuple(table["notes"]),
        "file": name,
        "cache": cache,
    }
    return RecordingSummary(**table | replaced | {"event": fit["event"]})


def _read_kept(cache: Path) -> list[dict[str, Any]] | None:
    """Return the content of a file of the cache; None if it is damaged or not there: then it is fitted again."""
    try:
        digest, content = cache.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):  # not there, no text, not two lines
        return None
    if hashlib.sha256(content.encode()).hexdigest() != digest:
        return None
    fits: list[dict[str, Any]] = json.loads(content)
    return fits


def _key(path: Path, settings: FitSettings, channel_map: ChannelMap | None) -> str:
    """Digest of all that a fit depends on: recording, sidecar, settings, map and the code of the package."""
    file, sidecar = file_and_sidecar(path)
    try:
        digest = hashlib.sha256(file.read_bytes())
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from None
    digest.update(f"{file.suffix.casefold()}{settings!r}{sidecar!r}{channel_map!r}".encode() + _code())
    return digest.hexdigest()[:32]


@cache
def _code() -> bytes:
    """Digest of the package: a changed fit does not return an old answer."""
    digest = hashlib.sha256()
    for item in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(item.read_bytes())
    return digest.digest()


def fit_read(
    recording: RigRun | LateralStiffnessTest, path: Path, *, name: str, settings: FitSettings
) -> tuple[RecordingSummary, Points]:
    """Fit a recording by its kind; also returns up to 240 points (measured, fitted) for figures."""
    check = preflight(recording, load_tolerance=settings.load_tolerance)
    if not check.usable:
        raise InputError(f"{path}: not usable: {'; '.join(check.problems)}")
    notes = tuple(dict.fromkeys((*recording.notes, *check.problems)))
    if isinstance(recording, LateralStiffnessTest):
        summary, points = _pull(recording, name, settings)
    elif is_slip_step(recording):
        summary, points = _step(recording, name)
    else:
        summary, points = _sweep(recording, name, settings)
    refuse_infinite(summary, path)
    unusual = check_plausible(summary, path)
    extra = tuple(note for note in (*summary.notes, *unusual) if note not in notes)
    return replace(summary, notes=notes + extra), points


def _summary(
    recording: RigRun | LateralStiffnessTest,
    name: str,
    kind: str,
    estimate: Estimate,
    fit: Any,
    details: Mapping[str, Any],
) -> RecordingSummary:
    return RecordingSummary(
        file=name,
        kind=kind,
        condition=recording.condition,
        synthetic=recording.synthetic,
        value=estimate.value,
        fit_sd=fit.fit_sd,
        r_squared=fit.r_squared,
        notes=fit.notes,
        details={name: value for name, value in details.items() if value is not None},
    )


def _sweep(run: RigRun, name: str, settings: FitSettings) -> tuple[RecordingSummary, Points]:
    """Fit a slip sweep: its summary, and points (block means) for figures."""
    fit = fit_slip_sweep(run, calibration=settings.calibration, lag_correction=settings.lag_correction)
    parameters, blocks, used = fit.parameters, fit.blocks, fit.blocks.settled
    sd, largest = fit.parameters_sd, float(np.max(np.abs(blocks.force)))
    moment, camber = fit.aligning_moment, run.inclination
    details = {
        "peak_N": parameters["peak"],
        "shape": parameters["shape"],
        "curvature": parameters["curvature"],
        "curve_slope_N_per_rad": fit.curve_slope,
        "Sv_N": parameters["vertical_shift"],
        "Sv_sd_N": sd["vertical_shift"],
        "Sh_rad": parameters["horizontal_shift"],
        "Sh_sd_rad": sd["horizontal_shift"],
        "drift_N": parameters["drift"],
        "load_N": fit.load,
        "largest_force_N": largest,
        "branches": float(fit.branches),
        "residual_sd_N": fit.residual_sd,
        "force_at_zero_N": fit.force_at_zero[0],
        "force_at_zero_sd_N": fit.force_at_zero[1],
        "apparent_relaxation_length_m": fit.apparent_relaxation_length,
        "camber_rad": None if camber is None else float(np.nanmedian(camber)),
        "temperature_C": fit.temperature,
    }
    if moment is not None:
        details |= {
            "pneumatic_trail_m": moment.pneumatic_trail,
            "pneumatic_trail_sd_m": moment.pneumatic_trail_sd,
            "aligning_moment_slope_N_m_per_rad": moment.slope,
            "moment_at_zero_N_m": moment.at_zero[0],
            "moment_at_zero_sd_N_m": moment.at_zero[1],
        }
    summary = _summary(run, name, "slip_sweep", fit.cornering_stiffness, fit, details)
    summary = replace(summary, rate=fit.rate, speed=fit.speed, half_gap=fit.half_gap, half_gap_sd=fit.half_gap_sd)
    points = {
        "slip_rad": blocks.slip[used],
        "force_N": blocks.force[used],
        "residual_N": -fit.residuals,
        "rate_rad_s": blocks.rate[used],
        "time_s": blocks.time[used],
    }
    return summary, _thin_points(points)


def _pull(test: LateralStiffnessTest, name: str, settings: FitSettings) -> tuple[RecordingSummary, Points]:
    """Fit a lateral stiffness test: its summary, and points (readings) for figures."""
    fit = fit_lateral_stiffness(test, calibration=settings.calibration)
    details = {
        "friction_N": fit.friction,
        "largest_force_N": float(np.max(np.abs(fit.force))),
        "presliding_m": fit.presliding,
        "linear_range_m": fit.linear_range,
        "departure": fit.departure,
        "gauge_resolution_m": fit.resolution,
        "rim_share": fit.rim_share,
        "readings": float(fit.readings),
        "readings_used": float(fit.readings_used),
        "residual_sd_N": fit.residual_sd,
    }
    points = {"deflection_m": fit.deflection, "force_N": fit.force, "fitted_N": fit.fitted}
    return _summary(test, name, "lateral_stiffness", fit.lateral_stiffness, fit, details), _thin_points(points)


def _step(run: RigRun, name: str) -> tuple[RecordingSummary, Points]:
    """Fit a slip step: its summary, and no points."""
    fit = fit_slip_step(run)
    details = {
        "force_change_N": fit.force_change,
        "residual_sd_N": fit.residual_sd,
        "dof": fit.fit_dof,
        "slip_before_rad": fit.slip[0],
        "slip_after_rad": fit.slip[1],
        "curve_sd_m": fit.curve_sd,
        "deficit": fit.deficit,
        "length_by_deficit": fit.length_by_deficit,
        "distance_to_63_m": fit.distance_to_63,
    }
    return _summary(run, name, "slip_step", fit.relaxation_length, fit, details), {}


def _thin_points(points: dict[str, Any]) -> Points:
    """Keep up to about 240 points, for figures."""
    return {name: values[:: max(1, len(values) // 240)].tolist() for name, values in points.items()}


@dataclass(frozen=True)
class CurvatureExponent:
    """Flat over drum cornering stiffness as (1 + R / R_drum)^n: reported, never applied."""

    tyre: str  # name
    exponent: Estimate  # n, without unit; its standard uncertainty is NaN of a single pair
    pairs: int  # how many loads and pressures were measured on both surfaces
    drum_radius: float  # m, mean over the pairs
    ratio: float  # C_alpha on the drum over that on the flat track, geometric mean over the pairs


@dataclass(frozen=True)
class Campaign:
    """All conditions of a campaign, its repeatability, and the files that were skipped (name -> reason)."""

    folder: Path  # where the recordings are
    conditions: tuple[ConditionResult, ...]  # sorted as :func:`combine_campaign` leaves them
    sweep_repeatability: Repeatability  # of cornering stiffness
    pull_repeatability: Repeatability  # of lateral stiffness
    settings: FitSettings  # those of every fit
    skipped: dict[str, str]
    curvature: tuple[CurvatureExponent, ...]  # one a tyre that was measured on both surfaces

    def as_json(self) -> dict[str, Any]:
        """``{"conditions": [...]}``; a quantity that was not measured is null."""
        return {"conditions": [_condition_json(condition) for condition in self.conditions]}


def recordings_in(folder: Path, *, exclude: Path | None = None) -> list[Path]:
    """Recordings below a folder: every .csv and .tdx file, every other format with a sidecar, and sidecars that name
    their recording; sorted."""
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that holds the recordings")
    files = []
    for path in _files_in(folder, exclude):
        ending = path.suffix.casefold()
        sidecar = path.with_suffix(".toml")
        if ending == ".toml" and (_named_by(path) is not None or _refused_alone(path)):
            files.append(path)
        elif ending in OWN or (ending in FORMATS and sidecar.is_file()):
            files += [path] if _named_by(sidecar) is None else []
    if not files:
        raise InputError(
            f"{folder}: holds no recordings; expected .csv files or other formats with .toml sidecars, or .tdx files; "
            "`velotyre look FILE` shows what a recording can be used for, and drafts its sidecar"
        )
    described = {named for path in files if (named := _named_by(path)) is not None}
    return [path for path in files if path.resolve() not in described]


def passed_over(folder: Path, *, exclude: Path | None = None) -> list[Path]:
    """Files of a laboratory's formats below a ``folder`` that are not read, for they have no sidecar."""
    files = _files_in(folder, exclude)
    named = {_named_by(path) for path in files if path.suffix.casefold() == ".toml"}
    formats = set(FORMATS) - {*OWN, ".txt", ".dat", ".asc"}
    return [
        path
        for path in files
        if path.suffix.casefold() in formats and path.with_suffix(".toml") not in files and path.resolve() not in named
    ]


def _files_in(folder: Path, exclude: Path | None) -> list[Path]:
    results = None if exclude is None else exclude.resolve()
    return [path for path in files_below(folder) if results not in path.resolve().parents]


def _named_by(sidecar: Path) -> Path | None:
    """The recording that a sidecar names; None if it names none or is none."""
    try:
        named = read_toml(sidecar, "sidecar").get("recording") if sidecar.suffix == ".toml" else None
    except InputError:  # told when the recording is read
        return None
    return (sidecar.parent / named).resolve() if isinstance(named, str) and named else None


def _refused_alone(sidecar: Path) -> bool:
    """True if a TOML file without a recording next to it cannot be read: reading it as a recording gives the reason."""
    if any(sidecar.with_suffix(ending).is_file() for ending in FORMATS):
        return False
    try:
        read_toml(sidecar, "sidecar")
    except InputError:
        return True
    return False


def fit_campaign(
    folder: Path,
    *,
    settings: FitSettings | None = None,
    cache_folder: Path | None = None,
    exclude: Path | None = None,
    skip_bad: bool = True,
    jobs: int | None = None,
    wheel_radius: float = 0.34,
    progress: bool = True,
    channel_map: ChannelMap | None = None,
) -> Campaign:
    """Fit every recording of a folder and combine them by condition."""
    from tyre.ground.progress import progress_bar

    settings = settings or FitSettings()
    files = recordings_in(folder, exclude=exclude)
    shared = {"settings": settings, "cache_folder": cache_folder, "channel_map": channel_map}
    tasks = [(path, path.relative_to(folder).as_posix().removesuffix(".toml"), shared) for path in files]
    summaries: list[RecordingSummary] = []
    skipped: dict[str, str] = {}
    with nullcontext() if cache_folder is None else _hold_cache(cache_folder):
        outcomes = progress_bar(_run(tasks, jobs), total=len(tasks), desc="recordings", unit="file", show=progress)
        for name, outcome in chain.from_iterable(outcomes):
            if isinstance(outcome, RecordingSummary):
                summaries.append(outcome)
            elif skip_bad:
                skipped[name] = outcome
            else:
                raise InputError(
                    f"{outcome} (correct or remove the file, or leave it out with --skip-bad, the default)"
                )
    if not summaries:
        raise InputError(
            f"{folder}: none of {len(skipped)} recordings could be used; `velotyre look FILE` shows what is missing; "
            "the first: {}: {}".format(*next(iter(skipped.items())))
        )
    summaries.sort(key=lambda item: item.file)
    conditions, sweeps, pulls = combine_campaign(summaries, settings, where=str(folder))
    curvature = _curvature(conditions, wheel_radius)
    return Campaign(folder, tuple(conditions), sweeps, pulls, settings, dict(sorted(skipped.items())), curvature)


@contextmanager
def _hold_cache(folder: Path) -> Iterator[None]:
    """Hold the ``folder`` of finished fits, made if missing, during the block; another fit that fills it is waited for.

    What killed runs left in it is removed, which must not be what the other one is about to write.
    """
    make_folder(folder)
    waiting = f"warning: {folder}: another fit is writing there; this one waits for its end"
    with hold_folder(folder, lambda: print(waiting, file=sys.stderr)):
        make_folder(folder)  # the other one may have been removed with what it had made
        clear_of_killed_runs(folder)
        yield


def _curvature(conditions: Sequence[ConditionResult], wheel_radius: float) -> tuple[CurvatureExponent, ...]:
    """Exponent n of (1 + R / R_drum)^n of each tyre measured on both surfaces, R the ``wheel_radius`` (m)."""
    exponents = []
    for tyre in sorted({condition.tyre for condition in conditions}):
        of_tyre = [c for c in keep_upright(conditions) if c.tyre == tyre and c.cornering_stiffness is not None]
        flat = {(c.load, c.pressure): c.cornering_stiffness for c in of_tyre if c.surface == "flat"}
        pairs = [
            (partner.value / c.cornering_stiffness.value, c.drum_radius)
            for c in of_tyre
            if c.surface == "drum"
            and c.drum_radius
            and c.cornering_stiffness
            and (partner := flat.get((c.load, c.pressure)))
        ]
        if not pairs:
            continue
        ratios, radii = np.array(pairs).T
        y = np.log(ratios)
        x = np.array([log_curvature(wheel_radius=wheel_radius, drum_radius=r) for r in radii])
        exponent = float(x @ y / (x @ x))
        estimate = Estimate(exponent, float("nan"), 1.0)
        if y.size > 1:
            sd = float(np.sqrt(np.sum((y - exponent * x) ** 2) / (y.size - 1) / (x @ x)))
            estimate = Estimate(exponent, sd, float(y.size - 1))
        exponents.append(CurvatureExponent(tyre, estimate, y.size, float(np.mean(radii)), float(np.exp(y.mean()))))
    return tuple(exponents)


def _task(task: tuple[Path, str, dict[str, Any]]) -> list[tuple[str, RecordingSummary | str]]:
    """Summarise one file: path, name and the other arguments of :func:`summarise`, for a worker."""
    path, name, shared = task
    return summarise(path, name=name, **shared)


def _run(tasks: Sequence[Any], jobs: int | None) -> Iterator[list[tuple[str, RecordingSummary | str]]]:
    """Summarise files in ``jobs`` processes (None: one a processor), a result a file as each is ready."""
    count = jobs if jobs is not None else os.cpu_count() or 1
    if count < 1:
        raise InputError(f"jobs = {count} must be at least 1")
    remaining = iter(tasks)
    in_this_process = count == 1 or len(tasks) < 8  # fewer files cost less than a pool of workers
    for outcomes in map(_task, remaining):
        yield outcomes
        if not in_this_process and any(isinstance(outcome, RecordingSummary) for _, outcome in outcomes):
            break  # before the first that can be used, a pool may be of no use either
    else:
        return
    with worker_pool(count) as pool:
        # four a worker at a time, so that memory does not grow with the campaign
        pending = {pool.submit(_task, task) for task in islice(remaining, 4 * count)}
        try:
            while pending:
                finished, pending = wait(pending, return_when=FIRST_COMPLETED)
                pending |= {pool.submit(_task, task) for task in islice(remaining, len(finished))}
                yield from (future.result() for future in finished)
        finally:
            for future in pending:
                future.cancel()


def _condition_json(condition: ConditionResult) -> dict[str, Any]:
    """A condition as plain values, units at the ends of the keys; what was not measured is None."""
    estimates = {
        "cornering_stiffness_N_per_rad": condition.cornering_stiffness,
        "lateral_stiffness_N_per_m": condition.lateral_stiffness,
        "relaxation_length_m": condition.relaxation_length,
        "camber_stiffness_N_per_rad": condition.camber_stiffness,
        "twisting_stiffness_N_m_per_rad": condition.twisting_stiffness,
    }
    return {
        "tyre": condition.tyre,
        "surface": condition.surface,
        "load_N": condition.load,
        "pressure_bar": round(condition.pressure / PASCAL_PER_BAR, 6),
        "camber_deg": round(float(np.rad2deg(condition.camber)), 6),
        **{name: None if estimate is None else estimate.as_json() for name, estimate in estimates.items()},
        "r_squared": condition.r_squared,
        "files": list(condition.files),
        "warnings": list(condition.warnings),
    }


def write_tables(campaign: Campaign, out: Path, *, wheel_radius: float) -> tuple[list[Path], list[str]]:
    """Write one measured table per tyre and surface, and its .tir files (MF6.1; MF5.2 per pressure)."""
    tables, remarks = measured_tables(campaign)
    paths: list[Path] = []
    for folder in ("maps", "tir"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    stems = slugs(table.tyre for table in tables)
    for table in tables:
        name = f"{stems[table.tyre]}_{table.surface}"
        path = out / "maps" / f"{name}.csv"
        write_table(table, path)
        paths += [path, *_write_property_files(table, out / "tir", name, wheel_radius)]
    return paths, remarks


def measured_tables(campaign: Campaign) -> tuple[list[MeasuredTable], list[str]]:
    """The conditions of a campaign as one table per tyre and surface, with all that is known of their uncertainty."""
    groups: dict[tuple[str, str], list[ConditionResult]] = defaultdict(list)
    for condition in campaign.conditions:
        groups[condition.tyre, condition.surface].append(condition)
    tables: list[MeasuredTable] = []
    remarks: list[str] = []
    for (tyre, surface), conditions in groups.items():
        members = keep_upright(conditions)
        complete = [c for c in members if c.cornering_stiffness is not None and c.lateral_stiffness is not None]
        left_out = {"at more camber": len(conditions) - len(members), "without C or K": len(members) - len(complete)}
        label = f"{tyre} on {surface}"
        remarks += [f"{label}: conditions {how}, not in the map: {n}" for how, n in left_out.items() if n]
        if complete:
            tables.append(_table(complete, campaign))
    return tables, remarks


def _table(conditions: Sequence[ConditionResult], campaign: Campaign) -> MeasuredTable:
    synthetic = any(item.synthetic for item in conditions)
    borrowed = any(item.borrowed_stiffness for item in conditions)
    notes = ["standard deviations include calibration, which is common to all conditions of the campaign"]
    notes += ["synthetic: from the rig simulator, not measured"] if synthetic else []
    notes += ["lateral stiffness is that of the flat track"] if borrowed else []
    radius = next((item.drum_radius for item in conditions if item.drum_radius), None)
    c = _column([item.cornering_stiffness for item in conditions])
    k = _column([item.lateral_stiffness for item in conditions])
    routes, gains = sorted({route for item in conditions for route in item.direct}), campaign.settings.calibration
    first, trail = conditions[0], _column([item.pneumatic_trail for item in conditions])
    return MeasuredTable(
        tyre=first.tyre,
        surface=first.surface,
        load=np.array([item.load for item in conditions]),
        pressure=np.array([item.pressure for item in conditions]),
        cornering_stiffness=c.value,
        cornering_stiffness_sd=c.sd,
        lateral_stiffness=k.value,
        lateral_stiffness_sd=k.sd,
        source=f"fitted from the rig recordings in {campaign.folder.name}",
        notes=tuple(notes),
        lateral_stiffness_origin="flat-track value" if borrowed else "measured",
        synthetic=synthetic,
        drum_diameter=2.0 * radius if radius and first.surface == "drum" else None,
        calibration=CommonCalibration(**{name: getattr(gains, name) for name in ("force", "slip", "displacement")}),
        stiffness_correlation=np.array([_correlation(item) for item in conditions]),
        cornering_stiffness_dof=c.dof,
        lateral_stiffness_dof=k.dof,
        pneumatic_trail=trail if trail.known.any() else None,
        direct_relaxation_length={route: _column([item.direct.get(route) for item in conditions]) for route in routes},
    )


def _correlation(condition: ConditionResult) -> float:
    """Correlation of cornering and lateral stiffness; 0 if one of them is exact."""
    covariance = np.zeros((3, 3)) if condition.covariance is None else condition.covariance
    scale = float(np.sqrt(covariance[0, 0] * covariance[1, 1]))
    return float(covariance[0, 1]) / scale if scale > 0.0 else 0.0


def _column(estimates: Sequence[Estimate | None]) -> MeasuredColumn:
    """Make a column of estimates, NaN where there is none."""
    rows = [(np.nan, np.nan, np.inf) if e is None else (e.value, e.sd, e.dof) for e in estimates]
    return MeasuredColumn(*(np.array(column) for column in zip(*rows, strict=True)))


def _write_property_files(table: MeasuredTable, folder: Path, name: str, wheel_radius: float) -> list[Path]:
    from tyre.laws.tir import fit_mf52, fit_mf61, write_tir

    load, pressure = table.load, table.pressure
    c, k = table.cornering_stiffness, table.lateral_stiffness
    common: dict[str, Any] = {"tyre": table.tyre, "surface": table.surface, "notes": table.notes}
    paths = [folder / f"{name}_mf61.tir"]
    model = fit_mf61(load=load, pressure=pressure, cornering_stiffness=c, lateral_stiffness=k)
    write_tir(model, paths[0], unloaded_radius=wheel_radius, **common)
    for value in np.unique(pressure):
        at_pressure: Array = pressure == value
        paths.append(folder / f"{name}_{value / PASCAL_PER_BAR:.2f}bar_mf52.tir")
        old = fit_mf52(
            load=load[at_pressure],
            pressure=float(value),
            cornering_stiffness=c[at_pressure],
            lateral_stiffness=k[at_pressure],
            unloaded_radius=wheel_radius,
        )
        write_tir(old, paths[-1], **common)
    return paths
