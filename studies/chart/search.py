"""Every boundary of a chart: seeds from a grid of roots, curves through them, a count that tells what is missing."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from studies.chart.curve import SLOW, SMALLEST, Boundary, Seed, sharpen, trace
from studies.chart.plane import NOISE, Plane, lattice
from tyre.ground.arrays import Array

GRID = 33  # points along each axis, from whose roots boundaries are looked for
REACH = 1.5  # cells: a root is looked after if it might lie on the axis so near
INSIDE = 1e-6  # of the axes: a line along the edge of the chart is taken so far inside, where curves end
SAME = 0.1  # of a step: a seed so near to a curve lies on it


def from_points(plane: Plane, points: Array, reach: float) -> list[Seed]:
    """Points on boundaries to which Newton leads from the roots at some points."""
    look = plane.look(points)
    steep = np.hypot(look.gradients[..., 0].real, look.gradients[..., 1].real)
    size = np.abs(look.values).max(1, keepdims=True)
    away = np.abs(look.values.real) / np.maximum(steep, 1e-300)
    k, i = np.nonzero((look.values.imag >= 0) & (away <= reach) & (steep > NOISE * size))
    if not k.size:
        return []
    order = np.argsort(away[k, i], kind="stable")
    k, i = k[order], i[order]
    real = look.values[k, i].imag == 0
    found = sharpen(plane, points[k], look.values[k, i], real, longest=reach)
    kept: list[Seed] = []
    seen: set[tuple[object, ...]] = set()
    for m in np.flatnonzero(found.reached):
        gradient = found.at.gradient[m]
        cell = np.round(found.shares[m] * 4 / reach).astype(int).tolist()
        key = (*cell, round(abs(found.at.root[m].imag), 1), bool(real[m]), *(gradient.real > 0).tolist())
        if key not in seen and np.hypot(*gradient.real) > NOISE * found.at.size[m]:
            seen.add(key)
            kept.append(Seed(found.shares[m], 0j if real[m] else complex(found.at.root[m]), bool(real[m]), gradient))
    return kept


def all_boundaries(plane: Plane, *, step: float) -> list[Boundary]:
    """The boundaries to which Newton leads from roots of a grid that may lie on the axis within the next cell."""
    found = from_points(plane, lattice(*[np.linspace(0, 1, GRID)] * 2), REACH / (GRID - 1))
    return with_seeds(plane, [], found, step=step)


def with_seeds(plane: Plane, known: Sequence[Boundary], found: Iterable[Seed], *, step: float) -> list[Boundary]:
    """The boundaries that are known and those through further seeds."""
    linear = plane.space.linear
    slow = SLOW * float(np.sqrt(linear.parameters["g"] / linear.parameters["w"]))
    boundaries = list(known)
    for seed in found:
        alike = (boundary for boundary in boundaries if boundary.real == seed.real)
        if not any(one.passes(seed.shares, seed.root, seed.normal, SAME * step) for one in alike):
            traced = trace(plane, seed, step=step, slow=slow)
            way = np.ptp(traced.shares[[0, -1]], axis=0) if len(traced) > 1 else np.zeros(2)
            if traced.closed or way.max() > SMALLEST:  # what ends where it began at the edge went back
                boundaries.append(traced)
    return boundaries


def count_unstable(boundaries: Sequence[Boundary], first: Array, second: Array, start: int) -> NDArray[np.intp]:
    """Count unstable roots (k, l) on a grid: ``start`` at its first point, and what crosses at each boundary."""
    along = np.zeros((len(first) + 1, len(second)), np.intp)
    side = np.zeros(len(second) + 1, np.intp)
    for boundary in boundaries:
        pieces = boundary.segments
        at, line, sign = _crossings(*pieces, second, 1)
        np.add.at(along, (np.searchsorted(first, at), line), sign * boundary.step)
        at, _, sign = _crossings(*pieces, first[:1], 0)
        np.add.at(side, np.searchsorted(second, at), sign * boundary.step)
    rows, column = np.cumsum(along, 0)[:-1], np.cumsum(side)[:-1]
    return np.asarray(start + rows - rows[:1] + column - column[0])


def _crossings(
    begin: Array, end: Array, left: NDArray[np.bool_], lines: Array, axis: int
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Crossings of pieces and lines of constant coordinate ``axis``: the other coordinate, line, and change."""
    lines = np.clip(lines, INSIDE, 1 - INSIDE)
    low, high = np.minimum(begin[:, axis], end[:, axis]), np.maximum(begin[:, axis], end[:, axis])
    from_, to = np.searchsorted(lines, low, side="left"), np.searchsorted(lines, high, side="left")
    count = to - from_
    piece = np.repeat(np.arange(len(begin)), count)
    line = np.repeat(from_, count) + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    along = end - begin
    t = (lines[line] - begin[piece, axis]) / along[piece, axis]
    other = 1 - axis
    at = begin[piece, other] + t * along[piece, other]
    # left of a piece along (dx, dy) is (-dy, dx); rising in the other coordinate leads to the left where that is > 0
    to_left = (-along[piece, 1] if other == 0 else along[piece, 0]) > 0
    return at, line, np.where(to_left == left[piece], 1, -1)


