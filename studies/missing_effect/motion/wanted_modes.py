"""Which eigenvalue of the model is the measured mode: the nearest, one root for each mode of a speed."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tyre.base.arrays import Array, Complex

OTHER_KIND = 3.0  # a real root stands in for a measured oscillation only where no pair is three times as near


@dataclass(frozen=True, eq=False)
class Crowd:
    """Speeds at which as many ``modes`` are wanted: their points, mode by mode.

    Attributes
    ----------
    modes : int
    points : ndarray, shape (m,)
        Points of one mode at one speed, its repeats, stand together.
    starts : ndarray
        Where each such group begins.
    owner : ndarray, shape (m,)
        Number of the group of each point.
    """

    modes: int
    points: NDArray[np.intp]
    starts: NDArray[np.intp]
    owner: NDArray[np.intp]


@dataclass(frozen=True)
class Wanted:
    """What is to be predicted: at recorded speeds, modes near ``near``."""

    speed: Array
    mode: tuple[str, ...]
    near: Complex

    @cached_property
    def crowded(self) -> tuple[Crowd, ...]:
        """Speeds at which several modes are wanted, those with as many modes together."""
        of_count: dict[int, list[list[list[int]]]] = {}
        for speed in np.unique(self.speed):
            points = np.flatnonzero(self.speed == speed).tolist()
            names = sorted({self.mode[i] for i in points})
            if len(names) > 1:
                groups = [[i for i in points if self.mode[i] == name] for name in names]
                of_count.setdefault(len(names), []).append(groups)
        return tuple(_crowd(modes, [g for groups in speeds for g in groups]) for modes, speeds in of_count.items())


def _crowd(modes: int, groups: list[list[int]]) -> Crowd:
    sizes = [len(group) for group in groups]
    return Crowd(
        modes, np.array([i for group in groups for i in group]), np.cumsum([0, *sizes[:-1]]),
        np.repeat(np.arange(len(groups)), sizes),
    )  # fmt: skip


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
    for crowd in wanted.crowded:
        total = np.add.reduceat(cost[crowd.points], crowd.starts).reshape(-1, crowd.modes, cost.shape[1])
        found[crowd.points] = _assigned(total).ravel()[crowd.owner]
    return np.asarray(found)


def _assigned(cost: Array) -> NDArray[np.intp]:
    """Eigenvalue of each mode (C, modes), no two the same, for least ``cost`` (C, modes, n) at each of C speeds."""
    if cost.shape[1] > 2:
        return np.array([linear_sum_assignment(c)[1] for c in cost])
    both = cost[:, 0, :, None] + cost[:, 1, None, :]
    n = cost.shape[2]
    both[:, np.arange(n), np.arange(n)] = np.inf
    return np.stack(np.divmod(both.reshape(len(cost), -1).argmin(1), n), 1)
