"""Bounded Levenberg-Marquardt on |residual|^2 + |z|^2, by orthogonal factors: nothing in it can become singular.

Steps are bent by geodesic acceleration (Transtrum & Sethna 2012, arXiv:1201.5885): the valleys of these problems are
long and curved, and straight steps have to be short there.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular
from scipy.linalg.lapack import dgeqrt

from studies.inference.arrays import Array

THOROUGH, GUIDE, ROUGH = (60, 60), (20, 20), (20, 7)
"""Most iterations of a fit, and of one that is still poor then: to its end, to show the way, to compare many."""

LEAST_DAMPING, MOST_DAMPING = 1e-9, 1e6
EXACT = 1e-3  # decrease of the objective that one more step promises, below which a fit has converged
TINY = 1e-9  # that no step is worth
RELATIVE = 1e-5  # the same in shares of the objective
SETTLED = 0.1  # share of what counts as none: more of it left after a step shows a valley, not a minimum
GOOD, BAD = 0.75, 0.25  # decrease over that of the linear model: the damping falls above the one, rises below the other
PROBE = 0.1  # of a step: where the second derivative along it is taken
MOST_BENT = (
    0.75  # twice the acceleration over the step, in the metric of the damping: a step that bends more is straight
)
POOR_DECREMENT = 1e-2  # a fit that is poor anyway is not polished beyond a per cent, but where it must converge
POOR_CHI2 = 10.0  # objective a row beyond which a fit is poor
BEATEN = 1.5  # times what another start has reached, above which a fit that stalls is given up
STALLED, SLOW = 8, 0.9  # turns in which it must fall below this share
PANEL = 8  # columns that are factored at once: LAPACK's own choice takes narrow matrices column by column
WEDGED, CREEP = 4, 0.05  # turns that gained less than this share of what one step promises, beside what is not finite

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


@np.errstate(invalid="ignore", over="ignore")  # what is not finite is judged below, and never a minimum
def minimise(
    evaluate: Evaluate,
    z: Array,
    lower: Array,
    upper: Array,
    used: NDArray[np.bool_],
    *,
    turns: tuple[int, int] = THOROUGH,
    eager: bool = False,
    reached: float = np.inf,
) -> End:
    """Levenberg-Marquardt on |residual[used]|^2 + |z|^2 within bounds.

    A coordinate at a bound that the gradient pushes outward is held there (projected Newton). Steps are least-squares
    solutions of [jacobian; 1] step = -[residual; z], never of the normal equations. The damping is a thousandth at
    first and rises tenfold where a step lowers nothing (Marquardt 1963, J. Soc. Indust. Appl. Math. 11, 431-441).

    Parameters
    ----------
    evaluate : callable
        (z, whether derivatives are wanted) -> residual (n,), derivative (n, p).
    z, lower, upper : ndarray, shape (p,)
        Start and bounds, in prior sd from the prior mean.
    used : ndarray of bool, shape (n,)
    turns : tuple of int, shape (2,)
        Most iterations, in all and of a fit that is still poor then; it is not converged where they do not suffice.
    eager : bool
        Whether derivatives are cheap beside the residual: they are then taken with each trial, not after it.
    reached : float
        Objective that another start has reached, a sum of squares without unit: a fit that stalls far above it ends.
    """
    rows = slice(None) if used.all() else used  # a mask copies
    z = np.clip(z, lower, upper)
    residual, jacobian = evaluate(z, slopes=True)
    objective, damping, decrement = _objective(residual[rows], z), 1e-3, np.inf
    near = as_promised = fallen = False  # as_promised: the last step gained what a whole one promises
    past: list[float] = []
    for turn in range(turns[0]):
        if not (np.isfinite(objective) and np.isfinite(jacobian[rows]).all()):
            return End(z, np.inf, residual, jacobian, np.inf)
        gradient = jacobian[rows].T @ residual[rows] + z
        held = ((z <= lower) & (gradient > 0)) | ((z >= upper) & (gradient < 0))
        free = np.flatnonzero(~held)
        if not len(free):
            return End(z, objective, residual, jacobian, 0.0)
        data = _triangle(jacobian[rows] if len(free) == len(z) else jacobian[rows][:, free])
        triangle = _triangle(np.vstack([data, np.eye(len(free))]))
        promised = solve_triangular(triangle, gradient[free], trans="T", check_finite=False)
        decrement = float(promised @ promised)
        poor = turns != THOROUGH and objective > POOR_CHI2 * used.sum()
        if not np.isfinite(decrement) or (poor and decrement <= POOR_DECREMENT * objective) or decrement < TINY:
            break
        if poor and turn >= turns[1]:
            break
        past.append(objective)
        if objective > BEATEN * reached and turn >= STALLED and objective > SLOW * past[-1 - STALLED]:
            break
        crept = turn >= WEDGED and past[-1 - WEDGED] - objective < CREEP * decrement
        if crept and fallen and decrement > small(objective):
            break
        valley, near = near, decrement <= small(objective)
        last = decrement <= SETTLED * small(objective)
        if last and valley:
            break
        size = np.sqrt((triangle**2).sum(0))
        improved = False
        while damping < MOST_DAMPING:
            damped = qr(np.vstack([triangle, np.diag(np.sqrt(damping) * size)]), mode="economic", check_finite=False)
            step = _step(damped, promised)
            expected = decrement - float(((promised - triangle @ step) ** 2).sum())
            straight = np.zeros(len(z))
            straight[free] = -step
            trial = z + straight
            if valley or not (near or as_promised):
                probe = np.clip(z + PROBE * straight, lower, upper)
                further = evaluate(probe, slopes=False)[0][rows]
                bend = 2 / PROBE**2 * (further - residual[rows] - jacobian[rows] @ (probe - z))
                trial[free] += _acceleration(damped[1], (jacobian[rows].T @ bend)[free], size, step)
            trial = np.clip(trial, lower, upper)
            tried = evaluate(trial, slopes=eager)
            new = _objective(tried[0][rows], trial)
            fallen = fallen or not np.isfinite(new)
            if new < objective:
                gained = objective - new
                improved, z, objective = True, trial, new
                if last and as_promised:  # slopes no longer change
                    residual = tried[0]
                    break
                as_promised = gained > GOOD * decrement
                residual, jacobian = tried if eager else evaluate(z, slopes=True)
                if gained > GOOD * expected:
                    damping = max(damping / 10, LEAST_DAMPING)
                elif gained < BAD * expected:
                    damping *= 3
                break
            damping *= 10
        if last or not improved:
            break
    return End(z, objective, residual, jacobian, decrement)


def distinct(points: Iterable[Array], known: Sequence[Array] = ()) -> list[Array]:
    """The ``points`` (p,) without repetitions and without those ``known``: from one place there is one way."""
    found: list[Array] = []
    for x in points:
        if not any(np.array_equal(x, other) for other in (*known, *found)):
            found.append(x)
    return found


def spread(jacobian: Array) -> tuple[Array, float]:
    """Inverse of 1 + jacobian' jacobian (p, p), and the logarithm of its determinant with the sign turned.

    Parameters
    ----------
    jacobian : ndarray, shape (n, p)
        In prior sd.
    """
    if not np.isfinite(jacobian).all():
        return np.eye(jacobian.shape[1]), np.inf
    triangle = _triangle(jacobian)
    _, s, axes = np.linalg.svd(triangle)
    gain = np.zeros(jacobian.shape[1])
    gain[: len(s)] = s**2
    return (axes.T / (1 + gain)) @ axes, float(np.log1p(gain).sum())


def _triangle(matrix: Array) -> Array:
    """R of the orthogonal factors of a ``matrix`` (n, p), without the rows of zeros."""
    if not matrix.size:
        return np.zeros((min(matrix.shape), matrix.shape[1]))
    return np.asarray(np.triu(dgeqrt(min(PANEL, *matrix.shape), matrix)[0][: matrix.shape[1]]))


def _objective(kept: Array, z: Array) -> float:
    value = float(kept @ kept + z @ z)
    return value if np.isfinite(value) else np.inf


def _step(damped: tuple[Array, Array], promised: Array) -> Array:
    """Step (p,) of the damped least squares, by the orthogonal factors of triangle and damping below each other."""
    q, r = damped
    return np.asarray(solve_triangular(r, q[: len(promised)].T @ promised, check_finite=False))


def _acceleration(damped: Array, force: Array, size: Array, step: Array) -> Array:
    """Half the acceleration (p,) along a ``step``, by the ``damped`` triangle (p, p); zero where it is large.

    ``force`` (p,) is jacobian' times the second derivative of the residual along the step, ``size`` (p,) the metric.
    """
    if not np.isfinite(force).all():
        return np.zeros(len(step))
    turned = solve_triangular(damped, force, trans="T", check_finite=False)
    bent = -np.asarray(solve_triangular(damped, turned, check_finite=False))
    if 2 * np.linalg.norm(size * bent) > MOST_BENT * np.linalg.norm(size * step):
        return np.zeros(len(step))
    return bent / 2
