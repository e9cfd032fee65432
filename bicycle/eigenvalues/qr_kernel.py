"""Eigenvalues of many small real matrices, compiled: 64 matrices go side by side through shifted QR.

Needs numba (extra ``fast``). A matrix that is done, or whose rows are not in work, is masked: nothing it holds depends
on its neighbours. The steps are those of LAPACK's ``dlahqr`` (Golub & Van Loan, Matrix Computations, 4th ed., 7.5;
deflation after Ahues & Tisseur 1997), so is the backward error: a few eps times the norm.
"""

import math

import numpy as np

from bicycle.eigenvalues.compilation import compiled, compiled_within
from bicycle.eigenvalues.hessenberg_kernel import LANES, NOTHING, Places, hessenberg, room_for
from tyre.base.arrays import Array

EPS = float(np.finfo(float).eps)
MOST_ITERATIONS = 300  # of one eigenvalue; two or three are usual


@compiled
def solve(stack: Array, real: Array, imag: Array) -> int:
    """Fill in the eigenvalues of matrices, each row sorted by real then imaginary part.

    Parameters
    ----------
    stack : ndarray, shape (m, n, n)
        In any unit.
    real, imag : ndarray, shape (m, n)
        Get the parts of the eigenvalues, in the same unit.

    Returns
    -------
    int
        Index of the first matrix that failed, or -1. Of those before it some may not be filled in.
    """
    m, n = stack.shape[:2]
    for start in range(0, m, LANES):  # all in one call, which leaves the interpreter free
        count = min(LANES, m - start)
        if start == 0 or count < LANES:
            _, h, by = room_for(n, count)
        hessenberg(stack, start, count, h, by)
        failed = roots_of(h, by.unit, start, count, real, imag)
        if failed >= 0:
            return start + failed
    return -1


@compiled_within
def roots_of(h: Array, unit: Array, start: int, count: int, real: Array, imag: Array) -> int:
    """Fill in the eigenvalues of matrices in Hessenberg form; first lane that failed, or -1.

    Parameters
    ----------
    h : ndarray, shape (n + 1, n + 1, lanes)
        As of :func:`bicycle.eigenvalues.hessenberg_kernel.hessenberg`.
    unit : ndarray, shape (lanes,)
        What each matrix was divided by.
    start, count : int
        Index of the first matrix and number of matrices.
    real, imag : ndarray, shape (m, n)
        Get the parts of the eigenvalues, in the unit of the matrices.
    """
    n = h.shape[0] - 1
    window, lane = np.empty((3, h.shape[2]), np.int64), np.empty((8, h.shape[2]))
    failed = _iterate(h, n, window, lane)
    if 0 <= failed < count:
        return failed
    for k in range(count):
        _collect(h, n, k, unit[k], real[start + k], imag[start + k])
    return -1


@compiled_within
def _iterate(h: Array, n: int, window: Places, lane: Array) -> int:
    """Francis double-shift QR with deflation in every lane; first lane that does not converge, or -1."""
    low, high, age = window[0], window[1], window[2]
    lanes = h.shape[2]
    for k in range(lanes):
        high[k], age[k] = n - 1, 0
    for _ in range(MOST_ITERATIONS * n):
        _deflate(h, n)
        first, last = n, 0
        for k in range(lanes):
            i = high[k]
            while i >= 0:
                if i == 0 or h[i, i - 1, k] == 0.0:
                    i -= 1
                elif i == 1 or h[i - 1, i - 2, k] == 0.0:
                    i -= 2
                else:
                    break
            age[k] = age[k] + 1 if i == high[k] else 0
            high[k] = low[k] = i
            if i < 0:
                continue
            if age[k] > MOST_ITERATIONS or not math.isfinite(h[i, i, k]):
                return k
            while low[k] > 0 and h[low[k], low[k] - 1, k] != 0.0:
                low[k] -= 1
            first, last = min(first, low[k]), max(last, i)
        if first == n:
            return -1
        _shift(h, low, high, age, lane)
        _sweep(h, first, last, low, high, lane)
    return 0


@compiled_within
def _deflate(h: Array, n: int) -> None:
    """Set negligible entries below the diagonal to zero."""
    lanes = h.shape[2]
    for i in range(1, n):
        for k in range(lanes):
            below, above = abs(h[i, i - 1, k]), abs(h[i - 1, i, k])
            here, gap = abs(h[i, i, k]), abs(h[i - 1, i - 1, k] - h[i, i, k])
            size = here + abs(h[i - 1, i - 1, k])
            size = size if size > 0.0 else 1.0
            ab, ba = max(below, above), min(below, above)
            aa, bb = max(here, gap), min(here, gap)
            s = aa + ab
            s = s if s > 0.0 else 1.0
            small = below <= EPS * size and ba * (ab / s) <= max(NOTHING, EPS * (bb * (aa / s)))
            h[i, i - 1, k] = 0.0 if small or below <= NOTHING else h[i, i - 1, k]


