"""One file of a campaign: read, fitted, reduced to a few numbers, and kept in a cache so that a killed run goes on."""

import hashlib
import json
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError
from tyre.base.files import write_text
from tyre.campaigns.consistency import check_plausible, refuse_infinite
from tyre.campaigns.summary import FitSettings, RecordingSummary
from tyre.fits.pull_test import fit_pull_test
from tyre.fits.slip_step import fit_slip_step, is_slip_step
from tyre.fits.slip_sweep import fit_slip_sweep
from tyre.recordings.recording import Condition, PullTest, RigRun

_POINTS = 240  # of a recording kept for figures, in the cache only


def summarise(path: Path, *, name: str, settings: FitSettings, cache_folder: Path | None) -> RecordingSummary:
    """Read and fit one file, or take the result of an earlier run with the same content, settings and code.

    Parameters
    ----------
    path : Path
        Recording (.csv with sidecar, or .tdx).
    name : str
        How the file is called in results, relative to the campaign's folder.
    settings : FitSettings
    cache_folder : Path or None
        Where results are kept; None keeps none.

    Returns
    -------
    RecordingSummary

    Raises
    ------
    InputError
        When the file cannot be read or fitted; the message names it.
    """
    kept = None if cache_folder is None else cache_folder / f"{_key(path, settings)}.fit"
    if kept is not None and (found := _read_kept(kept)) is not None:
        return _from_json(found["summary"], name, kept)
    summary, points = fit_recording(path, name=name, settings=settings)
    if kept is None:
        return summary
    content = json.dumps({"summary": asdict(summary) | {"cache": None}, "points": points})
    write_text(kept, f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}\n")
    return _from_json(asdict(summary), name, kept)


def _read_kept(kept: Path) -> dict[str, Any] | None:
    """What an earlier run kept; None where there is nothing, or not what was written: then it is fitted again."""
    try:
        digest, content = kept.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):  # not there, no text, not two lines
        return None
    if hashlib.sha256(content.encode()).hexdigest() != digest:
        return None
    found: dict[str, Any] = json.loads(content)
    return found


def fit_recording(path: Path, *, name: str, settings: FitSettings) -> tuple[RecordingSummary, dict[str, list[float]]]:
    """Fit one recording by its kind; also returns up to 240 points (measured, fitted) for figures.

    Parameters
    ----------
    path, name, settings
        As in :func:`summarise`.

    Raises
    ------
    InputError
        As :func:`summarise`.
    """
    from tyre.recordings.read import read_recording

    return fit_read(read_recording(path), path, name=name, settings=settings)


def fit_read(
    recording: RigRun | PullTest, path: Path, *, name: str, settings: FitSettings
) -> tuple[RecordingSummary, dict[str, list[float]]]:
    """Fit a recording that has been read, as :func:`fit_recording`.

    Parameters
    ----------
    recording : RigRun or PullTest
    path : Path
        What messages call it.
    name, settings
        As in :func:`summarise`.

    Raises
    ------
    InputError
        When it cannot be fitted.
    """
    from tyre.recordings.preflight import preflight

    check = preflight(recording, load_tolerance=settings.load_tolerance)
    if not check.usable:
        raise InputError(f"{path}: not usable: {'; '.join(check.problems)}")
    notes = tuple(dict.fromkeys((*recording.notes, *check.problems)))
    if isinstance(recording, PullTest):
        summary, points = _pull(recording, name, settings)
    elif is_slip_step(recording):
        summary, points = _step(recording, name)
    else:
        summary, points = _sweep(recording, name, settings)
    refuse_infinite(summary, path)
    unusual = check_plausible(summary, path)
    extra = tuple(note for note in (*summary.notes, *unusual) if note not in notes)
    return RecordingSummary(**{**_shallow(summary), "notes": notes + extra}), points


def points_of(summary: RecordingSummary) -> dict[str, Any]:
    """Points of a fitted recording for a figure, from the cache; empty where none were kept.

    Parameters
    ----------
    summary : RecordingSummary
    """
    found = None if summary.cache is None else _read_kept(summary.cache)
    return {} if found is None else {key: np.array(value) for key, value in found["points"].items()}


