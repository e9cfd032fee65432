"""What a sensor does to a channel: gain, delay, low-pass, bias, drift, saturation, crosstalk."""

from dataclasses import dataclass

import numpy as np

from studies.missing_effect.blind.second.chain import Real


@dataclass(frozen=True)
class Sensor:
    """Errors of one channel.

    Attributes
    ----------
    gain : float
        Reading over truth.
    delay : float
        s; the reading is late.
    low_pass : float
        Time constant of a filter, s.
    order : int
        Number of such filters in series; of order two or more no library knows.
    bias : float
        Constant, in the unit of the channel.
    drift : float
        Per second, in the unit of the channel.
    limit : float
        Where the reading saturates, in the unit of the channel; 0 for nowhere.
    crosstalk : float
        Share of another channel in the reading.
    other : str
        That channel.
    """

    gain: float = 1.0
    delay: float = 0.0
    low_pass: float = 0.0
    order: int = 1
    bias: float = 0.0
    drift: float = 0.0
    limit: float = 0.0
    crosstalk: float = 0.0
    other: str = ""

    def read(self, time: Real, true: Real, other: Real | None = None) -> Real:
        """What is recorded of a channel that is ``true``, at ``time`` (samples,), with an ``other`` channel."""
        seen = np.asarray(true) + (self.crosstalk * other if other is not None else 0.0)
        if self.delay:
            seen = np.interp(time - self.delay, time, seen)
        step = time[1] - time[0]
        for _ in range(self.order if self.low_pass else 0):
            seen = _lagged(seen, step / self.low_pass)
        if self.limit:
            seen = self.limit * np.tanh(seen / self.limit)
        found: Real = self.gain * seen + self.bias + self.drift * time
        return found


def _lagged(signal: Real, steps: float) -> Real:
    """First-order lag of a signal that is straight between samples; it starts settled."""
    decay = np.exp(-steps)
    new = 1 - (1 - decay) / steps  # weight of the newer sample
    found = signal.copy()
    for k in range(1, len(signal)):
        found[k] = decay * found[k - 1] + (1 - decay - new) * signal[k - 1] + new * signal[k]
    return found
