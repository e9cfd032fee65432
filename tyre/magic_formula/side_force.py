"""The Magic Formula of the side force at one vertical load, its slope, and the cornering stiffness it contains.

Dell'Orto et al., eq. (4), after Bakker, Nyborg & Pacejka (1987), SAE 870421; the horizontal shift is Pacejka's.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def normalised_side_force(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    vertical_shift: ArrayLike = 0.0,
    horizontal_shift: ArrayLike = 0.0,
) -> NDArray[np.float64]:
    """Return the side force over the vertical load, Fy/Fz.

    Fy/Fz = D sin{C atan[B x - E (B x - atan(B x))]} + Sv with x = slip angle + Sh.

    Parameters
    ----------
    slip_angle : array_like
        Slip angle, rad; any shape, broadcast against the coefficients.
    stiffness_factor : array_like
        B, 1/rad.
    shape_factor, peak_factor, curvature_factor : array_like
        C, D and E, dimensionless. E <= 1 keeps the curve single-valued in its argument.
    vertical_shift : array_like
        Sv, dimensionless (a force over the vertical load).
    horizontal_shift : array_like
        Sh, rad.

    Returns
    -------
    ndarray
        Fy/Fz, dimensionless, of the broadcast shape; grows with the slip angle for B C D > 0.
    """
    reduced_slip = np.asarray(stiffness_factor) * (np.asarray(slip_angle) + np.asarray(horizontal_shift))
    curved_slip = reduced_slip - np.asarray(curvature_factor) * (reduced_slip - np.arctan(reduced_slip))
    shape = np.asarray(shape_factor)
    return np.asarray(
        np.asarray(peak_factor) * np.sin(shape * np.arctan(curved_slip)) + np.asarray(vertical_shift), dtype=np.float64
    )


def normalised_side_force_slope(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    horizontal_shift: ArrayLike = 0.0,
) -> NDArray[np.float64]:
    """Return d(Fy/Fz)/d(slip angle), 1/rad; arguments as in `normalised_side_force` (Sv does not enter)."""
    stiffness, shape = np.asarray(stiffness_factor), np.asarray(shape_factor)
    curvature = np.asarray(curvature_factor)
    reduced_slip = stiffness * (np.asarray(slip_angle) + np.asarray(horizontal_shift))
    curved_slip = reduced_slip - curvature * (reduced_slip - np.arctan(reduced_slip))
    inner = stiffness * (1 - curvature + curvature / (1 + reduced_slip**2))
    outer = np.asarray(peak_factor) * shape * np.cos(shape * np.arctan(curved_slip))
    return np.asarray(outer * inner / (1 + curved_slip**2), dtype=np.float64)


def cornering_stiffness(
    *, stiffness_factor: ArrayLike, shape_factor: ArrayLike, peak_factor: ArrayLike, vertical_load: ArrayLike
) -> NDArray[np.float64]:
    """Return C_Fy = B C D Fz, N/rad: the slope of Fy where slip angle + Sh = 0.

    The paper's eq. (5) leaves the vertical load out, although B C D is the slope of the normalised force.
    """
    product = np.asarray(stiffness_factor) * np.asarray(shape_factor) * np.asarray(peak_factor)
    return np.asarray(product * np.asarray(vertical_load), dtype=np.float64)
