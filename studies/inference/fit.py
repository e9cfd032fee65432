"""Maximum a posteriori fits from several starts by a bounded Levenberg-Marquardt, and Laplace evidence.

Steps are found by orthogonal factors, in which nothing can become singular, and bent by geodesic acceleration
(Transtrum & Sethna 2012, arXiv:1201.5885): the valleys of these problems are long and curved, and straight steps have
to be short there.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular
from scipy.linalg.lapack import dgeqrt
from scipy.special import chdtrc, log_ndtr

from studies.inference.kind import Kind
from studies.inference.parameter import Array, Candidate, UncertainParameter, hypothesis_name, slopes_of, values_of
from studies.inference.rules import RULES

THOROUGH, GUIDE, ROUGH = (60, 60), (20, 20), (20, 7)
"""Most iterations of a fit, and of one that is still poor then: to its end, to show the way, to compare many."""

LIGHTER = (1e-3, 3e-2)  # shares of a misfit that count at first, where a start is far off
PATIENCE = {100.0: 5, 1.5: 8}
"""Times the objective reached elsewhere, above which a fit is given up -> after so many iterations of 10 % in all."""
PROBE = 0.1  # of a step: where the second derivative along it is taken

Evaluate = Callable[..., tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class End:
    """End of a fit: coordinates in prior sd from the prior mean, objective (infinite if nothing finite was found),
    residual (n,) and jacobian (n, p) of all rows, and the decrease that one more Gauss-Newton step promises."""

    z: Array  # (p,), in prior sd from the prior mean
    objective: float
    residual: Array
    jacobian: Array
    decrement: float  # of the objective, by one more Gauss-Newton step

    @property
    def converged(self) -> bool:
        """Gradient and step are as small as a minimum asks for."""
        return self.decrement <= negligible_decrease(self.objective)


def negligible_decrease(objective: float) -> float:
    """Decrease of an ``objective`` (a sum of squares) that is treated as none."""
    return max(1e-3, 1e-5 * objective)


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
    """
    rows = slice(None) if used.all() else used  # a mask copies
    z = np.clip(z, lower, upper)
    residual, jacobian = evaluate(z, slopes=True)
    objective, damping, decrement = _objective(residual[rows], z), 1e-3, np.inf
    small_promise = as_promised = fallen = False  # as_promised: the last step gained what a whole one promises
    past: list[float] = []
    for _ in range(turns[0]):
        if not (np.isfinite(objective) and np.isfinite(jacobian[rows]).all()):
            return End(z, np.inf, residual, jacobian, np.inf)
        gradient = jacobian[rows].T @ residual[rows] + z
        at_bound = ((z <= lower) & (gradient > 0)) | ((z >= upper) & (gradient < 0))
        free = np.flatnonzero(~at_bound)
        if not len(free):
            return End(z, objective, residual, jacobian, 0.0)
        data = _triangle(jacobian[rows] if len(free) == len(z) else jacobian[rows][:, free])
        triangle = _triangle(np.vstack([data, np.eye(len(free))]))
        promised = solve_triangular(triangle, gradient[free], trans="T", check_finite=False)
        decrement = float(promised @ promised)
        past.append(objective)
        if _given_up(past, decrement, turns, int(used.sum()), reached, fallen=fallen):
            break
        # a promise as small as a minimum's after such a one was a slow beginning: a valley, not a minimum
        valley, small_promise = small_promise, decrement <= negligible_decrease(objective)
        last = decrement <= 0.1 * negligible_decrease(objective)
        if last and valley:
            break
        size = np.sqrt((triangle**2).sum(0))
        improved = False
        while damping < 1e6:
            damped = qr(np.vstack([triangle, np.diag(np.sqrt(damping) * size)]), mode="economic", check_finite=False)
            step = solve_triangular(damped[1], damped[0][: len(promised)].T @ promised, check_finite=False)
            expected = decrement - float(((promised - triangle @ step) ** 2).sum())
            straight = np.zeros(len(z))
            straight[free] = -step
            trial = z + straight
            if valley or not (small_promise or as_promised):
                probe = np.clip(z + PROBE * straight, lower, upper)
                probe_residual = evaluate(probe, slopes=False)[0][rows]
                bend = 2 / PROBE**2 * (probe_residual - residual[rows] - jacobian[rows] @ (probe - z))
                trial[free] += _acceleration(damped[1], (jacobian[rows].T @ bend)[free], size, step)
            trial = np.clip(trial, lower, upper)
            evaluated = evaluate(trial, slopes=eager)
            new = _objective(evaluated[0][rows], trial)
            fallen = fallen or not np.isfinite(new)
            if new < objective:
                gained = objective - new
                improved, z, objective = True, trial, new
                if last and as_promised:  # slopes no longer change
                    residual = evaluated[0]
                    break
                as_promised = gained > 0.75 * decrement
                residual, jacobian = evaluated if eager else evaluate(z, slopes=True)
                if gained > 0.75 * expected:
                    damping = max(damping / 10, 1e-9)
                elif gained < 0.25 * expected:
                    damping *= 3
                break
            damping *= 10
        if last or not improved:
            break
    return End(z, objective, residual, jacobian, decrement)


