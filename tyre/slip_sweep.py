"""Cornering stiffness and pneumatic trail from a slip sweep."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tyre.errors import InputError
from tyre.properties import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties
from tyre.recording import Channel, Condition, RigRun
from tyre.sensor_faults import without_faults
from tyre.sweep_curve import (
    BOUNDS,
    CURVE,
    LAG_NODES,
    LAG_WEIGHTS,
    NAMES,
    Blocks,
    block_means,
    lagged_magic_formula,
    magic_formula,
    solve_sweep,
    sweep_model,
)


@dataclass(frozen=True)
class AligningMoment:
    """Aligning moment about zero slip (adapted SAE, Mz = -t Fy)."""

    pneumatic_trail: float  # t, m
    pneumatic_trail_sd: float  # of the fit; the calibration of the moment cell is not in it
    slope: float  # dMz/d(slip) = -t C_Fy, N m/rad
    offset: float  # N m
    r_squared: float  # of the block means
    at_zero: tuple[float, float]  # moment at zero recorded slip and its standard deviation, N m


def fit_aligning_moment(
    blocks: Blocks, cornering_stiffness: float, parameters: dict[str, float]
) -> AligningMoment | None:
    """Fit Mz = offset - t F with a trail t = t0 / (1 + (slip / width)^2) that shrinks with slip.

    The side force F is the fitted one without its offset; the slip in t lags like the force does. The form is the first
    terms of the Magic Formula's cosine trail (Pacejka, Tire and Vehicle Dynamics, 3rd ed., eq. 4.E42).
    """
    if blocks.moment is None:
        return None
    used = blocks.settled & np.isfinite(blocks.moment)
    moment = blocks.moment[used]
    force = _curve(blocks, blocks.time[used], blocks.rate[used], cornering_stiffness, parameters)
    past = blocks.time[used][:, None] - parameters["lag"] * LAG_NODES
    slip = np.interp(past, blocks.time, blocks.slip) @ LAG_WEIGHTS + parameters["horizontal_shift"]

    def design(width: float) -> NDArray[np.float64]:
        return np.column_stack([-force / (1.0 + (slip / width) ** 2), np.ones_like(force)])

    def residual(z: Channel) -> Channel:
        return design(np.exp(z[2])) @ z[:2] - moment

    start = np.array([*np.linalg.lstsq(design(0.1), moment, rcond=None)[0], np.log(0.1)])
    found: Any = least_squares(
        residual, start, bounds=([-1.0, -np.inf, np.log(0.01)], [1.0, np.inf, np.log(10.0)]), x_scale="jac"
    )
    left = residual(found.x)
    total = float(np.sum((moment - moment.mean()) ** 2))
    covariance = np.linalg.pinv(found.jac.T @ found.jac)
    # blocks of one branch share slow errors: count the lag-one correlation as fewer independent blocks
    rho = float(np.clip(left[1:] @ left[:-1] / max(float(left @ left), 1e-300), 0.0, 0.95))
    variance = float(left @ left) / max(left.size - 3, 1) * (1.0 + rho) / (1.0 - rho)
    trail, sd = float(found.x[0]), float(np.sqrt(covariance[0, 0] * variance))
    shift = parameters["horizontal_shift"]
    there = _steady(np.zeros(1), cornering_stiffness, parameters)[0][0]
    row = np.array([-there / (1.0 + (shift / np.exp(found.x[2])) ** 2), 1.0])
    return AligningMoment(
        pneumatic_trail=trail,
        pneumatic_trail_sd=sd,
        slope=-trail * cornering_stiffness,
        offset=float(found.x[1]),
        r_squared=1.0 - float(left @ left) / total if total > 0.0 else 0.0,
        at_zero=(float(row @ found.x[:2]), float(np.sqrt(row @ covariance[:2, :2] @ row * variance))),
    )


def _steady(slip: Channel, stiffness: float, parameters: dict[str, float]) -> tuple[Channel, NDArray[np.float64]]:
    """Steady side force over recorded slip without its offset, and its derivatives."""
    shape = {name: parameters[name] for name in ("peak", "shape", "curvature")}
    return magic_formula(slip=slip + parameters["horizontal_shift"], cornering_stiffness=stiffness, **shape)


def _curve(blocks: Blocks, time: Channel, rate: Channel, stiffness: float, parameters: dict[str, float]) -> Channel:
    """Side force without offset and drift."""
    return lagged_magic_formula(
        time=time, slip_time=blocks.time, slip=blocks.slip, direction=np.sign(rate), cornering_stiffness=stiffness,
        **{name: parameters[name] for name in CURVE},
    )[0]  # fmt: skip


@dataclass(frozen=True)
class SlipSweepFit:
    """Result of one slip sweep (SI units, adapted SAE)."""

    condition: Condition
    source: Path | None
    synthetic: bool
    cornering_stiffness: Estimate  # C_Fy, N/rad, with fit, stated repeatability and calibration in its interval
    fit_sd: float  # of C_Fy from the (correlated) residuals of this recording alone, N/rad
    # ``peak`` N, ``shape``, ``curvature``, ``horizontal_shift`` (Sh, rad), ``vertical_shift`` (Sv, N), ``drift`` (N
    # over the recording), ``lag`` (s), ``hysteresis`` (rad)
    parameters: dict[str, float]
    parameters_sd: dict[str, float]  # nan if a parameter rests on a bound
    not_identified: tuple[str, ...]  # coefficients these data do not determine one by one, only their product
    half_gap: float  # half the slip distance between up and down branch, rad, at ``rate``
    half_gap_sd: float
    rate: float  # mean absolute d(slip)/dt, rad/s
    speed: float | None
    apparent_relaxation_length: float | None  # lag times speed, m: the whole gap read as lag
    r_squared: float  # 1 - SS_res/SS_tot over the samples (Dell'Orto et al., eq. 6)
    residual_sd: float
    load: float  # mean measured vertical load, N
    branches: int
    samples: int
    slip_range: tuple[float, float]
    force_at_zero: tuple[float, float]  # steady side force at zero recorded slip and its standard deviation, N
    temperature: float | None
    aligning_moment: AligningMoment | None
    notes: tuple[str, ...]
    sensor_faults: tuple[str, ...]  # also among the ``notes``
    blocks: Blocks
    residuals: Channel

    def steady_force(self, slip: Channel) -> Channel:
        """Fitted steady side force, offsets included."""
        force, _ = _steady(np.asarray(slip), self.cornering_stiffness.value, self.parameters)
        return force + self.parameters["vertical_shift"]


def fit_slip_sweep(
    run: RigRun, *, calibration: Calibration | None = None, lag_correction: bool = True,
    relaxation_length: float | None = None,
) -> SlipSweepFit:  # fmt: skip
    """Fit the steady side-force curve of one slip sweep.

    The model is Fy(t) = Sv + drift t + MF(slip history + Sh), MF in terms of its slope at zero (C_Fy), seen through
    the first-order lag of Dell'Orto et al., eq. (1). MF is that of the mean load, and follows the measured load in
    proportion. Samples within half a metre after a reversal are left out (the lag is not steady there). A robust loss
    (soft L1 at three standard deviations) holds spikes down; the covariance allows for correlated residuals. Samples in
    which the force cell or the slip sensor flattens are not used (:mod:`tyre.sensor_faults`).

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
    zero, by_shift = _steady(np.zeros(1), c, parameters)
    zero_sd = solution.sd_of_sum(
        horizontal_shift=by_shift[0, 0], cornering_stiffness=by_shift[1, 0], vertical_shift=1.0
    )
    lag_fitted = model.free[NAMES.index("lag")] and blocks.speed is not None
    least = {"peak": 0.0, "shape": 0.0, "curvature": 0.2}  # a coefficient known to 5 % of itself or of this is told
    loose = tuple(name for name, size in least.items() if not sd[name] < 0.05 * max(abs(parameters[name]), size))
    return SlipSweepFit(
        condition=run.condition, source=run.source, synthetic=run.synthetic,
        cornering_stiffness=Estimate(c, total, dof), fit_sd=fit_sd, parameters=parameters, parameters_sd=sd,
        not_identified=loose, half_gap=parameters["lag"] * rate + parameters["hysteresis"],
        half_gap_sd=float(widened * solution.sd_of_sum(lag=rate, hysteresis=1.0)), rate=rate, speed=blocks.speed,
        apparent_relaxation_length=parameters["lag"] * (blocks.speed or np.nan) if lag_fitted else None,
        r_squared=r_squared, residual_sd=residual_sd, load=load,
        branches=int(np.unique(blocks.branch[blocks.settled]).size), samples=samples,
        slip_range=(float(blocks.slip.min()), float(blocks.slip.max())),
        force_at_zero=(float(zero[0]) + parameters["vertical_shift"], zero_sd),
        temperature=None if run.temperature is None else float(np.nanmean(run.temperature)),
        aligning_moment=fit_aligning_moment(blocks, c, parameters), notes=tuple(notes), sensor_faults=tuple(faults),
        blocks=blocks, residuals=solution.residuals,
    )  # fmt: skip


def _goodness(run: RigRun, blocks: Blocks, parameters: dict[str, float], c: float) -> tuple[float, float, int]:
    """R^2 and standard deviation of the residuals of the samples (not of the block means)."""
    time, near = run.time, np.clip(np.searchsorted(blocks.time, run.time), 0, blocks.time.size - 1)
    use = np.isfinite(run.side_force) & blocks.settled[near]
    force = _curve(blocks, time[use], blocks.rate[near[use]], c, parameters)
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
