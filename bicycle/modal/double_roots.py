"""Where to put nodes between two that could not be matched: half-way, and all the way down to a meeting of roots.

Two real roots that meet become a pair. Their sum and their discriminant D = (a - b)^2 are smooth there, so Newton on D
tells the meeting speed within a few steps. With it, all the halvings that close in on the meeting are known at once and
computed in one call. What was foreseen is checked against the roots found: the nodes are those of plain bisection.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from math import isfinite

import numpy as np

from bicycle.modal.matching import CLEAR, Nodes
from tyre.base.arrays import Array, Complex

Members = tuple[int, int]

NEWTON_STEPS = 2
WORTH = 4.0  # smallest steps: below it plain bisection is as quick
SHARP = 16.0  # ratio of distances to a meeting: roots that go like its square root are not matched over more than 14


@dataclass
class _Couple:
    """Two real roots, the larger first, or a pair, the upper half first: sum, D = (a - b)^2 and their slopes."""

    members: Members
    sum: float
    sum_slope: float
    d: float
    d_slope: float


Couples = tuple[list[_Couple], list[_Couple]]


def between(a: Nodes, b: Nodes, compute: Callable[[Array], Nodes], smallest: float) -> Nodes:
    """New nodes inside each interval: its middle, or every halving that a meeting asks for.

    Parameters
    ----------
    a, b : Nodes
        Lower and upper ends of k intervals.
    compute : callable
        Nodes at given speeds (m,), m/s.
    smallest : float
        Width (m/s) below which no interval is halved.
    """
    real_a, real_b = ((part.values.imag == 0).sum(1) for part in (a, b))
    alone = (np.abs(real_a - real_b) == 2) & (b.v - a.v > WORTH * smallest)
    if not alone.any():
        return compute((a.v + b.v) / 2)
    k = np.flatnonzero(alone)
    targets = dict(zip(k.tolist(), _double_root_speeds(a.take(k), b.take(k), compute).tolist(), strict=True))
    ends = list(zip(a.v.tolist(), b.v.tolist(), strict=True))
    chains = [list(_halvings(*end, targets[n], smallest)) if n in targets else [] for n, end in enumerate(ends)]
    steps = [step for end, chain in zip(ends, chains, strict=True) for step in pairwise(sorted([*end, *chain]))]
    beside = [v for step in steps for v in _beside(*step, targets.values(), smallest)]
    path = [v for chain in chains for v in chain]
    known = {*path, *beside}
    middles = [(x + y) / 2 for n, (x, y) in enumerate(ends) if n not in targets]
    found = compute(np.array([*path, *beside, *(v for v in middles if v not in known)]))
    real = iter((found.values.imag == 0).sum(1).tolist())
    keep = np.ones(len(found.v), bool)
    start = 0
    for n, chain in enumerate(chains):
        right = _right_turns(chain, [next(real) for _ in chain], int(real_a[n]), int(real_b[n]))
        keep[start + right : start + len(chain)] = False
        start += len(chain)
    if not keep.all():  # another meeting than foreseen
        keep[start : start + len(beside)] = np.isin(beside, middles)
    return found if keep.all() else found.take(np.flatnonzero(keep))


def _halvings(low: float, high: float, target: float, smallest: float) -> Iterator[float]:
    """Middles of the intervals around ``target`` until they are ``smallest``."""
    while high - low > smallest:
        middle = (low + high) / 2
        yield middle
        low, high = (low, middle) if target < middle else (middle, high)


def _beside(low: float, high: float, targets: Collection[float], smallest: float) -> Iterator[float]:
    """Middles of an interval that begins or ends so near to a meeting that roots turn sharply in it."""
    if high - low <= smallest:
        return
    for target in targets:
        near, far = sorted((abs(low - target), abs(high - target)))
        if not low <= target <= high and far > SHARP * near:
            middle = (low + high) / 2
            yield middle
            yield from _beside(low, middle, targets, smallest)
            yield from _beside(middle, high, targets, smallest)
            return


def _right_turns(chain: list[float], counts: list[int], low: int, high: int) -> int:
    """How many halvings followed the change of the number of real roots from ``low`` to ``high``."""
    for number, count in enumerate(counts[:-1]):
        if chain[number + 1] < chain[number]:
            high = count
        else:
            low = count
        if low == high:
            return number + 1
    return len(counts)


def _double_root_speeds(a: Nodes, b: Nodes, compute: Callable[[Array], Nodes]) -> Array:
    """Speeds (k,) at which two real roots of one node meet to be a pair of the other."""
    h = b.v - a.v
    ends = zip(map(_couples, a.values, a.slopes), map(_couples, b.values, b.slopes), h.tolist(), strict=True)
    two = [_same_two(x, y, w) for x, y, w in ends]
    first, last = (
        np.array([[c.d, c.d_slope, c.sum] for c in side]).T for side in ([x for x, _, _ in two], [y for _, y, _ in two])
    )
    t = _zero(first[0], last[0], first[1] * h, last[1] * h)
    speed, total = a.v + t * h, (1 - t) * first[2] + t * last[2]
    for _ in range(NEWTON_STEPS):
        nodes = compute(speed)
        for k, (real, pairs) in enumerate(map(_couples, nodes.values, nodes.slopes)):
            distance = [abs(c.sum - total[k]) + abs(c.d) ** 0.5 for c in (*real, *pairs)]
            near = [*real, *pairs][distance.index(min(distance))]
            total[k] = near.sum
            if near.d_slope and isfinite(near.d / near.d_slope):
                speed[k] = min(max(speed[k] - near.d / near.d_slope, a.v[k]), b.v[k])
    return speed


def steps_with_one(a: Nodes, b: Nodes) -> list[int]:
    """Indices of the intervals from ``a`` to ``b`` in which the number of real roots changes by two."""
    change = (a.values.imag == 0).sum(1) - (b.values.imag == 0).sum(1)
    return list(np.flatnonzero(np.abs(change) == 2).tolist())


def join_double_root(a: Nodes, b: Nodes, k: int) -> tuple[Members, Members] | None:
    """Give the two roots that meet their mean, which is smooth, in place; say which they are.

    None where it is not plain which two: they must be nearer to each other than to any other root.

    Parameters
    ----------
    a, b : Nodes
        Lower and upper ends of the intervals.
    k : int
        Index of the interval.
    """
    h = float(b.v[k] - a.v[k])
    x, y, miss = _same_two(_couples(a.values[k], a.slopes[k]), _couples(b.values[k], b.slopes[k]), h)
    changed = []
    for nodes, two in ((a, x), (b, y)):
        values, slopes = nodes.values[k].copy(), nodes.slopes[k].copy()
        values[list(two.members)], slopes[list(two.members)] = two.sum / 2, two.sum_slope / 2
        others = np.abs(np.delete(values, two.members) - two.sum / 2)
        if max(abs(two.d), miss) ** 0.5 >= 2 * CLEAR * others.min(initial=np.inf):
            return None
        changed.append((nodes, values, slopes))
    for nodes, values, slopes in changed:
        nodes.values[k], nodes.slopes[k] = values, slopes
    return x.members, y.members


def _couples(values: Complex, slopes: Complex) -> Couples:
    """All two real roots of one node (n,), and all its pairs."""
    roots, rates = values.tolist(), slopes.tolist()
    size = {i: -z.real for i, z in enumerate(roots) if not z.imag}
    real = combinations(sorted(size, key=size.__getitem__), 2)
    pairs = [(i, roots.index(z.conjugate())) for i, z in enumerate(roots) if z.imag > 0]
    return [_couple(two, roots, rates) for two in real], [_couple(two, roots, rates) for two in pairs]


def _couple(members: Members, values: list[complex], slopes: list[complex]) -> _Couple:
    i, j = members
    gap, turn = values[i] - values[j], slopes[i] - slopes[j]
    total, rise = values[i] + values[j], slopes[i] + slopes[j]
    return _Couple(members, total.real, rise.real, (gap * gap).real, (2 * gap * turn).real)


def _same_two(first: Couples, last: Couples, h: float) -> tuple[_Couple, _Couple, float]:
    """Which two roots of one end are real and go on as, or come from, which pair of the other; how far D misses."""
    merge = len(first[0]) > len(last[0])
    found = []
    for x in first[0 if merge else 1]:
        sum_x, d_x = x.sum + h / 2 * x.sum_slope, x.d + h / 2 * x.d_slope
        for y in last[1 if merge else 0]:
            miss = abs(d_x - (y.d - h / 2 * y.d_slope))
            found.append((abs(sum_x - (y.sum - h / 2 * y.sum_slope)) + miss**0.5, x, y, miss))
    _, x, y, miss = min(found, key=lambda pick: pick[0])
    return x, y, miss


def _zero(a: Array, b: Array, slope_a: Array, slope_b: Array) -> Array:
    """Where a function of t in (0, 1) with these ends and slopes is zero, by Hermite interpolation of its inverse."""
    with np.errstate(all="ignore"):
        width = b - a
        s = -a / width
        rate_a, rate_b = width / slope_a, width / slope_b
        t = s**2 * (3 - 2 * s) + s * (1 - s) * ((1 - s) * rate_a - s * rate_b)
        good = np.isfinite(t) & (rate_a > 0) & (rate_b > 0) & (t > 0) & (t < 1)
    return np.where(good, t, np.clip(np.nan_to_num(s, nan=0.5), 0, 1))
