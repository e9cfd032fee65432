"""Search for the speeds at which roots of A(v) cross the imaginary axis, of many bicycles at once.

With A(v) = sum v^k A_k, a real root is zero where det A(v) = 0, and a pair is imaginary where the bialternate sum
2 A(v) (.) I, whose eigenvalues are the sums of two eigenvalues of A, is singular (Guckenheimer, Myers & Sturmfels 1997,
SIAM J. Numer. Anal. 34, 1-21). Both are eigenvalue problems of a companion matrix in v. Newton with d(lambda)/dv
sharpens what they give. Unstable roots are counted at fixed speeds and between the crossings; where the count does not
add up, or a root turns back near the axis, the missing crossings are looked for there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import comb
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.eigen import Decomposition, decompose, spectra, uncertainty, unstable_roots
from tyre.ground.arrays import Array, Complex

Mask = NDArray[np.bool_]
Whole = NDArray[np.intp]


@dataclass(frozen=True)
class Limits:
    """Numbers that distinguish a crossing from a touch and from rounding; shares have no unit."""

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


class Zeros(NamedTuple):
    """Crossings (k,) of bicycles ``owner``: speed (m/s), rad/s, d(lambda)/dv, and how well the speed is known (m/s)."""

    owner: Whole  # (k,), numbers of the bicycles
    speed: Array  # (k,), m/s
    omega: Array  # (k,), rad/s; 0: a real root
    slope: Complex  # (k,), d(lambda)/dv of the crossing root, 1/m
    doubt: Array  # (k,), m/s: uncertainty of the speed from rounding

    def take(self, index: Whole | Mask) -> "Zeros":
        """Take the crossings at ``index``."""
        parts: tuple[Any, ...] = self
        return Zeros(*(part[index] for part in parts))

    def and_(self, more: "Zeros") -> "Zeros":
        """Join these and ``more`` ones, those of each bicycle by speed."""
        joined = Zeros(*(np.concatenate(parts) for parts in zip(self, more, strict=True)))
        return joined.take(np.lexsort((joined.omega, joined.speed, joined.owner)))


def find_crossings(polynomial: SpeedPolynomial, unit: Array, limits: Array) -> Zeros:
    """All crossings of bicycles A(v) = ``polynomial``, with sqrt(g w) = ``unit`` (m,), in ``limits`` (m, 2), m/s."""
    low = np.maximum(limits[:, 0], LIMITS.rest * unit)
    return Search(polynomial, unit, np.column_stack([low, limits[:, 1]])).run()


@dataclass
class Search:
    """The bicycles of a search, low < v <= high (m/s) of each in ``limits`` (m, 2), and what is known at nodes."""

    polynomial: SpeedPolynomial  # A(v) (m, n, n) of all bicycles, 1/s
    unit: Array  # (m,), sqrt(g w), m/s
    limits: Array  # (m, 2), m/s

    def run(self) -> Zeros:
        """All crossings; more are sought until they explain every change of the number of unstable roots."""
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
    def with_these(zeros: Zeros, more: tuple[Whole, Array]) -> tuple[Whole, Array]:
        """Bicycles and speeds (m/s) of candidates: the crossings ``zeros``, and ``more``."""
        return np.concatenate([zeros.owner, more[0]]), np.concatenate([zeros.speed, more[1]])

    def candidates(self) -> tuple[Whole, Array]:
        """Bicycles and speeds near which a real root may be zero or a pair imaginary."""
        stacked = bialternate_sum(np.stack([*self.polynomial.values()]))
        sums = SpeedPolynomial(dict(zip(self.polynomial, stacked, strict=True)), shape=stacked.shape[1:])
        candidates = [singular_speeds(part, LIMITS.shift * self.unit) for part in (self.polynomial, sums)]
        speeds = np.concatenate(candidates, 1)
        with np.errstate(invalid="ignore"):
            nearly_real = np.abs(speeds.imag) <= LIMITS.nearly_real * np.abs(speeds)
            low, high = (1 - 1e-3) * self.limits[:, :1], (1 + 1e-3) * self.limits[:, 1:]
            owner, place = np.nonzero(nearly_real & (speeds.real > low) & (speeds.real < high))
        return owner, speeds.real[owner, place]

    def newton(self, owner: Whole, speeds: Array, *, counted: bool = False) -> Zeros:
        """Newton from every candidate along every root that may be the crossing one; each crossing once, no touches."""
        at = decompose(self.polynomial.take(owner), speeds)
        size = np.abs(at.values).max(1, keepdims=True, initial=0.0)
        step = np.abs(at.values.real) / np.maximum(np.abs(at.slopes.real), 1e-300)
        may_cross = (step <= LIMITS.near * speeds[:, None]) | (np.abs(at.values.real) < 1e-6 * size)
        k, i = np.nonzero((at.values.imag >= 0) & may_cross)
        candidates = Decomposition(*(part[k] for part in at))
        zeros = self._sharpen(owner[k], speeds[k], at.values[k, i], candidates, LIMITS.slack if counted else 1.0)
        low, high = self.limits[zeros.owner].T
        zeros = zeros.take((low < zeros.speed) & (zeros.speed <= high))
        return _merge_duplicates(self._crossing(zeros, (2.0, 20.0, 200.0) if counted else (2.0,)))

    def _sharpen(self, owner: Whole, speeds: Array, roots: Complex, at: Decomposition, slack: float) -> Zeros:
        """Solve Re lambda(v) = 0 along the roots given; those that converge, from ``at`` on."""
        v = speeds.copy()
        expected = roots.copy()
        still = np.zeros(len(speeds), bool)
        last = np.full(len(speeds), np.inf)
        row = np.arange(len(speeds))
        polynomial = self.polynomial.take(owner)
        root, slope, change = roots, roots, np.zeros(len(speeds))
        values, left, right = at.values, at.left, at.right
        for attempt in range(30):
            values, slopes, right, left = at
            place = np.abs(values - expected[:, None]).argmin(1)
            root, slope = values[row, place], slopes[row, place]
            change = np.where(slope.real != 0, -root.real / np.where(slope.real == 0, 1, slope.real), 0.0)
            step = np.abs(change) / v
            still |= (step <= LIMITS.rounding) & (step > last / 2)  # as near as rounding lets it come
            if still.all():
                break
            change = np.where(still, 0.0, np.clip(change, -0.1 * v, 0.1 * v))
            if attempt == 29:
                break
            v, expected = v + change, root + slope * change
            if (still | (step <= LIMITS.last_step)).all():
                root = np.where(root.imag == 0, expected.real, expected)
                break
            last = step
            at = decompose(polynomial, v)
        if not len(v):
            return Zeros(owner, v, v, slope, v)
        error = slack * uncertainty(values, left, polynomial(v), right)[row, place]
        rise = v * np.abs(slope.real)
        good = np.abs(root.real) <= np.maximum(error, LIMITS.rounding * rise)
        good &= np.abs(v - speeds) <= LIMITS.farthest * speeds
        error = np.maximum(error, np.abs(root.real))
        good &= error < LIMITS.hardly_known * rise
        omega = np.abs(root.imag)
        doubt = error / np.maximum(np.abs(slope.real), 1e-300)
        return Zeros(owner, v, omega, slope, doubt).take(good)

    def _crossing(self, zeros: Zeros, looks: Sequence[float]) -> Zeros:
        """Take crossings whose real part changes its sign beyond doubt; a touch that rounding moves is none."""
        sure = zeros.doubt <= LIMITS.well_known * zeros.speed
        for look in looks:
            unsure = np.flatnonzero(~sure)
            if not unsure.size:
                break
            crossings = zeros.take(unsure)
            far = np.minimum(look * crossings.doubt, np.maximum(1e-3 * crossings.speed, 2 * crossings.doubt))
            offset = np.concatenate([-far, far])
            twice = np.tile(np.arange(len(far)), 2)
            values = spectra(self.polynomial.take(crossings.owner[twice])(crossings.speed[twice] + offset))
            roots = 1j * crossings.omega[twice] + crossings.slope[twice] * offset
            followed = values[np.arange(len(offset)), np.abs(values - roots[:, None]).argmin(1)]
            before, after = crossings.slope.real * followed.real.reshape(2, -1)
            sure[unsure[(before < 0) & (after > 0)]] = True
        return zeros.take(sure)

    def count_at_nodes(self) -> None:
        """Roots at fixed speeds of each bicycle within its limits, which also hold 12 even steps below the first."""
        top = self.limits[:, 1].max() / self.unit.min()
        more = np.arange(NODES[-1] + 0.8, top + 0.8, 0.8)
        nodes = np.concatenate([NODES, more])[None] * self.unit[:, None]
        low, high = self.limits[:, :1], self.limits[:, 1:]
        owner, place = np.nonzero((nodes > low) & (nodes < high))
        first = np.minimum(np.where(nodes > low, nodes, np.inf).min(1), self.limits[:, 1])
        low_nodes = np.maximum(low + (first[:, None] - low) * np.linspace(0, 1, 12)[:-1], low * (1 + 1e-9))
        bicycles = np.arange(len(self.unit))
        speed = np.concatenate([nodes[owner, place], low_nodes.ravel(), high[:, 0]])
        owner = np.concatenate([owner, np.repeat(bicycles, 11), bicycles])
        order = np.lexsort((speed, owner))
        self.owner, self.speed = owner[order], speed[order]
        self.at = decompose(self.polynomial.take(self.owner), self.speed, vectors=False)
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
        half_distance = np.minimum(np.sqrt(2 * np.abs(turn) / bend), 0.5)  # of the two zeros from the turn
        start, width, owner = self.speed[step[k]], h[step[k]], self.owner[step[k]]
        speeds = [(start + width * at)[reached] for at in (t - half_distance, t + half_distance)]
        low, high = self.limits[np.tile(owner[reached], 2)].T
        return np.tile(owner[reached], 2), np.clip(np.concatenate(speeds), low * (1 + 1e-9), high)

    def missing(self, zeros: Zeros) -> tuple[Whole, Array]:
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
        expected = np.append(0, np.cumsum(change))[np.searchsorted(known_key, key)]
        step = np.flatnonzero((np.diff(count - expected) != 0) & (owner[1:] == owner[:-1]))
        return self._bisect_counts(owner[step], speed[step], speed[step + 1])

    def _count(self, owner: Whole, speed: Array) -> Whole:
        return unstable_roots(spectra(self.polynomial.take(owner)(speed))) if len(owner) else np.empty(0, np.intp)

    def _bisect_counts(self, owner: Whole, low: Array, high: Array) -> tuple[Whole, Array]:
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

    def beyond_rounding(self, zeros: Zeros) -> Zeros:
        """The crossings, and those that rounding hides close to them where the count adds up better with them."""
        missing = self.missing(zeros)
        if not missing[0].size:
            return zeros
        hidden = self.newton(*missing, counted=True)
        new = [not any(_same(hidden, k, zeros, j) for j in range(len(zeros.speed))) for k in range(len(hidden.speed))]
        more = zeros.and_(hidden.take(np.array(new, bool)))
        return more if self.missing(more)[0].size < missing[0].size else zeros


def _same(a: Zeros, k: int, b: Zeros, j: int) -> bool:
    """True if two are one crossing, found twice."""
    return bool(
        a.owner[k] == b.owner[j]
        and abs(a.speed[k] - b.speed[j]) <= LIMITS.same_speed * b.speed[j]
        and (a.slope[k].real > 0) == (b.slope[j].real > 0)
        and abs(a.omega[k] - b.omega[j]) <= LIMITS.same_frequency * max(a.omega[k], b.omega[j])
    )


def _merge_duplicates(zeros: Zeros) -> Zeros:
    """Each crossing once, those of each bicycle by speed; two that are one and go opposite ways are a touch."""
    zeros = zeros.take(np.lexsort((zeros.omega, zeros.speed, zeros.owner)))
    group = np.arange(len(zeros.speed))
    for back in range(1, min(9, len(group))):  # how many places two finds of one crossing may be apart
        later, earlier = zeros.take(np.arange(back, len(group))), zeros.take(np.arange(len(group) - back))
        tolerance = np.maximum(LIMITS.same_speed * later.speed, later.doubt + earlier.doubt)
        steepest = np.maximum(np.abs(later.slope), np.abs(earlier.slope))
        alike = (later.owner == earlier.owner) & (later.speed - earlier.speed <= tolerance)
        alike &= np.abs(later.omega - earlier.omega) <= LIMITS.same_frequency * (later.omega + 1) + tolerance * steepest
        for k in np.flatnonzero(alike).tolist():
            group[group == group[k + back]] = group[k]
    _, first = np.unique(group, return_index=True)
    _, last = np.unique(group[::-1], return_index=True)
    crosses = zeros.slope[first].real * zeros.slope[len(group) - 1 - last].real > 0
    order = np.lexsort((zeros.doubt, group))
    _, best = np.unique(group[order], return_index=True)
    return zeros.take(np.sort(order[best[crosses]]))


def singular_speeds(polynomial: SpeedPolynomial, shift: Array) -> Complex:
    """Speeds (m, k; complex in general, m/s) at which each A(v) = sum of v^k A_k of a stack is singular.

    v^s A(v) = sum of u^k B_k about the speed ``shift`` (m,), u = v - shift; the eigenvalues of the companion matrix of
    B_0^-1 B_k are 1 / u. NaN where B_0 is singular.
    """
    lowest = min(polynomial, default=0)
    highest = max(polynomial, default=0)
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
        for row in range(m):  # the count of unstable roots finds what is lost
            if np.linalg.matrix_rank(blocks[0, row]) == n:
                companion[row, :n] = np.linalg.solve(blocks[0, row], right[row])
    good: Mask = np.asarray(np.isfinite(companion).all((1, 2)))
    inverse = spectra(companion if good.all() else np.where(good[:, None, None], companion, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(shift[:, None] + np.abs(shift)[:, None] / inverse, complex)


def bialternate_sum(matrices: Array) -> Array:
    """Matrices (..., n(n-1)/2, n(n-1)/2) whose eigenvalues are the sums of two different ones of ``matrices``."""
    n = matrices.shape[-1]
    rows, columns, i, j, signs = _bialternate_pattern(n)
    total = np.zeros((*matrices.shape[:-2], comb(n, 2), comb(n, 2)))
    total[..., rows, columns] = signs * matrices[..., i, j]
    p, q = np.tril_indices(n, -1)
    places = np.arange(len(p))
    diagonal = np.diagonal(matrices, axis1=-2, axis2=-1)
    total[..., places, places] = diagonal[..., p] + diagonal[..., q]
    return total


@cache
def _bialternate_pattern(n: int) -> Whole:
    """Rows, columns, entries (i, j), signs of x ^ y -> A x ^ y + x ^ A y on e_p ^ e_q, p > q, but its diagonal."""
    pairs = [(p, q) for p in range(n) for q in range(p)]
    number = {pair: k for k, pair in enumerate(pairs)}
    entries = []
    for column, (p, q) in enumerate(pairs):
        for i in range(n):
            for first, second, source in ((i, q, p), (p, i, q)):
                if first != second and i != source:
                    row = number[max(first, second), min(first, second)]
                    entries.append((row, column, i, source, 1 if first > second else -1))
    return np.array(entries, np.intp).reshape(-1, 5).T
