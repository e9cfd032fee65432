"""Critical speeds: where a root of a model crosses the imaginary axis, of one bicycle or of many.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are eigenvalue problems of a companion matrix in v. Newton with d(lambda)/dv
sharpens what they give. Unstable roots are counted at fixed speeds and between the crossings; where the count does not
add up, or a root turns back near the axis, the missing crossings are looked for there.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import comb
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bicycle.eigen import (
    Decomposition,
    angular_frequency,
    decompose,
    frequency_hz,
    uncertainty,
    unstable_roots,
)  # fmt: skip
from bicycle.linear_model import LinearModel
from bicycle.model import Model, as_linear
from bicycle.naming import Rules, check_trackable, name_points, speed_unit, stack_of_one
from bicycle.speed_polynomial import SpeedPolynomial
from bicycle.tracking import assign_sets
from tyre.arrays import Array, Complex
from tyre.errors import InputError

OSCILLATORY, REAL = "oscillatory", "real"
DESTABILISING, STABILISING = "destabilising", "stabilising"
Mask = NDArray[np.bool_]
Whole = NDArray[np.intp]


@dataclass(frozen=True)
class Limits:
    """Numbers that tell a crossing from a touch and from rounding; shares have no unit."""

    nearly_real: float = 1e-3  # relative imaginary part of candidates that are tried: near-double ones are noisy
    rest: float = 1e-7  # of sqrt(g w): closer to rest is rest, where undamped pairs lie on the axis
    shift: float = -0.37  # of sqrt(g w): pencils are solved about this speed, at which no model is singular
    near: float = 0.05  # of the speed: a root whose crossing is foreseen within this is tried
    last_step: float = 1e-9  # of the speed: after a step of Newton below this the next would be rounding
    rounding: float = 1e-7  # of the speed: a step below this that does not halve is rounding
    farthest: float = 0.2  # of the speed: a crossing so far from its candidate has another one
    same_speed: float = 1e-9  # of the speed
    same_frequency: float = 1e-6  # of the frequency
    well_known: float = 1e-8  # of the speed: a crossing known better than this needs no second look
    hardly_known: float = 0.02  # of the speed: a crossing known no better than this is none
    slack: float = 300.0  # of what rounding should change in a root, where a count tells that there is a crossing
    turns: float = 0.2  # of the real part at the nearest node: a root that comes so near the axis is looked at
    searches: int = 3  # for crossings that a count tells are missing


LIMITS = Limits()
NODES = np.concatenate([np.arange(1, 32) * 0.1, np.arange(32, 208, 8) * 0.1])
"""Speeds at which unstable roots are counted, in units of sqrt(g w); further ones follow in the last step."""


class CrossingIdentity(NamedTuple):
    """Which crossing it is, whatever its speed: the mode, which way, and its number among these from slow to fast."""

    mode: str
    destabilising: bool
    occurrence: int = 1

    def __str__(self) -> str:
        number = f" ({self.occurrence})" if self.occurrence > 1 else ""
        return f"{self.mode} {'unstable' if self.destabilising else 'stable'} above{number}"


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which a mode changes its stability.

    Attributes
    ----------
    speed : float
        m/s.
    kind : str
        ``oscillatory`` (a pair crosses the imaginary axis) or ``real`` (a real root crosses zero).
    mode : str
        Name as in :func:`bicycle.named_modes.modes`; empty as long as it is not known.
    frequency_hz : float
        Of the crossing pair, Hz; 0 for a real root.
    direction : str
        What happens to that root as the speed grows: ``stabilising`` or ``destabilising``.
    """

    speed: float
    kind: str
    mode: str
    frequency_hz: float
    direction: str

    @classmethod
    def of_root(cls, *, speed: float, root: complex, destabilising: bool, mode: str = "") -> "CriticalSpeed":
        """A root on the axis at ``speed`` (m/s): ``root`` (1/s), ``destabilising`` or not, with the name ``mode``."""
        kind = OSCILLATORY if root.imag else REAL
        hertz = abs(float(frequency_hz(root)))
        return cls(float(speed), kind, mode, hertz, DESTABILISING if destabilising else STABILISING)

    def __repr__(self) -> str:
        oscillation = f" at {self.frequency_hz:.4g} Hz" if self.oscillatory else ", a real root"
        return f"<CriticalSpeed {self.speed:.6g} m/s: {self.mode} {self.direction}{oscillation}>"

    @property
    def oscillatory(self) -> bool:
        """True if a pair crosses, False if a real root does."""
        return self.kind == OSCILLATORY

    @property
    def destabilising(self) -> bool:
        """True if the mode loses its stability as the speed grows."""
        return self.direction == DESTABILISING

    @property
    def angular_frequency(self) -> float:
        """Imaginary part of the crossing root, rad/s; 0 for a real root."""
        return float(angular_frequency(self.frequency_hz))

    @property
    def unstable_roots(self) -> int:
        """By how much the number of unstable roots grows here: +-2 for a pair, +-1 for a real root."""
        return (2 if self.oscillatory else 1) * (1 if self.destabilising else -1)

    def named(self, mode: str) -> "CriticalSpeed":
        """Return this crossing under the name ``mode``."""
        return replace(self, mode=mode)


