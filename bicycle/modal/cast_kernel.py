"""Which mode plays which role, compiled: the assignment of :mod:`bicycle.modal.cast` and whether it is clear."""

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled_within
from bicycle.modal.cast import FAINT, MARGIN
from tyre.base.arrays import Array


@compiled_within
def cast(mean: Array, weight: Array, given: NDArray[np.int64]) -> bool:
    """Give each mode a role or -1; False where it is not clear by a margin.

    Parameters
    ----------
    mean : ndarray, shape (roles, modes)
        Share of each role in each mode.
    weight : ndarray, shape (roles,)
        What it counts.
    given : ndarray of int, shape (modes,)
        Filled in: number of the role.
    """
    played, modes = mean.shape
    worth, other = np.zeros((played, modes)), np.empty(modes, np.int64)
    whole = _best(mean, weight, FAINT, worth, given)
    for least in (FAINT / (1 + MARGIN), FAINT * (1 + MARGIN)):
        _best(mean, weight, least, worth, other)
        for mode in range(modes):
            if other[mode] != given[mode]:
                return False
    _best(mean, weight, FAINT, worth, other)
    for mode in range(modes):
        if given[mode] >= 0:
            kept = worth[given[mode], mode]
            worth[given[mode], mode] = 0.0
            if not _assign(worth, other) < (1 - MARGIN) * whole:
                return False
            worth[given[mode], mode] = kept
    return True


@compiled_within
def _best(mean: Array, weight: Array, least: float, worth: Array, given: NDArray[np.int64]) -> float:
    for p in range(mean.shape[0]):
        for mode in range(mean.shape[1]):
            worth[p, mode] = weight[p] * mean[p, mode] if mean[p, mode] >= least else 0.0
    return _assign(worth, given)


@compiled_within
def _assign(worth: Array, given: NDArray[np.int64]) -> float:
    """Largest sum of one entry a row and a column, over all sets of columns row by row; which, -1 for none."""
    played, modes = worth.shape
    sets = 1 << modes
    best, choice = np.zeros((played + 1, sets)), np.full((played, sets), -1)
    for p in range(played):
        for used in range(sets):
            best[p + 1, used] = best[p, used]
            for mode in range(modes):
                if (used >> mode) & 1 and worth[p, mode] > 0.0:
                    total = best[p, used & ~(1 << mode)] + worth[p, mode]
                    if total > best[p + 1, used]:
                        best[p + 1, used], choice[p, used] = total, mode
    given[:] = -1
    used = sets - 1
    for p in range(played - 1, -1, -1):
        mode = choice[p, used]
        if mode >= 0:
            given[mode] = p
            used &= ~(1 << mode)
    return float(best[played, sets - 1])
