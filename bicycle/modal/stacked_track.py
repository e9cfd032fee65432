"""Roots of many bicycles followed along speed at once, in plain numpy: the sparse track, all open steps of a round.

Neighbouring nodes are linked as those of one bicycle are (:mod:`bicycle.modal.matching`); a step in which it is plain
which two real roots meet stands for itself. Other steps are halved, so that all nodes are among those of the full
track, and so are meetings next to speeds that are asked for.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import BATCH, decompose
from bicycle.modal.apart import keep_apart
from bicycle.modal.doubts import BESIDE_A_CHANGE, NO_VECTORS, NODES, SMALLEST, SURE, TOO_CLOSE
from bicycle.modal.identity import conjugate_index
from bicycle.modal.matching import CLEAR, Roots, link_roots
from bicycle.modal.tracking import STEP
from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex

Indices = NDArray[np.intp]


class ManyTracks(NamedTuple):
    """Nodes of many bicycles, by bicycle and speed: N in all, n branches.

    Attributes
    ----------
    start : ndarray of int, shape (m + 1,)
        Where the nodes of each bicycle begin; those of an unsure one are left out.
    v : ndarray, shape (N,)
        m/s.
    values, slopes : complex ndarray, shape (N, n)
        1/s and 1/m, a column a branch.
    share : ndarray, shape (N, n, n)
        Of each state (second axis) in each branch.
    smooth : ndarray of bool, shape (N,)
        False where two real roots meet in the step to the next node.
    given : ndarray of bool, shape (N,)
        Nodes of the sparse grid; the others were asked for.
    """

    start: Indices
    v: Array
    values: Complex
    slopes: Complex
    share: Array
    smooth: NDArray[np.bool_]
    given: NDArray[np.bool_]


class _Found(NamedTuple):
    """Nodes in the order they were computed, their roots in LAPACK's."""

    owner: Indices
    v: Array
    values: Complex
    slopes: Complex
    share: Array


