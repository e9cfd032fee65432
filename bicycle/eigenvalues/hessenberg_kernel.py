"""Hessenberg form of many small real matrices, compiled: 64 matrices go side by side.

Needs numba (extra ``fast``). One matrix alone waits on every square root and division; 64 in step fill the vector
unit. The steps are those of LAPACK's ``dgebal`` and ``dgehrd`` (Golub & Van Loan, Matrix Computations, 4th ed., 7.4
and 7.5), so is the backward error: a few eps times the norm.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled_within
from tyre.base.arrays import Array

LANES, FEWEST = 64, 8  # as many side by side, or fewer by this step where fewer are left
ONE_BITS = 1023  # exponent of 1.0
NOTHING = 1e-140  # of the norm: its square is still a number

Places = NDArray[np.int64]


class Similarity(NamedTuple):
    """How matrices A and their Hessenberg forms H hang together: H = Q' D^-1 (P' A P) D Q / unit.

    ``order`` (n, lanes) is the permutation P, ``scale`` (n, lanes) the diagonal of D; Q is the product of the
    reflections 1 - tau v v' with ``v`` (n, n, lanes), one a row, and ``tau`` (n, lanes).
    """

    unit: Array
    order: Places
    scale: Array
    v: Array
    tau: Array


@compiled_within
def room_for(n: int, count: int) -> tuple[int, Array, Similarity]:
    """Number of lanes, and empty arrays for the Hessenberg forms of ``count`` matrices (n, n) and their similarity.

    Parameters
    ----------
    n, count : int
        Number of rows, and of matrices.
    """
    lanes = min(LANES, -(-count // FEWEST) * FEWEST)
    h = np.zeros((n + 1, n + 1, lanes))  # a reflection may reach over the edge by one
    order = np.zeros((n, lanes), np.int64)
    by = Similarity(np.empty(lanes), order, np.empty((n, lanes)), np.empty((n, n, lanes)), np.empty((n, lanes)))
    return lanes, h, by


@compiled_within
def hessenberg(stack: Array, start: int, count: int, h: Array, by: Similarity) -> None:
    """Balance matrices and reduce them to upper Hessenberg form, one a lane.

    Parameters
    ----------
    stack : ndarray, shape (m, n, n)
        In any unit.
    start, count : int
        Index of the first matrix and number of matrices; lanes beyond them repeat the last.
    h : ndarray, shape (n + 1, n + 1, lanes)
        Gets the matrices; the last row and column are free for what follows.
    by : Similarity
        Gets what leads back, ``unit`` is a power of two.
    """
    n, lanes = stack.shape[1], h.shape[2]
    lane, order = np.empty((8, lanes)), np.empty(n, np.int64)
    for k in range(lanes):
        source = start + min(k, count - 1)
        _isolate(stack[source], order)
        for i in range(n):
            by.order[i, k] = order[i]
            for j in range(n):
                h[i, j, k] = stack[source, order[i], order[j]]
    _normalise(h, n, by.unit)
    _balance(h, n, by.scale, lane)
    _reduce(h, n, by.v, by.tau, lane)


@compiled_within
def _isolate(a: Array, order: Places) -> None:
    """Order rows and columns so that roots that stand alone on the diagonal come first or last (block triangular)."""
    n = a.shape[0]
    for i in range(n):
        order[i] = i
    first, last = 0, n
    busy = True
    while busy:
        busy = False
        for i in range(first, last):
            row = column = True
            for j in range(first, last):
                if j != i:
                    row = row and a[order[i], order[j]] == 0.0
                    column = column and a[order[j], order[i]] == 0.0
                    if not (row or column):
                        break
            if row:
                last -= 1
                order[i], order[last] = order[last], order[i]
            elif column:
                order[i], order[first] = order[first], order[i]
                first += 1
            if row or column:
                busy = True
                break


@compiled_within
def _normalise(h: Array, n: int, unit: Array) -> None:
    """Divide by a power of two near the largest entry, kept in ``unit``."""
    lanes = h.shape[2]
    for k in range(lanes):
        unit[k] = 0.0
    for i in range(n):
        for j in range(n):
            for k in range(lanes):
                unit[k] = max(unit[k], abs(h[i, j, k]))
    bits = unit.view(np.int64)
    for k in range(lanes):
        exponent = min(max(bits[k] >> 52, 30), 2016)
        bits[k] = exponent << 52
    for i in range(n):
        for j in range(n):
            for k in range(lanes):
                h[i, j, k] /= unit[k]


@compiled_within
def _balance(h: Array, n: int, scale: Array, lane: Array) -> None:
    """Scale by powers of two, kept in ``scale``, until rows and columns have like norms."""
    row, column, factor = lane[0], lane[1], lane[2]
    lanes = h.shape[2]
    scale[:] = 1.0
    bits = factor.view(np.int64)
    for _ in range(100):
        busy = False
        for i in range(n):
            for k in range(lanes):
                row[k] = column[k] = 0.0
            for j in range(n):
                if j != i:
                    for k in range(lanes):
                        row[k] += abs(h[i, j, k])
                        column[k] += abs(h[j, i, k])
            change = False
            for k in range(lanes):
                usable = row[k] > 1e-280 and column[k] > 1e-280
                factor[k] = row[k] / column[k] if usable else 1.0
            for k in range(lanes):
                bits[k] = (((bits[k] >> 52) - ONE_BITS >> 1) + ONE_BITS) << 52  # half the exponent of the ratio
            for k in range(lanes):
                better = column[k] * factor[k] + row[k] / factor[k] < 0.95 * (column[k] + row[k])
                factor[k] = factor[k] if better else 1.0
                change = change or better
            if change:
                busy = True
                for k in range(lanes):
                    scale[i, k] *= factor[k]
                for j in range(n):
                    for k in range(lanes):
                        h[i, j, k] /= factor[k]
                for j in range(n):
                    for k in range(lanes):
                        h[j, i, k] *= factor[k]
        if not busy:
            return


@compiled_within
def _reduce(h: Array, n: int, reflection: Array, factor: Array, lane: Array) -> None:
    """Reduce to upper Hessenberg form by Householder reflections 1 - tau v v', kept with v[top] = 1 left out."""
    below, total = lane[0], lane[2]
    lanes = h.shape[2]
    for c in range(n - 2):
        top = c + 1
        v, tau = reflection[c], factor[c]
        for k in range(lanes):
            below[k] = 0.0
        for i in range(top + 1, n):
            for k in range(lanes):
                below[k] += h[i, c, k] * h[i, c, k]
        for k in range(lanes):
            x = h[top, c, k]
            some = below[k] > NOTHING * NOTHING  # squares of less have lost their digits
            beta = -math.copysign(math.sqrt(x * x + below[k]), x)
            tau[k] = (beta - x) / beta if some else 0.0
            below[k] = 1.0 / (x - beta) if some else 0.0
            h[top, c, k] = beta if some else x
        for i in range(top + 1, n):
            for k in range(lanes):
                v[i, k] = h[i, c, k] * below[k]
                h[i, c, k] = 0.0
        for j in range(top, n):
            for k in range(lanes):
                total[k] = h[top, j, k]
            for i in range(top + 1, n):
                for k in range(lanes):
                    total[k] += v[i, k] * h[i, j, k]
            for k in range(lanes):
                total[k] *= tau[k]
                h[top, j, k] -= total[k]
            for i in range(top + 1, n):
                for k in range(lanes):
                    h[i, j, k] -= total[k] * v[i, k]
        for i in range(n):
            for k in range(lanes):
                total[k] = h[i, top, k]
            for j in range(top + 1, n):
                for k in range(lanes):
                    total[k] += h[i, j, k] * v[j, k]
            for k in range(lanes):
                total[k] *= tau[k]
                h[i, top, k] -= total[k]
            for j in range(top + 1, n):
                for k in range(lanes):
                    h[i, j, k] -= total[k] * v[j, k]
