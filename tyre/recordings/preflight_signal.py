"""What can be wrong with a sampled signal, whatever it measures: gaps, dropouts, frozen and saturated stretches."""

import numpy as np

from tyre.recordings.recording import Channel

_GAP = 5.0  # a time step of so many usual steps is a gap


def time_faults(time: Channel) -> list[tuple[str, bool]]:
    """Faults of ``time`` (n,), in s, as (text, whether it forbids a fit)."""
    if np.isnan(time).any():
        return [(f"time is missing in {np.count_nonzero(np.isnan(time))} samples; remove these rows", True)]
    steps = np.diff(time)
    backward = np.flatnonzero(steps <= 0.0)
    if backward.size:
        first = int(backward[0])
        return [
            (
                f"time does not increase at {backward.size} samples, first at sample {first + 2} "
                f"({time[first]:g} s, then {time[first + 1]:g} s); sort or cut the recording",
                True,
            )
        ]
    gaps = np.flatnonzero(steps > _GAP * np.median(steps))
    if gaps.size:
        return [(f"{gaps.size} gaps in time, the first of {steps[gaps[0]]:.3g} s after {time[gaps[0]]:g} s", False)]
    return []


def dropouts(name: str, channel: Channel, *, allowed_share: float = 0.2) -> list[tuple[str, bool]]:
    """Missing samples of a channel; more than ``allowed_share`` of them forbid a fit.

    Parameters
    ----------
    name : str
        What the message calls the channel.
    channel : ndarray, shape (n,)
        In any unit, NaN where a sample is missing.
    allowed_share : float, optional
        Largest share of missing samples that still allows a fit.
    """
    missing = np.isnan(channel)
    if not missing.any():
        return []
    starts, lengths = runs(missing)
    text = (
        f"{name} has {np.count_nonzero(missing)} missing samples ({missing.mean():.1%}), the longest run of "
        f"{lengths.max()} from sample {starts[lengths.argmax()] + 1}"
    )
    return [(text, bool(missing.mean() > allowed_share))]


def stuck(name: str, channel: Channel, mover: Channel, *, travel: float) -> list[tuple[str, bool]]:
    """Stretches where a channel repeats one value while ``mover`` travels: saturated at its extremes, else frozen.

    Parameters
    ----------
    name : str
        For the text.
    channel, mover : ndarray, shape (n,)
        What should follow, and what it should follow.
    travel : float
        Travel of ``mover`` within a stretch, in its unit, that cannot leave a live channel unchanged.

    Returns
    -------
    list of (str, bool)
        Text, and True as such a stretch forbids a fit.
    """
    starts, lengths = runs(np.diff(channel) == 0.0)
    faults, saturated, frozen = [], 0, 0
    lowest, highest = np.nanmin(channel), np.nanmax(channel)
    for start, length in zip(starts, lengths, strict=True):
        stretch = mover[start : start + length + 1]
        if length < 4 or np.isnan(stretch).all() or np.nanmax(stretch) - np.nanmin(stretch) < travel:
            continue
        if channel[start] in (lowest, highest):
            saturated += int(length) + 1
        else:
            frozen += int(length) + 1
    if saturated:
        faults.append((f"{name} is saturated: {saturated} samples stay at its extreme values", True))
    if frozen:
        faults.append((f"{name} is frozen: {frozen} samples repeat one value while the rig moves", True))
    return faults


def runs(flags: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and lengths (numbers of samples) of the runs of True in ``flags`` (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    return edges[::2], edges[1::2] - edges[::2]


def count_branches(channel: Channel) -> int:
    """How often ``channel`` (n,), in any unit, runs through its whole range; half runs (middle to an end) add up."""
    finite = channel[np.isfinite(channel)]
    if finite.size == 0 or finite.min() == finite.max():
        return 0
    middle, half = (finite.max() + finite.min()) / 2, (finite.max() - finite.min()) / 2
    place = (finite - middle) / half
    zone = np.select([place > 0.5, place < -0.5, np.abs(place) < 0.25], [1, -1, 0], default=9)  # 9: between zones
    zone = zone[zone != 9]
    return int(np.count_nonzero(np.diff(zone))) // 2


def slope(x: Channel, y: Channel) -> tuple[float, float]:
    """Least-squares slope of ``y`` over ``x`` (n,) and their correlation where both are there; NaN if x is constant."""
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < 2:
        return float("nan"), float("nan")
    dx, dy = x[both] - x[both].mean(), y[both] - y[both].mean()
    if not dx.any():
        return float("nan"), float("nan")
    spread = float(np.sqrt((dx @ dx) * (dy @ dy)))
    return float(dx @ dy / (dx @ dx)), float(dx @ dy / spread) if spread else 0.0
