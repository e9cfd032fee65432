"""Dahl's friction: it approaches its final value exponentially over the distance since the last reversal.

Dahl (1968): dT/dx = (1 - T sgn(dx) / f) f / presliding, for the friction T with final value f.
"""

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array


def dahl_after(state: ArrayLike, *, travel: ArrayLike, direction: ArrayLike, presliding: ArrayLike) -> Array:
    """Friction over its final value after a way in one direction; arguments broadcast.

    Parameters
    ----------
    state : array_like
        Friction over its final value before, -1 to 1.
    travel : array_like
        Distance, m, >= 0.
    direction : array_like
        1 or -1, the sign of the motion; friction here has the sign of the motion, as the force that drives it.
    presliding : array_like
        Distance over which friction builds up, m.
    """
    final = np.asarray(direction, float)
    return np.asarray(final + (np.asarray(state) - final) * np.exp(-np.asarray(travel) / np.asarray(presliding)))


def dahl_friction(displacement: Array, *, presliding: ArrayLike, start: float | None = None) -> Array:
    """Friction over its final value along a path that is followed reading by reading.

    Parameters
    ----------
    displacement : ndarray, shape (n,)
        m.
    presliding : array_like, shape (...)
        m.
    start : float, optional
        Where the path begins without friction, m; by default at the first reading.

    Returns
    -------
    ndarray, shape (..., n)
    """
    reach = np.asarray(presliding, float)
    friction = np.empty((*reach.shape, len(displacement)))
    state = np.zeros(reach.shape)
    steps = np.diff(displacement, prepend=displacement[0] if start is None else start)
    for k, step in enumerate(steps):
        state = dahl_after(state, travel=abs(step), direction=np.copysign(1.0, step), presliding=reach)
        friction[..., k] = state
    return friction
