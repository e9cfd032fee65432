"""Demands on modes over a range of speed, to be stable or well damped, and the speeds at which they are missed most."""

import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from bicycle.model.default_sd import standard_deviations
from bicycle.model.eigen import eigensystem, project
from bicycle.model.state_space import LinearModel
from bicycle.motion.limit_cycles import LIMITS
from bicycle.parameters.bicycle import POSITIVE, UNITS, of_kind
from bicycle.stability.named_modes import modes
from studies.model_space.axes import SPEED, typical_range
from studies.model_space.changed_model import ModelSpace
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, read_number, refuse_unknown
from tyre.ground.units import PASCAL_PER_BAR

STABLE, EVERY = "stable", "all"


@dataclass(frozen=True)
class Demand:
    """A mode that is to keep ``Re z + ratio |z| <= growth``: stable with ratio 0, else that damping ratio at least.

    With an ``amplitude`` (degrees of steer) it may grow by ``growth`` (1/s), if stable limit cycles stay below.
    """

    mode: str  # name of a mode, or EVERY
    ratio: float = 0.0  # least damping ratio, 0 to below 1
    amplitude: float = 0.0  # degrees at the bar, largest of a motion that lasts; 0: no demand on one
    growth: float = 0.0  # 1/s, largest growth rate

    def __str__(self) -> str:
        if self.amplitude:
            return f"{self.mode} below {self.amplitude:g}° steer amplitude, growth rate up to {self.growth:.3g} 1/s"
        return f"{self.mode} stable" if not self.ratio else f"{self.mode} with a damping ratio of {self.ratio:g}"

    def excess(self, roots: Any) -> Any:
        """By how much ``roots`` (1/s, any shape) miss it: ``Re z + ratio |z| - growth``, 1/s."""
        return roots.real + self.ratio * np.abs(roots) - self.growth

    def slope(self, root: Complex, change: Complex) -> Array:
        """Derivatives (k, d) of the excess from those of roots (k,)."""
        turned = (root.conj() / np.maximum(np.abs(root), 1e-300))[:, None] * change
        return np.asarray(change.real + self.ratio * turned.real)

    def worst_roots(self, branches: Mapping[str, Complex]) -> tuple[Complex, NDArray[np.bool_]]:
        """At each speed the root that misses it most (m,), and whether there is one (m,)."""
        roots = members(branches, self.mode)
        excess = np.where(np.isnan(roots), -np.inf, self.excess(np.nan_to_num(roots)))
        at, row = excess.argmax(1), np.arange(len(roots))
        return roots[row, at], np.isfinite(excess[row, at])


def demands(keep: Sequence[tuple[str, str]], ratio: float | None = None) -> tuple[Demand, ...]:
    """Demands as written: mode, and ``stable`` (of ``ratio``), a damping ratio, or an amplitude such as ``2deg``."""
    by_mode: dict[str, Demand] = {}
    most = math.degrees(LIMITS["steer"])
    for mode, word in keep:
        angle = re.fullmatch(r"(\d*\.?\d+)(deg|°)", word)
        if angle and mode not in by_mode and mode != EVERY and 0 < float(angle[1]) <= most:
            by_mode[mode] = Demand(mode, amplitude=float(angle[1]))
            continue
        try:
            number = (ratio or 0.0) if word == STABLE else read_number(word)
        except ValueError:
            number = np.nan
        if not 0 <= number < 1:
            raise InputError(
                f"--keep {mode} {word if word != STABLE else number}: give {STABLE}, a minimum damping ratio "
                f"from 0 to below 1, or a maximum steer amplitude of one mode such as 2deg, up to {most:g}deg"
            )
        if mode in by_mode:
            raise InputError(f"--keep {mode} is given twice; keep one")
        by_mode[mode] = Demand(mode, number)
    return tuple(by_mode.values())


def expand_all_modes(demands: Sequence[Demand], linear: LinearModel, speeds: Array) -> tuple[Demand, ...]:
    """Replace a demand on ``all`` by one on every mode of a model at speeds (m,), m/s; an unknown mode is refused."""
    names = [name for name in modes(linear, speeds).names if "+" not in name]
    demand_on_all = next((demand for demand in demands if demand.mode == EVERY), None)
    by_mode = {demand.mode: demand for demand in demands if demand.mode != EVERY}
    for name in by_mode:
        if name not in names:
            raise InputError(
                f"--keep {name}: the model has no such mode between {speeds.min():g} and {speeds.max():g} m/s; it has "
                f"{', '.join(names)} ({EVERY} is every one)"
            )
    if demand_on_all is not None:
        by_mode = {name: by_mode.get(name, Demand(name, demand_on_all.ratio)) for name in names}
    return tuple(by_mode.values())


