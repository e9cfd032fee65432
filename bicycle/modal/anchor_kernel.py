"""Where weave, capsize and castering are plainest, compiled: the anchor of :mod:`bicycle.modal.naming`.

Needs numba (extra ``fast``).
"""

import math

import numpy as np

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.modal.anchor import BETTER, LEVEL, MOSTLY, QUICK, SLOW, SPARE, WHOLE
from bicycle.modal.batch_kind import Roles
from bicycle.modal.doubts import SURE
from bicycle.modal.identity_kernel import Walked, Whole
from bicycle.modal.track_kernel import Track
from tyre.base.arrays import Array

WEAVE, CAPSIZE, CASTERING, FIRST_ROLE = 0, 1, 2, 3  # numbers of names


@compiled_within
def find_anchor(w: Walked, m: int, share: Array, roles: Roles, unit: float, core: Whole) -> int:
    """Node at which weave, capsize and castering are plainest, -1 where it is not clear; ``core`` marks their roots.

    Parameters
    ----------
    w : Walked
    m : int
        Number of nodes.
    share : ndarray, shape (m, roles, n)
        Of each role in each branch.
    roles : Roles
    unit : float
        Unit of speed, m/s.
    core : ndarray of int, shape (n,)
        Gets 1 for its branches.
    """
    n = w.re.shape[1]
    best, most, plainest, second = -1, 0, -1.0, -1.0
    here, slow = np.empty(n, np.int64), np.empty(3, np.int64)
    count, plain = np.zeros(m, np.int64), np.full(m, -1.0)
    for k in range(m):
        speed = w.v[k] / unit
        if not SLOW - SPARE <= speed <= QUICK + SPARE:
            continue
        count[k] = _core_at(w, k, share, roles, here, slow, 0)
        if count[k]:
            plain[k] = _plainness(w, k, here)
        if not w.grid[k] or not SLOW <= speed <= QUICK or count[k] == 0 or count[k] < most:
            continue
        if count[k] > most:
            most, plainest, second = count[k], -1.0, -1.0
        if plain[k] > plainest:
            best, plainest, second = k, plain[k], plainest
            for i in range(n):
                core[i] = here[i]
        else:
            second = max(second, plain[k])
    if most < WHOLE:  # between these nodes, beside a meeting, there may be a whole one for a short while
        return -1
    if plainest - second < LEVEL or _more_between(w, m, unit, count, plain, most, plainest):
        return -1
    if _more_at_meetings(w, m, share, roles, unit, most, plainest) or _leans_otherwise(w, m, best, share, roles, core):
        return -1
    return best


@compiled_within
def _more_between(w: Walked, m: int, unit: float, count: Whole, plain: Array, most: int, plainest: float) -> bool:
    """Whether the full track may have a plainer node inside a step that it divides."""
    divided = False
    for k in range(m - 1):
        if w.grid[k]:
            divided = w.grid[k] == 1
        if not divided or w.v[k + 1] / unit < SLOW or w.v[k] / unit > QUICK:
            continue
        if count[k] > most or count[k + 1] > most:
            return True
        edge = w.v[k] / unit < SLOW or w.v[k + 1] / unit > QUICK  # rising towards the end of the range, it has no peak
        if edge and min(count[k], count[k + 1]) >= most and not max(plain[k], plain[k + 1]) * BETTER < plainest:
            return True
        if w.grid[k] or count[k] < most or k == 0:
            continue
        peak = (count[k - 1] < most or plain[k] >= plain[k - 1]) and (count[k + 1] < most or plain[k] >= plain[k + 1])
        if peak and not plain[k] * BETTER < plainest:
            return True
    return False


@compiled_within
def _more_at_meetings(
    w: Walked, m: int, share: Array, roles: Roles, unit: float, most: int, plainest: float
) -> bool:  # fmt: skip
    """Whether a node next to a meeting may be plainer: who moves in two nearly equal roots is not known there."""
    here, slow = np.empty(w.re.shape[1], np.int64), np.empty(3, np.int64)
    for k in range(m - 1):
        if w.v[k + 1] / unit < SLOW or w.v[k] / unit > QUICK:
            continue
        meet = 0
        for i in range(w.re.shape[1]):
            meet |= 1 << i if w.mate[k, i] != w.mate[k + 1, i] else 0
        if meet:
            for end in range(k, k + 2):
                count = _core_at(w, end, share, roles, here, slow, meet)
                if count > most or (count and count == most and not _plainness(w, end, here) * BETTER < plainest):
                    return True
    return False


@compiled_within
def _leans_otherwise(w: Walked, m: int, best: int, share: Array, roles: Roles, core: Whole) -> bool:
    """Whether another root would be the capsize at a node next to the anchor, in a step that the full track divides."""
    first, second = -1, -1
    for i in range(w.re.shape[1]):
        if core[i] and w.im[best, i] == 0.0:
            first, second = i, first
    for k in (best - 1, best):
        if not 0 <= k < m - 1:
            continue
        node, other = k, k + 1 if k == best else k
        while not w.grid[node]:
            node -= 1
        here = _leaning(share, best, roles, first) >= _leaning(share, best, roles, second)
        there = _leaning(share, other, roles, first) >= _leaning(share, other, roles, second)
        if w.grid[node] == 1 and here != there:
            return True
    return False