def _given_up(
    past: Sequence[float], decrement: float, turns: tuple[int, int], count: int, reached: float, *, fallen: bool
) -> bool:
    """No further step is worth its time: it promises nothing, or the fit is poor and stalls."""
    turn, objective = len(past) - 1, past[-1]
    poor = turns != THOROUGH and objective > 10.0 * count
    if not np.isfinite(decrement) or decrement < 1e-9 or (poor and decrement <= 1e-2 * objective):
        return True
    if poor and turn >= turns[1]:
        return True
    patience = next((few for times, few in PATIENCE.items() if objective > times * reached), None)
    if patience is not None and turn >= patience and objective > 0.9 * past[-1 - patience]:
        return True
    # four turns gained next to nothing of what one step promises, beside values that are not finite
    crept = turn >= 4 and past[-5] - objective < 0.05 * decrement
    return crept and fallen and decrement > negligible_decrease(objective)


def drop_repeats(points: Iterable[Array]) -> list[Array]:
    """Drop repeated ``points`` (p,): from one place there is one way."""
    distinct: list[Array] = []
    for point in points:
        if not any(np.array_equal(point, earlier) for earlier in distinct):
            distinct.append(point)
    return distinct


def spread(jacobian: Array) -> tuple[Array, float]:
    """Inverse of 1 + jacobian' jacobian (p, p), and ln det of that matrix; ``jacobian`` (n, p) in prior sd."""
    if not np.isfinite(jacobian).all():
        return np.eye(jacobian.shape[1]), np.inf
    _, s, axes = np.linalg.svd(_triangle(jacobian))
    gain = np.zeros(jacobian.shape[1])
    gain[: len(s)] = s**2
    return (axes.T / (1 + gain)) @ axes, float(np.log1p(gain).sum())


def _triangle(matrix: Array) -> Array:
    """R of the orthogonal factors of a ``matrix`` (n, p), without the rows of zeros."""
    if not matrix.size:
        return np.zeros((min(matrix.shape), matrix.shape[1]))
    # panels of 8 columns: LAPACK's own choice takes narrow matrices column by column
    factors = dgeqrt(min(8, *matrix.shape), matrix)[0][: matrix.shape[1]]
    return np.where(_below(*factors.shape), 0.0, factors)


@cache
def _below(rows: int, columns: int) -> NDArray[np.bool_]:
    """Mask of places below the diagonal; cached, for numpy's triu takes as long as the factors of a small matrix."""
    return np.tri(rows, columns, -1, dtype=bool)


def _objective(residual: Array, z: Array) -> float:
    value = float(residual @ residual + z @ z)
    return value if np.isfinite(value) else np.inf


