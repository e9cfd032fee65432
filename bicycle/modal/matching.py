"""Which root of one node is which of the next, told by where they are heading and by their vectors."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tyre.base.arrays import Array, Complex

CLEAR = 0.2  # a match is clear when its error is below this share of the distance to any rival
TWIN = 1e-7  # roots closer than this share of the largest cannot be told apart, and need not be
MAC_ENOUGH = 0.5


@dataclass
class Roots:
    """Eigenvalues and their slopes (m, n) at ``v`` (m,)."""

    v: Array
    values: Complex
    slopes: Complex

    def take(self, index: NDArray[np.intp]) -> Self:
        """Those at ``index`` (k,)."""
        return type(self)(*(part[index] for part in vars(self).values()))

    def and_(self, others: Self) -> Self:
        """These and the ``others``, one after the other."""
        return type(self)(*map(np.concatenate, zip(vars(self).values(), vars(others).values(), strict=True)))


@dataclass
class Nodes(Roots):
    """Roots with right (columns) and left (rows) eigenvectors (m, n, n)."""

    right: Complex
    left: Complex

    def joined(self, new: "Nodes") -> tuple["Nodes", NDArray[np.intp]]:
        """These and the ``new`` nodes in order of ``v``, and the places of the old ones among them."""
        order = np.argsort(np.concatenate([self.v, new.v]), kind="stable")
        places = np.empty_like(order)
        places[order] = np.arange(len(order))
        return self.and_(new).take(order), places[: len(self.v)]


def link(a: Nodes, b: Nodes) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Match the nodes ``a`` and their neighbours ``b``, k each: which root follows which, and where it is beyond doubt.

    Returns the match (k, n) and whether it is good (k,).
    """
    match, good, alone = link_roots(a, b)
    row, own = np.arange(len(match))[:, None], np.arange(match.shape[1])
    mac = np.abs(a.left @ b.right)[row, own, match] * np.abs(b.left @ a.right)[row, match, own]
    return match, good & ((mac > MAC_ENOUGH) | ~alone).all(1)


def link_roots(a: Roots, b: Roots) -> tuple[NDArray[np.intp], NDArray[np.bool_], NDArray[np.bool_]]:
    """The same by where the roots are heading alone, of ``a`` and their neighbours ``b``.

    Returns the match (k, n), whether it is good (k,), and which roots have no twin (k, n).
    """
    half = (b.v - a.v)[:, None] / 2
    cost = np.abs((a.values + half * a.slopes)[:, :, None] - (b.values - half * b.slopes)[:, None, :])
    size = np.maximum(np.abs(a.values).max(1), np.abs(b.values).max(1))[:, None]
    cost = np.fmin(cost, 1e3 * size[:, :, None])
    kind_a, kind_b = np.sign(a.values.imag), np.sign(b.values.imag)
    allowed = kind_a[:, :, None] == kind_b[:, None, :]
    match = assign(np.where(allowed, cost, 1e6 * size[:, :, None] + cost))
    row, own = np.arange(len(match))[:, None], np.arange(match.shape[1])
    landed = b.values[row, match]
    twin = np.abs(landed[:, :, None] - b.values[:, None, :]) <= TWIN * size[:, :, None]
    rival = np.where(twin, np.inf, cost).min(2)
    good = (cost[row, own, match] < CLEAR * rival).all(1) & allowed[row, own, match].all(1)
    order = np.argsort(np.where(kind_a == 0, a.values.real, np.inf), axis=1)
    real = np.where(kind_a[row, order] == 0, landed.real[row, order], np.inf)
    with np.errstate(invalid="ignore"):  # inf - inf beyond the last real root
        good &= ~(np.diff(real) < -TWIN * size).any(1)
    return match, good, twin.sum(2) == 1


def set_cost(a: Complex, b: Complex) -> Array:
    """Squared distance of roots ``a`` and ``b``, shape (k, n) each, in 1/s^2, shape (k, n, n).

    A light hand leads the larger of two real roots to the upper half of a pair.
    """
    rank_a, rank_b = a.real + a.imag, b.real + b.imag
    return np.abs(a[:, :, None] - b[:, None, :]) ** 2 + 1e-3 * (rank_a[:, :, None] - rank_b[:, None, :]) ** 2


def assign(cost: Array) -> NDArray[np.intp]:
    """Cheapest one-to-one match, ``cost`` of shape (k, n, n) -> column of each row (k, n)."""
    match = cost.argmin(2)
    for row in np.flatnonzero((np.sort(match) != np.arange(match.shape[1])).any(1)):
        match[row] = linear_sum_assignment(cost[row])[1]
    return match
