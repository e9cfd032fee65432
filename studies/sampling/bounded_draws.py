"""Random quantities that stay physically possible, with the mean, standard deviation and correlation that are stated.

A quantity x of mean m and standard deviation s is made of a standard normal number g:

- free in sign: x = m + s g;
- with one bound b (at distance d = abs(m - b)), abs(x - b) is lognormal: abs(x - b) = d exp(+-t g - t^2/2), upper sign
  for a lower bound, t^2 = ln(1 + s^2/d^2); its mean is d and its standard deviation s exactly, its median d
  exp(-t^2/2);
- between two bounds a and b, if one is within REACH s: x = a + (b - a) F(Phi(g)), F the inverse distribution function
  of the beta distribution with alpha = p k, beta = (1 - p) k, p = (m - a)/(b - a), k = p (1 - p) (b - a)^2/s^2 - 1;
  else normal;
- with its mean at a bound (no distribution within the bounds has that mean): x = b +- s abs(g), inwards, so that the
  root-mean-square distance to b is s.

Quantities with a joint covariance S get correlated g. Two lognormal ones need t_i t_j rho = +-ln(1 +- S_ij/(d_i d_j))
(lower signs where one of the two has an upper bound), a lognormal and a normal one d_i t_i s_j rho = S_ij (Stein's
lemma); with the other two kinds rho is the stated correlation, which is near. Positive quantities cannot have every
correlation that normal ones can: where the matrix of rho has negative eigenvalues these are set to zero and its
diagonal to 1 again, so that mean and standard deviation stay exact and the correlation is the nearest of this kind;
:meth:`BoundedDraws.notes` says so.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaincinv, ndtr

from tyre.base.arrays import Array
from tyre.base.errors import InputError

REACH = 8.5  # standard deviations; no normal number drawn here is as large
FREE = (-np.inf, np.inf)
MISSED = 0.01  # of a correlation, that is worth a word
NORMAL, LOGNORMAL, BETA, FOLDED = range(4)


def possible_moments(name: str, mean: float, sd: float, bounds: tuple[float, float]) -> None:
    """Refuse a mean and standard deviation that no quantity within these bounds has.

    Parameters
    ----------
    name : str
        In the message.
    mean, sd : float
        In the unit of the quantity.
    bounds : pair of float
        Lowest and highest possible value, in the same unit.

    Raises
    ------
    InputError
        The mean is outside, or between two bounds the standard deviation is too large.
    """
    low, high = bounds
    if np.isinf(mean) and sd > 0:
        raise InputError(f"{name}: its value is infinite, which has no standard deviation; give a finite one")
    if not low <= mean <= high:
        raise InputError(f"{name}: the mean {mean:g} is outside {low:g} .. {high:g}, so no draw could be possible")
    between = np.isfinite(low) and np.isfinite(high) and low < mean < high
    most = np.sqrt((mean - low) * (high - mean)) if between else np.inf
    if sd >= most:
        raise InputError(
            f"{name}: nothing between {low:g} and {high:g} with a mean of {mean:g} has a standard deviation of {sd:g}; "
            f"it is always below {most:.4g}"
        )


class BoundedDraws:
    """Joint draws of some quantities within their bounds.

    Parameters
    ----------
    mean : array_like, shape (n,)
    factor : array_like, shape (n, n)
        Its product with its transpose is the covariance.
    bounds : sequence of (low, high)
        Possible values; infinite where there is no bound.
    """

    def __init__(self, mean: ArrayLike, factor: ArrayLike, bounds: Sequence[tuple[float, float]]) -> None:
        self.mean, self.factor = np.asarray(mean, float), np.asarray(factor, float)
        self.sd = np.hypot.reduce(self.factor, axis=1)
        self.low, self.high = np.asarray(bounds, float).T
        self.kind = np.array([_kind(*row) for row in zip(self.mean, self.sd, self.low, self.high, strict=True)])
        lower = np.isfinite(self.low) & (~np.isfinite(self.high) | (self.mean < self.high))
        self._sign = np.where(lower, 1.0, -1.0)
        self._bound = np.where(lower, self.low, self.high)
        self._distance = np.where(self.kind == LOGNORMAL, np.abs(self.mean - self._bound), 1.0)
        with np.errstate(over="ignore"):  # no draw is finite then
            self._log_sd = np.sqrt(np.log1p((self.sd / self._distance) ** 2))

    def linear(self, z: Array) -> Array:
        """Normal quantities (n, m) from standard normal ``z`` (n, m), whatever the bounds: mean + factor z."""
        return np.asarray(
            self.mean[:, None] + sum(np.multiply.outer(a, b) for a, b in zip(self.factor.T, z, strict=True))
        )

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
                x[i] = self._beta(i, g[i])
        return x

    def _beta(self, i: int, g: Array) -> Array:
        width = self.high[i] - self.low[i]
        p = (self.mean[i] - self.low[i]) / width
        k = p * (1 - p) * (width / self.sd[i]) ** 2 - 1
        return np.asarray(self.low[i] + width * betaincinv(p * k, (1 - p) * k, ndtr(g)))

    @cached_property
    def root(self) -> Array:
        """Matrix (n, n), rows of length 1: correlated g from independent z, near to the linear ones."""
        if len(self.mean) == 1:
            return np.ones((1, 1))
        values, vectors = np.linalg.eigh(self._wanted)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        root /= np.linalg.norm(root, axis=1)[:, None]
        left, _, right = np.linalg.svd(root.T @ (self.factor / np.where(self.sd > 0, self.sd, 1.0)[:, None]))
        return np.asarray(root @ left @ right)

    @cached_property
    def _correlation(self) -> Array:
        unit = self.factor / np.where(self.sd > 0, self.sd, 1.0)[:, None]
        found = unit @ unit.T
        np.fill_diagonal(found, 1.0)
        return found

    @cached_property
    def _wanted(self) -> Array:
        """Correlation (n, n) of g that gives the stated one of the quantities; perhaps no correlation matrix."""
        stated = self._correlation
        wanted = np.where(self._mixed, stated * self._ratio, stated)
        growth = np.maximum(self._signs * stated * self._spreads, -1 + 1e-12)
        wanted = np.where(self._both, self._signs * np.log1p(growth) / self._products, wanted)
        wanted = np.clip(wanted, -1.0, 1.0)
        np.fill_diagonal(wanted, 1.0)
        return np.asarray(wanted)

    @property
    def _drawn(self) -> Array:
        """Correlation (n, n) of the quantities as drawn; that of g where one is neither normal nor lognormal."""
        found = np.clip(self.root @ self.root.T, -1.0, 1.0)
        growth = np.expm1(np.where(self._both, self._signs * found * self._products, 0.0))
        found = np.where(self._mixed, found / self._ratio, found)
        return np.asarray(np.where(self._both, self._signs * growth / self._spreads, found))

    @cached_property
    def _both(self) -> NDArray[np.bool_]:
        """Pairs of lognormal quantities."""
        lognormal = self.kind == LOGNORMAL
        return np.outer(lognormal, lognormal)

    @cached_property
    def _mixed(self) -> NDArray[np.bool_]:
        """Pairs of a lognormal and a normal quantity."""
        lognormal, normal = self.kind == LOGNORMAL, self.kind == NORMAL
        return np.outer(lognormal, normal) | np.outer(normal, lognormal)

    @cached_property
    def _ratio(self) -> Array:
        """s / (d t) of the lognormal one of a pair, at least 1."""
        own = np.where(self.kind == LOGNORMAL, self.sd / (self._distance * self._log_sd_or_one), 1.0)
        return np.maximum.outer(own, own)

    @property
    def _log_sd_or_one(self) -> Array:
        return np.where(self.kind == LOGNORMAL, self._log_sd, 1.0)

    @property
    def _products(self) -> Array:
        return np.outer(self._log_sd_or_one, self._log_sd_or_one)

    @property
    def _signs(self) -> Array:
        return np.outer(self._sign, self._sign)

    @property
    def _spreads(self) -> Array:
        relative = np.where(self.kind == LOGNORMAL, self.sd / self._distance, 1.0)
        return np.outer(relative, relative)

    def notes(self, names: Sequence[str]) -> tuple[str, ...]:
        """What cannot be had as stated, in words that call the quantities ``names``."""
        said = [
            f"{name} stands at the end of what is possible, so its draws lie on one side of it: "
            f"their root-mean-square distance to it is the stated {sd:.3g}"
            for name, kind, sd in zip(names, self.kind, self.sd, strict=True)
            if kind == FOLDED and sd > 0
        ]
        away = np.abs(self._drawn - self._correlation).max()
        if away > MISSED:
            said.append(
                f"quantities that keep their sign cannot have the stated correlations of {', '.join(names)}; "
                "means and standard deviations are kept, the correlations are the nearest that can be had"
            )
        return tuple(said)


def _kind(mean: float, sd: float, low: float, high: float) -> int:
    ends = int(np.isfinite(low)) + int(np.isfinite(high))
    if ends and sd > 0 and mean in (low, high):
        return FOLDED
    if ends == 1:
        return LOGNORMAL if sd > 0 else NORMAL
    return BETA if ends == 2 and min(mean - low, high - mean) < REACH * sd else NORMAL
