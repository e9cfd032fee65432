"""Cornering stiffness and pneumatic trail from a slip sweep, and sensors that flatten or have two gains."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import stdtr

from tyre.fits import sweep_curve
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.number_with_sd import with_sd
from tyre.measured.properties import Calibration, Estimate
from tyre.recordings.noise import correlated_covariance
from tyre.recordings.recording import Channel, RigRun


@dataclass(frozen=True)
class AligningMoment:
    """Aligning moment about zero slip (adapted SAE, Mz = -t Fy)."""

    pneumatic_trail: float  # t, m
    pneumatic_trail_sd: float  # m, of the fit; the calibration of the moment cell is not in it
    slope: float  # dMz/d(slip) = -t C_alpha, N m/rad
    offset: float  # N m, of the moment where the lateral force without its offset is zero
    r_squared: float  # of the block means
    at_zero: tuple[float, float]  # moment at zero recorded slip and its standard deviation, N m


def _round_trail(slip: Channel, width: float, _exponent: float) -> Channel:
    """Trail over its largest, round at zero slip: the first terms of the Magic Formula's cosine."""
    return np.asarray(1.0 / (1.0 + (slip / width) ** 2))


def _peaked_trail(slip: Channel, width: float, exponent: float) -> Channel:
    """Trail over its largest, which falls from zero slip on as the end of the contact slides, until all of it does."""
    return np.asarray(np.clip(1.0 - np.abs(slip) / width, 0.0, None) ** exponent)


# the trail falls like a cosine (Pacejka, Tire and Vehicle Dynamics, 3rd ed., eq. 4.E42) or in proportion to the slip,
# as under a pressure that vanishes at the ends of the contact (section 3.2.1 there): the pressure is not known
TRAIL_LAWS = (_round_trail, _peaked_trail)


@dataclass(frozen=True)
class _TrailFit:
    """A law of the trail fitted to the moment of the blocks."""

    trail: float  # m
    offset: float  # N m
    shape_at_zero: float  # trail at zero recorded slip over its largest
    covariance: NDArray[np.float64]  # (p, p), of trail, offset and the numbers of the shape, with correlated residuals
    residual: Channel  # (m,), N m


def _fit_trail(law: Any, slip: Channel, force: Channel, moment: Channel, shift: float) -> _TrailFit:
    """Fit Mz = offset - t F with a trail t of one ``law`` over the slip (m,), ``shift`` at zero recorded slip."""
    shapes = 1 if law is _round_trail else 2  # the width, and the exponent of a peak
    start, low, high = [np.log(0.1), np.log(2.0)], [np.log(0.01), np.log(0.5)], [np.log(10.0), np.log(6.0)]

    def shape(z: Channel, at: Channel) -> Channel:
        return np.asarray(law(at, float(np.exp(z[2])), float(np.exp(z[3])) if shapes == 2 else 1.0))

    def residual(z: Channel) -> Channel:
        return z[1] - z[0] * force * shape(z, slip) - moment

    begin = np.array([0.0, 0.0, *start[:shapes]])
    columns = np.column_stack([-force * shape(begin, slip), np.ones_like(force)])
    begin[:2] = np.linalg.lstsq(columns, moment, rcond=None)[0]
    limits = ([-1.0, -np.inf, *low[:shapes]], [1.0, np.inf, *high[:shapes]])
    solution: Any = scipy.optimize.least_squares(residual, np.clip(begin, *limits), bounds=limits, x_scale="jac")
    residuals = residual(solution.x)
    power = max(float(residuals @ residuals), 1e-300)
    # blocks of one branch share slow errors: count the lag-one correlation as fewer independent blocks
    rho = float(np.clip(residuals[1:] @ residuals[:-1] / power, 0.0, 0.95))
    variance = power / max(residuals.size - shapes - 2, 1) * (1.0 + rho) / (1.0 - rho)
    return _TrailFit(
        trail=float(solution.x[0]),
        offset=float(solution.x[1]),
        shape_at_zero=float(shape(solution.x, np.array([shift]))[0]),
        covariance=np.linalg.pinv(solution.jac.T @ solution.jac) * variance,
        residual=residuals,
    )


