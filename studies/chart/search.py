"""Every boundary of a chart: seeds from a grid of roots, curves through them, a count that shows what is missing."""

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


def find_seeds(plane: Plane, points: Array, reach: float) -> list[Seed]:
    """Find points on boundaries by Newton from those roots at ``points`` (m, 2) that may cross within ``reach``.

    Both in shares of the axes; of seeds that are close together with the same root one is kept.
    """
    look = plane.look(points)
    steep = np.hypot(look.gradients[..., 0].real, look.gradients[..., 1].real)
    size = np.abs(look.values).max(1, keepdims=True)
    distance = np.abs(look.values.real) / np.maximum(steep, 1e-300)
    k, i = np.nonzero((look.values.imag >= 0) & (distance <= reach) & (steep > NOISE * size))
    if not k.size:
        return []
    order = np.argsort(distance[k, i], kind="stable")
    k, i = k[order], i[order]
    real = look.values[k, i].imag == 0
    sharp = sharpen(plane, points[k], look.values[k, i], real, longest=reach)
    seeds: list[Seed] = []
    seen: set[tuple[object, ...]] = set()
    for m in np.flatnonzero(sharp.reached):
        gradient = sharp.at.gradient[m]
        cell = np.round(sharp.shares[m] * 4 / reach).astype(int).tolist()
        key = (*cell, round(abs(sharp.at.root[m].imag), 1), bool(real[m]), *(gradient.real > 0).tolist())
        if key not in seen and np.hypot(*gradient.real) > NOISE * sharp.at.size[m]:
            seen.add(key)
            seeds.append(Seed(sharp.shares[m], 0j if real[m] else complex(sharp.at.root[m]), bool(real[m]), gradient))
    return seeds


def all_boundaries(plane: Plane, *, step: float) -> list[Boundary]:
    """Trace the boundaries through all seeds that a grid of points leads to, in steps of at most ``step`` (shares)."""
    seeds = find_seeds(plane, lattice(*[np.linspace(0, 1, GRID)] * 2), REACH / (GRID - 1))
    return add_boundaries(plane, [], seeds, step=step)


def add_boundaries(
    plane: Plane, boundaries: Sequence[Boundary], seeds: Iterable[Seed], *, step: float
) -> list[Boundary]:
    """Trace the boundaries through ``seeds`` that lie on none of ``boundaries``; return these with the new ones."""
    linear = plane.space.linear
    slow = SLOW * float(np.sqrt(linear.parameters["g"] / linear.parameters["w"]))
    all_traced = list(boundaries)
    for seed in seeds:
        alike = (boundary for boundary in all_traced if boundary.real == seed.real)
        if not any(boundary.passes(seed.shares, seed.root, seed.normal, SAME * step) for boundary in alike):
            traced = trace(plane, seed, step=step, slow=slow)
            way = np.ptp(traced.shares[[0, -1]], axis=0) if len(traced) > 1 else np.zeros(2)
            if traced.closed or way.max() > SMALLEST:  # what ends where it began at the edge went back
                all_traced.append(traced)
    return all_traced


def count_unstable(boundaries: Sequence[Boundary], first: Array, second: Array, start: int) -> NDArray[np.intp]:
    """Count unstable roots (k, l) on a grid: ``start`` at its first point, and what crosses at each boundary."""
    change_along = np.zeros((len(first) + 1, len(second)), np.intp)
    change_aside = np.zeros(len(second) + 1, np.intp)
    for boundary in boundaries:
        pieces = boundary.segments
        at, line, sign = _crossings(*pieces, second, 1)
        np.add.at(change_along, (np.searchsorted(first, at), line), sign * boundary.step)
        at, _, sign = _crossings(*pieces, first[:1], 0)
        np.add.at(change_aside, np.searchsorted(second, at), sign * boundary.step)
    rows, column = np.cumsum(change_along, 0)[:-1], np.cumsum(change_aside)[:-1]
    return np.asarray(start + rows - rows[:1] + column - column[0])


