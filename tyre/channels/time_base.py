"""One time base for the channels of a map: its clock, the times of the file, or resampling that is asked for."""

from collections.abc import Mapping

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.clock import check_clock
from tyre.channels.even_steps import how_to
from tyre.channels.resampling import resampled
from tyre.channels.signals import Signals
from tyre.channels.units import find_unit, says_nothing

DATETIME = "datetime"
"""Unit of a column of dates and times: s after its first one once read."""


def without_times(signals: Signals, channel_map: ChannelMap) -> bool:
    """Whether a file (``signals``) gives none of the channels of ``channel_map`` its own times."""
    return all(signals[entry.column].time is None for entry in channel_map.channels.values())


def one_time_base(
    signals: Signals, channel_map: ChannelMap, values: Mapping[str, Array]
) -> tuple[Array, dict[str, Array], tuple[str, ...]]:
    """Time of the samples, s, and the channels at these times.

    Parameters
    ----------
    signals : Signals
    channel_map : ChannelMap
    values : mapping of str to ndarray, shape (n,)
        Channels of the map, in SI units; each may have its own n.

    Returns
    -------
    time : ndarray, shape (m,)
    values : dict of str to ndarray, shape (m,)
    notes : tuple of str

    Raises
    ------
    InputError
        Different numbers of samples under one clock, a clock that cannot be, rates that differ without resampling.
    """
    where, clock = signals.source, channel_map.clock
    if clock is not None:
        lengths = {name: x.size for name, x in values.items()}
        column = clock.column or clock.index
        stamps = signals[column] if column else None
        if stamps is not None:
            lengths["time"] = stamps.values.size
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{name} {count}" for name, count in lengths.items())
            raise InputError(f"{where}: the channels have different numbers of samples ({said}), so not one clock")
        factor = _time_factor(clock.unit, stamps.unit if clock.column and stamps else "s", where)
        count = next(iter(lengths.values()))
        time = clock.times(None if stamps is None else stamps.values, count, factor, where=where)
        if channel_map.resampling is None:
            return time, dict(values), check_clock(time, where=where)
        times = dict.fromkeys(values, time)
    else:
        times = {}
        for name, entry in channel_map.channels.items():
            own = signals[entry.column].time
            if own is None:
                raise InputError(
                    f"{where}: the file gives no times of {name}; add time = {{column = ..., unit = ...}} or "
                    "time = {rate_hz = ...} to [channels]"
                )
            times[name] = own
        first = next(iter(times.values()))
        if all(own is first or np.array_equal(own, first) for own in times.values()) and channel_map.resampling is None:
            return first, dict(values), check_clock(first, where=where)
    notes = [note for own in {id(t): t for t in times.values()}.values() for note in check_clock(own, where=where)]
    if channel_map.resampling is None:
        said = ", ".join(f"{name} {own.size} samples" for name, own in times.items())
        raise InputError(
            f"{where}: the channels were sampled at different times ({said}); {how_to(*times.values())}, or "
            "like = CHANNEL for the times of one of them"
        )
    time, found, more = resampled(times, values, channel_map.resampling, where=where)
    return time, found, (*notes, *more)


def _time_factor(unit: str, written: str, where: str) -> float:
    here = f"{where}: time"
    if DATETIME in (unit, written):
        if unit not in ("", DATETIME) or written != DATETIME:
            raise InputError(
                f"{here}: the column holds {'dates' if written == DATETIME else 'no dates'}; mend its unit"
            )
        return 1.0
    silent = says_nothing(written)
    if not unit and silent:
        raise InputError(f"{here}: the file says no unit of time; add unit = 's' or 'ms' in the channel map")
    found = find_unit(unit or written, "time", where=here)
    if unit and not silent and find_unit(written, "time", where=here) != found:
        raise InputError(f"{here}: the file says {written!r}, the channel map {unit!r}; take one of them out")
    return found.factor
