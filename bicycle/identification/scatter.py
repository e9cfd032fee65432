"""Weigh the scatter from run to run, which no single run can know, by what repeats at about one speed show.

Runs whose speeds differ by less than 5 % are repeats. Within such a group a number may follow the speed, by the slope
of the line through the neighbouring groups, or by its own line if the speeds spread more than 1.5 %. The rest is the
scatter; a run far outside that of the others is set aside and widened alone, one in eight at most (of fewer: one).
The scatter of a group is its own, weighed against that of all groups, as a scaled inverse chi^2 prior of four degrees
of freedom is (Gelman et al., Bayesian Data Analysis, 3rd ed., 2.6); if an F test parts them, it stands alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, fdtr, fdtrc, stdtr, stdtrit

from tyre.ground.arrays import Array

SAME_SPEED = 0.05  # relative
OWN_LINE = 0.015  # relative spread of speeds within a group beyond which it has a slope of its own
REFUTED = 0.05  # probability of such a scatter if the stated sd are right
Numbers = Sequence[float] | Array


@dataclass(frozen=True)
class Repeats:
    """Scatter of one number over runs."""

    groups: tuple[tuple[int, ...], ...]  # places of the runs at about one speed, by speed
    scatter: Array  # (runs,), sd of one run about its law in speed, as its repeats say; NaN without any
    freedom: int  # degrees of freedom of all groups together, without the runs set aside
    aside: tuple[int, ...]  # runs that lie far outside the scatter of the others
    sd: Array  # (runs,), stated sd, widened if repeats scatter more: a 95 % interval is 1.96 of it to both sides

    def count(self, run: int) -> int:
        """Number of repeats of a ``run`` (its place), itself among them."""
        return next(len(group) for group in self.groups if run in group)


@dataclass(frozen=True)
class _Group:
    """Runs at about one speed that are not set aside, and the columns of their law in speed."""

    kept: list[int]  # places of the runs
    law: Array  # (runs, 1) a level, or (runs, 2) with a line of its own
    level: Array  # numbers less the slope between groups
    slope: float  # of the number over the speed, per m/s, as the neighbouring groups show it

    def residual(self) -> tuple[Array, Array]:
        """Residual (runs,) of each run about the law, and the share (runs,) of its variance that the fit leaves."""
        hat = self.law @ np.linalg.pinv(self.law)
        return self.level - hat @ self.level, np.maximum(1 - np.diag(hat), 0.0)

    def square(self) -> tuple[float, int]:
        """Sum of squares of the residuals and its degrees of freedom."""
        residuals, free = self.residual()
        return float(residuals @ residuals), round(float(free.sum()))


def about_one_speed(speeds: Sequence[float], tolerance: float = SAME_SPEED) -> tuple[tuple[int, ...], ...]:
    """Group places of ``speeds`` (m/s) within a share ``tolerance`` of the slowest of their group, by speed."""
    groups: list[list[int]] = []
    for place in np.argsort(speeds, kind="stable").tolist():
        if groups and speeds[place] <= speeds[groups[-1][0]] * (1 + tolerance):
            groups[-1].append(place)
        else:
            groups.append([place])
    return tuple(tuple(group) for group in groups)


def repeats(speeds: Numbers, values: Numbers, stated_sds: Numbers) -> Repeats:
    """Find the scatter of ``values`` at ``speeds`` (m/s), and what their stated sd, ``stated_sds``, should be."""
    v, y, stated_sd = (np.asarray(x, float) for x in (speeds, values, stated_sds))
    members = about_one_speed(v.tolist())
    aside: list[int] = []
    while (worst := _outlier(_group_runs(members, v, y, aside), len(y), len(aside))) is not None:
        aside.append(worst)
    groups = _group_runs(members, v, y, aside)
    squares = [group.square() for group in groups]
    total, freedom = (sum(column) for column in zip(*squares, strict=True))
    scatter = np.full(len(y), np.nan)
    sd = stated_sd.copy()
    is_measured = not stated_sd.all() or chdtrc(*_surprise(groups, stated_sd)[::-1]) < REFUTED
    for places, (square, nu) in zip(map(list, members), squares, strict=True):
        if not freedom:
            break
        other_freedom = freedom - nu
        prior = min(4.0, other_freedom)
        pooled = (total - square) / other_freedom if other_freedom else 0.0
        ratio = square / nu / pooled if nu and pooled else 1.0
        if nu and pooled and 2 * min(fdtrc(nu, other_freedom, ratio), fdtr(nu, other_freedom, ratio)) < REFUTED:
            prior = 0.0
        variance = (prior * pooled + square) / (prior + nu)
        scatter[places] = math.sqrt(variance)
        if not nu and not is_measured:  # of a speed without repeats nothing is known but what the others show
            continue
        own_variance = float(np.mean(stated_sd[places] ** 2))
        if chdtrc(prior + nu, (prior + nu) * variance / max(own_variance, 1e-300)) < REFUTED:
            widening = float(stdtrit(freedom if prior else nu, 0.975)) / 1.959964  # such an sd is itself uncertain
            sd[places] = np.sqrt(stated_sd[places] ** 2 + max(widening**2 * variance - own_variance, 0.0))
    for place in aside:
        group = next(group for group_places, group in zip(members, groups, strict=True) if place in group_places)
        sd[place] = math.hypot(sd[place], float(abs(y[place] - group.slope * v[place] - np.mean(group.level))))
    return Repeats(members, scatter, freedom, tuple(aside), sd)


def surprise(speeds: Numbers, values: Numbers, stated_sds: Numbers, tolerance: float) -> tuple[float, int]:
    """Residuals of repeats over their stated sd, squared and summed, and the degrees of freedom: chi^2 of right sd."""
    v, y, sds = (np.asarray(x, float) for x in (speeds, values, stated_sds))
    return _surprise(_group_runs(about_one_speed(v.tolist(), tolerance), v, y, []), sds)


def _surprise(groups: Sequence[_Group], sds: Array) -> tuple[float, int]:
    scaled = [(group.law / sds[group.kept][:, None], group.level / sds[group.kept]) for group in groups]
    residuals = [level - law @ np.linalg.lstsq(law, level, rcond=None)[0] for law, level in scaled]
    return float(sum(residual @ residual for residual in residuals)), sum(
        max(len(law) - law.shape[1], 0) for law, _ in scaled
    )


def _group_runs(members: Sequence[Sequence[int]], v: Array, y: Array, aside: Sequence[int]) -> list[_Group]:
    """Groups without the runs set aside; the slope at each follows from medians of all groups."""
    slopes = np.zeros(1)
    if len(members) > 1:
        at = np.array([np.mean(v[list(group)]) for group in members])
        slopes = np.gradient(np.array([np.median(y[list(group)]) for group in members]), at)
    groups = []
    for group, slope in zip(members, slopes, strict=True):
        remaining = [place for place in group if place not in aside]
        columns = [np.ones(len(remaining))]
        if len(remaining) > 1 and np.ptp(v[remaining]) > OWN_LINE * v[remaining].mean():
            columns.append(v[remaining] - v[remaining].mean())
        groups.append(_Group(remaining, np.stack(columns, 1), y[remaining] - slope * v[remaining], float(slope)))
    return groups


def _outlier(groups: Sequence[_Group], count: int, aside: int) -> int | None:
    """The run farthest outside the scatter of all others, if such a one is less likely than 2 %; of three or more."""
    squares = [group.square() for group in groups]
    total, nu = (sum(column) for column in zip(*squares, strict=True))
    worst, largest = None, 0.0
    for group, (square, group_freedom) in zip(groups, squares, strict=True):
        if group_freedom < 2 or nu < 4 or aside >= max(1, count // 8):
            continue
        residuals, free = group.residual()
        of_run = residuals**2 / np.maximum(free, 1e-9)  # of the sum of squares, by this run
        variance_of_others = (total - of_run) / (nu - 1)
        if group_freedom >= 3:  # a speed at which all scatter more has no outlier
            variance_of_others = np.maximum(variance_of_others, (square - of_run) / (group_freedom - 1))
        score = np.sqrt(of_run / np.maximum(variance_of_others, 1e-300))  # t of about nu - 1 degrees of freedom
        if score.max() > largest:
            largest = float(score.max())
            worst = group.kept[int(np.argmax(score))]
    return worst if worst is not None and (count - aside) * 2 * stdtr(nu - 1, -largest) < 0.02 else None
