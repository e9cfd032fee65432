"""The curve of a lateral stiffness test: its strokes, the laws that may describe it, and their weights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import fdtrc, ndtri

from tyre.fits.friction import dahl_after
from tyre.ground.arrays import Array
from tyre.recordings.noise import correlated_covariance
from tyre.recordings.recording import Channel
from tyre.recordings.signal_quality import noise_level


@dataclass(frozen=True)
class Limits:
    """Limits of the fit of a lateral stiffness test."""

    chance: float = 1e-3  # that the noise of a gauge alone counts as a reversal somewhere in a recording
    blocks: int = 160  # about so many means stand for a long recording
    spared: int = 3  # blocks beyond its numbers, at least, that judge a law
    few: int = 10  # blocks; with fewer nothing is left out and no law has more than two terms
    terms: int = 4  # powers of the deflection, at most
    bent: float = 0.01  # chance, before looking, that a pull bends: most stay far below the friction limit
    cut: float = 0.88  # each range tried is so much of the one before it
    cuts: int = 12  # ranges tried
    negligible: float = 1e-3  # weight of a law, over the largest, that no longer counts
    presliding: tuple[float, float] = (1e-6, 3e-4)  # m, over which the friction of a rig builds up
    stiction: float = 0.1  # of the whole deflection; friction that takes longer cannot be told from stiffness
    p_memory: float = 0.05  # significance of a memory of the noise
    p_poor: float = 0.01  # significance of a fit that leaves more than noise


LIMITS = Limits()


def gauge_noise(deflection: Channel, force: Channel) -> float:
    """Standard deviation (m) of the noise of a displacement, also where it is coloured or the plate moves unevenly.

    The force separates the motion of the plate from noise of its gauge. Differences over longer and longer steps see
    all of a noise that has a memory.
    """
    slope = float(np.polyfit(deflection, force, 1)[0])
    beside_force = deflection - force / slope
    steps = [step for step in (1, 3, 10, 30) if step == 1 or deflection.size >= 40 * step]  # forty tell an sd
    return max(min(noise_level(deflection[::step]), noise_level(beside_force[::step])) for step in steps)


def find_strokes(deflection: Channel, *, noise: float, resolution: float) -> NDArray[np.int64]:
    """Readings at which the strokes begin.

    A stroke ends where the deflection turns back by more than the noise of the gauge does by chance, and by more than
    three reading steps.
    """
    by_chance = -2.0 * float(ndtri(LIMITS.chance / (2.0 * deflection.size))) * noise
    threshold = max(by_chance, 3.0 * resolution, 1e-9)
    turns, extreme, direction = [0], 0, 0.0
    for index in range(1, deflection.size):
        change = deflection[index] - deflection[extreme]
        advance = change * (direction or np.sign(change))
        if direction == 0.0:
            if advance > threshold:
                direction, extreme = float(np.sign(deflection[index] - deflection[turns[0]])), index
        elif advance >= 0.0:
            extreme = index
        elif -advance > threshold:
            turns.append(extreme)
            direction, extreme = -direction, index
    return np.array(turns)


@dataclass(frozen=True)
class Pull:
    """Readings (n,) of a test: deflection m, force N, clock from -1/2 to 1/2; strokes begin at ``turns``."""

    deflection: Channel  # (n,), m, plate minus rim
    force: Channel  # (n,), N, lateral force
    clock: Channel  # (n,), from -1/2 at the first reading to 1/2 at the last
    turns: NDArray[np.int64]  # (strokes,), reading at which each stroke begins

    @cached_property
    def span(self) -> float:
        """Range of the deflection, m."""
        return float(np.ptp(self.deflection))

    @cached_property
    def powers(self) -> Array:
        """Powers x |x / span|^k (n, terms) of the deflection, m."""
        share = np.abs(self.deflection / self.span)
        return np.asarray(self.deflection[:, None] * share[:, None] ** np.arange(LIMITS.terms))

    @cached_property
    def travelled(self) -> list[tuple[slice, float, Channel]]:
        """The readings of each stroke, its direction (-1 or 1), and the way (m) from its beginning to each."""
        ends = np.append(self.turns[1:], self.deflection.size - 1)
        strokes = []
        for number, (begin, end) in enumerate(zip(self.turns, ends, strict=True)):
            direction = float(np.sign(self.deflection[end] - self.deflection[begin]))
            readings = slice(begin + (number > 0), end + 1)
            way = np.maximum(direction * (self.deflection[readings] - self.deflection[begin]), 0.0)
            strokes.append((readings, direction, way))
        return strokes

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """First reading (m,) of each block: equal parts of time and way together, so that a long hold counts less."""
        count = self.deflection.size
        if count <= LIMITS.blocks:
            return np.arange(count)
        way, travelled = np.empty(count), 0.0
        for readings, _, way_of_stroke in self.travelled:
            way[readings] = travelled + np.maximum.accumulate(way_of_stroke)
            travelled = float(way[readings.stop - 1])
        part = np.arange(count) / count + way / travelled
        edges = np.searchsorted(part, np.linspace(0.0, part[-1], LIMITS.blocks + 1)[:-1])
        return np.unique(np.append(edges, self.turns))

    @cached_property
    def size(self) -> Channel:
        """Readings (m,) in each block."""
        return np.diff(np.append(self.first, self.deflection.size)).astype(np.float64)

    def means(self, channels: Array) -> Array:
        """Block means (m,) or (m, k) of channels (n,) or (n, k)."""
        return np.asarray((np.add.reduceat(channels, self.first, axis=0).T / self.size).T)

    def friction(self, presliding: float) -> Channel:
        """Dahl friction (n,) over its final value, from -1 to 1; starts from zero at the first reading."""
        state, friction = 0.0, np.empty(self.deflection.size)
        for readings, direction, way in self.travelled:
            friction[readings] = dahl_after(state, travel=way, direction=direction, presliding=presliding)
            whole = float(way[-1])
            state = float(dahl_after(state, travel=whole, direction=direction, presliding=presliding))
        return friction


@dataclass(frozen=True)
class Law:
    """F = F0 + K x (1 + c1 |x| + ...) + T + drift, with ``terms`` powers of x, of the first ``blocks``."""

    terms: int  # powers of x: 1 is a straight line
    blocks: int  # how many of the first block means it holds for
    friction: bool  # T, with its presliding, is fitted
    drift: bool  # the drift of the force's zero is fitted

    @property
    def numbers(self) -> int:
        """How many numbers are fitted: F0, the powers, friction and its presliding, drift."""
        return 1 + self.terms + 2 * self.friction + self.drift

    def columns(self, powers: Array, friction: Array, clock: Array) -> NDArray[np.float64]:
        """Columns of a linear fit: 1, the powers (k, terms or more), then friction and drift if they are fitted."""
        columns = [np.ones_like(clock), *powers[:, : self.terms].T]
        if self.friction:
            columns.append(friction)
        if self.drift:
            columns.append(clock)
        return np.column_stack(columns)


@dataclass(frozen=True)
class LawFit:
    """A law that was fitted to block means."""

    law: Law  # which numbers were fitted, and to how many blocks
    values: Array  # (p,), of the columns
    presliding: float  # m; 0 without friction
    cost: float  # weighted sum of squares, N^2
    jacobian: NDArray[np.float64]  # (m, p) or (m, p + 1) with the presliding, weighted by the root of the block sizes
    residual: Channel  # (m,), likewise

    @property
    def spare(self) -> int:
        """Degrees of freedom."""
        return self.law.blocks - self.law.numbers

    @property
    def left_over(self) -> float:
        """Standard deviation of a reading about the law, N."""
        return float(np.sqrt(self.cost / self.spare))

    @property
    def stiffness(self) -> float:
        """Slope at the origin, N/m."""
        return float(self.values[1])

    @property
    def stiffness_sd(self) -> float:
        """Standard deviation of the slope if the noise is white, N/m."""
        scale = np.linalg.norm(self.jacobian, axis=0)
        scale[scale == 0.0] = 1.0
        covariance = np.linalg.pinv((self.jacobian / scale).T @ (self.jacobian / scale), rcond=1e-15)
        return float(self.left_over * np.sqrt(covariance[1, 1]) / scale[1])

    def departure(self, pull: Pull, deflection: Array) -> Array:
        """Relative departure of the force from K x at some deflections (m)."""
        share = np.abs(deflection) / pull.span
        powers = [self.values[1 + power] * share**power for power in range(1, self.law.terms)]
        return np.asarray(np.sum(powers, axis=0) / self.stiffness) if powers else np.zeros_like(share)

    def force(self, pull: Pull) -> Channel:
        """The fitted force (n,), N; NaN at the readings that are left out."""
        fitted = np.full(pull.deflection.size, np.nan)
        used = used_readings(pull, self.law)
        friction = pull.friction(self.presliding) if self.law.friction else np.zeros_like(fitted)
        fitted[used] = self.law.columns(pull.powers[used], friction[used], pull.clock[used]) @ self.values
        return fitted


def used_readings(pull: Pull, law: Law) -> slice:
    """The readings that a law is fitted to: the first ones of the test."""
    return slice(0, int(np.append(pull.first, pull.deflection.size)[law.blocks]))


def smaller_ranges(pull: Pull, *, least_span: float) -> list[int]:
    """Numbers of the first blocks whose deflection stays within smaller and smaller ends, and spans enough (m).

    What has once slid does not come back, so the recording counts only before its deflection passes an end.
    """
    x = pull.means(pull.deflection)
    reach = float(np.max(np.abs(x)))
    passed = [int(np.argmax(np.abs(x) > LIMITS.cut**number * reach)) for number in range(1, LIMITS.cuts)]
    return sorted({count for count in passed if count > 1 and np.ptp(x[:count]) > least_span}, reverse=True)


def candidate_laws(pull: Pull, ranges: Sequence[int]) -> list[Law]:
    """Return the laws that may describe the first blocks, as many as each of the ``ranges`` gives."""
    starts = np.append(pull.first, pull.deflection.size)
    most = LIMITS.terms if pull.first.size >= LIMITS.few else 2
    laws = []
    for count, terms in product(ranges, range(1, most + 1)):
        strokes = int(np.sum(pull.turns < starts[count] - 1))
        with_friction = [True]
        if strokes == 1:
            # one stroke shows at most how friction builds up at its beginning, and not beside a curve of many powers
            with_friction = [False, True] if terms <= 2 else [False]
        for friction in with_friction:
            law = Law(terms, count, friction, drift=strokes > 1)
            if count - law.numbers >= LIMITS.spared:
                laws.append(law)
    return laws or [Law(1, count, friction=False, drift=False) for count in ranges]


@dataclass(frozen=True)
class PullCurve:
    """The laws that describe a test, the likeliest first, with their weights (sum 1)."""

    pull: Pull  # the readings
    fits: tuple[LawFit, ...]  # (k,), likeliest first
    weights: Channel  # (k,), probability of each
    noise: float  # standard deviation of a reading of the force, by its differences, N
    poor: bool  # the likeliest law leaves more than that, and not by chance
    slow: float  # factor on standard deviations by the memory of what is left
    dof: float  # effective degrees of freedom behind ``stiffness_sd``

    @property
    def stiffness(self) -> float:
        """Mean of the slopes at the origin, N/m."""
        return float(self.weights @ [fit.stiffness for fit in self.fits])

    @property
    def stiffness_sd(self) -> float:
        """Its standard deviation, with what the laws differ by, N/m."""
        slopes, sds = (np.array([getattr(fit, name) for fit in self.fits]) for name in ("stiffness", "stiffness_sd"))
        return float(np.sqrt(self.weights @ ((self.slow * sds) ** 2 + (slopes - self.stiffness) ** 2)))

    @property
    def leader(self) -> LawFit:
        """The likeliest law."""
        return self.fits[0]


def fit_curve(pull: Pull, *, noise_floor: float, least_span: float) -> PullCurve:
    """Fit all laws that may describe a lateral stiffness test, and weigh them.

    The weight of a law is exp(-(chi^2 + p ln n + 2 q + 2 m) / 2). It has p numbers (Schwarz 1978; they cost more with
    few of the n block means, McQuarrie 1999, *Stat. Probab. Lett.* 44, 79). The q powers beyond the second cost less
    (Akaike 1974), as a tyre that slides has all of them. The m block means left out must be earned (Jay & Neil 2021,
    *Phys. Rev. D* 103, 114502), and smaller ranges are tried only where the full one fits badly. Noise with a memory
    bends a curve as a law does, so chi^2 is that of its slow part.
    """
    solver = LawSolver(pull)
    fits = [solver.roughly(law) for law in candidate_laws(pull, [pull.first.size])]
    fast, fast_dof = difference_noise(pull, fits, noise_floor)
    best = min(fits, key=lambda fit: _criterion(fit, pull, fast))
    if _is_poor(best, fast, fast_dof) and pull.first.size >= LIMITS.few:
        fits += [solver.roughly(law) for law in candidate_laws(pull, smaller_ranges(pull, least_span=least_span))]
        # what no law removes is slow noise, and no lack of fit
        judging = [fit for fit in fits if fit.spare >= max(LIMITS.few, 0.3 * pull.first.size)]
        noise = max(fast, min((fit.left_over for fit in judging), default=0.0))
        best = min(fits, key=lambda fit: _criterion(fit, pull, noise))
    else:
        squares = fast**2 * fast_dof + best.cost  # a law that fits tells the noise, too
        noise = float(np.sqrt(squares / (fast_dof + best.spare)))
    slow, dof = _slowness(best)
    least = min(_criterion(fit, pull, slow * noise) for fit in fits)
    highest = least - 2.0 * np.log(LIMITS.negligible)
    fits = [solver.fully(fit) for fit in fits if _criterion(fit, pull, slow * noise) < highest]
    fits = sorted(fits, key=lambda fit: _criterion(fit, pull, slow * noise))
    criteria = np.array([_criterion(fit, pull, slow * noise) for fit in fits])
    weights = np.exp(-0.5 * (criteria - criteria[0]))
    leader = fits[0]
    poor = _is_poor(leader, fast, fast_dof)
    return PullCurve(pull, tuple(fits), weights / weights.sum(), fast, poor, slow, dof)


def _is_poor(fit: LawFit, noise: float, noise_dof: float) -> bool:
    """True if the residuals of a law exceed a noise (N) that is known with so many degrees of freedom."""
    return bool(fdtrc(fit.spare, noise_dof, fit.cost / fit.spare / noise**2) < LIMITS.p_poor)


def _criterion(fit: LawFit, pull: Pull, noise: float) -> float:
    """How unlikely a law is, for a noise (N) of the readings."""
    left_out = pull.first.size - fit.law.blocks
    return float(fit.cost / noise**2) + _penalty(fit.law, pull.first.size) + 2.0 * left_out


def _penalty(law: Law, count: int) -> float:
    """What the numbers of a law cost, for ``count`` block means in all."""
    cheaper = max(law.terms - 2, 0)
    small = law.blocks / max(law.blocks - law.numbers - 2, 0.5)
    penalty = small * ((law.numbers - cheaper) * float(np.log(count)) + 2.0 * cheaper)
    return penalty - 2.0 * float(np.log(LIMITS.bent)) if law.terms > 1 else penalty


class LawSolver:
    """Fits laws to the block means of one lateral stiffness test."""

    def __init__(self, pull: Pull) -> None:
        self.pull = pull
        self.root = np.sqrt(pull.size)
        self.force, self.clock = pull.means(pull.force), pull.means(pull.clock)
        self.powers = pull.means(pull.powers)
        least, most = LIMITS.presliding
        self.bounds = [float(np.log(least)), float(np.log(max(min(most, LIMITS.stiction * pull.span), 2.0 * least)))]
        lengths = np.exp(np.linspace(self.bounds[0], self.bounds[1], 7))
        self.trials = [(float(length), pull.means(pull.friction(length))) for length in lengths]

    def roughly(self, law: Law) -> LawFit:
        """Fit a law with the best of a few presliding lengths."""
        if not law.friction:
            return self._fit(law, 0.0, np.zeros_like(self.clock))
        return min((self._fit(law, *trial) for trial in self.trials), key=lambda fit: fit.cost)

    def fully(self, fit: LawFit) -> LawFit:
        """Fit the presliding length, too."""
        if not fit.law.friction:
            return fit

        def at(log_length: float) -> LawFit:
            length = float(np.exp(log_length))
            return self._fit(fit.law, length, self.pull.means(self.pull.friction(length)))

        low, high = self.bounds
        begin = float(np.clip(np.log(fit.presliding), low + 1e-3, high - 1e-3))
        search: Any = scipy.optimize.least_squares
        exact = dict.fromkeys(("ftol", "xtol", "gtol"), 1e-15)  # so that rounding of the file decides nothing
        log_length = float(
            search(lambda z: at(z[0]).residual, [begin], jac="3-point", bounds=([low], [high]), **exact).x[0]
        )
        best, step = at(log_length), 1e-3
        by_length = [self._column(fit.law, best, log_length + change) for change in (-step, step)]
        by_presliding = (by_length[1] - by_length[0]) / (2.0 * step)
        return replace(best, jacobian=np.column_stack([best.jacobian, by_presliding]))

    def _column(self, law: Law, fit: LawFit, log_length: float) -> Channel:
        """Weighted force of friction (m,), N, for a presliding length."""
        used = slice(0, law.blocks)
        friction = self.pull.means(self.pull.friction(float(np.exp(log_length))))
        return np.asarray(self.root[used] * friction[used] * fit.values[1 + law.terms])

    def _fit(self, law: Law, presliding: float, friction: Channel) -> LawFit:
        used = slice(0, law.blocks)
        root = self.root[used]
        jacobian = law.columns(self.powers[used], friction[used], self.clock[used]) * root[:, None]
        values = np.asarray(np.linalg.lstsq(jacobian, self.force[used] * root, rcond=None)[0], np.float64)
        residual = jacobian @ values - self.force[used] * root
        return LawFit(law, values, presliding, float(residual @ residual), jacobian, residual)


_DIFFERENCE = np.array([1.0, -2.0, 1.0])  # no slope is left in it, and the curve of a tyre hardly


def difference_noise(pull: Pull, fits: Sequence[LawFit], floor: float) -> tuple[float, float]:
    """Standard deviation (N) of a reading of the force, by the differences of block means, and degrees of freedom."""
    count = pull.first.size
    if count < LIMITS.few:
        # nothing but the fits tells the noise of a few readings: that of the likeliest is taken
        best = min(fits, key=lambda fit: count * np.log(max(fit.cost, 1e-300)) + _penalty(fit.law, count))
        return max(best.left_over, floor), float(best.spare)
    beside_line = pull.means(pull.force - fits[0].stiffness * pull.deflection)
    off = np.convolve(beside_line, _DIFFERENCE, mode="valid")
    off /= np.sqrt(np.convolve(1.0 / pull.size, _DIFFERENCE**2, mode="valid"))
    white = 1.4826 * float(np.median(np.abs(off)))
    return max(white, floor), count / 4.0  # a median of overlapping differences tells so much


def _slowness(fit: LawFit) -> tuple[float, float]:
    """Factor by which the memory of the residuals widens the slope's standard deviation, and degrees of freedom."""
    if fit.law.blocks < 4 * LIMITS.few or not _remembers(fit):
        return 1.0, float(fit.spare)
    scale = np.linalg.norm(fit.jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    covariance, dof = correlated_covariance(fit.jacobian / scale, fit.residual)
    return max(1.0, float(np.sqrt(covariance[1, 1]) / scale[1]) / fit.stiffness_sd), dof


def _remembers(fit: LawFit) -> bool:
    """True if groups of neighbouring residuals differ by more than chance: an analysis of variance."""
    width = round(np.sqrt(fit.residual.size))
    groups = fit.residual[: fit.residual.size // width * width].reshape(-1, width)
    between = width * float(np.var(groups.mean(axis=1), ddof=1))
    within = float(np.mean(np.var(groups, axis=1, ddof=1)))
    count = groups.shape[0]
    return bool(fdtrc(count - 1, count * (width - 1), between / max(within, 1e-300)) < LIMITS.p_memory)
