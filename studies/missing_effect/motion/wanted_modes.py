"""Which eigenvalue of the model is the measured mode: the nearest, one root for each mode of a speed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tyre.base.arrays import Array, Complex

OTHER_KIND = 3.0  # a real root stands in for a measured oscillation only where no pair is three times as near


@dataclass(frozen=True)
class Wanted:
    """What is to be predicted: at recorded speeds, modes near ``near``."""

    speed: Array
    mode: tuple[str, ...]
    near: Complex

    @cached_property
    def crowded(self) -> tuple[list[int], ...]:
        """Points of each speed at which several modes are wanted."""
        found = []
        for speed in np.unique(self.speed):
            points = np.flatnonzero(self.speed == speed).tolist()
            if len({self.mode[i] for i in points}) > 1:
                found.append(points)
        return tuple(found)


def root_of(wanted: Wanted, speeds: Array, values: Complex) -> NDArray[np.intp]:
    """Index (m,) of the eigenvalue that each wanted mode is: the nearest, one root for each mode of a speed.

    Parameters
    ----------
    wanted : Wanted
        m modes.
    speeds : ndarray, shape (S,)
        m/s, sorted.
    values : ndarray, shape (S, n)
        Eigenvalues, 1/s.
    """
    at = np.searchsorted(speeds, wanted.speed)
    near, here = wanted.near[:, None], values[at]
    cost = np.abs(here - near)
    oscillates = np.abs(here.imag) > 1e-9 * np.abs(here).max(1, keepdims=True)
    cost[oscillates != (np.abs(near.imag) > 1e-6 * np.abs(near))] *= OTHER_KIND
    cost[here.imag < 0] = 1e6
    found = cost.argmin(1)
    for points in wanted.crowded:
        names = sorted({wanted.mode[i] for i in points})
        total = np.array([np.sum([cost[i] for i in points if wanted.mode[i] == name], axis=0) for name in names])
        chosen = dict(zip(names, linear_sum_assignment(total)[1], strict=True))
        found[points] = [chosen[wanted.mode[i]] for i in points]
    return np.asarray(found)
