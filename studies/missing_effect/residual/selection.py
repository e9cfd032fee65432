"""Which terms of the residual torque the data ask for: evidence of the linearised problem, and its held-out score.

About a fit the residuals are linear in the coordinates, r = r* + A (z - z*), with z normal a priori. The evidence of
any subset of columns is then exact, and so is the density of rows that are left out: that of all rows over that of
the rest. So terms can be tried by hundreds, and the few that are chosen are fitted again with the full model.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studies.missing_effect.residual.terms import PAIRS, Degrees, Pair, SpeedScale, keys
from tyre.base.arrays import Array

Sums = tuple[Array, Array, float, int]
"""A' A, A' y, y' y and the number of some rows."""

PRICE_PAIR, PRICE_DEGREE = math.log(8), math.log(2)
"""Log prior odds against a further pair of torque and state, of eight, and against a further power of the speed."""


@dataclass(frozen=True, eq=False)
class Linear:
    """Residuals that are linear in normal coordinates.

    Attributes
    ----------
    jacobian : ndarray, shape (n, p)
        A, in prior standard deviations over ``noise``.
    target : ndarray, shape (n,)
        A z* - r*, over ``noise``.
    fold : ndarray of int, shape (n,)
        What is held out together.
    """

    jacobian: Array
    target: Array
    fold: NDArray[np.intp]

    @cached_property
    def _sums(self) -> dict[int, Sums]:
        """A' A, A' y, y' y and the number of the rows of each fold."""
        found = {}
        for number in np.unique(self.fold):
            a, y = self.jacobian[self.fold == number], self.target[self.fold == number]
            found[int(number)] = (a.T @ a, a.T @ y, float(y @ y), len(y))
        return found

    @cached_property
    def _total(self) -> Sums:
        return _added(self._sums.values())

    @cached_property
    def _rests(self) -> tuple[Sums, ...]:
        """Sums of the rows without each fold."""
        return tuple(_added(part for other, part in self._sums.items() if other != number) for number in self._sums)

    def posterior(self, columns: NDArray[np.intp], sd: Array | None = None) -> tuple[Array, Array]:
        """Mean (q,) and covariance (q, q) of the coordinates in ``columns`` (q,), the others being zero.

        Parameters
        ----------
        columns : ndarray of int, shape (q,)
        sd : ndarray, shape (q,), optional
            Prior standard deviations of these coordinates; 1 by default.
        """
        gram, push, _, _ = self._total
        scale = np.ones(len(columns)) if sd is None else sd
        inner = np.eye(len(columns)) + gram[np.ix_(columns, columns)] * np.outer(scale, scale)
        inverse = np.linalg.inv(inner)
        return scale * (inverse @ (scale * push[columns])), inverse * np.outer(scale, scale)

    def evidence(self, columns: NDArray[np.intp], sd: Array | None = None) -> float:
        """ln of the density of all rows with the coordinates in ``columns`` (q,), their prior ``sd`` as above."""
        return _log_density(self._total, columns, sd)

    def held_out(self, columns: NDArray[np.intp]) -> float:
        """ln of the density of each fold given the others, summed, with the coordinates in ``columns`` (q,)."""
        if len(self._sums) == 1:
            return -math.inf
        whole = _log_density(self._total, columns)
        score = sum(whole - _log_density(rest, columns) for rest in self._rests)
        return score if math.isfinite(score) else -math.inf

    def misfit(self, columns: NDArray[np.intp]) -> float:
        """|residual|^2 and penalty that the best coordinates in ``columns`` (q,) leave, over the number of rows."""
        gram, push, square, count = self._total
        inner = np.eye(len(columns)) + gram[np.ix_(columns, columns)]
        return (square - float(push[columns] @ np.linalg.solve(inner, push[columns]))) / count

    def louder(self, noise: float) -> "Linear":
        """The same with the noise larger by a factor ``noise`` (no unit)."""
        return Linear(self.jacobian / noise, self.target / noise, self.fold)


def _added(parts: Iterable[Sums]) -> Sums:
    gram, push, square, count = zip(*parts, strict=True)
    return np.sum(gram, axis=0), np.sum(push, axis=0), float(sum(square)), int(sum(count))


def _log_density(sums: Sums, columns: NDArray[np.intp], sd: Array | None = None) -> float:
    """ln N(y; 0, 1 + A A') by the matrix inversion lemma; minus infinity where a motion runs away beyond numbers."""
    gram, push, square, count = sums
    scale = np.ones(len(columns)) if sd is None else sd
    inner = np.eye(len(columns)) + gram[np.ix_(columns, columns)] * np.outer(scale, scale)
    pushed = scale * push[columns]
    try:
        value = square - float(pushed @ np.linalg.solve(inner, pushed))
    except np.linalg.LinAlgError:
        return -math.inf
    found = -0.5 * (value + float(np.linalg.slogdet(inner)[1]) + count * math.log(2 * math.pi))
    return found if math.isfinite(found) else -math.inf


