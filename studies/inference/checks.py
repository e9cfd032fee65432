"""The checks an effect must pass before it is named: held-out score, goodness of fit, whiteness, wider nuisances."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from studies.inference.arrays import Array
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward

FEWEST_RESIDUALS = 8  # of a series that can be judged white
MOST_LAGS = 10
WIDER_NUISANCES = 2.0  # times their standard deviations


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Prediction of data left out of the fit.

    Attributes
    ----------
    log_score : float
        ln of the predictive density of what was left out, summed over the folds.
    residual : ndarray, shape (n,)
        Whitened, of each row as its own fold's fit predicts it.
    possible : bool
        False where there is one fold only, and the residual that of the fit to everything.
    """

    log_score: float
    residual: Array
    possible: bool = True

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)

    @property
    def gap(self) -> float:
        """How far chi^2/n is above that of noise alone, as a standard deviation: sqrt(max(0, chi^2/n - 1))."""
        return float(np.sqrt(max(0.0, self.chi2 / len(self.residual) - 1)))


def held_out(forward: Forward, hypothesis: Fit) -> HeldOut:
    """Refit with each fold left out and score what was left out, its predictive covariance included.

    Parameters
    ----------
    forward : Forward
    hypothesis : Fit
        The fit to all rows, from which the others begin.
    """
    score, residual = 0.0, np.zeros(len(forward.rows.where))
    numbers = np.unique(forward.rows.fold)
    if len(numbers) == 1:
        return HeldOut(0.0, hypothesis.residual, possible=False)
    for number in numbers:
        out = forward.rows.fold == number
        rest = fit(
            forward, hypothesis.candidates, starts=[hypothesis.theta], rows=~out,
            nuisance_scale=hypothesis.nuisance_scale,
        )  # fmt: skip
        r, j = rest.residual[out], rest.jacobian[out]
        score += log_normal(r, j, rest.covariance)
        residual[out] = r
    return HeldOut(score, residual)


def log_normal(r: Array, j: Array, covariance: Array) -> float:
    """ln N(r; 0, I + j covariance j'), by the matrix inversion lemma where there are many rows.

    Parameters
    ----------
    r : ndarray, shape (n,)
        Whitened residual.
    j : ndarray, shape (n, p)
        Its derivative.
    covariance : ndarray, shape (p, p)
        Of the coordinates.
    """
    scale = np.sqrt(np.maximum(covariance.diagonal(), 1e-300))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    g = j @ (scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0)))  # rounding may leave it a little indefinite
    inner = np.eye(g.shape[1]) + g.T @ g
    projected = g.T @ r
    squared = float(r @ r - projected @ np.linalg.solve(inner, projected))
    return -0.5 * (squared + float(np.linalg.slogdet(inner)[1]) + len(r) * math.log(2 * math.pi))


def goodness_of_fit(forward: Forward, hypothesis: Fit) -> float:
    """P(chi^2 larger) of a fit: the objective (data and nuisance penalty) on n minus the freely fitted parameters.

    Parameters
    ----------
    forward : Forward
    hypothesis : Fit
    """
    freedom = len(forward.rows.where) - sum(u.size for c in hypothesis.candidates for u in c.unknowns)
    return float(chi2_distribution.sf(hypothesis.objective, max(freedom, 1)))


def whiteness(forward: Forward, residual: Array) -> float:
    """P value of Ljung-Box over all series, and of cross-correlation with the inputs; the smaller, doubled.

    Parameters
    ----------
    forward : Forward
    residual : ndarray, shape (n,)
        Whitened, of a fit.
    """
    values = [_ljung_box(forward, residual)]
    if forward.rows.inputs is not None:
        values.append(_input_correlation(forward, residual, forward.rows.inputs))
    return min(1.0, len(values) * min(values))


def _series(forward: Forward) -> Iterator[Array]:
    """Rows of each series that is long enough."""
    series = np.array(forward.rows.series)
    for name in dict.fromkeys(forward.rows.series):
        rows = series == name
        if rows.sum() >= FEWEST_RESIDUALS:
            yield rows


def _ljung_box(forward: Forward, residual: Array) -> float:
    statistic, freedom = 0.0, 0
    for rows in _series(forward):
        r = residual[rows]
        n = len(r)
        r = r - r.mean()
        lags = min(MOST_LAGS, n // 4)
        for lag in range(1, lags + 1):
            rho = float(r[lag:] @ r[:-lag]) / float(r @ r)
            statistic += n * (n + 2) * rho**2 / (n - lag)
        freedom += lags
    return float(chi2_distribution.sf(statistic, freedom)) if freedom else 1.0


def _input_correlation(forward: Forward, residual: Array, inputs: Array) -> float:
    statistic, freedom = 0.0, 0
    for rows in _series(forward):
        r = residual[rows]
        for u in inputs[rows].T:
            u = u - u.mean()
            power = float(u @ u)
            if power == 0:
                continue
            for lag in range(MOST_LAGS):
                shifted = float(r[lag:] @ u[: len(u) - lag])
                statistic += shifted**2 / (power * float(r @ r) / len(r))
                freedom += 1
    return float(chi2_distribution.sf(statistic, freedom)) if freedom else 1.0


def with_wider_nuisances(forward: Forward, known: Hypotheses, leaders: list[Fit]) -> Hypotheses:
    """The null and some hypotheses refitted with twice the nuisance sd.

    Parameters
    ----------
    forward : Forward
    known : Hypotheses
    leaders : list of Fit
        Those that are refitted.
    """
    null = fit(forward, starts=[known.null.theta], nuisance_scale=WIDER_NUISANCES)
    fits = [fit(forward, f.candidates, starts=[f.theta], nuisance_scale=WIDER_NUISANCES) for f in leaders]
    return Hypotheses(null, tuple(fits), known.library)
