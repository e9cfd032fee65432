"""How probable a record of a steer angle is, by how rough its motion and how loud its noise is taken to be.

The differences of order m of the spline's coefficients are independent and normal, so the motion is white noise that
was integrated m times; what is added to the spline may be of any size (restricted likelihood: Patterson & Thompson
1971). Of that nothing is known but what one sample says (unit information: Kass & Wasserman 1995, J. Am. Stat. Assoc.
90, 928-934).
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from studies.missing_effect.motion.friction import third_difference_noise
from studies.missing_effect.motion.steer_functions import Functions
from tyre.base.arrays import Array

INTEGRATED = (2, 3, 4, 5)  # times, m: from an acceleration that jumps to a smooth one
VARIANCES = np.arange(-4.0, 24.1, 0.5)  # log10 of the variance of the smoothest motion, in those of the noise
SEEN = 1e-11  # of the largest singular value, below which one is rounding
TWINS = 1e-6  # the same, of functions that are added
ROUNDING = 1e-12  # of the largest angle, the least noise


class Shapes(NamedTuple):
    """K orthonormal motions at the T samples, made of C functions; the first ``free`` may be of any size.

    Those are polynomials and what is added to the spline; the others are the smoother the earlier they come.
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
class Likelihood:
    """Of a record.

    Attributes
    ----------
    recorded : ndarray, shape (T,)
        rad.
    shapes : Shapes
        What its motion is made of.
    least : float, optional
        Sd of its noise, at least, rad.
    """

    recorded: Array
    shapes: Shapes
    least: float | None

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
        return float((ROUNDING * np.abs(self.recorded).max()) ** 2 + np.finfo(float).tiny)

    @cached_property
    def _parts(self) -> tuple[Array, float, float]:
        """Squares along the motions that are not free and beside all of them, and the log of what is free."""
        n, free, power = len(self.recorded), self.shapes.free, self.seen**2
        rest = max(float(self.recorded @ self.recorded - power.sum()), 0.0)
        white = third_difference_noise(self.recorded) ** 2 + self._rounding
        return power[free:], rest, free * math.log(n * white)

    def at(self, size: float, sd: float | None) -> tuple[float, float]:
        """Log evidence, and sd (rad) of the noise.

        Parameters
        ----------
        size : float
            log10 of the variance of the smoothest motion (1, in those of the noise).
        sd : float or None
            Of the noise, rad; the most probable where it is not given.
        """
        power, rest, wide = self._parts
        n, free = len(self.recorded), self.shapes.free
        grown = 1 + 10**size * self._weight
        squares = float(np.sum(power / grown)) + rest
        variance = squares / (n - free) + self._rounding if sd is None else sd**2
        spread = (n - free) * math.log(variance) + float(np.sum(np.log(grown)))
        return -0.5 * (spread + squares / variance + wide), math.sqrt(variance)

    def share(self, size: float) -> Array:
        """The share of each shape that is taken for motion (K,).

        Parameters
        ----------
        size : float
            As in :meth:`at` (1).
        """
        motion = 10**size * self._weight
        return np.concatenate([np.ones(self.shapes.free), motion / (1 + motion)])

    @cached_property
    def likely(self) -> Likely:
        """With the most probable sizes."""

        def best(sd: float | None) -> float:
            first = float(max(VARIANCES, key=lambda size: self.at(size, sd)[0]))
            step = float(VARIANCES[1] - VARIANCES[0])
            bounds = (first - step, first + step)
            return float(minimize_scalar(lambda x: -self.at(x, sd)[0], bounds=bounds, method="bounded").x)

        size = best(None)
        value, sd = self.at(size, None)
        if self.least is not None and self.least > sd:
            size = best(self.least)
            value, sd = self.at(size, self.least)
        return Likely(value, sd, self.share(size))


def shapes_of(functions: Functions, integrated: int) -> Shapes:
    """Motions that functions make, the differences of the spline's coefficients being white.

    Parameters
    ----------
    functions : Functions
    integrated : int
        Number of times, as in :data:`INTEGRATED`.
    """
    basis = functions.at(functions.time)
    whole, count = basis.shape[1], functions.of_spline
    free = np.zeros((whole, integrated + whole - count))
    free[:count, :integrated] = np.polynomial.legendre.legvander(np.linspace(-1, 1, count), integrated - 1)
    free[count:, integrated:] = np.eye(whole - count)
    free /= np.linalg.norm(basis @ free, axis=0)
    q, r, vt = np.linalg.svd(basis @ free, full_matrices=False)
    apart = r > TWINS * r[0]  # jumps at neighbouring samples are alike
    q, free = q[:, apart], free @ (vt[apart].T / r[apart])
    sums = np.eye(whole, count - integrated, -integrated)
    for _ in range(integrated):
        sums[:count] = np.cumsum(sums[:count], axis=0)  # without rounding: their differences of that order are white
    for _ in range(2):  # what rounding left the first time
        sums -= free @ (q.T @ (basis @ sums))
    u, s, vt = np.linalg.svd(basis @ sums, full_matrices=False)
    seen = s > SEEN * s[0]
    u, s, vt = u[:, seen], s[seen], vt[seen]
    weight = np.concatenate([np.full(free.shape[1], np.inf), s**2])
    coefficients = np.concatenate([free, sums @ (vt.T / s)], 1)
    return Shapes(coefficients, np.concatenate([q, u], 1), weight, free.shape[1])


def likelihoods(functions: Functions, recorded: Array, least: float | None) -> list[Likelihood]:
    """Of a record, for each number of times that the noise may have been integrated.

    Parameters
    ----------
    functions : Functions
    recorded : ndarray, shape (T,)
        rad.
    least : float or None
        Sd of its noise, at least, rad.
    """
    return [Likelihood(recorded, shapes_of(functions, integrated), least) for integrated in INTEGRATED]


def most_likely(tried: list[Likelihood]) -> Likelihood:
    """That with the highest evidence.

    Parameters
    ----------
    tried : list of Likelihood
    """
    return max(tried, key=lambda one: one.likely.evidence)