ACriticalSpeed = TypeVar("ACriticalSpeed", bound=CriticalSpeed)


def identified(crossings: Iterable[ACriticalSpeed]) -> dict[CrossingIdentity, ACriticalSpeed]:
    """Critical speeds of one model by their identity, in the order given, which is from slow to fast."""
    count = Counter[tuple[str, bool]]()
    identities = {}
    for crossing in crossings:
        key = (crossing.mode, crossing.destabilising)
        count[key] += 1
        identities[CrossingIdentity(*key, count[key])] = crossing
    return identities


def critical_speeds(model: Model | LinearModel, max_speed: float = 60.0) -> tuple[CriticalSpeed, ...]:
    """All speeds 0 < v <= max_speed at which a root crosses the imaginary axis, by speed.

    A root that only touches the axis is not listed. Where the equations switch at a speed, a root that jumps across
    the axis there is listed at that speed, with kind and frequency of the root above it.

    Parameters
    ----------
    model : Model or LinearModel
        A bicycle with its effects, or its linear model.
    max_speed : float
        m/s.

    Returns
    -------
    tuple of CriticalSpeed
        :func:`identified` tells which is which in another model.

    Raises
    ------
    InputError
        ``max_speed`` is not a positive finite number or too high, or the model is too stiff.
    """
    model = as_linear(model)
    if not (np.isfinite(max_speed) and max_speed > 0):
        raise InputError(f"max_speed = {max_speed!r} m/s is not allowed; give a finite speed > 0 m/s")
    check_trackable(model, np.array([max_speed]), "max_speed")
    unit, rules = np.array([speed_unit(model)]), Rules.of(model)
    found: list[CriticalSpeed] = []
    for number, at in enumerate(model.ranges):
        if at.lower < max_speed:
            stack = stack_of_one(model, number)
            limits = np.array([[at.lower, min(at.upper, max_speed)]])
            (own,) = crossings_of(rules, stack, unit, model.parameters["g"], limits)
            found += own
    found += _jumps(model, rules, max_speed)
    return tuple(sorted(found, key=lambda c: (c.speed, c.frequency_hz)))


def crossings_of(
    rules: Rules, polynomial: SpeedPolynomial, unit: Array, gravity: float | Array, limits: Array
) -> list[list[CriticalSpeed]]:
    """Named crossings of many bicycles, those of each by speed."""
    search = _Search(polynomial, unit, np.column_stack([np.maximum(limits[:, 0], LIMITS.rest * unit), limits[:, 1]]))
    zeros = search.run()
    result: list[list[CriticalSpeed]] = [[] for _ in unit]
    if not len(zeros.speed):
        return result
    named = name_points(rules, polynomial, unit, gravity, zeros.owner, zeros.speed)
    place = np.abs(named.values - 1j * zeros.omega[:, None]).argmin(1)[:, None]
    first, second = (np.take_along_axis(x, place, 1)[:, 0].tolist() for x in (named.first, named.second))
    for k, bicycle in enumerate(zeros.owner.tolist()):
        result[bicycle].append(CriticalSpeed.of_root(
            speed=zeros.speed[k], root=1j * zeros.omega[k], destabilising=bool(zeros.slope[k].real > 0),
            mode=rules.name(first[k], second[k]),
        ))  # fmt: skip
    return result


