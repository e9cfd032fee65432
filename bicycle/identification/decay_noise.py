"""Noise of free decays beside that of the sensors: the same mode, excited by the ground all along the window.

An oscillator that white noise drives has the stationary correlation e^(-|sigma| t) (cos omega t -+ |sigma| / omega
sin omega t), minus for its rate and plus for its angle (Crandall & Mark, Random Vibration in Mechanical Systems, 1963,
section 2.2). Its state at the start of the window is among the free amplitudes. As one disturbance drives all
channels, their evidence counts as that of one channel.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import toeplitz

from bicycle.identification.decay_window import Window
from tyre.base.arrays import Array

SHARES = (1.0, 30.0, 1e3)
"""Variance of the driven motion over that of the white noise of the samples."""

LEAST_DAMPING = 0.03
MOST_SAMPLES = 240


@dataclass(frozen=True)
class Driven:
    """Noise with a covariance matrix for each share.

    Attributes
    ----------
    kinds : tuple of tuple of int
        Places of the channels that are rates, and of those that are angles; no empty ones.
    precision : ndarray, shape (f, kinds, n, n)
        Inverse covariances, for unit variance of the whole noise.
    logdet : ndarray, shape (f, c)
        Log determinants of the covariances.
    """

    kinds: tuple[tuple[int, ...], ...]
    precision: Array
    logdet: Array


def driven(w: Window, modes: Array) -> Driven | None:
    """Driven noise of a window about the eigenvalues that its modes have.

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
    n = len(w.time)
    if n > MOST_SAMPLES:
        return None
    angles = [name.endswith("_rad") for name in w.channels]
    places = {kind: tuple(k for k, angle in enumerate(angles) if angle == kind) for kind in sorted(set(angles))}
    made = {angle: _inverted(_correlation(w.time, modes, rate=not angle), n) for angle in places}
    logdet = np.empty((len(SHARES), len(w.channels)))
    for angle, those in places.items():
        logdet[:, list(those)] = made[angle][1][:, None]
    return Driven(tuple(places.values()), np.stack([made[angle][0] for angle in places], 1), logdet)


def _correlation(time: Array, modes: Array, *, rate: bool) -> Array:
    total = np.zeros((len(time), len(time)))
    for sigma, omega in modes:
        decay = max(abs(float(sigma)), LEAST_DAMPING * float(omega))
        wave = np.cos(omega * time) + (-1 if rate else 1) * decay / omega * np.sin(omega * time)
        total += toeplitz(np.exp(-decay * time) * wave) / len(modes)
    return total


def _inverted(correlation: Array, n: int) -> tuple[Array, Array]:
    covariances = np.array([(np.eye(n) + share * correlation) / (1 + share) for share in SHARES])
    return np.linalg.inv(covariances), np.linalg.slogdet(covariances)[1]


def counted(probabilities: Array, colours: int) -> float:
    """As how many channels the evidence of c channels counts, over c.

    Parameters
    ----------
    probabilities : ndarray, shape (f, c)
        Of the noises of each channel, the driven ones last.
    colours : int
        Number of those that are not driven.
    """
    share = probabilities[colours:].sum(0)
    return float(np.mean(1 - share * (1 - 1 / share.size)))
