"""From a slip sweep to the cornering stiffness: Magic Formula fit with lag, offsets and drift taken out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tyre.base.errors import InputError
from tyre.fits.estimate import Calibration, Estimate, combine_uncertainties
from tyre.fits.sweep_branches import Blocks, block_means
from tyre.fits.sweep_curve import lagged_magic_formula, magic_formula
from tyre.fits.sweep_model import (
    HIGH,
    LOW,
    NAMES,
    expand,
    free_parameters,
    parameter_covariance,
    solve_least_squares,
    start_values,
    sweep_model,
)
from tyre.fits.sweep_moment import AligningMoment, fit_aligning_moment
from tyre.recordings.recording import Channel, Condition, RigRun


@dataclass(frozen=True)
class SlipSweepFit:
    """Result of one slip sweep (SI units, adapted SAE).

    Attributes
    ----------
    cornering_stiffness : Estimate
        C_Fy, N/rad; its interval holds the fit's own uncertainty, the stated repeatability of a single recording and
        the calibration of force and slip angle.
    fit_sd : float
        Standard deviation of C_Fy from the residuals of this recording alone (correlation accounted for), N/rad.
    parameters : dict
        ``peak`` N, ``shape``, ``curvature``, ``shift`` (Sh, rad), ``offset`` (Sv, N), ``drift`` (N over the
        recording), ``lag`` (s), ``hysteresis`` (rad).
    parameters_sd : dict
        Standard deviations of the same; nan where a parameter rests on a bound.
    not_identified : tuple of str
        Coefficients these data do not determine one by one (only their product, the slope, is).
    half_gap, half_gap_sd : float
        Half the slip distance between up and down branch, rad, at ``rate``.
    rate : float
        Mean absolute d(slip)/dt, rad/s.
    apparent_relaxation_length : float or None
        Lag times speed, m: the whole gap read as lag. One rate alone cannot tell lag from friction of the rig.
    apparent_relaxation_length_sd : float or None
    r_squared : float
        1 - SS_res/SS_tot over the samples (Dell'Orto et al., eq. 6).
    load : float
        Mean measured vertical load, N.
    """

    condition: Condition
    source: Path | None
    synthetic: bool
    cornering_stiffness: Estimate
    fit_sd: float
    parameters: dict[str, float]
    parameters_sd: dict[str, float]
    not_identified: tuple[str, ...]
    half_gap: float
    half_gap_sd: float
    rate: float
    speed: float | None
    apparent_relaxation_length: float | None
    apparent_relaxation_length_sd: float | None
    r_squared: float
    residual_sd: float
    load: float
    branches: int
    samples: int
    slip_range: tuple[float, float]
    temperature: float | None
    aligning_moment: AligningMoment | None
    notes: tuple[str, ...]
    blocks: Blocks
    residuals: Channel

    def steady_force(self, slip: Channel) -> Channel:
        """Fitted steady side force, N, at ``slip`` (rad), offsets included."""
        p = self.parameters
        force, _ = magic_formula(
            slip=np.asarray(slip) + p["shift"],
            cornering_stiffness=self.cornering_stiffness.value,
            peak=p["peak"],
            shape=p["shape"],
            curvature=p["curvature"],
        )
        return force + p["offset"]


def fit_slip_sweep(
    run: RigRun,
    *,
    calibration: Calibration | None = None,
    lag_correction: bool = True,
    relaxation_length: float | None = None,
) -> SlipSweepFit:
    """Fit the steady side-force curve of one slip sweep.

    The model is Fy(t) = Sv + drift t + MF(slip history + Sh), MF in terms of its slope at zero (C_Fy), seen through
    the first-order lag of Dell'Orto et al., eq. (1). Samples within half a metre after a reversal are left out (the
    lag is not steady there). A robust loss (soft L1 at three standard deviations) holds spikes down; the covariance
    allows for correlated residuals.

    Parameters
    ----------
    run : RigRun
        A sweep of at least one branch over +-1 deg or more.
    calibration : Calibration, optional
        Certificates of the rig.
    lag_correction : bool
        False fits without any lag: for showing what the correction removes.
    relaxation_length : float, optional
        Known relaxation length, m: then the lag is not fitted.

    Returns
    -------
    SlipSweepFit

    Raises
    ------
    InputError
        For a recording that is no sweep, whose side force falls with slip, or whose fit does not converge.
    """
    where = str(run.source or run.condition.tyre)
    calibration = calibration or Calibration()
    blocks = block_means(run)
    notes = list(run.notes)
    free = free_parameters(blocks, lag_correction, relaxation_length, notes, where)
    load = float(np.nanmean(run.vertical_load))
    used = blocks.settled
    if used.sum() < 2 * free.sum():
        raise InputError(
            f"{where}: only {used.sum()} tenths of a degree of slip are left after the lag has settled; "
            "sweep more slowly, further or more often"
        )
    stiffness, force_scale, start = start_values(blocks, free, relaxation_length, where)
    model = sweep_model(blocks, stiffness, force_scale)

    def residual(free_values: Channel) -> Channel:
        return model(expand(start, free, free_values))[0] / sigma

    def jacobian(free_values: Channel) -> NDArray[np.float64]:
        return model(expand(start, free, free_values))[1][:, free] / sigma

    sigma = 1.0
    limits = (LOW[free], HIGH[free])
    first = solve_least_squares(residual, start[free], jacobian=jacobian, bounds=limits, tolerance=1e-7)
    sigma = max(1.4826 * float(np.median(np.abs(first.fun))), 1e-9 * force_scale)
    found = solve_least_squares(residual, first.x, jacobian=jacobian, bounds=limits, loss="soft_l1", margin=3.0)
    if found.status == 0:
        notes.append("the fit stopped after 400 evaluations; its curve coefficients are not settled")
    values = expand(start, free, found.x)
    unit = np.array([stiffness, force_scale, 1.0, 1.0, 1.0, 1.0, 1.0, force_scale, force_scale])
    covariance, resting, noise_dof = parameter_covariance(found, free, limits)
    covariance *= np.outer(unit, unit)
    physical = dict(zip(NAMES, (float(v) for v in values * unit), strict=True))
    sd = dict(zip(NAMES, (float(v) for v in np.sqrt(np.diag(covariance))), strict=True))
    for index in np.flatnonzero(free)[resting]:
        sd[NAMES[index]] = float("nan")
    c, fit_sd = physical.pop("cornering_stiffness"), sd.pop("cornering_stiffness")
    if c <= 1.01 * LOW[0] * stiffness or c >= 0.99 * HIGH[0] * stiffness:
        raise InputError(f"{where}: the fitted cornering stiffness {c:.4g} N/rad is far from the slope near zero slip")
    doubtful = tuple(
        name
        for name in ("peak", "shape", "curvature")
        if not sd[name] < 0.05 * max(abs(physical[name]), 0.2 if name == "curvature" else 0.0)
    )
    rate = float(np.mean(np.abs(blocks.rate[used])))
    gap_row = np.zeros(9)
    gap_row[5], gap_row[6] = rate, 1.0
    widened = np.sqrt(noise_dof / (noise_dof - 2.0))  # standard deviation of Student's t: the noise is itself estimated
    r_squared, residual_sd, used_samples = _goodness(run, blocks, physical, c)
    _condition_notes(run, blocks, load, r_squared, notes)
    total, dof = combine_uncertainties(
        [
            (fit_sd, noise_dof),
            (calibration.repeatability * c, np.inf),
            (np.hypot(calibration.force, calibration.slip) * c, np.inf),
        ]
    )
    speed = blocks.speed
    fitted = bool(free[5])
    return SlipSweepFit(
        condition=run.condition,
        source=run.source,
        synthetic=run.synthetic,
        cornering_stiffness=Estimate(c, total, dof),
        fit_sd=fit_sd,
        parameters=physical,
        parameters_sd=sd,
        not_identified=doubtful,
        half_gap=physical["lag"] * rate + physical["hysteresis"],
        half_gap_sd=float(widened * np.sqrt(gap_row @ covariance @ gap_row)),
        rate=rate,
        speed=speed,
        apparent_relaxation_length=physical["lag"] * speed if fitted and speed is not None else None,
        apparent_relaxation_length_sd=sd["lag"] * speed if fitted and speed is not None else None,
        r_squared=r_squared,
        residual_sd=residual_sd,
        load=load,
        branches=int(np.unique(blocks.branch[used]).size),
        samples=used_samples,
        slip_range=(float(blocks.slip.min()), float(blocks.slip.max())),
        temperature=None if run.temperature is None else float(np.nanmean(run.temperature)),
        aligning_moment=fit_aligning_moment(blocks, c, physical, speed),
        notes=tuple(notes),
        blocks=blocks,
        residuals=model(values)[0],
    )


def _goodness(run: RigRun, blocks: Blocks, physical: dict[str, float], c: float) -> tuple[float, float, int]:
    """R^2 and standard deviation of the residuals of the samples (not of the block means)."""
    finite = np.isfinite(run.side_force)
    time = run.time
    near = np.clip(np.searchsorted(blocks.time, time), 0, blocks.time.size - 1)
    use = finite & blocks.settled[near]
    force, _ = lagged_magic_formula(
        time=time[use],
        slip_time=blocks.time,
        slip=blocks.slip,
        direction=np.sign(blocks.rate[near[use]]),
        cornering_stiffness=c,
        **{key: physical[key] for key in ("peak", "shape", "curvature", "shift", "lag", "hysteresis")},
    )
    middle = 0.5 * (blocks.time[0] + blocks.time[-1])
    drift = physical["drift"] * (time[use] - middle) / (blocks.time[-1] - blocks.time[0])
    measured = run.side_force[use]
    residual = measured - force - physical["offset"] - drift
    total = float(np.sum((measured - measured.mean()) ** 2))
    return 1.0 - float(residual @ residual) / total, float(np.std(residual)), int(use.sum())


def _condition_notes(run: RigRun, blocks: Blocks, load: float, r_squared: float, notes: list[str]) -> None:
    if abs(load / run.condition.load - 1.0) > 0.02:
        notes.append(f"mean measured load {load:.1f} N is {100 * (load / run.condition.load - 1):+.1f} % off nominal")
    if blocks.missing:
        notes.append(f"{blocks.missing} samples without side force left out")
    if r_squared < 0.98:
        notes.append(f"R^2 = {r_squared:.4f} is low for a slip sweep")
    reach = np.rad2deg(min(-blocks.slip.min(), blocks.slip.max()))
    if reach < 2.0:
        notes.append(f"slip reaches {reach:.1f} deg on one side only; the curve's centre is poorly known")
    if run.inclination is not None:
        camber = float(np.nanmean(run.inclination))
        if abs(camber) > np.deg2rad(0.5):
            notes.append(f"camber {np.rad2deg(camber):.2f} deg: the offset Sv contains camber thrust")
