"""A campaign: recordings of many conditions fitted, compared and exported."""

import os
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from tyre.arrays import Array
from tyre.channel_map import ChannelMap
from tyre.condition import (
    ConditionResult,
    FitSettings,
    Key,
    RecordingSummary,
    Repeatability,
    check_repeats,
    combine,
    condition_key,
    near_conditions,
    pooled_repeatability,
    upright,
    with_agreement,
    with_camber,
)
from tyre.contact_patch import log_curvature
from tyre.errors import InputError
from tyre.files import clear_of_killed_runs, read_toml, slugs
from tyre.formats import FORMATS
from tyre.map_files import write_table
from tyre.properties import Estimate
from tyre.recording_fits import summarise
from tyre.tables import CommonCalibration, MeasuredColumn, MeasuredTable
from tyre.units import PASCAL_PER_BAR
from tyre.workers import worker_pool

OWN = (".csv", ".tdx")
"""Endings that need no channel map if they hold velotyre's or TYDEX's names."""


@dataclass(frozen=True)
class CurvatureExponent:
    """Flat over drum cornering stiffness as (1 + R / R_drum)^n: reported, never applied."""

    tyre: str
    exponent: Estimate
    pairs: int
    drum_radius: float
    ratio: float


@dataclass(frozen=True)
class Campaign:
    """All conditions of a campaign, its repeatability, and the files that were skipped (name -> reason)."""

    folder: Path
    conditions: tuple[ConditionResult, ...]
    sweep_repeatability: Repeatability
    pull_repeatability: Repeatability
    settings: FitSettings
    skipped: dict[str, str]
    curvature: tuple[CurvatureExponent, ...]

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
        ending, beside = path.suffix.casefold(), path.with_suffix(".toml")
        if ending == ".toml" and _named_by(path) is not None:
            files.append(path)
        elif ending in OWN or (ending in FORMATS and beside.is_file()):
            files += [path] if _named_by(beside) is None else []
    if not files:
        raise InputError(
            f"{folder}: holds no recordings; expected .csv files or other formats with .toml sidecars, or .tdx files; "
            "`velotyre look FILE` says what a recording can be used for, and drafts its sidecar"
        )
    described = {named for path in files if (named := _named_by(path)) is not None}
    return [path for path in files if path.resolve() not in described]


def passed_over(folder: Path, *, exclude: Path | None = None) -> list[Path]:
    """Files of a laboratory's formats below a ``folder`` that are not read, for they have no sidecar."""
    files = _files_in(folder, exclude)
    named = {_named_by(path) for path in files if path.suffix.casefold() == ".toml"}
    formats = set(FORMATS) - {*OWN, ".txt", ".dat", ".asc"}
    return [
        path for path in files
        if path.suffix.casefold() in formats and path.with_suffix(".toml") not in files and path.resolve() not in named
    ]  # fmt: skip


def _files_in(folder: Path, exclude: Path | None) -> list[Path]:
    results = None if exclude is None else exclude.resolve()
    return [path for path in sorted(folder.rglob("*")) if path.is_file() and results not in path.resolve().parents]


def _named_by(sidecar: Path) -> Path | None:
    """The recording that a sidecar names; None if it names none or is none."""
    try:
        named = read_toml(sidecar, "sidecar").get("recording") if sidecar.suffix == ".toml" else None
    except InputError:  # told when the recording is read
        return None
    return (sidecar.parent / named).resolve() if isinstance(named, str) and named else None


def fit_campaign(
    folder: Path, *, settings: FitSettings | None = None, cache_folder: Path | None = None,
    exclude: Path | None = None, skip_bad: bool = True, jobs: int | None = None, wheel_radius: float = 0.34,
    progress: bool = True, channel_map: ChannelMap | None = None,
) -> Campaign:  # fmt: skip
    """Fit every recording of a folder and combine them by condition."""
    from tyre.progress import progress_bar

    settings = settings or FitSettings()
    files = recordings_in(folder, exclude=exclude)
    if cache_folder is not None:
        cache_folder.mkdir(parents=True, exist_ok=True)
        clear_of_killed_runs(cache_folder)
    shared = {"settings": settings, "cache_folder": cache_folder, "channel_map": channel_map}
    tasks = [(path, path.relative_to(folder).as_posix().removesuffix(".toml"), shared) for path in files]
    summaries: list[RecordingSummary] = []
    skipped: dict[str, str] = {}
    outcomes = progress_bar(_run(tasks, jobs), total=len(tasks), desc="recordings", unit="file", show=progress)
    for name, outcome in chain.from_iterable(outcomes):
        if isinstance(outcome, RecordingSummary):
            summaries.append(outcome)
        elif skip_bad:
            skipped[name] = outcome
        else:
            raise InputError(f"{outcome} (mend or remove the file, or leave it out with --skip-bad, the default)")
    if not summaries:
        raise InputError(
            f"{folder}: none of {len(skipped)} recordings could be used; `velotyre look FILE` says what is lacking; "
            "the first: {}: {}".format(*next(iter(skipped.items())))
        )
    summaries.sort(key=lambda item: item.file)
    return _assemble(folder, summaries, settings, dict(sorted(skipped.items())), wheel_radius)


