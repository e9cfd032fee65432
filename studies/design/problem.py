"""The smallest change that keeps every demand at every speed, solved by exchange: the worst speeds join the problem.

A demand over a range of speed is one constraint for each speed. Only the speeds at which it is missed most are kept:
they are found exactly for the numbers at hand, the problem with these speeds is solved (SLSQP with derivatives of the
roots), and so on until no further speed misses the demand (Hettich & Kortanek 1993, SIAM Rev. 35, 380-429).
"""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from studies.design.constraints import Followed
from studies.design.cost import Cost, Limits
from studies.design.demand import Demand
from studies.design.worst_speeds import Peak, at_speeds, peaks
from studies.model_axes.model_space import ModelSpace
from tyre.base.arrays import Array

ROUNDS = 14
KEPT = 1e-6  # 1/s: a demand missed by less is kept
CLEARLY = 1e-5  # 1/s by which a demand is to be kept, so that rounding does not undo it
SETTLED = 1e-7  # of the cost, by which the last rounds may differ
SAME_SPEED = 1e-3  # of the speed: peaks nearer than this are one
NEARLY = 3.0  # 1/s: peaks that keep their demand by more than this are left out
REGION = 0.35  # of the limits: the longest move of a number in a round
STILL = 1e-6  # of what counts as 1: a round that moves no number farther repeats the one before
MENDED = 4  # steps back to where the demands are kept


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked.

    Attributes
    ----------
    space : ModelSpace
        With the numbers that are varied, d of them.
    start : ndarray, shape (d,)
        As they stand, in their units.
    cost, limits : Cost, Limits
    demands : tuple of Demand
    speeds : ndarray, shape (m,)
        m/s, at which modes are looked at.
    """

    space: ModelSpace
    start: Array
    cost: Cost
    limits: Limits
    demands: tuple[Demand, ...]
    speeds: Array

    def peaks(self, x: Array) -> list[Peak]:
        """Every local maximum along speed of every demand, for numbers ``x`` (d,) in their units."""
        return peaks(self.space.linear_at(x), self.demands, self.speeds)

    def span(self) -> Array:
        """How far each number may move in a round, (d,), in its unit."""
        return REGION * np.maximum(self.limits.high - self.limits.low, 1e-300)


@dataclass(frozen=True, eq=False)
class Answer:
    """Numbers ``x`` (d,), their cost, the peaks there, and by how much the worst demand is missed (1/s, < 0: kept)."""

    x: Array
    cost: float
    peaks: tuple[Peak, ...]
    missed: float

    @property
    def kept(self) -> bool:
        """Whether every demand is kept."""
        return self.missed <= KEPT


def solved(problem: Problem, margins: Mapping[Demand, float], begin: Array) -> Answer:
    """The cheapest change from one beginning; the best reachable margin where no change keeps every demand.

    Parameters
    ----------
    problem : Problem
    margins : mapping of Demand to float
        By how much each is to be kept, 1/s.
    begin : ndarray, shape (d,)
        Numbers to begin with, in their units.
    """
    x, working = begin.copy(), list[tuple[Demand, float]]()
    best: Answer | None = None
    region, last = 1.0, np.inf
    for number in range(ROUNDS):
        found = problem.peaks(x)
        missed = max((peak.excess + margins.get(peak.demand, 0.0) for peak in found), default=-np.inf)
        answer = Answer(x, problem.cost.of(x - problem.start), tuple(found), missed)
        settled = best is not None and answer.kept and abs(answer.cost - last) <= SETTLED * max(answer.cost, 1e-12)
        last = answer.cost
        if best is None or _better(answer, best):
            best = answer
        if settled or (number == 0 and answer.kept and answer.cost == 0.0):
            break
        if number > ROUNDS // 2:
            region /= 2
        near = _joined(problem, working, found, margins, x)
        if not near:
            break
        working = [(peak.demand, peak.speed) for peak in near]
        ahead = _step(problem, near, margins, x, region)
        if number and (np.abs(ahead - x) <= STILL * problem.cost.scale).all():  # held by limits or by a kink of a tyre
            break
        x = ahead
    assert best is not None
    return best


def _better(one: Answer, other: Answer) -> bool:
    if one.kept != other.kept:
        return one.kept
    return one.cost < other.cost if one.kept else one.missed < other.missed


def _joined(
    problem: Problem, working: Sequence[tuple[Demand, float]], found: Sequence[Peak], margins: Mapping[Demand, float],
    x: Array,
) -> list[Peak]:  # fmt: skip
    """The peaks that matter, and the speeds of earlier rounds with their roots at these numbers."""
    most = {demand: max(p.excess for p in found if p.demand == demand) for demand in {p.demand for p in found}}
    near = [
        peak for peak in found
        if peak.excess + margins.get(peak.demand, 0.0) > -NEARLY or peak.excess == most[peak.demand]
    ]  # fmt: skip
    old = [
        (demand, speed) for demand, speed in working
        if not any(peak.demand == demand and abs(peak.speed - speed) <= SAME_SPEED * speed for peak in near)
    ]  # fmt: skip
    if old:
        near += at_speeds(problem.space.linear_at(x), old)
    return near


def _step(problem: Problem, near: Sequence[Peak], margins: Mapping[Demand, float], x: Array, region: float) -> Array:
    """The cheapest numbers that keep the demands at these speeds, within the region about x."""
    scale, start = problem.cost.scale, problem.start
    margin = np.array([margins.get(peak.demand, 0.0) + CLEARLY for peak in near])
    reach = region * problem.span()
    low, high = np.maximum(problem.limits.low, x - reach), np.minimum(problem.limits.high, x + reach)
    followed = Followed(problem.space, near, x)

    def kept(y: Array) -> Array:
        return np.asarray(-followed.excess(start + scale * y) - margin)

    def slopes(y: Array) -> Array:
        return np.asarray(-followed.excess_slopes(start + scale * y) * scale)

    y0 = np.clip((x - start) / scale, (low - start) / scale, (high - start) / scale)
    bounds = list(zip((low - start) / scale, (high - start) / scale, strict=True))
    constraint: Any = {"type": "ineq", "fun": kept, "jac": slopes}
    found = _solved(
        lambda y: 0.5 * float(y @ y), y0, jac=lambda y: y, bounds=bounds, constraints=[constraint],
        options={"maxiter": 40, "ftol": 1e-14},
    )  # fmt: skip
    y = np.clip(found.x, *np.transpose(bounds))
    if np.isfinite(y).all() and kept(y).min() > -1e-3:
        for _ in range(MENDED):  # where a tyre's table has a kink, the solver ends a little beside the demand
            short = -kept(y)
            if (short <= 0).all():
                break
            y = np.clip(y + np.linalg.pinv(slopes(y)[short > 0]) @ short[short > 0], *np.transpose(bounds))
        return np.asarray(start + scale * y)
    return _least_missed(problem, Followed(problem.space, near, x), margin, x, (low, high))


def _solved(*given: Any, **settings: Any) -> Any:
    """SLSQP; scipy before 1.12 warns of steps that leave the bounds by rounding, and clips them as later ones do."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
        return minimize(*given, method="SLSQP", **settings)


def _least_missed(problem: Problem, followed: Followed, margin: Array, x: Array, box: tuple[Array, Array]) -> Array:
    """Numbers with which the demand that is missed most is missed least."""
    scale, start = problem.cost.scale, problem.start
    ends = [(end - start) / scale for end in box]
    y0 = (x - start) / scale
    t0 = float((followed.excess(x) + margin).max())
    constraint: Any = {
        "type": "ineq",
        "fun": lambda z: z[-1] - followed.excess(start + scale * z[:-1]) - margin,
        "jac": lambda z: np.hstack(
            [-followed.excess_slopes(start + scale * z[:-1]) * scale, np.ones((len(margin), 1))]
        ),
    }
    down = np.r_[np.zeros(len(y0)), 1.0]
    found = _solved(
        lambda z: float(z[-1]), np.r_[y0, t0], jac=lambda z: down,
        bounds=[*zip(*ends, strict=True), (None, None)], constraints=[constraint],
        options={"maxiter": 30, "ftol": 1e-10},
    )  # fmt: skip
    y = np.clip(found.x[:-1], *ends)
    better = np.isfinite(y).all() and (followed.excess(start + scale * y) + margin).max() < t0 + 1e-6
    return np.asarray(start + scale * y) if better else x
