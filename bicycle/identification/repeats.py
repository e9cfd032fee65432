"""What repeats at about one speed say of the scatter from run to run, which no single run can know.

Runs whose speeds differ by less than 5 % are repeats. Within such a group a number may follow the speed, by the slope
of the line through the neighbouring groups, or by its own line where the speeds spread more than 1.5 %. What is left is
the scatter; a run far outside that of the others is set aside and widened alone, one in eight at most (of fewer: one).
The scatter of a group is its own, weighed against that of all groups, as a scaled inverse chi^2 prior of four degrees
of freedom is (Gelman et al., Bayesian Data Analysis, 3rd ed., 2.6); where an F test parts them, it stands alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, f, t

from tyre.base.arrays import Array

SAME_SPEED = 0.05  # relative
PRIOR = 4.0  # degrees of freedom that the scatter of all groups counts in each
OUTLYING = 0.02  # probability that a sound run of all is set aside
REFUTED = 0.05  # probability of such a scatter where the stated sd are right
FEWEST_ALONE = 3  # degrees of freedom of one speed that show its own scatter
OWN_LINE = 0.015  # relative spread of speeds within a group beyond which it has a slope of its own
NORMAL = 1.959964


@dataclass(frozen=True)
class Repeats:
    """Scatter of one number over runs.

    Attributes
    ----------
    groups : tuple of tuple of int
        Places of the runs at about one speed, by speed.
    scatter : ndarray, shape (runs,)
        Standard deviation of one run about its law in speed, as its repeats say; NaN where there are none at all.
    freedom : int
        Degrees of freedom of all groups together, without the runs set aside.
    aside : tuple of int
        Runs that lie far outside the scatter of the others.
    sd : ndarray, shape (runs,)
        The stated sd, widened where repeats scatter more: a 95 % interval is 1.96 of it to both sides.
    """

    groups: tuple[tuple[int, ...], ...]
    scatter: Array
    freedom: int
    aside: tuple[int, ...]
    sd: Array

    def count(self, run: int) -> int:
        """How many runs are repeats of a ``run`` (its place), itself among them."""
        return next(len(group) for group in self.groups if run in group)


def about_one_speed(speeds: Sequence[float], same: float = SAME_SPEED) -> tuple[tuple[int, ...], ...]:
    """Places of ``speeds`` (m/s) within a share ``same`` of the slowest of their group, by speed."""
    groups: list[list[int]] = []
    for place in np.argsort(speeds, kind="stable").tolist():
        if groups and speeds[place] <= speeds[groups[-1][0]] * (1 + same):
            groups[-1].append(place)
        else:
            groups.append([place])
    return tuple(tuple(group) for group in groups)


def repeats(
    speeds: Sequence[float] | Array, values: Sequence[float] | Array, stated: Sequence[float] | Array
) -> Repeats:
    """Scatter of one number over runs, and what their sd should be.

    Parameters
    ----------
    speeds, values, stated : array_like, shape (runs,)
        Forward speed (m/s), the number, and its sd by each run alone.
    """
    v, y, own = (np.asarray(x, float) for x in (speeds, values, stated))
    groups = about_one_speed(v.tolist())
    slope = _slopes(groups, v, y)
    aside: list[int] = []
    while (worst := _outlier(groups, v, y, slope, aside)) is not None:
        aside.append(worst)
    squares, freedom = _squares(groups, v, y, slope, aside)
    total, all_freedom = sum(squares), sum(freedom)
    scatter, sd = np.full(len(y), np.nan), own.copy()
    shown = not own.all() or chi2.sf(*_surprise(groups, v, y, own, slope, aside)) < REFUTED
    for group, square, nu in zip(groups, squares, freedom, strict=True):
        if not all_freedom:
            break
        prior = min(PRIOR, all_freedom - nu)
        pooled = (total - square) / (all_freedom - nu) if all_freedom > nu else 0.0
        if nu and pooled and _differs(square / nu / pooled, nu, all_freedom - nu):
            prior = 0.0
        variance = (prior * pooled + square) / (prior + nu)
        members = list(group)
        scatter[members] = math.sqrt(variance)
        if not nu and not shown:  # of a speed without repeats nothing is known but what the others show
            continue
        stated_variance = float(np.mean(own[members] ** 2))
        if chi2.sf((prior + nu) * variance / max(stated_variance, 1e-300), prior + nu) < REFUTED:
            few = float(t.ppf(0.975, all_freedom if prior else nu)) / NORMAL  # such an sd is itself uncertain
            sd[members] = np.sqrt(own[members] ** 2 + max(few**2 * variance - stated_variance, 0.0))
    for place in aside:
        group = next(group for group in groups if place in group)
        sd[place] = math.hypot(sd[place], _away(place, group, v, y, slope, aside))
    return Repeats(groups, scatter, all_freedom, tuple(aside), sd)


def surprise(
    speeds: Sequence[float] | Array, values: Sequence[float] | Array, stated: Sequence[float] | Array, same: float
) -> tuple[float, int]:
    """What repeats leave in stated sd, squared and summed, and its degrees of freedom: chi^2 where the sd are right.

    Parameters
    ----------
    speeds, values, stated : array_like, shape (runs,)
        Forward speed (m/s), the number, and its stated sd.
    same : float
        Share by which the speeds of repeats may differ.
    """
    v, y, own = (np.asarray(x, float) for x in (speeds, values, stated))
    groups = about_one_speed(v.tolist(), same)
    return _surprise(groups, v, y, own, _slopes(groups, v, y), ())


def _surprise(
    groups: tuple[tuple[int, ...], ...], v: Array, y: Array, own: Array, slope: Array, aside: Sequence[int]
) -> tuple[float, int]:
    """What the laws of the groups, fitted by stated sd ``own``, leave: chi^2 and its degrees of freedom."""
    total, freedom = 0.0, 0
    for group, s in zip(groups, slope, strict=True):
        kept, law = _law(group, v, aside)
        scaled, level = law / own[kept][:, None], (y[kept] - s * v[kept]) / own[kept]
        left = level - scaled @ np.linalg.lstsq(scaled, level, rcond=None)[0]
        total += float(left @ left)
        freedom += max(len(kept) - law.shape[1], 0)
    return total, freedom


def _differs(ratio: float, own: int, others: int) -> bool:
    """Whether a group's variance over that of the others refutes that they are the same (F test, both sides)."""
    return bool(2 * min(f.sf(ratio, own, others), f.cdf(ratio, own, others)) < REFUTED)


