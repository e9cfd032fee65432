"""Evidence of problems that are linear in normal coordinates."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.inference.parameter import Array

Sums = tuple[Array, Array, float, int]
"""A' A, A' y, y' y and the number of some rows."""


@dataclass(frozen=True, eq=False)
class Linear:
    """Residuals that are linear in normal coordinates: r = r* + A (z - z*)."""

    jacobian: Array  # (n, p), a, in prior standard deviations
    target: Array  # (n,), a z* - r*
    fold: NDArray[np.intp]  # (n,), rows of one fold are held out together

    @cached_property
    def _folds(self) -> dict[int, Sums]:
        """Sums of the rows of each fold, by its number."""
        sums = {}
        for number in np.unique(self.fold):
            a, y = self.jacobian[self.fold == number], self.target[self.fold == number]
            sums[int(number)] = (a.T @ a, a.T @ y, float(y @ y), len(y))
        return sums

    @cached_property
    def _total(self) -> Sums:
        return _add_sums(self._folds.values())

    @cached_property
    def _rests(self) -> tuple[Sums, ...]:
        """Sums of the rows without each fold."""
        return tuple(_add_sums(part for fold, part in self._folds.items() if fold != number) for number in self._folds)

    def posterior(self, columns: NDArray[np.intp], sd: Array | None = None) -> tuple[Array, Array]:
        """Mean (q,) and covariance (q, q) of the coordinates in ``columns``, of prior ``sd`` (1), the others zero."""
        gram, push, _, _ = self._total
        scale = np.ones(len(columns)) if sd is None else sd
        inverse = np.linalg.inv(np.eye(len(columns)) + gram[np.ix_(columns, columns)] * np.outer(scale, scale))
        return scale * (inverse @ (scale * push[columns])), inverse * np.outer(scale, scale)

    def evidence(self, columns: NDArray[np.intp], sd: Array | None = None) -> float:
        """ln of the density of all rows with the coordinates in ``columns``, of prior ``sd`` (1)."""
        return _log_density(self._total, columns, sd)

    def held_out(self, columns: NDArray[np.intp]) -> float:
        """ln of the density of each fold given the others, summed."""
        whole = _log_density(self._total, columns)
        score = sum(whole - _log_density(sums, columns) for sums in self._rests)
        return score if len(self._folds) > 1 and math.isfinite(score) else -math.inf

    def misfit(self, columns: NDArray[np.intp]) -> float:
        """|residual|^2 and penalty that the best coordinates in ``columns`` leave, over the number of rows."""
        gram, push, square, count = self._total
        inner = np.eye(len(columns)) + gram[np.ix_(columns, columns)]
        return (square - float(push[columns] @ np.linalg.solve(inner, push[columns]))) / count

    def with_noise(self, variance: float) -> "Linear":
        """Copy with a larger ``variance`` of the noise."""
        noise = math.sqrt(variance)
        return Linear(self.jacobian / noise, self.target / noise, self.fold)


def _add_sums(parts: Iterable[Sums]) -> Sums:
    gram, push, square, count = zip(*parts, strict=True)
    return np.sum(gram, axis=0), np.sum(push, axis=0), float(sum(square)), int(sum(count))


def _log_density(sums: Sums, columns: NDArray[np.intp], sd: Array | None = None) -> float:
    """ln N(y; 0, 1 + A A') by the matrix inversion lemma; minus infinity if a motion diverges beyond numbers."""
    gram, push, square, count = sums
    scale = np.ones(len(columns)) if sd is None else sd
    inner = np.eye(len(columns)) + gram[np.ix_(columns, columns)] * np.outer(scale, scale)
    pushed = scale * push[columns]
    try:
        value = square - float(pushed @ np.linalg.solve(inner, pushed))
    except np.linalg.LinAlgError:
        return -math.inf
    log_density = -0.5 * (value + float(np.linalg.slogdet(inner)[1]) + count * math.log(2 * math.pi))
    return log_density if math.isfinite(log_density) else -math.inf
