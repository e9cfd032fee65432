"""The checks an effect must pass before it is named: held-out score, goodness of fit, whiteness, wider nuisances."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from studies.inference.arrays import Array
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward

FEWEST = 8  # residuals of a series that can be judged white
LAGS = 10
WIDER = 2.0


@dataclass(frozen=True)
class HeldOut:
    """Prediction of data left out of the fit: log score and chi^2 of each row; not ``possible`` with one repeat."""

    log_score: float
    residual: Array
    possible: bool = True

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)


def held_out(forward: Forward, found: Fit) -> HeldOut:
    """Refit with each fold left out and score what was left out, its predictive covariance included."""
    score, residual = 0.0, np.zeros(len(forward.rows.where))
    numbers = np.unique(forward.rows.fold)
    if len(numbers) == 1:
        return HeldOut(0.0, found.residual, possible=False)
    for number in numbers:
        out = forward.rows.fold == number
        part = fit(forward, found.candidates, starts=[found.theta], rows=~out, nuisance_scale=found.nuisance_scale)
        r, j = part.residual[out], part.jacobian[out]
        score += log_normal(r, j, part.covariance)
        residual[out] = r
    return HeldOut(score, residual)


def log_normal(r: Array, j: Array, covariance: Array) -> float:
    """ln N(r; 0, I + j covariance j'), by the matrix inversion lemma where there are many rows."""
    scale = np.sqrt(np.maximum(covariance.diagonal(), 1e-300))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    g = j @ (scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0)))  # rounding may leave it a little indefinite
    inner = np.eye(g.shape[1]) + g.T @ g
    projected = g.T @ r
    squared = float(r @ r - projected @ np.linalg.solve(inner, projected))
    return -0.5 * (squared + float(np.linalg.slogdet(inner)[1]) + len(r) * math.log(2 * math.pi))


def goodness_of_fit(forward: Forward, found: Fit) -> float:
    """P(chi^2 larger): the objective (data and nuisance penalty) on n minus the freely fitted effect parameters."""
    freedom = len(forward.rows.where) - sum(u.size for c in found.candidates for u in c.unknowns)
    return float(chi2_distribution.sf(found.objective, max(freedom, 1)))


def whiteness(forward: Forward, residual: Array) -> float:
    """P value of Ljung-Box over all series, and of cross-correlation with the inputs; the smaller, doubled."""
    values = [_ljung_box(forward, residual)]
    if forward.rows.inputs is not None:
        values.append(_input_correlation(forward, residual))
    return min(1.0, len(values) * min(values))


def _ljung_box(forward: Forward, residual: Array) -> float:
    statistic, freedom = 0.0, 0
    series = np.array(forward.rows.series)
    for name in dict.fromkeys(forward.rows.series):
        r = residual[series == name]
        n = len(r)
        if n < FEWEST:
            continue
        r = r - r.mean()
        lags = min(LAGS, n // 4)
        for lag in range(1, lags + 1):
            rho = float(r[lag:] @ r[:-lag]) / float(r @ r)
            statistic += n * (n + 2) * rho**2 / (n - lag)
        freedom += lags
    return float(chi2_distribution.sf(statistic, freedom)) if freedom else 1.0


def _input_correlation(forward: Forward, residual: Array) -> float:
    statistic, freedom = 0.0, 0
    series = np.array(forward.rows.series)
    assert forward.rows.inputs is not None
    for name in dict.fromkeys(forward.rows.series):
        rows = series == name
        r, inputs = residual[rows], forward.rows.inputs[rows]
        for u in inputs.T:
            u = u - u.mean()
            power = float(u @ u)
            if power == 0 or len(r) < FEWEST:
                continue
            for lag in range(LAGS):
                shifted = float(r[lag:] @ u[: len(u) - lag])
                statistic += shifted**2 / (power * float(r @ r) / len(r))
                freedom += 1
    return float(chi2_distribution.sf(statistic, freedom)) if freedom else 1.0


def with_wider_nuisances(forward: Forward, known: Hypotheses, leaders: list[Fit]) -> Hypotheses:
    """The null and the leaders refitted with twice the nuisance standard deviations."""
    null = fit(forward, starts=[known.null.theta], nuisance_scale=WIDER)
    fits = [fit(forward, f.candidates, starts=[f.theta], nuisance_scale=WIDER) for f in leaders]
    return Hypotheses(null, tuple(fits), known.library)
