"""A single bicycle by the kernels for many, where a process asks for so many that loading them pays."""

from functools import cache
from itertools import count
from multiprocessing import parent_process

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed
from bicycle.eigenvalues.solvers import compiled, default_solver
from bicycle.linear_model import LinearModel
from bicycle.modal.speed_limits import check_trackable

CALLS = 40  # the plain path takes as much longer for so many as loading what is compiled already

_asked = count(1)


def crossings_by_kernels(model: LinearModel, max_speed: float) -> tuple[CriticalSpeed, ...] | None:
    """All critical speeds of a model by :mod:`bicycle.critical.batch`; None where it is not at hand or not sure.

    It is at hand where the process has asked for :data:`CALLS` bicycles and the kernels were compiled before: a
    program that asks for one does not wait for them.

    Parameters
    ----------
    model : LinearModel
    max_speed : float
        m/s, > 0.

    Raises
    ------
    InputError
        As by :func:`bicycle.critical.pencil.crossings_by_pencil`.
    """
    if len(model.ranges) > 1 or not _at_hand():
        return None
    from bicycle.critical.batch import critical_speeds_of
    from bicycle.modal.batch import Block

    check_trackable(model, np.array([max_speed]), "max_speed")
    found = critical_speeds_of(Block.of_models([model]), max_speed)
    return None if found.status[0] else found.of(0)


def _at_hand() -> bool:
    if parent_process():  # which worker gets which bicycle is chance, and the last digits must not hang on it
        return False
    number = next(_asked)
    if number % CALLS == 0:  # another process may have compiled them meanwhile
        _compiled_before.cache_clear()
    return number >= CALLS and _compiled_before()


@cache
def _compiled_before() -> bool:
    """Whether numba is there and every kernel needs but be loaded."""
    if default_solver() is not compiled:
        return False
    import bicycle.critical.batch  # noqa: F401  (brings every kernel)
    from bicycle.eigenvalues.compilation import all_kept

    return all_kept()