def _slopes(groups: tuple[tuple[int, ...], ...], v: Array, y: Array) -> Array:
    """Change of y with speed at each group, from medians of the groups; shape (groups,)."""
    if len(groups) == 1:
        return np.zeros(1)
    at = np.array([np.mean(v[list(group)]) for group in groups])
    middle = np.array([np.median(y[list(group)]) for group in groups])
    return np.asarray(np.gradient(middle, at))


def _left(
    group: tuple[int, ...], v: Array, y: Array, slope: float, aside: Sequence[int]
) -> tuple[list[int], Array, Array]:
    """Runs of a group that are not set aside, what its law leaves of each, and the share of it that is left.

    The law is a level; where the speeds differ so much that a slope between groups may be wrong, a line of its own.
    """
    kept, law = _law(group, v, aside)
    level = y[kept] - slope * v[kept]
    hat = law @ np.linalg.pinv(law)
    return kept, level - hat @ level, np.maximum(1 - np.diag(hat), 0.0)


def _law(group: tuple[int, ...], v: Array, aside: Sequence[int]) -> tuple[list[int], Array]:
    """Runs of a group that are not set aside, and the columns of its law: a level, perhaps a line."""
    kept = [place for place in group if place not in aside]
    columns = [np.ones(len(kept))]
    if len(kept) > 1 and np.ptp(v[kept]) > OWN_LINE * v[kept].mean():
        columns.append(v[kept] - v[kept].mean())
    return kept, np.stack(columns, 1)


def _squares(
    groups: tuple[tuple[int, ...], ...], v: Array, y: Array, slope: Array, aside: Sequence[int]
) -> tuple[list[float], list[int]]:
    """Sum of squares and degrees of freedom of each group."""
    left = [_left(group, v, y, s, aside) for group, s in zip(groups, slope, strict=True)]
    return [float(x @ x) for _, x, _ in left], [round(float(free.sum())) for _, _, free in left]


def _away(place: int, group: tuple[int, ...], v: Array, y: Array, slope: Array, aside: Sequence[int]) -> float:
    """How far a run lies from the others of its group."""
    number = next(k for k, s in enumerate(about_one_speed(v.tolist())) if s == group)
    kept = [other for other in group if other not in aside and other != place]
    return float(abs(y[place] - slope[number] * v[place] - np.mean(y[kept] - slope[number] * v[kept])))


def _outlier(groups: tuple[tuple[int, ...], ...], v: Array, y: Array, slope: Array, aside: Sequence[int]) -> int | None:
    """The run farthest outside the scatter of all others, if such a one is less likely than 2 %; of three or more."""
    squares, freedom = _squares(groups, v, y, slope, aside)
    total, nu, runs = sum(squares), sum(freedom), len(y) - len(aside)
    worst, largest = None, 0.0
    for group, s, square in zip(groups, slope, squares, strict=True):
        kept, left, free = _left(group, v, y, s, aside)
        own = round(float(free.sum()))
        if own < 2 or nu < 4 or len(aside) >= max(1, len(y) // 8):
            continue
        taken = left**2 / np.maximum(free, 1e-9)  # of the sum of squares, by this run
        others = (total - taken) / (nu - 1)
        if own >= FEWEST_ALONE:  # a speed at which all scatter more has no outlier
            others = np.maximum(others, (square - taken) / (own - 1))
        score = np.sqrt(taken / np.maximum(others, 1e-300))  # t of about nu - 1 degrees of freedom
        if score.max() > largest:
            largest, worst = float(score.max()), kept[int(np.argmax(score))]
    return worst if worst is not None and runs * 2 * t.sf(largest, nu - 1) < OUTLYING else None
