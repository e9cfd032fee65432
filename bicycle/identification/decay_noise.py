"""Tell how probable the samples of a window are, given the eigenvalues of its modes and the kind of its drift.

Each channel is y = sum over modes e^(sigma t) (a cos(omega t) + b sin(omega t)) + drift + noise. The noise is a first-
order autoregression of unknown sd s and coefficient in each channel. Amplitudes, drift and s are integrated out in
closed form and the coefficients summed, so that only eigenvalues are left (linear model with conjugate priors: O'Hagan
& Forster, Kendall's Advanced Theory of Statistics 2B, 2nd ed., ch. 11). Priors: amplitudes as large as three times the
signal, in the plane that a mode spans; the drift as :data:`KINDS` says; log s even.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln

from bicycle.identification.decay_window import Window, basis
from tyre.arrays import Array

AMPLITUDE, REAL = 3.0, 0.3  # prior sd of a mode and of a real mode in units of the signal's sd
TWINS = 1e-12  # of a diagonal: two equal modes leave it regular
PLAIN = {
    "none": (), "constant": (1.0,), "parabola": (1.0, 0.3, 0.1), "parabola/3": (1.0, 0.1, 0.03),
    "parabola/10": (1.0, 0.03, 0.01),
}  # fmt: skip
WITH_REAL_MODE = {
    "exponential": (1.0,), "parabola-exponential": (1.0, 0.1, 0.03), "parabola-exponential/3": (1.0, 0.03, 0.01),
}  # fmt: skip
KINDS = PLAIN | WITH_REAL_MODE
"""Kinds of drift and the prior sd of offset, slope and bend of each, rms over the window in units of the signal; the
last have a real mode beside (capsize, castering). A prior that is much too large is evidence against what is slight, so
there are several sizes."""

DRIFTS = tuple(dict.fromkeys(kind.partition("/")[0] for kind in KINDS))
"""Names of drifts, without sizes."""


def log_sum(logs: Array) -> Array:
    """Logarithm of the sum of exponentials along the first axis."""
    top = logs.max(0)
    return np.asarray(top + np.log(np.exp(logs - top).sum(0)))


@dataclass(frozen=True)
class Linear:
    """Amplitudes given eigenvalues, in units of each channel's scale: cos, sin of each mode, real mode, polynomials."""

    mean: Array  # (points, channels, p)
    covariance: Array  # (points, channels, p, p); channels are independent

    def sorted(self, order: NDArray[np.intp]) -> "Linear":
        """Amplitudes with the modes in this ``order`` (m,)."""
        places = np.arange(self.mean.shape[-1])
        places[: 2 * order.size] = np.stack([2 * order, 2 * order + 1], 1).ravel()
        return Linear(self.mean[..., places], self.covariance[:, :, places][..., places])


@dataclass(frozen=True)
class Solved:
    """Least squares at some eigenvalues for each coefficient of the noise, (points, colours, channels)."""

    logs: Array  # of the marginal likelihood
    gram: Array  # normal equations
    right: Array
    squares: Array
    samples: int

    def at(self, kept: NDArray[np.bool_]) -> "Solved":
        """Keep some of the points."""
        return Solved(self.logs[kept], self.gram[kept], self.right[kept], self.squares[kept], self.samples)

    def log(self) -> Array:
        """Logarithm of the marginal likelihood, (points,)."""
        return np.asarray(log_sum(np.swapaxes(self.logs, 0, 1)).sum(-1))

    def colour(self) -> NDArray[np.intp]:
        """Number of the most probable coefficient of each channel at the first point."""
        return np.asarray(self.logs[0].argmax(0))

    def linear(self) -> Linear:
        """Amplitudes with the most probable coefficient of the noise."""
        points, places = np.indices((len(self.logs), self.logs.shape[2]))
        one = points, self.logs.argmax(axis=1), places
        gram = self.gram[one]
        mean = np.linalg.solve(gram, self.right[one][..., None])[..., 0]
        return Linear(mean, np.linalg.inv(gram) * (self.squares[one] / self.samples)[..., None, None])


