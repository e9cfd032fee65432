"""A folder of rig recordings turned into conditions: C_Fy, K_y and relaxation length of every tyre measured."""

import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError
from tyre.base.files import clear_of_killed_runs
from tyre.base.parallel import worker_pool
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.condition import (
    ConditionResult,
    Key,
    combine,
    condition_key,
)
from tyre.campaigns.consistency import check_repeats, near_conditions
from tyre.campaigns.recording import summarise
from tyre.campaigns.repeatability import Repeatability, pooled_repeatability
from tyre.campaigns.summary import FitSettings, RecordingSummary
from tyre.channels.read import FORMATS
from tyre.drum import log_curvature
from tyre.estimate import Estimate

_IN_PROCESS = 8  # below this many files a pool of workers costs more than it saves
_WAITING = 4  # files handed out per worker, so that memory does not grow with the campaign


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
    """Recordings below a folder: every .csv and .tdx file, and every other format with a sidecar, sorted.

    Parameters
    ----------
    folder : Path
    exclude : Path, optional
        A folder (the results) not to be searched.

    Returns
    -------
    list of Path

    Raises
    ------
    InputError
        When the folder does not exist or holds no recordings.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder; give the folder that holds the recordings")
    results = None if exclude is None else exclude.resolve()
    files = [path for path in sorted(folder.rglob("*")) if _may_be_recording(path) and not _within(path, results)]
    if not files:
        raise InputError(
            f"{folder}: holds no recordings; expected .csv files or other formats with .toml sidecars, or .tdx files; "
            "`velotyre look FILE` says what a recording can be used for, and drafts its sidecar"
        )
    return files


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
) -> Campaign:
    """Fit every recording of a folder and combine them by condition.

    Parameters
    ----------
    folder : Path
        CSV recordings with sidecars and TYDEX files, also in sub-folders.
    settings : FitSettings, optional
    cache_folder : Path, optional
        Per-file results are kept there by content, so an interrupted run goes on where it was.
    exclude : Path, optional
        Folder of results inside ``folder``.
    skip_bad : bool
        Leave out recordings that cannot be read or fitted, and say why in ``skipped``; else the first one raises.
    jobs : int, optional
        Number of processes; default: one per processor.
    wheel_radius : float
        Radius of the wheel with tyre, m, for the curvature exponent.
    progress : bool
        Show a progress bar on stderr.

    Returns
    -------
    Campaign

    Raises
    ------
    InputError
        For an empty folder, a bad file (where ``skip_bad`` is False), or when no file is left.
    """
    settings = settings or FitSettings()
    files = recordings_in(folder, exclude=exclude)
    if cache_folder is not None:
        cache_folder.mkdir(parents=True, exist_ok=True)
        clear_of_killed_runs(cache_folder)
    tasks = [(path, path.relative_to(folder).as_posix(), settings, cache_folder) for path in files]
    summaries: list[RecordingSummary] = []
    skipped: dict[str, str] = {}
    for name, outcome in _progress(_run(tasks, jobs), len(tasks), show=progress):
        if isinstance(outcome, RecordingSummary):
            summaries.append(outcome)
        elif skip_bad:
            skipped[name] = outcome
        else:
            raise InputError(f"{outcome} (mend or remove the file, or leave it out with --skip-bad, the default)")
    if not summaries:
        first = next(iter(skipped.items()))
        raise InputError(
            f"{folder}: none of {len(skipped)} recordings could be used; `velotyre look FILE` says what is lacking; "
            f"the first: {first[0]}: {first[1]}"
        )
    summaries.sort(key=lambda item: item.file)
    return _assemble(folder, summaries, settings, dict(sorted(skipped.items())), wheel_radius)


def _assemble(
    folder: Path,
    summaries: Sequence[RecordingSummary],
    settings: FitSettings,
    skipped: dict[str, str],
    wheel_radius: float,
) -> Campaign:
    groups: dict[Key, list[RecordingSummary]] = defaultdict(list)
    for summary in summaries:
        groups[condition_key(summary)].append(summary)
    for (tyre, surface, load, pressure), group in groups.items():
        check_repeats(group, f"{folder}: {tyre}, {surface}, {load:g} N, {pressure / PASCAL_PER_BAR:g} bar")
    near = near_conditions(groups)

    def of(kind: str) -> list[list[RecordingSummary]]:
        return [[item for item in group if item.kind == kind] for group in groups.values()]

    floor = settings.calibration.repeatability
    sweeps = pooled_repeatability(of("slip_sweep"), floor=floor)
    pulls = pooled_repeatability(of("pull_test"), floor=floor)
    conditions = []
    for key in sorted(groups, key=lambda k: (k[0], k[1] != "flat", k[1], k[3], k[2])):
        tyre, surface, load, pressure = key
        flat = groups.get((tyre, "flat", load, pressure), []) if surface == "drum" else []
        conditions.append(
            combine(
                key,
                groups[key],
                borrowed=[item for item in flat if item.kind == "pull_test"],
                sweep_repeatability=sweeps,
                pull_repeatability=pulls,
                calibration=settings.calibration,
                further_warnings=[near[key]] if key in near else [],
            )
        )
    return Campaign(
        folder=folder,
        conditions=tuple(conditions),
        sweep_repeatability=sweeps,
        pull_repeatability=pulls,
        settings=settings,
        skipped=skipped,
        curvature=_curvature(conditions, wheel_radius),
    )


def _curvature(conditions: Sequence[ConditionResult], wheel_radius: float) -> tuple[CurvatureExponent, ...]:
    """Exponent n of (1 + R / R_drum)^n from conditions measured on both surfaces."""
    found = []
    for tyre in sorted({condition.tyre for condition in conditions}):
        flat = {
            (c.load, c.pressure): c.cornering_stiffness
            for c in conditions
            if c.tyre == tyre and c.surface == "flat" and c.cornering_stiffness is not None
        }
        logs, bases, radii = [], [], []
        for c in conditions:
            partner = flat.get((c.load, c.pressure))
            if c.tyre == tyre and c.surface == "drum" and c.drum_radius and c.cornering_stiffness and partner:
                logs.append(np.log(partner.value / c.cornering_stiffness.value))
                bases.append(log_curvature(wheel_radius=wheel_radius, drum_radius=c.drum_radius))
                radii.append(c.drum_radius)
        if not logs:
            continue
        y, x = np.array(logs), np.array(bases)
        exponent = float(x @ y / (x @ x))
        if y.size > 1:
            sd = float(np.sqrt(np.sum((y - exponent * x) ** 2) / (y.size - 1) / (x @ x)))
            estimate = Estimate(exponent, sd, float(y.size - 1))
        else:
            estimate = Estimate(exponent, float("nan"), 1.0)
        found.append(CurvatureExponent(tyre, estimate, y.size, float(np.mean(radii)), float(np.exp(y.mean()))))
    return tuple(found)


def _task(task: tuple[Path, str, FitSettings, Path | None]) -> tuple[str, RecordingSummary | str]:
    path, name, settings, cache_folder = task
    try:
        return name, summarise(path, name=name, settings=settings, cache_folder=cache_folder)
    except InputError as error:
        return name, str(error)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra: numbers that no fit can go through
        return name, f"{path}: cannot be fitted ({type(error).__name__}: {error})"


def _run(tasks: Sequence[Any], jobs: int | None) -> Iterator[tuple[str, RecordingSummary | str]]:
    count = jobs if jobs is not None else os.cpu_count() or 1
    if count < 1:
        raise InputError(f"jobs = {count} must be at least 1")
    if count == 1 or len(tasks) < _IN_PROCESS:
        yield from map(_task, tasks)
        return
    with worker_pool(count) as pool:
        remaining = iter(tasks)
        pending: set[Future[tuple[str, RecordingSummary | str]]] = set()
        try:
            for task in islice(remaining, _WAITING * count):
                pending.add(pool.submit(_task, task))
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for task in islice(remaining, len(done)):
                    pending.add(pool.submit(_task, task))
                for future in done:
                    yield future.result()
        finally:
            for future in pending:
                future.cancel()


def _progress(items: Iterable[Any], total: int, *, show: bool) -> Iterable[Any]:
    from tyre.base.progress import progress_bar

    return progress_bar(items, total=total, desc="recordings", unit="file", show=show)


def _may_be_recording(path: Path) -> bool:
    ending = path.suffix.casefold()
    described = ending in FORMATS and path.with_suffix(".toml").is_file()
    return path.is_file() and (ending in (".csv", ".tdx") or described)


def _within(path: Path, folder: Path | None) -> bool:
    return folder is not None and folder in path.resolve().parents


def _condition_json(condition: ConditionResult) -> dict[str, Any]:
    def plain(estimate: Estimate | None) -> dict[str, object] | None:
        return None if estimate is None else estimate.as_json()

    return {
        "tyre": condition.tyre,
        "surface": condition.surface,
        "load_N": condition.load,
        "pressure_bar": round(condition.pressure / PASCAL_PER_BAR, 6),
        "cornering_stiffness_N_per_rad": plain(condition.cornering_stiffness),
        "lateral_stiffness_N_per_m": plain(condition.lateral_stiffness),
        "relaxation_length_m": plain(condition.relaxation_length),
        "r_squared": condition.r_squared,
        "files": list(condition.files),
        "warnings": list(condition.warnings),
    }
