"""Tracks of many bicycles as arrays, and their state matrices at nodes, compiled. Needs numba (extra ``fast``)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.modal.tracking import STEP
from tyre.base.arrays import Array

Small = NDArray[np.int16]

OPEN, SMOOTH, MEETING = 0, 1, 2


class Track(NamedTuple):
    """Nodes of B bicycles, at most M each with n roots, in the order they were computed; ``order`` sorts them by speed.

    ``kind`` and ``match`` tell of the step from a node to the next: which root follows which; in a MEETING the roots
    ``two`` of the node (first two) and of the next (last two) turn from real to a pair or back.
    """

    v: Array  # (B, M), m/s
    re: Array  # (B, M, n), 1/s
    im: Array
    dre: Array  # (B, M, n), slopes, 1/m
    dim: Array
    share: Array  # (B, M, n, n), of each state in each root
    filled: Small  # (B,), how many nodes there are
    order: Small  # (B, M)
    kind: Small  # (B, M)
    match: Small  # (B, M, n)
    two: Small  # (B, M, 4)
    status: Small  # (B,)
    grid: Small  # (B,), how many of the first nodes are those of the sparse grid
    plain: Small  # (B, M), 1 where the step to the next node of the full grid was linked as a whole
    until: Small  # (B, M), not 0: a step that the full track may take as a whole, divided here, leads to this node
    whole: Small  # (B, M, n), and to these of its roots


def empty_track(bicycles: int, nodes: int, n: int) -> Track:
    """Room for so many bicycles, nodes of each, and roots.

    Parameters
    ----------
    bicycles, nodes, n : int
        Number of each.
    """
    table = (bicycles, nodes)
    return Track(
        np.zeros(table), np.zeros((*table, n)), np.zeros((*table, n)), np.zeros((*table, n)), np.zeros((*table, n)),
        np.zeros((*table, n, n)),
        np.zeros(bicycles, np.int16), np.zeros(table, np.int16), np.zeros(table, np.int16),
        np.zeros((*table, n), np.int16), np.zeros((*table, 4), np.int16), np.zeros(bicycles, np.int16),
        np.zeros(bicycles, np.int16), np.zeros(table, np.int16), np.zeros(table, np.int16),
        np.zeros((*table, n), np.int16),
    )  # fmt: skip


class Decomposed(NamedTuple):
    """Roots (k, n), their slopes (2, k, n), shares of states (k, n, n) and doubt (k, n) at k nodes."""

    re: Array
    im: Array
    slopes: Array
    share: Array
    doubt: Array

    def part(self, nodes: slice) -> "Decomposed":
        """Some of the ``nodes``, in arrays as kernels take them."""
        re, im, slopes, share, doubt = self
        return Decomposed(
            re[nodes], im[nodes], np.ascontiguousarray(slopes[:, nodes]), share[nodes], doubt[nodes]
        )  # fmt: skip


@compiled
def assemble(
    coefficients: Array, powers: Array, owner: NDArray[np.int64], v: Array, stack: Array, change: Array
) -> None:
    """Fill in A(v) and dA/dv of bicycles ``owner`` (k,) at speeds ``v`` (k,).

    Parameters
    ----------
    coefficients : ndarray, shape (p, B, n, n)
        Of the powers of the speed.
    powers : ndarray, shape (p,)
        These powers.
    owner, v : ndarray, shape (k,)
        Index of the bicycle, and m/s.
    stack, change : ndarray, shape (k, n, n)
        Get A in 1/s, and dA/dv in 1/m.
    """
    n = stack.shape[1]
    for k in range(len(v)):
        for i in range(n):
            for j in range(n):
                stack[k, i, j] = change[k, i, j] = 0.0
        for p in range(len(powers)):
            power = powers[p]
            one = v[k] ** power
            slope = power * v[k] ** (power - 1) if power != 0.0 else 0.0
            a = coefficients[p, owner[k]]
            for i in range(n):
                for j in range(n):
                    stack[k, i, j] += one * a[i, j]
                    change[k, i, j] += slope * a[i, j]


@compiled_within
def mate_of(re: Array, im: Array, i: int) -> int:
    """The other half of a pair (roots (n,)), the root itself where it is real.

    Parameters
    ----------
    re, im : ndarray, shape (n,)
        1/s.
    i : int
        Index of the root.
    """
    if im[i] != 0.0:
        for j in range(len(re)):
            if re[j] == re[i] and im[j] == -im[i]:
                return j
    return i


@compiled_within
def on_grid(t: Track, unit: Array, b: int, slot: int) -> bool:
    """Whether the full track has this node whatever the roots do.

    Parameters
    ----------
    t : Track
    unit : ndarray, shape (B,)
        m/s.
    b, slot : int
        Indices of the bicycle and the node.
    """
    steps = t.v[b, slot] / (unit[b] * STEP)
    return bool(slot < t.grid[b] or abs(steps - round(steps)) < 1e-9)
