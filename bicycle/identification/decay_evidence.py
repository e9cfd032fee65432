"""How probable the samples of a window are, given the eigenvalues of its modes and the kind of its drift.

Each channel is y = sum over modes e^(sigma t) (a cos(omega t) + b sin(omega t)) + drift + noise. The drift is a
polynomial, or an offset and a real mode that dies out (capsize, castering). The noise is a first-order autoregression
of unknown sd s and coefficient in each channel, or white with driven modes that all channels share
(:mod:`.decay_noise`). Amplitudes, drift and s are integrated out in closed form and the kinds of noise summed, so that
only eigenvalues are left (linear model with conjugate priors: O'Hagan & Forster, Kendall's Advanced Theory of
Statistics 2B, 2nd ed., ch. 11). Priors: amplitudes as large as three times the signal, in the plane that a mode spans;
an offset as large as the signal, a slope and a real mode of 0.3, a bend of 0.1 of it; log s even.

The precision matrix of a first-order autoregression has three diagonals, so the products with it for all coefficients
follow from three sums over the samples; driven modes move the samples along few directions.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from bicycle.identification.decay_noise import Driven
from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

AMPLITUDE = 3.0  # prior sd of a mode in units of the signal's sd
DRIVEN = 0.5  # prior probability that the modes are driven all along the window
POLYNOMIALS = (1.0, 0.3, 0.1)  # prior sd of offset, slope and bend of a drift in the same units, rms over the window
REAL = 0.3  # that of a real mode
TWINS = 1e-12  # of a diagonal: two equal modes leave it regular
EXPONENTIAL = "exponential"
DRIFTS = {"none": 0, "constant": 1, "parabola": 3, EXPONENTIAL: 1}
"""Kinds of drift and how many polynomials each has; the last has a real mode beside."""


@dataclass(frozen=True)
class Linear:
    """Amplitudes given eigenvalues: ``mean`` (points, channels, p), ``covariance`` (points, channels, p, channels, p).

    The order is cos, sin of each mode, a real mode, then the polynomials of the drift; in units of each channel's
    scale.
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True)
class _Solved:
    """Least squares of one kind of noise: log likelihood, normal equations, right sides, sums of squares."""

    log: Array
    gram: Array
    right: Array
    squares: Array


