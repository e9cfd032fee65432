"""How good a recorded channel is: resolution, noise, missing, saturated and frozen stretches, spikes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tyre.base.arrays import Array

MOST = 200_000  # samples looked at for resolution and noise
FEW_LEVELS = 8  # a channel of so few values is a switch or a counter of states
HELD = 4  # equal samples at an extreme
COARSE = 25  # steps in the range of a channel, below which its resolution shows
SPIKE = 12.0  # of the noise
_DIFFERENCES = 70.0  # sum of squares of 1, -4, 6, -4, 1


@dataclass(frozen=True)
class Quality:
    """What is seen in the samples of one channel, in its own unit.

    Attributes
    ----------
    samples, missing, longest_missing, first_missing : int
        Numbers of samples; of the longest run of missing ones, and the sample it begins at, from 1.
    lowest, median, highest : float
        NaN where every sample is missing.
    step : float
        That all values are multiples of; 0 where none shows.
    noise : float
        Standard deviation (1 sd), from fourth differences by their median; 0 where it is below the resolution.
    held_low, held_high : int
        Samples in runs of :data:`HELD` or more at the lowest and the highest value, where such runs are unusual.
    frozen, frozen_from : int
        Longest run of one value that is no extreme, where so long a run is unusual, and its first sample, from 1.
    spikes : int
        Single samples far from both neighbours.
    levels : int
        Different values, up to ``FEW_LEVELS`` + 1.
    """

    samples: int
    missing: int
    longest_missing: int
    first_missing: int
    lowest: float
    median: float
    highest: float
    step: float
    noise: float
    held_low: int
    held_high: int
    frozen: int
    frozen_from: int
    spikes: int
    levels: int

    @property
    def dead(self) -> bool:
        """Whether it never changes, or holds no valid sample."""
        return not self.highest > self.lowest

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader should know, a phrase each."""
        if self.missing == self.samples:
            return ("no valid sample",)
        found = []
        if self.dead:
            what = "a set value, or dead" if self.lowest else "dead, or not connected"
            found.append(f"constant {self.lowest:.6g}: {what}?")
        if self.missing:
            found.append(
                f"{self.missing} missing ({self.missing / self.samples:.1%}), at most {self.longest_missing} in a row "
                f"from sample {self.first_missing}"
            )
        for held, value, name in ((self.held_high, self.highest, "highest"), (self.held_low, self.lowest, "lowest")):
            if held:
                found.append(f"{held} samples stay at its {name} value {value:.6g}: saturated?")
        if self.frozen:
            found.append(f"repeats one value {self.frozen} times from sample {self.frozen_from}: frozen?")
        if self.spikes:
            found.append(f"{self.spikes} spikes of one sample")
        if self.step and not self.dead and FEW_LEVELS < (self.highest - self.lowest) / self.step < COARSE:
            found.append(f"coarse: {(self.highest - self.lowest) / self.step:.0f} steps of {self.step:.3g} in all")
        if 1 < self.levels <= FEW_LEVELS:
            found.append(f"only {self.levels} values: a switch or a state?")
        return tuple(found)


def quality(values: Array) -> Quality:
    """Look at the samples of one channel.

    Parameters
    ----------
    values : ndarray, shape (n,)
        In any unit, NaN where a sample is missing.
    """
    values = np.where(np.isinf(values), np.nan, np.asarray(values, float))
    there = np.isfinite(values)
    starts, lengths = _runs(~there)
    longest = int(lengths.argmax()) if lengths.size else -1
    gaps = (int(lengths[longest]), int(starts[longest]) + 1) if lengths.size else (0, 0)
    good = values[there]
    if not good.size:
        return Quality(values.size, values.size, *gaps, np.nan, np.nan, np.nan, 0.0, 0.0, 0, 0, 0, 0, 0, 0)
    low, high = float(good.min()), float(good.max())
    levels = int(min(np.unique(good[:MOST]).size, FEW_LEVELS + 1))
    with np.errstate(over="ignore", invalid="ignore"):  # numbers near the end of what a float holds
        step = resolution(good[:MOST])
        noise = noise_level(good[:MOST])
        still = (0, 0, 0, 0) if levels <= FEW_LEVELS else _still(values, low, high, step)
        spikes = _spikes(good, max(noise, step / np.sqrt(12)), high - low) if levels > FEW_LEVELS else 0
    return Quality(
        values.size, int(values.size - good.size), *gaps, low, float(np.median(good)), high, step, noise, *still,
        spikes, levels,
    )  # fmt: skip


def resolution(values: Array) -> float:
    """The step that all values are multiples of (but for one offset); 0 where none is coarse enough to be seen.

    Gaps between neighbouring values of 100 steps or more are not looked at: an error of the step adds up over them.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite, in any unit.
    """
    different = np.unique(values)
    if different.size < 3:
        return 0.0
    steps = np.diff(different)
    size = float(np.abs(different).max())
    steps = steps[steps > 1e-9 * size]  # rounding of printed numbers and of single precision
    if steps.size < 2:
        return 0.0
    step = float(np.median(steps[steps < 1.5 * steps.min()]))
    multiples = steps[steps < 100 * step] / step
    return step if np.max(np.abs(multiples - np.round(multiples))) < 0.05 else 0.0


def noise_level(values: Array) -> float:
    """Standard deviation of white noise, robust against the signal and spikes; 0 where most differences vanish.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite, in any unit, equally spaced.
    """
    if values.size < 10:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(values, 4))) / np.sqrt(_DIFFERENCES))


def _runs(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return edges[::2], edges[1::2] - edges[::2]


def _still(values: Array, low: float, high: float, step: float) -> tuple[int, int, int, int]:
    """Samples held at the extremes, the longest run of another value, and where that begins."""
    starts, lengths = _runs(np.diff(values) == 0.0)
    if not lengths.size:
        return 0, 0, 0, 0
    lengths = lengths + 1
    at = values[starts]
    inside = (at != low) & (at != high)
    usual = float(np.median(np.append(lengths[inside], np.ones(values.size - int(lengths.sum())))))
    held = []
    for extreme in (low, high):
        count = int(lengths[(at == extreme) & (lengths >= max(HELD, 5 * usual))].sum())
        near = np.abs(values - extreme) < max(1.5 * step, 0.01 * (high - low))
        beside = np.count_nonzero(near) - np.count_nonzero(values == extreme)  # many, where a peak is round
        rest = extreme == 0 or count > 0.5 * values.size  # standing still, or a set value
        held.append(0 if rest or count <= 2 * beside else count)
    longest = int(np.where(inside, lengths, 0).argmax())
    frozen = int(lengths[longest]) if inside[longest] and lengths[longest] >= max(20, 20 * usual) else 0
    return held[0], held[1], frozen, int(starts[longest]) + 1 if frozen else 0


def _spikes(values: Array, noise: float, span: float) -> int:
    if values.size < 10 or noise <= 0:
        return 0
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    off = np.minimum(np.abs(before), np.abs(after)) * (np.sign(before) == np.sign(after))
    return int(np.count_nonzero((off > SPIKE * noise) & (off > 0.1 * span)))
