"""Names of the roots of many bicycles, compiled: :func:`bicycle.modal.naming.name_branches` on sparse tracks.

Needs numba (extra ``fast``). The rules and their limits are those of :mod:`bicycle.modal.naming`; where they call
themselves unclear, or two nodes or roots are equally good, the bicycle is left to the plain path.
"""

import math
from typing import NamedTuple

import numpy as np

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.modal.anchor import MOSTLY, SLOW, SPARE, WALKING
from bicycle.modal.anchor_kernel import FIRST_ROLE, find_anchor, own_core
from bicycle.modal.batch_kind import Roles
from bicycle.modal.cast_kernel import cast
from bicycle.modal.doubts import NO_ANCHOR, NO_HEIR, NOT_CLEAR, SHORT_PAIR, SURE
from bicycle.modal.identity import APART
from bicycle.modal.identity_kernel import CHANCE, Walked, Whole, walk
from bicycle.modal.naming import FAST, HIGHEST, LOWEST, NEAR_REST, OVERDAMPED, SHORT
from bicycle.modal.track_kernel import Track, mate_of, on_grid
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array

SAME = 1e-6  # of the unit of speed: rounding decides which side a node is of


class Named(NamedTuple):
    """Of each bicycle: roots in branches at its sorted nodes, modes they may belong to as bits, names of the modes."""

    root: Whole  # (B, M, n): number among the roots of the node
    label: Whole  # (B, M, n)
    name: Whole  # (B, n): number of the name of each mode
    anchor: Array  # (B,), m/s


@compiled
def name_all(t: Track, unit: Array, roles: Roles, found: Named, todo: Whole) -> None:
    """Name the roots of bicycles where ``todo`` (B,) is not 0, ``unit`` (B,) in m/s; the unclear get a status.

    Parameters
    ----------
    t : Track
    unit : ndarray, shape (B,)
        m/s.
    roles : Roles
    found : Named
        Filled in.
    todo : ndarray of int, shape (B,)
        Not 0 where a name is asked for.
    """
    bicycles, most, n = t.re.shape
    table = (most, n)
    w = Walked(
        np.empty(most), np.empty(table), np.empty(table), np.empty(table, np.int64), np.empty(table, np.int64),
        np.empty(n, np.int64), np.empty(n, np.int64), np.empty(most, np.int64),
    )  # fmt: skip
    share = np.empty((most, roles.number, n))
    for b in range(bicycles):
        if t.status[b] != SURE or not todo[b]:
            continue
        m = t.filled[b]
        _in_branches(t, b, m, w, found.root[b], share, roles, unit)
        t.status[b] = _name(w, m, share, roles, unit[b], found, b) if _as_whole(t, b, m, found.root[b]) else NO_HEIR
        if t.status[b] == SURE:
            for k in range(m):
                for i in range(n):
                    found.label[b, k, i] = w.label[k, i]


@compiled_within
def _in_branches(t: Track, b: int, m: int, w: Walked, root: Whole, share: Array, roles: Roles, unit: Array) -> None:
    """Roots of the nodes in speed order and of each node in the order of branches; shares of roles where needed."""
    n = w.re.shape[1]
    for i in range(n):
        root[0, i] = i
    for k in range(m):
        slot = t.order[b, k]
        w.v[k] = t.v[b, slot]
        w.grid[k] = 1 + t.plain[b, slot] if on_grid(t, unit, b, slot) else 0
        for i in range(n):
            if k:
                root[k, i] = t.match[b, t.order[b, k - 1], root[k - 1, i]]
            w.re[k, i], w.im[k, i] = t.re[b, slot, root[k, i]], t.im[b, slot, root[k, i]]
        for i in range(n):
            w.mate[k, i] = mate_of(w.re[k], w.im[k], i)
        if SLOW - SPARE <= w.v[k] / unit[b] <= FAST + SPARE:
            for i in range(n):
                for r in range(roles.number):
                    share[k, r, i] = 0.0
                for s in range(n):
                    share[k, roles.of_state[s], i] += t.share[b, slot, s, root[k, i]]


