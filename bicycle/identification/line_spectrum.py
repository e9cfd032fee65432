"""Lines of a signal: frequencies of which it is made, where it is made of lines at all.

A multisine, a sum of sines or anything periodic is a few lines, however long it is recorded; noise and sweeps fill the
spectrum. Lines are the peaks of the spectrum of the whole record under a Hann window. All are fitted to the samples
together by least squares weighted with that window, so that it matters neither whether the record holds a whole number
of periods nor how lines leak into each other (Stoica & Moses 2005, Spectral Analysis of Signals, ch. 4), and their
frequencies are refined by Gauss and Newton. Where what is left holds peaks again, these are fainter lines.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import detrend
from scipy.signal.windows import hann

from tyre.base.arrays import Array

APART = 2.5  # bins, 1 / duration: lines that are nearer are not told apart
LOWEST = 2.0  # bins: below it is trend
FAINTEST = 0.03  # of the highest peak, in amplitude; the side lobes of the window lie at 0.027
MOST = 250  # lines: with more the spectrum is full
FIRST_LEFT, LEFT, NOTHING = 0.2, 0.05, 1e-4  # share of the power that is not in lines: at first, at last, of no line
ROUNDS, STEPS, PADDED = 3, 3, 8
ROWS = 1 << 13


def lines_of(signal: Array, step: float) -> Array:
    """Frequencies of the lines of a signal; none where it is not made of lines.

    Fainter lines are looked for among what the stronger ones leave, until that is less than 1e-4 of the power.

    Parameters
    ----------
    signal : ndarray, shape (k,)
    step : float
        Sample time, s.

    Returns
    -------
    ndarray, shape (m,)
        Hz, increasing. Empty where more than a twentieth of the power is outside of lines.
    """
    x = np.asarray(detrend(np.asarray(signal, float)))
    duration = len(x) * step
    total = float(weights(len(x)) @ x**2)
    found, rest, share = np.empty(0), x, 1.0
    for number in range(ROUNDS):
        more = _peaks(rest, step, found)
        if not 0 < len(more) + len(found) <= MOST:
            break
        first = np.sort(np.concatenate([found, more]))
        rest = fitted(first, [x], step)[1][0]
        if not number and float(weights(len(x)) @ rest**2) > FIRST_LEFT * total:
            return np.empty(0)
        found = first
        for _ in range(STEPS):
            found = _refined(found, x, step)
        rest = fitted(found, [x], step)[1][0]
        share = float(weights(len(x)) @ rest**2) / total
        if share < NOTHING or not len(more):
            break
    found = found[np.diff(found, prepend=-np.inf) * duration > 1]
    return found if share <= LEFT else np.empty(0)


def weights(size: int) -> Array:
    """Hann window of ``size`` samples, shape (size,), symmetric and above zero."""
    return np.asarray(hann(size + 2))[1:-1]


def basis(hertz: Array, size: int, step: float, rows: slice = slice(None)) -> Array:
    """Cosines, sines, one and a ramp at the samples, shape (samples, 2 m + 2).

    Parameters
    ----------
    hertz : ndarray, shape (m,)
        Hz.
    size : int
        Number of samples.
    step : float
        Sample time, s.
    rows : slice
        Indices of the samples that are wanted.
    """
    time = (np.arange(size)[rows] - (size - 1) / 2) * step
    angle = 2 * np.pi * np.outer(time, hertz)
    return np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(time), time / (size * step)])


def fitted(hertz: Array, signals: Sequence[Array], step: float) -> tuple[Array, Array]:
    """Coefficients (2 m + 2, signals) of :func:`basis` by weighted least squares, and what is left, (signals, k).

    Parameters
    ----------
    hertz : ndarray, shape (m,)
        Hz.
    signals : sequence of ndarray, shape (k,)
    step : float
        Sample time, s.
    """
    x = np.array(signals, float)
    size, width = x.shape[1], 2 * len(hertz) + 2
    gram, side, v = np.zeros((width, width)), np.zeros((width, len(x))), weights(size)
    parts = [slice(k, k + ROWS) for k in range(0, size, ROWS)]
    for rows in parts:
        a = basis(hertz, size, step, rows)
        gram += a.T @ (a * v[rows, None])
        side += a.T @ (x[:, rows] * v[rows]).T
    found = np.linalg.lstsq(gram, side, rcond=None)[0]
    left = np.concatenate([x[:, rows] - (basis(hertz, size, step, rows) @ found).T for rows in parts], axis=1)
    return np.asarray(found, float), left


def _peaks(x: Array, step: float, known: Array) -> Array:
    """Peaks (Hz) of the spectrum that stand apart from each other and from the ``known``."""
    size = len(x)
    power = np.abs(np.fft.rfft(x * weights(size), PADDED * size))
    hertz = np.arange(len(power)) / (PADDED * size * step)
    inner = np.arange(1, len(power) - 1)
    high = power[inner] >= FAINTEST * power[hertz * size * step >= LOWEST].max(initial=np.inf if size < 8 else 0)
    top = inner[high & (power[inner] > power[inner - 1]) & (power[inner] >= power[inner + 1])]
    top = top[hertz[top] * size * step >= LOWEST]
    if len(top) > 3 * MOST:
        return np.empty(0)
    chosen: list[float] = []
    for k in top[np.argsort(-power[top])]:
        before, at, after = np.log(power[k - 1 : k + 2])
        f = float(hertz[k] + 0.5 * (before - after) / (before - 2 * at + after) * hertz[1])
        if np.abs(np.concatenate([known, chosen]) - f).min(initial=np.inf) * size * step >= APART:
            chosen.append(f)
    return np.array(chosen)


def _refined(hertz: Array, x: Array, step: float) -> Array:
    """One step of Gauss and Newton on the frequencies."""
    size, m = len(x), len(hertz)
    found, left = fitted(hertz, [x], step)
    of_cos, of_sin = found[:m, 0], found[m : 2 * m, 0]
    width = 3 * m + 2
    gram, side, v = np.zeros((width, width)), np.zeros(width), weights(size)
    for rows in (slice(k, k + ROWS) for k in range(0, size, ROWS)):
        a = basis(hertz, size, step, rows)
        turn = 2 * np.pi * (np.arange(size)[rows] - (size - 1) / 2)[:, None] / size
        a = np.column_stack([a, turn * (of_sin * a[:, :m] - of_cos * a[:, m : 2 * m])])
        gram += a.T @ (a * v[rows, None])
        side += a.T @ (left[0, rows] * v[rows])
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    bins = (np.linalg.lstsq(gram / np.outer(scale, scale), side / scale, rcond=1e-12)[0] / scale)[2 * m + 2 :]
    return np.asarray(hertz + np.clip(bins, -0.25, 0.25) / (size * step))
