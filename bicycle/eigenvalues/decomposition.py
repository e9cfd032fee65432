"""Eigenvalues with right and left eigenvectors, and how fast each eigenvalue moves: d(lambda) = u dA x for u x = 1.

(Lancaster 1964, Numerische Mathematik 6, 377-387.)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bicycle.speed_polynomial import SpeedPolynomial
from tyre.base.arrays import Array, Complex

BATCH = 1000  # matrices a call: they fit the cache
DOUBTFUL = 1e-7  # a pair with an imaginary part below this share of the largest root may be a double real root
DIGITS = 30 * np.finfo(float).eps  # what rounding may change in the last digits of a root


class Eigensystem(NamedTuple):
    """Eigenvalues (m, n) in 1/s, right eigenvectors as columns and left ones as rows (m, n, n), u_i x_i = 1."""

    values: Complex
    right: Complex
    left: Complex


class Decomposition(NamedTuple):
    """Eigenvalues (m, n) in 1/s, their slopes d(lambda)/dv (m, n) in 1/m, right (columns) and left eigenvectors."""

    values: Complex
    slopes: Complex
    right: Complex
    left: Complex


def eigensystem(matrices: Array, *, mass: Array | None = None) -> Eigensystem:
    """Eigenvalues and eigenvectors of A, or of E^-1 F where a mass matrix E is given.

    Parameters
    ----------
    matrices : ndarray, shape (m, n, n)
        A in 1/s, or F.
    mass : ndarray, shape (m, n, n), optional
        E; the left eigenvectors are then those of the pencil, u_i E x_i = 1.

    Returns
    -------
    Eigensystem
        Roots in LAPACK's order: of a pair the upper half comes first, the lower next to it.
    """
    values, right = np.linalg.eig(matrices if mass is None else np.linalg.solve(mass, matrices))
    left = inverse(right if mass is None else mass @ right)
    return Eigensystem(values.astype(complex, copy=False), right, left)


def decompose(polynomial: SpeedPolynomial, speeds: Array) -> Decomposition:
    """Eigenvalues of A(v) with slopes and eigenvectors; what rounding split of a double real root is real again.

    Parameters
    ----------
    polynomial : SpeedPolynomial, shape (n, n) or (m, n, n)
        A of one bicycle, or of m of them, which have one speed each.
    speeds : ndarray, shape (m,)
        m/s.
    """
    if len(speeds) > BATCH:
        stacked = len(polynomial.shape) > 2
        parts = []
        for part in np.array_split(np.arange(len(speeds)), -(-len(speeds) // BATCH)):
            parts.append(decompose(polynomial.take(part) if stacked else polynomial, speeds[part]))
        return Decomposition(*(np.concatenate(part) for part in zip(*parts, strict=True)))
    matrices = polynomial(speeds)
    values, right, left = eigensystem(matrices)
    slopes = projected(left, polynomial.derivative(speeds), right)
    k = np.flatnonzero(doubtful(values))
    if k.size:
        rounding = np.abs(values[k].imag) <= uncertainty(values[k], left[k], matrices[k], right[k])
        values[k] = np.where(rounding, values[k].real, values[k])
    return Decomposition(values, *(part.astype(complex, copy=False) for part in (slopes, right, left)))


def projected(left: Complex, matrices: Array, right: Complex) -> Complex:
    """u_i M x_i of every pair of eigenvectors: what a change M of the matrix does to each eigenvalue.

    Parameters
    ----------
    left, right : ndarray, shape (m, n, n)
        Left eigenvectors as rows, right ones as columns.
    matrices : ndarray, shape (m, n, n)

    Returns
    -------
    ndarray, shape (m, n)
    """
    return np.asarray(((left @ matrices).swapaxes(1, 2) * right).sum(1))


def doubtful(values: Complex) -> NDArray[np.bool_]:
    """Where a pair may be two equal real roots that rounding has split.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        Eigenvalues, 1/s.

    Returns
    -------
    ndarray of bool, shape (m,)
    """
    size = np.abs(values.imag)
    return np.asarray(((size > 0) & (size <= DOUBTFUL * np.abs(values).max(1, keepdims=True))).any(1))


def uncertainty(values: Complex, left: Complex, matrices: Array, right: Complex) -> Array:
    """What rounding may change in each root: eps times the largest root, or more where the root is sensitive.

    That is ``eps |u| |A| |x|``, with absolute values of left and right eigenvectors, u x = 1.

    Parameters
    ----------
    values : ndarray, shape (m, n)
        Eigenvalues, 1/s.
    left, matrices, right : ndarray, shape (m, n, n)

    Returns
    -------
    ndarray, shape (m, n)
        1/s.
    """
    own = ((np.abs(left) @ np.abs(matrices)).swapaxes(1, 2) * np.abs(right)).sum(1)
    return np.asarray(DIGITS * np.maximum(own, np.abs(values).max(1, keepdims=True)))


def inverse(matrices: Complex) -> Complex:
    """Inverses of ``matrices`` (m, n, n); the pseudo-inverse of a matrix of eigenvectors that is exactly defective."""
    try:
        return np.asarray(np.linalg.inv(matrices))
    except np.linalg.LinAlgError:
        half = len(matrices) // 2
        parts = (matrices[:half], matrices[half:])
        return np.concatenate([inverse(part) for part in parts]) if half else np.asarray(np.linalg.pinv(matrices))


def positive_definite(mass: Array) -> NDArray[np.bool_]:
    """Which of many matrices are positive definite, (m,).

    Parameters
    ----------
    mass : ndarray, shape (m, n, n)
        Only the symmetric part counts.
    """
    symmetric = (mass + mass.swapaxes(-1, -2)) / 2
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(symmetric)[..., 0] > 0)
    return np.ones(len(mass), bool)
