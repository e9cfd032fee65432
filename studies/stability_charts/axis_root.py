"""A root on the imaginary axis: how far a point is from there, which way, and Newton to it.

Of a pair, the real part counts, with d(lambda) = u dA x for left and right eigenvectors (Lancaster 1964, Numerische
Mathematik 6, 377-387). A real root is zero where the smallest singular value s of A is, and ds = u dA x with singular
vectors: this stays smooth where two real roots are zero at once, while each of them has no derivative there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studies.stability_charts.plane import Look, Plane
from tyre.base.arrays import Array, Complex

MOST_STEPS = 12
CONVERGED = 1e-13  # of the range: a step below this is rounding


class AxisRoot(NamedTuple):
    """What crosses the axis near m points.

    Attributes
    ----------
    root : ndarray, shape (m,)
        1/s.
    gradient : ndarray, shape (m, 2)
        Its derivative with the shares of both axes, 1/s.
    height, uphill : ndarray, shape (m,) and (m, 2)
        What must vanish (1/s), and its derivative; smooth everywhere along the boundary.
    size, rival : ndarray, shape (m,)
        Largest root, and the distance of the nearest other one, 1/s.
    """

    root: Complex
    gradient: Complex
    height: Array
    uphill: Array
    size: Array
    rival: Array


def axis_root(look: Look, expected: Complex, real: NDArray[np.bool_]) -> AxisRoot:
    """The root that is meant at each point.

    Parameters
    ----------
    look : Look
        At m points.
    expected : ndarray of complex, shape (m,)
        Where the root should be, 1/s; of a pair the upper half.
    real : ndarray of bool, shape (m,)
        Whether a real root is meant: the one nearest to zero.
    """
    values, row = look.values, np.arange(len(look.values))
    target = np.where(real, 0.0, expected)
    away = np.abs(values - target[:, None])
    away = np.where(~real[:, None] & (values.imag <= 0), np.inf, away)
    own = np.where(np.isinf(away).all(1), np.abs(values - target[:, None]).argmin(1), away.argmin(1))
    root, gradient = values[row, own], look.gradients[row, own]
    apart = np.abs(values - root[:, None])
    apart[row, own] = np.inf
    height, uphill = root.real.copy(), gradient.real.copy()
    k = np.flatnonzero(real)
    if k.size:
        left, size, right = np.linalg.svd(look.matrices[k])
        u, x = left[:, :, -1], right[:, -1]
        height[k] = size[:, -1]
        uphill[k] = np.einsum("mi,maij,mj->ma", u, look.slopes[k], x)
        joint = (u * x).sum(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            root[k], gradient[k] = size[:, -1] / joint, uphill[k] / joint[:, None]
    return AxisRoot(root, gradient, height, uphill, np.abs(values).max(1), apart.min(1))


class Sharp(NamedTuple):
    """Points (m, 2) on the axis, what crosses there, and which of them Newton reached."""

    shares: Array
    at: AxisRoot
    reached: NDArray[np.bool_]


def sharpened(
    plane: Plane, shares: Array, expected: Complex, real: NDArray[np.bool_], *, longest: float,
    held: NDArray[np.bool_] | None = None,
) -> Sharp:  # fmt: skip
    """Newton from points to the nearest point at which the root that is expected lies on the axis.

    Parameters
    ----------
    plane : Plane
    shares : ndarray, shape (m, 2)
        Where to begin, 0 to 1 along each axis.
    expected : ndarray of complex, shape (m,)
        The root there, 1/s.
    real : ndarray of bool, shape (m,)
        Whether a real root is meant.
    longest : float
        Longest step, as a share of the range.
    held : ndarray of bool, shape (m, 2), optional
        Coordinates that stay as they are; at least one of each point is free.
    """
    u, root = shares.copy(), expected.astype(complex)
    free = np.ones_like(u) if held is None else (~held).astype(float)
    moving = np.arange(len(u))
    for _ in range(MOST_STEPS):
        at = axis_root(plane.look(u[moving]), root[moving], real[moving])
        uphill = at.uphill * free[moving]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step = -at.height[:, None] * uphill / (uphill**2).sum(1, keepdims=True)
        step = np.where(np.isfinite(step), step, 0.0)
        length = np.hypot(*step.T)
        step *= np.minimum(1.0, longest / np.maximum(length, 1e-300))[:, None]
        now = np.clip(u[moving] + step, 0.0, 1.0)
        taken, u[moving] = now - u[moving], now
        root[moving] = at.root + (at.gradient * taken).sum(1)
        moving = moving[np.hypot(*taken.T) > CONVERGED]
        if not moving.size:
            break
    at = axis_root(plane.look(u), root, real)
    steep = np.hypot(*(at.uphill * free).T)
    with np.errstate(divide="ignore", invalid="ignore"):
        left = np.abs(at.height) / steep
    kind = real | (at.root.imag > 0)
    return Sharp(u, at, kind & (left < 1e-9) & (np.abs(at.root.real) < 1e-9 * at.size))
