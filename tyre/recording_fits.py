"""The fit of one recording, of any kind, kept in a cache."""

import hashlib
import json
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tyre.channel_map import ChannelMap
from tyre.condition import FitSettings, RecordingSummary, check_plausible, refuse_infinite
from tyre.errors import InputError
from tyre.files import write_text
from tyre.preflight import preflight
from tyre.properties import Estimate
from tyre.pull_test import fit_pull_test
from tyre.recording import Condition, PullTest, RigRun
from tyre.recording_files import file_and_sidecar, read_events
from tyre.relaxation import fit_slip_step, is_slip_step
from tyre.slip_sweep import fit_slip_sweep

Points = dict[str, list[float]]


def summarise(
    path: Path, *, name: str, settings: FitSettings, cache_folder: Path | None, channel_map: ChannelMap | None = None
) -> list[tuple[str, RecordingSummary | str]]:
    """Fit every event of one file, or take the results of an earlier run with the same content, settings and code.

    Gives the name of each event with its fit, or the reason why there is none.
    """
    try:
        kept = None if cache_folder is None else cache_folder / f"{_key(path, settings, channel_map)}.fit"
        found = None if kept is None else _read_kept(kept)
        if found is None:
            found = [_fitted(event, run, path, settings) for event, run in read_events(path, channel_map).items()]
            if kept is not None:
                content = json.dumps(found)
                write_text(kept, f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}\n")
    except InputError as error:
        return [(name, str(error))]
    outcomes: list[tuple[str, RecordingSummary | str]] = []
    for one in found:
        called = f"{name}#{one['event']}" if one["event"] else name
        outcomes.append((called, _summary_of(one, called, kept) if one["summary"] else one["problem"]))
    return outcomes


def points_of(summary: RecordingSummary) -> dict[str, Any]:
    """Return the points of a fitted recording for a figure, from the cache; empty if none were kept."""
    found = None if summary.cache is None else _read_kept(summary.cache)
    points: dict[str, Any] = next((one["points"] for one in found or () if one["event"] == summary.event), {})
    return {key: np.array(value) for key, value in points.items()}


def _fitted(event: str, recording: RigRun | PullTest, path: Path, settings: FitSettings) -> dict[str, Any]:
    """Fit one event, or say why not, as plain values."""
    try:
        summary, points = fit_read(recording, path, name=event, settings=settings)
        return {"event": event, "summary": asdict(summary), "points": points}
    except InputError as error:
        problem = str(error)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra: numbers that no fit can go through
        problem = f"{path}: cannot be fitted ({type(error).__name__}: {error})"
    return {"event": event, "summary": None, "problem": problem}


def _summary_of(one: dict[str, Any], name: str, kept: Path | None) -> RecordingSummary:
    table = one["summary"]
    own = {"condition": Condition(**table["condition"]), "notes": tuple(table["notes"]), "file": name, "cache": kept}
    return RecordingSummary(**table | own | {"event": one["event"]})


def _read_kept(kept: Path) -> list[dict[str, Any]] | None:
    """Return the content of a file of the cache; None if it is damaged or not there: then it is fitted again."""
    try:
        digest, content = kept.read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):  # not there, no text, not two lines
        return None
    if hashlib.sha256(content.encode()).hexdigest() != digest:
        return None
    found: list[dict[str, Any]] = json.loads(content)
    return found


def _key(path: Path, settings: FitSettings, channel_map: ChannelMap | None) -> str:
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
    for item in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(item.read_bytes())
    return digest.digest()


def fit_read(
    recording: RigRun | PullTest, path: Path, *, name: str, settings: FitSettings
) -> tuple[RecordingSummary, Points]:
    """Fit a recording by its kind; also returns up to 240 points (measured, fitted) for figures."""
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
    return replace(summary, notes=notes + extra), points


def _summary(
    recording: RigRun | PullTest, name: str, kind: str, estimate: Estimate, fit: Any, details: dict[str, float]
) -> RecordingSummary:
    return RecordingSummary(
        file=name, kind=kind, condition=recording.condition, synthetic=recording.synthetic, value=estimate.value,
        fit_sd=getattr(fit, "fit_sd", estimate.sd), r_squared=fit.r_squared, details=details, notes=fit.notes,
    )  # fmt: skip


