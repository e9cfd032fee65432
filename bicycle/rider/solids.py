"""Mass, centre and inertia of the solids of a body: stadium-shaped slices between two sections (Yeadon 1990).

A stadium is a rectangle 2 t by 2 r with a half disc of radius r at both short sides; r and t vary linearly along the
axis. All integrands are polynomials of degree 4 at most along the axis, so five Gauss points are exact.
"""

import math

import numpy as np

from bicycle.rider.joining import RigidBody
from tyre.base.arrays import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)
POINTS, WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
"""Places from 0 to 1 along the axis, and their weights."""


def stadium_solid(
    *, thickness: tuple[float, float], radius: tuple[float, float], start: Array, end: Array, turn: Array,
    density: float, long_side_forward: bool = False,
) -> RigidBody:  # fmt: skip
    """A solid between two stadia with half lengths t (``thickness``) and radii r at ``start`` and ``end``.

    Parameters
    ----------
    thickness, radius : (float, float)
        m, at both ends.
    start, end : array (3,)
        Centres of both ends, m.
    turn : array (3, 3)
        Columns: the solid's axes, x along the stadium, y across it, z along the axis.
    density : float
        kg/m^3.
    long_side_forward : bool
        True: the stadium's long side lies along y (a foot's heel).
    """
    s = POINTS
    t, r = (pair[0] + s * (pair[1] - pair[0]) for pair in (thickness, radius))
    area = 4 * r * t + math.pi * r**2
    across = 4 * t * r**3 / 3 + math.pi * r**4 / 4
    along = 4 * r * t**3 / 3 + math.pi * r**2 * t**2 + 8 * r**3 * t / 3 + math.pi * r**4 / 4
    spread = (across, along) if long_side_forward else (along, across)
    return _stack(area, *spread, start=start, end=end, turn=turn, density=density)


def half_ellipsoid(*, radius: float, start: Array, end: Array, turn: Array, density: float) -> RigidBody:
    """The vault of a head: a half ellipsoid of revolution on a disc.

    Parameters
    ----------
    radius : float
        Of the disc, m.
    start, end : ndarray, shape (3,)
        Centre of the disc and top of the vault, m.
    turn : ndarray, shape (3, 3)
        Columns: the solid's axes, z along it.
    density : float
        kg/m^3.
    """
    r = radius * np.sqrt(1 - POINTS**2)
    spread = math.pi * r**4 / 4
    return _stack(math.pi * r**2, spread, spread, start=start, end=end, turn=turn, density=density)


def _stack(
    area: Array, spread_x: Array, spread_y: Array, *, start: Array, end: Array, turn: Array, density: float
) -> RigidBody:
    """Sum of slices with area (m^2) and second moments of area along x and y (m^4) at :data:`POINTS`."""
    height = float(np.linalg.norm(end - start))
    weight = density * height * WEIGHTS
    mass = float(weight @ area)
    middle = float(weight @ (area * POINTS)) / mass
    xx, yy = float(weight @ spread_x), float(weight @ spread_y)
    zz = height**2 * float(weight @ (area * (POINTS - middle) ** 2))
    local = np.diag([yy + zz, xx + zz, xx + yy])
    return RigidBody(mass, start + middle * (end - start), turn @ local @ turn.T)
