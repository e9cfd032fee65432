"""The time of samples: sound clocks, one time base for several rates, and resampling if it is asked for."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tyre.formats.channel_map import ChannelMap, Clock, Resampling
from tyre.formats.signals import Signals
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import find_unit, says_nothing

GAP = 5.0
"""A step of so many usual ones is a gap."""

_LIMITS = {
    "repeated": 1e-6,  # of the usual step: less is rounding
    "uneven": 0.1,  # of the usual step
    "latest": 1e11,  # s, the year 5000
    "quickest": 1e-7,  # s between samples: no logger of a rig or a bicycle takes ten million of them a second
    "drift": 1e-3,  # relative change of the sample time from the first to the last tenth of a recording
    "near": 1e-3,  # of a step: samples so near to the even times are there already
}


def check_clock(time: Array, *, where: str) -> tuple[str, ...]:
    """Refuse a ``time`` (s) that is missing, stands still or runs back; say gaps, uneven steps and drift of another."""
    missing = np.flatnonzero(~np.isfinite(time))
    if missing.size:
        raise InputError(
            f"{where}: time is missing in {missing.size} of {time.size} samples, first in sample "
            f"{missing[0] + 1}; repair it, or give time = {{rate_hz = ...}} if the samples are equally spaced"
        )
    if time.size < 2:
        return ()
    if np.abs(time[[0, -1]]).max() > _LIMITS["latest"]:
        raise InputError(f"{where}: time reaches {np.abs(time).max():.3g} s, which is no date; check its unit")
    steps = np.diff(time)
    sampled_steps = steps[:: 1 + steps.size // 100_000]  # enough to tell how they scatter
    usual = float(np.median(sampled_steps))
    wrong = np.flatnonzero(steps <= _LIMITS["repeated"] * max(usual, 0.0))
    if wrong.size:
        first = int(wrong[0])
        back = steps[wrong] < -_LIMITS["repeated"] * abs(usual)
        fault = "runs back" if back[0] else "repeats"
        raise InputError(
            f"{where}: time {fault} at {int(np.count_nonzero(back == back[0]))} samples, first at sample "
            f"{first + 2} ({time[first]:.10g} s, then {time[first + 1]:.10g} s); cut the recording there, or "
            "give time = {rate_hz = ...} if the samples are equally spaced"
        )
    if usual < _LIMITS["quickest"]:
        raise InputError(f"{where}: time has {1 / usual:.3g} samples a second, which no logger takes; check its unit")
    notes = []
    gaps = np.flatnonzero(steps > GAP * usual)
    if gaps.size:
        notes.append(
            f"time jumps {gaps.size} times by more than {GAP:g} usual steps of {usual:.6g} s, first by "
            f"{steps[gaps[0]]:.6g} s after {time[gaps[0]]:.10g} s"
        )
    elif steps.max() > (1 + _LIMITS["uneven"]) * usual or steps.min() < (1 - _LIMITS["uneven"]) * usual:
        notes.append(f"time is uneven: its steps range from {steps.min():.6g} to {steps.max():.6g} s")
    tenth = steps.size // 10
    if tenth >= 10:
        first_step, last_step = np.median(steps[:tenth]), np.median(steps[-tenth:])
        resolution = float(np.ptp(np.quantile(sampled_steps, [0.1, 0.9])))  # rounded stamps make medians jump
        if abs(last_step / first_step - 1) > _LIMITS["drift"] and abs(last_step - first_step) > resolution / 2:
            notes.append(f"the sample time drifts from {first_step:.6g} to {last_step:.6g} s over the recording")
    return tuple(notes)


DAMAGED = 200
"""Samples, one of which may have a time that is missing or runs back for it alone: it is treated as a missing "
"sample."""