def _sweep(run: RigRun, name: str, settings: FitSettings) -> tuple[RecordingSummary, Points]:
    fit = fit_slip_sweep(run, calibration=settings.calibration, lag_correction=settings.lag_correction)
    parameters, blocks, used = fit.parameters, fit.blocks, fit.blocks.settled
    sd, largest = fit.parameters_sd, float(np.max(np.abs(blocks.force)))
    details = {
        "peak_N": parameters["peak"], "shape": parameters["shape"], "curvature": parameters["curvature"],
        "Sv_N": parameters["vertical_shift"], "Sv_sd_N": sd["vertical_shift"],
        "Sh_rad": parameters["horizontal_shift"], "Sh_sd_rad": sd["horizontal_shift"],
        "drift_N": parameters["drift"], "load_N": fit.load, "largest_force_N": largest,
        "branches": float(fit.branches), "residual_sd_N": fit.residual_sd,
        "force_at_zero_N": fit.force_at_zero[0], "force_at_zero_sd_N": fit.force_at_zero[1],
    }  # fmt: skip
    if fit.apparent_relaxation_length is not None:
        details["apparent_relaxation_length_m"] = fit.apparent_relaxation_length
    if run.inclination is not None:
        details["camber_rad"] = float(np.nanmedian(run.inclination))
    if fit.temperature is not None:
        details["temperature_C"] = fit.temperature
    if fit.aligning_moment is not None:
        details["pneumatic_trail_m"] = fit.aligning_moment.pneumatic_trail
        details["pneumatic_trail_sd_m"] = fit.aligning_moment.pneumatic_trail_sd
        details["aligning_moment_slope_N_m_per_rad"] = fit.aligning_moment.slope
        zero, sd_of_zero = fit.aligning_moment.at_zero
        details |= {"moment_at_zero_N_m": zero, "moment_at_zero_sd_N_m": sd_of_zero}
    summary = _summary(run, name, "slip_sweep", fit.cornering_stiffness, fit, details)
    summary = replace(summary, rate=fit.rate, speed=fit.speed, half_gap=fit.half_gap, half_gap_sd=fit.half_gap_sd)
    points = {
        "slip_rad": blocks.slip[used], "force_N": blocks.force[used], "residual_N": -fit.residuals,
        "rate_rad_s": blocks.rate[used], "time_s": blocks.time[used],
    }  # fmt: skip
    return summary, _thinned(points)


def _pull(test: PullTest, name: str, settings: FitSettings) -> tuple[RecordingSummary, Points]:
    fit = fit_pull_test(test, calibration=settings.calibration)
    details = {
        "friction_N": fit.friction, "largest_force_N": float(np.max(np.abs(fit.force))),
        "presliding_m": fit.presliding, "linear_range_m": fit.linear_range, "departure": fit.departure,
        "gauge_resolution_m": fit.resolution, "rim_share": fit.rim_share, "readings": float(fit.readings),
        "residual_sd_N": fit.residual_sd,
    }  # fmt: skip
    points = {"deflection_m": fit.deflection, "force_N": fit.force, "fitted_N": fit.fitted}
    return _summary(test, name, "pull_test", fit.lateral_stiffness, fit, details), _thinned(points)


def _step(run: RigRun, name: str) -> tuple[RecordingSummary, Points]:
    fit = fit_slip_step(run)
    details = {
        "force_change_N": fit.force_change, "residual_sd_N": fit.residual_sd, "dof": fit.fit_dof,
        "slip_before_rad": fit.slip[0], "slip_after_rad": fit.slip[1], "curve_sd_m": fit.curve_sd,
        "deficit": fit.deficit, "length_by_deficit": fit.length_by_deficit,
    }  # fmt: skip
    if fit.distance_to_63 is not None:
        details["distance_to_63_m"] = fit.distance_to_63
    return _summary(run, name, "slip_step", fit.relaxation_length, fit, details), {}


def _thinned(points: dict[str, Any]) -> Points:
    """Keep up to about 240 points, for figures."""
    return {name: values[:: max(1, len(values) // 240)].tolist() for name, values in points.items()}