def track_many(
    polynomial: SpeedPolynomial, unit: Array, owner: Indices, v: Array, asked: Array, status: NDArray[np.int16]
) -> ManyTracks:
    """Track many bicycles from node to node.

    Parameters
    ----------
    polynomial : SpeedPolynomial, shape (m, n, n)
        Scaled state matrices, 1/s.
    unit : ndarray, shape (m,)
        sqrt(g w), m/s.
    owner : ndarray of int, shape (k,)
        Bicycle of each node of the sparse grid.
    v : ndarray, shape (k,)
        Its speed, m/s, rising for each bicycle.
    asked : ndarray, shape (m, j)
        Speeds that are asked for, m/s.
    status : ndarray of int, shape (m,)
        Of each bicycle; gets the reason where it cannot be tracked beyond doubt.
    """
    found: list[_Found] = []

    def compute(owner: Indices, v: Array) -> Roots:
        start = len(found)
        for part in np.array_split(np.arange(len(v)), -(-len(v) // BATCH)):
            values, slopes, right, left = decompose(polynomial.take(owner[part]), v[part])
            share = np.abs(right * left.swapaxes(1, 2))
            share /= share.sum(1, keepdims=True)
            found.append(_Found(owner[part], v[part], values, slopes, share))
        new = found[start:]
        return Roots(v, np.concatenate([part.values for part in new]), np.concatenate([part.slopes for part in new]))

    nodes = compute(owner, v)
    lower = np.flatnonzero(owner[1:] == owner[:-1])
    upper, own, count = lower + 1, owner[lower], len(owner)
    a, b = nodes.take(lower), nodes.take(upper)
    filled = np.bincount(owner, minlength=len(unit))
    linked = []
    while len(lower):
        h = b.v - a.v
        match, good, meets = _linked(a, b)
        good &= ~meets | (h <= 1.5 * STEP * unit[own])  # the full track has nodes there that tell more
        beside = np.zeros(len(own), bool)
        k = np.flatnonzero(good & meets)
        beside[k] = ((asked[own[k]] >= a.v[k, None]) & (asked[own[k]] <= b.v[k, None])).any(1)
        small = h < SMALLEST * unit[own]
        status[own[~good & small]], status[own[beside & small]] = TOO_CLOSE, BESIDE_A_CHANGE
        good &= ~beside
        linked.append((lower[good], match[good], ~meets[good]))
        np.add.at(filled, own[~good], 1)
        status[filled > max(NODES, 2 * len(owner) // len(unit))] = TOO_CLOSE
        k = np.flatnonzero(~good & (status[own] == SURE))
        own, lower, upper, a, b = own[k], lower[k], upper[k], a.take(k), b.take(k)
        if not len(k):
            break
        middle = compute(own, (a.v + b.v) / 2)
        new = count + np.arange(len(k))
        count += len(k)
        a, b = a.and_(middle), middle.and_(b)
        own, lower, upper = np.tile(own, 2), np.concatenate([lower, new]), np.concatenate([new, upper])
    return _in_branches(_Found(*map(np.concatenate, zip(*found, strict=True))), linked, len(owner), status)


def _linked(a: Roots, b: Roots) -> tuple[Indices, NDArray[np.bool_], NDArray[np.bool_]]:
    """Which root follows which (k, n), where it is beyond doubt and where two real roots meet (k,)."""
    change = (a.values.imag == 0).sum(1) - (b.values.imag == 0).sum(1)
    meets = np.abs(change) == 2
    two = np.zeros((2, *a.values.shape), bool)
    plain = change == 0
    k = np.flatnonzero(meets)
    if k.size:
        first, last, told = _two_that_meet(a.take(k), b.take(k), change[k] > 0)
        plain[k] = told
        merged = []
        for nodes, members, mark in ((a, first, two[0]), (b, last, two[1])):
            values, slopes = nodes.values.copy(), nodes.slopes.copy()
            rows = k[:, None]
            values[rows, members] = values[rows, members].mean(1, keepdims=True).real
            slopes[rows, members] = slopes[rows, members].mean(1, keepdims=True).real
            mark[rows, members] = True
            merged.append(Roots(nodes.v, values, slopes))
        match, good, _ = link_roots(*merged)
        landed = match[k[:, None], first]
        plain[k] &= (np.sort(landed, 1) == np.sort(last, 1)).all(1)
        match[k[:, None], first] = last
    else:
        match, good, _ = link_roots(a, b)
    good &= plain
    k = np.flatnonzero(good)
    h, row = (b.v - a.v)[k, None], k[:, None]
    good[k] = keep_apart(a.values[k], b.values[row, match[k]], h * a.slopes[k], h * b.slopes[row, match[k]], ~two[0][k])
    return match, good, meets


def _two_that_meet(a: Roots, b: Roots, merge: NDArray[np.bool_]) -> tuple[Indices, Indices, NDArray[np.bool_]]:
    """Which two roots (k, 2) of each end meet, as ``double_roots.join_double_root``, and where that is plain (k,)."""
    rows, merges = np.arange(len(a.v)), merge[:, None]

    def either(first: NDArray[Any], last: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        return np.where(merges, first, last), np.where(merges, last, first)

    (alone, paired), (rise_alone, rise_paired) = either(a.values, b.values), either(a.slopes, b.slopes)
    ahead = np.where(merges, 0.5, -0.5) * (b.v - a.v)[:, None]
    i, j = np.triu_indices(alone.shape[1], 1)
    gap, turn = alone[:, i] - alone[:, j], rise_alone[:, i] - rise_alone[:, j]
    d = (gap * gap + 2 * ahead * gap * turn).real  # discriminants and sums, foretold for the middle
    d_pair = -4 * paired.imag**2 + 8 * ahead * paired.imag * rise_paired.imag
    total = (alone[:, i] + alone[:, j] + ahead * (rise_alone[:, i] + rise_alone[:, j])).real
    total_pair = 2 * (paired - ahead * rise_paired).real
    miss = np.abs(d[:, :, None] - d_pair[:, None, :])
    off = np.abs(total[:, :, None] - total_pair[:, None, :]) + np.sqrt(miss)
    real = (alone[:, i].imag == 0) & (alone[:, j].imag == 0)
    possible = real[:, :, None] & (paired.imag > 0)[:, None, :]
    best = np.where(possible, off, np.inf).reshape(len(rows), -1).argmin(1)
    couple, upper = np.divmod(best, alone.shape[1])
    i, j = i[couple], j[couple]
    larger = alone[rows, i].real >= alone[rows, j].real
    two = np.where(larger, [i, j], [j, i]).T
    halves = np.stack([upper, conjugate_index(paired)[rows, upper]], 1)
    plain = possible[rows, couple, upper]
    for values, members in ((alone, two), (paired, halves)):
        both = values[rows[:, None], members]
        far = np.abs(values - both.mean(1, keepdims=True))
        far[rows[:, None], members] = np.inf
        spread = np.maximum(np.abs(both[:, 0] - both[:, 1]) ** 2, miss[rows, couple, upper])
        plain &= np.sqrt(spread) < 2 * CLEAR * far.min(1)
    return *either(two, halves), plain


def _in_branches(
    nodes: _Found, linked: Sequence[tuple[Indices, Indices, NDArray[np.bool_]]], given: int,
    status: NDArray[np.int16],
) -> ManyTracks:  # fmt: skip
    """Nodes of the sure in order, and their roots in the order of branches."""
    match, smooth = np.zeros(nodes.values.shape, np.intp), np.ones(len(nodes.v), bool)
    for lower, follows, plain in linked:
        match[lower], smooth[lower] = follows, plain
    bad = ~np.isfinite(nodes.slopes).all(1)
    status[nodes.owner[bad]] = NO_VECTORS
    order = np.lexsort((nodes.v, nodes.owner))
    order = order[status[nodes.owner[order]] == SURE]
    start = np.searchsorted(nodes.owner[order], np.arange(len(status) + 1))
    match, values = match[order], nodes.values[order]
    branch = np.zeros(match.shape, np.intp)
    first, count = start[:-1], np.diff(start)
    here = first[count > 0]
    branch[here] = np.lexsort((values[here].imag, values[here].real), axis=1)
    for step in range(count.max(initial=0) - 1):
        at = first[count > step + 1] + step
        branch[at + 1] = np.take_along_axis(match[at], branch[at], 1)
    values, slopes = (np.take_along_axis(x, branch, 1) for x in (values, nodes.slopes[order]))
    share = np.take_along_axis(nodes.share[order], branch[:, None, :], 2)
    return ManyTracks(start, nodes.v[order], values, slopes, share, smooth[order], order < given)
