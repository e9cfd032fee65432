"""Weights and correlations over the grid of measured loads and pressures.

What a smooth trend leaves over is taken as a random field that is uncorrelated between neighbouring measured lines of
load or pressure and loses its correlation linearly over the interval between them, in both directions (a product of
triangular correlations). Its best linear prediction from the measured conditions is then exactly bilinear
interpolation inside a complete grid, goes to the bare trend one interval outside, and comes with an error variance:
(1 - sum of squared weights) misfit^2, zero at measured conditions.
"""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array


@dataclass(frozen=True, eq=False)
class ConditionsGrid:
    """The measured conditions as points of a grid; ``load`` N and ``pressure`` Pa, shape (N,) each."""

    load: Array
    pressure: Array

    def weights(self, load: Array, pressure: Array) -> Array:
        """Weight of every measured condition at the asked ones, shape (n, N); rows are bilinear inside the grid.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.
        """
        return self.correlation(load, pressure, self.load, self.pressure)

    def correlation(self, load: Array, pressure: Array, other_load: Array, other_pressure: Array) -> Array:
        """Correlation of the leftover field between two lists of conditions, shape (n, m).

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa of the first.
        other_load, other_pressure : ndarray, shape (m,)
            Of the second.
        """
        along_load = _triangular(np.unique(self.load), load, other_load)
        along_pressure = _triangular(np.unique(self.pressure), pressure, other_pressure)
        return along_load * along_pressure

    def prediction_error(self, load: Array, pressure: Array) -> Array:
        """Covariance of the prediction error over misfit^2 at the asked conditions, shape (n, n).

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.
        """
        weights = self.weights(load, pressure)
        return self.correlation(load, pressure, load, pressure) - weights @ weights.T


def _triangular(lines: Array, first: Array, second: Array) -> Array:
    distance = np.abs(_line_number(lines, first)[:, None] - _line_number(lines, second)[None, :])
    return np.maximum(0.0, 1.0 - distance)


def _line_number(lines: Array, value: Array) -> Array:
    """Position in units of measured lines, continued beyond the outer ones with the outer interval."""
    if lines.size == 1:
        return np.asarray(value / lines[0] - 1.0)
    number = np.interp(value, lines, np.arange(lines.size))
    below = np.minimum(value - lines[0], 0.0) / (lines[1] - lines[0])
    above = np.maximum(value - lines[-1], 0.0) / (lines[-1] - lines[-2])
    return np.asarray(number + below + above)