def grid(low: float, high: float) -> Array:
    """Speeds (m,) at which modes are looked at from ``low`` to ``high``, at most 0.4 m/s apart."""
    return np.linspace(low, high, max(41, int(np.ceil((high - low) / 0.4)) + 1))


def members(branches: Mapping[str, Complex], mode: str) -> Complex:
    """Roots (m, k) in 1/s that are, or may be, of a mode; NaN where there are fewer."""
    of_mode = [values for name, values in branches.items() if mode in name.split("+")]
    count = len(next(iter(branches.values())))
    return np.concatenate(of_mode, 1) if of_mode else np.full((count, 1), complex(np.nan, np.nan))


@dataclass(frozen=True)
class Peak:
    """A demand, a speed (m/s), the root there (1/s) and by how much it misses the demand (1/s; below 0: keeps it)."""

    demand: Demand
    speed: float  # m/s
    root: complex  # 1/s
    excess: float  # 1/s, below 0: the demand is kept


def peaks(linear: LinearModel, demands: Sequence[Demand], speeds: Array) -> list[Peak]:
    """Local maxima of the excess of every demand along rising speeds (m,), m/s, ends included and sharpened."""
    branches = modes(linear, speeds).branches
    maxima = []
    for demand in demands:
        roots, exists = demand.worst_roots(branches)
        excess = np.where(exists, demand.excess(np.nan_to_num(roots)), -np.inf)
        left, right = np.r_[-np.inf, excess[:-1]], np.r_[excess[1:], -np.inf]
        for k in np.flatnonzero((excess >= left) & (excess >= right) & exists).tolist():
            neighbours = slice(max(k - 1, 0), min(k + 1, len(speeds) - 1) + 1)
            peak = Peak(demand, float(speeds[k]), complex(roots[k]), float(excess[k]))
            maxima.append(_sharpen_peak(linear, peak, speeds[neighbours], roots[neighbours]))
    return maxima


def _sharpen_peak(linear: LinearModel, peak: Peak, speeds: Array, roots: Complex) -> Peak:
    """Refine a peak of a grid: the maximum between its neighbours, of the root that leads from one to the other."""
    if np.isnan(roots).any():
        return peak

    def root(speed: float) -> complex:
        guess = np.interp(speed, speeds, roots.real) + 1j * np.interp(speed, speeds, roots.imag)
        values = linear.eigenvalues(speed)
        return complex(values[np.abs(values - guess).argmin()])

    optimum = scipy.optimize.minimize_scalar(
        lambda v: -float(peak.demand.excess(root(v))),
        bounds=(speeds[0], speeds[-1]),
        method="bounded",
        options={"xatol": 1e-7 * peak.speed + 1e-9, "maxiter": 60},
    )
    best = root(float(optimum.x))
    excess = float(peak.demand.excess(best))
    return Peak(peak.demand, float(optimum.x), best, excess) if excess > peak.excess else peak


def at_speeds(linear: LinearModel, demand_speeds: Sequence[tuple[Demand, float]]) -> list[Peak]:
    """The root that misses a demand most at given speeds (m/s), if there is one."""
    branches = modes(linear, np.array([speed for _, speed in demand_speeds])).branches
    missed_most = []
    for k, (demand, speed) in enumerate(demand_speeds):
        roots, exists = demand.worst_roots({name: values[k : k + 1] for name, values in branches.items()})
        if exists[0]:
            missed_most.append(Peak(demand, speed, complex(roots[0]), float(demand.excess(roots[0]))))
    return missed_most


ROUNDS = 8
IMPOSSIBLE = 1e3  # 1/s: misses of numbers that make no bicycle
BESIDE = 1e-3  # 1/s: largest miss that is put down to the solver, not to the demands
KEPT = -10.0  # 1/s: a demand that is kept by more than this is no constraint
KEPT_WITHIN = 1e-6  # 1/s: a demand missed by less is kept
CLEARLY = 1e-5  # 1/s by which a demand is to be kept, so that rounding does not undo it
BY_COST, BY_SD, RELATIVE = "stated costs", "standard deviations", "shares of the value"


