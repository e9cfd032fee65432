"""Which varied parameter matters: shares of the variance of an output, estimated from the bicycles that there are.

The first-order index of a parameter x is S = Var(E[y | x]) / Var(y): the share of the variance that would vanish on
average if x were known (Sobol 1993, Math. Modelling Comput. Exp. 1, 407). No further bicycle is computed:

- on a grid, E[y | x] is the mean at each of its values, every combination counting the same;
- of a sample, it is the mean in classes of equally many bicycles, and what chance makes of such means is taken off:
  S = (SSB - (k - 1) MSW) / SST with k classes, SSB and MSW the sum of squares between them and the mean square within
  (Kelley 1935, PNAS 21, 554, in an analysis of variance). In a cell of the grid the samples are the same as in the
  others, so it is taken of each sample's mean over the cells, deviations from the cell's mean.

The total index T of a grid parameter is the mean variance along it over Var(y): what remains if all others are known.
Its sum over the parameters is 1 or more, that of S 1 or less if the parameters are independent; what is missing to 1 is
their interaction.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.sweep_pictures.varied import Varied
from studies.sweeps.spec import Normal
from tyre.base.arrays import Array

LEAST, LEAST_OF_A_GRID = 40, 4  # bicycles
RESAMPLES = 200
NORMAL_95 = 1.96
CORRELATED, STATED = 0.1, 0.02
CLASSES = (4, 64)


@dataclass(frozen=True)
class Share:
    """The part of a parameter in the variance of an output.

    Attributes
    ----------
    name : str
        Of the parameter.
    first, total : float
        Indices; the total one NaN where these bicycles do not tell it.
    half_width : float
        Of the 95 % interval of the first-order index; 0 where the grid is all there is.
    """

    name: str
    first: float
    total: float
    half_width: float


def shares(y: Array, varied: Sequence[Varied], *, seed: int = 0, resamples: int = RESAMPLES) -> list[Share]:
    """Shares of the variance of an output.

    Parameters
    ----------
    y : ndarray, shape (cells, samples)
        The output, NaN where a bicycle does not have it.
    varied : sequence of Varied
    seed : int
        Of the bootstrap over samples, any whole number.
    resamples : int
        Number of them.

    Returns
    -------
    list of Share
        In the order of ``varied``; empty where too few bicycles have the output or all have the same.
    """
    known = np.isfinite(y)
    enough = known.any(0).sum() >= LEAST if y.shape[1] > 1 else known.sum() >= LEAST_OF_A_GRID
    if not enough or not _varies(y):
        return []
    first = _indices(y, varied)
    spread = np.zeros(len(varied))
    if y.shape[1] > 1:
        rng = np.random.default_rng([seed, 16])
        found = []
        for _ in range(resamples):
            chosen = rng.integers(0, y.shape[1], y.shape[1])
            again = y[:, chosen]
            if _varies(again):
                found.append(_indices(again, [_resampled(one, chosen) for one in varied]))
        spread = NORMAL_95 * np.std(found, axis=0, ddof=1)
    return [Share(one.name, float(first[k]), _total(y, one, varied), float(spread[k])) for k, one in enumerate(varied)]


def correlated(varied: Sequence[Varied], has: NDArray[np.bool_]) -> list[tuple[str, str, float]]:
    """Pairs of sampled parameters whose ranks are correlated beyond chance, among the bicycles that have an output.

    Parameters
    ----------
    varied : sequence of Varied
    has : ndarray of bool, shape (cells, samples)

    Returns
    -------
    list of tuple
        Two names and Spearman's correlation.
    """
    from scipy.stats import rankdata

    drawn = [one for one in varied if one.sampled and not one.named]
    kept = has.any(0)
    count = int(kept.sum())
    if len(drawn) < 2 or count < LEAST:
        return []
    matrix = np.corrcoef([rankdata(one.values[0, kept]) for one in drawn])
    least = max(CORRELATED, 4 / np.sqrt(count))
    pairs = [(i, j) for i in range(len(drawn)) for j in range(i) if abs(matrix[i, j]) > least]
    return [(drawn[j].name, drawn[i].name, float(matrix[i, j])) for i, j in pairs]


def stated_correlations(groups: Sequence[Normal]) -> list[tuple[str, str, float]]:
    """Pairs of parameters that the sweep draws with a correlation: two names and the correlation."""
    found = []
    for group in groups:
        covariance = np.array(group.factor) @ np.array(group.factor).T
        sd = np.sqrt(np.diag(covariance))
        for i in range(len(sd)):
            for j in range(i):
                r = covariance[i, j] / (sd[i] * sd[j]) if sd[i] * sd[j] > 0 else 0.0
                if abs(r) > STATED:
                    found.append((group.names[j], group.names[i], float(r)))
    return found


def _varies(y: Array) -> bool:
    known = y[np.isfinite(y)]
    return bool(known.size > 1 and np.ptp(known) > 1e-9 * np.abs(known).max())


def _resampled(one: Varied, chosen: Any) -> Varied:
    return Varied(one.name, one.unit, one.values[:, chosen]) if one.sampled else one


def _indices(y: Array, varied: Sequence[Varied]) -> Array:
    known = np.isfinite(y)
    total = float(np.var(y[known]))
    count = known.sum(1, keepdims=True)
    centre = np.where(count > 0, np.where(known, y, 0).sum(1, keepdims=True) / np.maximum(count, 1), 0)
    own = known.sum(0)
    kept = own > 0
    mean = np.where(known, y - centre, 0).sum(0)[kept] / own[kept]
    found = []
    for one in varied:
        if one.sampled:
            found.append(_between_classes(mean, one.values[0, kept]) / total)
        else:
            values = np.broadcast_to(one.values, y.shape)[known]
            found.append(_between_levels(y[known], values) / total)
    return np.array(found)


def _between_levels(y: Array, values: NDArray[np.generic]) -> float:
    """Variance of the means at each value."""
    _, place = np.unique(values, return_inverse=True)
    count = np.bincount(place)
    mean = np.bincount(place, y) / count
    return float(np.sum(count * (mean - y.mean()) ** 2) / len(y))


def _between_classes(y: Array, values: Array) -> float:
    """Variance of the mean of y in classes of equally many values, what chance adds taken off."""
    n = len(y)
    classes = int(np.clip(round(2 * n ** (1 / 3)), *CLASSES))
    edges = np.unique(np.quantile(values, np.linspace(0, 1, classes + 1)[1:-1]))
    place = np.searchsorted(edges, values, side="right")
    count = np.bincount(place, minlength=len(edges) + 1)
    used = count > 0
    k = int(used.sum())
    if k < 2 or n <= k:
        return 0.0
    mean = np.bincount(place, y, minlength=len(edges) + 1)[used] / count[used]
    between = float(np.sum(count[used] * (mean - y.mean()) ** 2))
    within = float(np.sum((y - y.mean()) ** 2)) - between
    return (between - (k - 1) * within / (n - k)) / n


def _total(y: Array, one: Varied, varied: Sequence[Varied]) -> float:
    """Total index of a parameter on a grid where every bicycle has the output; else NaN."""
    if one.sampled or not np.isfinite(y).all():
        return float("nan")
    others = [other.values[:, 0] for other in varied if other is not one and not other.sampled]
    group = np.zeros(len(y), np.intp)
    for values in others:
        place = np.unique(values, return_inverse=True)[1]
        group = np.unique(group * (place.max() + 1) + place, return_inverse=True)[1]
    along = [y[group == each].var(0).mean() for each in range(group.max() + 1)]
    return float(np.mean(along) / y.var())
