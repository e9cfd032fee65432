"""Relaxation length: C_alpha/K_y, two sweep rates, or a step of slip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.special import chdtrc, ndtri

from tyre.fits.sweep_curve import load_wander
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.laws.magic_formula import magic_formula
from tyre.measured.properties import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties, weighed_scatter
from tyre.recordings.recording import Channel, RigRun


def first_order_lag(signal: Array, *, step: float, start: float | None = None) -> Array:
    """Solve y' + y = signal at equal steps for an input that is linear between samples, y (n,) in its unit.

    ``step`` is that between samples over the lag; ``start`` is y at the first sample (None: that of the signal).
    """
    decay = np.exp(-step)
    ramp = (1.0 - decay) / step
    begin = ramp * signal[0] if start is None else start - (1.0 - ramp) * signal[0]
    lagged, _ = scipy.signal.lfilter([1.0 - ramp, ramp - decay], [1.0, -decay], signal, zi=[begin])
    return np.asarray(lagged)


@dataclass(frozen=True)
class SlipStepFit:
    """Result of one slip step."""

    relaxation_length: Estimate  # with what the curve of the tyre leaves open
    fit_sd: float  # from the (correlated) residuals of this recording alone, m
    fit_dof: float  # degrees of freedom behind ``fit_sd``
    curve_sd: float  # because the peak of the lateral force is assumed, common to all steps of a tyre, m
    slip: tuple[float, float]  # before and after the step, rad
    deficit: float  # share by which the force change stays below cornering stiffness times slip change, as assumed
    length_by_deficit: float  # relative change of the length for a deficit that is larger by one
    distance_to_63: float | None  # m to where the smoothed force first passes 63.2 % of its change
    force_change: float  # N, of the fitted steady force from before to after the step
    r_squared: float  # of the resampled lateral force
    residual_sd: float  # N, likewise
    notes: tuple[str, ...]  # those of the recording


def is_slip_step(run: RigRun) -> bool:
    """True if a recording is a slip step: declared as one, or slip rests at two levels for most of the time."""
    if run.kind != "slip_sweep":
        return run.kind == "slip_step"
    slip = run.slip_angle[np.isfinite(run.slip_angle)]
    if slip.size < 20:
        return False
    span = float(np.ptp(slip))
    low, high = float(slip.min()), float(slip.max())
    at_rest = (slip < low + 0.1 * span) | (slip > high - 0.1 * span)
    changes = int(np.sum(np.abs(np.diff((slip > 0.5 * (low + high)).astype(int)))))
    return bool(at_rest.mean() > 0.9 and changes < 4 and span > np.deg2rad(0.1))


# peak of the lateral force over load of a tyre that is not known better, its relative standard deviation, and the shape
# C of its Magic Formula: bicycle tyres have 0.7 to 1.2 (Dell'Orto et al.; Schwalbe 28 x 1.75 of data/tyres)
PEAK, PEAK_SD, SHAPE = 0.95, 0.25, 1.4


def steady_curve(slip: Array, *, stiffness: float, peak: float, shape: float = SHAPE, curvature: float = 0.0) -> Array:
    """Lateral force of a tyre without offsets at a steady slip (rad): the Magic Formula with this slope at zero."""
    reduced = stiffness / (shape * peak) * slip
    return peak * magic_formula(reduced, shape_factor=shape, curvature_factor=curvature)


def fit_slip_step(run: RigRun) -> SlipStepFit:
    """Fit the relaxation length to a slip step: the slip lags, and the force follows the curve at the lagged slip.

    length d(lagged slip)/d(distance) + lagged slip = slip, F = F0 + curve(lagged slip) (Pacejka 2012, ch. 7; at small
    slip the first-order lag of the force of Dell'Orto et al., eqs. 1 and 2). The recorded slip is the input, integrated
    exactly over travelled distance, so a step that takes a while does not lengthen the result. Cornering stiffness,
    offset and length are fitted. The force follows the measured load, as a load that swings once a turn of the wheel
    would be taken for lag. A drift of the force cell is slow noise, which the interval allows for. One step does not
    show the peak of the curve, so it is assumed as :data:`PEAK` of the load; its uncertainty is part of that of the
    length.
    """
    where = str(run.source or run.condition.tyre)
    distance, slip, force, heavier = _over_distance(run, where)
    head = max(3, distance.size // 100)
    before, after = float(np.median(slip[:head])), float(np.median(slip[-max(head, distance.size // 5) :]))
    jump = after - before
    if abs(jump) < np.deg2rad(0.1):
        raise InputError(f"{where}: the slip angle changes by {np.rad2deg(jump):.3f} deg; a step of 0.1 deg is needed")
    step = distance[1] - distance[0]
    # slip noise outside the transition would only pass through the lag as noise: hold the plateaus still
    u = (slip - before) / jump
    noise = 1.4826 * float(np.median(np.abs(u[-distance.size // 5 :] - 1.0)))
    u = np.where(np.abs(u) < 4.0 * noise, 0.0, np.where(np.abs(u - 1.0) < 4.0 * noise, 1.0, u))
    middle = float(distance[np.argmax(u > 0.5)])
    change = float(np.median(force[-distance.size // 5 :]) - np.median(force[:head]))
    if change / jump <= 0.0:
        raise InputError(
            f"{where}: the lateral force falls with slip after conversion from the declared axes; check axes"
        )
    load = float(np.nanmean(run.vertical_load)) if np.isfinite(run.vertical_load).any() else run.condition.load
    assumed = max(PEAK * load, 1.5 * abs(change))
    scale = max(1.4826 * float(np.median(np.abs(force - np.convolve(force, np.ones(5) / 5.0, mode="same")))), 1e-6)
    limits = ([-np.inf, 0.0, np.log(0.5 * step)], [np.inf, np.inf, np.log(distance[-1])])

    def fitted(peak: float, start: Array, scale: float) -> Any:
        def residual(z: Channel) -> Channel:
            lagged = before + jump * first_order_lag(u, step=step / float(np.exp(z[2])))
            steady = (1.0 + heavier) * steady_curve(lagged, stiffness=z[1], peak=peak)
            return z[0] + steady - force

        robust: dict[str, Any] = {"loss": "soft_l1", "f_scale": 3.0 * scale}
        solution: Any = scipy.optimize.least_squares(residual, start, bounds=limits, x_scale="jac", **robust)
        return solution, residual(solution.x)

    begin = np.array([np.median(force[:head]), change / jump, np.log(0.1)])
    solution, residuals = fitted(assumed, begin, scale)
    scale = max(scale, 1.4826 * float(np.median(np.abs(residuals))))  # slow noise is not to be taken for outliers
    solution, residuals = fitted(assumed, solution.x, scale)
    length = float(np.exp(solution.x[2]))
    if not 2.0 * step < length < (distance[-1] - middle) / 3.0:
        raise InputError(
            f"{where}: relaxation length {length:.3f} m does not fit a recording of {distance[-1] - middle:.2f} m "
            f"after the step at {step:.4f} m per sample; roll on for at least three relaxation lengths"
        )
    robust_weight = 1.0 / np.sqrt(1.0 + (residuals / (3.0 * scale)) ** 2)
    change_of, covariance, dof = _averaged_over_noise(solution.jac, robust_weight * residuals)
    solution.x = solution.x + change_of
    length = float(np.exp(solution.x[2]))
    sd = length * float(np.sqrt(covariance[2, 2]))

    def deficit(peak: float, z: Array) -> float:
        ends = steady_curve(np.array([before, after]), stiffness=z[1], peak=peak)
        return 1.0 - float(ends[1] - ends[0]) / (float(z[1]) * jump)

    refits = [(peak, fitted(peak, solution.x, scale)[0].x) for peak in assumed * np.exp([-PEAK_SD, PEAK_SD])]
    by_curve = float(refits[0][1][2] - refits[1][1][2])
    by_deficit = by_curve / (deficit(*refits[0]) - deficit(*refits[1]))
    curve_sd = length * abs(by_curve) / 2.0
    total = float(np.sum((force - force.mean()) ** 2))
    ends = steady_curve(np.array([before, after]), stiffness=solution.x[1], peak=assumed)
    level, change = float(solution.x[0] + ends[0]), float(ends[1] - ends[0])
    width = max(1, distance.size // 200) * 2 + 1
    smooth = np.convolve(np.pad(force, width // 2, mode="edge"), np.ones(width) / width, mode="valid")
    passed = np.flatnonzero(((smooth - level) / change > 1.0 - np.exp(-1.0)) & (distance > middle))
    return SlipStepFit(
        fit_sd=sd,
        fit_dof=dof,
        curve_sd=curve_sd,
        relaxation_length=Estimate(length, *combine_uncertainties([(sd, dof), (curve_sd, np.inf)])),
        slip=(before, after),
        deficit=deficit(assumed, solution.x),
        length_by_deficit=by_deficit,
        force_change=change,
        distance_to_63=float(distance[passed[0]] - middle) if passed.size else None,
        r_squared=1.0 - float(residuals @ residuals) / total,
        residual_sd=float(np.std(residuals)),
        notes=run.notes,
    )


def _averaged_over_noise(
    jacobian: NDArray[np.float64], residual: Channel
) -> tuple[Channel, NDArray[np.float64], float]:
    """Step from a fit to the likeliest parameters under white plus AR(1) noise, their covariance and its freedom.

    A slip step is too short to estimate the size and memory of slow noise, and the interval at the likeliest ones is
    too narrow: step and covariance are averaged over a grid of them by restricted likelihood (Patterson &
    Thompson, 1971). A force cell without slow noise is not on the grid: so short a recording cannot show its absence.
    """
    n, p = jacobian.shape
    width = max(1, n // 140)  # means hold what a fit sees of slow noise
    m = n // width
    x = jacobian[: m * width].reshape(m, width, p).mean(1)
    y = residual[: m * width].reshape(m, width).mean(1)
    size = np.linalg.norm(x, axis=0)
    x, distance = x / size, np.abs(np.subtract.outer(np.arange(m), np.arange(m)))
    weights, steps, squares, spent = [], [], [], []
    for memory in np.geomspace(m / 50.0, m / 1.5, 7):
        for share in (0.3, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98):
            factor = np.linalg.cholesky((1.0 - share) * np.eye(m) + share * np.exp(-distance / memory))
            white = solve_triangular(factor, np.column_stack([x, y]), lower=True)
            basis, triangle = np.linalg.qr(white[:, :p])
            step = np.linalg.solve(triangle, basis.T @ white[:, p])
            misfit = float(np.sum((white[:, p] - basis @ (basis.T @ white[:, p])) ** 2))
            logdet = np.log(np.diag(factor)).sum() + np.log(np.abs(np.diag(triangle))).sum()
            weights.append(-logdet - 0.5 * (m - p) * np.log(max(misfit, 1e-300)))
            inverse = np.linalg.inv(triangle)
            steps.append(-step)
            # slow noise counts as one value a memory
            spent.append(share**2 / max(2.5, m / (2.0 * memory) - p) + (1.0 - share) ** 2 / (m - p))
            squares.append(inverse @ inverse.T * misfit / (m - p - 2) + np.outer(step, step))
    weight = np.exp(np.array(weights) - max(weights))
    weight /= weight.sum()
    mean = np.tensordot(weight, steps, 1)
    covariance = (np.tensordot(weight, squares, 1) - np.outer(mean, mean)) / np.outer(size, size)
    return mean / size, covariance, 1.0 / float(weight @ spent)


def complete_samples(run: RigRun) -> NDArray[np.bool_]:
    """Mark the samples of a slip step that lack nothing: they are fitted."""
    valid = np.isfinite(run.lateral_force) & np.isfinite(run.slip_angle) & np.isfinite(run.time)
    return valid if run.speed is None else valid & np.isfinite(run.speed)


def _over_distance(run: RigRun, where: str) -> tuple[Channel, Channel, Channel, Channel]:
    """Even steps of distance (m), and there the slip (rad), the force (N) and the load over its mean less one."""
    valid = complete_samples(run)
    if (count := int(valid.sum())) < 50:
        raise InputError(f"{where}: {count} complete samples are too few for a slip step; at least 50 are needed")
    time = run.time[valid]
    if run.speed is not None:
        speed = run.speed[valid]
    elif run.condition.speed is not None:
        speed = np.full(time.size, run.condition.speed)
    else:
        raise InputError(f"{where}: a slip step needs the speed; record it or give speed_km_h in the sidecar")
    if np.any(speed <= 0.0):
        raise InputError(f"{where}: speed {speed.min():.3g} m/s; the tyre must roll forward throughout a slip step")
    travelled = np.concatenate([[0.0], np.cumsum(np.diff(time) * 0.5 * (speed[1:] + speed[:-1]))])
    even = np.linspace(0.0, travelled[-1], travelled.size)
    slip = np.interp(even, travelled, run.slip_angle[valid])
    force = np.interp(even, travelled, run.lateral_force[valid])
    has_load = np.isfinite(run.vertical_load[valid])
    if not has_load.any():
        return even, slip, force, np.zeros_like(even)
    load = np.interp(even, travelled[has_load], run.vertical_load[valid][has_load])
    width = 2 * (even.size // 100) + 1  # noise averages out, and what swings with a turn of the wheel does not
    means = np.convolve(np.pad(load, width // 2, mode="edge"), np.full(width, 1.0 / width), mode="valid")
    return even, slip, force, load_wander(load, means, np.full(even.size, width))


def relaxation_from_stiffness(
    *, cornering_stiffness: Estimate, lateral_stiffness: Estimate, calibration: Calibration
) -> tuple[Estimate, NDArray[np.float64]]:
    """Relaxation length C_alpha / K_y with the covariance of all three (Dell'Orto et al., eq. 3)."""
    c, k = cornering_stiffness.value, lateral_stiffness.value
    c_sd, k_sd = cornering_stiffness.sd / c, lateral_stiffness.sd / k
    length = c / k
    separate = np.diag([c_sd**2 + calibration.slip**2, k_sd**2 + calibration.displacement**2])
    relative = separate + calibration.force**2  # one load cell
    # d(ln C, ln K, ln length) = rows of this matrix times d(ln C, ln K)
    rows = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, -1.0]])
    scale = np.array([c, k, length])
    covariance = rows @ relative @ rows.T * np.outer(scale, scale)
    certificate = calibration.slip**2 + calibration.displacement**2
    parts = [(c_sd, cornering_stiffness.dof), (k_sd, lateral_stiffness.dof), (float(np.sqrt(certificate)), np.inf)]
    _, dof = combine_uncertainties(parts)
    return Estimate(length, float(np.sqrt(covariance[2, 2])), dof), covariance


