"""Noise of a channel, first-order autoregressive, and initial states that are integrated out of whitened runs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from tyre.ground.arrays import Array

LARGEST_SIGNAL = 1e12  # of a simulated signal: the trial bicycle has fallen


def limited(signal: Array) -> Array:
    """The ``signal`` within +-:data:`LARGEST_SIGNAL`."""
    if not signal.size or (signal.max() <= LARGEST_SIGNAL and signal.min() >= -LARGEST_SIGNAL):
        return signal
    finite = np.nan_to_num(signal, nan=LARGEST_SIGNAL, posinf=LARGEST_SIGNAL, neginf=-LARGEST_SIGNAL)
    return np.asarray(finite.clip(-LARGEST_SIGNAL, LARGEST_SIGNAL))


@dataclass(frozen=True)
class ChannelNoise:
    """First-order autoregressive noise of a channel."""

    sd: float  # marginal, in the unit of the channel
    colour: float = 0.0  # autoregressive coefficient
    given: bool = False  # the user states the sd

    def whiten(self, signal: Array) -> Array:
        """Turn the noise in ``signal`` (n, ...) along the first axis into unit white noise."""
        white = limited(signal) / self.sd
        white[1:] = (white[1:] - self.colour * white[:-1]) / np.sqrt(1 - self.colour**2)
        return white

    def colour_again(self, white: Array) -> Array:
        """Undo the whitening of one series ``white`` (n,)."""
        rest = np.sqrt(1 - self.colour**2)
        scaled = np.concatenate([white[:1], rest * white[1:]]) * self.sd
        return np.asarray(scipy.signal.lfilter([1.0], [1.0, -self.colour], scaled))

    def of_means(self, channels: list[Array], count: int) -> float:
        """Sd of means of ``count`` samples, with the colour that third differences of ``channels`` (n,) show."""
        colours = np.linspace(0.0, 0.98, 99)
        shown = float(np.mean([np.var(np.diff(x, 3)) for x in channels])) / self.sd**2
        colour = np.interp(-shown, -(20 - 30 * colours + 12 * colours**2 - 2 * colours**3), colours)
        apart = np.arange(1, count)
        return float(self.sd * np.sqrt((1 + 2 * np.sum((1 - apart / count) * colour**apart)) / count))

    def estimated(self, series: list[Array]) -> "ChannelNoise":
        """Noise that whitened residuals of several ``series`` (n,) show; a given sd stays."""
        raw = [self.colour_again(white) for white in series]
        level = float(np.sqrt(np.mean([np.mean(e**2) for e in raw])))
        change = float(np.mean([np.mean(np.diff(e) ** 2) for e in raw]))
        sd = self.sd if self.given else level
        return ChannelNoise(sd, float(np.clip(1 - change / (2 * sd**2), 0.0, 0.98)), self.given)


def rough_noise(channels: list[Array]) -> ChannelNoise:
    """Noise from second differences of one channel in all runs, until a fit is there."""
    rough = np.sqrt(np.mean([np.var(np.diff(x, 2)) / 6 for x in channels]))
    floor = 1e-3 * np.sqrt(np.mean([np.var(x) for x in channels]))
    return ChannelNoise(float(max(rough, floor)))


class Marginal(NamedTuple):
    """R runs with their initial states integrated out, rows of zeros behind the end of shorter runs.

    With the whitened free responses Phi S = U s V', the residual is multiplied by (I + Phi S^2 Phi')^-1/2 = I + U
    (1/sqrt(1 + s^2) - 1) U', which is exact.
    """

    residual: Array  # (R, C T), whitened
    left: Array  # U (R, C T, k)
    gain: Array  # 1/sqrt(1 + s^2) - 1 (R, k)
    start: Array  # most probable initial states (R, n + ...)
    right: Array  # V (R, m, k)
    singular: Array  # s (R, k)

    def without(self, white: Array) -> Array:
        """Rest of ``white`` columns (R, C T, columns) after marginalising."""
        rest = self.left @ (self.gain[:, :, None] * (self.left.swapaxes(-1, -2) @ white))
        rest += white
        return rest

    def follows(self, white: Array) -> Array:
        """Movement of the most probable starts (R, m, columns), in prior sd, with ``white`` columns."""
        share = (self.singular / (1 + self.singular**2))[..., None]
        return self.right @ (share * (self.left.swapaxes(-1, -2) @ white))

    @property
    def spread(self) -> Array:
        """Root of the covariance of the starts after the data, in prior sd (R, m, m)."""
        return np.eye(self.right.shape[1]) + (self.right * self.gain[:, None, :]) @ self.right.swapaxes(-1, -2)


def integrated_out(phi: Array, white: Array) -> Marginal:
    """Runs without the part that their initial states explain; NaN if a trial bicycle has fallen."""
    if not (np.abs(phi).max() < LARGEST_SIGNAL and np.abs(white).max() < LARGEST_SIGNAL):  # or not a number
        nothing = np.full((*phi.shape[:2], 1), np.nan)
        wide, one = np.zeros((len(phi), phi.shape[-1])), np.zeros((len(phi), 1))
        return Marginal(nothing[..., 0], nothing, one, wide, wide[..., None], one)
    u, s, vt = np.linalg.svd(phi, full_matrices=False)
    found = Marginal(white[..., 0], u, 1 / np.sqrt(1 + s**2) - 1, white[:, 0], vt.swapaxes(-1, -2), s)
    return found._replace(residual=found.without(white)[..., 0], start=found.follows(white)[..., 0])
