"""Eigenvalues and eigenvectors of stacks of small matrices by LAPACK, and eigenvalues as oscillations.

>>> import numpy as np
>>> eigenvalues(np.array([[[0.0, 1.0], [-4.0, 0.0]]]))
array([[0.-2.j, 0.+2.j]])
>>> round(float(damping_ratio(-3 + 4j)), 3), round(float(frequency_hz(2j * np.pi)), 3)
(0.6, 1.0)
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.speed_polynomial import SpeedPolynomial
from tyre.arrays import Array, Complex
from tyre.errors import InputError
from tyre.workers import one_blas_thread

BATCH = 1024  # matrices a call: they fit the cache, and there is enough for every thread
DOUBTFUL = 1e-7  # a pair with an imaginary part below this share of the largest root may be a double real root
DIGITS = 30 * np.finfo(float).eps  # what rounding may change in the last digits of a root
NOISE = 1e-12  # of the largest root: a root smaller than this is zero


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


def eigenvalues(stack: ArrayLike, *, threads: int = 1) -> Complex:
    """Eigenvalues (..., n) in 1/s of matrices, sorted by real then imaginary part."""
    matrices = np.asarray(stack, float)
    if matrices.ndim < 2 or matrices.shape[-1] != matrices.shape[-2]:
        raise InputError(f"matrices have shape {matrices.shape}; give square ones, shape (..., n, n)")
    if not np.isfinite(matrices).all():
        first = tuple(np.argwhere(~np.isfinite(matrices))[0].tolist())
        raise InputError(f"entry {[*first]} of the matrices is {matrices[first]}; eigenvalues need finite entries")
    flat = matrices.reshape(-1, *matrices.shape[-2:])
    return in_batches(lambda part: flat[part], flat.shape[:2], threads).reshape(matrices.shape[:-1])


def in_batches(matrices: Callable[[slice], NDArray[np.float64]], shape: tuple[int, int], threads: int = 1) -> Complex:
    """Eigenvalues (m, n) in 1/s of m matrices that ``matrices`` makes where they are used, from a slice of them."""
    if threads < 1:
        raise InputError(f"threads = {threads}; give at least 1")
    result = np.empty(shape, complex)

    def fill(start: int) -> None:
        part = slice(start, start + BATCH)
        result[part] = np.sort(np.linalg.eigvals(matrices(part)).astype(complex, copy=False), axis=-1)

    starts = range(0, len(result), BATCH)
    if threads == 1 or len(starts) < 2:
        for start in starts:
            fill(start)
    else:
        with one_blas_thread(), ThreadPoolExecutor(threads) as pool:
            list(pool.map(fill, starts))
    return result


def eigensystem(matrices: Array, *, mass: Array | None = None) -> Eigensystem:
    """Eigenvalues and eigenvectors of A, or of E^-1 F where a mass matrix E is given."""
    values, right = np.linalg.eig(matrices if mass is None else np.linalg.solve(mass, matrices))
    left = inverse(right if mass is None else mass @ right)
    return Eigensystem(values.astype(complex, copy=False), right, left)


def roots_at(polynomial: SpeedPolynomial, speeds: Array) -> Eigensystem:
    """Eigenvalues and eigenvectors of A(v); what rounding split of a double real root is real again."""
    matrices = polynomial(speeds)
    values, right, left = eigensystem(matrices)
    k = np.flatnonzero(doubtful(values))
    if k.size:
        rounding = np.abs(values[k].imag) <= uncertainty(values[k], left[k], matrices[k], right[k])
        values[k] = np.where(rounding, values[k].real, values[k])
    return Eigensystem(values, right.astype(complex, copy=False), left.astype(complex, copy=False))


def decompose(polynomial: SpeedPolynomial, speeds: Array) -> Decomposition:
    """Roots of :func:`roots_at` with their slopes d(lambda) = u dA x for u x = 1 (Lancaster 1964)."""
    parts = []
    for start in range(0, max(len(speeds), 1), BATCH):
        part = slice(start, start + BATCH)
        own = polynomial.take(part) if len(polynomial.shape) > 2 else polynomial
        values, right, left = roots_at(own, speeds[part])
        slopes = projected(left, own.derivative(speeds[part]), right).astype(complex, copy=False)
        parts.append(Decomposition(values, slopes, right, left))
    if len(parts) == 1:
        return parts[0]
    return Decomposition(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def projected(left: Complex, matrices: Array, right: Complex) -> Complex:
    """u_i M x_i (m, n) of every pair of eigenvectors (m, n, n): what a change M does to each eigenvalue."""
    return np.asarray(((left @ matrices).swapaxes(1, 2) * right).sum(1))


def doubtful(values: Complex) -> NDArray[np.bool_]:
    """Points (m,) at which a pair of the ``values`` (m, n) may be two equal real roots that rounding has split."""
    size = np.abs(values.imag)
    return np.asarray(((size > 0) & (size <= DOUBTFUL * np.abs(values).max(1, keepdims=True))).any(1))


def uncertainty(values: Complex, left: Complex, matrices: Array, right: Complex) -> Array:
    """Rounding (m, n) of each root, 1/s: eps times the largest root, or eps |u| |A| |x| where that is more."""
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
    """Which of the matrices ``mass`` (m, n, n) have a positive definite symmetric part, (m,)."""
    symmetric = (mass + mass.swapaxes(-1, -2)) / 2
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(symmetric)[..., 0] > 0)
    return np.ones(len(mass), bool)


def unstable_roots(values: Complex) -> NDArray[np.intp]:
    """Number of unstable roots of each row of ``values`` (m, n), beyond rounding."""
    return np.asarray((values.real > NOISE * np.abs(values).max(-1, keepdims=True)).sum(-1))


def frequency_hz(eigenvalues: ArrayLike) -> Array:
    """Damped frequency Im(z) / (2 pi), Hz, of eigenvalues in 1/s; 0 for a real root, below 0 for a lower half."""
    return np.asarray(np.asarray(eigenvalues, complex).imag / (2 * np.pi))


def angular_frequency(hertz: ArrayLike) -> Array:
    """2 pi f, rad/s, of frequencies in Hz: the imaginary part of the upper half of a pair."""
    return np.asarray(2 * np.pi * np.asarray(hertz, float))


def damping_ratio(eigenvalues: ArrayLike) -> Array:
    """Damping ratio -Re(z) / |z| of either half of a pair; below 0 where it grows, NaN for a root at zero."""
    root = np.asarray(eigenvalues, complex)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(-root.real / np.abs(root))


def oscillating(eigenvalues: ArrayLike) -> Complex:
    """The upper halves of pairs, NaN in place of every other root."""
    root = np.asarray(eigenvalues, complex)
    with np.errstate(invalid="ignore"):
        return np.where(root.imag > 0, root, complex(np.nan, np.nan))


def least_damping_ratio(eigenvalues: ArrayLike) -> Array:
    """Smallest damping ratio (...) among the oscillations of ``eigenvalues`` (..., n), NaN where none oscillates."""
    root = np.asarray(eigenvalues, complex)
    ratio = np.where(root.imag > 0, damping_ratio(root), np.inf).min(-1)
    return np.where(np.isinf(ratio), np.nan, ratio)


def pair_damping_ratio(first: Complex, second: Complex) -> NDArray[np.float64]:
    """Damping ratio of the two roots of one mode, a pair (``second`` is NaN) or two real ones, 1/s."""
    with np.errstate(invalid="ignore", divide="ignore"):
        overdamped = -(first + second).real / (2 * np.sqrt(np.maximum((first * second).real, 0)))
        ratio = np.where(first.imag > 0, damping_ratio(first), overdamped)
    return np.where(np.isfinite(ratio), ratio, np.nan)
