"""Crossings of the imaginary axis on tracked roots of many bicycles, compiled.

Needs numba (extra ``fast``). In a step the real part of a root is Hermite's cubic of its two nodes, give or take the
distance at which the two nodes' predictions miss each other half-way. A step has no crossing where the cubic stays away
from zero by more than that, one where it rises or falls through zero beyond doubt; any other is asked to be divided. So
every crossing up to the highest speed is either seen or the bicycle is left to the plain path.
"""

import math

from bicycle.critical.completeness import NOISE
from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.modal.cubic_kernel import hermite, miss, reach
from bicycle.modal.doubts import SMALLEST, SURE, TOO_CLOSE
from bicycle.modal.identity_kernel import Whole
from bicycle.modal.track_kernel import MEETING, Track
from tyre.base.arrays import Array

NONE, ONE, PERHAPS = 0, 1, 2
STRAIGHT = 4.0  # a slope is of one sign beyond doubt where it is larger than so many misses
ROOM = 1.5  # of the largest discriminant at the ends of a step: it is nowhere larger inside


@compiled
def divide(t: Track, unit: Array, low: Array, high: Array, owner: Whole, v: Array) -> int:
    """Ask for nodes in steps that may hide crossings; fill in ``owner`` and ``v`` and say how many.

    Parameters
    ----------
    t : Track
    unit, low, high : ndarray, shape (B,)
        Unit of speed and the ends of the range that is looked at, m/s.
    owner, v : ndarray
        Get the bicycles and the speeds.
    """
    n, asked = t.re.shape[2], 0
    for b in range(t.v.shape[0]):
        if t.status[b] != SURE:
            continue
        wanted = 0
        for j in range(t.filled[b] - 1):
            left, right = t.order[b, j], t.order[b, j + 1]
            if t.v[b, right] <= low[b] or t.v[b, left] >= high[b]:
                continue
            h = t.v[b, right] - t.v[b, left]
            perhaps = t.kind[b, left] == MEETING and not _meets_away(t, b, left, right, h)
            for i in range(n):
                if not perhaps and not (t.kind[b, left] == MEETING and i in (t.two[b, left, 0], t.two[b, left, 1])):
                    perhaps = t.im[b, left, i] >= 0.0 and sees(t, b, left, right, i) == PERHAPS
            if not perhaps:
                continue
            if t.filled[b] + wanted >= t.v.shape[1] or h < SMALLEST * unit[b]:
                t.status[b] = TOO_CLOSE
                asked -= wanted
                break
            owner[asked], v[asked] = b, t.v[b, left] + 0.5 * h
            asked += 1
            wanted += 1
    return asked


@compiled_within
def sees(t: Track, b: int, left: int, right: int, i: int) -> int:
    """Whether root ``i`` of the node ``left`` crosses on its way to the next: NONE, ONE or PERHAPS.

    Parameters
    ----------
    t : Track
    b : int
        Index of the bicycle.
    left, right : int
        Indices of the two nodes.
    i : int
        Index of the root.
    """
    h = t.v[b, right] - t.v[b, left]
    k = t.match[b, left, i]
    a, z = t.re[b, left, i], t.re[b, right, k]
    rise_a, rise_z = h * t.dre[b, left, i], h * t.dre[b, right, k]
    size = 0.0
    for r in range(t.re.shape[2]):
        size = max(size, math.hypot(t.re[b, left, r], t.im[b, left, r]))
    return _one(a, z, rise_a, rise_z, NOISE * size, 1 if t.v[b, left] == 0.0 else 0)


@compiled_within
def _one(a: float, z: float, rise_a: float, rise_z: float, noise: float, at_rest: int) -> int:
    doubt = miss(a, z, rise_a, rise_z) + noise
    square, cube = 3.0 * (z - a) - 2.0 * rise_a - rise_z, rise_a + rise_z - 2.0 * (z - a)
    least, most = reach(a, z, rise_a, rise_z)
    flat, steep = min(rise_a, rise_z), max(rise_a, rise_z)  # of the slope: at the ends and where it turns
    if cube != 0.0:
        turn = -square / (3.0 * cube)
        if 0.0 < turn < 1.0:
            slope = rise_a + turn * (2.0 * square + 3.0 * cube * turn)
            flat, steep = min(flat, slope), max(steep, slope)
    if least > doubt or most < -doubt:
        return NONE
    if flat > STRAIGHT * doubt or steep < -STRAIGHT * doubt:
        if min(abs(a), abs(z)) > 2.0 * noise:
            return ONE if a * z < 0.0 else NONE
        if at_rest and abs(a) <= 2.0 * noise < abs(z):  # from the axis straight away
            return NONE
    return PERHAPS


