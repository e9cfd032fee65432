"""Critical speeds: where a root of the model crosses the imaginary axis."""

from importlib.util import find_spec

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.critical.pencil import crossings_by_pencil
from bicycle.eigenvalues.solvers import compiled, default_solver
from bicycle.linear_model import LinearModel
from bicycle.modal.speed_limits import check_trackable
from bicycle.model import Model, as_linear
from tyre.base.errors import InputError
from tyre.base.optional import not_installed


def critical_speeds(
    model: Model | LinearModel, max_speed: float = 60.0, *, fast: bool = False
) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    Parameters
    ----------
    model : Model or LinearModel
        A bicycle with its effects, or its linear model.
    max_speed : float
        m/s.
    fast : bool
        By the kernels for many bicycles (extra ``fast``), the same to 1e-9 m/s: worth it where a program asks for
        hundreds one by one. The first call of a process loads them, the first on a machine compiles them.

    Returns
    -------
    tuple of CriticalSpeed
        :func:`bicycle.critical.critical_speed.identified` tells which is which in another model.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high to be tracked, the model is too stiff, or
        ``fast`` without numba.
    """
    model = as_linear(model)
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")
    found = _by_kernels(model, max_speed) if fast else None
    return crossings_by_pencil(model, max_speed) if found is None else found


def _by_kernels(model: LinearModel, max_speed: float) -> tuple[CriticalSpeed, ...] | None:
    """The same as a batch of one; None where it is not sure, the equations switch, or no kernels can be kept."""
    if not find_spec("numba"):
        raise InputError(not_installed("numba", extra="fast"))
    check_trackable(model, np.array([max_speed]), "max_speed", stiffness=False)
    if len(model.ranges) > 1 or default_solver() is not compiled:
        return None
    from bicycle.critical.batch import critical_speeds_of
    from bicycle.modal.block import Block

    found = critical_speeds_of(Block.of_models([model]), max_speed)
    return None if found.status[0] else found.of(0)