def fit_aligning_moment(
    blocks: sweep_curve.Blocks, at_zero: "ForceAtZero", parameters: dict[str, float]
) -> AligningMoment | None:
    """Fit Mz = offset - t F with a trail t that shrinks with slip, round or peaked at zero slip.

    The lateral force F is the measured one without its offset; the slip in t lags like the force does. Near zero slip
    the moment vanishes with the force, so the trail there rests on the law by which it falls. Each of
    :data:`TRAIL_LAWS` counts by its likelihood, and what they differ by is in the standard deviation. So is that of the
    slope of the force there, by which the moment is divided.
    """
    if blocks.moment is None:
        return None
    used = blocks.settled & np.isfinite(blocks.moment)
    moment = blocks.moment[used]
    # the measured force, as the law that was fitted to it may be none of this tyre
    clock = (blocks.time[used] - 0.5 * (blocks.time[0] + blocks.time[-1])) / (blocks.time[-1] - blocks.time[0])
    force = blocks.force[used] - parameters["vertical_shift"] - parameters["drift"] * clock
    past = blocks.time[used][:, None] - parameters["lag"] * sweep_curve.LAG_NODES
    shift = parameters["horizontal_shift"]
    slip = np.interp(past, blocks.time, blocks.slip) @ sweep_curve.LAG_WEIGHTS + shift
    fits = [_fit_trail(law, slip, force, moment, shift) for law in TRAIL_LAWS]
    weights = sweep_curve.law_weights([fit.residual for fit in fits], [fit.covariance.shape[0] for fit in fits])
    best = fits[int(np.argmax(weights))]
    trails = np.array([fit.trail for fit in fits])
    trail = float(weights @ trails)
    variance = float(weights @ [fit.covariance[0, 0] + (fit.trail - trail) ** 2 for fit in fits])
    force_there = at_zero.force - parameters["vertical_shift"]
    row = np.array([-force_there * best.shape_at_zero, 1.0])
    total = float(np.sum((moment - moment.mean()) ** 2))
    return AligningMoment(
        pneumatic_trail=trail,
        pneumatic_trail_sd=float(np.hypot(np.sqrt(variance), trail * at_zero.stiffness_sd / at_zero.stiffness)),
        slope=-trail * at_zero.stiffness,
        offset=best.offset,
        r_squared=1.0 - float(best.residual @ best.residual) / total if total > 0.0 else 0.0,
        at_zero=(float(row @ [best.trail, best.offset]), float(np.sqrt(row @ best.covariance[:2, :2] @ row))),
    )


@dataclass(frozen=True)
class ForceAtZero:
    """Lateral force at zero slip and its slope, over the laws of the lateral force that are possible."""

    stiffness: float  # C_alpha, N/rad
    stiffness_sd: float  # N/rad, of the fit and of what the laws differ by
    force: float  # N, at zero recorded slip, Sv included
    force_sd: float  # N, likewise
    brush_weight: float  # probability of the laws with a brush, 0 to 1


def weigh_lateral_force_laws(
    model: sweep_curve.SweepModel, solution: sweep_curve.SweepSolution, *, brushes: bool
) -> ForceAtZero:
    """Slope of the lateral force at zero slip, whether it is that of the Magic Formula, of a brush or between them.

    The slope of a brush falls in proportion to |slip|. A Magic Formula has no such kink, fits it almost as well, and is
    then 7 % less steep at zero slip. Each law counts by its likelihood, as those of the trail do. Without ``brushes``
    the Magic Formula is the only law.
    """
    laws = [solution]
    for pure in (True, False) if brushes else ():
        brush = sweep_curve.with_brush(model, pure=pure)
        if model.blocks.settled.sum() >= 2 * brush.free.sum():
            laws.append(sweep_curve.solve_sweep(brush))
    laws = [law for law in laws if law is solution or np.isfinite(law.sd["cornering_stiffness"])]
    # the brush alone is one of many shapes: that it has fewer numbers than the Magic Formula is no evidence for it
    numbers = [max(law.numbers, solution.numbers) for law in laws]
    weights = sweep_curve.law_weights([law.residuals for law in laws], numbers)
    slopes = np.array([law.values["cornering_stiffness"] for law in laws])
    slope = float(weights @ slopes)
    variances = np.array([law.sd["cornering_stiffness"] ** 2 for law in laws]) + (slopes - slope) ** 2
    forces, force_variances = np.array([_force_at_zero(law) for law in laws]).T
    force = float(weights @ forces)
    return ForceAtZero(
        stiffness=slope,
        stiffness_sd=float(np.sqrt(weights @ variances)),
        force=force,
        force_sd=float(np.sqrt(weights @ (force_variances + (forces - force) ** 2))),
        brush_weight=1.0 - float(weights[0]),
    )


