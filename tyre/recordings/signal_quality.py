"""Quality of a recorded channel: resolution, noise, missing, saturated and frozen stretches, spikes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tyre.ground.arrays import Array

_MOST = 200_000  # samples looked at for resolution and noise
_FEW = 8  # a channel of so few values is a switch or a counter of states


@dataclass(frozen=True)
class Quality:
    """Findings in the samples of one channel, in its own unit; samples are numbered from 1, ``noise`` is 1 sd."""

    samples: int  # number of all samples
    missing: int  # number of samples without a value
    longest_missing: int  # samples of the longest run without a value
    first_missing: int  # first sample of that run; 0 if none is missing
    lowest: float  # smallest value; NaN without a valid sample
    median: float  # NaN without a valid sample
    highest: float  # largest value; NaN without a valid sample
    step: float  # resolution, that all values are multiples of; 0 if it is not seen
    noise: float  # 1 sd of white noise; 0 if it is not seen
    held_low: int  # number of samples that stay at the lowest value (saturated)
    held_high: int  # number of samples that stay at the highest value (saturated)
    frozen: int  # samples of the longest run of one value between the extremes; 0 if it is usual
    frozen_from: int  # first sample of that run; 0 if none
    spikes: int  # number of single samples far off both neighbours
    levels: int  # number of different values; 9 for more than 8
    dropouts: int = 0  # stretches in which it falls to one value and comes back
    dropout_samples: int = 0  # number of samples in all dropouts
    dropout_from: int = 0  # first sample of the first dropout; 0 if none
    dropout_value: float = 0.0  # value to which it falls

    @property
    def dead(self) -> bool:
        """True if it never changes, or holds no valid sample."""
        return not self.highest > self.lowest

    @property
    def losses(self) -> tuple[str, ...]:
        """Remarks on samples that hold no measured value, a phrase each."""
        phrases = []
        if self.missing:
            phrases.append(
                f"{self.missing} missing ({self.missing / self.samples:.1%}), at most {self.longest_missing} in a row "
                f"from sample {self.first_missing}"
            )
        if self.dropouts:
            phrases.append(
                f"{self.dropouts} {'dropouts' if self.dropouts > 1 else 'dropout'} to {self.dropout_value:.6g}, "
                f"{self.dropout_samples} samples, the first from sample {self.dropout_from}"
            )
        return tuple(phrases)

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks for a reader, a phrase each."""
        if self.missing == self.samples:
            return ("no valid sample",)
        phrases = []
        if self.dead:
            cause = "a set value, or dead" if self.lowest else "dead, or not connected"
            phrases.append(f"constant {self.lowest:.6g}: {cause}?")
        phrases += self.losses
        for is_held, value, name in ((self.held_high, self.highest, "highest"), (self.held_low, self.lowest, "lowest")):
            if is_held:
                phrases.append(f"{is_held} samples stay at its {name} value {value:.6g}: saturated?")
        if self.frozen:
            phrases.append(f"repeats one value {self.frozen} times from sample {self.frozen_from}: frozen?")
        if self.spikes:
            phrases.append(f"{self.spikes} {'spikes' if self.spikes > 1 else 'spike'} of one sample")
        if self.step and not self.dead and _FEW < (self.highest - self.lowest) / self.step < 25:  # so few steps show
            phrases.append(f"coarse: {(self.highest - self.lowest) / self.step:.0f} steps of {self.step:.3g} in all")
        if 1 < self.levels <= _FEW:
            phrases.append(f"only {self.levels} values: a switch or a state?")
        return tuple(phrases)


