"""Tyre properties at several conditions together: their covariance and the degrees of freedom behind it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.maps.prediction import Prediction
from tyre.maps.stiffness_covariance import StiffnessCovariance
from tyre.properties import TyreProperties

QUANTITIES = ("cornering_stiffness", "lateral_stiffness", "relaxation_length")
"""In the order of every covariance of tyre properties."""


class JointCovariance(NamedTuple):
    """Of (C_Fy, K_y, relaxation length) of the first condition, then of the second, and so on; SI units.

    Attributes
    ----------
    covariance : ndarray, shape (3 n, 3 n)
    variance_spread : tuple of ndarray, shape (3 n, 3 n) each, or None
        Parts Q of the covariance that were estimated each by itself, over the root of their degrees of freedom: the
        variance g' S g of a result with gradient g has (g' S g)^2 / sum (g' Q g)^2 degrees of freedom. None where
        nobody states any.
    """

    covariance: Array
    variance_spread: tuple[Array, ...] | None

    def degrees_of_freedom(self, gradient: ArrayLike) -> float:
        """Effective degrees of freedom of a result (Welch-Satterthwaite; JCGM 100:2008, eq. G.2b), at least 1.

        Parameters
        ----------
        gradient : array_like, shape (3 n,)
            Of the result with respect to the quantities, SI units.
        """
        return effective_degrees_of_freedom(gradient, self.covariance, self.variance_spread or ())

    def of(self, row: int) -> tuple[Array, Array | None]:
        """Covariance (3, 3) and degrees of freedom (3,), or None where nobody states any, of one condition.

        Parameters
        ----------
        row : int
            Number of the condition, from 0.
        """
        place = slice(3 * row, 3 * row + 3)
        mine = self.covariance[place, place].copy()
        if self.variance_spread is None:
            return mine, None
        return mine, np.array([self.degrees_of_freedom(g) for g in np.eye(len(self.covariance))[place]])


@dataclass(frozen=True, eq=False)
class JointProperties:
    """Properties at n conditions with their joint covariance.

    Attributes
    ----------
    properties : tuple of TyreProperties
        In the order asked for.
    joint : JointCovariance
    trail_covariance : ndarray, shape (n, n)
        Of the pneumatic trails, m^2; NaN in rows and columns where none is known.
    """

    properties: tuple[TyreProperties, ...]
    joint: JointCovariance
    trail_covariance: Array

    @property
    def covariance(self) -> Array:
        """Of (C_Fy, K_y, relaxation length) of each, SI units, shape (3 n, 3 n)."""
        return self.joint.covariance


def effective_degrees_of_freedom(gradient: ArrayLike, covariance: Array, variance_spread: Sequence[Array]) -> float:
    """Welch-Satterthwaite degrees of freedom of a result.

    Parameters
    ----------
    gradient : array_like, shape (p,)
    covariance : ndarray, shape (p, p)
    variance_spread : sequence of ndarray, shape (p, p) each
        As in :class:`JointCovariance`.

    Returns
    -------
    float
        At least 1; infinite where nothing was estimated.
    """
    g = np.asarray(gradient, float)
    spent = sum(float(g @ part @ g) ** 2 for part in variance_spread)
    return max(1.0, float(g @ covariance @ g) ** 2 / spent) if spent > 0.0 else np.inf


def joint_covariance(
    cornering: Prediction,
    lateral: Prediction,
    measured: StiffnessCovariance,
    dof: tuple[Array, Array] | None,
) -> JointCovariance:
    """Covariance of both stiffnesses and their ratio at n conditions.

    The relaxation length enters to first order, d(C/K) = (C/K) (dC/C - dK/K). Repeatability is pooled over a campaign,
    so the scatters of its conditions are known equally badly: their degrees of freedom do not add up.

    Parameters
    ----------
    cornering, lateral : Prediction
        N/rad and N/m at n conditions.
    measured : StiffnessCovariance
        At the N measured conditions.
    dof : (ndarray, ndarray) or None
        Degrees of freedom of the measured C and K, shape (N,) each.
    """
    n = cornering.value.size
    length = cornering.value / lateral.value
    to_properties = np.zeros((3 * n, 2 * n))  # from (C of all, K of all) to (C, K, length) of each
    to_properties[0::3, :n] = np.eye(n)
    to_properties[1::3, n:] = np.eye(n)
    to_properties[2::3, :n] = np.diag(length / cornering.value)
    to_properties[2::3, n:] = np.diag(-length / lateral.value)
    stiffness = np.zeros((2 * n, 2 * n))
    stiffness[:n, :n] = cornering.carry @ measured.cornering @ cornering.carry.T + cornering.error
    stiffness[n:, n:] = lateral.carry @ measured.lateral @ lateral.carry.T + lateral.error
    stiffness[:n, n:] = cornering.carry @ measured.cornering_lateral @ lateral.carry.T
    stiffness[n:, :n] = stiffness[:n, n:].T
    covariance = to_properties @ stiffness @ to_properties.T
    covariance = (covariance + covariance.T) / 2
    if dof is None:
        return JointCovariance(covariance, None)
    spread = []
    for half, prediction, total, own, freedom in (
        (to_properties[:, :n], cornering, measured.cornering, measured.own_cornering, dof[0]),
        (to_properties[:, n:], lateral, measured.lateral, measured.own_lateral, dof[1]),
    ):
        # a stated number of degrees of freedom is that of the whole standard deviation: own^4/dof_own = sd^4/dof
        known = np.diag(own) > 0
        ratio = np.divide(np.diag(total), np.diag(own), out=np.zeros(own.shape[0]), where=known)
        root = np.sqrt(ratio) / freedom**0.25
        scatter = prediction.carry @ (own * np.outer(root, root)) @ prediction.carry.T
        spread += [half @ scatter @ half.T]
        if prediction.error_dof > 0:
            spread += [half @ prediction.error @ half.T / np.sqrt(prediction.error_dof)]
    return JointCovariance(covariance, tuple(spread))


def side_by_side(parts: Sequence[JointProperties]) -> JointProperties:
    """Properties of different tyres together: their errors have nothing in common.

    Parameters
    ----------
    parts : sequence of JointProperties
        Of one tyre each.
    """
    spreads = [part.joint.variance_spread for part in parts]
    blocks = [np.shape(part.covariance)[0] for part in parts]
    starts = np.cumsum([0, *blocks])
    spread = tuple(
        _placed(matrix, int(start), int(starts[-1]))
        for start, matrices in zip(starts, spreads, strict=False)
        for matrix in matrices or ()
    )
    every = sum(_placed(part.covariance, int(at), int(starts[-1])) for at, part in zip(starts, parts, strict=False))
    trails = [part.trail_covariance for part in parts]
    at_trails = np.cumsum([0, *(len(trail) for trail in trails)])
    trail = sum(_placed(one, int(at), int(at_trails[-1])) for at, one in zip(at_trails, trails, strict=False))
    stated = None if all(matrices is None for matrices in spreads) else spread
    properties = tuple(one for part in parts for one in part.properties)
    return JointProperties(properties, JointCovariance(np.asarray(every), stated), np.asarray(trail))


def _placed(matrix: Array, start: int, size: int) -> Array:
    whole = np.zeros((size, size))
    whole[start : start + len(matrix), start : start + len(matrix)] = matrix
    return whole
