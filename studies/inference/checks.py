"""The checks of an effect before it is named: held-out score, fit, whiteness, what is left, how far nuisances went."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from studies.inference.arrays import Array
from studies.inference.evidence import Hypotheses
from studies.inference.fit import Fit, fit
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate

FEWEST_RESIDUALS = 8  # of a series that can be judged white
MOST_LAGS = 10
DRAWS = 200  # of white noise
ROUNDING = 1e-12  # of the size of a residual, below which it does not vary
TAKEN = 1e-4  # of the square of a direction: less than that left by a hypothesis says nothing about it
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
    if not (np.isfinite(r).all() and np.isfinite(j).all()):
        return -math.inf  # what falls over predicts nothing
    scale = np.sqrt(np.maximum(covariance.diagonal(), 1e-300))
    size, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    g = j @ (scale[:, None] * axes * np.sqrt(np.maximum(size, 0.0)))  # rounding may leave it a little indefinite
    inner = np.eye(g.shape[1]) + g.T @ g
    projected = g.T @ r
    squared = float(r @ r - projected @ np.linalg.lstsq(inner, projected)[0])
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


def within_uncertainty(hypothesis: Fit) -> float:
    """P(sum of squares larger) of how far the nuisances went, in their standard deviations, if these are true.

    Before the data are known, what a fit will make of them has the covariance 1 - P with their posterior covariance P,
    both in prior sd (Box 1980, J. Royal Statistical Society A 143, 383-430); the sum of squares is compared with the
    chi^2 distribution of its mean and variance (Satterthwaite).

    Parameters
    ----------
    hypothesis : Fit
    """
    count = hypothesis.effect_columns.start
    nuisances = hypothesis.unknowns[:count]
    sd = hypothesis.nuisance_scale * np.array([u.scale for u in nuisances])
    went = (hypothesis.theta[:count] - np.array([u.centre for u in nuisances])) / sd
    known = np.eye(count) - hypothesis.covariance[:count, :count] / np.outer(sd, sd)
    free = np.clip(np.linalg.eigvalsh(known), 0.0, 1.0)
    mean, variance = float(free.sum()), 2 * float((free**2).sum())
    if not variance > ROUNDING:
        return 1.0
    return float(chi2_distribution.sf(2 * mean * float(went @ went) / variance, 2 * mean**2 / variance))


def left_over(forward: Forward, hypothesis: Fit) -> tuple[float, str] | None:
    """P(larger) of what terms without a cause would still explain, and the one that would explain most.

    A cause that the library lacks is often imitated well enough for the sum of squares, which is spread over all rows;
    the terms ask in few directions. Score test (Rao 1948, Proc. Cambridge Philosophical Society 44, 50-57): the slopes
    T of the residual r at zero size, s = T' r, whose covariance is T' (1 - J P J') T where the hypothesis, with slopes
    J and posterior covariance P, is true. Asked of all terms together and of each, by Bonferroni. None where there is
    no term, or the hypothesis takes all of them.

    Parameters
    ----------
    forward : Forward
    hypothesis : Fit
        To all rows.
    """
    terms: tuple[Candidate, ...] = ()
    for term in forward.directions():
        if forward.compatible((*hypothesis.candidates, *terms, term)):
            terms += (term,)
    neutral = [u.centre for term in terms for u in term.unknowns]
    residual, jacobian = forward.residual((*hypothesis.candidates, *terms), np.append(hypothesis.theta, neutral))
    t = jacobian[:, len(hypothesis.theta) :]
    size = np.sqrt((t**2).sum(0))
    moving = np.flatnonzero(np.isfinite(size) & (size > 0))
    if not len(moving) or not np.isfinite(residual).all():
        return None
    t = t[:, moving] / size[moving]
    score, taken = t.T @ residual, t.T @ hypothesis.jacobian
    spread = t.T @ t - taken @ hypothesis.covariance @ taken.T
    free, axes = np.linalg.eigh(spread)
    told = free > TAKEN
    if not told.any():
        return None
    together = float(((axes.T @ score)[told] ** 2 / free[told]).sum())
    each = np.where(spread.diagonal() > TAKEN, score**2 / np.maximum(spread.diagonal(), TAKEN), 0.0)
    most = int(np.argmax(each))
    p = chi2_distribution.sf(together, int(told.sum())), len(each) * chi2_distribution.sf(each[most], 1)
    return float(min(1.0, 2 * min(p))), terms[moving[most]].identifier


def whiteness(forward: Forward, hypothesis: Fit) -> float:
    """P value of Ljung-Box over all series, and of cross-correlation with the inputs; the smaller, doubled.

    A fit takes something out of the noise, and so do initial states that are integrated out: the statistics are
    compared with those of white noise from which the same was taken out, by their mean and variance (Satterthwaite
    1946, Biometrics Bulletin 2, 110-114).

    Parameters
    ----------
    forward : Forward
    hypothesis : Fit
        To all rows.
    """
    rows = list(_series(forward))
    if not rows:
        return 1.0
    noise = np.random.default_rng(0).standard_normal((len(hypothesis.residual), DRAWS))
    noise = forward.marginalised(hypothesis.candidates, hypothesis.theta, noise)
    noise -= hypothesis.jacobian @ (hypothesis.covariance @ (hypothesis.jacobian.T @ noise))
    every = np.column_stack([hypothesis.residual, noise])
    values = [_share_beyond(_ljung_box(rows, every))]
    if forward.rows.inputs is not None:
        values.append(_share_beyond(_input_correlation(rows, every, forward.rows.inputs)))
    return min(1.0, len(values) * min(values))


def _share_beyond(statistic: Array) -> float:
    """P(larger) of the first of the statistics by the chi^2 distribution with the moments of the others."""
    mean, variance = float(statistic[1:].mean()), float(statistic[1:].var(ddof=1))
    if not (variance > 0 and math.isfinite(statistic[0])):
        return 1.0
    return float(chi2_distribution.sf(2 * mean * statistic[0] / variance, 2 * mean**2 / variance))


def _series(forward: Forward) -> Iterator[NDArray[np.intp]]:
    """Rows of each series that is long enough."""
    series = np.array(forward.rows.series)
    for name in dict.fromkeys(forward.rows.series):
        rows = np.flatnonzero(series == name)
        if len(rows) >= FEWEST_RESIDUALS:
            yield rows


def _ljung_box(series: list[NDArray[np.intp]], residual: Array) -> Array:
    """Sum of n (n + 2) rho^2 / (n - lag) over lags and ``series``, of residuals (n, k): (k,)."""
    statistic = np.zeros(residual.shape[1])
    for rows in series:
        r = residual[rows]
        n = len(r)
        rounding = n * (ROUNDING * np.abs(r).max(0)) ** 2
        r = r - r.mean(0)
        power = (r**2).sum(0)
        power = np.where(power > rounding, power, np.inf)  # a constant, as of a root that stays real, says nothing
        for lag in range(1, min(MOST_LAGS, n // 4) + 1):
            statistic += n * (n + 2) * ((r[lag:] * r[:-lag]).sum(0) / power) ** 2 / (n - lag)
    return statistic


def _input_correlation(series: list[NDArray[np.intp]], residual: Array, inputs: Array) -> Array:
    """Sum of squared correlations with the ``inputs`` (n, inputs) over lags and series, of residuals (n, k): (k,)."""
    statistic = np.zeros(residual.shape[1])
    for rows in series:
        r = residual[rows]
        power = np.maximum((r**2).mean(0), 1e-300)
        for u in inputs[rows].T:
            u = u - u.mean()
            if not u.any():
                continue
            for lag in range(MOST_LAGS):
                statistic += (u[: len(u) - lag] @ r[lag:]) ** 2 / (float(u @ u) * power)
    return statistic


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
