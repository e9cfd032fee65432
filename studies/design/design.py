"""The smallest change of some numbers of a model that keeps its demands, what else changes, and its robustness."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy

from bicycle.effects.effect_registry import registry
from bicycle.model.model_file import build_model
from bicycle.motion.limit_cycles import find_limit_cycles
from bicycle.parameters.parameter_covariance import ParameterKey
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import Rules, refuse_impossible_mode
from studies.design import problem as posed
from studies.design.problem import CLEARLY, Answer, Demand, Peak, Problem, search_cheapest
from studies.model_space.changed_model import ModelSpace, changed_content
from studies.model_space.lasting_motions import motion_at
from studies.model_space.outputs import HIGHEST
from studies.uncertainty.uncertain_model import NothingUncertain, UncertainModel
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError


@dataclass(frozen=True, eq=False)
class Certainty:
    """Share of draws of a design that keep its demands."""

    excess: Mapping[Demand, Array]  # (n,), 1/s, by which each draw misses the demand; below 0: keeps it, NaN: not told
    unknown: int  # draws of which some demand is not told
    refused: int  # draws that are no bicycle, left out

    @property
    def largest_misses(self) -> Array:
        """Largest miss (k,) of all demands of each draw for which it is known, 1/s."""
        misses = np.stack(list(self.excess.values()))
        return np.asarray(misses[:, ~np.isnan(misses).any(0)].max(0))

    @property
    def probability(self) -> float:
        """Share of draws that keep every demand."""
        return float((self.largest_misses <= 0).mean()) if self.largest_misses.size else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the probability (Wilson 1927), with undecided samples counted both ways."""
        keeping, count = int((self.largest_misses <= 0).sum()), self.largest_misses.size + self.unknown
        if not count:
            return 0.0, 1.0
        least, most = (
            scipy.stats.binomtest(n, count).proportion_ci(method="wilson") for n in (keeping, keeping + self.unknown)
        )
        return float(least.low), float(most.high)

    def back_off(
        self, nominal: Mapping[Demand, float], margins: Mapping[Demand, float], probability: float
    ) -> dict[Demand, float]:
        """Margins (1/s) with which that share of the same draws would have kept every demand."""
        spread = {demand: float(np.nanstd(values)) or 1e-12 for demand, values in self.excess.items()}
        distances = np.stack([(values - nominal[d]) / spread[d] for d, values in self.excess.items()])
        for row, (demand, values) in zip(distances, self.excess.items(), strict=True):
            # 1/s: a demand that is kept by more than this beyond its margin does not bind
            if nominal[demand] + margins.get(demand, 0.0) < -1e-2:
                row[values <= 0] = -np.inf
        beta = float(np.nanquantile(distances.max(0), probability, method="higher"))
        return {demand: beta * size for demand, size in spread.items()}


def certainty(
    uncertain: UncertainModel,
    demands: Sequence[Demand],
    speeds: Array,
    *,
    samples: int,
    seed: int,
    matched: bool = False,
) -> Certainty:
    """Draw bicycles about a design and see which of them keep the demands at rising speeds (k,), m/s."""
    draw = uncertain.matched_draw if matched and uncertain.can_match(samples) else uncertain.draw
    z, left_out = uncertain.filter_possible(draw(samples, seed))
    names = Rules.of(uncertain.nominal.linear_model()).names
    excess = {demand: np.full(len(z), np.nan) for demand in demands}
    for rows, named, refused in uncertain.name_modes(z, speeds):
        for demand in demands:
            place = names.index(demand.mode)
            of_mode = (named.first == place) | (named.second == place)
            missed = _top(speeds, np.where(of_mode, demand.excess(named.values), -np.inf).max(2))
            excess[demand][rows] = np.where(refused, np.nan, missed)
    return Certainty(excess, int(np.isnan(np.stack(list(excess.values()))).any(0).sum()), sum(left_out.values()))


