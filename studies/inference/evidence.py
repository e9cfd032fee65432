"""Evidence of a fit: held-out score, goodness of fit, whiteness, what empirical terms explain, parameter shifts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtrc

from studies.inference.fit import Fit, fit
from studies.inference.kind import Kind
from studies.inference.parameter import Array, Candidate


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Prediction of held-out data."""

    log_score: float  # ln of the predictive density of held-out data, summed over the folds
    residual: Array  # (n,), whitened, of each row as its own fold's fit predicts it
    possible: bool = True  # false if there is one fold only: the residual is then that of the fit to everything

    @property
    def count(self) -> int:
        """Number of held-out data points."""
        return len(self.residual)

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)

    @property
    def gap(self) -> float:
        """Excess of chi^2/n over that of noise alone, as a standard deviation: sqrt(max(0, chi^2/n - 1))."""
        return float(np.sqrt(max(0.0, self.chi2 / len(self.residual) - 1)))


MOST_FOLDS = 6  # each held-out fold is one more fit


def folds(group: Sequence[str], place: ArrayLike, repeat: Sequence[str]) -> NDArray[np.intp]:
    """Fold of each row: groups in the order of their place are dealt out in turn to at most six folds."""
    if len(set(group)) == 1:
        group = repeat
    names = np.asarray(group)
    places = np.asarray(place, float)
    order = sorted(set(group), key=lambda name: (float(places[names == name].mean()), name))
    number = {name: k % min(MOST_FOLDS, len(order)) for k, name in enumerate(order)}
    return np.array([number[name] for name in group], np.intp)


def held_out(kind: Kind, hypothesis: Fit) -> HeldOut:
    """Refit without each fold and score the held-out fold, its predictive covariance included."""
    score, residual = 0.0, np.zeros(len(kind.rows.places))
    numbers = np.unique(kind.rows.fold)
    if len(numbers) == 1:
        return HeldOut(0.0, hypothesis.residual, possible=False)
    for number in numbers:
        in_fold = kind.rows.fold == number
        refit = fit(
            kind,
            hypothesis.candidates,
            starts=[hypothesis.theta],
            rows=~in_fold,
            nuisance_scale=hypothesis.nuisance_scale,
        )
        r, j = refit.residual[in_fold], refit.jacobian[in_fold]
        score += log_normal(r, j, refit.covariance)
        residual[in_fold] = r
    return HeldOut(score, residual)


def log_normal(r: Array, j: Array, covariance: Array) -> float:
    """ln N(r; 0, I + j covariance j') of residuals (n,), by the matrix inversion lemma; ``j`` (n, p)."""
    if not (np.isfinite(r).all() and np.isfinite(j).all()):
        return -math.inf  # what falls over predicts nothing
    scale = np.sqrt(np.maximum(covariance.diagonal(), 1e-300))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    g = j @ (scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0)))  # rounding may leave it a little indefinite
    inner = np.eye(g.shape[1]) + g.T @ g
    projected = g.T @ r
    squared = float(r @ r - projected @ np.linalg.lstsq(inner, projected, rcond=None)[0])
    return -0.5 * (squared + float(np.linalg.slogdet(inner)[1]) + len(r) * math.log(2 * math.pi))


def within_uncertainty(hypothesis: Fit) -> float:
    """P(sum of squares larger) of how far the nuisances went, in their standard deviations, if these are true."""
    count = hypothesis.effect_columns.start
    sd = hypothesis.nuisance_scale * np.array([u.scale for u in hypothesis.nuisances])
    went = (hypothesis.theta[:count] - np.array([u.centre for u in hypothesis.nuisances])) / sd
    narrowing = np.eye(count) - hypothesis.covariance[:count, :count] / np.outer(sd, sd)
    free = np.clip(np.linalg.eigvalsh(narrowing), 0.0, 1.0)
    mean = float(free.sum())
    variance = 2 * float((free**2).sum())
    return _upper_tail_p(float(went @ went), mean, variance) if variance > 1e-12 else 1.0


def _upper_tail_p(statistic: float, mean: float, variance: float) -> float:
    """P(larger) by the chi^2 distribution with these moments: Satterthwaite (1946), Biometrics Bulletin 2, 110-114."""
    return float(chdtrc(2 * mean**2 / variance, 2 * mean * statistic / variance))


