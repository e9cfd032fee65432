"""Maximum a posteriori fits by Levenberg-Marquardt with bounds, and Laplace evidence."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from studies.inference.arrays import Array
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate, UncertainParameter, together

ITERATIONS = 40
MOST_DAMPING = 1e6
SMALLEST_GAIN = 1e-5  # relative decrease of the objective below which a fit has ended
POOR_CHI2, POOR_GAIN = 10.0, 1e-2  # a fit with chi^2 of ten a row is not polished beyond a per cent
MOST_SCALES = 3.0  # prior sd of a size that occurs
FARTHEST = 100.0  # prior sd: no fit comes near, but a trial step may overflow beyond
AT_BOUND = 1e-9


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis fitted to the data.

    Attributes
    ----------
    candidates, unknowns : tuples
        What was added, and everything that floated.
    theta, covariance : ndarray
        Coordinates (p,) and their posterior covariance (p, p).
    residual, jacobian : ndarray
        Whitened, of all rows (n,), (n, p).
    objective : float
        |residual|^2 of the fitted rows plus the prior penalty.
    log_evidence : float
        Laplace, without the constant that all hypotheses share.
    nuisance_scale : float
        Factor on the prior sd of the nuisances.
    converged : bool
        Whether it ended at an optimum.
    """

    candidates: tuple[Candidate, ...]
    unknowns: tuple[UncertainParameter, ...]
    theta: Array
    covariance: Array
    residual: Array
    jacobian: Array
    objective: float
    log_evidence: float
    nuisance_scale: float = field(default=1.0)
    converged: bool = True

    @property
    def name(self) -> str:
        """Identifiers joined by +."""
        return together(self.candidates)

    @property
    def identifiers(self) -> frozenset[str]:
        """Of the candidates."""
        return frozenset(candidate.identifier for candidate in self.candidates)

    @property
    def chi2(self) -> float:
        """|residual|^2."""
        return float(self.residual @ self.residual)

    @property
    def effect_columns(self) -> slice:
        """Where the unknowns of the candidates stand."""
        return slice(len(self.unknowns) - sum(len(c.unknowns) for c in self.candidates), len(self.unknowns))

    def columns(self, candidate: Candidate) -> slice:
        """Where the unknowns of one candidate stand."""
        start = self.effect_columns.start
        for other in self.candidates:
            if other.identifier == candidate.identifier:
                return slice(start, start + len(other.unknowns))
            start += len(other.unknowns)
        raise KeyError(candidate.identifier)

    def implausible(self) -> list[str]:
        """Sizes of effects beyond three prior sd: one and a half times the upper end of the typical range."""
        return [
            f"{c.identifier}.{u.name}"
            for c in self.candidates
            for u, x in zip(c.unknowns, self.theta[self.columns(c)], strict=True)
            if u.size and abs(x - u.centre) > MOST_SCALES * u.scale
        ]

    @property
    def physical(self) -> bool:
        """Inside its bounds and of a size that occurs."""
        return not self.at_bound() and not self.implausible()

    def at_bound(self) -> list[str]:
        """Sizes of effects that ended at a bound."""
        names = []
        for candidate in self.candidates:
            columns = self.columns(candidate)
            for u, x in zip(candidate.unknowns, self.theta[columns], strict=True):
                near = 1e-3 * u.scale
                if u.size and (x <= u.lowest + near or x >= u.highest - near):
                    names.append(f"{candidate.identifier}.{u.name}")
        return names


def prior(
    unknowns: tuple[UncertainParameter, ...], candidates: tuple[Candidate, ...], scale: float
) -> tuple[Array, Array]:
    """Centre and standard deviation (p,) of the coordinates.

    Parameters
    ----------
    unknowns : tuple of UncertainParameter
        Nuisances, then those of the candidates.
    candidates : tuple of Candidate
    scale : float
        Factor on the standard deviations of the nuisances.
    """
    centre = np.array([u.centre for u in unknowns])
    sd = np.array([u.scale for u in unknowns])
    sd[: len(unknowns) - sum(len(c.unknowns) for c in candidates)] *= scale
    return centre, sd