def _force_at_zero(solution: sweep_curve.SweepSolution) -> tuple[float, float]:
    """Steady lateral force at zero recorded slip (N) and its variance (N^2), of one law."""
    values, share = solution.values, solution.values["brush_share"]
    zero, by = _steady_force(np.zeros(1), values["cornering_stiffness"], values)
    brush, by_brush = sweep_curve.brush_force(
        slip=np.array([values["horizontal_shift"]]),
        cornering_stiffness=values["cornering_stiffness"],
        peak=values["peak"],
    )
    mixed = by[:2, 0] + share * (by_brush[:2, 0] - by[:2, 0])
    sd = solution.sd_of_sum(horizontal_shift=mixed[0], cornering_stiffness=mixed[1], vertical_shift=1.0)
    return float(zero[0] + share * (brush[0] - zero[0])) + values["vertical_shift"], sd**2


def _steady_force(slip: Channel, stiffness: float, parameters: dict[str, float]) -> tuple[Channel, NDArray[np.float64]]:
    """Steady lateral force over recorded slip without its offset, and its derivatives."""
    shape = {name: parameters[name] for name in ("peak", "shape", "curvature")}
    return sweep_curve.magic_formula(slip=slip + parameters["horizontal_shift"], cornering_stiffness=stiffness, **shape)


def _curve(
    blocks: sweep_curve.Blocks, time: Channel, rate: Channel, stiffness: float, parameters: dict[str, float]
) -> Channel:
    """Fitted lateral force (n,), N, at times (n,), s, with its lag and hysteresis, without offset and drift."""
    return sweep_curve.lagged_magic_formula(
        time=time,
        history=blocks.history,
        direction=np.sign(rate),
        cornering_stiffness=stiffness,
        **{name: parameters[name] for name in sweep_curve.CURVE},
    )[0]


