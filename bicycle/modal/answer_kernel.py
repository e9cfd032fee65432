"""Names of roots at the speeds that are asked for, compiled: :meth:`bicycle.modal.tracker.Tracker.labels` in batches.

Needs numba (extra ``fast``). A root belongs to the branch that is expected next to it. Where another comes near, or the
names change between the two nodes around a speed, the bicycle is left to the plain path.
"""

import math

import numpy as np

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.eigenvalues.vectors_kernel import DOUBTFUL
from bicycle.modal.cubic_kernel import hermite
from bicycle.modal.doubts import BESIDE_A_CHANGE, RIVALS, SMALLEST, SURE
from bicycle.modal.identity_kernel import CHANCE, Whole
from bicycle.modal.matching import CLEAR, TWIN
from bicycle.modal.naming_kernel import Named
from bicycle.modal.track_kernel import MEETING, SMOOTH, Track, mate_of, on_grid
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array

LEVELS = 4  # of halving at once towards a meeting
NARROW = 2.0**-6 * STEP  # of the unit of speed: who gets which root is judged so near to a meeting of two modes


@compiled
def answer(t: Track, found: Named, unit: Array, v: Array, re: Array, im: Array, names: Whole) -> None:
    """Fill in the names of roots at speeds, as bits; a bicycle that is not sure gets a status.

    Parameters
    ----------
    t : Track
    found : Named
    unit : ndarray, shape (B,)
        Unit of speed, m/s.
    v : ndarray, shape (B, m)
        m/s, NaN for none.
    re, im : ndarray, shape (B, m, n)
        Roots there, sorted, 1/s.
    names : ndarray of int, shape (B, m, n)
        Gets the numbers of the names each may have, as bits.
    """
    n = re.shape[2]
    expected, branch = np.empty((2, n)), np.empty(n, np.int64)
    for b in range(v.shape[0]):
        if t.status[b] != SURE:
            continue
        for k in range(v.shape[1]):
            if math.isnan(v[b, k]):
                continue
            j = step_of(t, b, v[b, k])
            if not _branches(t, found, b, j, v[b, k], re[b, k], im[b, k], expected, branch):
                t.status[b] = RIVALS
                break
            at = node_like(t, found, unit, b, j, v[b, k])
            if at < 0:
                t.status[b] = BESIDE_A_CHANGE
                break
            for i in range(n):
                mate = mate_of(re[b, k], im[b, k], i)
                modes = found.label[b, at, branch[i]] | found.label[b, at, branch[mate]]
                if modes & CHANCE:
                    t.status[b] = BESIDE_A_CHANGE
                names[b, k, i] = name_bits(found.name[b], modes)


@compiled_within
def name_bits(name: Whole, modes: int) -> int:
    """Numbers of the names of ``modes``, both as bits; ``name`` (n,) is the name of each mode."""
    bits = 0
    for mode in range(len(name)):
        if (modes >> mode) & 1:
            bits |= 1 << name[mode]
    return bits


@compiled_within
def step_of(t: Track, b: int, v: float) -> int:
    """The step that holds ``v`` (m/s): the place of its lower node.

    Parameters
    ----------
    t : Track
    b : int
        Index of the bicycle.
    v : float
        m/s.
    """
    low, high = 0, t.filled[b] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if t.v[b, t.order[b, middle]] <= v:
            low = middle
        else:
            high = middle
    return low


@compiled_within
def same_labels(t: Track, found: Named, b: int, j: int, v: float) -> bool:
    """Whether no name changes in step ``j``, or ``v`` (m/s) is one of its ends.

    Parameters
    ----------
    t : Track
    found : Named
    b, j : int
        Indices of the bicycle and the step.
    v : float
        m/s.
    """
    if t.v[b, t.order[b, j]] == v or t.v[b, t.order[b, j + 1]] == v:
        return True
    return _same_names(found, b, j, j + 1)


