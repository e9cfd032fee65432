"""Noise of a channel, first-order autoregressive, and initial states that are integrated out of whitened runs."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from studies.diagnosis.family import Family
from tyre.ground.arrays import Array

LARGEST_SIGNAL = 1e12  # of a simulated signal: the trial bicycle has fallen


def clip_fallen(signal: Array) -> Array:
    """Copy of ``signal`` within +-:data:`LARGEST_SIGNAL`, NaN at its upper end; itself if it is within."""
    if not signal.size or (signal.max() <= LARGEST_SIGNAL and signal.min() >= -LARGEST_SIGNAL):
        return signal
    finite = np.nan_to_num(signal, nan=LARGEST_SIGNAL, posinf=LARGEST_SIGNAL, neginf=-LARGEST_SIGNAL)
    return np.asarray(finite.clip(-LARGEST_SIGNAL, LARGEST_SIGNAL))


@dataclass(frozen=True)
class ChannelNoise:
    """First-order autoregressive noise of a channel."""

    sd: float  # marginal, in the unit of the channel
    colour: float = 0.0  # autoregressive coefficient
    stated: bool = False  # the user states the sd: it is never estimated

    def whiten(self, signal: Array) -> Array:
        """Whitened ``signal`` (n, ...): along its first axis, in time, this noise becomes white noise of sd 1."""
        white = clip_fallen(signal) / self.sd
        white[1:] = (white[1:] - self.colour * white[:-1]) / np.sqrt(1 - self.colour**2)
        return white

    def colour_again(self, white: Array) -> Array:
        """Signal (n,), in the unit of the channel, that :meth:`whiten` turns into ``white`` (n,)."""
        innovation_sd = np.sqrt(1 - self.colour**2)
        scaled = np.concatenate([white[:1], innovation_sd * white[1:]]) * self.sd
        return np.asarray(scipy.signal.lfilter([1.0], [1.0, -self.colour], scaled))

    def sd_of_means(self, channels: list[Array], count: int) -> float:
        """Sd of means of ``count`` samples, in the channel's unit, of the colour that ``channels`` (n,) show."""
        colours = np.linspace(0.0, 0.98, 99)
        # variance of third differences, in units of that of the noise, as measured and as noise of each colour has it
        measured = float(np.mean([np.var(np.diff(x, 3)) for x in channels])) / self.sd**2
        expected = 20 - 30 * colours + 12 * colours**2 - 2 * colours**3
        colour = np.interp(-measured, -expected, colours)
        lag = np.arange(1, count)
        return float(self.sd * np.sqrt((1 + 2 * np.sum((1 - lag / count) * colour**lag)) / count))

    def estimate(self, series: list[Array]) -> "ChannelNoise":
        """Noise with the sd (unless stated) and colour of residuals that this noise whitened to ``series`` (n,)."""
        residuals = [self.colour_again(white) for white in series]
        level = float(np.sqrt(np.mean([np.mean(r**2) for r in residuals])))
        change = float(np.mean([np.mean(np.diff(r) ** 2) for r in residuals]))
        sd = self.sd if self.stated else level
        return ChannelNoise(sd, float(np.clip(1 - change / (2 * sd**2), 0.0, 0.98)), self.stated)


def rough_noise(channels: list[Array]) -> ChannelNoise:
    """White noise with the sd that second differences of one channel show; ``channels`` (n,) are its runs."""
    rough = np.sqrt(np.mean([np.var(np.diff(x, 2)) / 6 for x in channels]))
    floor = 1e-3 * np.sqrt(np.mean([np.var(x) for x in channels]))
    return ChannelNoise(float(max(rough, floor)))


# ---- initial states: they enter linearly, have a wide normal prior and are integrated out ----

# Prior sd of an initial state by its unit, of forces and moments in weights and weights times m; of others 1. A joint
# gives way by a fraction of the lean; wider would veil a new mode.
START = {"rad/s": 3.0, "m/s": 2.0, "N": 0.3, "N m": 0.1, "rad": 0.5}
JOINT_START = {"rad/s": 0.5, "rad": 0.05}


def start_sd(family: Family) -> Array:
    """Prior sd (n,) of the initial states of a ``family`` of models, in the scaled units of its states."""
    weight = sum(family.base.bicycle.static_loads)
    sds = []
    for state, unit in zip(family.symbolic.declared.states, family.models.scale, strict=True):
        sd = (JOINT_START if state.joint else START).get(state.unit, 1.0)
        sds.append(sd * (weight if state.forcelike else 1.0) / unit)
    return np.array(sds)


def start_scale(states: Array, width: int) -> Array:
    """Prior sd (width,) of all starts: of the ``states`` (n,) as given, of filters and splines, which follow, 1."""
    return np.concatenate([states, np.ones(width - len(states))])


class Marginal(NamedTuple):
    """R runs with their initial states integrated out, rows of zeros behind the end of shorter runs.

    With the whitened free responses Phi S = U s V', the residual is multiplied by (I + Phi S^2 Phi')^-1/2 = I + U
    (1/sqrt(1 + s^2) - 1) U', which is exact.
    """

    residual: Array  # (R, C T), whitened
    left: Array  # U (R, C T, k)
    gain: Array  # 1/sqrt(1 + s^2) - 1 (R, k)
    start: Array  # (R, m), most probable initial states and further columns of phi, in prior sd unless rescaled
    right: Array  # V (R, m, k)
    singular: Array  # s (R, k)

    def integrate_out(self, white: Array) -> Array:
        """Whitened ``white`` (R, C T, columns) with the initial states integrated out, same shape."""
        marginal = self.left @ (self.gain[:, :, None] * (self.left.swapaxes(-1, -2) @ white))
        marginal += white
        return marginal

    def shift_starts(self, white: Array) -> Array:
        """Change (R, m, columns) of the most probable starts, in prior sd, by ``white`` (R, C T, columns)."""
        share = (self.singular / (1 + self.singular**2))[..., None]
        return self.right @ (share * (self.left.swapaxes(-1, -2) @ white))

    @property
    def spread(self) -> Array:
        """Square root (R, m, m) of the posterior covariance of the starts, in prior sd."""
        return np.eye(self.right.shape[1]) + (self.right * self.gain[:, None, :]) @ self.right.swapaxes(-1, -2)


def integrate_starts_out(phi: Array, white: Array) -> Marginal:
    """Integrate the starts out of R runs; the residual is NaN if a trial bicycle has fallen.

    ``phi`` (R, C T, m) are the whitened responses to 1 prior sd of each start, ``white`` (R, C T, 1) the whitened runs.
    """
    if not (np.abs(phi).max() < LARGEST_SIGNAL and np.abs(white).max() < LARGEST_SIGNAL):  # or not a number
        runs, _, count = phi.shape
        undefined = np.full((*phi.shape[:2], 1), np.nan)
        return Marginal(
            undefined[..., 0],
            undefined,
            gain=np.zeros((runs, 1)),
            start=np.zeros((runs, count)),
            right=np.zeros((runs, count, 1)),
            singular=np.zeros((runs, 1)),
        )
    u, s, vt = np.linalg.svd(phi, full_matrices=False)
    marginal = Marginal(white[..., 0], u, 1 / np.sqrt(1 + s**2) - 1, white[:, 0], vt.swapaxes(-1, -2), s)
    residual = marginal.integrate_out(white)[..., 0]
    return marginal._replace(residual=residual, start=marginal.shift_starts(white)[..., 0])
