"""State matrices inv(M) F of many small models, compiled: one elimination each. Needs numba (extra ``fast``)."""

import math

import numpy as np
from numpy.typing import NDArray

from bicycle.eigenvalues.compilation import compiled, compiled_within


@compiled
def reduce_pencil(
    mass: NDArray[np.float64],
    parts: tuple[NDArray[np.float64], ...],
    scale: NDArray[np.float64],
    out: NDArray[np.float64],
    refused: NDArray[np.bool_],
) -> None:
    """Fill ``out`` with inv(D) inv(M) F D, D = diag(scale), for p stacks F; mark M that are not positive.

    Parameters
    ----------
    mass : ndarray, shape (m, n, n)
        M.
    parts : tuple of p ndarrays, shape (m, n, n)
        The stacks F.
    scale : ndarray, shape (n,)
        Diagonal of D.
    out : ndarray, shape (p, m, n, n)
        Filled.
    refused : ndarray of bool, shape (m,)
        Filled: True where M is not positive.

    Notes
    -----
    Gaussian elimination with partial pivoting; M counts as positive where its symmetric part has a Cholesky factor.
    """
    m, n, p = mass.shape[0], mass.shape[1], len(parts)
    a, factor, right = np.empty((n, n)), np.empty((n, n)), np.empty((n, n * p))
    for k in range(m):
        refused[k] = False
        for i in range(n):
            for j in range(i + 1):
                total = 0.5 * (mass[k, i, j] + mass[k, j, i])
                for q in range(j):
                    total -= factor[i, q] * factor[j, q]
                if i > j:
                    factor[i, j] = total / factor[j, j]
                elif total > 0.0:
                    factor[i, i] = math.sqrt(total)
                else:
                    refused[k] = True
                    factor[i, i] = 1.0
        for i in range(n):
            for j in range(n):
                a[i, j] = mass[k, i, j]
        for number, part in enumerate(parts):
            for i in range(n):
                for j in range(n):
                    right[i, number * n + j] = part[k, i, j] * scale[j]
        if not refused[k]:
            _eliminate(a, right)
        for number in range(p):
            for i in range(n):
                for j in range(n):
                    out[number, k, i, j] = right[i, number * n + j] / scale[i]


@compiled_within
def _eliminate(a: NDArray[np.float64], right: NDArray[np.float64]) -> None:
    """Solve a x = right in place; ``a`` is regular."""
    n, width = right.shape
    for j in range(n):
        pivot = j
        for i in range(j + 1, n):
            if abs(a[i, j]) > abs(a[pivot, j]):
                pivot = i
        if pivot != j:
            for c in range(n):
                a[j, c], a[pivot, c] = a[pivot, c], a[j, c]
            for c in range(width):
                right[j, c], right[pivot, c] = right[pivot, c], right[j, c]
        for i in range(j + 1, n):
            if a[i, j] != 0.0:
                share = a[i, j] / a[j, j]
                for c in range(j + 1, n):
                    a[i, c] -= share * a[j, c]
                for c in range(width):
                    right[i, c] -= share * right[j, c]
    for i in range(n - 1, -1, -1):
        for c in range(width):
            right[i, c] /= a[i, i]
        for q in range(i):
            if a[q, i] != 0.0:
                for c in range(width):
                    right[q, c] -= a[q, i] * right[i, c]