def _assemble(
    folder: Path, summaries: Sequence[RecordingSummary], settings: FitSettings, skipped: dict[str, str],
    wheel_radius: float,
) -> Campaign:  # fmt: skip
    groups: dict[Key, list[RecordingSummary]] = defaultdict(list)
    for summary in summaries:
        groups[condition_key(summary)].append(summary)
    for key, group in groups.items():
        check_repeats(group, f"{folder}: {key}, {key.surface}")
    near = near_conditions(groups)

    sweeps, pulls = (
        pooled_repeatability(
            [[item for item in group if item.kind == kind] for group in groups.values()],
            floor=settings.calibration.repeatability,
        )
        for kind in ("slip_sweep", "pull_test")
    )
    conditions = []
    for key in sorted(groups, key=lambda k: (k.tyre, k.surface != "flat", k.surface, k.pressure, k.load, k.camber)):
        flat = groups.get(key._replace(surface="flat"), []) if key.surface == "drum" else []
        conditions.append(
            combine(
                key, groups[key], borrowed=[item for item in flat if item.kind == "pull_test"],
                sweep_repeatability=sweeps, pull_repeatability=pulls, calibration=settings.calibration,
                further_warnings=[near[key]] if key in near else [],
            )
        )  # fmt: skip
    conditions = with_agreement(with_camber(conditions, settings.calibration))
    curvature = _curvature(conditions, wheel_radius)
    return Campaign(folder, tuple(conditions), sweeps, pulls, settings, skipped, curvature)


def _curvature(conditions: Sequence[ConditionResult], wheel_radius: float) -> tuple[CurvatureExponent, ...]:
    """Exponent n of (1 + R / R_drum)^n from conditions measured on both surfaces."""
    found = []
    for tyre in sorted({condition.tyre for condition in conditions}):
        mine = [c for c in upright(conditions) if c.tyre == tyre and c.cornering_stiffness is not None]
        flat = {(c.load, c.pressure): c.cornering_stiffness for c in mine if c.surface == "flat"}
        logs, bases, radii = [], [], []
        for c in mine:
            partner = flat.get((c.load, c.pressure))
            if c.surface == "drum" and c.drum_radius and c.cornering_stiffness and partner:
                logs.append(np.log(partner.value / c.cornering_stiffness.value))
                bases.append(log_curvature(wheel_radius=wheel_radius, drum_radius=c.drum_radius))
                radii.append(c.drum_radius)
        if not logs:
            continue
        y, x = np.array(logs), np.array(bases)
        exponent = float(x @ y / (x @ x))
        estimate = Estimate(exponent, float("nan"), 1.0)
        if y.size > 1:
            sd = float(np.sqrt(np.sum((y - exponent * x) ** 2) / (y.size - 1) / (x @ x)))
            estimate = Estimate(exponent, sd, float(y.size - 1))
        found.append(CurvatureExponent(tyre, estimate, y.size, float(np.mean(radii)), float(np.exp(y.mean()))))
    return tuple(found)


def _task(task: tuple[Path, str, dict[str, Any]]) -> list[tuple[str, RecordingSummary | str]]:
    path, name, shared = task
    return summarise(path, name=name, **shared)


def _run(tasks: Sequence[Any], jobs: int | None) -> Iterator[list[tuple[str, RecordingSummary | str]]]:
    count = jobs if jobs is not None else os.cpu_count() or 1
    if count < 1:
        raise InputError(f"jobs = {count} must be at least 1")
    if count == 1 or len(tasks) < 8:  # fewer files cost less than a pool of workers
        yield from map(_task, tasks)
        return
    with worker_pool(count) as pool:
        remaining = iter(tasks)
        # four a worker at a time, so that memory does not grow with the campaign
        pending = {pool.submit(_task, task) for task in islice(remaining, 4 * count)}
        try:
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                pending |= {pool.submit(_task, task) for task in islice(remaining, len(done))}
                yield from (future.result() for future in done)
        finally:
            for future in pending:
                future.cancel()


