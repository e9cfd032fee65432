"""Friction that builds up along a way: Dahl's law (1968)."""

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array


def dahl_after(state: ArrayLike, *, travel: ArrayLike, direction: ArrayLike, presliding: ArrayLike) -> Array:
    """Friction over its final value after a way in one direction; arguments broadcast."""
    final = np.asarray(direction, float)
    return np.asarray(final + (np.asarray(state) - final) * np.exp(-np.asarray(travel) / np.asarray(presliding)))


def dahl_friction(displacement: Array, *, presliding: ArrayLike, start: float | None = None) -> Array:
    """Friction over its final value along a path that is followed reading by reading."""
    reach = np.asarray(presliding, float)
    friction = np.empty((*reach.shape, len(displacement)))
    state = np.zeros(reach.shape)
    steps = np.diff(displacement, prepend=displacement[0] if start is None else start)
    for k, step in enumerate(steps):
        state = dahl_after(state, travel=abs(step), direction=np.copysign(1.0, step), presliding=reach)
        friction[..., k] = state
    return friction
