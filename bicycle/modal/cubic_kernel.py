"""Hermite's cubic of a step, compiled: its values and how far it reaches. Needs numba (extra ``fast``)."""

import math

from bicycle.eigenvalues.compilation import compiled_within


@compiled_within
def hermite(a: float, b: float, rise_a: float, rise_b: float, s: float) -> float:
    """Cubic of s in 0..1 with these ends and slopes.

    Parameters
    ----------
    a, b : float
        At 0 and 1, in any unit.
    rise_a, rise_b : float
        Slopes there, in the same unit.
    s : float
        No unit.
    """
    return (1 + 2 * s) * (1 - s) ** 2 * a + s**2 * (3 - 2 * s) * b + s * (1 - s) * ((1 - s) * rise_a - s * rise_b)


@compiled_within
def reach(a: float, z: float, rise_a: float, rise_z: float) -> tuple[float, float]:
    """Smallest and largest value of the cubic of :func:`hermite` between its ends.

    Parameters
    ----------
    a, z, rise_a, rise_z : float
        Ends and slopes, in any unit.
    """
    square, cube = 3.0 * (z - a) - 2.0 * rise_a - rise_z, rise_a + rise_z - 2.0 * (z - a)
    least, most = min(a, z), max(a, z)
    under = square * square - 3.0 * cube * rise_a
    if under >= 0.0:
        for sign in (-1.0, 1.0):
            below = square + sign * math.sqrt(under)
            s = -rise_a / below if below != 0.0 else -1.0
            if 0.0 < s < 1.0:
                value = hermite(a, z, rise_a, rise_z, s)
                least, most = min(least, value), max(most, value)
    return least, most


@compiled_within
def miss(a: float, z: float, rise_a: float, rise_z: float) -> float:
    """How far what both ends foretell for the middle differs.

    Parameters
    ----------
    a, z, rise_a, rise_z : float
        Ends and slopes, in any unit.
    """
    return abs(a + 0.5 * rise_a - z + 0.5 * rise_z)