def relaxation_from_two_rates(sweeps: Sequence[Any]) -> Estimate | None:
    """Relaxation length from the ``half_gap`` (rad), ``rate`` (rad/s) and ``speed`` (m/s) of sweeps at several rates.

    Half the slip distance between the branches is h = h0 + |d(slip)/dt| length / v: its growth with the rate is the
    lag, while h0 (friction of the steering, play) does not depend on the rate. A constant delay between the force and
    slip channels of the rig reads as lag: delay times speed must be taken off if it is known.
    """
    usable = [sweep for sweep in sweeps if sweep.speed is not None and sweep.half_gap_sd > 0.0]
    if len(usable) < 2:
        return None
    pace = np.array([sweep.rate / sweep.speed for sweep in usable])
    if pace.max() < 1.5 * pace.min():
        return None
    gap = np.array([sweep.half_gap for sweep in usable])
    weight = 1.0 / np.array([sweep.half_gap_sd for sweep in usable])
    design = np.column_stack([np.ones_like(pace), pace])
    bread = np.linalg.inv((design * weight[:, None] ** 2).T @ design)
    values = bread @ (design * weight[:, None] ** 2).T @ gap
    chi2 = float(np.sum(((gap - design @ values) * weight) ** 2))
    dof = len(usable) - 2
    # scatter beyond the sweeps' own uncertainty widens the result; scatter below it does not narrow it
    inflation = max(1.0, np.sqrt(chi2 / dof)) if dof else 1.0
    return Estimate(float(values[1]), float(np.sqrt(bread[1, 1])) * inflation, float(dof) if dof else np.inf)


