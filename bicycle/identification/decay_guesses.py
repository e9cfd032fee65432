"""Where to look for the modes of a window: about peaks of its spectrum, by least squares with a parabola."""

import math

import numpy as np

from bicycle.eigenvalues.oscillation import angular_frequency
from bicycle.identification.decay_evidence import basis
from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

SLOWEST, FASTEST = 0.1, 200.0  # rad/s
LOWEST, HIGHEST = -50.0, 20.0  # 1/s
HIGHEST_PEAK = FASTEST / 2  # of a spectrum, rad/s
FLOOR = 1e-5  # of a signal: with less noise the normal equations are singular
FACTORS = np.array([0.35, 0.5, 0.65, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.8])
DAMPING = (-0.1, 0.02, 0.1, 0.2, 0.35, 0.6)  # -sigma / omega
DEAD = (1.0, 2.5)  # the same of a transient


def noise_floor(w: Window, modes: Array) -> Array:
    """Sd (c,) of what the ``modes`` (m, 2) and a parabola leave of each channel of the window ``w``."""
    whole = np.hstack([basis(modes[None], w.time)[0], w.drift])
    left = w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0]
    return np.asarray(np.maximum(np.sqrt((left**2).sum(0) / max(len(w.time) - whole.shape[1], 1)), FLOOR))


def first_guesses(w: Window, start_hz: float | None) -> list[Array]:
    """Single modes to start from, the most probable of a net about the highest peak of the spectrum first.

    Parameters
    ----------
    w : Window
    start_hz : float, optional
        In place of the peak.

    Returns
    -------
    list of ndarray, shape (1, 2)
    """
    peak = _peak(w, w.signals) if start_hz is None else float(angular_frequency(start_hz))
    return _net(w, peak, DAMPING, [])


def further_guess(w: Window, known: Array, start_hz: float | None = None) -> list[Array]:
    """The ``known`` modes (m, 2) with one more, sought in what they leave of a window ``w`` or near ``start_hz``."""
    whole = np.hstack([basis(known[None], w.time)[0], w.drift])
    left = w.signals - whole @ np.linalg.lstsq(whole, w.signals, rcond=None)[0]
    peak = _peak(w, left) if start_hz is None else float(angular_frequency(start_hz))
    return _net(w, peak, (*DAMPING, *DEAD), [known])


def _net(w: Window, peak: float, damping: tuple[float, ...], known: list[Array]) -> list[Array]:
    """The three best (by least squares with a parabola) of a net about a peak."""
    omega = np.clip(FACTORS * peak, 1.01 * SLOWEST, 0.99 * FASTEST)
    net = np.array([[[-zeta * o, o]] for o in omega for zeta in damping])
    net[..., 0] = np.clip(net[..., 0], 0.9 * LOWEST, 0.9 * HIGHEST)
    if known:
        net = np.concatenate([np.repeat(known[0][None], len(net), 0), net], 1)
    fixed = np.broadcast_to(w.drift, (len(net), *w.drift.shape))
    q, _ = np.linalg.qr(np.concatenate([basis(net, w.time), fixed], 2))
    left = (w.signals**2).sum() - ((np.swapaxes(q, 1, 2) @ w.signals) ** 2).sum((1, 2))
    return [net[k] for k in np.argsort(left)[:3]]


def seeking_block(w: Window) -> int:
    """Samples of a window ``w`` that may be made one where peaks are sought; in longer blocks a fast one seems slow."""
    return max(1, int(math.pi / HIGHEST_PEAK / (w.time[1] - w.time[0])))


def _peak(w: Window, signals: Array) -> float:
    """Highest peak of the summed spectra, rad/s."""
    step, size = w.time[1] - w.time[0], 8 * len(w.time)
    power = (np.abs(np.fft.rfft(signals - signals.mean(0), size, axis=0)) ** 2).sum(1)
    frequency = angular_frequency(np.fft.rfftfreq(size, step))
    power = np.where((frequency < 1.0) | (frequency > HIGHEST_PEAK), 0.0, power)
    return float(frequency[int(np.argmax(power))])