ASIDE = 1e-4  # of the axes: how far to both sides of a curve the roots are counted
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Check:
    """Unstable roots on a grid: counted, and as the boundaries tell them at points ``apart`` from every boundary."""

    unstable: NDArray[np.intp]  # (k, k), number of unstable roots, counted
    told: NDArray[np.intp]  # (k, k), the same number as it follows from the boundaries crossed
    apart: NDArray[np.bool_]  # (k, k), True: more than a cell from every boundary
    sides: int  # points of boundaries whose two sides do not differ by the roots that cross there
    compared: int  # points of boundaries whose two sides were counted

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Points (k, k) more than a cell from every boundary at which the two counts differ."""
        return np.asarray(self.apart & (self.unstable != self.told))

    @property
    def grid(self) -> Array:
        """Shares (k,) of either axis at which roots were counted."""
        return np.linspace(0, 1, len(self.unstable))


def complete_boundaries(
    plane: Plane, boundaries: Sequence[Boundary], *, step: float, fine: int = 101
) -> tuple[list[Boundary], Check]:
    """Add the boundaries that the count of unstable roots on a ``fine`` grid shows to be missing, and check all."""
    found, grid = list(boundaries), np.linspace(0, 1, fine)
    points = lattice(grid, grid)
    unstable = plane.unstable(points).reshape(fine, fine)
    for number in range(ROUNDS + 1):
        away = np.full(len(points), np.inf)
        if found:
            away = scipy.spatial.KDTree(np.concatenate([boundary.shares for boundary in found])).query(points)[0]
        apart = (away > 1.5 / (fine - 1)).reshape(fine, fine)
        told = count_unstable(found, grid, grid, 0)
        values, often = np.unique((unstable - told)[apart if apart.any() else ...], return_counts=True)
        told = told + values[often.argmax()]
        missing = apart & (told != unstable)
        if not missing.any() or number == ROUNDS:
            break
        # where the count changes from a point to one beside it
        edge = scipy.ndimage.morphological_gradient(unstable, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]]).ravel() > 0
        more = with_seeds(plane, found, from_points(plane, points[edge], 2 / (fine - 1)), step=step)
        if len(more) == len(found):
            break
        found = more
    sides, compared = _sides(plane, found)
    return found, Check(unstable, told, apart, sides, compared)


def _sides(plane: Plane, found: Sequence[Boundary]) -> tuple[int, int]:
    """Number of points of boundaries with a difference of counts that no curve explains, and of those compared."""
    wrong = compared = 0
    for boundary in found:
        others = [other.shares for other in found if other is not boundary]
        at = boundary.shares[:: max(1, len(boundary) // 20)]
        normal = boundary.normals[:: max(1, len(boundary) // 20)]
        ends = np.stack([at - ASIDE * normal, at + ASIDE * normal])
        good = ((ends >= 0) & (ends <= 1)).all((0, 2))
        if others:
            good &= scipy.spatial.KDTree(np.concatenate(others)).query(at)[0] > 0.01
        if not good.any():
            continue
        counts = plane.unstable(ends[:, good].reshape(-1, 2)).reshape(2, -1)
        wrong += int((counts[1] - counts[0] != boundary.step).sum())
        compared += int(good.sum())
    return wrong, compared
