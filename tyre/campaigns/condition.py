"""Recordings of one tyre at one load, pressure and surface combined into C_Fy, K_y and relaxation length."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.consistency import repeat_warnings
from tyre.campaigns.repeatability import Repeatability
from tyre.campaigns.summary import RecordingSummary
from tyre.estimate import Calibration, Estimate, combine_uncertainties
from tyre.fits.relaxation import (
    Agreement,
    agreement,
    mean_of_steps,
    relaxation_from_stiffness,
    relaxation_from_two_rates,
)
from tyre.fits.slip_step import SlipStepFit
from tyre.recordings.recording import SYNTHETIC_NOTES

Key = tuple[str, str, float, float]


@dataclass(frozen=True)
class ConditionResult:
    """One tyre at one load (N), pressure (Pa) and surface; None where it was not measured.

    ``covariance`` is of (C_Fy, K_y, relaxation length), SI units; ``pneumatic_trail`` in m. ``borrowed_stiffness``
    says that K_y comes from the flat track. ``scatter`` holds the relative standard deviations of its own
    repeats.
    """

    tyre: str
    surface: str
    load: float
    pressure: float
    drum_radius: float | None
    cornering_stiffness: Estimate | None
    lateral_stiffness: Estimate | None
    relaxation_length: Estimate | None
    covariance: NDArray[np.float64] | None
    r_squared: float | None
    pneumatic_trail: Estimate | None
    routes: Agreement | None
    direct: dict[str, Estimate]
    borrowed_stiffness: bool
    scatter: dict[str, float]
    synthetic: bool
    sweeps: tuple[RecordingSummary, ...]
    pulls: tuple[RecordingSummary, ...]
    steps: tuple[RecordingSummary, ...]
    warnings: tuple[str, ...]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the recordings behind it, sorted."""
        return tuple(sorted(item.file for item in (*self.sweeps, *self.pulls, *self.steps)))

    @property
    def label(self) -> str:
        """``tyre, surface, load, pressure`` in the units of the field."""
        return f"{self.tyre}, {self.surface}, {self.load:g} N, {self.pressure / PASCAL_PER_BAR:g} bar"


def condition_key(summary: RecordingSummary) -> Key:
    """Tyre, surface, load rounded to 0.1 N and pressure to 0.001 bar: what makes recordings repeats of each other.

    Parameters
    ----------
    summary : RecordingSummary
    """
    condition = summary.condition
    return condition.tyre, condition.surface, round(condition.load, 1), round(condition.pressure / 100.0) * 100.0


def combine(
    key: Key,
    recordings: Sequence[RecordingSummary],
    *,
    borrowed: Sequence[RecordingSummary],
    sweep_repeatability: Repeatability,
    pull_repeatability: Repeatability,
    calibration: Calibration,
    further_warnings: Sequence[str] = (),
) -> ConditionResult:
    """Combine the recordings of one condition.

    C_Fy and K_y are means over their recordings. Their variance is the pooled repeatability over the number of repeats
    (the condition's own scatter where it is significantly larger, p < 0.01) plus the calibration, which repeats do
    not average out.

    Parameters
    ----------
    key : tuple
        Tyre, surface, load (N), pressure (Pa).
    recordings : sequence of RecordingSummary
        All recordings at this condition.
    borrowed : sequence of RecordingSummary
        Flat-track pull tests of the same tyre, load and pressure, used where a drum condition has none.
    sweep_repeatability, pull_repeatability : Repeatability
    calibration : Calibration
    further_warnings : sequence of str
        What the campaign as a whole says of this condition.

    Returns
    -------
    ConditionResult
    """
    tyre, surface, load, pressure = key
    by_kind = {
        kind: tuple(sorted((item for item in recordings if item.kind == kind), key=lambda item: item.file))
        for kind in ("slip_sweep", "pull_test", "slip_step")
    }
    sweeps, pulls, steps = by_kind["slip_sweep"], by_kind["pull_test"], by_kind["slip_step"]
    warnings = [*further_warnings, *repeat_warnings(recordings)]
    for item in (*sweeps, *pulls, *steps):
        warnings += [f"{item.file}: {note}" for note in item.notes if note not in SYNTHETIC_NOTES]
    is_borrowed = not pulls and bool(borrowed)
    if is_borrowed:
        pulls = tuple(sorted(borrowed, key=lambda item: item.file))
        warnings.append("lateral stiffness is that of the flat track (no pull test on the drum)")
    c = _mean(sweeps, sweep_repeatability, "cornering stiffness", warnings)
    k = _mean(pulls, pull_repeatability, "lateral stiffness", warnings)
    if c is None:
        warnings.append("no slip sweep: cornering stiffness unknown")
    if k is None:
        warnings.append("no pull test: lateral stiffness and C/K unknown")
    length, covariance, full_c, full_k = None, None, None, None
    if c is not None:
        full_c = _with_calibration(c, float(np.hypot(calibration.force, calibration.slip)))
    if k is not None:
        full_k = _with_calibration(k, float(np.hypot(calibration.force, calibration.displacement)))
    if c is not None and k is not None:
        length, covariance = relaxation_from_stiffness(
            cornering_stiffness=(c.value, c.sd, c.dof),
            lateral_stiffness=(k.value, k.sd, k.dof),
            calibration=calibration,
        )
    direct = _direct_routes(sweeps, steps, calibration)
    routes = agreement(({"C/K": length} if length is not None else {}) | direct)
    if routes is not None and routes.p_value < 0.05:
        warnings.append(f"routes to the relaxation length disagree: {routes.sentence}")
    everything = (*sweeps, *pulls, *steps)
    return ConditionResult(
        tyre=tyre,
        surface=surface,
        load=load,
        pressure=pressure,
        drum_radius=next((item.condition.drum_radius for item in recordings), None),
        cornering_stiffness=full_c,
        lateral_stiffness=full_k,
        relaxation_length=length,
        covariance=covariance,
        r_squared=float(np.mean([item.r_squared for item in sweeps])) if sweeps else None,
        pneumatic_trail=_trail(sweeps),
        routes=routes,
        direct=direct,
        borrowed_stiffness=is_borrowed,
        scatter={
            name: float(np.std([item.value for item in items], ddof=1) / np.mean([item.value for item in items]))
            for name, items in (("slip_sweep", sweeps), ("pull_test", pulls), ("slip_step", steps))
            if len(items) > 1
        },
        synthetic=any(item.synthetic for item in everything),
        sweeps=sweeps,
        pulls=pulls,
        steps=steps,
        warnings=tuple(warnings),
    )


