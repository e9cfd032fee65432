"""A design: the numbers as they stand, as they should be, what binds, what else changes, and how sure it is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bicycle.modal.named_modes import modes
from studies.design.certainty import ALONG, Certainty, certainty
from studies.design.cost import base_of, cost_of, limits_of
from studies.design.demand import Demand, expanded, grid
from studies.design.problem import CLEARLY, Answer, Problem, solved
from studies.design.worst_speeds import Peak
from studies.model_axes.changed_content import changed_content
from studies.model_axes.model_space import ModelSpace
from studies.uncertainty.uncertain_model import UncertainModel
from tyre.base.arrays import Array
from tyre.base.errors import InputError

STARTS = 4  # beginnings of the search: the model as it stands, and points within the limits
BINDS = 1e-3  # 1/s: a demand kept by less binds
AT_LIMIT = 1e-6  # of the limits
BACK_OFFS = 8
SAMPLES = 1000
SAME_COST = 1e-3  # starts whose costs differ by less found the same


@dataclass(frozen=True, eq=False)
class Design:
    """What was found.

    Attributes
    ----------
    problem : Problem
    before, after : Answer
        The model as it stands, and as it should be (or as near as it comes).
    agreed : tuple of (int, int)
        How many of how many beginnings that kept every demand came to the same cost.
    unstable : tuple of dict
        Before and after: name of a mode -> (lowest, highest speed looked at at which it is unstable, largest real
        part), m/s and 1/s.
    certainty : Certainty or None
        None where nothing is uncertain.
    margins : mapping of Demand to float
        By how much each demand was to be kept, 1/s, for the probability asked for.
    probability : float or None
        That was asked for.
    """

    problem: Problem
    before: Answer
    after: Answer
    agreed: tuple[int, int]
    unstable: tuple[dict[str, tuple[float, float, float]], dict[str, tuple[float, float, float]]]
    certainty: Certainty | None
    margins: Mapping[Demand, float]
    probability: float | None

    @property
    def binding(self) -> list[Peak]:
        """Peaks whose demand is kept by hardly more than asked for; where it cannot be kept, those missed most."""
        found = self.after.peaks
        if not self.after.kept:
            most = max(p.excess + self.margins.get(p.demand, 0.0) for p in found)
            return [p for p in found if p.excess + self.margins.get(p.demand, 0.0) > most - 10 * BINDS]
        return [p for p in found if abs(p.excess + self.margins.get(p.demand, 0.0)) < BINDS]

    @property
    def at_limit(self) -> list[tuple[str, float, str]]:
        """Keys whose number stands at a limit, the limit in its unit, and what sets it."""
        limits, x, found = self.problem.limits, self.after.x, []
        for i, axis in enumerate(self.problem.space.axes):
            width = limits.high[i] - limits.low[i]
            for end in (limits.low[i], limits.high[i]):
                if abs(x[i] - end) <= AT_LIMIT * width and abs(x[i] - self.problem.start[i]) > AT_LIMIT * width:
                    found.append((axis.key, float(end), limits.why[i]))
        return found

    @property
    def content(self) -> dict[str, Any]:
        """The content of the corrected model file, with absolute paths."""
        return changed_content(self.problem.space, self.after.x)


@dataclass(frozen=True)
class Wanted:
    """What a design is asked for besides its demands.

    Attributes
    ----------
    costs, sd : mapping of str to float
        Cost of a change by one unit; further standard deviations, SI.
    limits : mapping of str to (float, float)
        By key, in its unit.
    assume : bool
        Whether what nobody states has a default standard deviation.
    probability : float or None
        Least share of drawn bicycles that keep every demand.
    samples, seed : int
        Draws of the probability.
    """

    costs: Mapping[str, float]
    sd: Mapping[str, float]
    limits: Mapping[str, tuple[float, float]]
    assume: bool = False
    probability: float | None = None
    samples: int = SAMPLES
    seed: int = 0


def designed(
    content: Mapping[str, Any],
    keys: Sequence[str],
    asked: Sequence[Demand],
    speeds: tuple[float, float],
    wanted: Wanted,
) -> Design:
    """The smallest change of some numbers of a model that keeps every demand over a range of speed.

    Parameters
    ----------
    content : mapping
        Of a model file, with absolute paths.
    keys : sequence of str
        The numbers that are varied.
    asked : sequence of Demand
    speeds : pair of float
        Lowest and highest speed, m/s.
    wanted : Wanted

    Raises
    ------
    InputError
        A number that cannot be varied, a mode that there is not, speeds that the model does not allow, or a
        probability of a model of which nothing is uncertain.
    """
    space = ModelSpace(content, keys)
    start, looked = base_of(space), grid(*speeds)
    space.linear.check_speeds(looked)
    demands = expanded(asked, space.linear, looked)
    limits = limits_of(space, wanted.limits)
    cost = cost_of(space, wanted.costs, wanted.sd, assume=wanted.assume)
    space.refuse_impossible([start])
    problem = Problem(space, start, cost, limits, demands, looked)
    before = _answer(problem, start)
    uncertain = _uncertain(content, wanted)
    if wanted.probability is not None and uncertain is None:
        raise InputError(
            f"--probability {wanted.probability:g}: nothing is uncertain; give --sd NAME=VALUE, or --assume"
        )
    margins: dict[Demand, float] = {}
    after, agreed = _best(problem, margins, wanted.seed)
    if wanted.probability is not None and after.kept:
        after, agreed, margins = _sure(problem, after, agreed, wanted, wanted.probability)
    sure = None if uncertain is None else _certainty(problem, after, wanted, wanted.seed + 1)
    unstable = (_unstable(problem, start), _unstable(problem, after.x))
    return Design(problem, before, after, agreed, unstable, sure, margins, wanted.probability)


def _answer(problem: Problem, x: Array, margins: Mapping[Demand, float] | None = None) -> Answer:
    found = problem.peaks(x)
    missed = max((p.excess + (margins or {}).get(p.demand, 0.0) for p in found), default=-np.inf)
    return Answer(x, problem.cost.of(x - problem.start), tuple(found), missed)


def _best(problem: Problem, margins: Mapping[Demand, float], seed: int) -> tuple[Answer, tuple[int, int]]:
    """The cheapest of several searches, and how many of those that kept every demand came to the same.

    A search that leads to no bicycle counts for nothing; limits may hold such numbers.
    """
    rng = np.random.default_rng(seed)
    low, high = problem.limits.low, problem.limits.high
    found: list[Answer] = []
    refusal = ""
    for number in range(STARTS):
        begin = low + (high - low) * rng.uniform(size=len(low)) if number else problem.start
        try:
            problem.space.refuse_impossible([begin])
            answer = solved(problem, margins, begin)
            problem.space.refuse_impossible([answer.x])
        except (InputError, np.linalg.LinAlgError) as error:
            refusal = refusal or str(error)
            continue
        found.append(answer)
        if answer.cost == 0.0 and answer.kept:
            return answer, (1, 1)
    if not found:
        raise InputError(f"every search came to numbers that make no bicycle ({refusal}); narrow the --limits")
    kept = [one for one in found if one.kept]
    if not kept:
        return min(found, key=lambda one: one.missed), (0, len(found))
    best = min(kept, key=lambda one: one.cost)
    same = sum(one.cost <= best.cost * (1 + SAME_COST) for one in kept)
    return best, (same, len(found))


def _uncertain(content: Mapping[str, Any], wanted: Wanted) -> UncertainModel | None:
    try:
        return UncertainModel(content, sd=wanted.sd, defaults=wanted.assume)
    except InputError as error:
        if str(error).startswith("nothing is uncertain"):
            return None
        raise


def _certainty(
    problem: Problem, answer: Answer, wanted: Wanted, seed: int, *, matched: bool = False
) -> Certainty | None:
    uncertain = _uncertain(changed_content(problem.space, answer.x), wanted)
    if uncertain is None:
        return None
    speeds = np.union1d(
        np.linspace(problem.speeds[0], problem.speeds[-1], ALONG), [peak.speed for peak in answer.peaks]
    )
    return certainty(uncertain, problem.demands, speeds, samples=wanted.samples, seed=seed, matched=matched)


def _sure(
    problem: Problem, after: Answer, agreed: tuple[int, int], wanted: Wanted, probability: float
) -> tuple[Answer, tuple[int, int], dict[Demand, float]]:
    """Margins that make the design keep its demands with a probability, and the design with them.

    The same draws are used each time; how the worst excess of the draws scatters about that of the design says how
    large the margin must be.
    """
    margins: dict[Demand, float] = {}
    best: tuple[Answer, dict[Demand, float]] | None = None
    for _ in range(BACK_OFFS):
        seen = _certainty(problem, after, wanted, wanted.seed, matched=True)
        if seen is None:
            break
        if seen.probability >= probability and (best is None or after.cost < best[0].cost):
            best = (after, margins)
        nominal = {d: max((p.excess for p in after.peaks if p.demand == d), default=-np.inf) for d in problem.demands}
        now = seen.back_off(nominal, margins, probability)
        if margins and all(abs(now[d] - margins[d]) <= 0.01 * abs(now[d]) + CLEARLY for d in now) and best:
            break
        margins = {d: max(value, 0.0) for d, value in now.items()}
        found = solved(problem, margins, after.x)
        if not found.kept:
            found = min([found, _best(problem, margins, wanted.seed)[0]], key=lambda one: one.missed)
        after = found
        if not after.kept:
            return after, agreed, margins
    if best is None:
        return replace(after, missed=max(after.missed, 1.0)), agreed, margins
    return best[0], agreed, best[1]


def _unstable(problem: Problem, x: Array) -> dict[str, tuple[float, float, float]]:
    found: dict[str, tuple[float, float, float]] = {}
    for name, values in modes(problem.space.linear_at(x), problem.speeds).branches.items():
        real = np.where(np.isnan(values), -np.inf, values.real).max(1)
        bad = np.flatnonzero(real > CLEARLY)
        if bad.size:
            speeds = problem.speeds[bad]
            found[name] = (float(speeds[0]), float(speeds[-1]), float(real[bad].max()))
    return found
