"""Functions that a steer angle is made of: a spline, what dies away after the start, and jumps of the acceleration."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from tyre.base.arrays import Array

DEGREE = 5  # the second derivative is a cubic spline
DYING = np.array([0.03, 0.1])  # s, time constants of what dies away after a start


class Functions(NamedTuple):
    """What a steer angle is made of, with C coefficients: those of a spline, then of what is added to it.

    Attributes
    ----------
    time : ndarray, shape (T,)
        Of the samples, s.
    spans : int
        Polynomials of the spline.
    jumps : tuple of float
        Times at which the acceleration jumps, s.
    """

    time: Array
    spans: int
    jumps: tuple[float, ...] = ()

    @property
    def of_spline(self) -> int:
        """Coefficients of the spline."""
        return self.spans + DEGREE

    def at(self, time: Array, derivative: int = 0) -> Array:
        """All functions or derivatives of them, shape (n, C).

        Parameters
        ----------
        time : ndarray, shape (n,)
            s.
        derivative : int, optional
            0 to 3.
        """
        first, last = self.time[0], self.time[-1]
        knots = first + (last - first) / self.spans * np.arange(-DEGREE, self.spans + DEGREE + 1)
        splines = BSpline(knots, np.eye(self.of_spline), DEGREE)(time, nu=derivative)
        dying = np.exp(-(time - first)[:, None] / DYING) * (-1 / DYING) ** derivative
        return np.concatenate([splines, dying, jumping(time, self.jumps, derivative)], 1)


def jumping(time: Array, jumps: Sequence[float] | Array, derivative: int = 0) -> Array:
    """Angles whose acceleration jumps from 0 to 1 and then stays or dies away, or whose rate jumps.

    The rate does where the acceleration jumped a little earlier or later.

    Parameters
    ----------
    time : ndarray, shape (n,)
        s.
    jumps : sequence of float, shape (J,)
        When, s.
    derivative : int, optional
        0 to 3.

    Returns
    -------
    ndarray, shape (n, 4 J)
        Four of each jump.
    """
    after = np.maximum(time[:, None] - np.asarray(jumps, float), 0.0)[..., None]
    begun, lost = (after > 0).astype(float), np.exp(-after / DYING)
    stays = (after**2 / 2, after, begun, 0 * after)[derivative]
    dies = (DYING * (after - DYING * (1 - lost)), DYING * (1 - lost), begun * lost, -begun * lost / DYING)
    sooner = (after, begun, 0 * after, 0 * after)[derivative]
    return np.concatenate([stays, sooner, dies[derivative]], -1).reshape(len(time), -1)
