"""Every boundary of a chart: seeds from a grid of roots, curves through them, a count that tells what is missing."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from studies.stability_charts.axis_root import sharpened
from studies.stability_charts.boundary import Boundary
from studies.stability_charts.plane import NOISE, Plane, lattice
from studies.stability_charts.tracing import SLOW, Seed, trace
from tyre.base.arrays import Array

GRID = 33  # points along each axis, from whose roots boundaries are looked for
REACH = 1.5  # cells: a root is looked after if it might lie on the axis so near
INSIDE = 1e-6  # of the axes: a line along the edge of the chart is taken so far inside, where curves end
SAME = 0.1  # of a step: a seed so near to a curve lies on it


def seeds(plane: Plane, grid: int = GRID) -> list[Seed]:
    """Points on boundaries: Newton from every root of a grid that may lie on the axis within the next cell.

    That finds curves between points, and islands that lie between points too: a root whose real part has its largest
    value h inside is led there as Newton halves the way to it.

    Parameters
    ----------
    plane : Plane
    grid : int
        Number of points along each axis.
    """
    points = lattice(*[np.linspace(0, 1, grid)] * 2)
    return from_points(plane, points, REACH / (grid - 1))


def from_points(plane: Plane, points: Array, reach: float) -> list[Seed]:
    """Points on boundaries to which Newton leads from the roots at some points.

    Parameters
    ----------
    plane : Plane
    points : ndarray, shape (m, 2)
        Shares of the axes.
    reach : float
        How far a boundary may be, as a share of the axes.
    """
    look = plane.look(points)
    steep = np.hypot(look.gradients[..., 0].real, look.gradients[..., 1].real)
    size = np.abs(look.values).max(1, keepdims=True)
    away = np.abs(look.values.real) / np.maximum(steep, 1e-300)
    near = (look.values.imag >= 0) & (away <= reach) & (steep > NOISE * size)
    k, i = np.nonzero(near)
    if not k.size:
        return []
    order = np.argsort(away[k, i], kind="stable")
    k, i = k[order], i[order]
    found = sharpened(plane, points[k], look.values[k, i], look.values[k, i].imag == 0, longest=reach)
    real = look.values[k, i].imag == 0
    kept: list[Seed] = []
    seen: set[tuple[object, ...]] = set()
    for m in np.flatnonzero(found.reached):
        gradient = found.at.gradient[m]
        cell = np.round(found.shares[m] * 4 / reach).astype(int).tolist()
        key = (*cell, round(abs(found.at.root[m].imag), 1), bool(real[m]), *(gradient.real > 0).tolist())
        if key not in seen and np.hypot(*gradient.real) > NOISE * found.at.size[m]:
            seen.add(key)
            root = 0j if real[m] else complex(found.at.root[m])
            kept.append(Seed(found.shares[m], root, bool(real[m]), gradient))
    return kept


def all_boundaries(plane: Plane, *, step: float, grid: int = GRID) -> list[Boundary]:
    """The boundaries through all seeds, each once.

    Parameters
    ----------
    plane : Plane
    step : float
        Longest step along a curve, as a share of the axes.
    grid : int
        Number of points along each axis of the grid of seeds.
    """
    return with_seeds(plane, [], seeds(plane, grid), step=step)


def with_seeds(plane: Plane, known: Sequence[Boundary], found: Iterable[Seed], *, step: float) -> list[Boundary]:
    """The boundaries that are known and those through further seeds.

    Parameters
    ----------
    plane : Plane
    known : sequence of Boundary
    found : iterable of Seed
    step : float
        Longest step along a curve, as a share of the axes.
    """
    linear = plane.space.linear
    slow = SLOW * float(np.sqrt(linear.parameters["g"] / linear.parameters["w"]))
    boundaries = list(known)
    for seed in found:
        if not any(_on(boundary, seed, step) for boundary in boundaries):
            traced = trace(plane, seed, step=step, slow=slow)
            if len(traced) > 1:
                boundaries.append(traced)
    return boundaries


def _on(boundary: Boundary, seed: Seed, step: float) -> bool:
    return boundary.real == seed.real and boundary.passes(seed.shares, seed.root, seed.normal, SAME * step)


def counted(boundaries: Sequence[Boundary], first: Array, second: Array, start: int) -> NDArray[np.intp]:
    """Number of unstable roots (k, l) on a grid as the boundaries tell it.

    Along the second axis from the first point, then along the first: every crossing of a curve changes the number.

    Parameters
    ----------
    boundaries : sequence of Boundary
    first, second : ndarray, shape (k,) and (l,)
        Rising shares of the axes.
    start : int
        Number of unstable roots at the first point of both.
    """
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
    """Where pieces cross the lines on which coordinate ``axis`` is constant: the other coordinate, line, and change.

    The change is that of the number of unstable roots per root, as the other coordinate rises.
    """
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
