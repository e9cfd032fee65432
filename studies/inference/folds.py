"""Held-out folds: whole groups, or whole speeds, never part of one; repeats where there is one condition only."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST = 6


def folds(group: Sequence[str], speed: ArrayLike, repeat: Sequence[str]) -> NDArray[np.intp]:
    """Fold of each row: groups in the order of their speed are dealt out in turn to at most six folds.

    Where all rows are of one group, its repeats take the place of groups.
    """
    if len(set(group)) == 1:
        group = repeat
    names = np.asarray(group)
    speeds = np.asarray(speed, float)
    order = sorted(set(group), key=lambda name: (float(speeds[names == name].mean()), name))
    number = {name: k % min(MOST, len(order)) for k, name in enumerate(order)}
    return np.array([number[name] for name in group], np.intp)
