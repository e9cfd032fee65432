"""Noise of free decays beside that of the sensors: the same modes, excited by the ground all along the window.

White noise that drives an oscillator with eigenvalue lambda = sigma + i omega gives its complex coordinate the
stationary correlation e^(lambda t) for t > 0 (Crandall & Mark, Random Vibration in Mechanical Systems, 1963, section
2.2, for sigma small beside omega). A channel sees it by the phasor c that its free motion shows: the covariance of
channels k and l is Re(c_k conj(c_l) e^(lambda t)) / 2, so one disturbance moves all channels in the shape of the mode.
Its state at the start of the window is among the free amplitudes.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz

from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

SHARES = 10.0 ** np.arange(-1.5, 0.3, 0.25)
"""Rms of the driven motion over that of the mode in the window: 0.03 to 1.8, so near each other that none between two
is taken for a level at which the scatter is half of what it is."""

LEAST_DAMPING = 0.03
MOST_SAMPLES = 240
LEAST_NOISE = 1e-4  # of a signal; with less, sums of squares lose their digits
NEGLIGIBLE = 1e-3  # variance of a direction beside that of the sensors


@dataclass(frozen=True)
class Driven:
    """Covariance of the samples of all channels: that of white sensors and, for each share, of driven modes.

    All but the level is seen in units of it: samples and polynomials are divided by it once more.

    Attributes
    ----------
    level : ndarray, shape (c,)
        Sd of the sensors' noise, in units of the window's scale.
    directions : ndarray, shape (c, n, r)
        Orthonormal over channels and samples where these are in units of ``level``; divided by it.
    variances : ndarray, shape (f, r)
        Of the driven motion along them, for each share.
    left : ndarray, shape (f, r)
        What a sum of squares keeps of each direction.
    signals : ndarray, shape (f, r)
        The samples along the directions, as much as is left.
    squares : ndarray, shape (f,)
        Sum of squares of the samples.
    spread : ndarray, shape (f,)
        Log determinant; one of the levels is integrated, the others are known to sqrt(1 / 2n).
    beside, beside_drift : ndarray, shape (c, n) and (c, 3)
        What no direction moves of the samples, and products with the polynomials of the drift.
    taken, drift_products, drift_signals : ndarray, shape (f, c, 3, r), (f, c, 3, c, 3) and (f, c, 3)
        Of the polynomials what is not left along the directions, and products with themselves and with ``signals``.
    """

    level: Array
    directions: Array
    variances: Array
    left: Array
    signals: Array
    squares: Array
    spread: Array
    beside: Array
    beside_drift: Array
    taken: Array
    drift_products: Array
    drift_signals: Array


def driven(w: Window, modes: Array) -> Driven | None:
    """Driven noise of a window about the eigenvalues and phasors that its modes have.

    Parameters
    ----------
    w : Window
    modes : ndarray, shape (m, 2)
        sigma (1/s) and omega (rad/s).

    Returns
    -------
    Driven or None
        None where the window has too many samples for it.
    """
    n, channels = w.signals.shape
    if n > MOST_SAMPLES:
        return None
    roots = modes[:, 0] + 1j * modes[:, 1]
    waves = np.exp(roots * w.time[:, None])
    whole = np.hstack([waves.real, waves.imag, w.drift])
    amplitudes = np.linalg.lstsq(whole, w.signals, rcond=None)[0]
    left = w.signals - whole @ amplitudes
    level = np.maximum(np.sqrt((np.diff(left, 2, axis=0) ** 2).mean(0) / 6), LEAST_NOISE)  # of white noise
    columns = []
    for number, (sigma, omega) in enumerate(modes):
        phasors = amplitudes[number] - 1j * amplitudes[len(modes) + number]
        size = np.sqrt((np.abs(waves[:, number]) ** 2).mean())
        root = -max(abs(float(sigma)), LEAST_DAMPING * float(omega)) + 1j * omega
        values, vectors = np.linalg.eigh(toeplitz(np.exp(root * w.time)))
        kept = values * (size * SHARES.max() * np.abs(phasors / level).max()) ** 2 > NEGLIGIBLE / 10
        half = vectors[:, kept] * np.sqrt(values[kept] / 2) * size
        seen = (phasors / level)[:, None, None] * half  # (channels, n, r)
        columns += [seen.real, seen.imag]
    u = np.concatenate(columns, 2).reshape(channels * n, -1)
    along, singular, _ = np.linalg.svd(u, full_matrices=False)
    kept = singular * SHARES.max() > np.sqrt(NEGLIGIBLE)
    along, variances = along[:, kept], (SHARES[:, None] * singular[kept]) ** 2
    left = 1 / (1 + variances)
    scaled = (w.signals / level).T
    of_signals = scaled.ravel() @ along
    apart = scaled - (along @ of_signals).reshape(channels, n)
    directions = along.reshape(channels, n, -1) / level[:, None, None]
    polynomials = w.drift.T @ directions
    spread = np.log1p(variances).sum(1) + 2 * n * np.log(level).sum() - (channels - 1) * math.log(math.pi / n)
    taken = polynomials * (1 - left)[:, None, None]
    return Driven(
        level, directions, variances, left, left * of_signals, (apart**2).sum() + left @ of_signals**2, spread,
        apart / level[:, None], apart / level[:, None] @ w.drift, taken,
        np.einsum("fckr,dlr->fckdl", taken, polynomials), np.einsum("fr,ckr->fck", left * of_signals, polynomials),
    )  # fmt: skip