def _condition_json(condition: ConditionResult) -> dict[str, Any]:
    estimates = {
        "cornering_stiffness_N_per_rad": condition.cornering_stiffness,
        "lateral_stiffness_N_per_m": condition.lateral_stiffness, "relaxation_length_m": condition.relaxation_length,
        "camber_stiffness_N_per_rad": condition.camber_stiffness,
        "twisting_stiffness_N_m_per_rad": condition.twisting_stiffness,
    }  # fmt: skip
    return {
        "tyre": condition.tyre, "surface": condition.surface, "load_N": condition.load,
        "pressure_bar": round(condition.pressure / PASCAL_PER_BAR, 6),
        "camber_deg": round(float(np.rad2deg(condition.camber)), 6),
        **{name: None if estimate is None else estimate.as_json() for name, estimate in estimates.items()},
        "r_squared": condition.r_squared, "files": list(condition.files), "warnings": list(condition.warnings),
    }  # fmt: skip


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
    for (tyre, surface), every in groups.items():
        members = upright(every)
        if len(members) < len(every):
            cambered = len(every) - len(members)
            remarks.append(f"{tyre} on {surface}: {cambered} conditions at more camber are not in the map")
        complete = [c for c in members if c.cornering_stiffness is not None and c.lateral_stiffness is not None]
        if len(complete) < len(members):
            missing = len(members) - len(complete)
            remarks.append(f"{tyre} on {surface}: {missing} conditions without C or K are not in the map")
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
        tyre=first.tyre, surface=first.surface, load=np.array([item.load for item in conditions]),
        pressure=np.array([item.pressure for item in conditions]), cornering_stiffness=c.value,
        cornering_stiffness_sd=c.sd, lateral_stiffness=k.value, lateral_stiffness_sd=k.sd,
        source=f"fitted from the rig recordings in {campaign.folder.name}", notes=tuple(notes),
        lateral_stiffness_origin="flat-track value" if borrowed else "measured", synthetic=synthetic,
        drum_diameter=2.0 * radius if radius and first.surface == "drum" else None,
        calibration=CommonCalibration(**{name: getattr(gains, name) for name in ("force", "slip", "displacement")}),
        stiffness_correlation=np.array([_correlation(item) for item in conditions]), cornering_stiffness_dof=c.dof,
        lateral_stiffness_dof=k.dof, pneumatic_trail=trail if trail.known.any() else None,
        direct_relaxation_length={route: _column([item.direct.get(route) for item in conditions]) for route in routes},
    )  # fmt: skip


def _correlation(condition: ConditionResult) -> float:
    """Correlation of cornering and lateral stiffness; 0 if one of them is exact."""
    covariance = np.zeros((3, 3)) if condition.covariance is None else condition.covariance
    scale = float(np.sqrt(covariance[0, 0] * covariance[1, 1]))
    return float(covariance[0, 1]) / scale if scale > 0.0 else 0.0


def _column(estimates: Sequence[Estimate | None]) -> MeasuredColumn:
    rows = [(np.nan, np.nan, np.inf) if e is None else (e.value, e.sd, e.dof) for e in estimates]
    return MeasuredColumn(*(np.array(column) for column in zip(*rows, strict=True)))


def _write_property_files(table: MeasuredTable, folder: Path, name: str, wheel_radius: float) -> list[Path]:
    from tyre.tir import fit_mf52, fit_mf61, write_tir

    load, pressure = table.load, table.pressure
    c, k = table.cornering_stiffness, table.lateral_stiffness
    common: dict[str, Any] = {"tyre": table.tyre, "surface": table.surface, "notes": table.notes}
    paths = [folder / f"{name}_mf61.tir"]
    model = fit_mf61(load=load, pressure=pressure, cornering_stiffness=c, lateral_stiffness=k)
    write_tir(model, paths[0], unloaded_radius=wheel_radius, **common)
    for value in np.unique(pressure):
        here: Array = pressure == value
        paths.append(folder / f"{name}_{value / PASCAL_PER_BAR:.2f}bar_mf52.tir")
        old = fit_mf52(
            load=load[here], pressure=float(value), cornering_stiffness=c[here], lateral_stiffness=k[here],
            unloaded_radius=wheel_radius,
        )  # fmt: skip
        write_tir(old, paths[-1], **common)
    return paths