@dataclass(frozen=True)
class Evidence:
    """Marginal likelihood of one window with one kind of drift; priors are in units of ``noise``, about its sd (c,)."""

    window: Window
    drift: str
    noise: Array

    def solved(self, modes: Array, rates: Array | None = None) -> Solved:
        """Solve for all coefficients at ``modes`` (points, m, 2) and ``rates`` (points,) of a real mode."""
        w = self.window
        columns, sums, spread, _ = self._fixed
        waves = basis(modes, w.time, rates)
        p, channels = waves.shape[2], w.signals.shape[1]
        products = _products(waves, columns)
        ridge, ridges = self._ridge(products[:, 0], 2 * modes.shape[1], p)
        h = p + len(KINDS[self.drift])
        whole = (sums @ products.reshape(len(products), 3, -1)).reshape(len(products), -1, h + channels, h + channels)
        full = np.empty((*whole.shape[:2], channels, h + 1, h + 1))
        full[..., :h, :h] = whole[:, :, None, :h, :h] + (ridge * (self.noise**2)[:, None, None])[:, None]
        full[..., h, :h] = whole[:, :, h:, :h]
        full[..., h, h] = np.diagonal(whole[:, :, h:, h:], axis1=2, axis2=3)
        return _left(full, spread[:, None] - (ridges + 2 * h * np.log(self.noise))[:, None], len(w.time))

    @cached_property
    def _fixed(self) -> tuple[Array, Array, Array, Array]:
        """Polynomials and signals (n, k); what each colour takes of the three sums; its log determinant; the ridge."""
        w, phi = self.window, self.window.colours
        kept = len(KINDS[self.drift])
        sums = np.stack([1 + phi**2, -(phi**2), -phi], 1) / (1 - phi**2)[:, None]
        spread = (len(w.time) - 1) * np.log(1 - phi**2) + 2 * math.log(len(phi))
        sizes = np.tile(KINDS[self.drift], (w.signals.shape[1], 1))
        sizes[:, :1] *= np.maximum(1.0, np.abs(w.signals.mean(0)))[:, None]  # an offset may be larger than the motion
        return np.concatenate([w.drift[:, :kept], w.signals], 1), sums, spread, 1 / sizes**2

    def _ridge(self, plain: Array, oscillating: int, p: int) -> tuple[Array, Array]:
        """Prior precision of the amplitudes (points, channels, h, h), in units of the noise, and log determinants."""
        fixed = self._fixed[3]
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


def _left(full: Array, logdet: Array, count: int) -> Solved:
    """Solve normal equations ``full`` (..., h + 1, h + 1), whose last row holds right sides and the sum of squares."""
    h = full.shape[-1] - 1
    full.reshape(*full.shape[:-2], -1)[..., : h * (h + 2) : h + 2] *= 1 + TWINS
    gram, right, total = full[..., :h, :h], full[..., h, :h], full[..., h, h]
    try:
        root = np.diagonal(np.linalg.cholesky(full), axis1=-2, axis2=-1)
        squares, own = root[..., h] ** 2, 2 * np.log(root[..., :h]).sum(-1)
    except np.linalg.LinAlgError:  # singular to rounding, or a trial that grew beyond all numbers
        squares = total - (right * np.linalg.solve(gram, right[..., None])[..., 0]).sum(-1)
        own = np.linalg.slogdet(gram)[1]
    squares = np.maximum(squares, 1e-13 * total)
    logs = gammaln(count / 2) - 0.5 * (count * np.log(math.pi * squares) + own + logdet)
    return Solved(logs, gram, right, squares, count)


def _products(waves: Array, fixed: Array) -> Array:
    """Sum products of columns over the samples: of one sample, of the two at the ends, of neighbours twice."""
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