def _acceleration(damped: Array, force: Array, size: Array, step: Array) -> Array:
    """Half the acceleration (p,) along a ``step``, by the ``damped`` triangle (p, p); zero if it is large."""
    if not np.isfinite(force).all():
        return np.zeros(len(step))
    turned = solve_triangular(damped, force, trans="T", check_finite=False)
    bent = -np.asarray(solve_triangular(damped, turned, check_finite=False))
    if 2 * np.linalg.norm(size * bent) > 0.75 * np.linalg.norm(size * step):
        return np.zeros(len(step))
    return bent / 2


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis fitted to the data."""

    candidates: tuple[Candidate, ...]  # what was added
    unknowns: tuple[UncertainParameter, ...]  # everything that floated: nuisances, then those of the candidates
    theta: Array  # coordinates (p,)
    covariance: Array  # their posterior covariance (p, p)
    residual: Array  # whitened, of all rows (n,)
    jacobian: Array  # its derivative (n, p)
    objective: float  # |residual|^2 of the fitted rows plus the prior penalty
    log_evidence: float  # Laplace, without the constant that all hypotheses share
    nuisance_scale: float = 1.0  # factor on the prior sd of the nuisances
    converged: bool = True  # what has not converged is never judged
    begins: tuple[Array, ...] = ()  # coordinates (p,) from which the fit was tried

    @property
    def name(self) -> str:
        """Identifiers joined by +."""
        return hypothesis_name(self.candidates)

    @property
    def identifiers(self) -> frozenset[str]:
        """Identifiers of the candidates."""
        return frozenset(candidate.identifier for candidate in self.candidates)

    @property
    def chi2(self) -> float:
        """|residual|^2."""
        return float(self.residual @ self.residual)

    @property
    def penalty(self) -> float:
        """Share of the prior in the objective of a fit to all rows: the squares of all coordinates in prior sd."""
        return self.objective - self.chi2

    @property
    def misfit(self) -> float:
        """Objective a number: factor on the variances with which it were 1; at least 1: Birge (1932)."""
        return max(1.0, self.objective / len(self.residual))

    @property
    def goodness(self) -> float:
        """P(chi^2 larger) of the objective (data and nuisance penalty) on n minus the freely fitted parameters."""
        freedom = len(self.residual) - sum(u.size for c in self.candidates for u in c.unknowns)
        return float(chdtrc(max(freedom, 1), self.objective))

    @property
    def fits_data(self) -> bool:
        """It explains the data in sum, by chi^2 and prior."""
        return self.goodness > RULES.poor_fit

    @property
    def noise_factor(self) -> float:
        """Factor on the sd of the noise with which the objective a number were 1; 1 if it fits the data."""
        return 1.0 if self.fits_data else math.sqrt(self.misfit)

    @property
    def effect_columns(self) -> slice:
        """Columns of the unknowns of the candidates."""
        return slice(len(self.unknowns) - sum(len(c.unknowns) for c in self.candidates), len(self.unknowns))

    @property
    def nuisances(self) -> tuple[UncertainParameter, ...]:
        """Unknowns that float in every fit."""
        return self.unknowns[: self.effect_columns.start]

    def columns(self, candidate: Candidate) -> slice:
        """Columns of the unknowns of one ``candidate``."""
        start = self.effect_columns.start
        for c in self.candidates:
            if c.identifier == candidate.identifier:
                return slice(start, start + len(c.unknowns))
            start += len(c.unknowns)
        raise KeyError(candidate.identifier)

    def values(self, candidate: Candidate) -> list[tuple[UncertainParameter, float]]:
        """Unknowns of one ``candidate`` with their coordinates."""
        return list(zip(candidate.unknowns, self.theta[self.columns(candidate)], strict=True))

    def _sizes(self) -> list[tuple[str, UncertainParameter, float]]:
        """Identifier, unknown and coordinate of each size of an effect."""
        return [(c.identifier, u, x) for c in self.candidates for u, x in self.values(c) if u.size]

    def sizes_beyond_usual(self) -> list[str]:
        """Names (effect.size) of sizes beyond what usually occurs."""
        most = RULES.most_scales
        return [f"{name}.{u.name}" for name, u, x in self._sizes() if abs(x - u.centre) > most * u.scale / u.widened]

    def sizes_below_smallest(self) -> list[str]:
        """Names (effect.size) of sizes that are surely (two standard deviations) below the smallest that occurs."""
        return [
            f"{c.identifier}.{u.name}"
            for c in self.candidates
            for k, (u, x) in enumerate(self.values(c), self.columns(c).start)
            if u.smallest and abs(x - u.centre) + 2 * math.sqrt(self.covariance[k, k]) < u.smallest
        ]

    def effects_too_small(self) -> list[str]:
        """Identifiers of candidates all of whose sizes are below the least that is worth a name."""
        sizes = self._sizes()
        worth = {name for name, u, x in sizes if not abs(x - u.centre) < u.least}
        return list(dict.fromkeys(name for name, _, _ in sizes if name not in worth))

    def sizes_at_bound(self) -> list[str]:
        """Names (effect.size) of sizes that ended at a bound."""
        tolerance = 1e-3  # of the prior sd
        return [
            f"{name}.{u.name}"
            for name, u, x in self._sizes()
            if x <= u.lowest + tolerance * u.scale or x >= u.highest - tolerance * u.scale
        ]

    def effects_within_sd(self) -> list[str]:
        """Identifiers of candidates none of whose sizes exceeds its standard deviation, a misfit treated as noise."""
        spread = np.sqrt(np.maximum(self.covariance.diagonal(), 0.0) * self.misfit)
        names = []
        for c in self.candidates:
            sizes = zip(self.values(c), spread[self.columns(c)], strict=True)
            exceeds = [abs(x - u.centre) > sd for (u, x), sd in sizes if u.size]
            names += [c.identifier] if exceeds and not any(exceeds) else []
        return names

    @property
    def family(self) -> frozenset[str]:
        """Family of each candidate, or its own name if it has none."""
        return frozenset(c.family or c.identifier for c in self.candidates)

    @property
    def seldom_count(self) -> int:
        """Number of candidates of a rare size."""
        return len({name.split(".")[0] for name in self.sizes_beyond_usual()})

    @property
    def admissible(self) -> bool:
        """Converged, inside its bounds, no candidate too small for a name; its size may be unusual."""
        return self.converged and not self.sizes_at_bound() and not self.effects_too_small()

    @property
    def physical(self) -> bool:
        """Admissible and of a size that occurs."""
        return self.admissible and not self.sizes_beyond_usual()


def prior(
    unknowns: Sequence[UncertainParameter], candidates: Sequence[Candidate], scale: float = 1.0
) -> tuple[Array, Array]:
    """Centre and standard deviation (p,) of the coordinates; ``scale`` is a factor on the sd of the nuisances."""
    centre = np.array([u.centre for u in unknowns])
    sd = np.array([u.scale for u in unknowns])
    sd[: len(unknowns) - sum(len(c.unknowns) for c in candidates)] *= scale
    return centre, sd


def fit(
    kind: Kind,
    candidates: tuple[Candidate, ...] = (),
    *,
    starts: Sequence[Array] | None = None,
    rows: NDArray[np.bool_] | None = None,
    nuisance_scale: float = 1.0,
    turns: tuple[int, int] = THOROUGH,
    patient: bool = False,
    reached: float = math.inf,
) -> Fit:
    """Fit nuisances and ``candidates`` from several ``starts`` (p,) to all or some ``rows`` (n,); the best end.

    A start that hardly gains far above the objective that is ``reached`` already, here or by others, is given up.
    """
    problem = _Problem(candidates, (*kind.nuisances, *(u for c in candidates for u in c.unknowns)), nuisance_scale)
    used = np.ones(len(kind.rows.places), bool) if rows is None else rows
    starts = starts or default_starts(kind, candidates)
    begins = []
    for x in starts:
        led = problem.solve_easier(kind, x) if patient else []
        begins += [*led, x]  # what an easier problem leads to first: others are given up where they lag behind
    begins = drop_repeats(begins)
    best = problem.end(kind, begins[0], used, turns, reached=reached)
    for begin in begins[1:]:
        end = problem.end(kind, begin, used, turns, reached=min(reached, best.objective))
        best = min(best, end, key=lambda end: end.objective)
    return replace(problem.evidence(kind, best, used), begins=tuple(begins))


@dataclass(frozen=True)
class _Problem:
    """A fit in prior sd from the prior mean."""

    candidates: tuple[Candidate, ...]  # of the hypothesis
    unknowns: tuple[UncertainParameter, ...]  # (p), nuisances, then those of the candidates
    nuisance_scale: float  # factor on the prior sd of the nuisances

    @property
    def prior(self) -> tuple[Array, Array]:
        return prior(self.unknowns, self.candidates, self.nuisance_scale)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds (p,) in prior sd: no fit comes near 100, but a trial step may overflow beyond."""
        centre, sd = self.prior
        lower, upper = (np.array([getattr(u, end) for u in self.unknowns]) for end in ("lowest", "highest"))
        return np.maximum((lower - centre) / sd, -100.0), np.minimum((upper - centre) / sd, 100.0)

    def end(
        self,
        kind: Kind,
        x: Array,
        used: NDArray[np.bool_],
        turns: tuple[int, int],
        *,
        reached: float = math.inf,
        share: float = 1.0,
    ) -> End:
        """The minimum to which ``x`` (p,) leads, with a ``share`` of the data's weight."""
        centre, sd = self.prior
        weight = math.sqrt(share)

        def evaluate(z: Array, *, slopes: bool) -> tuple[Array, Array]:
            residual, jacobian = kind.residual(self.candidates, centre + sd * z, slopes=slopes)
            return weight * residual, weight * jacobian * sd if slopes else jacobian

        start = (x - centre) / sd
        return minimise(evaluate, start, *self.bounds, used, turns=turns, eager=kind.thorough, reached=reached)

    def solve_easier(self, kind: Kind, x: Array) -> list[Array]:
        """Solve the easier problems in turn from ``x`` (p,); coordinates of the last end, empty if there is none.

        A kind without any counts less of its misfit: what is stated of the parameters then leads the first steps.
        """
        centre, sd = self.prior
        led = []
        problems = [(easier, 1.0) for easier in kind.easier_problems()] or [(kind, share) for share in LIGHTER]
        for easier, share in problems:
            end = self.end(easier, x, np.ones(len(easier.rows.places), bool), GUIDE, share=share)
            if math.isfinite(end.objective):
                x = centre + sd * end.z
                led.append(x)
        return led[-1:]

    def evidence(self, kind: Kind, end: End, used: NDArray[np.bool_]) -> Fit:
        """The fit at its ``end``; what is not finite gets no evidence at all."""
        centre, sd = self.prior
        z, theta = end.z, centre + sd * end.z
        log_evidence, inverse = -math.inf, np.eye(len(z))
        if math.isfinite(end.objective):
            inverse, volume = spread(end.jacobian[used])
            log_evidence = -(end.objective + volume + kind.log_determinant(self.candidates, theta)) / 2
            gradient = end.jacobian[used].T @ end.residual[used] + z
            for i, u in enumerate(self.unknowns):
                if u.one_sided:
                    log_evidence += _half_normal(z[i] - self.bounds[0][i], gradient[i], inverse[i, i])
        finite = math.isfinite(log_evidence)
        return Fit(
            self.candidates,
            self.unknowns,
            theta,
            inverse * np.outer(sd, sd),
            end.residual,
            end.jacobian / sd,
            end.objective if finite else math.inf,
            log_evidence if finite else -math.inf,
            self.nuisance_scale,
            finite and end.converged,
        )