def fit(
    forward: Forward,
    candidates: tuple[Candidate, ...] = (),
    *,
    starts: list[Array] | None = None,
    rows: NDArray[np.bool_] | None = None,
    nuisance_scale: float = 1.0,
) -> Fit:
    """Fit nuisances and candidates.

    Parameters
    ----------
    forward : Forward
    candidates : tuple of Candidate
        What joins the base model.
    starts : list of ndarray, shape (p,), optional
        Coordinates from which to begin; the best end is kept. By default those of the candidates.
    rows : ndarray of bool, shape (n,), optional
        What is fitted; all by default.
    nuisance_scale : float
        Factor on the prior sd of the nuisances.
    """
    unknowns = (*forward.nuisances, *(u for c in candidates for u in c.unknowns))
    centre, sd = prior(unknowns, candidates, nuisance_scale)
    lower = np.maximum((np.array([u.lowest for u in unknowns]) - centre) / sd, -FARTHEST)
    upper = np.minimum((np.array([u.highest for u in unknowns]) - centre) / sd, FARTHEST)
    used = np.ones(len(forward.rows.where), bool) if rows is None else rows

    def evaluate(z: Array, *, slopes: bool) -> tuple[Array, Array]:
        residual, jacobian = forward.residual(candidates, centre + sd * z, slopes=slopes)
        return residual, jacobian * sd if slopes else jacobian

    best = None
    for x in starts or _starts(forward, candidates):
        end = minimise(evaluate, (x - centre) / sd, lower, upper, used)
        if best is None or end[1] < best[1] or not math.isfinite(best[1]):
            best = end
    assert best is not None
    z, objective, residual, jacobian = best
    kept = jacobian[used]
    hessian = kept.T @ kept + np.eye(len(z))
    inverse = np.linalg.inv(hessian)
    with np.errstate(invalid="ignore"):
        log_evidence = -objective / 2 - float(np.linalg.slogdet(hessian)[1]) / 2
    log_evidence -= forward.log_determinant(candidates, centre + sd * z) / 2
    gradient = kept.T @ residual[used] + z
    for i, u in enumerate(unknowns):
        if u.one_sided:
            log_evidence += _half_normal(z[i] - lower[i], gradient[i], inverse[i, i])
    if not np.isfinite(log_evidence):  # every start fell over
        log_evidence, objective = -math.inf, math.inf
    return Fit(
        candidates, unknowns, centre + sd * z, inverse * np.outer(sd, sd), residual, jacobian / sd, objective,
        log_evidence, nuisance_scale,
    )  # fmt: skip


def _starts(forward: Forward, candidates: tuple[Candidate, ...]) -> list[Array]:
    nominal = np.array([u.centre for u in forward.nuisances])
    longest = max((len(c.starts) for c in candidates), default=1)
    return [
        np.concatenate([nominal, *(c.starts[min(k, len(c.starts) - 1)] for c in candidates)]) for k in range(longest)
    ]


def _half_normal(distance: float, gradient: float, variance: float) -> float:
    """Correction of the evidence for a coordinate that is cut off at its neutral value, ``distance`` away."""
    push = max(gradient, 0.0) if distance < AT_BOUND else 0.0
    root = math.sqrt(variance)
    return math.log(2) + push**2 * variance / 2 + float(log_ndtr(distance / root - push * root))


def outlook(forward: Forward, parent: Fit, candidate: Candidate) -> float:
    """Objective that one Gauss-Newton step promises when a candidate joins a fitted hypothesis: a cheap preview.

    Parameters
    ----------
    forward : Forward
    parent : Fit
    candidate : Candidate
        None of the parent's own.
    """
    joined = (*parent.candidates, candidate)
    centre, sd = prior((*parent.unknowns, *candidate.unknowns), joined, 1.0)
    promised = []
    for start in candidate.first_starts:
        theta = np.concatenate([parent.theta, start])
        residual, jacobian = forward.residual(joined, theta)
        z, scaled = (theta - centre) / sd, jacobian * sd
        gradient = scaled.T @ residual + z
        hessian = scaled.T @ scaled + np.eye(len(z))
        promised.append(float(residual @ residual + z @ z - gradient @ np.linalg.solve(hessian, gradient)))
    return min(promised)


Evaluate = Callable[..., tuple[Array, Array]]


def minimise(
    evaluate: Evaluate, z: Array, lower: Array, upper: Array, used: NDArray[np.bool_]
) -> tuple[Array, float, Array, Array]:
    """Levenberg-Marquardt on |residual[used]|^2 + |z|^2 within bounds.

    A coordinate at a bound that the gradient pushes outward is held there (projected Newton).

    Parameters
    ----------
    evaluate : callable
        (z, whether derivatives are wanted) -> residual (n,), derivative (n, p).
    z, lower, upper : ndarray, shape (p,)
        Start and bounds, in prior sd from the prior mean.
    used : ndarray of bool, shape (n,)

    Returns
    -------
    z, objective, residual, jacobian
        Where it ended; residual and jacobian of all rows.
    """
    z = np.clip(z, lower, upper)
    residual, jacobian = evaluate(z, slopes=True)
    objective = float(residual[used] @ residual[used] + z @ z)
    damping = 1e-3
    for _ in range(ITERATIONS):
        kept = jacobian[used]
        gradient = kept.T @ residual[used] + z
        hessian = kept.T @ kept + np.eye(len(z))
        held = ((z <= lower) & (gradient > 0)) | ((z >= upper) & (gradient < 0))
        free = np.flatnonzero(~held)
        improved = 0.0
        if not np.isfinite(gradient).all():
            break
        while damping < MOST_DAMPING:
            step = np.zeros_like(z)
            damped = hessian[np.ix_(free, free)] + damping * np.diag(hessian.diagonal()[free])
            step[free] = -np.linalg.solve(damped, gradient[free])
            trial = np.clip(z + step, lower, upper)
            new_residual, _ = evaluate(trial, slopes=False)
            new = float(new_residual[used] @ new_residual[used] + trial @ trial)
            if np.isfinite(new) and new <= objective:
                improved = objective - new
                z, objective = trial, new
                residual, jacobian = evaluate(z, slopes=True)
                damping = max(damping / 10, 1e-9)
                break
            damping *= 10
        if improved < (SMALLEST_GAIN if objective < POOR_CHI2 * used.sum() else POOR_GAIN) * (1 + objective):
            break
    return z, objective, residual, jacobian
