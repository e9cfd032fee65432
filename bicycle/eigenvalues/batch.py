"""Many bicycles of one kind at once: coefficient matrices, state matrices and crossings of the axis, batched."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.derivation.evaluation import Evaluator
from bicycle.eigenvalues.solvers import Solver, compiled, default_solver
from bicycle.linear_model import LinearModel
from tyre.base.arrays import Array, Complex

BLOCK = 1024  # eigenvalues at a time: what is multiplied stays in the cache
NEWTON_STEPS = 25
LONGEST_STEP = 0.1  # of the speed


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Scaled state matrices A(v) = sum v^k A_k of m bicycles: ``powers`` k -> (m, n, n).

    ``refused`` (m,) marks bicycles whose mass matrix is not positive definite.
    """

    powers: Mapping[int, Array]
    refused: NDArray[np.bool_]


def coefficients(
    linear: LinearModel,
    evaluate: Evaluator,
    values: Mapping[str, Any],
    count: int,
    *,
    solver: Solver | None = None,
) -> Coefficients:
    """Coefficient matrices of ``count`` bicycles from parameters that are numbers or arrays (count,), SI.

    ``linear`` is the model of any of them and gives the scaling of the states; the equations must not switch.
    ``solver`` as in :func:`bicycle.eigenvalues.solvers.eigenvalues`.
    """
    matrices = evaluate(values)
    n = linear.order
    mass = np.broadcast_to(matrices.mass, (count, n, n))
    parts = tuple(np.broadcast_to(matrix, (count, n, n)) for matrix in matrices.dynamics.values())
    if (solver or default_solver()) is compiled:
        from bicycle.eigenvalues.pencil_kernel import reduce_pencil

        solved, refused = np.empty((len(parts), count, n, n)), np.empty(count, bool)
        reduce_pencil(
            np.ascontiguousarray(mass), tuple(map(np.ascontiguousarray, parts)), linear.scale, solved, refused
        )
        return Coefficients(dict(zip(matrices.dynamics, solved, strict=True)), refused)
    refused = ~_positive_definite(mass)
    if refused.any():
        mass = np.where(refused[:, None, None], np.eye(n), mass)
    right = np.concatenate([part * linear.scale for part in parts], -1)
    found = np.split(np.linalg.solve(mass, right) / linear.scale[:, None], len(parts), axis=-1)
    return Coefficients(dict(zip(matrices.dynamics, found, strict=True)), refused)


def no_mass(evaluate: Evaluator, values: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
    """Bicycles (count,) whose mass matrix is not positive definite; ``values`` as in :func:`coefficients`."""
    with np.errstate(all="ignore"):
        mass = evaluate(values, (0.0,) * len(evaluate.symbolic.switches)).mass
    mass = np.broadcast_to(mass, (count, *mass.shape[-2:]))
    finite = np.asarray(np.isfinite(mass).all((-2, -1)))
    return ~_positive_definite(np.where(finite[:, None, None], mass, np.eye(mass.shape[-1]))) | ~finite


def state_matrices(found: Coefficients, speeds: Array) -> Array:
    """State matrices of m bicycles at speeds (m, k) or (1, k), m/s; shape (m, k, n, n)."""
    total: Any = 0.0
    for power, matrix in found.powers.items():
        weight = np.power(speeds, float(power))[..., None, None] if power else 1.0
        total = total + weight * matrix[:, None]
    shape = (len(total), speeds.shape[-1], *total.shape[-2:])
    return np.asarray(np.broadcast_to(total, shape))


def _positive_definite(mass: Array) -> NDArray[np.bool_]:
    symmetric = (mass + mass.swapaxes(-1, -2)) / 2
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.eigvalsh(symmetric)[..., 0] > 0)
    return np.ones(len(mass), bool)


def with_slopes(found: Coefficients, speeds: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (m, n) of m bicycles at a speed each (m,), and d(eigenvalue)/dv = u A'(v) x of unit u x."""
    matrices = state_matrices(found, speeds[:, None])[:, 0]
    values, right = np.linalg.eig(matrices)
    derivative: Any = sum(
        power * np.power(speeds, float(power - 1))[:, None, None] * matrix
        for power, matrix in found.powers.items()
        if power
    )
    left = np.linalg.inv(right)
    return values.astype(complex), ((left @ derivative).swapaxes(1, 2) * right).sum(1).astype(complex)


def follow_crossing(
    found: Coefficients, speeds: Array, angular_frequency: Array, *, destabilising: bool
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Where the root near i ``angular_frequency`` (rad/s) crosses the imaginary axis, by Newton from ``speeds`` (m,).

    Returns
    -------
    speeds, angular_frequency : ndarray, shape (m,)
        m/s and rad/s.
    there : ndarray of bool, shape (m,)
        False where no such crossing in the same direction was reached.
    """
    v, root = speeds.copy(), 1j * angular_frequency
    size, here, slope = np.zeros(len(v)), np.zeros(len(v), complex), np.zeros(len(v), complex)
    moving = np.arange(len(v))
    for _ in range(NEWTON_STEPS):
        some = Coefficients({power: matrix[moving] for power, matrix in found.powers.items()}, found.refused[moving])
        values, slopes = with_slopes(some, v[moving])
        at = np.abs(values - root[moving, None]).argmin(1)[:, None]
        here[moving], slope[moving] = (np.take_along_axis(part, at, 1)[:, 0] for part in (values, slopes))
        size[moving] = np.abs(values).max(1)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -here[moving].real / slope[moving].real
        longest = LONGEST_STEP * v[moving]
        step = np.where(np.isfinite(step), np.clip(step, -longest, longest), 0.0)
        v[moving], root[moving] = v[moving] + step, here[moving] + slope[moving] * step
        moving = moving[np.abs(step) > 1e-13 * v[moving]]
        if not moving.size:
            break
    kind = np.where(angular_frequency > 0, here.imag > 1e-9 * size, np.abs(here.imag) <= 1e-9 * size)
    there = kind & (np.abs(here.real) <= 1e-9 * size) & ((slope.real > 0) == destabilising)
    return v, np.abs(here.imag), there


def eigenvalue_derivative_terms(left: Complex, right: Complex, terms: Sequence[tuple[Any, Array]]) -> Complex:
    """Sum over terms of weight u M_p x for k eigenvalues and p parameters: one real matrix product for all of them.

    Parameters
    ----------
    left, right : ndarray, shape (k, n)
        Left and right eigenvector of each eigenvalue.
    terms : sequence of (weight, matrices)
        Weights (k,), and real matrices (p, n, n); only places where some matrix is not zero cost anything.
        Small as it is, the product is quicker in one BLAS thread (:func:`tyre.base.blas.one_blas_thread`).

    Returns
    -------
    ndarray, shape (k, p)
    """
    places = [np.nonzero((stack != 0).any(0)) for _, stack in terms]
    table = np.concatenate([stack[:, i, j].T for (_, stack), (i, j) in zip(terms, places, strict=True)])
    result = np.empty((len(left), len(terms[0][1])), complex)
    for start in range(0, len(left), BLOCK):
        k = slice(start, start + BLOCK)
        products = np.concatenate(
            [
                (weight[k, None] * left[k][:, i]) * right[k][:, j]
                for (weight, _), (i, j) in zip(terms, places, strict=True)
            ],
            -1,
        )
        result[k].real = np.ascontiguousarray(products.real) @ table
        result[k].imag = np.ascontiguousarray(products.imag) @ table
    return result
