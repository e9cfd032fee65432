"""Roots of many bicycles followed along speed, compiled: the sparse track of :mod:`bicycle.modal.tracking`.

Needs numba (extra ``fast``). Neighbouring nodes are linked by where the roots are heading, as in
:mod:`bicycle.modal.matching` and with its limits, real roots and upper halves alone; a step in which it is plain which
two real roots meet stands for itself. Other steps are halved, so that all nodes are among those of the full track.
"""

import math

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.modal.apart_kernel import keep_apart
from bicycle.modal.doubts import NO_VECTORS, SMALLEST, SURE, TOO_CLOSE
from bicycle.modal.matching import CLEAR, TWIN
from bicycle.modal.track_kernel import MEETING, OPEN, SMOOTH, Track, mate_of, on_grid
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array


@compiled
def place(
    t: Track, owner: NDArray[np.int64], v: Array, re: Array, im: Array, slopes: Array, share: Array, doubt: Array
) -> None:
    """Take in nodes as :func:`bicycle.eigenvalues.vectors_kernel.decompose_stack` gives them (k of them).

    Parameters
    ----------
    t : Track
    owner : ndarray of int, shape (k,)
        Indices of the bicycles.
    v : ndarray, shape (k,)
        m/s.
    re, im, doubt : ndarray, shape (k, n)
        1/s.
    slopes : ndarray, shape (2, k, n)
        1/m.
    share : ndarray, shape (k, n, n)
        Of each state in each root.
    """
    n = re.shape[1]
    for k in range(len(v)):
        b = owner[k]
        slot = t.filled[b]
        at = slot
        while at > 0 and t.v[b, t.order[b, at - 1]] > v[k]:
            t.order[b, at] = t.order[b, at - 1]
            at -= 1
        t.order[b, at] = slot
        if at > 0:
            t.kind[b, t.order[b, at - 1]] = OPEN
        t.kind[b, slot] = OPEN
        t.filled[b] = slot + 1
        t.v[b, slot] = v[k]
        for i in range(n):
            t.re[b, slot, i], t.im[b, slot, i] = re[k, i], im[k, i]
            t.dre[b, slot, i], t.dim[b, slot, i] = slopes[0, k, i], slopes[1, k, i]
            if math.isnan(doubt[k, i]):
                t.status[b] = NO_VECTORS
            for s in range(n):
                t.share[b, slot, s, i] = share[k, s, i]


@compiled
def link_steps(t: Track, unit: Array, owner: NDArray[np.int64], v: Array) -> int:
    """Link all open steps; fill in ``owner`` and ``v`` with the nodes that are asked for, and say how many.

    ``unit`` (B,) is the unit of speed of each bicycle, m/s.

    Parameters
    ----------
    t : Track
    unit : ndarray, shape (B,)
        m/s.
    owner, v : ndarray, shape (k,)
        Get indices of bicycles and speeds, m/s.
    """
    bicycles, most, n = t.re.shape
    roots = np.empty((2, 5, n))  # of both ends: real, imaginary, predicted real, imaginary; number among the roots
    count = np.empty(2, np.int64)
    asked = 0
    for b in range(bicycles):
        if t.status[b] != SURE:
            continue
        wanted = 0
        for j in range(t.filled[b] - 1):
            left, right = t.order[b, j], t.order[b, j + 1]
            if t.kind[b, left] != OPEN:
                continue
            t.kind[b, left] = _link(t, b, left, right, roots, count)
            h = t.v[b, right] - t.v[b, left]
            if t.kind[b, left] == MEETING and h > 1.5 * STEP * unit[b]:
                t.kind[b, left] = OPEN  # the full track has nodes there that tell more
            if t.kind[b, left] != OPEN and not keep_apart(t, b, left, right, t.kind[b, left]):
                if t.kind[b, left] == SMOOTH and t.until[b, left] == 0 and h < 1.5 * STEP * unit[b]:
                    t.until[b, left] = right
                    for i in range(n):
                        t.whole[b, left, i] = t.match[b, left, i]
                t.kind[b, left] = OPEN
            if t.kind[b, left] == SMOOTH and on_grid(t, unit, b, left) and on_grid(t, unit, b, right):
                t.plain[b, left] = 1
            if t.kind[b, left] == OPEN:
                if t.filled[b] + wanted >= most or h < SMALLEST * unit[b]:
                    t.status[b] = TOO_CLOSE
                    asked -= wanted
                    break
                owner[asked], v[asked] = b, t.v[b, left] + 0.5 * h
                asked += 1
                wanted += 1
    return asked


