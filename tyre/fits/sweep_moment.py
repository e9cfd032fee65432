"""Aligning moment of a slip sweep: its slope at zero slip and the pneumatic trail."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tyre.fits.sweep_branches import Blocks
from tyre.fits.sweep_curve import CURVE, LAG_NODES, LAG_WEIGHTS, lagged_magic_formula
from tyre.recordings.recording import Channel


@dataclass(frozen=True)
class AligningMoment:
    """Aligning moment about zero slip (adapted SAE, Mz = -t Fy).

    ``pneumatic_trail`` t in m, ``slope`` dMz/d(slip) = -t C_Fy in N m/rad, ``offset`` in N m, ``r_squared`` of the
    block means. Standard deviations are those of the fit; the calibration of the moment cell is not in them.
    """

    pneumatic_trail: float
    pneumatic_trail_sd: float
    slope: float
    offset: float
    r_squared: float


def fit_aligning_moment(
    blocks: Blocks, cornering_stiffness: float, parameters: dict[str, float]
) -> AligningMoment | None:
    """Fit Mz = offset - t F with a trail t = t0 / (1 + (slip / width)^2) that shrinks with slip.

    The side force F is the fitted one without its offset; the slip in t lags like the force does. The form is the
    first terms of the Magic Formula's cosine trail (Pacejka, Tire and Vehicle Dynamics, 3rd ed., eq. 4.E42).

    Parameters
    ----------
    blocks : Blocks
    cornering_stiffness : float
        Fitted C_Fy, N/rad.
    parameters : dict
        Those of the side-force fit (SI), at least ``CURVE`` of :mod:`tyre.fits.sweep_curve`.

    Returns
    -------
    AligningMoment or None
        None where the recording has no aligning moment.
    """
    if blocks.moment is None:
        return None
    used = blocks.settled & np.isfinite(blocks.moment)
    moment = blocks.moment[used]
    force, _ = lagged_magic_formula(
        time=blocks.time[used],
        slip_time=blocks.time,
        slip=blocks.slip,
        direction=np.sign(blocks.rate[used]),
        cornering_stiffness=cornering_stiffness,
        **{name: parameters[name] for name in CURVE},
    )
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
    return AligningMoment(
        pneumatic_trail=trail,
        pneumatic_trail_sd=sd,
        slope=-trail * cornering_stiffness,
        offset=float(found.x[1]),
        r_squared=1.0 - float(left @ left) / total if total > 0.0 else 0.0,
    )
