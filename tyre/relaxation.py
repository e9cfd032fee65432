"""Relaxation length: C/K, two sweep rates, or a step of slip."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import least_squares
from scipy.signal import lfilter

from tyre.arrays import Array
from tyre.errors import InputError
from tyre.noise import correlated_covariance
from tyre.properties import REPEATABILITY_DOF, Calibration, Estimate, combine_uncertainties, weighed_scatter
from tyre.recording import Channel, Condition, RigRun


def first_order_lag(signal: Array, *, step: float, start: float | None = None) -> Array:
    """Solve y' + y = signal for an input that is linear between samples."""
    decay = np.exp(-step)
    ramp = (1.0 - decay) / step
    begin = ramp * signal[0] if start is None else start - (1.0 - ramp) * signal[0]
    lagged, _ = lfilter([1.0 - ramp, ramp - decay], [1.0, -decay], signal, zi=[begin])
    return np.asarray(lagged)


@dataclass(frozen=True)
class SlipStepFit:
    """Result of one slip step."""

    condition: Condition
    source: Path | None
    relaxation_length: Estimate
    distance_to_63: float | None  # m to where the smoothed force first passes 63.2 % of its change
    force_change: float
    r_squared: float
    residual_sd: float
    notes: tuple[str, ...]


def is_slip_step(run: RigRun) -> bool:
    """Tell if a recording is a slip step: declared as one, or slip rests at two levels for most of the time."""
    if run.kind == "slip_step":
        return True
    slip = run.slip_angle[np.isfinite(run.slip_angle)]
    if slip.size < 20:
        return False
    span = float(np.ptp(slip))
    low, high = float(slip.min()), float(slip.max())
    at_rest = (slip < low + 0.1 * span) | (slip > high - 0.1 * span)
    changes = int(np.sum(np.abs(np.diff((slip > 0.5 * (low + high)).astype(int)))))
    return bool(at_rest.mean() > 0.9 and changes < 4 and span > np.deg2rad(0.1))


