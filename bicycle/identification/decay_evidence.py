"""How probable the samples of a window are, given the eigenvalues of its modes and the kind of its drift.

Each channel is y = sum over modes e^(sigma t) (a cos(omega t) + b sin(omega t)) + drift + noise. The noise is a
first-order autoregression of unknown sd s and coefficient, or a driven mode (:mod:`.decay_noise`). Amplitudes, drift
and s are integrated out in closed form and the kinds of noise summed, so that only sigma and omega are left (linear
model with conjugate priors: O'Hagan & Forster, Kendall's Advanced Theory of Statistics 2B, 2nd ed., ch. 11). Priors:
amplitudes as large as three times the signal, in the plane that a mode spans; an offset as large as the signal, a slope
and a bend of a tenth; log s even.

The precision matrix of a first-order autoregression has three diagonals, so the products with it for all coefficients
follow from three sums over the samples.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammaln

from bicycle.identification.decay_noise import Driven, counted
from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

AMPLITUDE = 3.0  # prior sd of a mode in units of the signal's sd
DRIVEN = 0.1  # prior probability that the mode is driven all along the window
BEND = 0.1  # prior sd of slope and bend of a drift in the same units, each over the whole window
DRIFTS = {"none": 0, "constant": 1, "parabola": 3}
"""Kinds of drift and how many polynomials each has."""


@dataclass(frozen=True)
class Linear:
    """Amplitudes given eigenvalues: ``mean`` (points, channels, p) and ``covariance`` (points, channels, p, p).

    The order is cos, sin of each mode, then the polynomials of the drift; in units of each channel's scale.
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True)
class Evidence:
    """Marginal likelihood of one ``window`` with one kind of ``drift``; ``noise`` (c,) is about the sd of the noise.

    The priors of amplitudes and drift are given in units of ``noise``, which makes them conjugate.
    """

    window: Window
    drift: str
    noise: Array
    driven: Driven | None = None
    weight: float = 1.0

    def weighed(self, modes: Array) -> "Evidence":
        """The same with the evidence of the channels counted as at these ``modes`` (m, 2): see :func:`.counted`."""
        if self.driven is None or len(self.window.channels) == 1:
            return self
        each = self._solve(modes[None])[0][0]
        share = np.exp(each - each.max(0))
        return replace(self, weight=counted(share / share.sum(0), len(self.window.colours)))

    def log(self, modes: Array) -> Array:
        """Log of the marginal likelihood.

        Parameters
        ----------
        modes : ndarray, shape (points, m, 2)
            sigma (1/s) and omega (rad/s) of each mode.

        Returns
        -------
        ndarray, shape (points,)
        """
        each, _, _ = self._solve(modes)
        return np.asarray(self.weight * log_sum(np.swapaxes(each, 0, 1)).sum(-1))

    def linear(self, modes: Array) -> Linear:
        """Amplitudes with the most probable colour of each channel; ``modes`` (points, m, 2) as in :meth:`log`."""
        each, (gram, right), squares = self._solve(modes)
        points, channels = np.indices((len(modes), each.shape[2]))
        best = each.argmax(axis=1)
        chosen = gram[points, best, channels]
        mean = np.linalg.solve(chosen, right[points, best, channels][..., None])[..., 0]
        variance = squares[points, best, channels] / len(self.window.time)
        return Linear(mean, np.linalg.inv(chosen) * variance[..., None, None])

    def _prior(self, noises: int) -> Array:
        """Log prior of each noise, even among those of the sensors and among the driven ones."""
        own = len(self.window.colours)
        driven = DRIVEN if noises > own else 0.0
        more = [driven / (noises - own)] * (noises - own) if driven else []
        return np.log([*[(1 - driven) / own] * own, *more])

    def _solve(self, modes: Array) -> tuple[Array, tuple[Array, Array], Array]:
        """Log likelihood by point, colour and channel, normal equations, and sums of squares that are left."""
        w = self.window
        n, kept = len(w.time), DRIFTS[self.drift]
        waves = basis(modes, w.time)
        p = waves.shape[2]
        fixed = np.concatenate([w.drift[:, :kept], w.signals], 1)
        plain, ends, lagged = _products(waves, fixed)
        phi = w.colours[None, :, None, None]
        whole = (plain[:, None] * (1 + phi**2) - phi**2 * ends[:, None] - phi * lagged[:, None]) / (1 - phi**2)
        h = p + kept
        ridge = np.zeros((len(modes), w.signals.shape[1], h, h))
        own = plain[:, :p, :p] / n
        ridge[:, :, :p, :p] = own[:, None] * ((self.noise / AMPLITUDE) ** 2)[None, :, None, None]
        level = np.maximum(1.0, np.abs(w.signals.mean(0)))  # an offset may be larger than the motion
        for k in range(kept):
            ridge[:, :, p + k, p + k] = (self.noise / (level if k == 0 else BEND)) ** 2
        gram = whole[:, :, None, :h, :h] + ridge[:, None]
        right = np.swapaxes(whole[:, :, :h, h:], 2, 3)  # (points, noises, channels, h)
        total = np.diagonal(whole[:, :, h:, h:], axis1=2, axis2=3)
        spread = np.broadcast_to((n - 1) * np.log(1 - w.colours**2)[:, None], total.shape[1:])
        if self.driven is not None:
            more_gram, more_right, more_total = _dense(waves, fixed, kept, self.driven)
            gram = np.concatenate([gram, more_gram + ridge[:, None]], 1)
            right, total = np.concatenate([right, more_right], 1), np.concatenate([total, more_total], 1)
            spread = np.concatenate([spread, self.driven.logdet])
        solved = np.linalg.solve(gram, right[..., None])[..., 0]
        squares = np.maximum(total - (right * solved).sum(-1), 1e-13 * total)
        logdet = np.linalg.slogdet(gram)[1] - np.linalg.slogdet(ridge)[1][:, None]
        each = (
            gammaln(n / 2)
            - 0.5 * (n * np.log(math.pi * squares) + logdet + spread)
            + self._prior(gram.shape[1])[:, None]
        )
        return each, (gram, right), squares