def mean_length(steps: Sequence[Estimate], *, repeatability: float = 0.01, common: float = 0.0) -> Estimate | None:
    """Mean of repeated slip steps; ``common`` is a standard deviation (m) of all of them: the curve of the tyre."""
    if not steps:
        return None
    values = np.array([step.value for step in steps])
    mean = float(values.mean())
    if values.size == 1:
        parts = [(steps[0].sd, steps[0].dof), (repeatability * mean, REPEATABILITY_DOF), (common, np.inf)]
        return Estimate(mean, *combine_uncertainties(parts))
    fit_sd = float(np.sqrt(np.mean([step.sd**2 for step in steps])))
    squares, repeats = float(np.sum((values - mean) ** 2)), float(values.size - 1)
    sd, dof = weighed_scatter(float(np.hypot(repeatability * mean, fit_sd)), squares, repeats)
    return Estimate(mean, *combine_uncertainties([(max(sd, fit_sd) / np.sqrt(values.size), dof), (common, np.inf)]))


def mean_of_steps(steps: Sequence[Any], sweeps: Sequence[Any], *, repeatability: float = 0.01) -> Estimate | None:
    """Relaxation length from the summaries of slip steps, corrected by the curve of sweeps at the same condition.

    A step assumes the peak of the curve; where sweeps measured the curve, the length is moved by what the step's
    deficit is too small or too large, and a sixth of that deficit stays open.
    """
    lengths, open_part = [], 0.0
    names = ("curve_slope_N_per_rad", "peak_N", "shape", "curvature")
    measured = [sweep for sweep in sweeps if "peak_N" in sweep.details]
    curves = [tuple(sweep.details[name] for name in names) for sweep in measured]
    stiffnesses = np.array([sweep.value for sweep in measured])  # of a brush above the slope of the fitted curve
    for item in steps:
        details = item.details
        ends = np.array([details["slip_before_rad"], details["slip_after_rad"]])
        factor = 1.0
        open_sd = details["curve_sd_m"]
        if curves:
            forces = np.array([steady_curve(ends, stiffness=k, peak=d, shape=c, curvature=e) for k, d, c, e in curves])
            rise = np.diff(forces)[:, 0] / (np.diff(ends) * stiffnesses)
            deficit = float(np.mean(1.0 - rise))
            factor += details["length_by_deficit"] * (deficit - details["deficit"])
            open_sd = item.value * abs(details["length_by_deficit"] * deficit) / 6.0
        lengths.append(Estimate(item.value, item.fit_sd, details["dof"]).scaled(factor))
        open_part = max(open_part, open_sd)
    return mean_length(lengths, repeatability=repeatability, common=open_part)