def _sweep(run: RigRun, name: str, settings: FitSettings) -> tuple[RecordingSummary, dict[str, list[float]]]:
    fit = fit_slip_sweep(run, calibration=settings.calibration, lag_correction=settings.lag_correction)
    details = {
        "peak_N": fit.parameters["peak"],
        "shape": fit.parameters["shape"],
        "curvature": fit.parameters["curvature"],
        "Sv_N": fit.parameters["vertical_shift"],
        "Sv_sd_N": fit.parameters_sd["vertical_shift"],
        "Sh_rad": fit.parameters["horizontal_shift"],
        "Sh_sd_rad": fit.parameters_sd["horizontal_shift"],
        "drift_N": fit.parameters["drift"],
        "load_N": fit.load,
        "largest_force_N": float(np.max(np.abs(fit.blocks.force))),
        "branches": float(fit.branches),
        "residual_sd_N": fit.residual_sd,
    }
    if fit.apparent_relaxation_length is not None:
        details["apparent_relaxation_length_m"] = fit.apparent_relaxation_length
    if fit.temperature is not None:
        details["temperature_C"] = fit.temperature
    if fit.aligning_moment is not None:
        details |= {
            "pneumatic_trail_m": fit.aligning_moment.pneumatic_trail,
            "pneumatic_trail_sd_m": fit.aligning_moment.pneumatic_trail_sd,
            "aligning_moment_slope_N_m_per_rad": fit.aligning_moment.slope,
        }
    used = fit.blocks.settled
    thin = slice(None, None, max(1, int(used.sum()) // _POINTS))
    points = {
        "slip_rad": fit.blocks.slip[used][thin].tolist(),
        "force_N": fit.blocks.force[used][thin].tolist(),
        "residual_N": (-fit.residuals[thin]).tolist(),
        "rate_rad_s": fit.blocks.rate[used][thin].tolist(),
        "time_s": fit.blocks.time[used][thin].tolist(),
    }
    return (
        RecordingSummary(
            file=name,
            kind="slip_sweep",
            condition=run.condition,
            synthetic=run.synthetic,
            value=fit.cornering_stiffness.value,
            fit_sd=fit.fit_sd,
            r_squared=fit.r_squared,
            rate=fit.rate,
            speed=fit.speed,
            half_gap=fit.half_gap,
            half_gap_sd=fit.half_gap_sd,
            details=details,
            notes=fit.notes,
        ),
        points,
    )


def _pull(test: PullTest, name: str, settings: FitSettings) -> tuple[RecordingSummary, dict[str, list[float]]]:
    fit = fit_pull_test(test, calibration=settings.calibration)
    thin = slice(None, None, max(1, fit.force.size // _POINTS))
    return (
        RecordingSummary(
            file=name,
            kind="pull_test",
            condition=test.condition,
            synthetic=test.synthetic,
            value=fit.lateral_stiffness.value,
            fit_sd=fit.fit_sd,
            r_squared=fit.r_squared,
            details={
                "friction_N": fit.friction,
                "largest_force_N": float(np.max(np.abs(fit.force))),
                "presliding_m": fit.presliding,
                "linear_range_m": fit.linear_range,
                "departure": fit.departure,
                "gauge_resolution_m": fit.resolution,
                "rim_share": fit.rim_share,
                "readings": float(fit.readings),
                "residual_sd_N": fit.residual_sd,
            },
            notes=fit.notes,
        ),
        {
            "deflection_m": fit.deflection[thin].tolist(),
            "force_N": fit.force[thin].tolist(),
            "fitted_N": fit.fitted[thin].tolist(),
        },
    )


def _step(run: RigRun, name: str) -> tuple[RecordingSummary, dict[str, list[float]]]:
    fit = fit_slip_step(run)
    details = {"force_change_N": fit.force_change, "residual_sd_N": fit.residual_sd}
    details["dof"] = fit.relaxation_length.dof
    if fit.distance_to_63 is not None:
        details["distance_to_63_m"] = fit.distance_to_63
    return (
        RecordingSummary(
            file=name,
            kind="slip_step",
            condition=run.condition,
            synthetic=run.synthetic,
            value=fit.relaxation_length.value,
            fit_sd=fit.relaxation_length.sd,
            r_squared=fit.r_squared,
            details=details,
            notes=fit.notes,
        ),
        {},
    )


def _shallow(summary: RecordingSummary) -> dict[str, Any]:
    return {item.name: getattr(summary, item.name) for item in fields(summary)}


def _from_json(table: dict[str, Any], name: str, kept: Path) -> RecordingSummary:
    condition = Condition(**table["condition"])
    return RecordingSummary(
        **{**table, "condition": condition, "notes": tuple(table["notes"]), "file": name, "cache": kept}
    )


def _key(path: Path, settings: FitSettings) -> str:
    digest = hashlib.sha256()
    try:
        digest.update(path.read_bytes())
        sidecar = path.with_suffix(".toml")
        digest.update(sidecar.read_bytes() if path.suffix.casefold() == ".csv" and sidecar.exists() else b"")
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    digest.update(path.suffix.casefold().encode())
    digest.update(repr(settings).encode())
    digest.update(_code())
    return digest.hexdigest()[:32]


CODE = ("base", "campaigns", "channels", "fits", "magic_formula", "recordings")
"""Rooms whose code decides a result."""


@cache
def _code() -> bytes:
    """Digest of the modules that decide a result: a changed fit does not return an old answer."""
    from importlib import resources

    digest = hashlib.sha256()
    root = resources.files("tyre")
    for folder in (root / room for room in CODE):
        for item in sorted(folder.iterdir(), key=lambda entry: entry.name):
            if item.name.endswith(".py"):
                digest.update(item.read_bytes())
    return digest.digest()
