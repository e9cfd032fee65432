"""Random numbers, and draws of uncertain parameters that stay physically possible.

Every parameter has a Philox stream of its own, keyed by seed and name, and sample i takes word i of it (Salmon et al.
2011, doi 10.1145/2063384.2063405). A draw depends neither on chunks, engines or order nor on what else is varied.

A quantity x of mean m and standard deviation s is made of a standard normal number g:

- free in sign: x = m + s g;
- with one bound b (at distance d = abs(m - b)), abs(x - b) is lognormal: abs(x - b) = d exp(+-t g - t^2/2), upper sign
  for a lower bound, t^2 = ln(1 + s^2/d^2); its mean is d and its standard deviation s exactly;
- between two bounds a and b, if one is within REACH s: x = a + (b - a) F(Phi(g)), F the inverse distribution function
  of the beta distribution with alpha = p k, beta = (1 - p) k, p = (m - a)/(b - a), k = p (1 - p) (b - a)^2/s^2 - 1;
  else normal;
- with its mean at a bound (no distribution within the bounds has that mean): x = b +- s abs(g), inwards, so that the
  root-mean-square distance to b is s.

Quantities with a joint covariance S get correlated g. Two lognormal ones need t_i t_j rho = +-ln(1 +- S_ij/(d_i d_j))
(lower signs where one of the two has an upper bound), a lognormal and a normal one d_i t_i s_j rho = S_ij (Stein's
lemma); with the other two kinds rho is the stated correlation, which is near. Positive quantities cannot have every
correlation that normal ones can: negative eigenvalues of the matrix of rho are set to zero and its diagonal to 1 again,
so that mean and standard deviation stay exact and the correlation is the nearest of this kind.
"""

import hashlib
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv, ndtr, ndtri

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

WORDS = 4  # 64-bit words a Philox counter gives
REACH = 8.5  # standard deviations; no normal number drawn here is as large
NORMAL, LOGNORMAL, BETA, FOLDED = range(4)