@compiled_within
def _link(t: Track, b: int, left: int, right: int, roots: Array, count: NDArray[np.int64]) -> int:
    """Link the roots of two nodes; OPEN where it is not beyond doubt."""
    n = t.re.shape[2]
    half = 0.5 * (t.v[b, right] - t.v[b, left])
    reals = 0
    for i in range(n):
        reals += (1 if t.im[b, left, i] == 0.0 else 0) - (1 if t.im[b, right, i] == 0.0 else 0)
    if reals not in (-2, 0, 2):
        return OPEN
    meeting = reals != 0
    if meeting and not _two_that_meet(t, b, left, right, half, 1 if reals > 0 else 0):
        return OPEN
    size = 0.0
    for end in range(2):
        slot, sign = (left, half) if end == 0 else (right, -half)
        seen = 0
        for i in range(n):
            x, y = t.re[b, slot, i], t.im[b, slot, i]
            size = max(size, x * x + y * y)
            if y < 0.0 or (meeting and (i == t.two[b, left, 2 * end] or i == t.two[b, left, 2 * end + 1])):
                continue
            roots[end, 0, seen], roots[end, 1, seen], roots[end, 4, seen] = x, y, i
            roots[end, 2, seen], roots[end, 3, seen] = x + sign * t.dre[b, slot, i], y + sign * t.dim[b, slot, i]
            seen += 1
        if meeting:
            p, q = t.two[b, left, 2 * end], t.two[b, left, 2 * end + 1]
            mean = 0.5 * (t.re[b, slot, p] + t.re[b, slot, q])
            roots[end, 0, seen], roots[end, 1, seen], roots[end, 4, seen] = mean, 0.0, -1
            roots[end, 2, seen] = mean + sign * 0.5 * (t.dre[b, slot, p] + t.dre[b, slot, q])
            roots[end, 3, seen] = 0.0
            seen += 1
        count[end] = seen
    if count[0] != count[1]:
        return OPEN
    if not _match(t, b, left, right, roots, count[0], math.sqrt(size)):
        return OPEN
    return MEETING if meeting else SMOOTH


@compiled_within
def _match(t: Track, b: int, left: int, right: int, roots: Array, count: int, size: float) -> bool:
    """Fill in which root follows which; False where a rival is near, a real root would turn or the order changes."""
    a, z = roots[0], roots[1]
    twin = TWIN * size
    taken = 0
    for i in range(count):
        best, own = math.inf, -1
        for j in range(count):
            if (taken >> j) & 1 == 0:
                x, y = a[2, i] - z[2, j], a[3, i] - z[3, j]
                cost = x * x + y * y
                if cost < best:
                    best, own = cost, j
        if own < 0 or (a[1, i] == 0.0) != (z[1, own] == 0.0) or (a[4, i] < 0) != (z[4, own] < 0):
            return False
        rival = math.inf
        for j in range(count):
            x, y = z[0, j] - z[0, own], z[1, j] - z[1, own]
            if x * x + y * y > twin * twin:
                x, y = a[2, i] - z[2, j], a[3, i] - z[3, j]
                rival = min(rival, x * x + y * y)
            if z[1, j] > 0.0:  # its lower half
                x, y = a[2, i] - z[2, j], a[3, i] + z[3, j]
                rival = min(rival, x * x + y * y)
        if not best < CLEAR * CLEAR * rival:
            return False
        taken |= 1 << own
        if a[1, i] == 0.0:
            for k in range(i):  # both ends are sorted by real part, but for a mean
                if a[1, k] == 0.0:
                    before = _next(t, b, left, roots, count, k)
                    rises = a[0, i] - a[0, k]
                    if (z[0, own] - z[0, before]) * (1.0 if rises >= 0.0 else -1.0) < -twin:
                        return False
        if a[4, i] >= 0:
            t.match[b, left, int(a[4, i])] = int(z[4, own])
        else:
            t.match[b, left, t.two[b, left, 0]] = t.two[b, left, 2]
            t.match[b, left, t.two[b, left, 1]] = t.two[b, left, 3]
    for i in range(count):
        if a[1, i] > 0.0:
            lower = mate_of(t.re[b, left], t.im[b, left], int(a[4, i]))
            upper = t.match[b, left, int(a[4, i])]
            t.match[b, left, lower] = mate_of(t.re[b, right], t.im[b, right], upper)
    return True


