"""Tyre properties at several conditions together: their covariance and the degrees of freedom behind it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.estimate import Estimate
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


class JointLengths(NamedTuple):
    """A length measured beside the stiffnesses, at n conditions.

    Attributes
    ----------
    estimates : tuple of Estimate or None
        m; None where the table says nothing of it.
    covariance : ndarray, shape (n, n)
        m^2; NaN in rows and columns of those.
    variance_spread : tuple of ndarray, shape (n, n) each
        As in :class:`JointCovariance`.
    """

    estimates: tuple[Estimate | None, ...]
    covariance: Array
    variance_spread: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class JointProperties:
    """Properties at n conditions with their joint covariance.

    Attributes
    ----------
    properties : tuple of TyreProperties
        In the order asked for.
    joint : JointCovariance
    trails : JointLengths or None
        Pneumatic trails; None where a tyre of them has none.
    """

    properties: tuple[TyreProperties, ...]
    joint: JointCovariance
    trails: JointLengths | None = None

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


def side_by_side(parts: Sequence[JointProperties]) -> JointProperties:
    """Properties of different tyres together: their errors have nothing in common.

    Parameters
    ----------
    parts : sequence of JointProperties
        Of one tyre each.
    """
    spreads = [part.joint.variance_spread for part in parts]
    joint = JointCovariance(
        _diagonal([part.covariance for part in parts]),
        None if all(spread is None for spread in spreads) else _spread([spread or () for spread in spreads], parts, 3),
    )
    trails = [part.trails for part in parts if part.trails is not None]
    together = None
    if len(trails) == len(parts):
        estimates = tuple(estimate for trail in trails for estimate in trail.estimates)
        covariance = _diagonal([trail.covariance for trail in trails])
        together = JointLengths(estimates, covariance, _spread([t.variance_spread for t in trails], parts, 1))
    return JointProperties(tuple(one for part in parts for one in part.properties), joint, together)


def _diagonal(blocks: Sequence[Array]) -> Array:
    """The blocks along the diagonal of a matrix."""
    size = sum(len(block) for block in blocks)
    whole, start = np.zeros((size, size)), 0
    for block in blocks:
        whole[start : start + len(block), start : start + len(block)] = block
        start += len(block)
    return whole


def _spread(spreads: Sequence[Sequence[Array]], parts: Sequence[JointProperties], width: int) -> tuple[Array, ...]:
    """Every matrix of each part (``width`` rows a condition) at its place among zeros."""
    nothing = [np.zeros((width * len(part.properties),) * 2) for part in parts]
    return tuple(
        _diagonal([*nothing[:at], matrix, *nothing[at + 1 :]])
        for at, matrices in enumerate(spreads)
        for matrix in matrices
    )
