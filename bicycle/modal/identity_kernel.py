"""Who is who when roots of two modes meet, compiled: :func:`bicycle.modal.identity.regions` for one bicycle.

Needs numba (extra ``fast``). Sets of modes are bits of a number. What the rules leave to chance (two equal ways to
share pairs out) is not decided here but left to the plain path, as is what they call unclear.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled_within
from bicycle.modal.identity import APART, MUCH_FASTER, PLAIN
from bicycle.modal.naming import HIGHEST
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array

Whole = NDArray[np.int64]
CHANCE = 1 << 60  # beside the modes of a label: rounding decides which of them
WIDE = 1.5 * STEP / HIGHEST  # of the highest speed always tracked: the full track divides such a step


class Walked(NamedTuple):
    """What is known of one bicycle: nodes (m,), roots in branches (m, n), and the modes at the anchor."""

    v: Array  # (m,), m/s
    re: Array  # (m, n), 1/s
    im: Array
    mate: Whole  # (m, n)
    label: Whole  # (m, n), filled in: modes a root may belong to, as bits
    owner: Whole  # (n,), at the anchor
    double: Whole  # (n,), 1 for a mode of two roots
    grid: Whole  # (m,), 0 for a node that the full track may not have, 2 where it has none on the way to the next


@compiled_within
def walk(w: Walked, m: int, modes: int, castering: int, anchor: int, low: float, high: float) -> bool:
    """Fill in the labels up and down from the ``anchor``; False where it is not clear.

    Parameters
    ----------
    w : Walked
    m, modes : int
        Number of nodes and of modes.
    castering : int
        Number of the castering mode, or -1.
    anchor : int
        Index of the node at which ``w.owner`` holds.
    low, high : float
        Speeds always tracked, m/s.
    """
    n = w.re.shape[1]
    owner, now, chance = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    hidden = np.empty(n, np.int64)
    for way in range(2):
        for i in range(n):  # owner[:] = w.owner takes three seconds more to compile
            owner[i] = w.owner[i]
        chance[:] = 0
        hidden[:] = 0
        k, past = anchor, -1
        while 0 <= k < m:
            changed = past < 0
            for i in range(n):
                changed = changed or w.mate[k, i] != w.mate[past, i]
            if past >= 0 and (_halves_part(w, k, past, owner, chance) or _stepped_over(w, k, past, owner, hidden)):
                return False
            if changed and not _assign(w, k, anchor, way, modes, castering, owner, now, low, high):
                return False
            for i in range(n):
                w.label[k, i] = now[i] | chance[i]
            past = k
            k += 1 if way == 0 else -1
    return True


@compiled_within
def _halves_part(w: Walked, k: int, past: int, owner: Whole, chance: Whole) -> bool:
    """Mark the roots of a pair of two modes that splits, as rounding decides which is whose; True if they meet again.

    That is where the step of the full track next to the meeting has two roots that are equal to rounding.
    """
    for i in range(w.re.shape[1]):
        mate = w.mate[past, i]
        if mate != w.mate[k, i] and owner[i] != owner[mate]:
            chance[i] = chance[mate] = CHANCE
    again = False
    for i in range(w.re.shape[1]):
        again = again or (chance[i] != 0 and w.mate[k, i] != i)
    return again


@compiled_within
def _stepped_over(w: Walked, k: int, past: int, owner: Whole, hidden: Whole) -> bool:
    """Mark pairs of two modes that no certain node has shown yet; True if one is gone: the full track may miss it."""
    gone = False
    for i in range(w.re.shape[1]):
        if w.mate[k, i] != w.mate[past, i]:
            gone = gone or hidden[i] != 0
            hidden[i] = 1 if owner[i] != owner[w.mate[k, i]] else 0
        if w.grid[k]:
            hidden[i] = 0
    return gone


@compiled_within
def _assign(
    w: Walked, k: int, anchor: int, way: int, modes: int, castering: int, owner: Whole, now: Whole,
    low: float, high: float,
) -> bool:  # fmt: skip
    """Labels ``now`` at node k; roots that change hands blur what lies behind. False where it is not clear."""
    n = w.re.shape[1]
    group = np.zeros(modes, np.int64)  # modes tied to each
    before = owner.copy()
    for i in range(n):
        now[i] = 1 << owner[i]
        if owner[i] != owner[w.mate[k, i]]:
            group[owner[i]] |= (1 << owner[i]) | (1 << owner[w.mate[k, i]])
    for _ in range(modes):  # groups that share a member are one
        for mode in range(modes):
            for other in range(modes):
                if (group[mode] >> other) & 1:
                    group[mode] |= group[other]
    done = 0
    for mode in range(modes):
        if group[mode] == 0 or (done >> mode) & 1:
            continue
        done |= group[mode]
        found = _assign_group(w, k, owner, group[mode], modes, castering)
        if found < 0:
            return False
        for i in range(n):
            if (group[mode] >> before[i]) & 1:
                now[i] = (1 << owner[i]) if found < 2 else _joint(w, group[mode], modes, castering)
        inside = low <= w.v[k] <= high  # outside, whether it is seen hangs on what else is asked for
        if found == 1 and inside and not _blur(w, k, anchor, way, before, group[mode], modes, WIDE * high):
            return False
    return True


@compiled_within
def _joint(w: Walked, group: int, modes: int, castering: int) -> int:
    """Label of roots that may belong to any mode of a group; castering and one root of a tyre are wobble."""
    single, tyre, tyres, every = 0, -1, 0, 0
    for mode in range(modes):
        if (group >> mode) & 1:
            every += 1
            if w.double[mode] == 0:
                single += 1
                if mode != castering:
                    tyres += 1
                    tyre = mode
    only_these = castering >= 0 and (group >> castering) & 1 == 1 and tyres == 1 and single == every
    return 1 << tyre if only_these and tyre >= castering + 1 else group


@compiled_within
def _assign_group(w: Walked, k: int, owner: Whole, group: int, modes: int, castering: int) -> int:
    """Give roots back to their modes: 1 where any changed hands, 0 none, 2 it cannot be told, -1 it is not clear."""
    n = w.re.shape[1]
    pairs, reals, double, single = 0, 0, 0, 0
    for i in range(n):
        if (group >> owner[i]) & 1:
            if w.im[k, i] > 0.0:
                pairs += 1
            elif w.im[k, i] == 0.0:
                reals += 1
    for mode in range(modes):
        if (group >> mode) & 1:
            if w.double[mode]:
                double += 1
            else:
                single += 1
    if pairs != double or reals != single:
        return 2
    if pairs and reals:
        slow_pair, fast_pair, slow_real, fast_real = math.inf, 0.0, math.inf, 0.0
        for i in range(n):
            if (group >> owner[i]) & 1:
                size = math.hypot(w.re[k, i], w.im[k, i])
                if w.im[k, i] > 0.0:
                    slow_pair, fast_pair = min(slow_pair, size), max(fast_pair, size)
                elif w.im[k, i] == 0.0:
                    slow_real, fast_real = min(slow_real, size), max(fast_real, size)
        if castering >= 0 and (group >> castering) & 1 and single == 1:
            a, b = slow_pair, slow_real
        else:
            a, b = fast_real, MUCH_FASTER * fast_pair
        if b / PLAIN < a < b * PLAIN:
            return -1
        if not a <= b:
            return 2
    return _hand_over(w, k, owner, group, modes)


@compiled_within
def _hand_over(w: Walked, k: int, owner: Whole, group: int, modes: int) -> int:
    """Give pairs to the modes that had most of them, what remains to the single modes; 1 if any changed."""
    n = w.re.shape[1]
    pairs, double = np.empty(n, np.int64), np.empty(n, np.int64)
    many = 0
    for i in range(n):
        if (group >> owner[i]) & 1 and w.im[k, i] > 0.0:
            pairs[many] = i
            many += 1
    seen = 0
    for mode in range(modes):
        if (group >> mode) & 1 and w.double[mode]:
            double[seen] = mode
            seen += 1
    best, again = np.zeros(1 << many, np.int64), np.zeros(1 << many, np.int64)
    choice = np.zeros((many, 1 << many), np.int64)
    for mask in range(1, 1 << many):  # modes given to the first pairs: most roots kept, and in how many ways
        row = -1
        for d in range(many):
            row += (mask >> d) & 1
        best[mask] = -1
        for d in range(many):
            if (mask >> d) & 1:
                rest = mask & ~(1 << d)
                i = pairs[row]
                kept = (1 if owner[i] == double[d] else 0) + (1 if owner[w.mate[k, i]] == double[d] else 0)
                if best[rest] + kept > best[mask]:
                    best[mask], choice[row, mask], again[mask] = best[rest] + kept, d, again[rest]
                elif best[rest] + kept == best[mask]:
                    again[mask] = 1
    if again[(1 << many) - 1]:
        return -1
    target = owner.copy()
    mask = (1 << many) - 1
    for row in range(many - 1, -1, -1):
        d = choice[row, mask]
        target[pairs[row]] = target[w.mate[k, pairs[row]]] = double[d]
        mask &= ~(1 << d)
    return _give_reals(w, k, owner, target, group, modes)


@compiled_within
def _give_reals(w: Walked, k: int, owner: Whole, target: Whole, group: int, modes: int) -> int:
    """Real roots of pairs that are gone become those of the single modes that have none; 1 if any root changed."""
    n = w.re.shape[1]
    kept_by, free, lost, changed = 0, 0, 0, 0
    for i in range(n):
        if (group >> owner[i]) & 1 and w.im[k, i] == 0.0 and not w.double[owner[i]]:
            kept_by |= 1 << owner[i]
    for i in range(n):
        if (group >> owner[i]) & 1 and w.im[k, i] == 0.0 and w.double[owner[i]]:
            free += 1
            lost = 0
            for mode in range(modes):
                if (group >> mode) & 1 and not w.double[mode] and not (kept_by >> mode) & 1:
                    lost += 1
                    target[i] = mode
    if free > 1 or lost > 1:
        return -1  # the rules go by size: rare, and left to the plain path
    for i in range(n):
        changed += 1 if target[i] != owner[i] else 0
        owner[i] = target[i]
    return 1 if changed else 0


@compiled_within
def _blur(w: Walked, k: int, anchor: int, way: int, before: Whole, group: int, modes: int, wide: float) -> bool:
    """Lose identity back from where roots changed hands, where those of two modes were close; False if it may end."""
    n = w.re.shape[1]
    regular = 0
    for mode in range(modes):
        regular += 1 if (group >> mode) & 1 and w.double[mode] else 0
    step = -1 if way == 0 else 1
    past = k + step
    while (past >= anchor) if way == 0 else (past <= anchor):
        pairs, lost = 0, False
        for i in range(n):
            pairs += 1 if (group >> before[i]) & 1 and w.im[past, i] > 0.0 else 0
        if pairs == regular:
            break
        for i in range(n):
            if not (group >> before[i]) & 1:
                continue
            own, other = -1.0, math.inf
            size = math.hypot(w.re[past, i], w.im[past, i])
            for j in range(n):
                if j == i or not (group >> before[j]) & 1:
                    continue
                gap = math.hypot(w.re[past, i] - w.re[past, j], w.im[past, i] - w.im[past, j])
                near = gap / (size + math.hypot(w.re[past, j], w.im[past, j]) + 1e-300)
                if before[i] == before[j]:
                    own = max(own, near)
                else:
                    other = min(other, near)
            lost = lost or (other < own and other < APART)
        if not lost:
            break
        if abs(w.v[past] - w.v[past - step]) > wide:  # the full track has nodes there at which it may end
            return False
        for i in range(n):
            if (group >> before[i]) & 1:
                w.label[past, i] = group
        past += step
    return True
