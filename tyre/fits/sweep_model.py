"""The parameters of a slip-sweep fit: which are free, where they start, their bounds, model and covariance."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tyre.base.errors import InputError
from tyre.fits.noise import correlated_covariance
from tyre.fits.sweep_branches import Blocks
from tyre.fits.sweep_curve import lagged_magic_formula
from tyre.recordings.recording import Channel

NAMES = ("cornering_stiffness", "peak", "shape", "curvature", "shift", "lag", "hysteresis", "offset", "drift")
LOW = np.array([0.2, 0.7, 0.5, -10.0, -0.05, -0.3, -0.02, -5.0, -5.0])
HIGH = np.array([5.0, 6.0, 2.5, 1.0, 0.05, 1.5, 0.02, 5.0, 5.0])
_TWO_RATES = 1.5  # rates in one recording that differ by this factor separate lag from rate-independent hysteresis


def solve_least_squares(
    residual: Callable[[Channel], Channel],
    start: Channel,
    *,
    jacobian: Callable[[Channel], NDArray[np.float64]],
    bounds: tuple[Any, Any] = (-np.inf, np.inf),
    loss: Any = "linear",
    margin: float = 1.0,
    tolerance: float = 1e-14,
) -> Any:
    """Minimise a sum of squares (or of a robust loss): scipy's trust-region reflective solver, run to rounding.

    Parameters
    ----------
    residual : callable
        Parameters (p,) -> residuals (n,).
    start : ndarray, shape (p,)
    jacobian : callable
        Parameters (p,) -> derivatives of the residuals (n, p). Differences would cost the last digits.
    bounds : tuple
        Lower and upper bounds.
    loss : str
        ``linear`` or ``soft_l1``.
    margin : float
        Residual beyond which a robust loss grows linearly.
    tolerance : float
        Relative change of cost, parameters and gradient at which to stop.

    Returns
    -------
    scipy.optimize.OptimizeResult
    """
    return least_squares(
        residual,
        start,
        jac=jacobian,
        bounds=bounds,
        loss=loss,
        f_scale=margin,
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
        max_nfev=400,
    )


def free_parameters(
    blocks: Blocks, lag_correction: bool, relaxation_length: float | None, notes: list[str], where: str
) -> NDArray[np.bool_]:
    rates = blocks.branch_rates[np.unique(blocks.branch[blocks.settled])]
    both = bool((rates > 0.0).any() and (rates < 0.0).any())
    pace = np.abs(rates)
    free = np.ones(9, dtype=bool)
    free[5] = lag_correction and both and relaxation_length is None
    free[6] = lag_correction and both and pace.max() > _TWO_RATES * pace.min()
    free[8] = both and rates.size >= 3
    if relaxation_length is not None and blocks.speed is None:
        raise InputError(f"{where}: a known relaxation length needs the speed; give speed_km_h in the sidecar")
    if not both and relaxation_length is None and lag_correction:
        notes.append("only one direction of sweep: the lag cannot be told from the offset Sh and is not removed")
    return free


def start_values(
    blocks: Blocks, free: NDArray[np.bool_], relaxation_length: float | None, where: str
) -> tuple[float, float, Channel]:
    slip, force = blocks.slip, blocks.force
    near = np.abs(slip) < max(np.deg2rad(1.5), 0.25 * float(np.abs(slip).max()))
    if near.sum() < 5:
        raise InputError(f"{where}: the sweep does not cross zero slip; its slope there cannot be measured")
    slope, level = np.polyfit(slip[near], force[near], 1)
    if slope <= 0.0:
        raise InputError(
            f"{where}: the side force falls with slip ({np.deg2rad(slope):.3g} N/deg after conversion from "
            "the declared axes); check axes = ISO / SAE / adapted SAE"
        )
    scale = float(np.max(np.abs(force - level)))
    start = np.array([1.05, 1.2, 1.3, 0.0, 0.0, 0.0, 0.0, level / scale, 0.0])
    if relaxation_length is not None and blocks.speed is not None:
        start[5] = relaxation_length / blocks.speed
    elif free[5]:
        start[5] = 0.1 / (blocks.speed or 2.5)
    start = np.clip(start, LOW + 1e-6, HIGH - 1e-6)
    return float(slope), scale, start


def sweep_model(
    blocks: Blocks, stiffness: float, force_scale: float
) -> Callable[[Channel], tuple[Channel, NDArray[np.float64]]]:
    used = blocks.settled
    middle = 0.5 * (blocks.time[0] + blocks.time[-1])
    drift = (blocks.time[used] - middle) / (blocks.time[-1] - blocks.time[0])
    direction = np.sign(blocks.rate[used])

    def evaluate(z: Channel) -> tuple[Channel, NDArray[np.float64]]:
        force, part = lagged_magic_formula(
            time=blocks.time[used],
            slip_time=blocks.time,
            slip=blocks.slip,
            direction=direction,
            cornering_stiffness=z[0] * stiffness,
            peak=z[1] * force_scale,
            shape=z[2],
            curvature=z[3],
            shift=z[4],
            lag=z[5],
            hysteresis=z[6],
        )
        part[0] *= stiffness
        part[1] *= force_scale
        offset = np.full_like(drift, force_scale)
        jacobian = np.column_stack([*part, offset, force_scale * drift])
        return force + force_scale * (z[7] + z[8] * drift) - blocks.force[used], jacobian

    return evaluate


def expand(start: Channel, free: NDArray[np.bool_], values: Channel) -> Channel:
    full = start.copy()
    full[free] = values
    return full


def parameter_covariance(
    found: Any, free: NDArray[np.bool_], limits: tuple[Channel, Channel]
) -> tuple[NDArray[np.float64], NDArray[np.bool_], float]:
    """Covariance of all nine parameters, which of the free ones rest on a bound, and the degrees of freedom."""
    low, high = limits
    resting = (found.x - low < 1e-6 * (high - low)) | (high - found.x < 1e-6 * (high - low))
    inner = np.flatnonzero(~resting)
    weight = 1.0 / np.sqrt(1.0 + (found.fun / 3.0) ** 2)  # derivative of the soft L1 loss
    small, dof = correlated_covariance(found.jac[:, inner], weight * found.fun)
    full = np.zeros((9, 9))
    position = np.flatnonzero(free)[inner]
    full[np.ix_(position, position)] = small
    return full, resting, dof