@dataclass(frozen=True, eq=False)
class Selector:
    """Search over the number of terms of each pair.

    Attributes
    ----------
    linear : Linear
        Columns: what floats anyway, then all terms of ``full``.
    floating : int
        Number of the former.
    scale : SpeedScale
    """

    linear: Linear
    floating: int
    scale: SpeedScale

    @cached_property
    def full(self) -> dict[Pair, int]:
        """All terms that the speeds allow."""
        return dict.fromkeys(PAIRS, self.scale.most)

    def columns(self, degrees: Degrees) -> NDArray[np.intp]:
        """Columns (q,) of what floats anyway and of the terms of ``degrees``."""
        place = {key: self.floating + k for k, key in enumerate(keys(self.full))}
        return np.array([*range(self.floating), *(place[key] for key in keys(degrees))], dtype=np.intp)

    def worth(self, degrees: Degrees) -> float:
        """Log evidence of ``degrees`` with the price of its terms."""
        terms = [count for count in degrees.values() if count]
        price = PRICE_PAIR * len(terms) + PRICE_DEGREE * sum(count - 1 for count in terms)
        return self.linear.evidence(self.columns(degrees)) - price

    def select(self, start: Degrees) -> dict[Pair, int]:
        """Terms added, raised, lowered and dropped from ``start`` while the evidence grows and so does the held-out
        score; at the end each term must earn its held-out score.
        """
        chosen = {pair: count for pair, count in start.items() if count}
        while (better := self._better(chosen)) is not None:
            chosen = better
        return self._earned(chosen)

    def _better(self, chosen: dict[Pair, int]) -> dict[Pair, int] | None:
        now, score = self.worth(chosen), self.linear.held_out(self.columns(chosen))
        tried = sorted(((self.worth(other), k, other) for k, other in enumerate(self._moves(chosen))), reverse=True)
        for worth, _, other in tried:
            if worth <= now:
                return None
            fewer = len(keys(other)) < len(keys(chosen))
            if fewer or self.linear.held_out(self.columns(other)) > score:
                return other
        return None

    def _moves(self, chosen: dict[Pair, int]) -> Iterator[dict[Pair, int]]:
        for pair in PAIRS:
            have = chosen.get(pair, 0)
            for count in {have - 1, have + 1, have + 2, 0} - {have, -1}:
                if count <= self.scale.most:
                    yield {p: n for p, n in (chosen | {pair: count}).items() if n}

    def _earned(self, chosen: dict[Pair, int]) -> dict[Pair, int]:
        """Without the terms whose removal raises the held-out score, the worst first."""
        while chosen:
            score = self.linear.held_out(self.columns(chosen))
            lowered = [_lowered(chosen, pair) for pair in chosen]
            best = max(lowered, key=lambda other: self.linear.held_out(self.columns(other)))
            if self.linear.held_out(self.columns(best)) < score:
                break
            chosen = best
        return chosen

    def without_useless(self, chosen: Degrees) -> dict[Pair, int]:
        """The terms of ``chosen`` less one power of the pair whose last term costs the held-out score most, if any."""
        gains = {pair: gain[1] for (pair, _), gain in self.gains(chosen).items()}
        worst = min(gains, key=lambda pair: gains[pair])
        return dict(chosen) if gains[worst] > 0 else _lowered(chosen, worst)

    def without_weakest(self, chosen: Degrees) -> dict[Pair, int]:
        """The terms of ``chosen`` without the pair whose loss costs the held-out score least."""
        rest = [{p: n for p, n in chosen.items() if p != pair} for pair in chosen]
        return max(rest, key=lambda other: self.linear.held_out(self.columns(other)))

    def gains(self, chosen: Degrees) -> dict[tuple[Pair, int], tuple[float, float]]:
        """What the last term of each pair gains: log evidence, and held-out log score. ``chosen`` has the terms."""
        return {
            (pair, count - 1): (
                _gain(self.linear.evidence, self.columns(chosen), self.columns(_lowered(chosen, pair))),
                _gain(self.linear.held_out, self.columns(chosen), self.columns(_lowered(chosen, pair))),
            )
            for pair, count in chosen.items()
        }


def _gain(measure: Callable[[NDArray[np.intp]], float], these: NDArray[np.intp], others: NDArray[np.intp]) -> float:
    return measure(these) - measure(others)


def _lowered(chosen: Degrees, pair: Pair) -> dict[Pair, int]:
    return {p: n - (p == pair) for p, n in chosen.items() if n - (p == pair)}
