"""Coloured noise of the channels of time histories: e_k = rho e_(k-1) + innovation, whitened along the samples."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array

LARGEST_SIGNAL = 1e12  # of what is simulated: the trial bicycle has fallen
COLOURS = (0.0, 0.98)  # of the autoregressive coefficient


def limited(signal: Array) -> Array:
    """The ``signal`` (any shape) within +-:data:`LARGEST_SIGNAL`, which a trial bicycle that falls goes beyond."""
    if not signal.size or (signal.max() <= LARGEST_SIGNAL and signal.min() >= -LARGEST_SIGNAL):
        return signal
    finite = np.nan_to_num(signal, nan=LARGEST_SIGNAL, posinf=LARGEST_SIGNAL, neginf=-LARGEST_SIGNAL)
    return np.asarray(finite.clip(-LARGEST_SIGNAL, LARGEST_SIGNAL))


@dataclass(frozen=True)
class ChannelNoise:
    """First-order autoregressive noise of a channel.

    Attributes
    ----------
    sd : float
        Marginal, in the unit of the channel.
    colour : float
        Autoregressive coefficient.
    given : bool
        Whether the user states the sd.
    """

    sd: float
    colour: float = 0.0
    given: bool = False

    def whiten(self, signal: Array) -> Array:
        """Turn the noise in ``signal`` (n, ...) along the first axis into unit white noise."""
        white = limited(signal) / self.sd
        if self.colour:
            white[1:] = (white[1:] - self.colour * white[:-1]) / np.sqrt(1 - self.colour**2)
        return white

    def colour_again(self, white: Array) -> Array:
        """Undo the whitening of one series ``white`` (n,)."""
        raw = white * self.sd
        if self.colour:
            for k in range(1, len(raw)):
                raw[k] = self.colour * raw[k - 1] + np.sqrt(1 - self.colour**2) * raw[k]
        return raw

    def estimated(self, series: list[Array]) -> "ChannelNoise":
        """The noise that whitened residuals show, of several ``series`` (n,); a given sd stays."""
        raw = [self.colour_again(white) for white in series]
        level = float(np.sqrt(np.mean([np.mean(e**2) for e in raw])))
        change = float(np.mean([np.mean(np.diff(e) ** 2) for e in raw]))
        sd = self.sd if self.given else level
        return ChannelNoise(sd, float(np.clip(1 - change / (2 * sd**2), *COLOURS)), self.given)


def whitened(signals: Array, noise: Sequence[ChannelNoise]) -> Array:
    """:meth:`ChannelNoise.whiten` of all channels at once.

    Parameters
    ----------
    signals : ndarray, shape (runs, channels, samples, columns)
        In the units of the channels.
    noise : sequence of ChannelNoise
        Of each channel.
    """
    white = limited(signals) / np.array([one.sd for one in noise])[:, None, None]
    colour = np.array([one.colour for one in noise])[:, None, None]
    if colour.any():
        rest = np.sqrt(1 - colour**2)
        for run in white:  # one after the other: whole copies of all would cost more than the arithmetic
            run[:, 1:] -= colour * run[:, :-1]
            run[:, 1:] /= rest
    return np.asarray(white)


def rough_noise(channels: list[Array]) -> ChannelNoise:
    """Noise from second differences of one channel in all runs, ``channels`` (n,) each, until a fit is there."""
    rough = np.sqrt(np.mean([np.var(np.diff(x, 2)) / 6 for x in channels]))
    floor = 1e-3 * np.sqrt(np.mean([np.var(x) for x in channels]))
    return ChannelNoise(float(max(rough, floor)))
