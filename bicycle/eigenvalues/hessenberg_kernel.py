"""What comes before QR: many small real matrices, side by side, balanced and brought to Hessenberg form. Needs numba.

The steps are those of LAPACK's ``dgebal`` and ``dgehrd`` (Golub & Van Loan, Matrix Computations, 4th ed., 7.4). What
these functions compile to is kept with :mod:`bicycle.eigenvalues.qr_kernel`, and numba looks at that file only: who
changes something here removes the ``__pycache__`` of this folder.
"""

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from tyre.base.arrays import Array

LANES = 64
ONE_BITS = 1023  # exponent of 1.0

compiled: Callable[[Any], Any] = numba.njit(cache=True, nogil=True, error_model="numpy")

Places = NDArray[np.int64]


@compiled
def isolate(a: Array, order: Places) -> None:
    """Order rows and columns so that roots that stand alone on the diagonal come first or last (block triangular).

    ``a`` has shape (n, n); ``order`` (n,) is filled with the numbers of its rows.
    """
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


@compiled
def normalise(h: Array, n: int, unit: Array) -> None:
    """Divide by a power of two near the largest entry.

    The first ``n`` rows and columns of ``h``, shape (n + 1, n + 1, LANES), are changed in place; ``unit``, shape
    (LANES,), is filled with the divisors.
    """
    for k in range(LANES):
        unit[k] = 0.0
    for i in range(n):
        for j in range(n):
            for k in range(LANES):
                unit[k] = max(unit[k], abs(h[i, j, k]))
    bits = unit.view(np.int64)
    for k in range(LANES):
        exponent = min(max(bits[k] >> 52, 30), 2016)
        bits[k] = exponent << 52
    for i in range(n):
        for j in range(n):
            for k in range(LANES):
                h[i, j, k] /= unit[k]


@compiled
def balance(h: Array, n: int, lane: Array) -> None:
    """Scale by powers of two until rows and columns have like norms.

    The first ``n`` rows and columns (a number) of ``h``, shape (n + 1, n + 1, LANES), are changed in place; ``lane``,
    shape (8, LANES), is room to work in.
    """
    row, column, factor = lane[0], lane[1], lane[2]
    bits = factor.view(np.int64)
    for _ in range(100):
        busy = False
        for i in range(n):
            for k in range(LANES):
                row[k] = column[k] = 0.0
            for j in range(n):
                if j != i:
                    for k in range(LANES):
                        row[k] += abs(h[i, j, k])
                        column[k] += abs(h[j, i, k])
            change = False
            for k in range(LANES):
                usable = row[k] > 1e-280 and column[k] > 1e-280
                factor[k] = row[k] / column[k] if usable else 1.0
            for k in range(LANES):
                bits[k] = (((bits[k] >> 52) - ONE_BITS >> 1) + ONE_BITS) << 52  # half the exponent of the ratio
            for k in range(LANES):
                better = column[k] * factor[k] + row[k] / factor[k] < 0.95 * (column[k] + row[k])
                factor[k] = factor[k] if better else 1.0
                change = change or better
            if change:
                busy = True
                for j in range(n):
                    for k in range(LANES):
                        h[i, j, k] /= factor[k]
                for j in range(n):
                    for k in range(LANES):
                        h[j, i, k] *= factor[k]
        if not busy:
            return


@compiled
def reduce(h: Array, n: int, v: Array, lane: Array) -> None:
    """Reduce to upper Hessenberg form by Householder reflections 1 - tau v v'.

    ``h``, shape (n + 1, n + 1, LANES), is changed in place, ``n`` is the number of its rows that hold the matrices;
    ``v``, shape (n, LANES), and ``lane``, shape (8, LANES), are room to work in.
    """
    below, tau, total = lane[0], lane[1], lane[2]
    for c in range(n - 2):
        top = c + 1
        for k in range(LANES):
            below[k] = 0.0
        for i in range(top + 1, n):
            for k in range(LANES):
                below[k] += h[i, c, k] * h[i, c, k]
        for k in range(LANES):
            x = h[top, c, k]
            some = below[k] > 0.0
            beta = -math.copysign(math.sqrt(x * x + below[k]), x)
            tau[k] = (beta - x) / beta if some else 0.0
            below[k] = 1.0 / (x - beta) if some else 0.0
            h[top, c, k] = beta if some else x
        for i in range(top + 1, n):
            for k in range(LANES):
                v[i, k] = h[i, c, k] * below[k]
                h[i, c, k] = 0.0
        for j in range(top, n):
            for k in range(LANES):
                total[k] = h[top, j, k]
            for i in range(top + 1, n):
                for k in range(LANES):
                    total[k] += v[i, k] * h[i, j, k]
            for k in range(LANES):
                total[k] *= tau[k]
                h[top, j, k] -= total[k]
            for i in range(top + 1, n):
                for k in range(LANES):
                    h[i, j, k] -= total[k] * v[i, k]
        for i in range(n):
            for k in range(LANES):
                total[k] = h[i, top, k]
            for j in range(top + 1, n):
                for k in range(LANES):
                    total[k] += h[i, j, k] * v[j, k]
            for k in range(LANES):
                total[k] *= tau[k]
                h[i, top, k] -= total[k]
            for j in range(top + 1, n):
                for k in range(LANES):
                    h[i, j, k] -= total[k] * v[j, k]
