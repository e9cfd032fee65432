"""The demands at fixed speeds as smooth functions of the numbers that are varied, each following its root."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.decomposition import eigensystem, projected
from studies.design.worst_speeds import Peak
from studies.model_axes.model_space import ModelSpace
from tyre.base.arrays import Array, Complex

CLEAR = 0.4  # of the distance to the nearest rival: a root nearer to where it was expected is the one
DEEPEST = 7  # halvings of a step of the numbers


class Followed:
    """Roots at some speeds, followed from where they are known.

    Parameters
    ----------
    space : ModelSpace
    peaks : sequence of Peak
        k of them: demand, speed and root.
    x : ndarray, shape (d,)
        Where their roots are known, in the units of the numbers.
    """

    def __init__(self, space: ModelSpace, peaks: Sequence[Peak], x: Array) -> None:
        self.space, self.demands = space, [peak.demand for peak in peaks]
        self.speeds = np.array([peak.speed for peak in peaks])
        self.x = np.asarray(x, float).copy()
        self.roots, self.slopes, _ = self._look(self.x, np.array([peak.root for peak in peaks]))

    def _look(self, x: Array, expected: Complex) -> tuple[Complex, Complex, NDArray[np.bool_]]:
        """Roots (k,) nearest to what is expected, their derivatives (k, d), and which of them are clear."""
        matrices, slopes = self.space.matrices_and_slopes(self._points(x), self.speeds)
        values, right, left = eigensystem(matrices)
        own, clear = _nearest(values, expected)
        row = np.arange(len(values))
        change = np.stack([projected(left, slopes[:, i], right)[row, own] for i in range(len(x))], -1)
        return values[row, own], change, clear

    def _points(self, x: Array) -> Array:
        return np.broadcast_to(x, (len(self.speeds), len(x)))

    def to(self, x: Array) -> None:
        """Follow every root to other numbers ``x`` (d,), in their units, in smaller steps where one is not clear."""
        self._to(np.asarray(x, float), DEEPEST)

    def _to(self, x: Array, deepest: int) -> None:
        step = x - self.x
        if not step.any():
            return
        found = self._look(x, self.roots + self.slopes @ step)
        if found[2].all() or not deepest:
            self.x, self.roots, self.slopes = x.copy(), found[0], found[1]
            return
        self._to(self.x + step / 2, deepest - 1)
        self._to(x, deepest - 1)

    def _roots_at(self, x: Array) -> Complex:
        """Roots (k,) at numbers ``x`` (d,), without derivatives where all are clear of rivals."""
        values = np.linalg.eigvals(self.space.matrices(self._points(x), self.speeds)).astype(complex)
        own, clear = _nearest(values, self.roots + self.slopes @ (x - self.x))
        if clear.all():
            return np.asarray(values[np.arange(len(values)), own])
        self.to(x)
        return self.roots

    def excess(self, x: Array) -> Array:
        """By how much each demand is missed (k,), 1/s, at numbers ``x`` (d,) in their units."""
        roots = self._roots_at(np.asarray(x, float))
        return np.array([d.excess(root) for d, root in zip(self.demands, roots, strict=True)])

    def excess_slopes(self, x: Array) -> Array:
        """Derivatives (k, d) of :meth:`excess` at numbers ``x`` (d,) in their units."""
        self.to(x)
        rows = zip(self.demands, self.roots, self.slopes, strict=True)
        return np.array([d.slope(np.array([root]), change[None])[0] for d, root, change in rows])


def _nearest(values: Complex, expected: Complex) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Of the roots (k, n), which is nearest to what is expected (k,), and whether it is clear of rivals."""
    away, row = np.abs(values - expected[:, None]), np.arange(len(values))
    own = away.argmin(1)
    apart = np.abs(values - values[row, own][:, None])
    apart[row, own] = np.inf
    return own, away[row, own] <= CLEAR * apart.min(1)