@dataclass(frozen=True)
class SlipSweepFit:
    """Result of one slip sweep (SI units, adapted SAE)."""

    cornering_stiffness: Estimate  # C_alpha, N/rad, with fit, stated repeatability and calibration in its interval
    fit_sd: float  # of C_alpha from the (correlated) residuals and the laws of this recording alone, N/rad
    curve_slope: float  # of the fitted Magic Formula at zero slip, N/rad: C_alpha unless a brush fits better
    curve_slope_sd: float  # of the residuals if the Magic Formula is the law, N/rad
    # ``peak`` N, ``shape``, ``curvature``, ``horizontal_shift`` (Sh, rad), ``vertical_shift`` (Sv, N), ``drift`` (N
    # over the recording), ``lag`` (s), ``hysteresis`` (rad)
    parameters: dict[str, float]
    parameters_sd: dict[str, float]  # nan if a parameter rests on a bound
    half_gap: float  # half the slip distance between up and down branch, rad, at ``rate``
    half_gap_sd: float  # rad, of the residuals of this recording alone
    rate: float  # mean absolute d(slip)/dt, rad/s
    speed: float | None  # m/s, mean rolling speed; None if neither recorded nor stated
    apparent_relaxation_length: float | None  # lag times speed, m: the whole gap read as lag
    r_squared: float  # 1 - SS_res/SS_tot over the samples (Dell'Orto et al., eq. 6)
    residual_sd: float  # N, of the samples about the fitted curve
    load: float  # mean measured vertical load, N
    branches: int  # how many stretches between reversals of the slip are fitted
    samples: int  # how many samples are fitted: settled ones with a lateral force
    force_at_zero: tuple[float, float]  # steady lateral force at zero recorded slip and its standard deviation, N
    temperature: float | None  # degrees Celsius, mean; None if not recorded
    aligning_moment: AligningMoment | None  # None where it was not recorded
    notes: tuple[str, ...]  # what a reader of the numbers must know
    sensor_faults: tuple[str, ...]  # also among the ``notes``
    blocks: sweep_curve.Blocks  # block means that were fitted
    residuals: Channel  # (m,), N, fitted minus measured lateral force of the settled blocks

    def __repr__(self) -> str:
        c = self.cornering_stiffness.scaled(float(np.deg2rad(1.0)))
        lines = [
            f"<SlipSweepFit at {self.load:.4g} N: {self.samples} samples, branches: {self.branches}, "
            f"R^2 {self.r_squared:.4f}, residual sd {self.residual_sd:.3g} N",
            f"cornering stiffness {with_sd(c.value, c.sd, places=1)} N/deg",
        ]
        if self.apparent_relaxation_length is not None and self.speed is not None:
            sd = 1e3 * self.parameters_sd["lag"] * self.speed
            length = with_sd(1e3 * self.apparent_relaxation_length, sd, places=1)
            lines.append(f"apparent relaxation length {length} mm at {self.speed:.3g} m/s")
        if self.aligning_moment is not None:
            trail, sd = 1e3 * self.aligning_moment.pneumatic_trail, 1e3 * self.aligning_moment.pneumatic_trail_sd
            lines.append(f"pneumatic trail {with_sd(trail, sd, places=1)} mm")
        return "\n ".join(lines) + f"; notes: {len(self.notes)}>"

    def steady_force(self, slip: Channel) -> Channel:
        """Fitted steady lateral force, offsets included."""
        force, _ = _steady_force(np.asarray(slip), self.curve_slope, self.parameters)
        return force + self.parameters["vertical_shift"]


