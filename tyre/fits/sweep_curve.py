"""The side-force curve of a sweep: a Magic Formula whose slope at zero slip is a parameter, seen through the lag."""

import numpy as np
from numpy.typing import NDArray

from tyre.magic_formula import side_force
from tyre.recordings.recording import Channel

# Two-point Gauss-Laguerre rule: the mean over an exponentially fading past, exact for a cubic history.
LAG_NODES = np.array([2.0 - np.sqrt(2.0), 2.0 + np.sqrt(2.0)])
LAG_WEIGHTS = np.array([2.0 + np.sqrt(2.0), 2.0 - np.sqrt(2.0)]) / 4.0

CURVE = ("peak", "shape", "curvature", "horizontal_shift", "lag", "hysteresis")
"""Parameters of a fitted sweep that :func:`lagged_magic_formula` takes beside the cornering stiffness."""


def magic_formula(
    *, slip: Channel, cornering_stiffness: float, peak: float, shape: float, curvature: float
) -> tuple[Channel, NDArray[np.float64]]:
    """Magic Formula in terms of its slope at zero, with derivatives.

    That of :mod:`tyre.magic_formula.side_force` with B = cornering_stiffness / (C D), in newtons (Dell'Orto et
    al., eqs. 4 and 5).

    Parameters
    ----------
    slip : ndarray, shape (n,)
        x, rad, measured from the curve's own centre.
    cornering_stiffness : float
        dF/dx at x = 0, N/rad.
    peak, shape, curvature : float
        D in N, C and E without unit.

    Returns
    -------
    force : ndarray, shape (n,)
        N.
    derivatives : ndarray, shape (5, n)
        With respect to slip, cornering stiffness, peak, shape, curvature.
    """
    u = cornering_stiffness / (shape * peak) * slip
    curve = side_force.magic_formula_derivatives(u, shape_factor=shape, curvature_factor=curvature)
    derivatives = np.stack(
        [
            curve.by_slip * cornering_stiffness / shape,
            curve.by_slip * slip / shape,
            curve.value - curve.by_slip * u,
            peak * (curve.by_shape - curve.by_slip * u / shape),
            peak * curve.by_curvature,
        ]
    )
    return peak * curve.value, derivatives


def lagged_magic_formula(
    *,
    time: Channel,
    slip_time: Channel,
    slip: Channel,
    direction: Channel,
    cornering_stiffness: float,
    peak: float,
    shape: float,
    curvature: float,
    horizontal_shift: float,
    lag: float,
    hysteresis: float,
) -> tuple[Channel, NDArray[np.float64]]:
    """Side force that follows the steady curve with a first-order lag, (lag) dF/dt + F = F_steady(slip).

    Its solution is the mean of F_steady over the past slip with weight exp(-t / lag), taken by two-point
    Gauss-Laguerre quadrature along the recorded slip history.

    Parameters
    ----------
    time, direction : ndarray, shape (n,)
        Instants at which the force is wanted (s) and the sign of d(slip)/dt there.
    slip_time, slip : ndarray, shape (m,)
        The slip history: s, rad.
    cornering_stiffness, peak, shape, curvature : float
        As :func:`magic_formula`.
    horizontal_shift : float
        Sh, rad: the curve's argument is slip + Sh.
    lag : float
        Relaxation length over speed, s.
    hysteresis : float
        Rate-independent half gap between the branches, rad of slip.

    Returns
    -------
    force : ndarray, shape (n,)
    derivatives : ndarray, shape (7, n)
        With respect to cornering stiffness, peak, shape, curvature, horizontal_shift, lag, hysteresis.
    """
    force = np.zeros_like(time)
    derivatives = np.zeros((7, time.size))
    pace = np.gradient(slip, slip_time)
    for node, weight in zip(LAG_NODES, LAG_WEIGHTS, strict=True):
        past = time - lag * node
        x = np.interp(past, slip_time, slip) + horizontal_shift - hysteresis * direction
        value, part = magic_formula(
            slip=x, cornering_stiffness=cornering_stiffness, peak=peak, shape=shape, curvature=curvature
        )
        force += weight * value
        derivatives[:4] += weight * part[1:]
        derivatives[4] += weight * part[0]
        derivatives[5] -= weight * node * part[0] * np.interp(past, slip_time, pace)
        derivatives[6] -= weight * part[0] * direction
    return force, derivatives