def _jumps(model: LinearModel, rules: Rules, max_speed: float) -> list[CriticalSpeed]:
    """Roots that jump across the axis where the equations switch, under the name that they have below."""
    found = []
    unit, own = np.array([speed_unit(model)]), np.array([0])
    for number, (below, _) in enumerate(pairwise(model.ranges)):
        if below.upper > max_speed:
            continue
        v = np.array([below.upper])
        sides = [
            name_points(rules, stack_of_one(model, k), unit, model.parameters["g"], own, v)
            for k in (number, number + 1)
        ]
        before, after = sides[0].values, sides[1].values
        after = np.take_along_axis(after, assign_sets(before, after), 1)
        was, is_ = (x.real[0] > 1e-12 * np.abs(x).max() for x in (before, after))
        for i in np.flatnonzero((was != is_) & (after.imag[0] >= 0)):
            mode = rules.name(int(sides[0].first[0, i]), int(sides[0].second[0, i]))
            root = 1j * after[0, i].imag
            found.append(CriticalSpeed.of_root(speed=v[0], root=root, destabilising=bool(is_[i]), mode=mode))
    return found


class _Zeros(NamedTuple):
    """Crossings (k,) of bicycles ``owner``: speed (m/s), rad/s, d(lambda)/dv, and how well the speed is known (m/s)."""

    owner: Whole
    speed: Array
    omega: Array
    slope: Complex
    doubt: Array

    def take(self, index: Whole | Mask) -> "_Zeros":
        """Take the crossings at ``index``."""
        parts: tuple[Any, ...] = self
        return _Zeros(*(part[index] for part in parts))

    def and_(self, other: "_Zeros") -> "_Zeros":
        """These and the ``other`` ones, those of each bicycle by speed."""
        both = _Zeros(*(np.concatenate(parts) for parts in zip(self, other, strict=True)))
        return both.take(np.lexsort((both.omega, both.speed, both.owner)))


