"""Eigenvalues and eigenvectors of stacks of small matrices, and eigenvalues as oscillations.

The kernel in C (_kernel.c) solves many matrices side by side. LAPACK solves those on which it fails, and all where
it was not built or the environment has VELOTYRE_KERNEL=off.

>>> import numpy as np
>>> eigenvalues(np.array([[[0.0, 1.0], [-4.0, 0.0]]]))
array([[0.-2.j, 0.+2.j]])
>>> round(float(damping_ratio(-3 + 4j)), 3), round(float(frequency_hz(2j * np.pi)), 3)
(0.6, 1.0)
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.equations.speed_polynomial import SpeedPolynomial
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError
from tyre.ground.workers import one_blas_thread

kernel: Any = None
if os.environ.get("VELOTYRE_KERNEL") != "off":
    with suppress(ImportError):  # installed without a compiler
        kernel = import_module("bicycle._kernel")
KERNEL = f"C, {kernel.width}" if kernel else "LAPACK, by numpy"

BATCH = 512  # matrices a call: they fit the cache, and there is enough for every thread
DOUBTFUL = 1e-7  # a pair with an imaginary part below this share of the largest root may be a double real root
DIGITS = 30 * np.finfo(float).eps  # what rounding may change in the last digits of a root
NOISE = 1e-12  # of the largest root: a root smaller than this is zero


class Eigensystem(NamedTuple):
    """Eigenvalues (m, n) in 1/s, right eigenvectors as columns and left ones as rows (m, n, n), u_i x_i = 1.

    The two halves of a pair stand side by side, the upper one first.
    """

    values: Complex  # (m, n), 1/s
    right: Complex  # (m, n, n), columns
    left: Complex  # (m, n, n), rows


class Decomposition(NamedTuple):
    """Eigenvalues (m, n) in 1/s, their slopes d(lambda)/dv (m, n) in 1/m, right (columns) and left eigenvectors."""

    values: Complex  # (m, n), 1/s
    slopes: Complex  # (m, n), 1/m
    right: Complex  # (m, n, n), columns
    left: Complex  # (m, n, n), rows


class Participation(NamedTuple):
    """Eigenvalues (m, n) in 1/s and who moves in each: shares without a unit."""

    values: Complex  # (m, n), 1/s
    share: Array  # (m, groups, n), sums of |left times right eigenvector| over the states of each group, of all states
    steering: Array  # (m, n), steer angle among all angles


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
        result[part] = spectra(matrices(part))

    starts = range(0, len(result), BATCH)
    if threads == 1 or len(starts) < 2:
        for start in starts:
            fill(start)
    else:
        with one_blas_thread(), ThreadPoolExecutor(threads) as pool:
            list(pool.map(fill, starts))
    return result


def spectra(matrices: Array) -> Complex:
    """Eigenvalues (m, n) of finite ``matrices`` (m, n, n), sorted by real then imaginary part."""
    m, n, _ = matrices.shape
    if kernel is None or not 0 < n <= kernel.most:
        return np.sort(np.linalg.eigvals(matrices).astype(complex, copy=False), axis=-1)
    values = np.empty((m, n), complex)
    if kernel.solve(n, np.ascontiguousarray(matrices, float), values):
        k = np.flatnonzero(np.isnan(values[:, 0]))
        values[k] = np.sort(np.linalg.eigvals(matrices[k]).astype(complex, copy=False), axis=-1)
    return values


def eigensystem(matrices: Array, *, mass: Array | None = None) -> Eigensystem:
    """Eigenvalues and eigenvectors of A, or of E^-1 F where mass matrices E, (m, n, n) or (1, n, n), are given."""
    if mass is None:
        values, _, right, left = eigensystem_with_slopes(matrices)
        return Eigensystem(values, right, left)
    inverse_mass = np.linalg.inv(mass)
    values, _, right, left = eigensystem_with_slopes(inverse_mass @ matrices)
    return Eigensystem(values, right, left @ inverse_mass)


def eigensystem_with_slopes(matrices: Array, changes: Array | None = None, *, vectors: bool = True) -> Decomposition:
    """Decomposition of A with slopes u_i dA x_i (Lancaster 1964) for ``changes`` dA (m, n, n), NaN without these.

    Without ``vectors`` these are empty.
    """
    m, n, _ = matrices.shape
    if kernel is None or not 0 < n <= kernel.most:
        return _by_lapack(matrices, changes)
    square = (m, n, n) if vectors else (0, n, n)
    decomposition = Decomposition(*(np.empty(shape, complex) for shape in ((m, n), (m, n), square, square)))
    contiguous = [None if part is None else np.ascontiguousarray(part, float) for part in (matrices, changes)]
    slopes = (None, None) if changes is None else (contiguous[1], decomposition.slopes)
    if kernel.solve(
        n, contiguous[0], decomposition.values, *slopes, *((decomposition.right, decomposition.left) if vectors else ())
    ):
        k = np.flatnonzero(np.isnan(decomposition.values[:, 0]))
        by_lapack = _by_lapack(matrices[k], None if changes is None else changes[k])
        for part, recomputed in list(zip(decomposition, by_lapack, strict=True))[: 4 if vectors else 2]:
            part[k] = recomputed
    return decomposition


def participation(matrices: Array, weights: Array, ratio: Array) -> Participation:
    """Eigenvalues of ``matrices`` (m, n, n) and how states take part in their motion.

    Each state counts ``weights`` (groups, n) for each group; ``ratio`` (3, n) has the rows a, b, c of the ``steering``
    a |x| / (b |x| + c |x| / |lambda|).
    """
    m, n, _ = matrices.shape
    if kernel is None or not 0 < n <= kernel.most:
        return _participation_by_lapack(matrices, weights, ratio)
    participation = Participation(np.empty((m, n), complex), np.empty((m, len(weights), n)), np.empty((m, n)))
    none = (None,) * 4
    contiguous = np.ascontiguousarray(matrices, float)
    if kernel.solve(
        n, contiguous, participation.values, *none, weights, participation.share, ratio, participation.steering
    ):
        k = np.flatnonzero(np.isnan(participation.values[:, 0]))
        for part, recomputed in zip(participation, _participation_by_lapack(matrices[k], weights, ratio), strict=True):
            part[k] = recomputed
    return participation


def _participation_by_lapack(matrices: Array, weights: Array, ratio: Array) -> Participation:
    values, right = np.linalg.eig(matrices)
    left = np.clip(_left_eigenvectors(values, right), -1e150, 1e150)  # a float holds the square of these
    x, u = right.real**2, left**2
    if np.iscomplexobj(values):
        x += right.imag**2
        k, i = np.nonzero(values.imag > 0)
        u[k, i] = u[k, i + 1] = (u[k, i] + u[k, i + 1]) / 4
    part = np.sqrt(x * u.swapaxes(1, 2))
    part /= np.maximum(part.sum(1, keepdims=True), 1e-300)
    steer, angles, rates = np.matmul(ratio, np.sqrt(x)).swapaxes(0, 1)
    all_angles = angles + rates / np.maximum(np.abs(values), 1e-300)
    steering = steer / np.maximum(all_angles, 1e-300)
    return Participation(values.astype(complex, copy=False), np.matmul(weights, part), steering)


def _left_eigenvectors(values: Complex, right: Complex) -> Array:
    """Left eigenvectors as rows; u + u* and i (u - u*) in place of the two of a pair: the inverse of a real matrix."""
    return inverse(np.where((values.imag < 0)[:, None], -right.imag, right.real) if np.iscomplexobj(values) else right)


def _by_lapack(matrices: Array, changes: Array | None) -> Decomposition:
    values, right = np.linalg.eig(matrices)
    left = _left_eigenvectors(values, right).astype(complex)
    values, right = values.astype(complex, copy=False), right.astype(complex, copy=False)
    k, i = np.nonzero(values.imag > 0)
    upper = (left[k, i] - 1j * left[k, i + 1]) / 2
    left[k, i], left[k, i + 1] = upper, upper.conj()
    slopes = np.full(values.shape, complex(np.nan, np.nan)) if changes is None else project(left, changes, right)
    return Decomposition(values, slopes, right, left)


def _real_again(roots: Complex, matrices: Array) -> None:
    """Make pairs among ``roots`` (m, n) that rounding has made of a double real root real again, in place."""
    k = np.flatnonzero(doubtful(roots))
    if k.size:
        values, right, left = eigensystem(matrices[k])
        roots[k] = np.where(np.abs(values.imag) <= uncertainty(values, left, matrices[k], right), values.real, values)


def participation_at(polynomial: SpeedPolynomial, speeds: Array, weights: Array, ratio: Array) -> Participation:
    """:func:`participation` in the roots of A(v); what rounding split of a double real root is real again."""
    matrices = polynomial(speeds)
    roots = participation(matrices, weights, ratio)
    _real_again(roots.values, matrices)
    return roots


def decompose(polynomial: SpeedPolynomial, speeds: Array, *, vectors: bool = True) -> Decomposition:
    """Roots of A(v), slopes and, unless left out, ``vectors``; a double real root that rounding split is real again."""
    parts = []
    for start in range(0, max(len(speeds), 1), BATCH):
        part = slice(start, start + BATCH)
        v, batch = speeds[part], polynomial
        if len(polynomial.shape) > 2 and len(speeds) > BATCH:
            batch = polynomial.take(part)
        matrices = batch(v)
        decomposition = eigensystem_with_slopes(
            matrices, np.broadcast_to(batch.derivative(v), matrices.shape), vectors=vectors
        )
        _real_again(decomposition.values, matrices)
        parts.append(decomposition)
    return parts[0] if len(parts) == 1 else Decomposition(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def project(left: Complex, matrices: Array, right: Complex) -> Complex:
    """u_i M x_i (m, n) of every pair of eigenvectors (m, n, n): what a change M does to each eigenvalue."""
    return np.asarray(((left @ matrices).swapaxes(1, 2) * right).sum(1))


def doubtful(values: Complex) -> NDArray[np.bool_]:
    """Points (m,) at which a pair of the ``values`` (m, n) may be two equal real roots that rounding has split."""
    size = np.abs(values.imag)
    return np.asarray(((size > 0) & (size <= DOUBTFUL * np.abs(values).max(1, keepdims=True))).any(1))


def uncertainty(values: Complex, left: Complex, matrices: Array, right: Complex) -> Array:
    """Rounding (m, n) of each root, 1/s: eps times the largest root, or eps |u| |A| |x| where that is more."""
    weighted_size = ((np.abs(left) @ np.abs(matrices)).swapaxes(1, 2) * np.abs(right)).sum(1)
    return np.asarray(DIGITS * np.maximum(weighted_size, np.abs(values).max(1, keepdims=True)))


def inverse(matrices: Any) -> Array:
    """Inverses of ``matrices`` (m, n, n); the pseudo-inverse of a matrix that is exactly singular."""
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
    """Damped frequency Im(z) / (2 pi), Hz, of eigenvalues in 1/s; 0 for a real root, below 0 for a lower half.

    NaN where there is no eigenvalue, also if only its real part is NaN.
    """
    root = np.asarray(eigenvalues, complex)
    return np.where(np.isnan(root), np.nan, root.imag / (2 * np.pi))


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


def min_damping_ratio(eigenvalues: ArrayLike) -> Array:
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
