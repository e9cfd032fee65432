"""What the coordinates of a fit change of a bicycle: derivatives of its matrices, times given vectors.

The matrices are polynomials in the speed v, so dF/dtheta x = sum over k of v^k dF_k x + F'(v) x dv/dtheta: only the
coefficients are differenced, and no matrix is put together at any speed. They are smooth, so central differences do.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bicycle.descriptor import DescriptorPolynomial, DescriptorStack
from bicycle.speed_polynomial import SpeedPolynomial
from studies.missing_effect.motion.family import Family
from tyre.base.arrays import Array, Complex

Matrix = Literal["dynamics", "input", "output"]


@dataclass(frozen=True, eq=False)
class Slopes:
    """A bicycle at recorded ``speeds`` (k,), m/s, and what p coordinates change of it.

    Attributes
    ----------
    family : Family
        The model with its p unknowns.
    theta : ndarray, shape (p,)
        Coordinates.
    speeds : ndarray, shape (k,)
        m/s.
    wanted : bool
        Whether derivatives are: without them p is zero here.
    """

    family: Family
    theta: Array
    speeds: Array
    wanted: bool = True

    @cached_property
    def _stencil(self) -> tuple[Array, Array]:
        return self.family.stencil(self.theta) if self.wanted else (self.theta[None], self.theta[:0])

    @property
    def steps(self) -> Array:
        """Of the differences (p,)."""
        return self._stencil[1]

    @cached_property
    def values(self) -> dict[str, Array]:
        """Every parameter of the bicycle and of those about it, arrays (2 p + 1, 1)."""
        return self.family.values(self._stencil[0])

    @cached_property
    def true_speeds(self) -> Array:
        """Of the bicycle and of those about it (2 p + 1, k), m/s."""
        return self.family.true_speeds(self.values, self.speeds)

    @cached_property
    def _all(self) -> DescriptorPolynomial:
        return self.family.matrices(self.values, self.true_speeds)

    @cached_property
    def _first(self) -> DescriptorPolynomial:
        return self._all.take(slice(1))

    @cached_property
    def system(self) -> DescriptorStack:
        """Matrices of the bicycle itself, arrays (1, k, ...)."""
        return self._first(self.true_speeds[:1])

    def difference(self, part: Array) -> Array:
        """Derivatives (p, ...) of something known of all bicycles, ``part`` (2 p + 1, ...), in its unit."""
        h = 2 * self.steps.reshape(-1, *(1,) * (part.ndim - 1))
        return (part[1 : len(h) + 1] - part[len(h) + 1 :]) / h

    def applied(
        self, matrix: Matrix, at: NDArray[np.intp], x: Array | Complex, rows: list[int] | None = None
    ) -> Complex:
        """dP x of a ``matrix`` P of the system, in its units.

        Parameters
        ----------
        matrix : str
            Name of P.
        at : ndarray of int, shape (m,)
            Numbers of the speeds.
        x : ndarray of float or complex, shape (m, columns, q)
            In the units of what P is applied to.
        rows : list of int, optional
            The rows of P that are wanted; all without.

        Returns
        -------
        ndarray of complex, shape (m, p, rows, q)
        """
        polynomial: SpeedPolynomial = getattr(self._all, matrix)
        v, kept = self.true_speeds[0, at, None, None], slice(None) if rows is None else rows
        change = {power: self.difference(part)[..., kept, :] for power, part in polynomial.items()}
        found = _product([(part, v**power * x) for power, part in change.items()], at)
        if (moved := self.difference(self.true_speeds)).any():
            per_speed: SpeedPolynomial = getattr(self._first, matrix).derivative
            found += (per_speed(self.true_speeds[:1])[0, at][:, kept] @ x)[:, None] * moved.T[at, :, None, None]
        return found

    def force(self, at: NDArray[np.intp], x: Complex, s: Complex) -> Complex:
        """(dF - s dE) x, shape (m, p, n, q).

        Parameters
        ----------
        at : ndarray of int, shape (m,)
            Numbers of the speeds.
        x : ndarray of complex, shape (m, n, q)
            States.
        s : ndarray of complex, shape (m,)
            1/s.
        """
        inertia = self.difference(self._all.mass), -s[:, None, None] * x
        return self.applied("dynamics", at, x) + _product([inertia], at)


def _product(terms: list[tuple[Array, Array | Complex]], at: NDArray[np.intp]) -> Complex:
    """Sum (m, p, rows, q) of matrices (p, 1 or k, rows, columns), times vectors (m, columns, q)."""
    parts, vectors = zip(*terms, strict=True)
    left = np.moveaxis(np.concatenate(parts, -1), 0, 1)  # (1 or k, p, rows, all columns)
    right = np.ascontiguousarray(np.concatenate(vectors, 1), complex).view(float)  # real and imaginary by turns
    speeds, p, rows, columns = left.shape
    flat = left.reshape(speeds, p * rows, columns)
    found = (flat if speeds == 1 else flat[at]) @ right
    return found.view(complex).reshape(len(at), p, rows, -1)