def default_starts(kind: Kind, candidates: tuple[Candidate, ...]) -> list[Array]:
    """Nuisances at their prior means, with the starts of the ``candidates``: coordinates (p,), several."""
    nominal = np.array([u.centre for u in kind.nuisances])
    most = range(max((len(c.starts) for c in candidates), default=1))
    return [np.concatenate([nominal, *(c.starts[min(k, len(c.starts) - 1)] for c in candidates)]) for k in most]


def _half_normal(distance: float, gradient: float, variance: float) -> float:
    """Correction of the evidence for a coordinate that is cut off at its neutral value, ``distance`` away."""
    push = max(gradient, 0.0) if distance < 1e-9 else 0.0
    root = math.sqrt(variance)
    return math.log(2) + push**2 * variance / 2 + float(log_ndtr(distance / root - push * root))


@dataclass(frozen=True)
class Moved:
    """A nuisance before and after the fit."""

    name: str  # of the parameter
    unit: str  # of the values and their sd
    prior: float  # value as stated
    prior_sd: float  # standard deviation as stated
    value: float  # value after the final fit
    sd: float  # standard deviation after the final fit
    alone: float  # how far it went if only nuisances float, in prior sd
    shift: float  # how far it went in the final fit, in prior sd
    assumed: bool = False  # nobody stated its prior sd