def uniform(*, seed: int, name: str, start: int, stop: int) -> Array:
    """Numbers (stop - start,) in the open interval (0, 1), in steps of 2**-53."""
    name_key = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")
    first = start // WORDS
    stream: Any = np.random.Philox(key=np.array([seed, name_key], np.uint64), counter=first)
    words = stream.random_raw(WORDS * (-(-stop // WORDS) - first))[start - WORDS * first :][: stop - start]
    return np.asarray(((words >> np.uint64(11)).astype(float) + 0.5) * 2.0**-53)


def normal(*, seed: int, name: str, start: int, stop: int) -> Array:
    """Standard normal numbers (stop - start,), the inverse distribution function of :func:`uniform`."""
    return np.asarray(ndtri(uniform(seed=seed, name=name, start=start, stop=stop)))


def possible_moments(name: str, mean: float, sd: float, bounds: tuple[float, float]) -> None:
    """Refuse a mean and standard deviation that no quantity within these bounds has."""
    low, high = bounds
    if np.isinf(mean) and sd > 0:
        raise InputError(f"{name}: its value is infinite, which has no standard deviation; give a finite one")
    if not low <= mean <= high:
        raise InputError(f"{name}: the mean {mean:g} is outside {low:g} .. {high:g}, so no sample is possible")
    between = np.isfinite(low) and np.isfinite(high) and low < mean < high
    most = np.sqrt((mean - low) * (high - mean)) if between else np.inf
    if sd >= most:
        raise InputError(
            f"{name}: nothing between {low:g} and {high:g} with a mean of {mean:g} has a standard deviation of {sd:g}; "
            f"the maximum is {most:.4g}"
        )


class BoundedDraws:
    """Joint draws of n quantities with means (n,) within their bounds, infinite if there is none."""

    def __init__(self, mean: ArrayLike, factor: ArrayLike, bounds: Sequence[tuple[float, float]]) -> None:
        self.mean, self.factor = np.asarray(mean, float), np.asarray(factor, float)
        self.sd = np.hypot.reduce(self.factor, axis=1)
        self.low, self.high = np.asarray(bounds, float).T
        self.kind = np.array([_kind(*row) for row in zip(self.mean, self.sd, self.low, self.high, strict=True)])
        lower = np.isfinite(self.low) & (~np.isfinite(self.high) | (self.mean < self.high))
        self._sign = np.where(lower, 1.0, -1.0)
        self._bound = np.where(lower, self.low, self.high)
        lognormal = self.kind == LOGNORMAL
        self._distance = np.where(lognormal, np.abs(self.mean - self._bound), 1.0)
        with np.errstate(over="ignore"):  # no draw is finite then
            relative = np.where(lognormal, self.sd / self._distance, 1.0)
            self._log_sd = np.where(lognormal, np.sqrt(np.log1p((self.sd / self._distance) ** 2)), 1.0)
            self._signs, self._spreads = np.outer(self._sign, self._sign), np.outer(relative, relative)
        self._products = np.outer(self._log_sd, self._log_sd)
        ratio = np.where(lognormal, self.sd / (self._distance * self._log_sd), 1.0)
        self._ratio = np.maximum.outer(ratio, ratio)
        self._both = np.outer(lognormal, lognormal)
        mixed = np.outer(lognormal, self.kind == NORMAL)
        self._mixed = mixed | mixed.T
        self._unit = self.factor / np.where(self.sd > 0, self.sd, 1.0)[:, None]

    def linear(self, z: Array) -> Array:
        """Normal quantities (n, m) from standard normal ``z`` (n, m), whatever the bounds: mean + factor z."""
        deviations = sum(np.multiply.outer(a, b) for a, b in zip(self.factor.T, z, strict=True))
        return np.asarray(self.mean[:, None] + deviations)

    def __call__(self, z: Array) -> Array:
        """Quantities (n, m) within the bounds from standard normal ``z`` (n, m)."""
        g = np.zeros_like(z)
        for column, part in zip(self.root.T, z, strict=True):  # sums in a fixed order: the same bits for any m
            g += np.multiply.outer(column, part)
        x = np.empty_like(g)
        for i, kind in enumerate(self.kind):
            if kind == NORMAL:
                x[i] = self.mean[i] + self.sd[i] * g[i]
            elif kind == LOGNORMAL:
                t, sign = self._log_sd[i], self._sign[i]
                x[i] = self._bound[i] + sign * self._distance[i] * np.exp(sign * t * g[i] - t * t / 2)
            elif kind == FOLDED:
                x[i] = self._bound[i] + self._sign[i] * self.sd[i] * np.abs(g[i])
            else:
                width = self.high[i] - self.low[i]
                p = (self.mean[i] - self.low[i]) / width
                k = p * (1 - p) * (width / self.sd[i]) ** 2 - 1
                x[i] = self.low[i] + width * betaincinv(p * k, (1 - p) * k, ndtr(g[i]))
        return x

    @cached_property
    def _stated(self) -> Array:
        """Correlation (n, n) as stated."""
        correlation = self._unit @ self._unit.T
        np.fill_diagonal(correlation, 1.0)
        return correlation

    @cached_property
    def root(self) -> Array:
        """Matrix (n, n), rows of length 1: correlated g from independent z, near to the linear ones."""
        if len(self.mean) == 1:
            return np.ones((1, 1))
        correlation = np.where(self._mixed, self._stated * self._ratio, self._stated)
        growth = np.maximum(self._signs * self._stated * self._spreads, -1 + 1e-12)
        correlation = np.clip(
            np.where(self._both, self._signs * np.log1p(growth) / self._products, correlation), -1.0, 1.0
        )
        np.fill_diagonal(correlation, 1.0)
        values, vectors = np.linalg.eigh(correlation)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        root /= np.linalg.norm(root, axis=1)[:, None]
        left, _, right = np.linalg.svd(root.T @ self._unit)
        return np.asarray(root @ left @ right)

    def notes(self, names: Sequence[str]) -> tuple[str, ...]:
        """Remarks on what cannot be drawn as stated, with ``names`` for the quantities."""
        remarks = [
            f"{name} is at the end of its possible range, so its samples lie on one side of it: their root-mean-square "
            f"distance to it is the stated {sd:.3g}"
            for name, kind, sd in zip(names, self.kind, self.sd, strict=True)
            if kind == FOLDED and sd > 0
        ]
        drawn = np.clip(self.root @ self.root.T, -1.0, 1.0)
        growth = np.expm1(np.where(self._both, self._signs * drawn * self._products, 0.0))
        drawn = np.where(self._mixed, drawn / self._ratio, drawn)
        drawn = np.where(self._both, self._signs * growth / self._spreads, drawn)
        if np.abs(drawn - self._stated).max() > 0.01:
            remarks.append(
                f"quantities that keep their sign cannot have the stated correlations of {', '.join(names)}; means and "
                "standard deviations are kept, the correlations are the nearest possible"
            )
        return tuple(remarks)


def _kind(mean: float, sd: float, low: float, high: float) -> int:
    ends = int(np.isfinite(low)) + int(np.isfinite(high))
    if ends and sd > 0 and mean in (low, high):
        return FOLDED
    if ends == 1:
        return LOGNORMAL if sd > 0 else NORMAL
    return BETA if ends == 2 and min(mean - low, high - mean) < REACH * sd else NORMAL


class Refused:
    """Items (m,) that cannot be computed; each is counted once, for the first reason that is found."""

    def __init__(self, count: int) -> None:
        self.mask = np.zeros(count, bool)
        self.reasons: dict[str, NDArray[np.bool_]] = {}
        self.examples: dict[str, str] = {}

    def add(self, why: str, mask: NDArray[np.bool_], example: str = "") -> None:
        """Refuse more items (m,) for a reason, with the message of one of them where the reason is not enough."""
        new = np.broadcast_to(mask, self.mask.shape) & ~self.mask
        if new.any():
            self.reasons[why] = self.reasons.get(why, np.zeros_like(new)) | new
            self.examples.setdefault(why, example)
            self.mask = self.mask | new

    @property
    def counts(self) -> dict[str, int]:
        """Number of refused items by reason."""
        return {self.sentence(why): int(mask.sum()) for why, mask in self.reasons.items()}

    def sentence(self, why: str) -> str:
        """The reason ``why`` with its example."""
        example = self.examples.get(why, "")
        return f"{why}, for example: {example}" if example else why


LEFT_OUT = "{number} of {total} samples rejected as impossible ({why})"


def left_out(counts: Mapping[str, int], total: int) -> str:
    """Remark on how many of ``total`` draws are left out and why, from the number by reason; empty if none is."""
    number = sum(counts.values())
    why = "; ".join(counts if len(counts) == 1 else (f"{count}: {reason}" for reason, count in counts.items()))
    return LEFT_OUT.format(number=number, total=total, why=why) if number else ""
