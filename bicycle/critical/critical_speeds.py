"""Critical speeds: where a root of the model crosses the imaginary axis."""

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.pencil import crossings_by_pencil
from bicycle.critical.single import crossings_by_kernels
from bicycle.linear_model import LinearModel
from bicycle.model import Model, as_linear
from tyre.base.errors import InputError


def critical_speeds(model: Model | LinearModel, max_speed: float = 60.0) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    A program that asks for many bicycles one by one soon gets them from the compiled kernels (extra ``fast``), the
    same to 1e-9 m/s and faster.

    Parameters
    ----------
    model : Model or LinearModel
        A bicycle with its effects, or its linear model.
    max_speed : float
        m/s.

    Returns
    -------
    tuple of CriticalSpeed
        :func:`bicycle.critical.critical_speed.identified` tells which is which in another model.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high to be tracked, or the model is too stiff.
    """
    model = as_linear(model)
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")
    found = crossings_by_kernels(model, max_speed)
    return crossings_by_pencil(model, max_speed) if found is None else found