@compiled_within
def _branches(
    t: Track, found: Named, b: int, j: int, v: float, re: Array, im: Array, expected: Array, branch: Whole
) -> bool:
    """Branch of each root (n,) at ``v`` in step ``j``; False where it is not beyond doubt."""
    n = len(re)
    left, right = t.order[b, j], t.order[b, j + 1]
    h = t.v[b, right] - t.v[b, left]
    s = (v - t.v[b, left]) / h
    size = 0.0
    for i in range(n):
        size = max(size, re[i] * re[i] + im[i] * im[i])
        branch[i] = -1
    for i in range(n):
        if 0.0 < im[i] <= DOUBTFUL * math.sqrt(size):
            return False  # rounding may have split two real roots
    first, second = -1, -1  # branches that meet
    for i in range(n):
        p, q = found.root[b, j, i], found.root[b, j + 1, i]
        if t.kind[b, left] == MEETING and 0.0 < s < 1.0 and p in (t.two[b, left, 0], t.two[b, left, 1]):
            if first < 0:
                first = i
            else:
                second = i
            continue
        expected[0, i] = hermite(t.re[b, left, p], t.re[b, right, q], h * t.dre[b, left, p], h * t.dre[b, right, q], s)
        expected[1, i] = hermite(t.im[b, left, p], t.im[b, right, q], h * t.dim[b, left, p], h * t.dim[b, right, q], s)
    for i in range(n):
        if i in (first, second):
            continue
        best, own = math.inf, -1
        for k in range(n):
            if branch[k] < 0:
                cost = (re[k] - expected[0, i]) ** 2 + (im[k] - expected[1, i]) ** 2
                if cost < best:
                    best, own = cost, k
        rival = math.inf
        for k in range(n):
            if k != own and (re[k] - re[own]) ** 2 + (im[k] - im[own]) ** 2 > TWIN * TWIN * size:
                rival = min(rival, (re[k] - expected[0, i]) ** 2 + (im[k] - expected[1, i]) ** 2)
        clear = best < CLEAR * CLEAR * rival or best <= TWIN * TWIN * size
        if not clear or (im[own] > 0.0) != (expected[1, i] > 0.0):
            return False
        branch[own] = i
    if first >= 0:
        if found.label[b, j, first] != found.label[b, j, second]:
            return False
        for k in range(n):
            if branch[k] < 0:
                branch[k], first = first, second
    return True


@compiled
def ask_more(t: Track, found: Named, v: Array, unit: Array, owner: Whole, more: Array) -> int:
    """Halve steps in which names change at speeds asked for, until the full track would not be finer; how many.

    Parameters
    ----------
    t, found : Track, Named
    v : ndarray, shape (B, m)
        m/s, NaN for none.
    unit : ndarray, shape (B,)
        Unit of speed, m/s.
    owner, more : ndarray, shape (k,)
        Get the bicycles and the speeds, m/s.
    """
    asked = 0
    for b in range(v.shape[0]):
        first = asked
        if t.status[b] != SURE:
            continue
        for j in range(t.filled[b] - 1):
            left = t.order[b, j]
            h = t.v[b, t.order[b, j + 1]] - t.v[b, left]
            if t.kind[b, left] == MEETING and h > NARROW * unit[b] and _of_two_modes(t, found, b, j):
                target, low = t.v[b, left] + h * _meeting(t, b, j), t.v[b, left]
                for _ in range(LEVELS):
                    h *= 0.5
                    if h < 0.5 * NARROW * unit[b]:
                        break
                    owner[asked], more[asked] = b, low + h
                    asked += 1
                    low += h if target >= low + h else 0.0
        wide = asked
        for k in range(v.shape[1]):
            j = 0 if math.isnan(v[b, k]) else step_of(t, b, v[b, k])
            left = t.order[b, j]
            h = t.v[b, t.order[b, j + 1]] - t.v[b, left]
            if math.isnan(v[b, k]) or same_labels(t, found, b, j, v[b, k]):
                continue
            if t.kind[b, left] == SMOOTH and h < 1.5 * STEP * unit[b]:
                continue
            middle = t.v[b, left] + 0.5 * h
            for other in range(first, wide):
                middle = math.nan if more[other] == middle else middle
            if math.isnan(middle) or (asked > wide and more[asked - 1] == middle):
                continue
            owner[asked], more[asked] = b, middle
            asked += 1
            if h < SMALLEST * unit[b]:
                t.status[b] = BESIDE_A_CHANGE
        if t.filled[b] + asked - first > t.v.shape[1]:
            t.status[b] = BESIDE_A_CHANGE
        if t.status[b] != SURE:
            asked = first
    return asked