@compiled_within
def _shift(h: Array, low: Places, high: Places, age: Places, lane: Array) -> None:
    """First column of (H - z1)(H - z2) of each window into ``lane`` 0 to 2; z1 and z2 from its lower corner."""
    lanes = h.shape[2]
    for k in range(lanes):
        i, j = high[k], low[k]
        if i < 0:
            i, j = 2, 0  # anything: masked
        a, b, c, d = h[i - 1, i - 1, k], h[i - 1, i, k], h[i, i - 1, k], h[i, i, k]
        if age[k] % 10 == 9:  # exceptional shifts break cycles
            s = abs(c) + abs(h[i - 1, i - 2, k])
            a = d = 0.75 * s + d
            b, c = -0.4375 * s, s
        lane[0, k], lane[1, k], lane[2, k], lane[3, k] = a, b, c, d
        lane[4, k], lane[5, k] = h[j, j, k], h[j, j + 1, k]
        lane[6, k], lane[7, k] = h[j + 1, j, k], h[j + 1, j + 1, k]
    for k in range(lanes):
        a, b, c, d = lane[0, k], lane[1, k], lane[2, k], lane[3, k]
        half = 0.5 * (a - d)
        z = half * half + b * c
        root = math.sqrt(abs(z))
        mean = 0.5 * (a + d)
        corner = mean + root if abs(mean + root - d) <= abs(mean - root - d) else mean - root
        re = corner if z >= 0.0 else mean  # two real shifts: the one near the corner twice
        im = 0.0 if z >= 0.0 else root
        h11, h12, h21, h22 = lane[4, k], lane[5, k], lane[6, k], lane[7, k]
        s = abs(h11 - re) + im + abs(h21)
        s = 1.0 / s if s > 0.0 else 0.0
        lane[0, k] = (h21 * s) * h12 + (h11 - re) * ((h11 - re) * s) + im * (im * s)
        lane[1, k] = (h21 * s) * (h11 + h22 - 2.0 * re)
        lane[2, k] = h21 * s
    for k in range(lanes):
        if high[k] >= 0:
            lane[2, k] *= h[low[k] + 2, low[k] + 1, k]


@compiled_within
def _sweep(h: Array, first: int, last: int, low: Places, high: Places, lane: Array) -> None:
    """One implicit double-shift step on rows low..high of every lane, all of them within first..last."""
    tau, v2, v3, beta = lane[3], lane[4], lane[5], lane[6]
    lanes = h.shape[2]
    for c in range(first, last):
        b = c - 1 if c > 0 else c  # the column the bulge is in
        for k in range(lanes):
            starts = low[k] == c
            three = c < high[k] - 1
            x = lane[0, k] if starts else h[c, b, k]
            y = lane[1, k] if starts else h[c + 1, b, k]
            z = (lane[2, k] if starts else h[c + 2, b, k]) if three else 0.0
            norm = x * x + y * y + z * z
            active = low[k] <= c and c < high[k] and norm > 0.0
            size = -math.copysign(math.sqrt(norm), x)
            share = 1.0 / (x - size)
            tau[k] = (size - x) / size if active else 0.0
            v2[k], v3[k] = (y * share if active else 0.0), (z * share if active else 0.0)
            beta[k] = size
        for k in range(lanes):
            inner = tau[k] != 0.0 and low[k] < c
            h[c, b, k] = beta[k] if inner else h[c, b, k]
            h[c + 1, b, k] = 0.0 if inner else h[c + 1, b, k]
            h[c + 2, b, k] = 0.0 if inner and c < high[k] - 1 else h[c + 2, b, k]
        for j in range(c, last + 1):
            for k in range(lanes):
                total = tau[k] * (h[c, j, k] + v2[k] * h[c + 1, j, k] + v3[k] * h[c + 2, j, k])
                h[c, j, k] -= total
                h[c + 1, j, k] -= total * v2[k]
                h[c + 2, j, k] -= total * v3[k]
        for i in range(first, min(c + 3, last) + 1):
            for k in range(lanes):
                total = tau[k] * (h[i, c, k] + v2[k] * h[i, c + 1, k] + v3[k] * h[i, c + 2, k])
                h[i, c, k] -= total
                h[i, c + 1, k] -= total * v2[k]
                h[i, c + 2, k] -= total * v3[k]


@compiled_within
def _collect(h: Array, n: int, k: int, unit: float, real: Array, imag: Array) -> None:
    """Read the eigenvalues of one lane off its diagonal blocks, sorted."""
    i = n - 1
    while i >= 0:
        if i == 0 or h[i, i - 1, k] == 0.0:
            real[i], imag[i] = h[i, i, k] * unit, 0.0
            i -= 1
        else:
            re1, im1, re2, im2 = _pair(h[i - 1, i - 1, k], h[i - 1, i, k], h[i, i - 1, k], h[i, i, k])
            real[i - 1], imag[i - 1], real[i], imag[i] = re1 * unit, im1 * unit, re2 * unit, im2 * unit
            i -= 2
    for i in range(1, n):
        re, im = real[i], imag[i]
        j = i - 1
        while j >= 0 and (real[j] > re or (real[j] == re and imag[j] > im)):
            real[j + 1], imag[j + 1] = real[j], imag[j]
            j -= 1
        real[j + 1], imag[j + 1] = re, im


@compiled_within
def _pair(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    """Eigenvalues of [[a, b], [c, d]] without overflow: re, im, re, im."""
    if c == 0.0 or b == 0.0:
        return a, 0.0, d, 0.0
    half = 0.5 * (a - d)
    large, small = max(abs(b), abs(c)), min(abs(b), abs(c))
    small = math.copysign(small, b) * math.copysign(1.0, c)
    size = max(abs(half), large)
    z = half / size * half + large / size * small
    if z >= 0.0:
        z = half + math.copysign(math.sqrt(size) * math.sqrt(z), half)
        return d + z, 0.0, (d - large / z * small if z != 0.0 else d), 0.0
    root = math.sqrt(size) * math.sqrt(-z)
    return d + half, -root, d + half, root
