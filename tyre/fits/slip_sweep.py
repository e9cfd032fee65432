"""From a slip sweep to the cornering stiffness: Magic Formula fit with lag, offsets and drift taken out."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tyre.base.errors import InputError
from tyre.estimate import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties
from tyre.fits.sensor_faults import without_faults
from tyre.fits.sweep_branches import Blocks, block_means
from tyre.fits.sweep_curve import CURVE, lagged_magic_formula, magic_formula
from tyre.fits.sweep_model import BOUNDS, NAMES, sweep_model
from tyre.fits.sweep_moment import AligningMoment, fit_aligning_moment
from tyre.fits.sweep_solution import solve_sweep
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
        ``peak`` N, ``shape``, ``curvature``, ``horizontal_shift`` (Sh, rad), ``vertical_shift`` (Sv, N), ``drift`` (N
        over the recording), ``lag`` (s), ``hysteresis`` (rad).
    parameters_sd : dict
        Standard deviations of the same; nan where a parameter rests on a bound (a hysteresis on 0.02 rad either way).
    not_identified : tuple of str
        Coefficients these data do not determine one by one (only their product, the slope, is).
    half_gap, half_gap_sd : float
        Half the slip distance between up and down branch, rad, at ``rate``.
    rate : float
        Mean absolute d(slip)/dt, rad/s.
    apparent_relaxation_length : float or None
        Lag times speed, m: the whole gap read as lag. One rate alone cannot tell lag from friction of the rig.
    r_squared : float
        1 - SS_res/SS_tot over the samples (Dell'Orto et al., eq. 6).
    load : float
        Mean measured vertical load, N.
    sensor_faults : tuple of str
        What is wrong with its sensors; also among the ``notes``.
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
    r_squared: float
    residual_sd: float
    load: float
    branches: int
    samples: int
    slip_range: tuple[float, float]
    temperature: float | None
    aligning_moment: AligningMoment | None
    notes: tuple[str, ...]
    sensor_faults: tuple[str, ...]
    blocks: Blocks
    residuals: Channel

    def steady_force(self, slip: Channel) -> Channel:
        """Fitted steady side force, offsets included.

        Parameters
        ----------
        slip : ndarray, shape (n,)
            rad.

        Returns
        -------
        ndarray, shape (n,)
            N.
        """
        p = self.parameters
        force, _ = magic_formula(
            slip=np.asarray(slip) + p["horizontal_shift"],
            cornering_stiffness=self.cornering_stiffness.value,
            peak=p["peak"],
            shape=p["shape"],
            curvature=p["curvature"],
        )
        return force + p["vertical_shift"]


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
    allows for correlated residuals. Samples in which the force cell or the slip sensor flattens are not used
    (:mod:`tyre.fits.sensor_faults`).

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
    model = sweep_model(
        blocks, lag_correction=lag_correction, relaxation_length=relaxation_length, notes=notes, where=where
    )
    solution = solve_sweep(model)
    faults: list[str] = []
    if lag_correction:  # a lag left in looks like a fault of the sensors
        model, solution, faults = without_faults(model, solution)
        blocks, notes = model.blocks, notes + faults
    if not solution.settled:
        notes.append("the fit stopped after 400 evaluations; its curve coefficients are not settled")
    parameters, sd = dict(solution.values), dict(solution.sd)
    c, fit_sd = parameters.pop("cornering_stiffness"), sd.pop("cornering_stiffness")
    low, high = BOUNDS["cornering_stiffness"]
    if c <= 1.01 * low * model.stiffness or c >= 0.99 * high * model.stiffness:
        raise InputError(f"{where}: the fitted cornering stiffness {c:.4g} N/rad is far from the slope near zero slip")
    load = float(np.nanmean(run.vertical_load))
    rate = float(np.mean(np.abs(blocks.rate[blocks.settled])))
    widened = np.sqrt(solution.dof / (solution.dof - 2.0))  # sd of Student's t: the noise is itself estimated
    r_squared, residual_sd, samples = _goodness(run, blocks, parameters, c)
    _condition_notes(run, blocks, load, r_squared, notes)
    total, dof = combine_uncertainties(
        [
            (fit_sd, solution.dof),
            (calibration.repeatability * c, REPEATABILITY_DOF),
            (np.hypot(calibration.force, calibration.slip) * c, np.inf),
        ]
    )
    lag_fitted = model.free[NAMES.index("lag")] and blocks.speed is not None
    return SlipSweepFit(
        condition=run.condition,
        source=run.source,
        synthetic=run.synthetic,
        cornering_stiffness=Estimate(c, total, dof),
        fit_sd=fit_sd,
        parameters=parameters,
        parameters_sd=sd,
        not_identified=_not_identified(parameters, sd),
        half_gap=parameters["lag"] * rate + parameters["hysteresis"],
        half_gap_sd=float(widened * solution.sd_of_sum(lag=rate, hysteresis=1.0)),
        rate=rate,
        speed=blocks.speed,
        apparent_relaxation_length=parameters["lag"] * (blocks.speed or np.nan) if lag_fitted else None,
        r_squared=r_squared,
        residual_sd=residual_sd,
        load=load,
        branches=int(np.unique(blocks.branch[blocks.settled]).size),
        samples=samples,
        slip_range=(float(blocks.slip.min()), float(blocks.slip.max())),
        temperature=None if run.temperature is None else float(np.nanmean(run.temperature)),
        aligning_moment=fit_aligning_moment(blocks, c, parameters),
        notes=tuple(notes),
        sensor_faults=tuple(faults),
        blocks=blocks,
        residuals=solution.residuals,
    )


def _not_identified(parameters: dict[str, float], sd: dict[str, float]) -> tuple[str, ...]:
    """Coefficients of the curve that are uncertain by more than 5 % (the curvature: of at least 0.2)."""
    least = {"peak": 0.0, "shape": 0.0, "curvature": 0.2}
    return tuple(name for name, size in least.items() if not sd[name] < 0.05 * max(abs(parameters[name]), size))


def _goodness(run: RigRun, blocks: Blocks, parameters: dict[str, float], c: float) -> tuple[float, float, int]:
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
        **{key: parameters[key] for key in CURVE},
    )
    middle = 0.5 * (blocks.time[0] + blocks.time[-1])
    drift = parameters["drift"] * (time[use] - middle) / (blocks.time[-1] - blocks.time[0])
    measured = run.side_force[use]
    residual = measured - force - parameters["vertical_shift"] - drift
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
