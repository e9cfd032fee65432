"""Held-out folds: whole groups, or whole conditions, never part of one; repeats where there is one condition only."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

MOST_FOLDS = 6


def folds(group: Sequence[str], place: ArrayLike, repeat: Sequence[str]) -> NDArray[np.intp]:
    """Fold of each row: groups in the order of their place are dealt out in turn to at most six folds.

    Where all rows are of one group, its repeats take the place of groups.

    Parameters
    ----------
    group : sequence of str, length n
        Rows of one group are held out together.
    place : array_like, shape (n,)
        The speed, or whatever the rows stand over, in any unit: neighbours go to different folds.
    repeat : sequence of str, length n
        Names of the repeats.

    Returns
    -------
    ndarray of int, shape (n,)
        From 0.
    """
    if len(set(group)) == 1:
        group = repeat
    names = np.asarray(group)
    places = np.asarray(place, float)
    order = sorted(set(group), key=lambda name: (float(places[names == name].mean()), name))
    number = {name: k % min(MOST_FOLDS, len(order)) for k, name in enumerate(order)}
    return np.array([number[name] for name in group], np.intp)