@dataclass(frozen=True)
class Limits:
    """Lowest and highest value (d,) of each number in its unit, and what sets the two."""

    low: Array  # (d,), each in the unit of its number
    high: Array  # (d,), likewise
    why: tuple[str, ...]  # d, what sets the two


@dataclass(frozen=True)
class Cost:
    """``scale`` (d,), the change of each number that costs one, in its unit; ``kind`` says what that is."""

    scale: Array  # (d,), each in the unit of its number
    kind: str  # BY_COST, BY_SD or RELATIVE

    def evaluate(self, change: Array) -> float:
        """Cost of a ``change`` (d,) in the units of the numbers: the root of the sum of squares."""
        return float(np.linalg.norm(change / self.scale))


def base_of(space: ModelSpace) -> Array:
    """The numbers as they stand (d,), in their units."""
    for axis, value in zip(space.axes, space.base, strict=True):
        if axis.key == SPEED or axis.condition == "load_N":
            raise InputError(f"--vary {axis.key}: it is no number of the model file; vary what the bicycle is made of")
        if math.isnan(value):
            either = f"{axis.key}.rear, {axis.key}.front or both"
            raise InputError(f"--vary {axis.key}: rear and front differ; vary {either}")
        if not math.isfinite(value):
            raise InputError(f"--vary {axis.key}: its value is infinite; give the model a finite one to start from")
    return space.base


def limits_of(space: ModelSpace, stated_limits: Mapping[str, tuple[float, float]]) -> Limits:
    """Limits of each number: as given, else what is measured of a tyre, else what is typical and possible."""
    keys = [axis.key for axis in space.axes]
    refuse_unknown("varied parameter", stated_limits, keys, where="--limits")
    low, high, why = [], [], []
    for axis, base in zip(space.axes, space.base, strict=True):
        if axis.key in stated_limits:
            ends, reason = stated_limits[axis.key], "given"
            if not (axis.bounds[0] <= ends[0] <= ends[1] <= axis.bounds[1]):
                raise InputError(
                    f"--limits {axis.key}={ends[0]:g}:{ends[1]:g}: possible are {axis.bounds[0]:g} to "
                    f"{axis.bounds[1]:g} {axis.unit}"
                )
            if not ends[0] <= base <= ends[1]:
                raise InputError(f"--limits {axis.key}: the model's {base:g} {axis.unit} is not between them")
        elif axis.wheels:
            assert space.tyres is not None
            ranges = [space.tyres.sources[wheel].pressure_range for wheel in axis.wheels]
            ends = (max(r[0] for r in ranges) / PASCAL_PER_BAR, min(r[1] for r in ranges) / PASCAL_PER_BAR)
            reason = "measured"
            if not math.isfinite(ends[1]):
                ends, reason = (0.5 * base, min(1.5 * base, axis.bounds[1])), "half as much again"
        else:
            typical, reason = of_kind(space.model.bicycle.kind)[0], "typical"
            ends = typical[axis.key] if axis.key in UNITS else typical_range(space.model, axis)
        reason += ", and the model's value" * (axis.key not in stated_limits and not ends[0] <= base <= ends[1])
        if axis.key in POSITIVE:
            ends = (max(ends[0], 1e-6 * base), ends[1])  # of a value that must be positive: its lowest
        low.append(max(min(ends[0], base), axis.bounds[0]))
        high.append(min(max(ends[1], base), axis.bounds[1]))
        why.append(reason)
    return Limits(np.array(low), np.array(high), tuple(why))


def cost_of(space: ModelSpace, costs: Mapping[str, float], sd: Mapping[str, float], *, assume: bool = False) -> Cost:
    """Cost of a change: stated costs, else standard deviations where all are known, else shares of the value."""
    keys = [axis.key for axis in space.axes]
    refuse_unknown("varied parameter", costs, keys, where="--cost")
    missing = [key for key in keys if key not in costs]
    if costs:
        if missing:
            raise InputError(f"--cost: {', '.join(missing)} has none; give a cost to every varied parameter, or none")
        if min(costs.values()) <= 0:
            raise InputError("--cost: a change must cost more than 0; keep a parameter out of --vary or limit it")
        return Cost(np.array([1 / costs[key] for key in keys]), BY_COST)
    uncertainties = standard_deviations(space.model, sd, assume=assume)
    largest_sd = [
        max(float(getattr(uncertainties.get(entry), "sd", 0.0)) for entry in entries) for entries in space.entries
    ]
    if all(largest_sd):
        return Cost(np.array(largest_sd), BY_SD)
    sizes = [
        abs(float(base)) or max(map(abs, typical_range(space.model, axis)))
        for axis, base in zip(space.axes, space.base, strict=True)
    ]
    return Cost(np.array(sizes), RELATIVE)