@compiled_within
def _as_whole(t: Track, b: int, m: int, root: Whole) -> bool:
    """Whether nodes inside steps that the full track may take as a whole lead to the same roots as these steps."""
    for k in range(m):
        slot = t.order[b, k]
        if t.until[b, slot] == 0:
            continue
        end = k + 1
        while t.order[b, end] != t.until[b, slot]:
            end += 1
        for i in range(root.shape[1]):
            if root[end, i] != t.whole[b, slot, root[k, i]]:
                return False
    return True


@compiled_within
def _name(w: Walked, m: int, share: Array, roles: Roles, unit: float, found: Named, b: int) -> int:
    """Name one bicycle; the status says whether that is clear."""
    n = w.re.shape[1]
    core = np.empty(n, np.int64)
    anchor = find_anchor(w, m, share, roles, unit, core)
    if anchor < 0:
        return NO_ANCHOR
    low, high = (LOWEST * unit if roles.singular else 0.0), HIGHEST * unit
    found.anchor[b] = w.v[anchor]
    modes, castering = own_core(w, anchor, share, roles, core, found.name[b])
    known = modes
    modes = _others(w, m, anchor, share, roles, modes, low, high)
    if modes < 0:
        return SHORT_PAIR
    if not walk(w, m, modes, castering, anchor, low, high):
        return NO_HEIR
    return SURE if _play(w, m, share, roles, unit, modes, known, found.name[b]) else NOT_CLEAR


@compiled_within
def _others(
    w: Walked, m: int, anchor: int, share: Array, roles: Roles, modes: int, low: float, high: float
) -> int:  # fmt: skip
    """Owners of all other roots, slow first; how many modes there are, -1 where two real roots may be one or not."""
    n, known = w.re.shape[1], modes
    partner = np.full(n, -1, np.int64)
    while True:  # real roots that are a pair at another speed, the nearest first
        p, q = _nearest_couple(w, m, anchor, partner, low, high)
        if p < 0:
            break
        if q < 0:
            return -1
        partner[p], partner[q] = q, p
    if _two_overdamped(w, anchor, share, roles, partner):
        return -1  # rare, and their order counts: left to the plain path
    while True:
        own, least = -1, math.inf
        for i in range(n):
            size = math.hypot(w.re[anchor, i], w.im[anchor, i])
            if w.owner[i] < 0 and size < least:
                own, least = i, size
        if own < 0:
            return -1 if not roles.singular and w.v[0] > 0.0 and _meet_at_rest(w, known) else modes
        other = partner[own] if w.im[anchor, own] == 0.0 else w.mate[anchor, own]
        w.owner[own] = modes
        if other >= 0 and other != own:
            w.owner[other] = modes
            w.double[modes] = 1
        modes += 1


@compiled_within
def _nearest_couple(
    w: Walked, m: int, anchor: int, partner: Whole, low: float, high: float
) -> tuple[int, int]:  # fmt: skip
    """Two real roots that are a pair at the speed nearest to the anchor; none -1 twice, in doubt the second -1."""
    best, p, q, sure = math.inf, -1, -1, False
    second, near = math.inf, 0
    for i in range(w.re.shape[1]):
        for j in range(i):
            free = w.owner[i] < 0 and w.owner[j] < 0 and partner[i] < 0 and partner[j] < 0
            if not free or w.im[anchor, i] != 0.0 or w.im[anchor, j] != 0.0:
                continue
            distance, seen = math.inf, False
            for k in range(m):
                if low <= w.v[k] <= high and w.mate[k, i] == j:
                    distance = min(distance, abs(w.v[k] - w.v[anchor]))
                    seen = seen or w.grid[k] > 0
            if distance < best:
                second, near = best, (1 << p) | (1 << q) if p >= 0 else 0
                best, p, q, sure = distance, i, j, seen
            elif distance < second:
                second, near = distance, (1 << i) | (1 << j)
    if p < 0:
        return -1, -1
    tie = second - best < 2.0 * SHORT * (high / HIGHEST) and near & ((1 << p) | (1 << q)) != 0
    return p, (q if sure and not tie else -1)  # the full track may step over a short pair, or see another first