@np.errstate(over="ignore", invalid="ignore")  # a trial that grows all through a long recording
def basis(modes: Array, time: Array) -> Array:
    """Decaying cosines and sines.

    Parameters
    ----------
    modes : ndarray, shape (points, m, 2)
        sigma (1/s) and omega (rad/s).
    time : ndarray, shape (n,)
        s.

    Returns
    -------
    ndarray, shape (points, n, 2 m)
    """
    root = modes[..., 0] + 1j * modes[..., 1]
    wave = np.exp(root[:, None] * time[None, :, None])
    return np.stack([wave.real, wave.imag], -1).reshape(len(modes), len(time), -1)


def _dense(waves: Array, fixed: Array, kept: int, driven: Driven) -> tuple[Array, Array, Array]:
    """Normal equations, right sides and squares for driven noise."""
    points, n, p = waves.shape
    h, channels, shares = p + kept, fixed.shape[1] - kept, len(driven.precision)
    gram = np.empty((points, shares, channels, h, h))
    right = np.empty((points, shares, channels, h))
    total = np.empty((points, shares, channels))
    flat = waves.transpose(1, 0, 2).reshape(n, -1)
    for kind, those in enumerate(driven.kinds):
        columns = [*range(kept), *(kept + place for place in those)]
        known, at = fixed[:, columns], list(those)
        for share in range(shares):
            precision = driven.precision[share, kind]
            turned = (precision @ flat).reshape(n, points, p).transpose(1, 2, 0)  # (points, p, n)
            own, cross = known.T @ precision @ known, turned @ known
            gram[:, share, at, :p, :p] = (turned @ waves)[:, None]
            gram[:, share, at, :p, p:] = cross[:, None, :, :kept]
            gram[:, share, at, p:, :p] = np.swapaxes(cross[..., :kept], 1, 2)[:, None]
            gram[:, share, at, p:, p:] = own[:kept, :kept]
            right[:, share, at, :p] = np.swapaxes(cross[..., kept:], 1, 2)
            right[:, share, at, p:] = own[kept:, :kept]
            total[:, share, at] = np.diag(own)[kept:]
    return gram, right, total


def log_sum(logs: Array) -> Array:
    """Logarithm of the sum of exponentials along the first axis of ``logs``, shape (k, ...)."""
    top = logs.max(0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(0)))


def _products(waves: Array, fixed: Array) -> tuple[Array, Array, Array]:
    """Sums over the samples of products of columns: of one sample, of the two at the ends, of neighbours twice."""
    points, _, p = waves.shape
    size = p + fixed.shape[1]

    def product(left: Array, right: Array, a: Array, b: Array) -> Array:
        found = np.empty((points, size, size))
        turned = np.swapaxes(left, 1, 2)
        found[:, :p, :p] = turned @ right
        found[:, :p, p:] = turned @ b
        found[:, p:, :p] = a.T @ right
        found[:, p:, p:] = a.T @ b
        return found

    plain = product(waves, waves, fixed, fixed)
    lag = product(waves[:, 1:], waves[:, :-1], fixed[1:], fixed[:-1])
    tips = [0, -1]
    ends = product(waves[:, tips], waves[:, tips], fixed[tips], fixed[tips])
    return plain, ends, lag + np.swapaxes(lag, 1, 2)