def compare_nuisances(null: Fit, final: Fit) -> tuple[Moved, ...]:
    """Compare each nuisance as stated and as fitted without (``null``) and with effects; farthest moved first."""
    unknowns = final.unknowns[: final.effect_columns.start]
    count = len(unknowns)
    centre = np.array([u.centre for u in unknowns])
    prior_values, null_values, final_values = values_of(
        unknowns, np.stack([centre, null.theta[:count], final.theta[:count]], 1)
    ).T
    slopes = slopes_of(unknowns, final.theta[:count])
    sd = np.sqrt(np.maximum(np.diag(slopes @ final.covariance[:count, :count] @ slopes.T), 0.0))
    shifts = []
    for k, u in enumerate(unknowns):
        if u.coupling is None:
            ways = (null.theta[k] - u.centre) / u.scale, (final.theta[k] - u.centre) / u.scale
        else:  # its own coordinate moves others as well
            ways = (null_values[k] - prior_values[k]) / u.scale, (final_values[k] - prior_values[k]) / u.scale
        shifts.append(
            Moved(
                u.name,
                u.unit,
                prior=float(prior_values[k]),
                prior_sd=u.slope(u.centre) * u.scale,
                value=float(final_values[k]),
                sd=float(sd[k]),
                alone=float(ways[0]),
                shift=float(ways[1]),
                assumed=u.assumed,
            )
        )
    return tuple(sorted(shifts, key=lambda m: -abs(m.shift)))


def lowest_explaining(fits: Iterable[Fit]) -> float:
    """Lowest objective of those ``fits`` that explain the data; infinite if none does."""
    return min((f.objective for f in fits if f.fits_data), default=math.inf)
