"""Shares of the varied parameters in the variance of an output, and correlations that make shares overlap."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import rankdata

from studies.sweep.specification import Normal
from studies.sweep.varied import Varied
from tyre.ground.arrays import Array

LEAST, LEAST_OF_A_GRID = 40, 4  # bicycles of a sample and of a grid that tell of shares


def shares(y: Array, varied: Sequence[Varied], *, seed: int = 0, resamples: int = 200) -> pd.DataFrame:
    """Shares of parameters in the variance of an output (cells, samples), NaN where a bicycle does not have it.

    A row per parameter with ``first_order``, ``half_width_95`` and ``total``; no row if too few have the output.
    """
    columns = ["parameter", "first_order", "half_width_95", "total"]
    finite = np.isfinite(y)
    enough = finite.any(0).sum() >= LEAST if y.shape[1] > 1 else finite.sum() >= LEAST_OF_A_GRID
    if not enough or not _varies(y):
        return pd.DataFrame(columns=columns)
    spread = np.zeros(len(varied))
    if y.shape[1] > 1:
        rng = np.random.default_rng([seed, 16])
        resampled = []
        for chosen in (rng.integers(0, y.shape[1], y.shape[1]) for _ in range(resamples)):
            if _varies(y[:, chosen]):
                drawn = [
                    replace(parameter, values=parameter.values[:, chosen]) if parameter.sampled else parameter
                    for parameter in varied
                ]
                resampled.append(_indices(y[:, chosen], drawn))
        spread = 1.96 * np.std(resampled, axis=0, ddof=1)
    names, totals = [parameter.name for parameter in varied], [_total(y, parameter, varied) for parameter in varied]
    return pd.DataFrame(dict(zip(columns, (names, _indices(y, varied), spread, totals), strict=True)))


def find_correlated(varied: Sequence[Varied], has: NDArray[np.bool_]) -> list[tuple[str, str, float]]:
    """Pairs of sampled parameters whose ranks are correlated beyond chance, among the bicycles that have an output."""
    sampled = [parameter for parameter in varied if parameter.sampled and not parameter.named]
    complete = has.any(0)
    count = int(complete.sum())
    if len(sampled) < 2 or count < LEAST:
        return []
    matrix = np.corrcoef([rankdata(parameter.values[0, complete]) for parameter in sampled])
    least = max(0.1, 4 / np.sqrt(count))
    pairs = [(i, j) for i in range(len(sampled)) for j in range(i) if abs(matrix[i, j]) > least]
    return [(sampled[j].name, sampled[i].name, float(matrix[i, j])) for i, j in pairs]


def stated_correlations(groups: Sequence[Normal]) -> list[tuple[str, str, float]]:
    """Pairs of parameters that the sweep draws with a correlation: two names and the correlation."""
    correlations = []
    for group in groups:
        factor = np.array(group.factor)
        unit = factor / np.maximum(np.hypot.reduce(factor, axis=1), 1e-300)[:, None]
        r = unit @ unit.T
        pairs = [(i, j) for i in range(len(r)) for j in range(i) if abs(r[i, j]) > 0.02]
        correlations += [(group.names[j], group.names[i], float(r[i, j])) for i, j in pairs]
    return correlations


def _varies(y: Array) -> bool:
    finite = y[np.isfinite(y)]
    return bool(finite.size > 1 and np.ptp(finite) > 1e-9 * np.abs(finite).max())


def _indices(y: Array, varied: Sequence[Varied]) -> Array:
    finite = np.isfinite(y)
    total = float(np.var(y[finite]))
    count = finite.sum(1, keepdims=True)
    centre = np.where(count > 0, np.where(finite, y, 0).sum(1, keepdims=True) / np.maximum(count, 1), 0)
    per_sample = finite.sum(0)
    held_by_some = per_sample > 0
    mean = np.where(finite, y - centre, 0).sum(0)[held_by_some] / per_sample[held_by_some]
    between = [
        _between_classes(mean, parameter.values[0, held_by_some])
        if parameter.sampled
        else _between_levels(y[finite], np.broadcast_to(parameter.values, y.shape)[finite])
        for parameter in varied
    ]
    return np.array(between) / total


def _between_levels(y: Array, values: NDArray[np.generic]) -> float:
    """Variance of the means at each value."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    return float(np.sum(count * ((np.bincount(place, y) / count) - y.mean()) ** 2) / len(y))


def _between_classes(y: Array, values: Array) -> float:
    """Variance of the mean of y in classes of equally many values, what chance adds taken off."""
    n = len(y)
    classes = int(np.clip(round(2 * n ** (1 / 3)), 4, 64))
    edges = np.unique(np.quantile(values, np.linspace(0, 1, classes + 1)[1:-1]))
    place = np.searchsorted(edges, values, side="right")
    count = np.bincount(place)
    filled = count > 0
    sums, count = np.bincount(place, y)[filled], count[filled]
    k = len(count)
    if k < 2 or n <= k:
        return 0.0
    between = float(np.sum(count * (sums / count - y.mean()) ** 2))
    return (between - (k - 1) * (float(np.sum((y - y.mean()) ** 2)) - between) / (n - k)) / n


def _total(y: Array, parameter: Varied, varied: Sequence[Varied]) -> float:
    """Total index of a parameter on a grid where every bicycle has the output; else NaN."""
    if parameter.sampled or not np.isfinite(y).all():
        return float("nan")
    grid_values = [p.values[:, 0] for p in varied if p is not parameter and not p.sampled]
    variances = pd.DataFrame(y).groupby(grid_values or np.zeros(len(y))).var(ddof=0)
    return float(variances.to_numpy().mean() / y.var())