def fit_slip_sweep(
    run: RigRun,
    *,
    calibration: Calibration | None = None,
    lag_correction: bool = True,
    relaxation_length: float | None = None,
) -> SlipSweepFit:
    """Fit the steady lateral force curve of one slip sweep.

    The model is Fy(t) = Sv + drift t + MF(slip history + Sh), MF in terms of its slope at zero (C_alpha), seen through
    the first-order lag of Dell'Orto et al., eq. (1). MF is that of the mean load, and follows the measured load in
    proportion. Samples within half a metre after a reversal are left out (the lag is not steady there). A robust loss
    (soft L1 at three standard deviations) holds spikes down; the covariance allows for correlated residuals. Samples in
    which the force cell or the slip sensor flattens are not used (:func:`find_fault`). The points
    of a steady table are used as they are, without lag.

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
        For a recording that is no sweep, whose lateral force falls with slip, or whose fit does not converge.
    """
    where = str(run.source or run.condition.tyre)
    calibration = calibration or Calibration()
    is_steady = run.kind == "steady"  # settled points have neither lag nor branches
    lag_correction = lag_correction and not is_steady
    blocks = sweep_curve.point_blocks(run) if is_steady else sweep_curve.block_means(run)
    notes = list(run.notes)
    model = sweep_curve.sweep_model(
        blocks, lag_correction=lag_correction, relaxation_length=relaxation_length, notes=notes, where=where
    )
    solution = sweep_curve.solve_sweep(model)
    faults: list[str] = []
    if lag_correction:  # a lag left in looks like a fault of the sensors
        model, solution, faults = without_faults(model, solution)
        blocks, notes = model.blocks, notes + faults
    if not solution.settled:
        notes.append("the fit stopped after 400 evaluations; its curve coefficients have not converged")
    parameters, sd = dict(solution.values), dict(solution.sd)
    slope = parameters.pop("cornering_stiffness")
    slope_sd = sd.pop("cornering_stiffness")
    del parameters["brush_share"], sd["brush_share"]  # of the Magic Formula alone
    low, high = sweep_curve.BOUNDS["cornering_stiffness"]
    if slope <= 1.01 * low * model.stiffness or slope >= 0.99 * high * model.stiffness:
        raise InputError(
            f"{where}: the fitted cornering stiffness {slope:.4g} N/rad is far from the slope near zero slip"
        )
    # a lag left in parts the branches so far that the misfit cannot tell the laws apart; a brush is then 9 % too steep
    at_zero = weigh_lateral_force_laws(model, solution, brushes=lag_correction or is_steady)
    c, fit_sd = at_zero.stiffness, at_zero.stiffness_sd
    if at_zero.brush_weight > 0.5:
        notes.append(
            f"the lateral force bends as a brush's does: C is {100 * (c / slope - 1.0):+.1f} % off the slope "
            "of the fitted Magic Formula at zero slip"
        )
    load = float(np.nanmean(run.vertical_load))
    rate = float(np.mean(np.abs(blocks.rate[blocks.settled])))
    widened = np.sqrt(solution.dof / (solution.dof - 2.0))  # sd of Student's t: the noise is itself estimated
    r_squared, residual_sd, samples = _goodness(run, blocks, parameters, slope)
    _condition_notes(run, blocks, load, r_squared, notes)
    lag_fitted = model.free[sweep_curve.NAMES.index("lag")] and blocks.speed is not None
    return SlipSweepFit(
        cornering_stiffness=calibration.estimate(c, fit_sd, solution.dof, calibration.slip),
        fit_sd=fit_sd,
        curve_slope=slope,
        curve_slope_sd=slope_sd * widened,
        parameters=parameters,
        parameters_sd=sd,
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
        force_at_zero=(at_zero.force, at_zero.force_sd),
        temperature=None if run.temperature is None else float(np.nanmean(run.temperature)),
        aligning_moment=fit_aligning_moment(blocks, at_zero, parameters),
        notes=tuple(notes),
        sensor_faults=tuple(faults),
        blocks=blocks,
        residuals=solution.residuals,
    )


def _goodness(
    run: RigRun, blocks: sweep_curve.Blocks, parameters: dict[str, float], c: float
) -> tuple[float, float, int]:
    """R^2 and standard deviation of the residuals of the samples (not of the block means)."""
    time, nearest = run.time, np.clip(np.searchsorted(blocks.time, run.time), 0, blocks.time.size - 1)
    use = np.isfinite(run.lateral_force) & blocks.settled[nearest]
    force = _curve(blocks, time[use], blocks.rate[nearest[use]], c, parameters)
    middle = 0.5 * (blocks.time[0] + blocks.time[-1])
    drift = parameters["drift"] * (time[use] - middle) / (blocks.time[-1] - blocks.time[0])
    measured = run.lateral_force[use]
    residual = measured - force - parameters["vertical_shift"] - drift
    total = float(np.sum((measured - measured.mean()) ** 2))
    return 1.0 - float(residual @ residual) / total, float(np.std(residual)), int(use.sum())


def _condition_notes(run: RigRun, blocks: sweep_curve.Blocks, load: float, r_squared: float, notes: list[str]) -> None:
    """Add to ``notes`` what is unusual: load (N) off nominal, missing samples, a poor fit, little slip, camber."""
    if abs(load / run.condition.load - 1.0) > 0.02:
        notes.append(f"mean measured load {load:.1f} N is {100 * (load / run.condition.load - 1):+.1f} % off nominal")
    if blocks.missing:
        notes.append(f"{blocks.missing} samples without lateral force rejected")
    if r_squared < 0.98:
        notes.append(f"R^2 = {r_squared:.4f} is low for a slip sweep")
    reach = np.rad2deg(min(-blocks.slip.min(), blocks.slip.max()))
    if reach < 2.0:
        notes.append(f"slip reaches {reach:.1f} deg on one side only; the curve's centre is poorly known")
    if run.inclination is not None:
        camber = float(np.nanmean(run.inclination))
        if abs(camber) > np.deg2rad(0.5):
            notes.append(f"camber {np.rad2deg(camber):.2f} deg: the offset Sv contains camber thrust")


