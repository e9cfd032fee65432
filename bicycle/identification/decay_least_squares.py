"""Least squares of a window for each kind of noise: likelihoods, amplitudes and their covariance."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.decay_window import SHARES
from tyre.base.arrays import Array


@dataclass(frozen=True)
class Linear:
    """Amplitudes given eigenvalues: ``mean`` (points, channels, p), ``covariance`` (points, channels, p, channels, p).

    The order is cos, sin of each mode, a real mode, then the polynomials of the drift; in units of each channel's
    scale.
    """

    mean: Array
    covariance: Array

    def sorted(self, order: NDArray[np.intp]) -> "Linear":
        """With the modes in this ``order`` (m,)."""
        places = np.arange(self.mean.shape[-1])
        places[: 2 * order.size] = np.stack([2 * order, 2 * order + 1], 1).ravel()
        return Linear(self.mean[..., places], self.covariance[:, :, places][..., places])


@dataclass(frozen=True)
class Least:
    """Least squares of one kind of noise: log likelihood, normal equations, right sides, sums of squares."""

    log: Array
    gram: Array
    right: Array
    squares: Array

    def at(self, kept: Array) -> "Least":
        """Those of the points that are ``kept`` (points,)."""
        return Least(self.log[kept], self.gram[kept], self.right[kept], self.squares[kept])


@dataclass(frozen=True)
class Noise:
    """The most probable kind at one point: colours (c,) of the sensors' by number, or the share of driven modes."""

    colours: NDArray[np.intp]
    share: int | None


@dataclass(frozen=True)
class Solved:
    """Least squares at some eigenvalues.

    Attributes
    ----------
    own : Least
        For the noise of each sensor, (points, colours, channels).
    driven : Least, optional
        For driven modes, (points, shares).
    samples : int
        Of one channel.
    prior : float
        Probability of driven modes before the samples are seen, where there is ``driven``.
    """

    own: Least
    driven: Least | None
    samples: int
    prior: float = 0.5

    def at(self, kept: Array) -> "Solved":
        """At the points that are ``kept`` (points,)."""
        driven = None if self.driven is None else self.driven.at(kept)
        return Solved(self.own.at(kept), driven, self.samples, self.prior)

    def log(self) -> Array:
        """Log of the marginal likelihood, shape (points,)."""
        return np.asarray(np.logaddexp(*self._parts()))

    def chances_driven(self) -> Array:
        """Probability of each share of driven modes at each point, shape (points, shares)."""
        if self.driven is None:
            return np.zeros((len(self.own.log), SHARES.size))
        return np.exp(self.driven.log + math.log(self.prior) - self.log()[:, None])

    def _parts(self) -> tuple[Array, Array]:
        """Log of the marginal likelihood with noise of the sensors alone and with driven modes, (points,) each."""
        own = log_sum(np.swapaxes(self.own.log, 0, 1)).sum(-1)
        if self.driven is None:
            return own, np.full(len(own), -math.inf)
        driven = log_sum(self.driven.log.T)
        if self.prior == 1:
            return np.full(len(own), -math.inf), driven
        return own + math.log(1 - self.prior), driven + math.log(self.prior)

    def most_probable(self) -> Noise:
        """Noise at the first point."""
        share = self.driven.log[0].argmax() if self.driven is not None and 0 in self._driven_at() else None
        return Noise(self.own.log[0].argmax(0), None if share is None else int(share))

    def _driven_at(self) -> NDArray[np.intp]:
        """Indices of the points at which driven modes are more probable than noise of the sensors alone."""
        own, driven = self._parts()
        return np.flatnonzero(driven > own)

    def linear(self) -> Linear:
        """Amplitudes with the most probable noise."""
        own, driven = self.own, self.driven
        count, _, channels = own.log.shape
        points, places = np.indices((count, channels))
        best = own.log.argmax(axis=1)
        chosen = own.gram[points, best, places]
        mean = np.linalg.solve(chosen, own.right[points, best, places][..., None])[..., 0]
        inverse = np.linalg.inv(chosen) * (own.squares[points, best, places] / self.samples)[..., None, None]
        covariance = np.einsum("pcij,cd->pcidj", inverse, np.eye(channels))
        if driven is not None:
            one, best = self._driven_at(), driven.log.argmax(1)
            chosen, right = driven.gram[one, best[one]], driven.right[one, best[one]]
            mean[one] = np.linalg.solve(chosen, right[..., None])[..., 0].reshape(-1, *mean.shape[1:])
            spread = (driven.squares[one, best[one]] / (self.samples * channels))[:, None, None]
            covariance[one] = (np.linalg.inv(chosen) * spread).reshape(-1, *covariance.shape[1:])
        return Linear(mean, covariance)


def log_sum(logs: Array) -> Array:
    """Logarithm of the sum of exponentials along the first axis of ``logs``, shape (k, ...)."""
    top = logs.max(0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(0)))
