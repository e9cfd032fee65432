"""Bounded Levenberg-Marquardt on |residual|^2 + |z|^2, by orthogonal factors: nothing in it can become singular."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from studies.inference.arrays import Array

THOROUGH, GUIDE, ROUGH = (60, 60), (20, 20), (20, 7)
"""Most iterations of a fit, and of one that is still poor then: to its end, to show the way, to compare many."""

LEAST_DAMPING, MOST_DAMPING = 1e-9, 1e6
EXACT = 1e-3  # decrease of the objective that one more step promises, below which a fit has converged
TINY = 1e-9  # that no step is worth
RELATIVE = 1e-5  # the same in shares of the objective
POOR_DECREMENT = 1e-2  # a fit that is poor anyway is not polished beyond a per cent, but where it must converge
POOR_CHI2 = 10.0  # objective a row beyond which a fit is poor

Evaluate = Callable[..., tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class End:
    """Where a fit ended.

    Attributes
    ----------
    z : ndarray, shape (p,)
        In prior sd from the prior mean.
    objective : float
        Infinite where nothing finite was found.
    residual, jacobian : ndarray
        Of all rows, (n,) and (n, p).
    decrement : float
        Decrease of the objective that one more Gauss-Newton step promises.
    """

    z: Array
    objective: float
    residual: Array
    jacobian: Array
    decrement: float

    @property
    def converged(self) -> bool:
        """Whether gradient and step are as small as a minimum asks for."""
        return self.decrement <= small(self.objective)


def small(objective: float) -> float:
    """Decrease of an ``objective`` (a sum of squares) that counts as none."""
    return max(EXACT, RELATIVE * objective)


def minimise(
    evaluate: Evaluate,
    z: Array,
    lower: Array,
    upper: Array,
    used: NDArray[np.bool_],
    *,
    turns: tuple[int, int] = THOROUGH,
) -> End:
    """Levenberg-Marquardt on |residual[used]|^2 + |z|^2 within bounds.

    A coordinate at a bound that the gradient pushes outward is held there (projected Newton). Steps are least-squares
    solutions of [jacobian; 1] step = -[residual; z], never of the normal equations.

    Parameters
    ----------
    evaluate : callable
        (z, whether derivatives are wanted) -> residual (n,), derivative (n, p).
    z, lower, upper : ndarray, shape (p,)
        Start and bounds, in prior sd from the prior mean.
    used : ndarray of bool, shape (n,)
    turns : tuple of int, shape (2,)
        Most iterations, in all and of a fit that is still poor then; it is not converged where they do not suffice.
    """
    z = np.clip(z, lower, upper)
    residual, jacobian = evaluate(z, slopes=True)
    objective, damping, decrement = _objective(residual, z, used), 1e-3, np.inf
    for turn in range(turns[0]):
        if not (np.isfinite(objective) and np.isfinite(jacobian[used]).all()):
            return End(z, np.inf, residual, jacobian, np.inf)
        gradient = jacobian[used].T @ residual[used] + z
        held = ((z <= lower) & (gradient > 0)) | ((z >= upper) & (gradient < 0))
        free = np.flatnonzero(~held)
        if not len(free):
            return End(z, objective, residual, jacobian, 0.0)
        factor = qr(np.vstack([jacobian[np.ix_(used, free)], np.eye(len(z))[:, free]]), mode="r", check_finite=False)
        triangle = factor[0][: len(free)]
        promised = solve_triangular(triangle, gradient[free], trans="T", check_finite=False)
        decrement = float(promised @ promised)
        poor = turns != THOROUGH and objective > POOR_CHI2 * used.sum()
        if not np.isfinite(decrement) or (poor and decrement <= POOR_DECREMENT * objective) or decrement < TINY:
            break
        if poor and turn >= turns[1]:
            break
        last = decrement <= small(objective)  # its step is still taken: the next decrement is smaller by far
        size = np.sqrt((triangle**2).sum(0))
        improved = False
        while damping < MOST_DAMPING:
            trial = z.copy()
            trial[free] -= _step(triangle, promised, np.sqrt(damping) * size)
            trial = np.clip(trial, lower, upper)
            new = _objective(evaluate(trial, slopes=False)[0], trial, used)
            if new < objective:
                improved, z, objective = True, trial, new
                residual, jacobian = evaluate(z, slopes=True)
                damping = max(damping / 10, LEAST_DAMPING)
                break
            damping *= 10
        if last or not improved:
            break
    return End(z, objective, residual, jacobian, decrement)


def spread(jacobian: Array) -> tuple[Array, float]:
    """Inverse of 1 + jacobian' jacobian (p, p), and the logarithm of its determinant with the sign turned.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        In prior sd.
    """
    if not np.isfinite(jacobian).all():
        return np.eye(jacobian.shape[1]), np.inf
    triangle = qr(jacobian, mode="r", check_finite=False)[0][: jacobian.shape[1]]
    _, s, axes = np.linalg.svd(triangle)
    gain = np.zeros(jacobian.shape[1])
    gain[: len(s)] = s**2
    return (axes.T / (1 + gain)) @ axes, float(np.log1p(gain).sum())


def _objective(residual: Array, z: Array, used: NDArray[np.bool_]) -> float:
    kept = residual[used]
    value = float(kept @ kept + z @ z)
    return value if np.isfinite(value) else np.inf


def _step(triangle: Array, promised: Array, damping: Array) -> Array:
    """Step (p,) of the damped least squares: ``damping`` (p,) below the ``triangle`` (p, p) of the undamped one."""
    p = len(promised)
    q, r = qr(np.vstack([triangle, np.diag(damping)]), mode="economic", check_finite=False)
    return np.asarray(solve_triangular(r, q[:p].T @ promised, check_finite=False))