def left_over(kind: Kind, hypothesis: Fit) -> tuple[float, str] | None:
    """P(larger) of what empirical terms still explain of the residuals, and the one that explains most.

    A cause missing in the library is often imitated well enough for the sum of squares, which is spread over all rows;
    the terms ask in few directions. Score test (Rao 1948, Proc. Cambridge Philosophical Society 44, 50-57): the slopes
    T of the residual r at zero size, s = T' r, whose covariance is T' (1 - J P J') T where the hypothesis, with slopes
    J and posterior covariance P, is true. Asked of all terms together and of each, by Bonferroni. None if there is no
    term, or the hypothesis takes all of them.
    """
    terms: tuple[Candidate, ...] = ()
    for term in kind.directions():
        if kind.compatible((*hypothesis.candidates, *terms, term)):
            terms += (term,)
    neutral = [u.centre for term in terms for u in term.unknowns]
    residual, jacobian = kind.residual((*hypothesis.candidates, *terms), np.append(hypothesis.theta, neutral))
    t = jacobian[:, len(hypothesis.theta) :]
    size = np.sqrt((t**2).sum(0))
    moving = np.flatnonzero(np.isfinite(size) & (size > 0))
    if not len(moving) or not np.isfinite(residual).all():
        return None
    t = t[:, moving] / size[moving]
    score, projected = t.T @ residual, t.T @ hypothesis.jacobian
    spread = t.T @ t - projected @ hypothesis.covariance @ projected.T
    free, axes = np.linalg.eigh(spread)
    least = 1e-4  # of the square of a direction: less than that left by the hypothesis says nothing about it
    informative = free > least
    if not informative.any():
        return None
    together = float(((axes.T @ score)[informative] ** 2 / free[informative]).sum())
    single_scores = np.where(spread.diagonal() > least, score**2 / np.maximum(spread.diagonal(), least), 0.0)
    most = int(np.argmax(single_scores))
    p = chdtrc(int(informative.sum()), together), len(single_scores) * chdtrc(1, single_scores[most])
    return float(min(1.0, 2 * min(p))), terms[moving[most]].identifier


def whiteness(kind: Kind, hypothesis: Fit) -> float:
    """P value of Ljung-Box over all series, and of cross-correlation with the inputs; the smaller, doubled."""
    series = np.array(kind.rows.series)
    every_series = (np.flatnonzero(series == name) for name in dict.fromkeys(kind.rows.series))
    rows = [places for places in every_series if len(places) >= 8]  # long enough to be judged white
    if not rows:
        return 1.0
    noise = np.random.default_rng(0).standard_normal((len(hypothesis.residual), 200))
    noise = kind.marginalise_noise(hypothesis.candidates, hypothesis.theta, noise)
    noise -= hypothesis.jacobian @ (hypothesis.covariance @ (hypothesis.jacobian.T @ noise))
    residual_and_draws = np.column_stack([hypothesis.residual, noise])
    statistics = [_ljung_box(rows, residual_and_draws)]
    if kind.rows.inputs is not None:
        statistics.append(_input_correlation(rows, residual_and_draws, kind.rows.inputs))
    values = []
    for statistic in statistics:
        mean, variance = float(statistic[1:].mean()), float(statistic[1:].var(ddof=1))
        has_spread = variance > 0 and math.isfinite(statistic[0])
        values.append(_upper_tail_p(float(statistic[0]), mean, variance) if has_spread else 1.0)
    return min(1.0, len(values) * min(values))


def _ljung_box(series: list[NDArray[np.intp]], residual: Array) -> Array:
    """Sum of n (n + 2) rho^2 / (n - lag) over ten lags and ``series``, of residuals (n, k): (k,)."""
    statistic = np.zeros(residual.shape[1])
    for rows in series:
        r = residual[rows]
        n = len(r)
        rounding = n * (1e-12 * np.abs(r).max(0)) ** 2
        r = r - r.mean(0)
        power = (r**2).sum(0)
        power = np.where(power > rounding, power, np.inf)  # a constant, as of a root that stays real, says nothing
        for lag in range(1, min(10, n // 4) + 1):
            statistic += n * (n + 2) * ((r[lag:] * r[:-lag]).sum(0) / power) ** 2 / (n - lag)
    return statistic


def _input_correlation(series: list[NDArray[np.intp]], residual: Array, inputs: Array) -> Array:
    """Sum of squared correlations with the ``inputs`` (n, inputs) over ten lags and series: (k,)."""
    statistic = np.zeros(residual.shape[1])
    for rows in series:
        r = residual[rows]
        power = np.maximum((r**2).mean(0), 1e-300)
        for u in inputs[rows].T:
            u = u - u.mean()
            if not u.any():
                continue
            for lag in range(10):
                statistic += (u[: len(u) - lag] @ r[lag:]) ** 2 / (float(u @ u) * power)
    return statistic
