"""A prescribed steer angle smoothed, with what is uncertain of it and of its first two derivatives.

The angle is a spline. Its coefficients' differences of order m are independent and normal, so it is white noise that
was integrated m times. How large they are, m, the number of knots, and the sd of the record's noise are those that
make the record most probable (restricted likelihood: Patterson & Thompson 1971; such splines: Eilers & Marx 1996).
A record often begins where a torque sets in: what then dies away is rougher than the rest of the run, and is free.
The covariance then holds both what noise does to the coefficients and what smoothing takes from the angle. That of a
least-squares spline has no room for the second: motion that noise hides in the angle stands out in its acceleration.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import minimize_scalar

from bicycle.identification.recording import STEER, Run
from studies.missing_effect.motion.friction import third_difference_noise
from tyre.base.arrays import Array

DEGREE = 5  # the second derivative is a cubic spline
FEWEST, SPANS, MORE = 6, 100, 2.0  # spans: at least, to begin with, and by which factor there are more
MOST_SHARE = 0.5  # coefficients a sample, beyond which nothing is smoothed
LEFT = 1.05  # times the noise, that a spline may leave
GAIN = 1.0  # of the log evidence, below which more knots are not worth it
INTEGRATED = (2, 3, 4, 5)  # times, m: from an acceleration that jumps to a smooth one
DYING = np.array([0.03, 0.1])  # s, time constants of what dies away after a start
VARIANCES = np.arange(-4.0, 24.1, 0.5)  # log10 of the variance of the smoothest motion, in those of the noise
SEEN = 1e-11  # of the largest singular value, below which one is rounding
ROUNDING = 1e-12  # of the largest angle, the least noise
DROPPED = 1e-3  # of the variance of the acceleration, which may be left out
ORDERS = 3  # the angle and two derivatives


class Shapes(NamedTuple):
    """K orthonormal motions at the T samples, made of C functions; the first ``free`` may be of any size.

    Those are polynomials and what dies away after the start; the others are the smoother the earlier they come.
    Coefficients of the functions (C, K), motions (T, K), and variance where the differences have sd 1 (K,), infinite
    where a motion is free.
    """

    coefficients: Array
    motions: Array
    weight: Array
    free: int


class Likely(NamedTuple):
    """The log evidence of a record, its noise (sd), and the share of each shape that is taken for motion (K,)."""

    evidence: float
    noise: float
    share: Array


@dataclass(frozen=True)
class SteerSpline:
    """A smoothed steer angle: a spline and what dies away after the start, with C coefficients.

    Attributes
    ----------
    time : ndarray, shape (T,)
        Of the samples, s.
    spans : int
        How many polynomials it is made of.
    coefficients : ndarray, shape (C,)
        rad.
    spread : ndarray, shape (C, K)
        What one standard deviation of each of K independent combinations does to the coefficients, rad.
    smoothing : ndarray, shape (T, T)
        From an acceleration at the samples to what the spline shows of it.
    """

    time: Array
    spans: int
    coefficients: Array
    spread: Array
    smoothing: Array

    @classmethod
    def of_run(cls, run: Run, noise: float | None) -> "SteerSpline":
        """Smooth the steer angle of a ``run``, whose ``noise`` (sd, rad) is estimated where it is not given.

        A record that scatters by more than the noise that is given has the noise that it shows.
        """
        recorded = run.inputs[STEER]
        white = third_difference_noise(recorded)
        allowed = LEFT * (white if noise is None else min(white, noise))
        most = max(FEWEST, int(MOST_SHARE * len(recorded)) - DEGREE - len(DYING))
        count = min(most, SPANS)
        shapes, likely = _most_likely(run.time, recorded, count, noise)
        while count < most:
            more = min(most, int(np.ceil(MORE * count)))
            finer, found = _most_likely(run.time, recorded, more, noise)
            if _left(recorded, shapes, likely) <= allowed and found.evidence <= likely.evidence + GAIN:
                break
            count, shapes, likely = more, finer, found
        shown = likely.share * (shapes.motions.T @ recorded)
        acceleration = _basis(run.time, count, 2) @ shapes.coefficients
        twice = np.tril(np.ones((len(recorded),) * 2)) * run.step
        smoothing = (acceleration * likely.share) @ (shapes.motions.T @ (twice @ twice))
        variance = np.cumsum((np.sum(acceleration**2, axis=0) * likely.share)[shapes.free :])
        # the roughest are left out, never the smooth ones, which lean the bicycle however little they accelerate
        kept = shapes.free + 1 + int(np.sum(variance < (1 - DROPPED) * variance[-1]))
        spread = likely.noise * shapes.coefficients[:, :kept] * np.sqrt(likely.share[:kept])
        return cls(run.time, count, shapes.coefficients @ shown, spread, smoothing)

    def at(self, later: float = 0.0) -> tuple[Array, Array]:
        """Angle and two derivatives (T, 3) at times ``later`` by so many s, and what is uncertain of them (T, 3, K).

        Outside the record it is the cubic that the spline is at the end.
        """
        inside = np.clip(self.time + later, self.time[0], self.time[-1])
        dt = (self.time + later - inside)[:, None]
        angle, rate, acceleration, jerk = (_basis(inside, self.spans, k, self.time) for k in range(ORDERS + 1))
        shapes = np.stack([
            angle + dt * (rate + dt / 2 * (acceleration + dt / 3 * jerk)),
            rate + dt * (acceleration + dt / 2 * jerk),
            acceleration + dt * jerk,
        ], 1)  # fmt: skip
        return shapes @ self.coefficients, shapes @ self.spread


def _basis(time: Array, spans: int, derivative: int = 0, samples: Array | None = None) -> Array:
    """A ``derivative`` at ``time`` (T,) of B-splines over ``samples`` (those times), then what dies away (T, C)."""
    samples = time if samples is None else samples
    width = (samples[-1] - samples[0]) / spans
    knots = samples[0] + width * np.arange(-DEGREE, spans + DEGREE + 1)
    splines = BSpline(knots, np.eye(spans + DEGREE), DEGREE)(time, nu=derivative)
    dying = np.exp(-(time - samples[0])[:, None] / DYING) * (-1 / DYING) ** derivative
    return np.concatenate([splines, dying], 1)


def _shapes(time: Array, spans: int, integrated: int) -> Shapes:
    """Motions of splines at ``time`` (T,) with a number of ``spans``, white noise ``integrated`` so many times."""
    basis = _basis(time, spans)
    whole, count = basis.shape[1], spans + DEGREE
    free = np.zeros((whole, integrated + len(DYING)))
    free[:count, :integrated] = np.polynomial.legendre.legvander(np.linspace(-1, 1, count), integrated - 1)
    free[count:, integrated:] = np.eye(len(DYING))
    q, r = np.linalg.qr(basis @ free)
    free = np.linalg.solve(r.T, free.T).T
    sums = np.eye(whole, count - integrated, -integrated)
    for _ in range(integrated):
        sums[:count] = np.cumsum(sums[:count], axis=0)  # without rounding: their differences of that order are white
    sums -= free @ (q.T @ (basis @ sums))
    u, s, vt = np.linalg.svd(basis @ sums, full_matrices=False)
    seen = s > SEEN * s[0]
    u, s, vt = u[:, seen], s[seen], vt[seen]
    weight = np.concatenate([np.full(free.shape[1], np.inf), s**2])
    coefficients = np.concatenate([free, sums @ (vt.T / s)], 1)
    return Shapes(coefficients, np.concatenate([q, u], 1), weight, free.shape[1])


def _most_likely(time: Array, recorded: Array, spans: int, noise: float | None) -> tuple[Shapes, Likely]:
    """The integrated noise that makes what was ``recorded`` (T,) most probable."""
    tried = [_shapes(time, spans, integrated) for integrated in INTEGRATED]
    found = [_likely(recorded, shapes, noise) for shapes in tried]
    best = max(range(len(found)), key=lambda k: found[k].evidence)
    return tried[best], found[best]


def _likely(recorded: Array, shapes: Shapes, noise: float | None) -> Likely:
    """Sizes of motion and noise that make the record (T,) most probable, the noise at least as given."""
    n, free = len(recorded), shapes.free
    power = (shapes.motions.T @ recorded) ** 2
    rest = max(float(recorded @ recorded - power.sum()), 0.0)
    weight = shapes.weight[free:] / shapes.weight[free]
    least = (ROUNDING * float(np.abs(recorded).max())) ** 2 + np.finfo(float).tiny
    # of free motions nothing is known but what one sample says (unit information: Kass & Wasserman 1995)
    wide = free * np.log(n * (third_difference_noise(recorded) ** 2 + least))

    def evidence(log_size: float, sd: float | None) -> tuple[float, float]:
        grown = 1 + 10**log_size * weight
        squares = float(np.sum(power[free:] / grown)) + rest
        variance = squares / (n - free) + least if sd is None else sd**2
        spread = (n - free) * np.log(variance) + float(np.sum(np.log(grown)))
        return -0.5 * (spread + squares / variance + wide), float(np.sqrt(variance))

    def best(sd: float | None) -> float:
        first = float(max(VARIANCES, key=lambda size: evidence(size, sd)[0]))
        step = float(VARIANCES[1] - VARIANCES[0])
        found = minimize_scalar(lambda x: -evidence(x, sd)[0], bounds=(first - step, first + step), method="bounded")
        return float(found.x)

    size = best(None)
    value, sd = evidence(size, None)
    if noise is not None and noise > sd:
        size = best(noise)
        value, sd = evidence(size, noise)
    motion = 10**size * weight
    return Likely(value, sd, np.concatenate([np.ones(free), motion / (1 + motion)]))


def _left(recorded: Array, shapes: Shapes, likely: Likely) -> float:
    """Sd of what the spline leaves of the record (T,), by its degrees of freedom."""
    left = recorded - shapes.motions @ (likely.share * (shapes.motions.T @ recorded))
    return float(np.sqrt(left @ left / max(len(recorded) - likely.share.sum(), 1.0)))