def _top(speeds: Array, excess: Array) -> Array:
    """Find the largest value (m,) along speed of values (m, k), between speeds by a parabola through three."""
    row, at = np.arange(len(excess)), np.clip(excess.argmax(1), 1, len(speeds) - 2)
    (a, fa), (b, fb), (c, fc) = ((speeds[at + k], excess[row, at + k]) for k in (-1, 0, 1))
    with np.errstate(divide="ignore", invalid="ignore"):
        left, right = (fb - fa) / (b - a), (fc - fb) / (c - b)
        bend = (right - left) / (c - a)
        slope = left + bend * (b - a)  # at the middle of the three
        top = fb - slope**2 / (4 * bend)
    vertex_between = np.isfinite(top) & (bend < 0) & (np.abs(slope) < -2 * bend * np.maximum(b - a, c - b))
    return np.asarray(np.where(vertex_between, np.maximum(top, excess.max(1)), excess.max(1)))


BINDS = 1e-3  # 1/s: a demand kept by less binds
AT_LIMIT = 1e-6  # of the limits
Unstable = dict[str, tuple[float, float, float]]


@dataclass(frozen=True, eq=False)
class Design:
    """A design: the model as it stands and as it should be, or as near as it comes."""

    problem: Problem  # numbers, cost, limits and demands
    before: Answer  # of the model as it stands
    after: Answer  # of the design
    agreed: tuple[int, int]  # searches that came to this cost, and all searches
    # before and after: mode -> lowest and highest unstable speed (m/s), largest growth (1/s)
    unstable: tuple[Unstable, Unstable]
    certainty: Certainty | None  # share of draws that keep the demands; None: nothing is uncertain
    margins: Mapping[Demand, float]  # 1/s, by which each demand is kept so that it holds with the probability
    probability: float | None  # with which the demands are to be kept; None: of the nominal model only
    amplitude: float | None = None  # degrees at the bar of the demand on one

    @property
    def binding(self) -> list[Peak]:
        """Peaks whose demand is kept by hardly more than asked for; if it cannot be kept, those missed most."""
        misses = [(p, p.excess + self.margins.get(p.demand, 0.0)) for p in self.after.peaks]
        if not self.after.kept:
            most = max(missed for _, missed in misses)
            return [p for p, missed in misses if missed > most - 10 * BINDS]
        return [p for p, missed in misses if abs(missed) < BINDS]

    @property
    def at_limit(self) -> list[tuple[str, float, str]]:
        """Keys whose number is at a limit, the limit in its unit, and what sets it."""
        limits, numbers = self.problem.limits, zip(self.problem.start, self.after.x, strict=True)
        rows = zip(self.problem.space.axes, limits.low, limits.high, limits.why, numbers, strict=True)
        return [
            (axis.key, float(end), why)
            for axis, low, high, why, (start, x) in rows
            for end in (low, high)
            if abs(x - end) <= AT_LIMIT * (high - low) < abs(x - start)
        ]

    @property
    def content(self) -> dict[str, Any]:
        """The content of the corrected model file, with absolute paths."""
        return changed_content(self.problem.space, self.after.x)


@dataclass(frozen=True)
class Wishes:
    """Wishes for a design besides demands: costs of a change by one unit, standard deviations (SI), limits by key."""

    costs: Mapping[str, float]  # key -> cost of a change by one unit of the key; empty: none is stated
    sd: Mapping[str, float]  # parameter -> standard deviation, SI
    limits: Mapping[str, tuple[float, float]]  # key -> lowest and highest value in its unit
    assume: bool = False  # True: default standard deviations where none is stated
    probability: float | None = None  # with which the demands are to be kept, 0 to 1; None: of the nominal model only
    samples: int = 1000  # random bicycles
    seed: int = 0  # of all random numbers


