"""Eigenvalues with their slopes and the shares of the states in them, compiled: 64 matrices go side by side.

Needs numba (extra ``fast``). Roots come from the QR of this room; right and left eigenvectors from one step of inverse
iteration on the Hessenberg form (Golub & Van Loan, Matrix Computations, 4th ed., 7.6.1), beginning with a right side
without structure. Where a vector does not grow as it must, the matrix is marked and not answered for.
"""

import math

import numpy as np

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.eigenvalues.hessenberg_kernel import LANES, Places, Similarity, hessenberg, room_for
from bicycle.eigenvalues.qr_kernel import EPS, roots_of
from tyre.base.arrays import Array

DIGITS = 30 * EPS  # what rounding may change in the last digits of a root (as of ``decomposition``)
DOUBTFUL = 1e-7  # a pair with an imaginary part below this share of the largest root may be a double real root
GROWTH = 1e-6  # of 1 / eps: an eigenvector grows at least by so much


@compiled
def decompose_stack(
    stack: Array, change: Array, real: Array, imag: Array, slopes: Array, shares: Array, doubt: Array
) -> int:
    """Fill in roots, d(root) for the ``change`` of the matrices, and the shares of states, of many matrices.

    Parameters
    ----------
    stack, change : ndarray, shape (m, n, n)
        A in 1/s, and dA in 1/s per unit of what changes.
    real, imag : ndarray, shape (m, n)
        Get the roots, sorted by real then imaginary part, 1/s. What rounding split of a double real root is real.
    slopes : ndarray, shape (2, m, n)
        Gets real and imaginary part of their derivatives.
    shares : ndarray, shape (m, n, n)
        Gets |left times right eigenvector| of each state (second axis) in each root (third), columns sum to 1.
    doubt : ndarray, shape (m, n)
        Gets what rounding may change in each root, 1/s; NaN where there is no eigenvector.

    Returns
    -------
    int
        Index of the first matrix without eigenvalues, or -1.
    """
    m, n = stack.shape[:2]
    for start in range(0, m, LANES):  # all in one call, which leaves the interpreter free
        count = min(LANES, m - start)
        if start == 0 or count < LANES:
            lanes, h, by = room_for(n, count)
            work, triangle = np.empty((12, max(n, 4), lanes)), np.empty((2, n, n, lanes))
        hessenberg(stack, start, count, h, by)
        keep = h.copy()
        failed = roots_of(h, by.unit, start, count, real, imag)
        if failed >= 0:
            return start + failed
        _vectors(keep, by, start, count, stack, change, real, imag, slopes, shares, doubt, triangle, work)
    return -1


@compiled_within
def _vectors(
    h: Array, by: Similarity, start: int, count: int, stack: Array, change: Array, real: Array, imag: Array,
    slopes: Array, shares: Array, doubt: Array, triangle: Array, work: Array,
) -> None:  # fmt: skip
    """Eigenvectors of up to LANES matrices, root by root, and what follows from them."""
    n, lanes = h.shape[0] - 1, h.shape[2]
    z = np.empty((2, lanes))
    root, norm = np.empty(lanes, np.int64), np.zeros(lanes)
    swap = np.empty((n, lanes))
    d = np.empty((2, n, n, lanes))  # |A| and dA, in the order of the Hessenberg form, balanced
    for k in range(lanes):
        at = start + min(k, count - 1)
        for i in range(n):
            p = by.order[i, k]
            for j in range(n):
                q = by.order[j, k]
                ratio = by.scale[j, k] / by.scale[i, k]
                d[0, i, j, k] = abs(stack[at, p, q]) * ratio
                d[1, i, j, k] = change[at, p, q] * ratio
    for i in range(n):
        for j in range(n):
            for k in range(lanes):
                norm[k] = max(norm[k], abs(h[i, j, k]))
    most = 0
    for k in range(count):
        seen = 0
        for i in range(n):
            seen += 1 if imag[start + k, i] >= 0.0 else 0
        most = max(most, seen)
    for k in range(lanes):
        root[k] = -1
    for _ in range(most):
        for k in range(lanes):
            at = start + min(k, count - 1)
            i = root[k] + 1
            while i < n and imag[at, i] < 0.0:
                i += 1
            if i < n:
                root[k] = i
            z[0, k], z[1, k] = real[at, root[k]] / by.unit[k], imag[at, root[k]] / by.unit[k]
        _factor(h, n, z, norm, triangle, work, swap)
        _right(n, triangle, work)
        _left(n, triangle, work, swap)
        _back(n, by, work)
        _judge(n, by, start, count, root, norm, d, real, imag, slopes, shares, doubt, work)
    for k in range(count):  # lower halves follow from the upper ones
        at = start + k
        for i in range(n):
            if imag[at, i] < 0.0:
                mate = i
                for j in range(n):
                    if imag[at, j] == -imag[at, i] and real[at, j] == real[at, i]:
                        mate = j
                slopes[0, at, i], slopes[1, at, i] = slopes[0, at, mate], -slopes[1, at, mate]
                doubt[at, i] = doubt[at, mate]
                for s in range(n):
                    shares[at, s, i] = shares[at, s, mate]
    _settle(start, count, n, real, imag, doubt)