@dataclass(frozen=True)
class Agreement:
    """Agreement of routes to the relaxation length: chi^2 about their weighted mean, its degrees of freedom and p.

    ``tests`` counts the conditions of the campaign that are tested alike, of which one may disagree by chance.
    """

    routes: dict[str, Estimate]  # relaxation length, m, by its route
    mean: float  # m, weighted by the inverse variances
    chi2: float  # sum of squared distances from the mean, each over its standard deviation
    dof: int  # number of routes less one
    p_value: float  # probability of a larger ``chi2`` if all routes measure one length
    tests: int = 1  # conditions of the campaign that are tested alike

    @property
    def limit(self) -> float:
        """The p below which the routes disagree: 5 % that any of the ``tests`` errs (Sidak 1967)."""
        return -float(np.expm1(np.log1p(-0.05) / self.tests))

    @property
    def agree(self) -> bool:
        """The routes agree, at the limit that allows for the number of tests."""
        return self.p_value >= self.limit

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        names = ", ".join(f"{name} {1e3 * e.value:.1f} ± {1e3 * e.sd:.1f} mm" for name, e in self.routes.items())
        verdict = "agree" if self.agree else "disagree"
        return f"{names}: {verdict} (chi^2 = {self.chi2:.2f}, {self.dof} dof, p = {self.p_value:.2g})"


def agreement(routes: Mapping[str, Estimate]) -> Agreement | None:
    """Test whether independent routes give one relaxation length."""
    if len(routes) < 2:
        return None
    value = np.array([e.value for e in routes.values()])
    # a standard deviation from few repeats is widened to the normal one with the same 95 % interval
    sd = np.array([(e.ci95[1] - e.value) / ndtri(0.975) for e in routes.values()])
    weight = 1.0 / sd**2
    mean = float(weight @ value / weight.sum())
    chi2 = float(np.sum(((value - mean) / sd) ** 2))
    dof = value.size - 1
    return Agreement(dict(routes), mean, chi2, dof, float(chdtrc(dof, chi2)))