_READING = {"lateral_force": "force", "slip_angle": "slip", "gain": "force"}  # of the blocks


@dataclass(frozen=True)
class Limits:
    """Limits of the verdict; data/validation/sensor_faults.json holds measured rates of false alarms."""

    onsets: tuple[float, ...] = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)  # tried, of the largest reading
    gained: float = 6.0  # least fall of the sum of squares, in units of its mean, that is worth a closer look
    fewest: int = 8  # blocks beyond an onset
    p_flat: float = 5e-4  # significance of a flattening
    p_sign: float = 1e-3  # significance of two gains
    least_flat: float = 0.03  # least flattening that is told, of the largest reading
    least_sign: float = 0.005  # least difference of gains that is told


LIMITS = Limits()


@dataclass(frozen=True)
class Flattening:
    """A channel that reads too little beyond an onset."""

    channel: str  # ``lateral_force`` or ``slip_angle``
    onset: float  # size of the reading at which it begins, N or rad
    largest: float  # largest reading, N or rad
    share: float  # by how much the largest reading is low, relative


@dataclass(frozen=True)
class GainBySign:
    """Gain of the force cell to the right less that to the left, relative, and its standard deviation."""

    difference: float  # relative
    sd: float  # likewise


def find_fault(model: sweep_curve.SweepModel, solution: sweep_curve.SweepSolution) -> "Flattening | GainBySign | None":
    """Return the fault of a sensor in a fitted sweep, if any is significant: the one that fits best."""
    # directions in which the fitted force can change, the last towards a brush, and the part of the force left over
    scaled = np.array([solution.values[name] for name in sweep_curve.NAMES]) / model.units
    residual, jacobian = model.residuals(scaled)
    brush = _brush_fit(model, solution) - (residual + model.blocks.force[model.blocks.settled])
    columns, unexplained = np.column_stack([jacobian[:, model.free], brush]), -residual
    steepness = jacobian[:, sweep_curve.NAMES.index("horizontal_shift")]
    before = _fit_column(columns, brush, unexplained)[1]
    faults: list[tuple[float, Flattening | GainBySign]] = []
    for channel, effect in (("lateral_force", -1.0), ("slip_angle", steepness)):
        reading = getattr(model.blocks, _READING[channel])[model.blocks.settled]
        largest = float(np.max(np.abs(reading)))
        onsets = [q for q in LIMITS.onsets if np.count_nonzero(np.abs(reading) > q * largest) >= LIMITS.fewest]
        trials = [
            (_fit_column(columns, effect * largest * _bend(reading / largest, q), unexplained), q) for q in onsets
        ]
        rising = [(float(remainder @ remainder), q) for (size, remainder), q in trials if size > 0.0]
        if not rising or before @ before - min(rising)[0] < LIMITS.gained * min(rising)[0] / len(reading):
            continue  # nothing to be gained, even if the noise were white
        best = min(rising)[1]
        fits = [_bent_fit(model, solution, brush, channel, q) for q in onsets if abs(q - best) < 0.11]
        cost, share, onset, significance = min(fits, key=lambda fit: fit[0])
        if channel == "slip_angle" and not _slows(model, onset * largest, share):
            continue
        deviations, dof = significance() if share > LIMITS.least_flat else (0.0, 1.0)
        if stdtr(dof, -deviations) < LIMITS.p_flat:
            faults.append((cost, Flattening(channel, onset * largest, largest, share)))
    force = model.blocks.force[model.blocks.settled]
    if min(np.count_nonzero(force > 0), np.count_nonzero(force < 0)) >= LIMITS.fewest:
        cost, size, _, significance = _bent_fit(model, solution, brush, "gain", 0.0)
        deviations, dof = significance() if abs(size) > LIMITS.least_sign else (0.0, 1.0)
        if 2.0 * stdtr(dof, -abs(deviations)) < LIMITS.p_sign:
            faults.append((cost, GainBySign(size, size / deviations)))
    return min(faults, key=lambda cost_and_fault: cost_and_fault[0])[1] if faults else None