def _mean(
    items: Sequence[RecordingSummary], repeatability: Repeatability, name: str, warnings: list[str]
) -> Estimate | None:
    """Mean over repeats with its scatter alone, no calibration."""
    if not items:
        return None
    values = np.array([item.value for item in items])
    mean, count = float(values.mean()), values.size
    sd, dof = repeatability.sd, repeatability.dof
    own = float(np.sqrt(np.mean([(item.fit_sd / item.value) ** 2 for item in items])))
    if not repeatability.measured:
        warnings.append(f"{name}: no repeats in this campaign; {100 * sd:.1f} % per recording is assumed, not measured")
        sd, dof = combine_uncertainties([(sd, dof), (own, np.inf)])
        return Estimate(mean, mean * sd / np.sqrt(count), dof)
    if repeatability.refuted:
        warnings.append(
            f"{name}: the campaign's repeats scatter by {100 * repeatability.scatter:.2f} %, more than the stated "
            "repeatability allows; their scatter alone is used"
        )
    sd = max(sd, own)  # of a recording noisier than the campaign's others
    if count > 2:
        scatter = float(np.std(values, ddof=1)) / mean
        if stats.f.sf((scatter / sd) ** 2, count - 1, dof) < 0.01:
            warnings.append(
                f"{name}: repeats scatter by {100 * scatter:.2f} %, more than the campaign's {100 * sd:.2f} %; "
                "their own scatter is used"
            )
            sd, dof = scatter, float(count - 1)
    return Estimate(mean, mean * sd / np.sqrt(count), dof)


def _with_calibration(estimate: Estimate, relative: float) -> Estimate:
    sd, dof = combine_uncertainties([(estimate.sd, estimate.dof), (relative * estimate.value, np.inf)])
    return replace(estimate, sd=sd, dof=dof)


def _trail(sweeps: Sequence[RecordingSummary]) -> Estimate | None:
    values = [item.details["pneumatic_trail_m"] for item in sweeps if "pneumatic_trail_m" in item.details]
    if not values:
        return None
    own = [item.details["pneumatic_trail_sd_m"] for item in sweeps if "pneumatic_trail_sd_m" in item.details]
    mean, count = float(np.mean(values)), len(values)
    if count == 1:
        return Estimate(mean, own[0])
    return Estimate(mean, float(np.std(values, ddof=1)) / np.sqrt(count), float(count - 1))


def _direct_routes(
    sweeps: Sequence[RecordingSummary], steps: Sequence[RecordingSummary], calibration: Calibration
) -> dict[str, Estimate]:
    routes = {}
    rates = relaxation_from_two_rates([item for item in sweeps if item.half_gap_sd > 0.0])
    if rates is not None:
        routes["two sweep rates"] = rates
    fits = [
        SlipStepFit(
            condition=item.condition,
            source=None,
            relaxation_length=Estimate(item.value, item.fit_sd, item.details["dof"]),
            distance_to_63=item.details.get("distance_to_63_m"),
            force_change=item.details["force_change_N"],
            r_squared=item.r_squared,
            residual_sd=item.details["residual_sd_N"],
            notes=item.notes,
        )
        for item in steps
    ]
    mean = mean_of_steps(fits, repeatability=calibration.repeatability)
    if mean is not None:
        routes["slip step"] = mean
    return routes