@dataclass
class _Search:
    """The bicycles of a search, low < v <= high (m/s) of each in ``limits`` (m, 2), and what is known at nodes."""

    polynomial: SpeedPolynomial
    unit: Array
    limits: Array

    def run(self) -> _Zeros:
        """All crossings, completed until the number of unstable roots adds up."""
        zeros = self.newton(*self.candidates())
        self.count_at_nodes()
        turns = self.turns()
        if turns[0].size:
            zeros = self.newton(*self.with_these(zeros, turns))
        for _ in range(LIMITS.searches):
            missing = self.missing(zeros)
            if not missing[0].size:
                return zeros
            zeros = self.newton(*self.with_these(zeros, missing))
        return self.beyond_rounding(zeros)

    @staticmethod
    def with_these(zeros: _Zeros, more: tuple[Whole, Array]) -> tuple[Whole, Array]:
        """Candidates: crossings that are known, and ``more``."""
        return np.concatenate([zeros.owner, more[0]]), np.concatenate([zeros.speed, more[1]])

    def candidates(self) -> tuple[Whole, Array]:
        """Bicycles and speeds near which a real root may be zero or a pair imaginary."""
        sums = SpeedPolynomial(
            {power: bialternate_sum(matrix) for power, matrix in self.polynomial.items()},
            shape=(len(self.unit), *[comb(self.polynomial.shape[-1], 2)] * 2),
        )
        both = [singular_speeds(part, LIMITS.shift * self.unit) for part in (self.polynomial, sums)]
        speeds = np.concatenate(both, 1)
        with np.errstate(invalid="ignore"):
            near = np.abs(speeds.imag) <= LIMITS.nearly_real * np.abs(speeds)
            low, high = (1 - 1e-3) * self.limits[:, :1], (1 + 1e-3) * self.limits[:, 1:]
            owner, place = np.nonzero(near & (speeds.real > low) & (speeds.real < high))
        return owner, speeds.real[owner, place]

    def newton(self, owner: Whole, speeds: Array, *, counted: bool = False) -> _Zeros:
        """Newton from every candidate along every root that may be the crossing one; each crossing once, no touches."""
        at = decompose(self.polynomial.take(owner), speeds)
        size = np.abs(at.values).max(1, keepdims=True, initial=0.0)
        step = np.abs(at.values.real) / np.maximum(np.abs(at.slopes.real), 1e-300)
        near = (step <= LIMITS.near * speeds[:, None]) | (np.abs(at.values.real) < 1e-6 * size)
        k, i = np.nonzero((at.values.imag >= 0) & near)
        there = Decomposition(*(part[k] for part in at))
        zeros = self._sharpened(owner[k], speeds[k], at.values[k, i], there, LIMITS.slack if counted else 1.0)
        low, high = self.limits[zeros.owner].T
        zeros = zeros.take((low < zeros.speed) & (zeros.speed <= high))
        return _once(self._crossing(zeros, (2.0, 20.0, 200.0) if counted else (2.0,)))

    def _sharpened(self, owner: Whole, speeds: Array, roots: Complex, at: Decomposition, slack: float) -> _Zeros:
        """Solve Re lambda(v) = 0 along the roots given; those that converge, from ``at`` on."""
        v, expected, still = speeds.copy(), roots.copy(), np.zeros(len(speeds), bool)
        last, row = np.full(len(speeds), np.inf), np.arange(len(speeds))
        polynomial = self.polynomial.take(owner)
        root, slope, moved = roots, roots, np.zeros(len(speeds))
        values, left, right = at.values, at.left, at.right
        for attempt in range(30):
            values, slopes, right, left = at
            own = np.abs(values - expected[:, None]).argmin(1)
            root, slope = values[row, own], slopes[row, own]
            moved = np.where(slope.real != 0, -root.real / np.where(slope.real == 0, 1, slope.real), 0.0)
            step = np.abs(moved) / v
            still |= (step <= LIMITS.rounding) & (step > last / 2)  # as near as rounding lets it come
            if still.all():
                break
            moved = np.where(still, 0.0, np.clip(moved, -0.1 * v, 0.1 * v))
            if attempt == 29:
                break
            v, expected = v + moved, root + slope * moved
            if (still | (step <= LIMITS.last_step)).all():
                root = np.where(root.imag == 0, expected.real, expected)
                break
            last = step
            at = decompose(polynomial, v)
        if not len(v):
            return _Zeros(owner, v, v, slope, v)
        error = slack * uncertainty(values, left, polynomial(v), right)[row, own]
        rise = v * np.abs(slope.real)
        good = np.abs(root.real) <= np.maximum(error, LIMITS.rounding * rise)
        good &= np.abs(v - speeds) <= LIMITS.farthest * speeds
        error = np.maximum(error, np.abs(root.real))
        good &= error < LIMITS.hardly_known * rise
        omega, doubt = np.abs(root.imag), error / np.maximum(np.abs(slope.real), 1e-300)
        return _Zeros(owner, v, omega, slope, doubt).take(good)

    def _crossing(self, zeros: _Zeros, looks: Sequence[float]) -> _Zeros:
        """Take crossings whose real part changes its sign beyond doubt; a touch that rounding moves is none."""
        sure = zeros.doubt <= LIMITS.well_known * zeros.speed
        for look in looks:
            rest = np.flatnonzero(~sure)
            if not rest.size:
                break
            one = zeros.take(rest)
            far = np.minimum(look * one.doubt, np.maximum(1e-3 * one.speed, 2 * one.doubt))
            away = np.concatenate([-far, far])
            twice = np.tile(np.arange(len(far)), 2)
            values = decompose(self.polynomial.take(one.owner[twice]), one.speed[twice] + away).values
            roots = 1j * one.omega[twice] + one.slope[twice] * away
            own = values[np.arange(len(away)), np.abs(values - roots[:, None]).argmin(1)]
            before, after = one.slope.real * own.real.reshape(2, -1)
            sure[rest[(before < 0) & (after > 0)]] = True
        return zeros.take(sure)

    def count_at_nodes(self) -> None:
        """Roots at fixed speeds of each bicycle within its limits, which also hold 12 even steps below the first."""
        top = self.limits[:, 1].max() / self.unit.min()
        more = np.arange(NODES[-1] + 0.8, top + 0.8, 0.8)
        nodes = np.concatenate([NODES, more])[None] * self.unit[:, None]
        low, high = self.limits[:, :1], self.limits[:, 1:]
        owner, place = np.nonzero((nodes > low) & (nodes < high))
        first = np.minimum(np.where(nodes > low, nodes, np.inf).min(1), self.limits[:, 1])
        below = np.maximum(low + (first[:, None] - low) * np.linspace(0, 1, 12)[:-1], low * (1 + 1e-9))
        every = np.arange(len(self.unit))
        speed = np.concatenate([nodes[owner, place], below.ravel(), high[:, 0]])
        owner = np.concatenate([owner, np.repeat(every, 11), every])
        order = np.lexsort((speed, owner))
        self.owner, self.speed = owner[order], speed[order]
        self.at = decompose(self.polynomial.take(self.owner), self.speed)
        self.unstable = unstable_roots(self.at.values)

    def turns(self) -> tuple[Whole, Array]:
        """Speeds next to which a real part that turns back between two nodes may be zero, before and after it turns."""
        a, z = slice(None, -1), slice(1, None)
        h = np.diff(self.speed)
        step = np.flatnonzero((self.owner[a] == self.owner[z]) & (h > 0))
        values, slopes = self.at.values, self.at.slopes
        half = h[step, None] / 2
        cost = np.abs(
            (values[step] + half * slopes[step])[:, :, None] - (values[step + 1] - half * slopes[step + 1])[:, None, :]
        )
        match = cost.argmin(2)
        noise = 1e-12 * np.abs(values).max(1, keepdims=True)
        after, rise_after = (np.take_along_axis(x[step + 1].real, match, 1) for x in (values, slopes))
        before, rise = values[step].real, h[step, None] * slopes[step].real
        rise_after = h[step, None] * rise_after
        towards = (before * after > 0) & (before * rise < 0) & (after * rise_after > 0)
        towards &= (np.abs(before) > noise[step]) & (np.abs(after) > noise[step + 1]) & (values[step].imag >= 0)
        k, i = np.nonzero(towards)
        before, after, rise, rise_after = (x[k, i] for x in (before, after, rise, rise_after))
        square, cube = 3 * (after - before) - 2 * rise - rise_after, rise + rise_after - 2 * (after - before)
        root = np.sqrt(np.maximum(square**2 - 3 * cube * rise, 0))  # Hermite's cubic turns at t
        t = -rise / (square + np.where(before > 0, root, -root))
        turn = before + t * (rise + t * (square + t * cube))
        reached = turn * np.sign(before) < LIMITS.turns * np.minimum(np.abs(before), np.abs(after))
        bend = np.maximum(np.abs(2 * square + 6 * cube * t), 1e-300)
        apart = np.minimum(np.sqrt(2 * np.abs(turn) / bend), 0.5)  # of the two zeros from the turn
        start, width, owner = self.speed[step[k]], h[step[k]], self.owner[step[k]]
        speeds = [(start + width * at)[reached] for at in (t - apart, t + apart)]
        low, high = self.limits[np.tile(owner[reached], 2)].T
        return np.tile(owner[reached], 2), np.clip(np.concatenate(speeds), low * (1 + 1e-9), high)

    def missing(self, zeros: _Zeros) -> tuple[Whole, Array]:
        """Speeds next to crossings that are not listed: where the number of unstable roots changes without them."""
        between = np.flatnonzero(zeros.owner[1:] == zeros.owner[:-1])
        middle = (zeros.speed[between] + zeros.speed[between + 1]) / 2
        owner = np.concatenate([self.owner, zeros.owner[between]])
        speed = np.concatenate([self.speed, middle])
        count = np.concatenate([self.unstable, self._count(zeros.owner[between], middle)])
        on = np.isin(owner + 1j * speed, zeros.owner + 1j * zeros.speed)
        order = np.lexsort((speed, owner))
        order = order[~on[order]]
        owner, speed, count = owner[order], speed[order], count[order]
        change = np.where(zeros.omega > 0, 2, 1) * np.sign(zeros.slope.real).astype(int)
        key, known_key = owner + 1j * speed, zeros.owner + 1j * zeros.speed  # complex numbers sort by both
        known = np.append(0, np.cumsum(change))[np.searchsorted(known_key, key)]
        step = np.flatnonzero((np.diff(count - known) != 0) & (owner[1:] == owner[:-1]))
        return self._bisected(owner[step], speed[step], speed[step + 1])

    def _count(self, owner: Whole, speed: Array) -> Whole:
        values = np.linalg.eigvals(self.polynomial.take(owner)(speed)) if len(owner) else np.empty((0, 1))
        return unstable_roots(values.astype(complex, copy=False)) if len(owner) else np.empty(0, np.intp)

    def _bisected(self, owner: Whole, low: Array, high: Array) -> tuple[Whole, Array]:
        """Narrow every change of the count of unstable roots down to a speed that Newton can start from."""
        owners, speeds = [np.empty(0, np.intp)], [np.empty(0)]
        while len(owner):
            middle = (low + high) / 2
            counts = [self._count(owner, v) for v in (low, middle, high)]
            halves = [(low, middle, counts[0] != counts[1]), (middle, high, counts[1] != counts[2])]
            owner, low, high = (
                np.concatenate(parts) for parts in zip(*((owner[at], a[at], b[at]) for a, b, at in halves), strict=True)
            )
            narrow = high - low < 1e-9 * high
            owners.append(owner[narrow])
            speeds.append((low[narrow] + high[narrow]) / 2)
            owner, low, high = owner[~narrow], low[~narrow], high[~narrow]
        return np.concatenate(owners), np.concatenate(speeds)

    def beyond_rounding(self, zeros: _Zeros) -> _Zeros:
        """The crossings, and those that rounding hides close to them where the count adds up better with them."""
        missing = self.missing(zeros)
        if not missing[0].size:
            return zeros
        found = self.newton(*missing, counted=True)
        new = [not any(_same(found, k, zeros, j) for j in range(len(zeros.speed))) for k in range(len(found.speed))]
        more = zeros.and_(found.take(np.array(new, bool)))
        return more if self.missing(more)[0].size < missing[0].size else zeros