def damaged_times(time: Array) -> NDArray[np.bool_]:
    """Samples (n,), True where a ``time`` (s) is missing or breaks an otherwise rising order, as in a damaged
    line; all False if more than one in :data:`DAMAGED` would have to go, or if others run back or repeat."""
    bad = ~np.isfinite(time)
    for place in np.flatnonzero(time[1:] < time[:-1])[: time.size // DAMAGED + 1].tolist():
        before = time[place - 1] if place else -np.inf
        after = time[place + 2] if place + 2 < time.size else np.inf
        if time[place] < after:  # without the later one of the two all is in order
            bad[place + 1] = True
        elif before < time[place + 1]:
            bad[place] = True
    sound = time[~bad]
    in_order = bool((np.diff(sound) > 0).all())
    return bad if in_order and DAMAGED * np.count_nonzero(bad) <= time.size else np.zeros(time.size, bool)


ADVICE = "write [resampling] with rate_hz = {rate} (linear interpolation)"


def how_to(*times: Array) -> str:
    """Advise a rate for even steps: that of the fastest of ``times`` (s), dropped samples and gaps aside."""
    rate = max((usual_rate(time) for time in times if time.size > 1), default=0.0)
    return ADVICE.format(rate=f"{rate:.4g}" if rate > 0 else "...")


def usual_rate(time: Array) -> float:
    """Samples a second by the steps of ``time`` (s, shape (n,)) that are near their median, as rounded stamps make that
    jump; NaN if there is none."""
    steps = np.diff(np.where(np.isfinite(time), time, np.nan))
    usual = float(np.nanmedian(steps)) if np.isfinite(steps).any() else 0.0
    if not usual > 0:
        return float("nan")
    alike = steps[np.abs(steps - usual) <= 0.5 * usual]
    return float(1 / (alike.mean() if alike.size else usual))


def fills(time: Array, *values: Array) -> bool:
    """True if resampling leaves no sample of ``values`` at ``time`` (s), all of shape (n,), missing: no gap, no end."""
    valid_times = [time[np.isfinite(x)] for x in values]
    if any(t.size < 2 or t[0] > time[0] or t[-1] < time[-1] for t in valid_times):
        return False
    return max(float(np.diff(t).max()) for t in valid_times) <= GAP * float(np.median(np.diff(time)))


def one_time_base(
    signals: Signals, channel_map: ChannelMap, values: Mapping[str, Array]
) -> tuple[Array, dict[str, Array], tuple[str, ...]]:
    """Bring channels (SI units, each with its own number of samples) to one time base: time in s, values, notes."""
    where = signals.source
    times = _times(signals, channel_map, values)
    times, values, lost = _drop_damaged(times, values)
    first = next(iter(times.values()))
    alike = all(time_base is first or np.array_equal(time_base, first) for time_base in times.values())
    if alike and channel_map.resampling is None:
        return first, dict(values), (*lost, *check_clock(first, where=where))
    notes = [*lost]
    notes += [
        note
        for time_base in {id(t): t for t in times.values()}.values()
        for note in check_clock(time_base, where=where)
    ]
    if channel_map.resampling is None:
        counts = ", ".join(f"{name} {time_base.size} samples" for name, time_base in times.items())
        raise InputError(
            f"{where}: the channels were sampled at different times ({counts}); {how_to(*times.values())}, or "
            "like = CHANNEL for the times of one of them"
        )
    time, resampled, more = _resample(times, values, channel_map.resampling, where)
    return time, resampled, (*notes, *more)


def _drop_damaged(
    times: Mapping[str, Array], values: Mapping[str, Array]
) -> tuple[dict[str, Array], dict[str, Array], tuple[str, ...]]:
    """Take out the samples of :func:`damaged_times`; also a note."""
    damaged = {key: damaged_times(time) for key, time in {id(time): time for time in times.values()}.items()}
    count = sum(int(np.count_nonzero(bad)) for bad in damaged.values())
    if not count:
        return dict(times), dict(values), ()
    sound = {id(time): time[~damaged[id(time)]] for time in times.values()}  # one array for the channels that share it
    sound_values = {name: values[name][~damaged[id(time)]] for name, time in times.items()}
    note = f"samples whose time is missing or out of order, treated as missing: {count}"
    return {name: sound[id(time)] for name, time in times.items()}, sound_values, (note,)


def _times(signals: Signals, channel_map: ChannelMap, values: Mapping[str, Array]) -> dict[str, Array]:
    """Times of every channel, s: those of the clock of the map, else the channel's own."""
    where, clock = signals.source, channel_map.clock
    if clock is None:
        times = {name: signals[entry.column].time for name, entry in channel_map.channels.items()}
        silent = next((name for name, time in times.items() if time is None), "")
        if silent:
            raise InputError(
                f"{where}: the file gives no times of {silent}; add time = {{column = ..., unit = ...}} or "
                "time = {rate_hz = ...} to [channels]"
            )
        return {name: time for name, time in times.items() if time is not None}
    column = clock.column or clock.index
    stamps = signals[column] if column else None
    lengths = {name: x.size for name, x in values.items()} | ({"time": stamps.values.size} if stamps else {})
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise InputError(f"{where}: the channels have different numbers of samples ({counts}), so not one clock")
    factor = _time_factor(clock.unit, stamps.unit if clock.column and stamps else "s", f"{where}: time")
    count = next(iter(lengths.values()))
    return dict.fromkeys(values, sample_times(clock, stamps.values if stamps else None, count, factor, where=where))


def sample_times(clock: Clock, values: Array | None, count: int, factor: float, *, where: str) -> Array:
    """Times (n,) of ``count`` samples in s: ``values`` of the clock's column times ``factor``, or by its rate."""
    if values is None:
        return np.arange(count) / clock.rate
    if clock.index:
        if not np.isfinite(values).all() or (values != np.round(values)).any():
            raise InputError(f"{where}: {clock.index} does not count samples: it must hold whole numbers")
        return (values - values[0]) / clock.rate
    return factor * values


def _time_factor(unit: str, written: str, where: str) -> float:
    if "datetime" in (unit, written):  # dates are in s after the first one once read
        if unit not in ("", "datetime") or written != "datetime":
            contents = "dates" if written == "datetime" else "no dates"
            raise InputError(f"{where}: the column holds {contents}; correct its unit")
        return 1.0
    if not unit and says_nothing(written):
        raise InputError(f"{where}: the file states no unit of time; add unit = 's' or 'ms' in the channel map")
    time_unit = find_unit(unit or written, "time", where=where)
    if unit and not says_nothing(written) and find_unit(written, "time", where=where) != time_unit:
        raise InputError(f"{where}: the file states {written!r}, the channel map {unit!r}; remove one of them")
    return time_unit.factor


def _resample(
    times: Mapping[str, Array], values: Mapping[str, Array], how: Resampling, where: str
) -> tuple[Array, dict[str, Array], list[str]]:
    """All channels at the same times (s), within the span that all of them cover, NaN inside gaps; notes on each."""
    first, last = max(t[0] for t in times.values()), min(t[-1] for t in times.values())
    if not last > first:
        raise InputError(f"{where}: the channels share no span of time; were they recorded together?")
    if how.like and how.like not in times:
        raise InputError(f"{where}: [resampling]: like = {how.like!r} is no channel; there are {', '.join(times)}")
    if how.like:
        base = times[how.like]
        time = base[(base >= first) & (base <= last)]
    else:
        time = first + np.arange(int(np.floor((last - first) * how.rate * (1 + 1e-12))) + 1) / how.rate
    if time.size < 2:
        raise InputError(f"{where}: only {time.size} samples after resampling; take a higher rate")
    resampled: dict[str, Array] = {}
    notes = []
    rate = (time.size - 1) / (time[-1] - time[0])
    for name, old_time in times.items():
        if old_time.size == time.size and np.array_equal(old_time, time) and how.like:
            resampled[name] = values[name]
            continue
        resampled[name] = _interpolate(time, old_time, values[name])
        missing = np.count_nonzero(~np.isfinite(values[name]))
        tolerance = _LIMITS["near"] * (time[1] - time[0])
        if 0 <= old_time.size - time.size <= 1 and np.abs(old_time[: time.size] - time).max() <= tolerance:
            # at even steps already but for rounding, and for a last one that these leave out
            x = values[name][: time.size]
            resampled[name] = np.where(np.isfinite(x), x, resampled[name])
            filled = np.count_nonzero(np.isfinite(resampled[name]) & ~np.isfinite(x))
            if missing:
                notes.append(f"{name}: {filled} of {missing} missing samples filled by linear interpolation")
            continue
        old_rate = (old_time.size - 1) / (old_time[-1] - old_time[0])
        fewer = "; no filter was applied, faster oscillations are mirrored" if old_rate > 1.01 * rate else ""
        lost = f"; {missing} samples were missing" if missing else ""
        same_rate = f"{old_rate:.6g}" == f"{rate:.6g}"
        change = (
            f"put at even steps of {rate:.6g} Hz" if same_rate else f"resampled from {old_rate:.6g} Hz to {rate:.6g} Hz"
        )
        notes.append(f"{name}: {change} by linear interpolation{lost}{fewer}")
    return time, resampled, notes


def _interpolate(time: Array, old_time: Array, values: Array) -> Array:
    """Linear interpolation; NaN if the samples on both sides are further apart than a gap."""
    valid = np.isfinite(values)
    if np.count_nonzero(valid) < 2:
        return np.full(time.shape, np.nan)
    valid_time, x = old_time[valid], values[valid]
    interpolated = np.interp(time, valid_time, x, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(valid_time, time), 1, valid_time.size - 1)
    wide = valid_time[after] - valid_time[after - 1] > GAP * np.median(np.diff(old_time))
    interpolated[wide & ~np.isin(time, valid_time)] = np.nan
    return np.asarray(interpolated, float)
