"""A prescribed steer angle, smoothed by a spline, with the uncertainty of it and of its first two derivatives.

The differences of order m of the spline's coefficients are independent and normal, so the motion is white noise that
was integrated m times (such splines: Eilers & Marx 1996). Their size, m, the number of knots, and the sd of the noise
are the most probable ones. Functions that are added to the spline may be of any size (restricted likelihood: Patterson
& Thompson 1971); one sample's information is known of them (unit information: Kass & Wasserman 1995, J. Am. Stat. Ass.
90, 928-934). These are what dies away after the start, for a record often begins where a torque sets in, and jumps of
the acceleration where the recorded torque jumps. The covariance holds both what noise does to the
coefficients and what smoothing takes from the angle.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from bicycle.identification.recording import STEER, STEER_TORQUE, Run
from studies.diagnosis.mistakes import third_difference_noise
from tyre.ground.arrays import Array

DEGREE = 5  # the second derivative is a cubic spline
DYING = np.array([0.03, 0.1])  # s, time constants of what dies away after a start
ORDERS = 3  # the angle and two derivatives


class Functions(NamedTuple):
    """Functions with C coefficients that a steer angle is made of: those of a spline, then the added ones."""

    time: Array  # of the samples, s
    spans: int  # polynomials of the spline
    jumps: tuple[float, ...] = ()  # times at which the acceleration jumps, s

    @property
    def of_spline(self) -> int:
        """Number of coefficients of the spline."""
        return self.spans + DEGREE

    def at(self, time: Array, derivative: int = 0) -> Array:
        """Functions, or their derivatives of that order, at a ``time`` (n,) in s: shape (n, C)."""
        first, last = self.time[0], self.time[-1]
        knots = first + (last - first) / self.spans * np.arange(-DEGREE, self.spans + DEGREE + 1)
        splines = scipy.interpolate.BSpline(knots, np.eye(self.of_spline), DEGREE)(time, nu=derivative)
        dying = np.exp(-(time - first)[:, None] / DYING) * (-1 / DYING) ** derivative
        return np.concatenate([splines, dying, jumping(time, self.jumps, derivative)], 1)


def jumping(time: Array, jumps: Sequence[float] | Array, derivative: int = 0) -> Array:
    """Angles (n, 4 J) whose acceleration jumps from 0 to 1 and then stays or dies away, or whose rate jumps."""
    after = np.maximum(time[:, None] - np.asarray(jumps, float), 0.0)[..., None]
    started = (after > 0).astype(float)
    decay = np.exp(-after / DYING)
    stays = (after**2 / 2, after, started, 0 * after)[derivative]
    dies = (DYING * (after - DYING * (1 - decay)), DYING * (1 - decay), started * decay, -started * decay / DYING)
    sooner = (after, started, 0 * after, 0 * after)[derivative]
    return np.concatenate([stays, sooner, dies[derivative]], -1).reshape(len(time), -1)


def torque_jumps(time: Array, torque: Array) -> tuple[float, ...]:
    """Times (s) at which a torque jumps, in the middle between two samples, the largest first."""
    aside = 6
    if len(torque) < 2 * aside:
        return ()
    u = (np.arange(2 * aside) - aside + 0.5) / aside
    weights = np.linalg.pinv(np.column_stack([u > 0, *(u**k for k in range(4))]))[0]
    noise = 1.4826 / np.sqrt(20.0) * float(np.median(np.abs(np.diff(torque, 3))))
    clear = 6.0 * max(noise * float(np.linalg.norm(weights)), float(np.finfo(float).eps * np.abs(torque).max()))

    def without(steps: dict[int, float]) -> Array:
        remaining = torque.copy()
        for place, size in steps.items():
            remaining[place + aside :] -= size
        return remaining

    steps: dict[int, float] = {}  # place -> size, each with the others taken away
    passed: list[int] = []
    while len(steps) < len(torque) // 12:
        sizes = np.correlate(without(steps), weights, "valid")
        sizes[[*steps, *passed]] = 0.0
        place = int(np.argmax(np.abs(sizes)))
        if abs(sizes[place]) <= clear:
            break
        if any(abs(place - k) <= aside and abs(sizes[place]) < 0.25 * abs(size) for k, size in steps.items()):
            passed.append(place)  # a cubic does not follow the torque beside a larger step
            continue
        steps[place] = float(sizes[place])
        for step in list(steps) * 3:  # rounds in which steps that are near each other are told apart
            remaining = without({k: size for k, size in steps.items() if k != step})
            steps[step] = float(weights @ remaining[step : step + len(weights)])
    jumps = [k for k in sorted(steps, key=lambda k: -abs(steps[k])) if abs(steps[k]) > clear]
    return tuple(float(x) for x in (time[aside - 1 :][jumps] + time[aside:][jumps]) / 2)


class Shapes(NamedTuple):
    """K orthonormal motions at the T samples, made of C functions; the first ``free`` may be of any size."""

    coefficients: Array  # of the functions (C, K)
    motions: Array  # (T, K)
    weight: Array  # variance if the differences have sd 1 (K,), infinite if a motion is free
    free: int  # how many


def shapes_of(functions: Functions, integrated: int) -> Shapes:
    """Motions that functions make if the differences of the spline's coefficients, ``integrated`` times, are white."""
    basis = functions.at(functions.time)
    whole, count = basis.shape[1], functions.of_spline
    free = np.zeros((whole, integrated + whole - count))
    free[:count, :integrated] = np.polynomial.legendre.legvander(np.linspace(-1, 1, count), integrated - 1)
    free[count:, integrated:] = np.eye(whole - count)
    free /= np.linalg.norm(basis @ free, axis=0)
    q, r, vt = np.linalg.svd(basis @ free, full_matrices=False)
    distinct = r > 1e-6 * r[0]  # jumps at neighbouring samples are alike
    q, free = q[:, distinct], free @ (vt[distinct].T / r[distinct])
    sums = np.eye(whole, count - integrated, -integrated)
    for _ in range(integrated):
        sums[:count] = np.cumsum(sums[:count], axis=0)  # without rounding: their differences of that order are white
    for _ in range(2):  # rounding leaves something the first time
        sums -= free @ (q.T @ (basis @ sums))
    u, s, vt = np.linalg.svd(basis @ sums, full_matrices=False)
    resolved = s > 1e-11 * s[0]  # below it a singular value is rounding
    u, s, vt = u[:, resolved], s[resolved], vt[resolved]
    weight = np.concatenate([np.full(free.shape[1], np.inf), s**2])
    coefficients = np.concatenate([free, sums @ (vt.T / s)], 1)
    return Shapes(coefficients, np.concatenate([q, u], 1), weight, free.shape[1])