def _same(one: _Zeros, k: int, other: _Zeros, j: int) -> bool:
    """True if two are one crossing, found twice."""
    return bool(
        one.owner[k] == other.owner[j]
        and abs(one.speed[k] - other.speed[j]) <= LIMITS.same_speed * other.speed[j]
        and (one.slope[k].real > 0) == (other.slope[j].real > 0)
        and abs(one.omega[k] - other.omega[j]) <= LIMITS.same_frequency * max(one.omega[k], other.omega[j])
    )


def _once(zeros: _Zeros) -> _Zeros:
    """Each crossing once, those of each bicycle by speed; two that are one and go opposite ways are a touch."""
    zeros = zeros.take(np.lexsort((zeros.omega, zeros.speed, zeros.owner)))
    groups: list[list[int]] = []
    for k in range(len(zeros.speed)):
        for group in groups[-8:]:
            last = group[-1]
            near = max(LIMITS.same_speed * zeros.speed[k], zeros.doubt[k] + zeros.doubt[last])
            alike = LIMITS.same_frequency * (zeros.omega[k] + 1) + near * np.abs(zeros.slope[[k, last]]).max()
            apart = zeros.speed[k] - zeros.speed[last], abs(zeros.omega[k] - zeros.omega[last])
            if zeros.owner[last] == zeros.owner[k] and apart[0] <= near and apart[1] <= alike:
                group.append(k)
                break
        else:
            groups.append([k])
    real = [g for g in groups if zeros.slope[g[0]].real * zeros.slope[g[-1]].real > 0]
    best = np.array([min(g, key=lambda k: zeros.doubt[k]) for g in real], np.intp)
    zeros = zeros.take(best)
    return zeros.take(np.lexsort((zeros.omega, zeros.speed, zeros.owner)))


