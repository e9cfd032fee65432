"""Speeds at which a Laurent polynomial of matrices is singular, and the bialternate sum that turns pairs into zeros."""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigvals

from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex


def singular_speeds(polynomial: SpeedPolynomial) -> Complex:
    """Speeds v (complex in general) at which sum of v^k A_k is singular, by companion linearisation of v^s A(v).

    Parameters
    ----------
    polynomial : SpeedPolynomial, shape (n, n)

    Returns
    -------
    ndarray of complex, shape (k,)
        In the unit of the speed, m/s.
    """
    lowest, highest = min(polynomial), max(polynomial)
    n, degree = polynomial.shape[0], highest - lowest
    if degree == 0 or n == 0:
        return np.empty(0, complex)
    blocks = [polynomial.coefficient(power) for power in range(lowest, highest + 1)]
    size = [np.linalg.norm(block) for block in blocks]
    unit = (size[0] / size[-1]) ** (1 / degree) if size[0] and size[-1] else 1.0  # speeds of order one
    blocks = [block * unit**k for k, block in enumerate(blocks)]
    left, right = np.eye(n * degree, k=n), np.eye(n * degree)
    left[-n:] = -np.hstack(blocks[:-1])
    right[-n:, -n:] = blocks[-1]
    numerator, denominator = eigvals(left, right, homogeneous_eigvals=True)
    finite = np.abs(denominator) > 1e-14 * np.abs(numerator)
    return np.asarray(unit * numerator[finite] / denominator[finite])


def bialternate_sum(matrix: Array) -> Array:
    """Matrix of size n(n-1)/2 whose eigenvalues are the sums of two different eigenvalues of a matrix.

    Parameters
    ----------
    matrix : ndarray, shape (n, n)

    Returns
    -------
    ndarray, shape (n(n-1)/2, n(n-1)/2)
    """
    rows, columns, i, j, signs = _bialternate_pattern(len(matrix))
    total = np.zeros((len(matrix) * (len(matrix) - 1) // 2,) * 2)
    np.add.at(total, (rows, columns), signs * matrix[i, j])
    return total


@cache
def _bialternate_pattern(n: int) -> NDArray[np.intp]:
    """Rows, columns, entries (i, j) and signs of the action x ^ y -> A x ^ y + x ^ A y on e_p ^ e_q, p > q."""
    pairs = [(p, q) for p in range(n) for q in range(p)]
    number = {pair: k for k, pair in enumerate(pairs)}
    entries = []
    for column, (p, q) in enumerate(pairs):
        for i in range(n):
            for first, second, source in ((i, q, p), (p, i, q)):
                if first != second:
                    row = number[max(first, second), min(first, second)]
                    entries.append((row, column, i, source, 1 if first > second else -1))
    return np.array(entries, np.intp).reshape(-1, 5).T