class Likely(NamedTuple):
    """Log evidence of a record, its noise (sd), and the share of each shape that is taken for motion (K,)."""

    evidence: float  # log of the probability of the record
    noise: float  # sd, rad
    share: Array  # (K,), 0 to 1: of the record along each shape, what is motion and not noise


@dataclass(frozen=True)
class Likelihood:
    """Probability of a record (T,), rad, as motion of these shapes with noise of sd ``least`` or more."""

    recorded: Array  # (T,), rad
    shapes: Shapes  # the K motions that it may be made of
    least: float | None  # rad; None: the noise is estimated with no lower limit

    @cached_property
    def seen(self) -> Array:
        """The record along the motions, shape (K,)."""
        return np.asarray(self.shapes.motions.T @ self.recorded)

    @cached_property
    def _weight(self) -> Array:
        free = self.shapes.free
        return self.shapes.weight[free:] / self.shapes.weight[free]

    @cached_property
    def _rounding(self) -> float:
        return float((1e-12 * np.abs(self.recorded).max()) ** 2 + np.finfo(float).tiny)

    @cached_property
    def _parts(self) -> tuple[Array, float, float]:
        """Squares (K - free,) along motions that are not free, the square that all leave, and log of the free part."""
        n, free, power = len(self.recorded), self.shapes.free, self.seen**2
        square_left = max(float(self.recorded @ self.recorded - power.sum()), 0.0)
        white = third_difference_noise(self.recorded) ** 2 + self._rounding
        return power[free:], square_left, free * math.log(n * white)

    def at(self, size: float, sd: float | None) -> tuple[float, float]:
        """Log evidence at log10 ``size`` of motion over noise (variances), and sd (rad) of noise, fitted if None."""
        power, square_left, wide = self._parts
        n, free = len(self.recorded), self.shapes.free
        grown = 1 + 10**size * self._weight
        squares = float(np.sum(power / grown)) + square_left
        variance = squares / (n - free) + self._rounding if sd is None else sd**2
        spread = (n - free) * math.log(variance) + float(np.sum(np.log(grown)))
        return -0.5 * (spread + squares / variance + wide), math.sqrt(variance)

    @cached_property
    def likely(self) -> Likely:
        """Evidence, noise and shares at the most probable sizes."""
        exponents = np.arange(-4.0, 24.1, 0.5)

        def best(sd: float | None) -> float:
            first = float(max(exponents, key=lambda size: self.at(size, sd)[0]))
            bounds = (first - 0.5, first + 0.5)
            return float(
                scipy.optimize.minimize_scalar(lambda x: -self.at(x, sd)[0], bounds=bounds, method="bounded").x
            )

        size = best(None)
        value, sd = self.at(size, None)
        if self.least is not None and self.least > sd:
            size = best(self.least)
            value, sd = self.at(size, self.least)
        motion = 10**size * self._weight
        return Likely(value, sd, np.concatenate([np.ones(self.shapes.free), motion / (1 + motion)]))

    @property
    def left(self) -> float:
        """Sd of the rest of the record, by its degrees of freedom."""
        remainder = self.recorded - self.shapes.motions @ (self.likely.share * self.seen)
        return float(np.sqrt(remainder @ remainder / max(len(remainder) - self.likely.share.sum(), 1.0)))