@compiled_within
def _factor(h: Array, n: int, z: Array, norm: Array, triangle: Array, work: Array, swap: Array) -> None:
    """H - z = P' L U with neighbours swapped where that is the larger pivot; factors of L in ``work`` 8 and 9."""
    lanes = work.shape[2]
    re, im = triangle[0], triangle[1]
    lre, lim = work[8], work[9]
    for i in range(n):
        for j in range(max(i - 1, 0), n):
            for k in range(lanes):
                re[i, j, k] = h[i, j, k]
                im[i, j, k] = 0.0
        for k in range(lanes):
            re[i, i, k] -= z[0, k]
            im[i, i, k] = -z[1, k]
    for c in range(n - 1):
        for k in range(lanes):
            size = re[c, c, k] * re[c, c, k] + im[c, c, k] * im[c, c, k]
            below = re[c + 1, c, k]
            swap[c, k] = 1.0 if below * below > size else 0.0
        for k in range(lanes):
            s = swap[c, k] > 0.0
            a, b, below = re[c, c, k], im[c, c, k], re[c + 1, c, k]
            p, q = (below if s else a), (0.0 if s else b)  # the pivot
            x, y = (a if s else below), (b if s else 0.0)
            size = p * p + q * q
            tiny = EPS * norm[k]
            small = size < tiny * tiny
            p, q = (tiny if small else p), (0.0 if small else q)
            size = 1.0 / max(p * p + q * q, 1e-300)
            re[c, c, k], im[c, c, k] = p, q
            lre[c, k], lim[c, k] = (x * p + y * q) * size, (y * p - x * q) * size
        for j in range(c + 1, n):
            for k in range(lanes):
                s = swap[c, k] > 0.0
                a, b, x, y = re[c, j, k], im[c, j, k], re[c + 1, j, k], im[c + 1, j, k]
                p, q = (x if s else a), (y if s else b)
                x, y = (a if s else x), (b if s else y)
                re[c, j, k], im[c, j, k] = p, q
                re[c + 1, j, k] = x - (lre[c, k] * p - lim[c, k] * q)
                im[c + 1, j, k] = y - (lre[c, k] * q + lim[c, k] * p)
    for k in range(lanes):
        p, q, tiny = re[n - 1, n - 1, k], im[n - 1, n - 1, k], EPS * norm[k]
        small = p * p + q * q < tiny * tiny
        re[n - 1, n - 1, k], im[n - 1, n - 1, k] = (tiny if small else p), (0.0 if small else q)


@compiled_within
def _right(n: int, triangle: Array, work: Array) -> None:
    """Solve U x = ones: ``work`` 0 and 1."""
    lanes = work.shape[2]
    re, im, x, y = triangle[0], triangle[1], work[0], work[1]
    for i in range(n - 1, -1, -1):
        for k in range(lanes):
            x[i, k], y[i, k] = 1.0, 0.0
        for j in range(i + 1, n):
            for k in range(lanes):
                x[i, k] -= re[i, j, k] * x[j, k] - im[i, j, k] * y[j, k]
                y[i, k] -= re[i, j, k] * y[j, k] + im[i, j, k] * x[j, k]
        _divide(x[i], y[i], re[i, i], im[i, i])


@compiled_within
def _left(n: int, triangle: Array, work: Array, swap: Array) -> None:
    """Solve (L U)' P u = ones, transposed and not conjugated: ``work`` 2 and 3."""
    lanes = work.shape[2]
    re, im, x, y, lre, lim = triangle[0], triangle[1], work[2], work[3], work[8], work[9]
    for i in range(n):
        for k in range(lanes):
            x[i, k], y[i, k] = 1.0, 0.0
        for j in range(i):
            for k in range(lanes):
                x[i, k] -= re[j, i, k] * x[j, k] - im[j, i, k] * y[j, k]
                y[i, k] -= re[j, i, k] * y[j, k] + im[j, i, k] * x[j, k]
        _divide(x[i], y[i], re[i, i], im[i, i])
    for c in range(n - 2, -1, -1):
        for k in range(lanes):
            p, q = x[c + 1, k], y[c + 1, k]
            a = x[c, k] - (lre[c, k] * p - lim[c, k] * q)
            b = y[c, k] - (lre[c, k] * q + lim[c, k] * p)
            s = swap[c, k] > 0.0
            x[c, k], y[c, k] = (p if s else a), (q if s else b)
            x[c + 1, k], y[c + 1, k] = (a if s else p), (b if s else q)


