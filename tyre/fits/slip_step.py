"""From a slip step to the relaxation length: the first-order lag of the side force over travelled distance."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tyre.base.errors import InputError
from tyre.estimate import Estimate
from tyre.fits.lag import first_order_lag
from tyre.fits.noise import correlated_covariance
from tyre.recordings.recording import Channel, Condition, RigRun


@dataclass(frozen=True)
class SlipStepFit:
    """Result of one slip step.

    ``relaxation_length`` in m; ``distance_to_63`` is the model-free distance (m) from the middle of the slip step to
    63 % of the force change, None where it cannot be read; ``force_change`` in N.
    """

    condition: Condition
    source: Path | None
    relaxation_length: Estimate
    distance_to_63: float | None
    force_change: float
    r_squared: float
    residual_sd: float
    notes: tuple[str, ...]


def is_slip_step(run: RigRun) -> bool:
    """Whether a recording is a slip step: declared as one, or slip rests at two levels for most of the time.

    Parameters
    ----------
    run : RigRun
    """
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

    Parameters
    ----------
    run : RigRun
        Slip at one level, then at another; needs the speed, in a channel or in the condition.

    Returns
    -------
    SlipStepFit

    Raises
    ------
    InputError
        Without a speed, without a step, or when the recording ends before three relaxation lengths.
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

    def lagged(length: float) -> Channel:
        return first_order_lag(u, step=step / length)

    def residual(z: Channel) -> Channel:
        return z[0] + z[1] * lagged(float(np.exp(z[2]))) - force

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
    return SlipStepFit(
        condition=run.condition,
        source=run.source,
        relaxation_length=Estimate(length, sd, dof),
        distance_to_63=_crossing(distance, force, float(found.x[0]), float(found.x[1]), middle),
        force_change=float(found.x[1]),
        r_squared=1.0 - float(left @ left) / total,
        residual_sd=float(np.std(left)),
        notes=run.notes,
    )


def complete_samples(run: RigRun) -> NDArray[np.bool_]:
    """Which samples of a slip step are fitted: those that lack nothing.

    Parameters
    ----------
    run : RigRun

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    valid = np.isfinite(run.side_force) & np.isfinite(run.slip_angle) & np.isfinite(run.time)
    return valid if run.speed is None else valid & np.isfinite(run.speed)


def _over_distance(run: RigRun, where: str) -> tuple[Channel, Channel, Channel]:
    valid = complete_samples(run)
    if valid.sum() < 50:
        raise InputError(
            f"{where}: {int(valid.sum())} complete samples are too few for a slip step; at least 50 are needed"
        )
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


def _crossing(distance: Channel, force: Channel, level: float, change: float, middle: float) -> float | None:
    """Distance from ``middle`` to where the smoothed force first passes 63.2 % of its change."""
    width = max(1, distance.size // 200) * 2 + 1
    smooth = np.convolve(np.pad(force, width // 2, mode="edge"), np.ones(width) / width, mode="valid")
    passed = np.flatnonzero(((smooth - level) / change > 1.0 - np.exp(-1.0)) & (distance > middle))
    return float(distance[passed[0]] - middle) if passed.size else None