@compiled_within
def _meeting(t: Track, b: int, j: int) -> float:
    """Where in step ``j``, from 0 to 1, the squared distance of the two roots that meet is zero: it is near linear."""
    left, right = t.order[b, j], t.order[b, j + 1]
    p, q, r, s = t.two[b, left, 0], t.two[b, left, 1], t.two[b, left, 2], t.two[b, left, 3]
    first = (t.re[b, left, p] - t.re[b, left, q]) ** 2 - (t.im[b, left, p] - t.im[b, left, q]) ** 2
    last = (t.re[b, right, r] - t.re[b, right, s]) ** 2 - (t.im[b, right, r] - t.im[b, right, s]) ** 2
    return first / (first - last) if first != last else 0.5


@compiled_within
def _of_two_modes(t: Track, found: Named, b: int, j: int) -> bool:
    """Whether the two roots that meet in step ``j`` are not of one mode, before and after."""
    first, second = -1, -1
    left = t.order[b, j]
    for i in range(found.root.shape[2]):
        if found.root[b, j, i] in (t.two[b, left, 0], t.two[b, left, 1]):
            if first < 0:
                first = i
            else:
                second = i
    one = found.label[b, j, first]
    return not (one == found.label[b, j, second] == found.label[b, j + 1, first] == found.label[b, j + 1, second])


@compiled_within
def node_like(t: Track, found: Named, unit: Array, b: int, j: int, v: float) -> int:
    """The node whose names hold at ``v`` (m/s) in step ``j``, -1 where that hangs on nodes that are not known here.

    In a step of the full track that it takes as a whole, it is the end farther from where names were given. In others
    names must not change.

    Parameters
    ----------
    t : Track
    found : Named
    unit : ndarray, shape (B,)
        Unit of speed, m/s.
    b, j : int
        Indices of the bicycle and the step.
    v : float
        m/s.
    """
    low, high = j, j + 1
    while low > 0 and not on_grid(t, unit, b, t.order[b, low]):
        low -= 1
    while high < t.filled[b] - 1 and not on_grid(t, unit, b, t.order[b, high]):
        high += 1
    if t.v[b, t.order[b, low]] == v:
        return low
    if t.v[b, t.order[b, high]] == v:
        return high
    up = v >= found.anchor[b]
    whole = low + 1 == high and t.kind[b, t.order[b, j]] == SMOOTH
    if t.plain[b, t.order[b, low]] or whole:
        wide = t.v[b, t.order[b, high]] - t.v[b, t.order[b, low]] > 1.5 * STEP * unit[b]
        return -1 if wide and not _same_names(found, b, low, high) else (high if up else low)
    own = j + 1 if up else j
    if not _same_names(found, b, j, j + 1):
        return -1
    while low < own < high:  # the full track may have any node out to the end of its step or to where roots meet
        if t.kind[b, t.order[b, own if up else own - 1]] == MEETING:
            return own
        own += 1 if up else -1
        if not _same_names(found, b, own, j):
            return -1
    return own


@compiled_within
def _same_names(found: Named, b: int, j: int, k: int) -> bool:
    changes = 0
    for i in range(found.label.shape[2]):
        changes += 1 if found.label[b, j, i] != found.label[b, k, i] else 0
    return changes == 0