def singular_speeds(polynomial: SpeedPolynomial, shift: Array) -> Complex:
    """Speeds (m, k; complex in general, m/s) at which each A(v) = sum of v^k A_k of a stack is singular.

    v^s A(v) = sum of u^k B_k about the speed ``shift`` (m,), u = v - shift; the eigenvalues of the companion matrix of
    B_0^-1 B_k are 1 / u. NaN where B_0 is singular.
    """
    lowest, highest = min(polynomial, default=0), max(polynomial, default=0)
    m, n, _ = polynomial.shape
    degree = highest - lowest
    if degree == 0 or n == 0:
        return np.empty((m, 0), complex)
    blocks = np.zeros((degree + 1, m, n, n))
    for power, matrix in polynomial.items():
        for k in range(power - lowest + 1):
            factor = comb(power - lowest, k) * np.abs(shift) ** (power - lowest)  # in units of the shift
            blocks[k] += (factor * np.sign(shift) ** (power - lowest - k))[:, None, None] * matrix
    companion = np.zeros((m, n * degree, n * degree))
    companion[:, n:, :-n] = np.eye(n * (degree - 1))
    right = np.concatenate([-block for block in blocks[1:]], -1)
    try:
        companion[:, :n] = np.linalg.solve(blocks[0], right)
    except np.linalg.LinAlgError:
        for one in range(m):  # the count of unstable roots finds what is lost
            if np.linalg.matrix_rank(blocks[0, one]) == n:
                companion[one, :n] = np.linalg.solve(blocks[0, one], right[one])
    good: Mask = np.asarray(np.isfinite(companion).all((1, 2)))
    inverse = np.linalg.eigvals(np.where(good[:, None, None], companion, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(shift[:, None] + np.abs(shift)[:, None] / inverse, complex)


def bialternate_sum(matrices: Array) -> Array:
    """Matrices (..., n(n-1)/2, n(n-1)/2) whose eigenvalues are the sums of two different ones of ``matrices``."""
    n = matrices.shape[-1]
    rows, columns, i, j, signs = _bialternate_pattern(n)
    size = comb(n, 2)
    total = np.zeros((size * size, *matrices.shape[:-2]))
    np.add.at(total, rows * size + columns, np.moveaxis(signs * matrices[..., i, j], -1, 0))
    return np.moveaxis(total, 0, -1).reshape(*matrices.shape[:-2], size, size)


@cache
def _bialternate_pattern(n: int) -> Whole:
    """Rows, columns, entries (i, j) and signs of the action x ^ y -> A x ^ y + x ^ A y on e_p ^ e_q, p > q."""
    pairs = [(p, q) for p in range(n) for q in range(p)]
    number = {pair: k for k, pair in enumerate(pairs)}
    entries = []
    for column, (p, q) in enumerate(pairs):
        for i in range(n):
            for first, second, source in ((i, q, p), (p, i, q)):
                if first != second:
                    row = number[max(first, second), min(first, second)]
                    entries.append((row, column, i, source, 1 if first > second else -1))
    return np.array(entries, np.intp).reshape(-1, 5).T


def follow_crossing(
    polynomials: SpeedPolynomial, speeds: Array, angular_frequency: Array, *, destabilising: bool
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Speeds (m,) at which one root of each bicycle crosses the imaginary axis, by Newton from where it is expected."""
    v, root = speeds.copy(), 1j * angular_frequency
    size, here, slope = np.zeros(len(v)), np.zeros(len(v), complex), np.zeros(len(v), complex)
    moving = np.arange(len(v))
    for _ in range(25):
        values, slopes, _, _ = decompose(polynomials.take(moving), v[moving])
        at = np.abs(values - root[moving, None]).argmin(1)[:, None]
        here[moving], slope[moving] = (np.take_along_axis(part, at, 1)[:, 0] for part in (values, slopes))
        size[moving] = np.abs(values).max(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -here[moving].real / slope[moving].real
        longest = 0.1 * v[moving]
        step = np.where(np.isfinite(step), np.clip(step, -longest, longest), 0.0)
        v[moving], root[moving] = v[moving] + step, here[moving] + slope[moving] * step
        moving = moving[np.abs(step) > 1e-13 * v[moving]]
        if not moving.size:
            break
    kind = np.where(angular_frequency > 0, here.imag > 1e-9 * size, np.abs(here.imag) <= 1e-9 * size)
    there = kind & (np.abs(here.real) <= 1e-9 * size) & ((slope.real > 0) == destabilising)
    return v, np.abs(here.imag), there