def fit_slip_step(run: RigRun) -> SlipStepFit:
    """Fit the first-order lag of the side force after a slip step (Dell'Orto et al., eqs. 1 and 2, length in m).

    The recorded slip itself, scaled from 0 to 1 over the step, is the input of the lag, so a step that takes a while
    does not lengthen the result: F = F0 + (F1 - F0) u_lagged, the lag integrated exactly over travelled distance.
    """
    where = str(run.source or run.condition.tyre)
    distance, slip, force = _over_distance(run, where)
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

    def residual(z: Channel) -> Channel:
        return z[0] + z[1] * first_order_lag(u, step=step / float(np.exp(z[2]))) - force

    change = float(np.median(force[-distance.size // 5 :]) - np.median(force[:head]))
    if change / jump <= 0.0:
        raise InputError(f"{where}: the side force falls with slip after conversion from the declared axes; check axes")
    start = np.array([np.median(force[:head]), change, np.log(0.1)])
    scale = max(1.4826 * float(np.median(np.abs(force - np.convolve(force, np.ones(5) / 5.0, mode="same")))), 1e-6)
    limits = ([-np.inf, -np.inf, np.log(0.5 * step)], [np.inf, np.inf, np.log(distance[-1])])
    found: Any = least_squares(residual, start, bounds=limits, x_scale="jac", loss="soft_l1", f_scale=3.0 * scale)
    length = float(np.exp(found.x[2]))
    if not 2.0 * step < length < (distance[-1] - middle) / 3.0:
        raise InputError(
            f"{where}: relaxation length {length:.3f} m does not fit a recording of {distance[-1] - middle:.2f} m "
            f"after the step at {step:.4f} m per sample; roll on for at least three relaxation lengths"
        )
    left = residual(found.x)
    inside = 1.0 / np.sqrt(1.0 + (left / (3.0 * scale)) ** 2)
    covariance, dof = correlated_covariance(found.jac, inside * left)
    sd = length * float(np.sqrt(covariance[2, 2]))
    total = float(np.sum((force - force.mean()) ** 2))
    level, change = float(found.x[0]), float(found.x[1])
    width = max(1, distance.size // 200) * 2 + 1
    smooth = np.convolve(np.pad(force, width // 2, mode="edge"), np.ones(width) / width, mode="valid")
    passed = np.flatnonzero(((smooth - level) / change > 1.0 - np.exp(-1.0)) & (distance > middle))
    return SlipStepFit(
        condition=run.condition, source=run.source, relaxation_length=Estimate(length, sd, dof),
        distance_to_63=float(distance[passed[0]] - middle) if passed.size else None, force_change=change,
        r_squared=1.0 - float(left @ left) / total, residual_sd=float(np.std(left)), notes=run.notes,
    )  # fmt: skip


def complete_samples(run: RigRun) -> NDArray[np.bool_]:
    """Mark the samples of a slip step that lack nothing: they are fitted."""
    valid = np.isfinite(run.side_force) & np.isfinite(run.slip_angle) & np.isfinite(run.time)
    return valid if run.speed is None else valid & np.isfinite(run.speed)


def _over_distance(run: RigRun, where: str) -> tuple[Channel, Channel, Channel]:
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
    return even, slip, np.interp(even, travelled, run.side_force[valid])


def relaxation_from_stiffness(
    *, cornering_stiffness: Estimate, lateral_stiffness: Estimate, calibration: Calibration | None = None
) -> tuple[Estimate, NDArray[np.float64]]:
    """Relaxation length C_Fy / K_y with the covariance of all three (Dell'Orto et al., eq. 3)."""
    calibration = calibration or Calibration()
    c, k = cornering_stiffness.value, lateral_stiffness.value
    c_sd, k_sd = cornering_stiffness.sd / c, lateral_stiffness.sd / k
    length = c / k
    own = np.diag([c_sd**2 + calibration.slip**2, k_sd**2 + calibration.displacement**2])
    relative = own + calibration.force**2  # one load cell
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


def mean_of_steps(steps: Sequence[Estimate], *, repeatability: float = 0.01) -> Estimate | None:
    """Mean relaxation length of repeated slip steps, their scatter weighed against the stated repeatability."""
    if not steps:
        return None
    values = np.array([step.value for step in steps])
    mean = float(values.mean())
    if values.size == 1:
        sd, dof = combine_uncertainties([(steps[0].sd, steps[0].dof), (repeatability * mean, REPEATABILITY_DOF)])
        return Estimate(mean, sd, dof)
    own = float(np.sqrt(np.mean([step.sd**2 for step in steps])))
    squares, repeats = float(np.sum((values - mean) ** 2)), float(values.size - 1)
    sd, dof = weighed_scatter(float(np.hypot(repeatability * mean, own)), squares, repeats)
    return Estimate(mean, max(sd, own) / np.sqrt(values.size), dof)


@dataclass(frozen=True)
class Agreement:
    """Agreement of routes to the relaxation length: chi^2 about their weighted mean, its degrees of freedom and p."""

    routes: dict[str, Estimate]
    mean: float
    chi2: float
    dof: int
    p_value: float

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        names = ", ".join(f"{name} {1e3 * e.value:.1f} +- {1e3 * e.sd:.1f} mm" for name, e in self.routes.items())
        verdict = "agree" if self.p_value >= 0.05 else "disagree"
        return f"{names}: {verdict} (chi^2 = {self.chi2:.2f}, {self.dof} dof, p = {self.p_value:.3f})"


def agreement(routes: Mapping[str, Estimate]) -> Agreement | None:
    """Test whether independent routes give one relaxation length."""
    if len(routes) < 2:
        return None
    value = np.array([e.value for e in routes.values()])
    # a standard deviation from few repeats is widened to the normal one with the same 95 % interval
    sd = np.array([(e.ci95[1] - e.value) / stats.norm.ppf(0.975) for e in routes.values()])
    weight = 1.0 / sd**2
    mean = float(weight @ value / weight.sum())
    chi2 = float(np.sum(((value - mean) / sd) ** 2))
    dof = value.size - 1
    return Agreement(dict(routes), mean, chi2, dof, float(stats.chi2.sf(chi2, dof)))