def _bent_fit(
    model: sweep_curve.SweepModel, solution: sweep_curve.SweepSolution, brush: Array, channel: str, onset: float
) -> tuple[float, float, float, Callable[[], tuple[float, float]]]:
    """Fit a sweep whose channel flattens beyond an onset, or whose force cell has two gains (``gain``).

    Gives the sum of squares, the share or difference, the onset, and what gives its distance from zero in standard
    deviations, with their degrees of freedom: most fits need no answer, which takes as long as they do.
    """
    blocks, used = model.blocks, model.blocks.settled
    start = np.array([solution.values[name] for name in sweep_curve.NAMES]) / model.units
    largest = float(np.max(np.abs(getattr(blocks, _READING[channel])[used])))

    def parts(z: Array) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, p + 2) by the curve, the way towards a brush and the share."""
        scaled, share, corrected = model.expand(z[:-2]), z[-1], model
        if channel == "slip_angle":
            missing = largest * _bend(blocks.slip / largest, onset)
            corrected = replace(model, blocks=replace(blocks, slip=blocks.slip + share * missing))
        residual, jacobian = corrected.residuals(scaled)
        columns = np.column_stack([jacobian[:, model.free], brush])
        force = residual + blocks.force[used] + z[-2] * brush
        if channel == "slip_angle":
            by_share = jacobian[:, sweep_curve.NAMES.index("horizontal_shift")] * missing[used]
        elif channel == "gain":
            by_share = np.abs(force) / 2.0
            columns *= (1.0 + share * np.sign(force) / 2.0)[:, None]
            force = force + share * by_share
        else:
            by_share = -largest * _bend(force / largest, onset)
            slope = 2.0 * np.clip(np.abs(force / largest) - onset, 0.0, None) / (1.0 - onset) ** 2  # of the bend
            columns *= (1.0 - share * slope)[:, None]
            force = force + share * by_share
        return force - blocks.force[used], np.column_stack([columns, by_share])

    low, high = (
        np.append(sweep_curve.LOW[model.free], [-5.0, -1.0]),
        np.append(sweep_curve.HIGH[model.free], [5.0, 1.0]),
    )
    begin = np.clip(np.append(start[model.free], [0.0, 0.01]), low + 1e-6, high - 1e-6)
    fitted = sweep_curve.solve_least_squares(parts, begin, bounds=(low, high), tolerance=1e-6)
    residual, columns = parts(fitted.x)
    size = float(fitted.x[-1])

    def significance() -> tuple[float, float]:
        scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        covariance, dof = correlated_covariance(columns / scale, residual)
        return size / (float(np.sqrt(covariance[-1, -1])) / float(scale[-1])), dof

    if channel == "lateral_force":
        true = np.abs((residual + blocks.force[used] - size * columns[:, -1]) / largest)
        missing = size * np.abs(_bend(true, onset))
        share = float(missing[np.argmax(true)] / true.max())
    else:
        share = size / (1.0 + size) if channel == "slip_angle" else size
    return float(residual @ residual), share, onset, significance


def without_faults(
    model: sweep_curve.SweepModel, solution: sweep_curve.SweepSolution
) -> tuple[sweep_curve.SweepModel, sweep_curve.SweepSolution, list[str]]:
    """Return a fitted sweep without the samples of a faulty sensor, and the notes on it."""
    fault = find_fault(model, solution)
    if fault is None:
        return model, solution, []
    if isinstance(fault, GainBySign):
        more, less = ("right", "left") if fault.difference > 0 else ("left", "right")
        return (
            model,
            solution,
            [
                f"the force cell seems to have a larger gain to the {more} than to the {less}, by at least "
                f"about {100 * abs(fault.difference):.1f} %; the cornering stiffness is that of their mean"
            ],
        )
    unit, factor = ("N", 1.0) if fault.channel == "lateral_force" else ("deg", 180.0 / np.pi)
    text = (
        f"a sensor flattens, most likely that of {fault.channel}: beyond +-{factor * fault.onset:.3g} {unit} it reads "
        f"too little, at least {100 * fault.share:.0f} % at its largest, {factor * fault.largest:.3g} {unit}"
    )
    blocks = model.blocks
    reading = blocks.force if fault.channel == "lateral_force" else blocks.slip
    inner = replace(model, blocks=replace(blocks, settled=blocks.settled & (np.abs(reading) <= fault.onset)))
    if inner.blocks.settled.sum() < 2 * model.free.sum():
        return model, solution, [f"{text}; too few samples remain without them, so they are used: C_alpha is uncertain"]
    better = sweep_curve.solve_sweep(inner)
    change = solution.values["cornering_stiffness"] / better.values["cornering_stiffness"] - 1.0
    than = f"{100 * abs(change):.1f} % {'higher' if change > 0 else 'lower'}"
    return inner, better, [f"{text}; samples beyond are not used; with them C_alpha is {than}"]


def _slows(model: sweep_curve.SweepModel, onset: float, share: float) -> bool:
    """True if the recorded slip is slower beyond an ``onset`` (rad), as it must be if a ``share`` is missing."""
    blocks = model.blocks
    same_branch = np.diff(blocks.branch) == 0
    pace = np.abs(np.diff(blocks.slip) / np.diff(blocks.time))[same_branch]
    middle = np.abs(blocks.slip[1:] + blocks.slip[:-1])[same_branch] / 2.0
    if not (middle > onset).any() or not (middle <= onset).any():
        return False
    return bool(np.median(pace[middle > onset]) < (1.0 - share) * np.median(pace[middle <= onset]))


def _bend(reading: Array, onset: float) -> Array:
    """Missing part of a reading from -1 to 1: nothing up to the onset, 1 at the end."""
    return np.asarray(np.sign(reading) * (np.clip(np.abs(reading) - onset, 0.0, None) / (1.0 - onset)) ** 2)


def _brush_fit(model: sweep_curve.SweepModel, solution: sweep_curve.SweepSolution) -> Array:
    """The force (m,), N, of the brush nearest to the sweep, with the shifts, drift, lag and hysteresis of the fit."""
    blocks, used, v = model.blocks, model.blocks.settled, solution.values
    lagged, _ = sweep_curve.lagged_slip(blocks.time[used], blocks.history, lag=v["lag"])
    slip = lagged + v["horizontal_shift"]
    slip -= v["hysteresis"] * np.sign(blocks.rate[used])
    measured = blocks.force[used]
    clock = (blocks.time[used] - blocks.time[used].mean()) / np.ptp(blocks.time)
    unit = float(np.max(np.abs(measured)))

    def force(z: Array) -> Array:
        stiffness, peak = z[0] * v["cornering_stiffness"], z[1] * unit
        brush, _ = sweep_curve.brush_force(slip=slip, cornering_stiffness=stiffness, peak=peak)
        return np.asarray(brush + v["vertical_shift"] + v["drift"] * clock)

    search: Any = scipy.optimize.least_squares
    limits = ([0.3, 0.7], [3.0, 6.0])
    best = search(lambda z: force(z) - measured, [1.0, 1.1], bounds=limits, x_scale=[0.1, 0.1], max_nfev=30)
    return force(best.x)


def _fit_column(columns: Array, column: Array, target: Array) -> tuple[float, Array]:
    """Fit ``columns`` (m, p) and one ``column`` (m,) more to a ``target`` (m,): size of the latter, and residual."""
    augmented = np.column_stack([columns, column])
    scale = np.linalg.norm(augmented, axis=0)
    sizes = np.linalg.lstsq(augmented / np.maximum(scale, 1e-300), target, rcond=1e-10)[0] / np.maximum(scale, 1e-300)
    return float(sizes[-1]), target - augmented @ sizes