@compiled_within
def _next(t: Track, b: int, left: int, roots: Array, count: int, k: int) -> int:
    """Place in ``roots`` of what follows root ``k``."""
    wanted = -1.0 if roots[0, 4, k] < 0 else float(t.match[b, left, int(roots[0, 4, k])])
    for j in range(count):
        if roots[1, 4, j] == wanted:
            return j
    return 0


@compiled_within
def _two_that_meet(t: Track, b: int, left: int, right: int, half: float, merge: int) -> bool:
    """Which two real roots of one end are the pair of the other (as ``double_roots.join_double_root``)."""
    n = t.re.shape[2]
    alone, paired = (left, right) if merge else (right, left)
    ahead = half if merge else -half
    best, miss_best, d_best, d_pair = math.inf, 0.0, 0.0, 0.0
    p, q, r = -1, -1, -1
    for i in range(n):
        for j in range(n):
            if t.im[b, alone, i] != 0.0 or t.im[b, alone, j] != 0.0 or j >= i:  # sorted: i is the larger
                continue
            gap, turn = t.re[b, alone, i] - t.re[b, alone, j], t.dre[b, alone, i] - t.dre[b, alone, j]
            total = t.re[b, alone, i] + t.re[b, alone, j] + ahead * (t.dre[b, alone, i] + t.dre[b, alone, j])
            d = gap * gap + ahead * 2.0 * gap * turn
            for u in range(n):
                if t.im[b, paired, u] <= 0.0:
                    continue
                y = 2.0 * t.im[b, paired, u]
                d_u = -y * y + ahead * 2.0 * y * 2.0 * t.dim[b, paired, u]
                miss = abs(d - d_u)
                off = abs(total - 2.0 * (t.re[b, paired, u] - ahead * t.dre[b, paired, u])) + math.sqrt(miss)
                if off < best:
                    best, miss_best, d_best, d_pair, p, q, r = off, miss, gap * gap, y * y, i, j, u
    if p < 0:
        return False
    mate = mate_of(t.re[b, paired], t.im[b, paired], r)
    a, c = (0, 2) if merge else (2, 0)
    t.two[b, left, a], t.two[b, left, a + 1] = p, q
    t.two[b, left, c], t.two[b, left, c + 1] = r, mate
    for side in range(2):
        slot, i, j = (alone, p, q) if side == 0 else (paired, r, mate)
        mean, other = 0.5 * (t.re[b, slot, i] + t.re[b, slot, j]), math.inf
        for k in range(n):
            if k not in (i, j):
                other = min(other, math.hypot(t.re[b, slot, k] - mean, t.im[b, slot, k]))
        if not math.sqrt(max(d_best if side == 0 else d_pair, miss_best)) < 2.0 * CLEAR * other:
            return False
    return True
