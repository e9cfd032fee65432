"""How probable the samples of a window are, given the eigenvalues of its modes and the kind of its drift.

Each channel is y = sum over modes e^(sigma t) (a cos(omega t) + b sin(omega t)) + drift + noise. The drift is a
polynomial, or an offset and a real mode that dies out (capsize, castering), or a parabola (a slow capsize) and one
that does. The noise is a first-order autoregression
of unknown sd s and coefficient in each channel, or white with driven modes that all channels share
(:mod:`.decay_noise`). Amplitudes, drift and s are integrated out in closed form and the kinds of noise summed, so that
only eigenvalues are left (linear model with conjugate priors: O'Hagan & Forster, Kendall's Advanced Theory of
Statistics 2B, 2nd ed., ch. 11). Priors: amplitudes as large as three times the signal, in the plane that a mode spans;
an offset as large as the signal, a real mode of 0.3 of it, slope and bend of three sizes (:data:`KINDS`); log s even.

The precision matrix of a first-order autoregression has three diagonals, so the products with it for all coefficients
follow from three sums over the samples; driven modes move the samples along few directions.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from bicycle.identification.decay_least_squares import Least, Solved
from bicycle.identification.decay_noise import Driven
from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

AMPLITUDE = 3.0  # prior sd of a mode in units of the signal's sd
TWINS = 1e-12  # of a diagonal: two equal modes leave it regular
PLAIN = {
    "none": (), "constant": (1.0,), "parabola": (1.0, 0.3, 0.1), "parabola/3": (1.0, 0.1, 0.03),
    "parabola/10": (1.0, 0.03, 0.01),
}  # fmt: skip
WITH_REAL_MODE = {
    "exponential": (1.0,), "parabola-exponential": (1.0, 0.1, 0.03), "parabola-exponential/3": (1.0, 0.03, 0.01),
}  # fmt: skip
KINDS = PLAIN | WITH_REAL_MODE
"""Kinds of drift and the prior sd of offset, slope and bend of each in the same units, rms over the window; the last
have a real mode beside. A prior that is much too large is evidence against what is slight, so there are several sizes
of those that may be."""

REAL = 0.3  # prior sd of a real mode in these units


def drift_of(kind: str) -> str:
    """Name of the drift of a ``kind``, without its size."""
    return kind.partition("/")[0]


DRIFTS = tuple(dict.fromkeys(map(drift_of, KINDS)))
"""Names of drifts."""


class _Fixed(NamedTuple):
    """What hangs on window and drift alone."""

    columns: Array
    """Polynomials and signals, shape (n, k)."""
    sums: Array
    """What each colour takes of the three sums of products, shape (colours, 3)."""
    spread: Array
    """Of each colour: log determinant and prior, shape (colours,)."""
    ridge: Array
    """Prior precision of the polynomials, in units of the noise, shape (channels, kept)."""


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
        """Log of the marginal likelihood (points,); ``modes`` and ``rates`` as :meth:`solved`."""
        return self.solved(modes, rates).log()

    def solved(self, modes: Array, rates: Array | None = None) -> Solved:
        """Least squares for each kind of noise.

        Parameters
        ----------
        modes : ndarray, shape (points, m, 2)
            sigma (1/s) and omega (rad/s) of each mode.
        rates : ndarray, shape (points,), optional
            Decay of the real mode, 1/s; for an exponential drift.
        """
        w, fixed = self.window, self._fixed
        n, kept = len(w.time), len(KINDS[self.drift])
        waves = basis(modes, w.time, rates)
        p, channels = waves.shape[2], w.signals.shape[1]
        products = _products(waves, fixed.columns)
        plain = products[:, 0]
        ridge, ridges = self._ridge(plain, 2 * modes.shape[1], p)
        h = p + kept
        whole = fixed.sums @ products.reshape(len(products), 3, -1)
        whole = whole.reshape(len(products), -1, h + channels, h + channels)
        full = np.empty((*whole.shape[:2], channels, h + 1, h + 1))
        full[..., :h, :h] = whole[:, :, None, :h, :h] + (ridge * (self.noise**2)[:, None, None])[:, None]
        full[..., h, :h] = whole[:, :, h:, :h]
        full[..., h, h] = np.diagonal(whole[:, :, h:, h:], axis1=2, axis2=3)
        own = _left(full, fixed.spread[:, None] - (ridges + 2 * h * np.log(self.noise))[:, None], n)
        driven = None if self.driven is None else self._shared(self.driven, waves, plain, ridge, ridges)
        return Solved(own, driven, n, min(float(w.driven.sum()), 1.0))  # a sum of what is rounded

    @cached_property
    def _fixed(self) -> _Fixed:
        w, phi = self.window, self.window.colours
        kept = len(KINDS[self.drift])
        sums = np.stack([1 + phi**2, -(phi**2), -phi], 1) / (1 - phi**2)[:, None]
        spread = (len(w.time) - 1) * np.log(1 - phi**2) + 2 * math.log(len(phi))
        sizes = np.tile(KINDS[self.drift], (w.signals.shape[1], 1))
        sizes[:, :1] *= np.maximum(1.0, np.abs(w.signals.mean(0)))[:, None]  # an offset may be larger than the motion
        return _Fixed(np.concatenate([w.drift[:, :kept], w.signals], 1), sums, spread, 1 / sizes**2)

    def _ridge(self, plain: Array, oscillating: int, p: int) -> tuple[Array, Array]:
        """Prior precision of the amplitudes (points, channels, h, h), in units of the noise, and log determinants."""
        fixed = self._fixed.ridge
        own = plain[:, :p, :p] / len(self.window.time) * (1 + TWINS * np.eye(p))
        ridge = np.zeros((len(plain), len(fixed), p + fixed.shape[1], p + fixed.shape[1]))
        turning = own[:, :oscillating, :oscillating] / AMPLITUDE**2
        ridge[:, :, :oscillating, :oscillating] = turning[:, None]
        logs = np.linalg.slogdet(turning)[1]
        if p > oscillating:
            dying = own[:, -1, -1] / REAL**2
            ridge[:, :, p - 1, p - 1] = dying[:, None]
            logs = logs + np.log(dying)
        for k, precision in enumerate(fixed.T, p):
            ridge[:, :, k, k] = precision
        return ridge, logs[:, None] + np.log(fixed).sum(1)

    def _shared(self, driven: Driven, waves: Array, plain: Array, ridge: Array, ridges: Array) -> Least:
        """Least squares over all channels at once, for driven modes."""
        n, channels = self.window.signals.shape
        points, _, p = waves.shape
        kept = len(KINDS[self.drift])
        h, r = p + kept, driven.variances.shape[1]
        lying = np.swapaxes(waves, 1, 2).reshape(-1, n)
        moved = np.empty((points, channels, p, r))
        right = np.empty((points, 1, channels, h))
        gram = np.zeros((points, 1, channels, h, channels, h))
        for k, level in enumerate(driven.level):
            gram[:, 0, k, :, k] = plain[:, :h, :h] / level**2 + ridge[:, k]
            moved[:, k] = (lying @ driven.directions[k]).reshape(points, p, r)
            right[:, 0, k, :p] = (lying @ driven.beside[k]).reshape(points, p)
        right[..., p:] = driven.beside_drift[:, :kept]
        shares = len(driven.left)
        along = moved.reshape(points, -1, r)
        taken = (along[:, None] * (1 - driven.left)[:, None]).reshape(points, -1, r)
        turning = (taken @ np.swapaxes(along, 1, 2)).reshape(points, shares, channels, p, channels, p)
        polynomials = driven.taken[:, :, :kept].reshape(-1, r)
        across = (along.reshape(-1, r) @ polynomials.T).reshape(points, channels, p, shares, channels, kept)
        gram = np.repeat(gram, shares, 1)
        gram[:, :, :, :p, :, :p] -= turning
        gram[:, :, :, :p, :, p:] -= across.transpose(0, 3, 1, 2, 4, 5)
        gram[:, :, :, p:, :, :p] -= across.transpose(0, 3, 4, 5, 1, 2)
        gram[:, :, :, p:, :, p:] -= driven.drift_products[:, :, :kept, :, :kept]
        right = np.repeat(right, shares, 1)
        right[..., :p] += (along @ driven.signals.T).reshape(points, channels, p, shares).transpose(0, 3, 1, 2)
        right[..., p:] += driven.drift_signals[:, :, :kept]
        size = channels * h
        full = np.empty((points, shares, size + 1, size + 1))
        full[..., :size, :size] = gram.reshape(points, shares, size, size)
        full[..., size, :size] = right.reshape(points, shares, size)
        full[..., size, size] = driven.squares
        # white is one of the sensors' colours
        spread = driven.spread + 2 * channels * math.log(len(self.window.colours)) - 2 * np.log(driven.chances)
        return _left(full, spread - ridges.sum(1)[:, None], n * channels)


def _left(full: Array, logdet: Array, count: int) -> Least:
    """Marginal likelihood of samples with what least squares leave, and those least squares.

    One Cholesky decomposition gives both the determinant of the normal equations and what is left.

    The last row of ``full`` (..., h + 1, h + 1) holds right sides and the sum of squares beside normal equations, the
    diagonal of which is changed; ``logdet`` is that of the noise, less that of the prior precision.
    """
    h = full.shape[-1] - 1
    full.reshape(*full.shape[:-2], -1)[..., : h * (h + 2) : h + 2] *= 1 + TWINS  # the diagonal
    gram, right, total = full[..., :h, :h], full[..., h, :h], full[..., h, h]
    try:
        root = np.diagonal(np.linalg.cholesky(full), axis1=-2, axis2=-1)
        squares, own = root[..., h] ** 2, 2 * np.log(root[..., :h]).sum(-1)
    except np.linalg.LinAlgError:  # singular to rounding, or a trial that grew beyond all numbers
        squares = total - (right * np.linalg.solve(gram, right[..., None])[..., 0]).sum(-1)
        own = np.linalg.slogdet(gram)[1]
    squares = np.maximum(squares, 1e-13 * total)
    log = gammaln(count / 2) - 0.5 * (count * np.log(math.pi * squares) + own + logdet)
    return Least(log, gram, right, squares)


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
    wave = np.exp(root[..., None] * time)
    turning = 2 * root.shape[1]
    columns = np.empty((len(modes), turning + (rates is not None), len(time)))
    columns[:, :turning:2], columns[:, 1:turning:2] = wave.real, wave.imag
    if rates is not None:
        columns[:, -1] = np.exp(-rates[:, None] * time)
    return np.swapaxes(columns, 1, 2)  # samples lie side by side: sums over them are quicker


def _products(waves: Array, fixed: Array) -> Array:
    """Sums over the samples of products of columns: of one sample, of the two at the ends, of neighbours twice.

    Shape (points, 3, columns, columns), where the ``fixed`` columns (n, k) follow the ``waves`` (points, n, p).
    """
    points, _, p = waves.shape
    size = p + fixed.shape[1]
    found = np.empty((points, 3, size, size))

    def product(place: int, left: slice, right: slice) -> None:
        a, b, one = fixed[left], fixed[right], np.swapaxes(waves[:, left], 1, 2)
        found[:, place, :p, :p] = one @ waves[:, right]
        found[:, place, :p, p:] = one @ b
        found[:, place, p:, :p] = a.T @ waves[:, right]
        found[:, place, p:, p:] = a.T @ b

    product(0, slice(None), slice(None))
    product(1, slice(None, None, len(fixed) - 1), slice(None, None, len(fixed) - 1))
    product(2, slice(1, None), slice(None, -1))
    found[:, 2] += np.swapaxes(found[:, 2], 1, 2).copy()
    return found