@compiled_within
def _leaning(share: Array, k: int, roles: Roles, i: int) -> float:
    lean, steer = float(share[k, roles.lean, i]), float(share[k, roles.steer, i])
    return lean / (lean + steer + 1e-300)


@compiled
def ask_between(t: Track, unit: Array, owner: Whole, v: Array) -> int:
    """Quarters of steps that the full track divides where an anchor may be; fill in ``owner`` and ``v``, say how many.

    Parameters
    ----------
    t : Track
    unit : ndarray, shape (B,)
        m/s.
    owner, v : ndarray, shape (k,)
        Get indices of bicycles and speeds, m/s.
    """
    asked = 0
    for b in range(t.v.shape[0]):
        wanted = 0
        for j in range(t.filled[b] - 1):
            slot = t.order[b, j]
            if t.status[b] != SURE or slot >= t.grid[b] or t.plain[b, slot] or t.v[b, slot] > QUICK * unit[b]:
                continue
            end = j + 1
            while end < t.filled[b] - 1 and t.order[b, end] >= t.grid[b]:
                end += 1
            low, high = t.v[b, slot], t.v[b, t.order[b, end]]
            if high < SLOW * unit[b]:
                continue
            for quarter in range(1, 4):
                place, known = low + 0.25 * quarter * (high - low), False
                for k in range(j + 1, end):
                    known = known or abs(t.v[b, t.order[b, k]] - place) < 0.1 * (high - low)
                if not known and t.filled[b] + wanted < t.v.shape[1]:
                    owner[asked], v[asked] = b, place
                    asked += 1
                    wanted += 1
    return asked


@compiled_within
def _core_at(w: Walked, k: int, share: Array, roles: Roles, here: Whole, slow: Whole, without: int) -> int:
    """Mark the pair and the two real roots among the three slowest of lean, steer and yaw at a node; how many.

    ``without`` has bits of branches that are not among them.
    """
    n = w.re.shape[1]
    here[:] = 0
    taken = 0
    for place in range(3):
        own, least = -1, math.inf
        for i in range(n):
            moving = share[k, roles.lean, i] + share[k, roles.steer, i] + share[k, roles.yaw, i]
            if w.im[k, i] < 0.0 or not moving >= MOSTLY or ((taken | without) >> i) & 1:
                continue
            size = math.hypot(w.re[k, i], w.im[k, i])
            if size < least:
                own, least = i, size
        slow[place] = own
        if own >= 0:
            taken |= 1 << own
    pairs, reals, count = 0, 0, 0
    for place in range(3):
        if slow[place] >= 0 and w.im[k, slow[place]] == 0.0:
            reals += 1
    for place in range(3):
        i = slow[place]
        if i < 0:
            continue
        if w.im[k, i] > 0.0:
            pairs += 1
            here[i] = 1 if pairs == 1 else 0
        else:
            here[i] = 1 if reals == 2 else 0
        count += here[i]
    return count


@compiled_within
def _plainness(w: Walked, k: int, core: Whole) -> float:
    """How far the core is from meeting: among itself, of the pair with itself, and with other modes."""
    n = w.re.shape[1]
    least = math.inf
    for i in range(n):
        if not core[i]:
            continue
        size = math.hypot(w.re[k, i], w.im[k, i])
        if w.im[k, i] > 0.0:
            least = min(least, w.im[k, i] / max(size, 1e-300))
        for j in range(n):
            if j != i and w.im[k, j] >= 0.0:
                gap = math.hypot(w.re[k, i] - w.re[k, j], w.im[k, i] - w.im[k, j])
                least = min(least, gap / (size + math.hypot(w.re[k, j], w.im[k, j]) + 1e-300))
    return least


@compiled_within
def own_core(w: Walked, k: int, share: Array, roles: Roles, core: Whole, name: Whole) -> tuple[int, int]:
    """Owners of the core at the anchor; how many modes, and the number of castering or -1.

    Parameters
    ----------
    w : Walked
    k : int
        Index of the anchor.
    share : ndarray, shape (m, roles, n)
        Of each role in each branch.
    roles : Roles
    core : ndarray of int, shape (n,)
        1 for its branches.
    name : ndarray of int, shape (n,)
        Gets the numbers of the names of its modes.
    """
    n = w.re.shape[1]
    w.owner[:] = -1
    w.double[:] = 0
    modes, first, second = 0, -1, -1
    for i in range(n):
        if core[i] and w.im[k, i] > 0.0:
            w.owner[i] = w.owner[w.mate[k, i]] = 0
            w.double[0] = 1
            name[0] = WEAVE
            modes = 1
        elif core[i]:
            if first < 0 or abs(w.re[k, i]) < abs(w.re[k, first]):
                first, second = i, first
            else:
                second = i
    if first < 0:
        return modes, -1
    if not _leaning(share, k, roles, first) >= _leaning(share, k, roles, second):
        first, second = second, first
    w.owner[first], w.owner[second] = modes, modes + 1
    name[modes], name[modes + 1] = CAPSIZE, CASTERING
    return modes + 2, modes + 1
