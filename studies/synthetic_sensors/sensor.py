"""One simulated sensor: delay, low-pass, scale, offset, drift, coloured noise, resolution, in this order."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from tyre.base.arrays import Array
from tyre.fits.noise import draw_ar1


@dataclass(frozen=True)
class Sensor:
    """What is wrong with one channel; numbers in the unit of the channel where no other is said.

    Attributes
    ----------
    noise_sd : float
        Standard deviation of its noise.
    correlation : float
        Of the noise of neighbouring samples, first-order autoregressive, 0 to 1.
    bandwidth_hz : float
        The same by the corner frequency of the noise; 0 where ``correlation`` says it.
    scale_error : float
        Reading over truth minus one, no unit.
    offset : float
        At the start.
    drift_per_s : float
        Change of the offset in a second.
    delay_s : float
        The reading is late by this, s.
    low_pass_hz : float
        Corner frequency of a first-order filter; 0 for none.
    resolution : float
        Step of the reading; 0 for none.
    """

    noise_sd: float = 0.0
    correlation: float = 0.0
    bandwidth_hz: float = 0.0
    scale_error: float = 0.0
    offset: float = 0.0
    drift_per_s: float = 0.0
    delay_s: float = 0.0
    low_pass_hz: float = 0.0
    resolution: float = 0.0

    def read(self, dense: Array, true: Array, time: Array, rng: np.random.Generator | None = None) -> Array:
        """What is recorded (samples,), in the unit of the channel.

        Parameters
        ----------
        dense : ndarray, shape (m,)
            Even times of the simulation, s.
        true : ndarray, shape (m,)
            The motion, in the unit of the channel.
        time : ndarray, shape (samples,)
            Times that are recorded, s; evenly spaced.
        rng : numpy.random.Generator, optional
            Of the noise; there is none without.
        """
        seen = lagged(true, dense[1] - dense[0], 1 / (2 * math.pi * self.low_pass_hz)) if self.low_pass_hz else true
        seen = np.interp(time - self.delay_s, dense, seen)  # before the start it stands still
        seen = (1 + self.scale_error) * seen + self.offset + self.drift_per_s * time
        if rng is not None and self.noise_sd:
            seen = seen + self.noise_sd * draw_ar1(len(time), memory=self.memory(time[1] - time[0]), rng=rng)
        return np.round(seen / self.resolution) * self.resolution if self.resolution else np.asarray(seen)

    def memory(self, step: float) -> float:
        """Correlation of the noise of neighbouring samples, ``step`` apart (s)."""
        return math.exp(-2 * math.pi * self.bandwidth_hz * step) if self.bandwidth_hz else self.correlation


def lagged(signal: Array, step: float, constant: float) -> Array:
    """First-order lag T y' = x - y of a signal that is straight between samples; it starts settled.

    Parameters
    ----------
    signal : ndarray, shape (m,)
        In any unit.
    step : float
        Between samples, s.
    constant : float
        T, s.

    Returns
    -------
    ndarray, shape (m,)
    """
    decay = math.exp(-step / constant)
    newer = 1 - (1 - decay) * constant / step  # weight of the newer sample, exact for a straight line
    older = 1 - decay - newer
    found, _ = lfilter([newer, older], [1.0, -decay], signal, zi=[(decay + older) * signal[0]])
    return np.asarray(found)