def quality(values: Array) -> Quality:
    """Look at the samples (n,) of one channel in any unit, NaN if missing."""
    values = np.where(np.isinf(values), np.nan, np.asarray(values, float))
    valid = np.isfinite(values)
    starts, lengths = runs(~valid)
    longest = int(lengths.argmax()) if lengths.size else -1
    gaps = (int(lengths[longest]), int(starts[longest]) + 1) if lengths.size else (0, 0)
    good = values[valid]
    if not good.size:
        return Quality(values.size, values.size, *gaps, np.nan, np.nan, np.nan, 0.0, 0.0, 0, 0, 0, 0, 0, 0)
    low, high = float(good.min()), float(good.max())
    levels = int(min(np.unique(good[:_MOST]).size, _FEW + 1))
    with np.errstate(over="ignore", invalid="ignore"):  # numbers near the end of what a float holds
        step = resolution(good[:_MOST])
        noise = noise_level(good[:_MOST])
        still = (0, 0, 0, 0) if levels <= _FEW else _find_still(values, low, high, step)
        visible = max(noise, step / np.sqrt(12))
        spikes = _spikes(good, visible, high - low) if levels > _FEW else 0
        dropouts = _dropouts(values, visible, low, high) if levels > _FEW else (0, 0, 0, 0.0)
    count, samples, first, value = dropouts
    spikes = max(spikes - count, 0) if count == samples else spikes  # of one sample each
    return Quality(
        values.size,
        int(values.size - good.size),
        *gaps,
        low,
        float(np.median(good)),
        high,
        step,
        noise,
        *still,
        spikes,
        levels,
        count,
        samples,
        first,
        value,
    )


def resolution(values: Array) -> float:
    """Find the step that all values are multiples of, but for one offset; 0 if none is coarse enough to be seen."""
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
    """Standard deviation of white noise, robust against the signal and spikes; 0 if most differences vanish."""
    if values.size < 10:
        return 0.0
    return float(1.4826 * np.median(np.abs(np.diff(values, 4))) / np.sqrt(70.0))  # squares of 1, -4, 6, -4, 1


def runs(flags: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return edges[::2], edges[1::2] - edges[::2]


def _find_still(values: Array, low: float, high: float, step: float) -> tuple[int, int, int, int]:
    """Samples held at the extremes, the longest run of another value, and where that begins."""
    starts, lengths = runs(np.diff(values) == 0.0)
    if not lengths.size:
        return 0, 0, 0, 0
    lengths = lengths + 1
    value_of_run = values[starts]
    between_extremes = (value_of_run != low) & (value_of_run != high)
    usual = float(np.median(np.append(lengths[between_extremes], np.ones(values.size - int(lengths.sum())))))
    is_held = []
    for extreme in (low, high):
        count = int(lengths[(value_of_run == extreme) & (lengths >= max(4, 5 * usual))].sum())
        near_extreme = np.abs(values - extreme) < max(1.5 * step, 0.01 * (high - low))
        near_only = np.count_nonzero(near_extreme) - np.count_nonzero(values == extreme)  # many, where a peak is round
        at_rest = extreme == 0 or count > 0.5 * values.size  # standing still, or a set value
        is_held.append(0 if at_rest or count <= 2 * near_only else count)
    longest = int(np.where(between_extremes, lengths, 0).argmax())
    frozen = int(lengths[longest]) if between_extremes[longest] and lengths[longest] >= max(20, 20 * usual) else 0
    return is_held[0], is_held[1], frozen, int(starts[longest]) + 1 if frozen else 0


def _dropouts(values: Array, noise: float, low: float, high: float) -> tuple[int, int, int, float]:
    """Number of dropouts, of their samples, the first one from 1, and the value to which a channel falls: 0, or an
    end of its range that is far off; it comes back to about where it was."""
    best = (0, 0, 0, 0.0)
    for value in dict.fromkeys((0.0, low, high)):
        starts, lengths = runs(values == value)
        inner = (starts > 0) & (starts + lengths < values.size)
        starts, lengths = starts[inner], lengths[inner]
        before, after = values[starts - 1] - value, values[starts + lengths] - value
        fall = np.minimum(np.abs(before), np.abs(after))
        far = (fall > 12.0 * noise) & (fall > 0.1 * (high - low)) & (np.abs(before - after) < 0.3 * fall)
        if np.count_nonzero(far) > best[0]:
            best = (int(np.count_nonzero(far)), int(lengths[far].sum()), int(starts[far][0]) + 1, float(value))
    return best


def _spikes(values: Array, noise: float, span: float) -> int:
    if values.size < 10 or noise <= 0:
        return 0
    before, after = values[1:-1] - values[:-2], values[1:-1] - values[2:]
    off = np.minimum(np.abs(before), np.abs(after)) * (np.sign(before) == np.sign(after))
    return int(np.count_nonzero((off > 12.0 * noise) & (off > 0.1 * span)))
