"""The Magic Formula, its derivatives, and the normalised side force of a tyre at one vertical load.

y = D sin{C atan[B x - E (B x - atan(B x))]}: Bakker, Nyborg & Pacejka (1987), SAE 870421; Dell'Orto et al., eq. (4).
Every force and moment of velotyre that bends with slip is this curve; only the blind test of `velotyre blind-test`
writes its own, to be independent.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array


class Curve(NamedTuple):
    """The Magic Formula of unit peak and its derivatives, each of the broadcast shape, dimensionless.

    ``by_slip`` is with respect to the reduced slip u = B x, ``by_shape`` to C, ``by_curvature`` to E.
    """

    value: Array
    by_slip: Array
    by_shape: Array
    by_curvature: Array


def magic_formula(reduced_slip: ArrayLike, *, shape_factor: ArrayLike, curvature_factor: ArrayLike) -> Array:
    """Return sin{C atan[u - E (u - atan u)]}, the Magic Formula of unit peak.

    Parameters
    ----------
    reduced_slip : array_like
        u = B x, dimensionless; any shape, broadcast against the factors.
    shape_factor, curvature_factor : array_like
        C and E, dimensionless. E <= 1 keeps the curve single-valued in its argument.

    Returns
    -------
    ndarray
        Dimensionless, of the broadcast shape; its slope at u = 0 is C.
    """
    return np.sin(np.asarray(shape_factor) * np.arctan(_bent(np.asarray(reduced_slip), curvature_factor)))


def magic_formula_derivatives(
    reduced_slip: ArrayLike, *, shape_factor: ArrayLike, curvature_factor: ArrayLike
) -> Curve:
    """Return the Magic Formula of unit peak with its derivatives; arguments as in `magic_formula`.

    Parameters
    ----------
    reduced_slip, shape_factor, curvature_factor : array_like
        u = B x, C and E, dimensionless, broadcast.

    Returns
    -------
    Curve
    """
    u, shape = np.asarray(reduced_slip), np.asarray(shape_factor)
    bent = _bent(u, curvature_factor)
    angle = np.arctan(bent)
    cosine = np.cos(shape * angle)
    by_bent = shape * cosine / (1 + bent * bent)
    return Curve(
        np.sin(shape * angle),
        by_bent * (1 - np.asarray(curvature_factor) * u * u / (1 + u * u)),
        angle * cosine,
        by_bent * (np.arctan(u) - u),
    )


def normalised_side_force(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    vertical_shift: ArrayLike = 0.0,
    horizontal_shift: ArrayLike = 0.0,
) -> Array:
    """Return the side force over the vertical load, Fy/Fz.

    Fy/Fz = D sin{C atan[B x - E (B x - atan(B x))]} + Sv with x = slip angle + Sh (the horizontal shift is Pacejka's).

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
    curve = magic_formula(
        np.asarray(stiffness_factor) * (np.asarray(slip_angle) + np.asarray(horizontal_shift)),
        shape_factor=shape_factor, curvature_factor=curvature_factor,
    )  # fmt: skip
    return np.asarray(np.asarray(peak_factor) * curve + np.asarray(vertical_shift), dtype=np.float64)


def normalised_side_force_slope(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    horizontal_shift: ArrayLike = 0.0,
) -> Array:
    """Return d(Fy/Fz)/d(slip angle); Sv does not enter.

    Parameters
    ----------
    slip_angle : array_like
        Slip angle, rad.
    stiffness_factor : array_like
        B, 1/rad.
    shape_factor, peak_factor, curvature_factor : array_like
        C, D and E, dimensionless.
    horizontal_shift : array_like
        Sh, rad.

    Returns
    -------
    ndarray
        1/rad, of the broadcast shape.
    """
    curve = magic_formula_derivatives(
        np.asarray(stiffness_factor) * (np.asarray(slip_angle) + np.asarray(horizontal_shift)),
        shape_factor=shape_factor, curvature_factor=curvature_factor,
    )  # fmt: skip
    return np.asarray(np.asarray(peak_factor) * np.asarray(stiffness_factor) * curve.by_slip, dtype=np.float64)


def cornering_stiffness(
    *, stiffness_factor: ArrayLike, shape_factor: ArrayLike, peak_factor: ArrayLike, vertical_load: ArrayLike
) -> Array:
    """Return C_Fy = B C D Fz: the slope of Fy where slip angle + Sh = 0.

    The paper's eq. (5) leaves the vertical load out, although B C D is the slope of the normalised force.

    Parameters
    ----------
    stiffness_factor : array_like
        B, 1/rad.
    shape_factor, peak_factor : array_like
        C and D, dimensionless.
    vertical_load : array_like
        Fz, N.

    Returns
    -------
    ndarray
        N/rad, of the broadcast shape.
    """
    product = np.asarray(stiffness_factor) * np.asarray(shape_factor) * np.asarray(peak_factor)
    return np.asarray(product * np.asarray(vertical_load), dtype=np.float64)


def _bent(u: Array, curvature: ArrayLike) -> Array:
    return np.asarray(u - np.asarray(curvature) * (u - np.arctan(u)))
