"""Whether the boundaries of a chart are all there: unstable roots counted on a fine grid and beside the curves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from studies.stability_charts.boundary import Boundary
from studies.stability_charts.plane import Plane, lattice
from studies.stability_charts.search import counted, from_points, with_seeds
from tyre.base.arrays import Array

FINE = 101  # points along each axis of the grid that checks
ASIDE = 1e-4  # of the axes: how far to both sides of a curve the roots are counted
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Check:
    """What the count of unstable roots says of the boundaries.

    Attributes
    ----------
    unstable : ndarray of int, shape (k, k)
        Number of unstable roots on the grid.
    told : ndarray of int, shape (k, k)
        The same as the boundaries tell it.
    apart : ndarray of bool, shape (k, k)
        Points of the grid more than a cell from every boundary.
    sides : int
        Points of boundaries on whose two sides the number differs by another amount than it must.
    compared : int
        Points of boundaries at which that was looked at.
    """

    unstable: NDArray[np.intp]
    told: NDArray[np.intp]
    apart: NDArray[np.bool_]
    sides: int
    compared: int

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Points (k, k) more than a cell from every boundary at which the two counts differ."""
        return np.asarray(self.apart & (self.unstable != self.told))

    @property
    def grid(self) -> Array:
        """Shares (k,) of either axis at which roots were counted."""
        return np.linspace(0, 1, len(self.unstable))


def completed(
    plane: Plane, boundaries: Sequence[Boundary], *, step: float, fine: int = FINE
) -> tuple[list[Boundary], Check]:
    """The boundaries, with those that the count of unstable roots tells are missing, and the check of all.

    Parameters
    ----------
    plane : Plane
    boundaries : sequence of Boundary
    step : float
        Longest step along a curve, as a share of the axes.
    fine : int
        Number of points along each axis.
    """
    found, grid = list(boundaries), np.linspace(0, 1, fine)
    points = lattice(grid, grid)
    unstable = plane.unstable(points).reshape(fine, fine)
    for number in range(ROUNDS + 1):
        apart = _apart(found, points, 1 / (fine - 1)).reshape(fine, fine)
        told = _told(found, grid, unstable, apart)
        missing = apart & (told != unstable)
        if not missing.any() or number == ROUNDS:
            break
        more = with_seeds(
            plane, found, from_points(plane, _next_to(unstable, missing, grid), 2 / (fine - 1)), step=step
        )
        if len(more) == len(found):
            break
        found = more
    sides, compared = _sides(plane, found)
    return found, Check(unstable, told, apart, sides, compared)


def _told(
    found: Sequence[Boundary], grid: Array, unstable: NDArray[np.intp], apart: NDArray[np.bool_]
) -> NDArray[np.intp]:
    told = counted(found, grid, grid, 0)
    plain = (unstable - told)[apart] if apart.any() else (unstable - told).ravel()
    values, often = np.unique(plain, return_counts=True)
    return np.asarray(told + values[often.argmax()])


def _apart(found: Sequence[Boundary], points: Array, cell: float) -> NDArray[np.bool_]:
    if not found:
        return np.ones(len(points), bool)
    away, _ = KDTree(np.concatenate([boundary.shares for boundary in found])).query(points)
    return np.asarray(away > 1.5 * cell)


def _next_to(unstable: NDArray[np.intp], missing: NDArray[np.bool_], grid: Array) -> Array:
    """Points (k, 2) of the grid at which the number of unstable roots changes, next to what is not explained."""
    edge = np.zeros_like(missing)
    for axis in (0, 1):
        change = np.diff(unstable, axis=axis) != 0
        low = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        high = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        edge[low] |= change
        edge[high] |= change
    i, j = np.nonzero(edge)
    return np.stack([grid[i], grid[j]], -1)


def _sides(plane: Plane, found: Sequence[Boundary]) -> tuple[int, int]:
    """How many points of boundaries have a difference of counts that no curve through them explains, of how many."""
    wrong = compared = 0
    for boundary in found:
        others = [other.shares for other in found if other is not boundary]
        tree = KDTree(np.concatenate(others)) if others else None
        at = boundary.shares[:: max(1, len(boundary) // 20)]
        normal = boundary.normals[:: max(1, len(boundary) // 20)]
        ends = np.stack([at - ASIDE * normal, at + ASIDE * normal])
        good = ((ends >= 0) & (ends <= 1)).all((0, 2))
        if tree is not None:
            good &= tree.query(at)[0] > 0.01
        if not good.any():
            continue
        counts = plane.unstable(ends[:, good].reshape(-1, 2)).reshape(2, -1)
        wrong += int((counts[1] - counts[0] != boundary.step).sum())
        compared += int(good.sum())
    return wrong, compared