def find_most_likely(functions: Functions, recorded: Array, least: float | None) -> Likelihood:
    """Most probable number of times that the noise was integrated: from an acceleration that jumps to a smooth one."""
    likelihoods = [Likelihood(recorded, shapes_of(functions, integrated), least) for integrated in (2, 3, 4, 5)]
    return max(likelihoods, key=lambda likelihood: likelihood.likely.evidence)


@dataclass(frozen=True)
class SteerSpline:
    """A smoothed steer angle with C coefficients."""

    functions: Functions  # the C functions that the angle is a sum of
    coefficients: Array  # (C,), rad
    spread: Array  # (C, K): the coefficients' change by one sd of each of K independent combinations, rad
    smoothing: Array  # (T, T): from an acceleration at the samples to what the spline shows of it

    @classmethod
    def of_run(cls, run: Run, noise: float | None) -> "SteerSpline":
        """Smooth the steer angle of a ``run``, whose ``noise`` (sd, rad) is estimated if it is not given."""
        torque = run.channels.get(STEER_TORQUE)
        jumps = () if torque is None else torque_jumps(run.time, torque)
        return cls._smooth(run.time.tobytes(), run.inputs[STEER].tobytes(), run.step, jumps, noise)

    @classmethod
    @lru_cache(maxsize=64)  # other readings of the other channels leave the angle as it is
    def _smooth(
        cls, times: bytes, angle: bytes, step: float, jumps: tuple[float, ...], noise: float | None
    ) -> "SteerSpline":
        time, recorded = np.frombuffer(times), np.frombuffer(angle)
        white = third_difference_noise(recorded)
        allowed = 1.05 * (white if noise is None else min(white, noise))
        most = max(6, len(recorded) // 2 - DEGREE - len(DYING))  # half as many coefficients as samples
        functions = Functions(time, min(most, 100), jumps)
        best = find_most_likely(functions, recorded, noise)
        while functions.spans < most:
            finer = functions._replace(spans=min(most, 2 * functions.spans))
            finer_fit = find_most_likely(finer, recorded, noise)
            if best.left <= allowed and finer_fit.likely.evidence - best.likely.evidence <= 1.0:
                break
            functions, best = finer, finer_fit
        shapes, likely = best.shapes, best.likely
        amplitudes = likely.share * best.seen
        acceleration = functions.at(time, 2) @ shapes.coefficients
        twice = np.tril(np.ones((len(recorded),) * 2)) * step
        smoothing = (acceleration * likely.share) @ (shapes.motions.T @ (twice @ twice))
        variance = np.cumsum((np.sum(acceleration**2, axis=0) * likely.share)[shapes.free :])
        # the roughest are left out, never the smooth ones, which lean the bicycle however little they accelerate
        count = shapes.free + 1 + int(np.sum(variance < (1 - 1e-3) * variance[-1]))
        spread = likely.noise * shapes.coefficients[:, :count] * np.sqrt(likely.share[:count])
        return cls(functions, shapes.coefficients @ amplitudes, spread, smoothing)

    def at(self, later: float = 0.0) -> tuple[Array, Array]:
        """Angle and two derivatives (T, 3) at times ``later`` by so many s, and their uncertainty (T, 3, K)."""
        time = self.functions.time
        clipped = np.clip(time + later, time[0], time[-1])
        dt = (time + later - clipped)[:, None]
        angle, rate, acceleration, jerk = (self.functions.at(clipped, k) for k in range(ORDERS + 1))
        shapes = np.stack(
            [
                angle + dt * (rate + dt / 2 * (acceleration + dt / 3 * jerk)),
                rate + dt * (acceleration + dt / 2 * jerk),
                acceleration + dt * jerk,
            ],
            1,
        )
        return shapes @ self.coefficients, shapes @ self.spread