@dataclass(frozen=True, eq=False)
class Problem:
    """The numbers that are varied and where they stand, their cost and limits, the demands, and speeds (m,) in m/s."""

    space: ModelSpace  # the model over the d numbers that are varied
    start: Array  # (d,), the numbers as they stand, in their units
    cost: Cost  # of a change of the numbers
    limits: Limits  # that the numbers never pass
    demands: tuple[Demand, ...]  # one a mode
    speeds: Array  # (m,), m/s, rising

    def answer(self, x: Array, margins: Mapping[Demand, float]) -> "Answer":
        """Cost and misses of numbers (d,), in their units, with margins (1/s) by which demands are to be kept."""
        maxima = peaks(self.space.linear_at(x), self.demands, self.speeds)
        missed = max((peak.excess + margins.get(peak.demand, 0.0) for peak in maxima), default=-np.inf)
        return Answer(x, self.cost.evaluate(x - self.start), tuple(maxima), missed)


@dataclass(frozen=True, eq=False)
class Answer:
    """Numbers ``x`` (d,), their cost, the peaks there, and by how much the worst demand is missed (1/s, < 0: kept)."""

    x: Array  # (d,), in the units of the numbers
    cost: float  # root of the sum of squared changes, each over its scale
    peaks: tuple[Peak, ...]  # worst speeds of every demand
    missed: float  # 1/s, of the worst demand; below 0: all are kept

    @property
    def kept(self) -> bool:
        """True if every demand is kept."""
        return self.missed <= KEPT_WITHIN

    @property
    def rank(self) -> tuple[bool, float]:
        """Order of answers, the best first: kept ones by their cost, then the others by what they miss."""
        return not self.kept, self.cost if self.kept else self.missed


class Misses:
    """By how much the demands of a problem are missed at speeds (m,), with derivatives, at one point after another.

    Points y (d,) are changes of the numbers over the scales of their cost. A demand that no mode is subject to at a
    speed is kept there.
    """

    def __init__(self, problem: Problem, speeds: Array, margins: Mapping[Demand, float]) -> None:
        self.problem, self.speeds = problem, speeds
        margin = [margins.get(demand, 0.0) + CLEARLY for demand in problem.demands]
        self.margin = np.repeat(margin, len(speeds))  # (demands * m,), 1/s, by which each is to be kept
        self.evaluate = lru_cache(maxsize=4)(self._evaluate)  # scipy asks for values and derivatives in turn

    def __call__(self, y: Array) -> Array:
        """Misses (demands * m,), 1/s; below 0: kept."""
        return self.evaluate(tuple(y))[0]

    def slopes(self, y: Array) -> Array:
        """Their derivatives (demands * m, d)."""
        return self.evaluate(tuple(y))[1]

    def largest_miss(self, x: Array) -> float:
        """Largest miss, 1/s, at numbers ``x`` (d,) in their units."""
        return float(self((x - self.problem.start) / self.problem.cost.scale).max())

    def _evaluate(self, y: tuple[float, ...]) -> tuple[Array, Array]:
        space, scale = self.problem.space, self.problem.cost.scale
        x = self.problem.start + scale * np.array(y)
        try:
            branches = modes(space.linear_at(x), self.speeds).branches
            matrices, matrix_slopes = space.matrices_and_slopes(x, self.speeds)
        except InputError:  # no bicycle: the search turns back
            return np.full(len(self.margin), IMPOSSIBLE), np.zeros((len(self.margin), len(x)))
        values, right, left = eigensystem(matrices)
        changes = np.stack([project(left, matrix_slopes[:, i], right) for i in range(len(x))], -1)  # (m, roots, d)

        row = np.arange(len(self.speeds))
        misses, slopes = [], []
        for demand in self.problem.demands:
            roots, exists = demand.worst_roots(branches)
            nearest = np.abs(values - np.nan_to_num(roots)[:, None]).argmin(1)
            root, change = values[row, nearest], changes[row, nearest]
            misses.append(np.where(exists, demand.excess(root), -np.inf))
            slopes.append(np.where(exists[:, None], demand.slope(root, change) * scale, 0.0))
        missed = np.concatenate(misses) + self.margin
        return np.maximum(missed, KEPT), np.where(missed[:, None] > KEPT, np.concatenate(slopes), 0.0)