@compiled_within
def _meets_away(t: Track, b: int, left: int, right: int, h: float) -> bool:
    """Whether two real roots meet beyond doubt away from zero: their mean is, by more than half their distance."""
    p, q, r, s = t.two[b, left, 0], t.two[b, left, 1], t.two[b, left, 2], t.two[b, left, 3]
    a, z = 0.5 * (t.re[b, left, p] + t.re[b, left, q]), 0.5 * (t.re[b, right, r] + t.re[b, right, s])
    rise_a = 0.5 * h * (t.dre[b, left, p] + t.dre[b, left, q])
    rise_z = 0.5 * h * (t.dre[b, right, r] + t.dre[b, right, s])
    apart = max(abs(t.re[b, left, p] - t.re[b, left, q]), abs(t.re[b, right, r] - t.re[b, right, s]))
    return _one(a, z, rise_a, rise_z, 0.5 * math.sqrt(ROOM) * apart, 0) == NONE


@compiled
def crossings(t: Track, low: Array, high: Array, owner: Whole, step: Whole, root: Whole, start: Array) -> int:
    """List the crossings of bicycles that are sure: how many.

    Parameters
    ----------
    t : Track
    low, high : ndarray, shape (B,)
        m/s.
    owner, step, root : ndarray of int
        Get the bicycle, the place of the lower node and the number of the root there.
    start : ndarray, shape (3, ...)
        Gets speed (m/s), and real and imaginary part of the root (1/s), about.
    """
    n, seen = t.re.shape[2], 0
    for b in range(t.v.shape[0]):
        if t.status[b] != SURE:
            continue
        for j in range(t.filled[b] - 1):
            left, right = t.order[b, j], t.order[b, j + 1]
            if t.v[b, right] <= low[b] or t.v[b, left] >= high[b]:
                continue
            for i in range(n):
                meets = t.kind[b, left] == MEETING and i in (t.two[b, left, 0], t.two[b, left, 1])
                if t.im[b, left, i] < 0.0 or meets or sees(t, b, left, right, i) != ONE:
                    continue
                h, k = t.v[b, right] - t.v[b, left], t.match[b, left, i]
                a, z = t.re[b, left, i], t.re[b, right, k]
                rise_a, rise_z = h * t.dre[b, left, i], h * t.dre[b, right, k]
                below, above = 0.0, 1.0
                for _ in range(40):
                    s = 0.5 * (below + above)
                    if (hermite(a, z, rise_a, rise_z, s) > 0.0) == (a > 0.0):
                        below = s
                    else:
                        above = s
                owner[seen], step[seen], root[seen] = b, j, i
                start[0, seen] = t.v[b, left] + s * h
                start[1, seen] = 0.0
                start[2, seen] = hermite(
                    t.im[b, left, i], t.im[b, right, k], h * t.dim[b, left, i], h * t.dim[b, right, k], s
                )
                seen += 1
    return seen


@compiled
def newton(v: Array, re: Array, im: Array, slopes: Array, doubt: Array, root: Array, step: Array, state: Array) -> None:
    """One step of Newton for Re(root) = 0 of crossings (k,), with the roots (k, n) at ``v``.

    Parameters
    ----------
    v : ndarray, shape (k,)
        m/s; moved.
    re, im, slopes, doubt : ndarray
        As :func:`bicycle.eigenvalues.vectors_kernel.decompose_stack` gives them.
    root : ndarray, shape (2, k)
        Expected root, 1/s; moved.
    step : ndarray, shape (k,)
        Gets the step, m/s.
    state : ndarray, shape (2, k)
        Gets the slope of the real part, 1/m, and how well the speed is known, m/s.
    """
    for k in range(len(v)):
        own, best = 0, math.inf
        for i in range(re.shape[1]):
            far = math.hypot(re[k, i] - root[0, k], im[k, i] - root[1, k])
            if far < best:
                own, best = i, far
        slope = slopes[0, k, own]
        step[k] = -re[k, own] / slope if slope != 0.0 else math.inf
        v[k] += step[k]
        root[0, k], root[1, k] = 0.0, im[k, own] + step[k] * slopes[1, k, own]
        state[0, k], state[1, k] = slope, doubt[k, own] / abs(slope) if slope != 0.0 else math.inf
