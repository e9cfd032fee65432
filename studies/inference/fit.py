"""Maximum a posteriori fits from several starts, and Laplace evidence."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from studies.inference.arrays import Array
from studies.inference.forward import Forward
from studies.inference.minimise import GUIDE, THOROUGH, End, distinct, minimise, spread
from studies.inference.parameter import Candidate, UncertainParameter, together

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
        Whether gradient and step are as small as a minimum asks for; what is not is never judged.
    begins : tuple of ndarray
        Coordinates (p,) from which the fit was tried.
    """

    candidates: tuple[Candidate, ...]
    unknowns: tuple[UncertainParameter, ...]
    theta: Array
    covariance: Array
    residual: Array
    jacobian: Array
    objective: float
    log_evidence: float
    nuisance_scale: float = 1.0
    converged: bool = True
    begins: tuple[Array, ...] = ()

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
            if u.size and abs(x - u.centre) > MOST_SCALES * u.scale / u.widened
        ]

    def negligible(self) -> list[str]:
        """Candidates all of whose sizes are below the least that is worth a name."""
        return [
            c.identifier
            for c in self.candidates
            if any(u.size for u in c.unknowns)
            and all(
                abs(x - u.centre) < u.least
                for u, x in zip(c.unknowns, self.theta[self.columns(c)], strict=True)
                if u.size
            )
        ]

    @property
    def penalty(self) -> float:
        """What of the objective is the prior's: the sum of squares of all coordinates in prior sd, of a fit to all."""
        return self.objective - self.chi2

    @property
    def unusual(self) -> int:
        """How many of the candidates have a size that seldom occurs."""
        return len({name.split(".")[0] for name in self.implausible()})

    @property
    def admissible(self) -> bool:
        """Converged, inside its bounds, no candidate too small for a name; its size may be unusual."""
        return self.converged and not self.at_bound() and not self.negligible()

    @property
    def physical(self) -> bool:
        """Admissible and of a size that occurs."""
        return self.admissible and not self.implausible()

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
    starts: Sequence[Array] | None = None,
    rows: NDArray[np.bool_] | None = None,
    nuisance_scale: float = 1.0,
    turns: tuple[int, int] = THOROUGH,
    patient: bool = False,
) -> Fit:
    """Fit nuisances and candidates.

    Parameters
    ----------
    forward : Forward
    candidates : tuple of Candidate
        What joins the base model.
    starts : sequence of ndarray, shape (p,), optional
        Coordinates from which to begin; the best end is kept. By default those of the candidates.
    rows : ndarray of bool, shape (n,), optional
        What is fitted; all by default.
    nuisance_scale : float
        Factor on the prior sd of the nuisances.
    turns : tuple of int, shape (2,)
        Most iterations, as :func:`studies.inference.minimise.minimise` takes them.
    patient : bool
        Whether each start also goes the way through the easier problems of ``forward``, from the easiest to itself.
    """
    problem = _Problem(candidates, (*forward.nuisances, *(u for c in candidates for u in c.unknowns)), nuisance_scale)
    used = np.ones(len(forward.rows.where), bool) if rows is None else rows
    starts = starts or default_starts(forward, candidates)
    begins = distinct(begin for x in starts for begin in (x, *(problem.guided(forward, x) if patient else ())))
    best = problem.end(forward, begins[0], used, turns)
    for begin in begins[1:]:
        end = problem.end(forward, begin, used, turns, reached=best.objective)
        best = min(best, end, key=lambda end: end.objective)
    return replace(problem.evidence(forward, best, used), begins=tuple(begins))


@dataclass(frozen=True)
class _Problem:
    """What is fitted, in prior sd from the prior mean."""

    candidates: tuple[Candidate, ...]
    unknowns: tuple[UncertainParameter, ...]
    nuisance_scale: float

    @property
    def prior(self) -> tuple[Array, Array]:
        return prior(self.unknowns, self.candidates, self.nuisance_scale)

    @property
    def bounds(self) -> tuple[Array, Array]:
        centre, sd = self.prior
        lower = np.maximum((np.array([u.lowest for u in self.unknowns]) - centre) / sd, -FARTHEST)
        return lower, np.minimum((np.array([u.highest for u in self.unknowns]) - centre) / sd, FARTHEST)

    def end(
        self,
        forward: Forward,
        x: Array,
        used: NDArray[np.bool_],
        turns: tuple[int, int] = THOROUGH,
        *,
        reached: float = math.inf,
    ) -> End:
        centre, sd = self.prior

        def evaluate(z: Array, *, slopes: bool) -> tuple[Array, Array]:
            residual, jacobian = forward.residual(self.candidates, centre + sd * z, slopes=slopes)
            return residual, jacobian * sd if slopes else jacobian

        start = (x - centre) / sd
        return minimise(evaluate, start, *self.bounds, used, turns=turns, eager=forward.thorough, reached=reached)

    def guided(self, forward: Forward, x: Array) -> list[Array]:
        """Where the easier problems lead, each begun where the one before ended; empty where there are none."""
        centre, sd = self.prior
        led = []
        for easier in forward.easier():
            end = self.end(easier, x, np.ones(len(easier.rows.where), bool), GUIDE)
            if not math.isfinite(end.objective):
                continue
            x = centre + sd * end.z
            led.append(x)
        return led[-1:]

    def evidence(self, forward: Forward, end: End, used: NDArray[np.bool_]) -> Fit:
        """The fit at its end; what is not finite gets no evidence at all."""
        centre, sd = self.prior
        z, theta = end.z, centre + sd * end.z
        log_evidence, inverse = -math.inf, np.eye(len(z))
        if math.isfinite(end.objective):
            inverse, volume = spread(end.jacobian[used])
            log_evidence = -(end.objective + volume + forward.log_determinant(self.candidates, theta)) / 2
            gradient = end.jacobian[used].T @ end.residual[used] + z
            for i, u in enumerate(self.unknowns):
                if u.one_sided:
                    log_evidence += _half_normal(z[i] - self.bounds[0][i], gradient[i], inverse[i, i])
        finite = math.isfinite(log_evidence)
        return Fit(
            self.candidates, self.unknowns, theta, inverse * np.outer(sd, sd), end.residual, end.jacobian / sd,
            end.objective if finite else math.inf, log_evidence if finite else -math.inf, self.nuisance_scale,
            finite and end.converged,
        )  # fmt: skip


def default_starts(forward: Forward, candidates: tuple[Candidate, ...]) -> list[Array]:
    """Nuisances at their prior means, with the starts of the ``candidates``: coordinates (p,), several."""
    nominal = np.array([u.centre for u in forward.nuisances])
    most = range(max((len(c.starts) for c in candidates), default=1))
    return [np.concatenate([nominal, *(c.starts[min(k, len(c.starts) - 1)] for c in candidates)]) for k in most]


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
        value = float(residual @ residual + z @ z - gradient @ spread(scaled)[0] @ gradient)
        promised.append(value if math.isfinite(value) else math.inf)
    return min(promised)
