"""Up and down branches of a slip sweep, and the block means the fit works on."""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from tyre.base.errors import InputError
from tyre.recordings.recording import Channel, RigRun

_SLIP_PER_BLOCK = np.deg2rad(0.1)  # the side force is straight within a block
_REVERSAL = 0.25  # a reversal stands out by this share of the slip range
_SETTLING = 0.5  # m travelled after a reversal before the lag of a bicycle tyre has settled


@dataclass(frozen=True)
class Blocks:
    """Block means along a sweep.

    Every array has shape (m,). ``time`` s (travelled distance over mean speed, where the speed was recorded), ``slip``
    rad, ``force`` N, ``moment`` N m or None, ``branch`` the number of the branch, ``rate`` d(slip)/dt of that branch
    in rad/s, ``settled`` False where a reversal (or the start) is too near for the lag to be steady, ``first`` the
    number of its first sample, from 0, ``size`` how many samples it has.
    """

    time: Channel
    slip: Channel
    force: Channel
    moment: Channel | None
    branch: NDArray[np.int64]
    rate: Channel
    settled: NDArray[np.bool_]
    speed: float | None
    missing: int
    first: NDArray[np.int64]
    size: NDArray[np.int64]

    @property
    def branch_rates(self) -> Channel:
        """d(slip)/dt of every branch, rad/s, shape (number of branches,)."""
        first = np.unique(self.branch, return_index=True)[1]
        return self.rate[first]


def slip_reversals(run: RigRun) -> NDArray[np.int64]:
    """Sample numbers where the slip angle turns round, with the first and the last sample.

    Parameters
    ----------
    run : RigRun

    Returns
    -------
    ndarray of int, shape (branches + 1,)

    Raises
    ------
    InputError
        When time does not increase or the slip angle does not change.
    """
    where = str(run.source or run.condition.tyre)
    if run.time.size < 20:
        raise InputError(f"{where}: {run.time.size} samples are too few for a slip sweep; at least 20 are needed")
    if not np.all(np.diff(run.time) > 0.0):
        raise InputError(f"{where}: time does not increase from sample to sample; sort the recording or cut it")
    slip = _filled(run.slip_angle, run.time, f"{where}: slip_angle")
    span = float(np.ptp(slip))
    if span < np.deg2rad(1.0):
        raise InputError(
            f"{where}: the slip angle spans {np.rad2deg(span):.2f} deg; a sweep of at least 1 deg is needed"
        )
    # Light smoothing, so that sensor noise at a turning point does not move it by more than a few samples.
    width = max(1, slip.size // 2000) * 2 + 1
    smooth = np.convolve(np.pad(slip, width // 2, mode="edge"), np.full(width, 1.0 / width), mode="valid")
    tops = find_peaks(smooth, prominence=_REVERSAL * span)[0]
    bottoms = find_peaks(-smooth, prominence=_REVERSAL * span)[0]
    return np.unique(np.concatenate([[0], tops, bottoms, [slip.size]]))


def block_means(run: RigRun) -> Blocks:
    """Average a sweep over blocks of 0.1 deg of slip, branch by branch.

    Averaging in time removes nearly all sensor noise from the slip angle (which would bias the slope) and leaves the
    lag untouched, because slip and force are averaged alike.

    Parameters
    ----------
    run : RigRun

    Returns
    -------
    Blocks

    Raises
    ------
    InputError
        For a recording that is no sweep, or with more than a fifth of its side force missing.
    """
    where = str(run.source or run.condition.tyre)
    edges = slip_reversals(run)
    slip = _filled(run.slip_angle, run.time, f"{where}: slip_angle")
    valid = np.isfinite(run.side_force)
    if valid.mean() < 0.8:
        raise InputError(
            f"{where}: {100.0 * (1.0 - valid.mean()):.0f} % of the side force is missing; at most 20 % may be"
        )
    clock, speed = _clock(run)
    starts, branch, rate = [], [], []
    for number, (low, high) in enumerate(itertools.pairwise(edges)):
        change = slip[high - 1] - slip[low]
        count = int(np.clip(round(abs(change) / _SLIP_PER_BLOCK), 1, high - low))
        starts.append(low + (np.arange(count) * (high - low)) // count)
        branch.append(np.full(count, number))
        rate.append(np.full(count, _slope(run.time[low:high], slip[low:high])))
    first = np.concatenate(starts)
    owner = np.concatenate(branch)
    size = np.diff(np.append(first, slip.size))
    good = np.add.reduceat(valid.astype(float), first)
    usable = good >= 0.5 * size

    def mean(channel: Channel, weight: Channel) -> Channel:
        return np.add.reduceat(np.where(weight > 0.0, channel, 0.0), first) / np.maximum(
            np.add.reduceat(weight, first), 1.0
        )

    weight = valid.astype(float)
    time = mean(clock, weight)
    began = clock[edges[:-1]][owner]
    pace = speed if speed is not None else 1.0
    moment = None
    if run.aligning_moment is not None and np.isfinite(run.aligning_moment).mean() > 0.8:
        moment = mean(run.aligning_moment, weight * np.isfinite(run.aligning_moment))
    blocks = Blocks(
        time=time,
        slip=mean(slip, weight),
        force=mean(run.side_force, weight),
        moment=moment,
        branch=owner,
        rate=np.concatenate(rate),
        settled=(clock[first] - began) * pace > _SETTLING,
        speed=speed,
        missing=int(np.sum(~valid)),
        first=first,
        size=size,
    )
    if usable.all():
        return blocks
    names = ("time", "slip", "force", "branch", "rate", "settled", "first", "size")
    kept = {name: getattr(blocks, name)[usable] for name in names}
    return Blocks(**kept, moment=None if moment is None else moment[usable], speed=speed, missing=blocks.missing)


def samples_used(run: RigRun, blocks: Blocks) -> NDArray[np.bool_]:
    """Which samples of a sweep stand in the block means that are fitted: settled ones with a side force.

    Parameters
    ----------
    run : RigRun
    blocks : Blocks
        Of this run.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    used = np.zeros(run.time.size, bool)
    for first, size in zip(blocks.first[blocks.settled], blocks.size[blocks.settled], strict=True):
        used[first : first + size] = True
    return used & np.isfinite(run.side_force)


def _clock(run: RigRun) -> tuple[Channel, float | None]:
    """Time, or travelled distance over mean speed where the speed was recorded; and the mean speed, m/s."""
    if run.speed is None or not np.isfinite(run.speed).any():
        return run.time, run.condition.speed
    speed = _filled(run.speed, run.time, str(run.source or run.condition.tyre))
    mean = float(np.mean(speed))
    if mean <= 0.0:
        raise InputError(
            f"{run.source or run.condition.tyre}: mean speed {mean:.3g} m/s; a rolling tyre needs a speed above 0"
        )
    if np.ptp(speed) < 1e-3 * mean:
        return run.time, mean
    steps = np.diff(run.time) * 0.5 * (speed[1:] + speed[:-1])
    return run.time[0] + np.concatenate([[0.0], np.cumsum(steps)]) / mean, mean


def _filled(channel: Channel, time: Channel, where: str) -> Channel:
    valid = np.isfinite(channel)
    if valid.all():
        return channel
    if valid.mean() < 0.8:
        raise InputError(
            f"{where}: {100.0 * (1.0 - valid.mean()):.0f} % of the channel is missing; at most 20 % may be"
        )
    return np.interp(time, time[valid], channel[valid])


def _slope(x: Channel, y: Channel) -> float:
    x = x - x.mean()
    spread = float(x @ x)
    return float(x @ (y - y.mean())) / spread if spread > 0.0 else 0.0