@compiled_within
def _divide(x: Array, y: Array, re: Array, im: Array) -> None:
    for k in range(len(x)):
        size = 1.0 / (re[k] * re[k] + im[k] * im[k])
        a, b = x[k], y[k]
        x[k], y[k] = (a * re[k] + b * im[k]) * size, (b * re[k] - a * im[k]) * size


@compiled_within
def _back(n: int, by: Similarity, work: Array) -> None:
    """From the Hessenberg form to the balanced matrix; vectors become of length 1, what they had is in ``work`` 10."""
    lanes = work.shape[2]
    total = work[11, 0]
    for pair in range(2):
        x, y = work[2 * pair], work[2 * pair + 1]
        length = work[10, pair]
        for k in range(lanes):
            length[k] = 0.0
        for i in range(n):
            for k in range(lanes):
                length[k] = max(length[k], abs(x[i, k]), abs(y[i, k]))
        for i in range(n):
            for k in range(lanes):
                x[i, k] /= length[k]
                y[i, k] /= length[k]
        for part in (x, y):
            for c in range(n - 3, -1, -1):
                v, tau, top = by.v[c], by.tau[c], c + 1
                for k in range(lanes):
                    total[k] = part[top, k]
                for i in range(top + 1, n):
                    for k in range(lanes):
                        total[k] += v[i, k] * part[i, k]
                for k in range(lanes):
                    total[k] *= tau[k]
                    part[top, k] -= total[k]
                for i in range(top + 1, n):
                    for k in range(lanes):
                        part[i, k] -= total[k] * v[i, k]


@compiled_within
def _judge(
    n: int, by: Similarity, start: int, count: int, root: Places, norm: Array, d: Array, real: Array, imag: Array,
    slopes: Array, shares: Array, doubt: Array, work: Array,
) -> None:  # fmt: skip
    """Slope, shares of states and doubt of one root of every lane."""
    lanes = work.shape[2]
    x, y, p, q = work[0], work[1], work[2], work[3]
    right, left, own = work[4], work[5], work[6]
    ux, uy, sx, sy, whole, rounding = work[7, 0], work[7, 1], work[11, 1], work[11, 2], work[11, 3], work[7, 2]
    for k in range(lanes):
        ux[k] = uy[k] = sx[k] = sy[k] = whole[k] = rounding[k] = 0.0
    for i in range(n):
        for k in range(lanes):
            a, b = p[i, k] * x[i, k] - q[i, k] * y[i, k], p[i, k] * y[i, k] + q[i, k] * x[i, k]
            ux[k] += a
            uy[k] += b
            own[i, k] = math.sqrt(a * a + b * b)
            whole[k] += own[i, k]
            right[i, k] = math.sqrt(x[i, k] * x[i, k] + y[i, k] * y[i, k])
            left[i, k] = math.sqrt(p[i, k] * p[i, k] + q[i, k] * q[i, k])
    for i in range(n):
        for j in range(n):
            for k in range(lanes):
                sx[k] += d[1, i, j, k] * (p[i, k] * x[j, k] - q[i, k] * y[j, k])
                sy[k] += d[1, i, j, k] * (p[i, k] * y[j, k] + q[i, k] * x[j, k])
                rounding[k] += left[i, k] * d[0, i, j, k] * right[j, k]
    for k in range(count):
        at, r = start + k, root[k]
        size = ux[k] * ux[k] + uy[k] * uy[k]
        slopes[0, at, r] = (sx[k] * ux[k] + sy[k] * uy[k]) / size
        slopes[1, at, r] = (sy[k] * ux[k] - sx[k] * uy[k]) / size if imag[at, r] != 0.0 else 0.0
        largest = 0.0
        for i in range(n):
            largest = max(largest, math.sqrt(real[at, i] * real[at, i] + imag[at, i] * imag[at, i]))
            shares[at, by.order[i, k], r] = own[i, k] / whole[k]
        grown = min(work[10, 0, k], work[10, 1, k]) * norm[k] * EPS > GROWTH
        doubt[at, r] = DIGITS * max(rounding[k] / math.sqrt(size), largest) if grown else math.nan


@compiled_within
def _settle(start: int, count: int, n: int, real: Array, imag: Array, doubt: Array) -> None:
    """What rounding split of a double real root is real again."""
    for k in range(start, start + count):
        largest = 0.0
        for i in range(n):
            largest = max(largest, math.sqrt(real[k, i] * real[k, i] + imag[k, i] * imag[k, i]))
        some = False
        for i in range(n):
            some = some or 0.0 < abs(imag[k, i]) <= DOUBTFUL * largest
        if some:
            for i in range(n):
                if abs(imag[k, i]) <= doubt[k, i]:
                    imag[k, i] = 0.0