@dataclass(frozen=True)
class Evidence:
    """Marginal likelihood of one ``window`` with one kind of ``drift``; ``noise`` (c,) is about the sd of the noise.

    The priors of amplitudes and drift are given in units of ``noise``, which makes them conjugate.
    """

    window: Window
    drift: str
    noise: Array
    driven: Driven | None = None

    def log(self, modes: Array, rates: Array | None = None) -> Array:
        """Log of the marginal likelihood.

        Parameters
        ----------
        modes : ndarray, shape (points, m, 2)
            sigma (1/s) and omega (rad/s) of each mode.
        rates : ndarray, shape (points,), optional
            Decay of the real mode, 1/s; for an exponential drift.

        Returns
        -------
        ndarray, shape (points,)
        """
        own, driven = self._solve(modes, rates)
        total = log_sum(np.swapaxes(own.log, 0, 1)).sum(-1)
        if driven is None:
            return np.asarray(total)
        return np.asarray(np.logaddexp(total + math.log(1 - DRIVEN), log_sum(driven.log.T) + math.log(DRIVEN)))

    def linear(self, modes: Array, rates: Array | None = None) -> Linear:
        """Amplitudes with the most probable noise; ``modes`` (points, m, 2) and ``rates`` (points,) as :meth:`log`."""
        own, driven = self._solve(modes, rates)
        n, channels = self.window.signals.shape
        points, places = np.indices((len(modes), channels))
        best = own.log.argmax(axis=1)
        chosen = own.gram[points, best, places]
        mean = np.linalg.solve(chosen, own.right[points, best, places][..., None])[..., 0]
        inverse = np.linalg.inv(chosen) * (own.squares[points, best, places] / n)[..., None, None]
        covariance = np.einsum("pcij,cd->pcidj", inverse, np.eye(channels))
        if driven is not None:
            total, best = log_sum(np.swapaxes(own.log, 0, 1)).sum(-1), driven.log.argmax(1)
            one = np.flatnonzero(log_sum(driven.log.T) + math.log(DRIVEN) > total + math.log(1 - DRIVEN))
            chosen, right = driven.gram[one, best[one]], driven.right[one, best[one]]
            mean[one] = np.linalg.solve(chosen, right[..., None])[..., 0].reshape(-1, *mean.shape[1:])
            spread = (driven.squares[one, best[one]] / (n * channels))[:, None, None]
            covariance[one] = (np.linalg.inv(chosen) * spread).reshape(-1, *covariance.shape[1:])
        return Linear(mean, covariance)

    def _solve(self, modes: Array, rates: Array | None) -> tuple[_Solved, _Solved | None]:
        """For the noise of each sensor, (points, colours, channels), and for driven modes, (points, shares)."""
        w = self.window
        n, kept = len(w.time), DRIFTS[self.drift]
        waves = basis(modes, w.time, rates)
        p = waves.shape[2]
        fixed = np.concatenate([w.drift[:, :kept], w.signals], 1)
        plain, ends, lagged = _products(waves, fixed)
        ridge = self._ridge(plain, 2 * modes.shape[1], p)
        h = p + kept
        phi = w.colours[None, :, None, None]
        whole = (plain[:, None] * (1 + phi**2) - phi**2 * ends[:, None] - phi * lagged[:, None]) / (1 - phi**2)
        gram = whole[:, :, None, :h, :h] + (ridge * (self.noise**2)[:, None, None])[:, None]
        right = np.swapaxes(whole[:, :, :h, h:], 2, 3)  # (points, noises, channels, h)
        total = np.diagonal(whole[:, :, h:, h:], axis1=2, axis2=3)
        spread = np.broadcast_to((n - 1) * np.log(1 - w.colours**2)[:, None], total.shape[1:])
        logdet = np.linalg.slogdet(ridge)[1] + 2 * h * np.log(self.noise)
        own = _left(gram, right, total, spread - logdet[:, None], n)
        own = _Solved(own.log - math.log(len(w.colours)), own.gram, own.right, own.squares)
        return own, None if self.driven is None else self._shared(self.driven, waves, plain, ridge)

    def _ridge(self, plain: Array, oscillating: int, p: int) -> Array:
        """Prior precision of the amplitudes (points, channels, h, h), in units of the noise."""
        w = self.window
        n, kept = len(w.time), DRIFTS[self.drift]
        ridge = np.zeros((len(plain), w.signals.shape[1], p + kept, p + kept))
        own = plain[:, :p, :p] / n * (1 + TWINS * np.eye(p))
        ridge[:, :, :oscillating, :oscillating] = own[:, None, :oscillating, :oscillating] / AMPLITUDE**2
        if p > oscillating:
            ridge[:, :, -1 - kept, -1 - kept] = own[:, None, -1, -1] / REAL**2
        level = np.maximum(1.0, np.abs(w.signals.mean(0)))  # an offset may be larger than the motion
        for k in range(kept):
            ridge[:, :, p + k, p + k] = 1 / (POLYNOMIALS[k] * (level if k == 0 else 1.0)) ** 2
        return ridge

    def _shared(self, driven: Driven, waves: Array, plain: Array, ridge: Array) -> _Solved:
        """Least squares over all channels at once, for driven modes."""
        w = self.window
        n, channels = w.signals.shape
        points, _, p = waves.shape
        kept = DRIFTS[self.drift]
        h, r = p + kept, driven.variances.shape[1]
        gram = np.zeros((points, channels, h, channels, h))
        right, along = np.empty((points, channels, h)), np.empty((points, r, channels, h))
        scaled = w.signals / driven.level
        of_signals = np.einsum("cnr,nc->r", driven.directions, scaled)
        beside = scaled - np.einsum("cnr,r->nc", driven.directions, of_signals)  # what no driven mode moves
        for k, level in enumerate(driven.level):
            gram[:, k, :, k] = plain[:, :h, :h] / level**2 + ridge[:, k]
            turned = driven.directions[k].T / level  # (r, n)
            along[:, :, k, :p] = turned @ waves
            along[:, :, k, p:] = turned @ w.drift[:, :kept]
            right[:, k, :p] = beside[:, k] @ waves / level
            right[:, k, p:] = beside[:, k] @ w.drift[:, :kept] / level
        size = channels * h
        flat, along = gram.reshape(points, size, size), along.reshape(points, r, size)
        left = 1 / (1 + driven.variances)  # (shares, r)
        grams = flat[:, None] - np.swapaxes(along, 1, 2)[:, None] @ (along[:, None] * (1 - left)[:, :, None])
        rights = right.reshape(points, 1, size) + np.einsum("fr,prs->pfs", left * of_signals, along)
        totals = np.broadcast_to((beside**2).sum() + left @ of_signals**2, grams.shape[:2])
        spread = np.log1p(driven.variances).sum(1) + 2 * n * np.log(driven.level).sum()
        # one of the levels is integrated, the others are known to sqrt(1 / 2n); white is one of the sensors' colours
        spread = spread - (channels - 1) * math.log(math.pi / n) + 2 * channels * math.log(len(w.colours))
        found = _left(grams, rights, totals, spread - np.linalg.slogdet(ridge)[1].sum(1)[:, None], n * channels)
        return _Solved(found.log - math.log(len(left)), found.gram, found.right, found.squares)


def _left(gram: Array, right: Array, total: Array, logdet: Array, count: int) -> _Solved:
    """Marginal likelihood of ``count`` samples with what least squares leave, and those least squares."""
    gram = gram * (1 + TWINS * np.eye(gram.shape[-1]))
    solved = np.linalg.solve(gram, right[..., None])[..., 0]
    squares = np.maximum(total - (right * solved).sum(-1), 1e-13 * total)
    spread = np.linalg.slogdet(gram)[1] + logdet
    log = gammaln(count / 2) - 0.5 * (count * np.log(math.pi * squares) + spread)
    return _Solved(log, gram, right, squares)


@np.errstate(over="ignore", invalid="ignore")  # a trial that grows all through a long recording
def basis(modes: Array, time: Array, rates: Array | None = None) -> Array:
    """Decaying cosines and sines, and perhaps a real mode.

    Parameters
    ----------
    modes : ndarray, shape (points, m, 2)
        sigma (1/s) and omega (rad/s).
    time : ndarray, shape (n,)
        s.
    rates : ndarray, shape (points,), optional
        Decay of the real mode, 1/s.

    Returns
    -------
    ndarray, shape (points, n, 2 m), or 2 m + 1 with a real mode
    """
    root = modes[..., 0] + 1j * modes[..., 1]
    wave = np.exp(root[:, None] * time[None, :, None])
    waves = np.stack([wave.real, wave.imag], -1).reshape(len(modes), len(time), -1)
    if rates is None:
        return waves
    return np.concatenate([waves, np.exp(-rates[:, None] * time)[..., None]], 2)


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