def with_effects(content: Mapping[str, Any], keys: Sequence[str]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """The content of a model file with the effects that keys name, without any influence yet, and which were added."""
    kinds, tables, added = registry(), dict(content.get("effects", {})), []
    for key in keys:
        name = ParameterKey.parse(key).effect
        if not name or name in tables or name not in kinds or kinds[name].slot is not None:
            continue
        neutral = {p.name: p.neutral for p in kinds[name].parameters if p.neutral is not None}
        values = {parameter: value for parameter, value in neutral.items() if math.isfinite(value)}
        if values and all(p.name in values or p.default is not None for p in kinds[name].parameters):
            tables[name] = values
            added.append(name)
    return (dict(content) | {"effects": tables} if added else dict(content)), tuple(added)


def find_design(
    content: Mapping[str, Any],
    keys: Sequence[str],
    keep: Sequence[Demand],
    speeds: tuple[float, float],
    wishes: Wishes,
) -> Design:
    """Find the smallest change of the numbers ``keys`` that keeps every demand between two ``speeds`` (m/s)."""
    effects = build_model(content).effects
    for demand in keep:
        if demand.mode != posed.EVERY:
            refuse_impossible_mode(demand.mode, effects, where="--keep")
    space = ModelSpace(content, keys)
    space.refuse_switches()
    start, looked = posed.base_of(space), posed.grid(*speeds)
    space.linear.check_speeds(looked)
    demands = posed.expand_all_modes(keep, space.linear, looked)
    limits = posed.limits_of(space, wishes.limits)
    cost = posed.cost_of(space, wishes.costs, wishes.sd, assume=wishes.assume)
    space.refuse_impossible([start])
    problem = Problem(space, start, cost, limits, demands, looked)
    before = problem.answer(start, {})
    uncertain = _uncertain(content, wishes)
    if wishes.probability is not None and uncertain is None:
        why = "nothing is uncertain; give --sd NAME=VALUE, or --assume"
        raise InputError(f"--probability {wishes.probability:g}: {why}")
    limited = [demand for demand in demands if demand.amplitude]
    if len(limited) > 1 or (limited and wishes.probability is not None):
        option = f"--keep {limited[0].mode} {limited[0].amplitude:g}deg"
        raise InputError(f"{option}: give one amplitude, without --probability")
    margins: dict[Demand, float] = {}
    after, agreed = _repeat_search(problem, margins, wishes.seed)
    amplitude = None
    if limited:
        problem, after, amplitude = _below_amplitude(problem, after, wishes)
    if wishes.probability is not None and after.kept:
        after, margins = _search_with_margins(problem, after, wishes, wishes.probability)
    sure = None if uncertain is None else _certainty(problem, after, wishes, wishes.seed + 1)
    unstable = (_unstable_ranges(problem, start), _unstable_ranges(problem, after.x))
    return Design(problem, before, after, agreed, unstable, sure, margins, wishes.probability, amplitude)


def _below_amplitude(problem: Problem, stable: Answer, wishes: Wishes) -> tuple[Problem, Answer, float]:
    """The design that lets a mode grow as fast as its amplitude allows, the same at all speeds, and the amplitude.

    Near a critical speed the square of the amplitude is proportional to the growth; each round uses that.
    """
    demand = next(d for d in problem.demands if d.amplitude)

    def amplitude(x: Array) -> float:
        cycles = find_limit_cycles(problem.space.model_at(x), max_speed=max(HIGHEST, problem.speeds[-1]))
        sizes = [motion_at(cycles, speed, demand.mode) for speed in problem.speeds.tolist()]
        return float(np.nan_to_num(sizes, nan=math.inf).max())

    best, reached, first = (problem, stable), amplitude(stable.x), amplitude(problem.start)
    if stable.kept and reached > demand.amplitude:
        raise InputError(
            f"--keep {demand.mode} {demand.amplitude:g}deg: an impulse starts a larger limit cycle even where it is "
            f"stable; "
            "give a damping ratio"
        )
    peak = max((p.excess for p in problem.answer(problem.start, {}).peaks if p.demand == demand), default=0.0)
    growth = max(peak, CLEARLY) * float(np.clip(demand.amplitude / max(first, 1e-9), 0.05, 1.0)) ** 2
    low, high = 0.0, math.inf
    for _ in range(8):  # rounds
        relaxed = replace(demand, growth=growth + CLEARLY)
        relaxed_problem = replace(problem, demands=tuple(relaxed if d == demand else d for d in problem.demands))
        answer = search_cheapest(relaxed_problem, {}, problem.start)
        last = amplitude(answer.x) if answer.cost else first
        if answer.kept and last <= demand.amplitude:
            best, reached, low = (relaxed_problem, answer), last, growth
            if answer.cost == 0 or last > 0.98 * demand.amplitude:
                break
        else:
            high = growth
        growth *= 0.98 * np.clip(demand.amplitude / max(last, 1e-9), 0.2, 3.0) ** 2
        growth = float(growth) if low < growth < high else (low + min(high, 9 * low)) / 2
    return *best, reached


def _repeat_search(problem: Problem, margins: Mapping[Demand, float], seed: int) -> tuple[Answer, tuple[int, int]]:
    """Search from four beginnings: the cheapest answer, how many came to its cost, and how many came to an answer."""
    rng = np.random.default_rng(seed)
    low, high = problem.limits.low, problem.limits.high
    answers, refusal = list[Answer](), ""
    for number in range(4):  # beginnings of the search: the model as it stands, and points within the limits
        begin = low + (high - low) * rng.uniform(size=len(low)) if number else problem.start
        try:
            problem.space.refuse_impossible([begin])
            answer = search_cheapest(problem, margins, begin)
            problem.space.refuse_impossible([answer.x])
        except (InputError, np.linalg.LinAlgError) as error:
            refusal = refusal or str(error)
            continue
        answers.append(answer)
        if answer.cost == 0.0 and answer.kept:
            return answer, (1, 1)
    if not answers:
        raise InputError(f"every search ended at an impossible bicycle ({refusal}); narrow the --limits")
    best = min(answers, key=lambda answer: answer.rank)
    return best, (sum(answer.kept and answer.cost <= best.cost * 1.001 for answer in answers), len(answers))


def _uncertain(content: Mapping[str, Any], wishes: Wishes) -> UncertainModel | None:
    try:
        return UncertainModel(content, sd=wishes.sd, defaults=wishes.assume)
    except NothingUncertain:
        return None


def _certainty(
    problem: Problem, answer: Answer, wishes: Wishes, seed: int, *, matched: bool = False
) -> Certainty | None:
    uncertain = _uncertain(changed_content(problem.space, answer.x), wishes)
    if uncertain is None:
        return None
    # speeds at which drawn bicycles are looked at, beside the worst ones of the design
    speeds = np.union1d(np.linspace(problem.speeds[0], problem.speeds[-1], 41), [peak.speed for peak in answer.peaks])
    return certainty(uncertain, problem.demands, speeds, samples=wishes.samples, seed=seed, matched=matched)


def _search_with_margins(
    problem: Problem, after: Answer, wishes: Wishes, probability: float
) -> tuple[Answer, dict[Demand, float]]:
    """Search with margins (1/s) so large that the demands are kept with a ``probability``; answer and margins."""
    margins: dict[Demand, float] = {}
    best: tuple[Answer, dict[Demand, float]] | None = None
    for _ in range(8):
        draws = _certainty(problem, after, wishes, wishes.seed, matched=True)
        if draws is None:
            break
        if draws.probability >= probability and (best is None or after.cost < best[0].cost):
            best = (after, margins)
        nominal = {d: max((p.excess for p in after.peaks if p.demand == d), default=-np.inf) for d in problem.demands}
        needed = draws.back_off(nominal, margins, probability)
        if margins and all(abs(needed[d] - margins[d]) <= 0.01 * abs(needed[d]) + CLEARLY for d in needed) and best:
            break
        margins = {d: max(value, 0.0) for d, value in needed.items()}
        after = search_cheapest(problem, margins, after.x)
        if not after.kept:
            after = min([after, _repeat_search(problem, margins, wishes.seed)[0]], key=lambda answer: answer.missed)
        if not after.kept:
            return after, margins
    return best or (replace(after, missed=max(after.missed, 1.0)), margins)


def _unstable_ranges(problem: Problem, x: Array) -> Unstable:
    ranges: Unstable = {}
    for name, values in modes(problem.space.linear_at(x), problem.speeds).branches.items():
        real = np.where(np.isnan(values), -np.inf, values.real).max(1)
        bad = np.flatnonzero(real > CLEARLY)
        if bad.size:
            speeds = problem.speeds[bad]
            ranges[name] = (float(speeds[0]), float(speeds[-1]), float(real[bad].max()))
    return ranges