@compiled_within
def _meet_at_rest(w: Walked, known: int) -> bool:
    """Whether two real roots may be a pair below the first node that is one mode, or blurs names above it.

    One mode: those that are modes by themselves, other than the first ``known``.
    """
    far = NEAR_REST * w.v[0] / (w.v[1] - w.v[0])
    for i in range(w.re.shape[1]):
        for j in range(i):
            p, q = w.owner[i], w.owner[j]
            real = w.im[0, i] == 0.0 and w.im[0, j] == 0.0
            alone = p >= known and q >= known and p != q and not w.double[p] and not w.double[q]
            if alone and not real:
                return True
            if not real or not (alone or _blurred(w, i, j) or _blurred(w, j, i)):
                continue
            first = (w.re[0, i] - w.re[0, j]) ** 2
            second = (w.re[1, i] - w.re[1, j]) ** 2 - (w.im[1, i] - w.im[1, j]) ** 2
            if not first > far * abs(second - first):
                return True
    return False


@compiled_within
def _blurred(w: Walked, i: int, j: int) -> bool:
    """Whether root ``i`` is near to one of another mode at the first node, and nearer than to the other of its own."""
    for k in range(w.re.shape[1]):
        if k not in (i, j) and w.owner[k] == w.owner[i] != w.owner[j]:
            near = _apart(w, i, j)
            return near < APART and near < _apart(w, i, k)
    return False


@compiled_within
def _apart(w: Walked, i: int, j: int) -> float:
    gap = math.hypot(w.re[0, i] - w.re[0, j], w.im[0, i] - w.im[0, j])
    return gap / (math.hypot(w.re[0, i], w.im[0, i]) + math.hypot(w.re[0, j], w.im[0, j]) + 1e-300)


@compiled_within
def _two_overdamped(w: Walked, anchor: int, share: Array, roles: Roles, partner: Whole) -> bool:
    """Whether a joint has two real roots at the anchor that are not a pair elsewhere."""
    for r in range(roles.number):
        alone, every = 0, 0
        for i in range(len(partner)):
            if roles.joint[r] and w.owner[i] < 0 and w.im[anchor, i] == 0.0 and share[anchor, r, i] > MOSTLY:
                every += 1
                alone += 1 if partner[i] < 0 else 0
        if alone and every > 1:
            return True
    return False


@compiled_within
def _play(w: Walked, m: int, share: Array, roles: Roles, unit: float, modes: int, known: int, name: Whole) -> bool:
    """Name the modes of tyres and joints by their mean share over a range of speed; False where that is not clear."""
    n, played = w.re.shape[1], len(roles.weight)
    mean, total = np.zeros((played, modes)), np.full(modes, 1e-300)
    for k in range(m):
        if not WALKING - SAME <= w.v[k] / unit <= FAST + SAME:
            continue
        weight = _weight(w.v, m, k, unit)
        for i in range(n):
            mode = -1
            if w.label[k, i] & CHANCE:
                return False
            for one in range(modes):
                if w.label[k, i] == 1 << one:
                    mode = one
            if mode < known:
                continue
            total[mode] += weight
            for p in range(played):
                part = 0.0
                for r in range(roles.number):
                    part += roles.mark[p, r] * share[k, r, i]
                if roles.oscillation[p] and w.im[k, i] == 0.0:
                    part *= OVERDAMPED
                mean[p, mode] += weight * part
    for mode in range(modes):
        for p in range(played):
            mean[p, mode] /= total[mode]
            if roles.first[p] < 0:
                mean[p, mode] = 0.0
    given = np.full(modes, -1, np.int64)
    if not cast(mean[:, known:], roles.weight, given[known:]):
        return False
    others = 0
    for mode in range(known, modes):
        name[mode] = FIRST_ROLE + given[mode]
        if given[mode] < 0:
            name[mode] = FIRST_ROLE + played + others
            others += 1
    return True


@compiled_within
def _weight(v: Array, m: int, k: int, unit: float) -> float:
    """Weight of node k of an integral as the full track takes it: half a step of it beyond its last node in range."""
    below = 0.5 * STEP if v[k] / unit >= WALKING else -0.5 * STEP
    above = 0.5 * STEP if v[k] / unit <= FAST else -0.5 * STEP
    if k and v[k - 1] / unit >= WALKING - SAME:
        below = 0.5 * (v[k] - v[k - 1]) / unit
    if k + 1 < m and v[k + 1] / unit <= FAST + SAME:
        above = 0.5 * (v[k + 1] - v[k]) / unit
    return below + above