def _crossings(
    begin: Array, end: Array, unstable_left: NDArray[np.bool_], lines: Array, axis: int
) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Cross pieces with lines of constant coordinate ``axis``; return for each crossing the other coordinate, the line,
    and 1 or -1: whether unstable roots are gained or lost as that coordinate rises.

    ``begin`` and ``end`` (m, 2) are of the pieces, in shares; ``unstable_left`` (m,) says where their unstable side is.
    """
    lines = np.clip(lines, INSIDE, 1 - INSIDE)
    first_line = np.searchsorted(lines, np.minimum(begin[:, axis], end[:, axis]), side="left")
    end_line = np.searchsorted(lines, np.maximum(begin[:, axis], end[:, axis]), side="left")
    count = end_line - first_line
    piece = np.repeat(np.arange(len(begin)), count)
    line = np.repeat(first_line, count) + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    direction = end - begin
    t = (lines[line] - begin[piece, axis]) / direction[piece, axis]
    across = 1 - axis
    at = begin[piece, across] + t * direction[piece, across]
    # left of a piece along (dx, dy) is (-dy, dx); rising in the other coordinate leads to the left where that is > 0
    to_left = (-direction[piece, 1] if across == 0 else direction[piece, 0]) > 0
    return at, line, np.where(to_left == unstable_left[piece], 1, -1)


ASIDE = 1e-4  # of the axes: how far to both sides of a curve the roots are counted
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Check:
    """Unstable roots on a grid: counted, and as the boundaries give them at points ``apart`` from every boundary."""

    unstable: NDArray[np.intp]  # (k, k), number of unstable roots, counted
    predicted: NDArray[np.intp]  # (k, k), the same number as it follows from the boundaries crossed
    far: NDArray[np.bool_]  # (k, k), True: more than a cell from every boundary
    sides: int  # points of boundaries whose two sides do not differ by the roots that cross there
    compared: int  # points of boundaries whose two sides were counted

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """Points (k, k) more than a cell from every boundary at which the two counts differ."""
        return np.asarray(self.far & (self.unstable != self.predicted))

    @property
    def grid(self) -> Array:
        """Shares (k,) of either axis at which roots were counted."""
        return np.linspace(0, 1, len(self.unstable))


def complete_boundaries(
    plane: Plane, boundaries: Sequence[Boundary], *, step: float, fine: int = 101
) -> tuple[list[Boundary], Check]:
    """Add the boundaries that the count of unstable roots on a ``fine`` grid shows to be missing, and check all."""
    completed = list(boundaries)
    grid = np.linspace(0, 1, fine)
    points = lattice(grid, grid)
    unstable = plane.unstable(points).reshape(fine, fine)
    for number in range(ROUNDS + 1):
        distance = np.full(len(points), np.inf)
        if completed:
            curve_points = np.concatenate([boundary.shares for boundary in completed])
            distance = scipy.spatial.KDTree(curve_points).query(points)[0]
        far = (distance > 1.5 / (fine - 1)).reshape(fine, fine)
        predicted = count_unstable(completed, grid, grid, 0)
        values, often = np.unique((unstable - predicted)[far if far.any() else ...], return_counts=True)
        predicted = predicted + values[often.argmax()]
        missing = far & (predicted != unstable)
        if not missing.any() or number == ROUNDS:
            break
        # where the count changes from a point to one beside it
        edge = scipy.ndimage.morphological_gradient(unstable, footprint=[[0, 1, 0], [1, 1, 1], [0, 1, 0]]).ravel() > 0
        more = add_boundaries(plane, completed, find_seeds(plane, points[edge], 2 / (fine - 1)), step=step)
        if len(more) == len(completed):
            break
        completed = more
    sides, compared = _sides(plane, completed)
    return completed, Check(unstable, predicted, far, sides, compared)


def _sides(plane: Plane, boundaries: Sequence[Boundary]) -> tuple[int, int]:
    """Count points of boundaries whose two sides do not differ by the roots that cross; also count all compared."""
    wrong = compared = 0
    for boundary in boundaries:
        neighbours = [neighbour.shares for neighbour in boundaries if neighbour is not boundary]
        at = boundary.shares[:: max(1, len(boundary) // 20)]
        normal = boundary.normals[:: max(1, len(boundary) // 20)]
        ends = np.stack([at - ASIDE * normal, at + ASIDE * normal])
        good = ((ends >= 0) & (ends <= 1)).all((0, 2))
        if neighbours:
            good &= scipy.spatial.KDTree(np.concatenate(neighbours)).query(at)[0] > 0.01
        if not good.any():
            continue
        counts = plane.unstable(ends[:, good].reshape(-1, 2)).reshape(2, -1)
        wrong += int((counts[1] - counts[0] != boundary.step).sum())
        compared += int(good.sum())
    return wrong, compared