def search_cheapest(problem: Problem, margins: Mapping[Demand, float], begin: Array) -> Answer:
    """Search the cheapest change from one beginning (d,); where none keeps every demand, the one that misses least."""
    best = problem.answer(begin, margins)
    if best.kept and best.cost == 0.0:
        return best
    x, speeds = begin, problem.speeds
    for _ in range(ROUNDS):
        misses = Misses(problem, speeds, margins)
        x = _minimise_cost(problem, misses, x)
        answer = problem.answer(x, margins)
        best = min(best, answer, key=lambda answer: answer.rank)
        if answer.kept:
            break
        if misses.largest_miss(x) > BESIDE:
            x = _minimise_miss(problem, misses, x)
            answer = problem.answer(x, margins)
            best = min(best, answer, key=lambda answer: answer.rank)
            if misses.largest_miss(x) > BESIDE and answer.missed <= misses.largest_miss(x) + BESIDE:
                break  # no change keeps the demands at these speeds, and none is missed more between them
        # The worst speeds lie between those of the grid: the demands are to be kept there too.
        speeds = np.union1d(speeds, [peak.speed for peak in answer.peaks])
    return best


def _minimise_cost(problem: Problem, misses: Misses, begin: Array) -> Array:
    """Find the numbers (d,) of the smallest cost that keep the demands, if there are any, from ``begin`` (d,)."""
    y = _minimise(
        lambda y: 0.5 * float(y @ y),
        lambda y: y,
        (begin - problem.start) / problem.cost.scale,
        _ends(problem),
        {"type": "ineq", "fun": lambda y: -misses(y), "jac": lambda y: -misses.slopes(y)},
    )
    # Where a tyre's table has a kink, the solver ends a little beside the demand: Newton steps back.
    # Needed by test_a_search_that_ends_at_a_kink_of_a_tyre_s_table_keeps_the_demand.
    for _ in range(4):
        missed = misses(y)
        if not 0 < missed.max() < BESIDE:
            break
        violated = missed > 0
        y = np.clip(y - np.linalg.pinv(misses.slopes(y)[violated]) @ missed[violated], *_ends(problem))
    return problem.start + problem.cost.scale * y


def _minimise_miss(problem: Problem, misses: Misses, begin: Array) -> Array:
    """Find the numbers (d,) with which the demand that is missed most is missed least, from ``begin`` (d,)."""
    y0 = (begin - problem.start) / problem.cost.scale
    low, high = _ends(problem)
    last = np.r_[np.zeros(len(y0)), 1.0]  # of the numbers and t, which no demand misses by more
    z = _minimise(
        lambda z: float(z[-1]),
        lambda z: last,
        np.r_[y0, misses(y0).max()],
        (np.r_[low, -np.inf], np.r_[high, np.inf]),
        {
            "type": "ineq",
            "fun": lambda z: z[-1] - misses(z[:-1]),
            "jac": lambda z: np.column_stack([-misses.slopes(z[:-1]), np.ones(len(misses.margin))]),
        },
    )
    return problem.start + problem.cost.scale * z[:-1]


def _ends(problem: Problem) -> tuple[Array, Array]:
    """Lowest and highest changes (d,) over the scales of their cost."""
    scale = problem.cost.scale
    return (problem.limits.low - problem.start) / scale, (problem.limits.high - problem.start) / scale


def _minimise(cost: Any, slope: Any, begin: Array, ends: tuple[Array, Array], constraint: Any) -> Array:
    """Minimise by SLSQP within the ends; scipy before 1.12 warns of steps that leave them by rounding."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
        result = scipy.optimize.minimize(
            cost,
            np.clip(begin, *ends),
            jac=slope,
            bounds=scipy.optimize.Bounds(*ends),
            constraints=[constraint],
            options={"maxiter": 25, "ftol": 1e-12},
            method="SLSQP",
        )
    return np.clip(result.x, *ends)
