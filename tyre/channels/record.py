"""Channels in SI units on one time base, one record for every event of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, refuse_unknown
from tyre.channels.channel_map import ChannelMap, MappedColumn
from tyre.channels.clock import Clock
from tyre.channels.draft import refuse_unmapped
from tyre.channels.mounting import Mounting
from tyre.channels.read import read_signals
from tyre.channels.signals import Signals
from tyre.channels.time_base import one_time_base, without_times
from tyre.channels.units import SI, Unit, find_unit, quantity_of, says_nothing
from tyre.channels.windows import cut

_ABSURD = 1e12  # in any SI unit of a channel
_EPOCH = 1e6  # s; times beyond are those of a calendar


@dataclass(frozen=True, eq=False)
class Record:
    """One event of a recording.

    Attributes
    ----------
    source : str
        The file, with the name of the event where there are several.
    time : ndarray, shape (n,)
        s, rising; as in the file (of dates: since the first sample).
    values : mapping of str to ndarray, shape (n,)
        Channels in SI units (temperature in degrees Celsius); NaN where a sample is missing.
    mountings : tuple of Mounting
        Rotations that were applied, with their uncertainty.
    notes : tuple of str
        What a reader must be told: resampling, gaps of the clock, lines passed over.
    event : str
        Name of the event; empty for a whole recording.
    timed : bool
        False where nothing says the time: then ``time`` numbers the samples.
    """

    source: str
    time: Array
    values: Mapping[str, Array]
    mountings: tuple[Mounting, ...] = ()
    notes: tuple[str, ...] = ()
    event: str = ""
    timed: bool = True


def read_records(
    path: Path, channel_map: ChannelMap, quantities: Mapping[str, str], *, timed: bool = True
) -> tuple[Record, ...]:
    """Read the channels of a map from a file.

    Parameters
    ----------
    path : Path
        In any format of :func:`tyre.channels.read.read_signals`.
    channel_map : ChannelMap
    quantities : mapping of str to str
        Channels that are known, and what each measures (see :data:`tyre.channels.units.QUANTITIES`).
    timed : bool
        Whether the time is needed; else a map and a file that say none are accepted.

    Returns
    -------
    tuple of Record
        One for every event, in the order of the windows.

    Raises
    ------
    InputError
        As :func:`tyre.channels.read.read_signals` and :func:`records`.
    """
    if not channel_map.channels:
        refuse_unmapped(path, quantities, reading=channel_map.reading)
    return _records(read_signals(path, map=channel_map), channel_map, quantities, timed=timed, own=True)


def records(
    signals: Signals, channel_map: ChannelMap, quantities: Mapping[str, str], *, timed: bool = True
) -> tuple[Record, ...]:
    """Bring signals to SI units, one time base and the axes of the vehicle, and cut them into events.

    Parameters
    ----------
    signals : Signals
    channel_map : ChannelMap
    quantities : mapping of str to str
        Channels that are known, and what each measures.
    timed : bool
        As in :func:`read_records`.

    Returns
    -------
    tuple of Record

    Raises
    ------
    InputError
        A channel or column that is not known, a unit that is missing, of another quantity or not that of the file, a
        channel without valid samples, a clock that stands still or runs back, rates that differ without resampling.
    """
    return _records(signals, channel_map, quantities, timed=timed, own=False)


def _records(
    signals: Signals, channel_map: ChannelMap, quantities: Mapping[str, str], *, timed: bool, own: bool
) -> tuple[Record, ...]:
    """As :func:`records`; signals of one's ``own`` are converted where they lie, for large files fill the memory."""
    where = signals.source
    known = _all_quantities(channel_map, quantities)
    units = {name: _unit(signals, entry, known[name], where, name) for name, entry in channel_map.channels.items()}
    stamps = channel_map.clock and (channel_map.clock.column or channel_map.clock.index)
    used = [signals.find(entry.column) for entry in channel_map.channels.values()]
    used += [signals.find(stamps)] if stamps else []
    values = {
        name: _in_si(signals, entry, units[name], in_place=own and used.count(signals.find(entry.column)) == 1)
        for name, entry in channel_map.channels.items()
    }
    for name, x in values.items():
        _check_values(x, f"{where}: {name} (column {channel_map.channels[name].column})")
    untimed = not timed and channel_map.clock is None and without_times(signals, channel_map)
    if untimed:
        channel_map = replace(channel_map, clock=Clock(rate=1.0))
    time, values, notes = one_time_base(signals, channel_map, values)
    if abs(time[0]) > _EPOCH:
        notes = (*notes, f"time is counted from its first sample, {time[0]:.10g} s")
        time = time - time[0]
    for mounting in channel_map.mountings:
        values |= mounting.turned(values)
        known_to = f" (known to {np.rad2deg(mounting.sd):g} deg, 1 sd)" if mounting.sd else ""
        notes = (*notes, f"{', '.join(mounting.channels)} turned from the axes of their sensor{known_to}")
    whole = Record(
        where, time, _kept(values, quantities), channel_map.mountings, (*signals.notes, *notes), timed=not untimed
    )
    if not channel_map.windows:
        return (whole,)
    levels = {}
    for window in channel_map.windows:
        if window.trigger is not None:
            name = window.trigger.channel
            unit = find_unit(window.trigger.unit, known[name], where=f"{where}, trigger of window {window.name!r}")
            levels[window.name] = values[name], unit.factor * window.trigger.level + unit.offset
    events, more = cut(channel_map.windows, time, levels, where=where)
    return tuple(_event(whole, name, span, more, several=len(events) > 1) for name, span in events.items())


def _kept(values: Mapping[str, Array], quantities: Mapping[str, str]) -> dict[str, Array]:
    """Channels that are known; the others only turned a sensor or triggered an event."""
    return {name: x for name, x in values.items() if name in quantities}


def _event(whole: Record, name: str, span: slice, more: list[str], *, several: bool) -> Record:
    if span.stop - span.start < 2:
        raise InputError(f"{whole.source}: event {name} holds {span.stop - span.start} samples; make its window longer")
    return replace(
        whole, time=whole.time[span], values={key: x[span] for key, x in whole.values.items()}, event=name,
        source=f"{whole.source}#{name}" if several else whole.source, notes=(*whole.notes, *more),
    )  # fmt: skip


def _all_quantities(channel_map: ChannelMap, quantities: Mapping[str, str]) -> dict[str, str]:
    """What every channel of the map measures; those that no one asked for must turn a sensor or trigger an event."""
    found = {name: quantities[name] for name in channel_map.channels if name in quantities}
    where = channel_map.source
    for mounting in channel_map.mountings:
        siblings = [found[name] for name in mounting.channels if name in found]
        for name in mounting.channels:
            if name not in channel_map.channels:
                raise InputError(f"{where}: [[mounting]] turns {name}, which is not in [channels]; add its column")
        if len(set(siblings)) != 1:
            said = "none is a channel that is used" if not siblings else f"they measure {' and '.join(siblings)}"
            raise InputError(f"{where}: [[mounting]] of {', '.join(mounting.channels)}: {said}")
        found |= dict.fromkeys(mounting.channels, siblings[0])
    for window in channel_map.windows:
        if window.trigger is None or window.trigger.channel in found:
            continue
        name = window.trigger.channel
        if name not in channel_map.channels:
            raise InputError(f"{where}: window {window.name!r} is triggered by {name}, which is not in [channels]")
        found[name] = quantity_of(window.trigger.unit)
        if not found[name]:
            raise InputError(f"{where}: window {window.name!r}: unit {window.trigger.unit!r} of its level is not known")
    refuse_unknown("channel", channel_map.channels, quantities if len(found) < len(channel_map.channels) else found,
                   where=f"{where}: [channels]")  # fmt: skip
    return found


def _unit(signals: Signals, entry: MappedColumn, quantity: str, where: str, name: str) -> Unit:
    """Unit of the numbers of one channel; two units that contradict each other are refused."""
    column = signals[entry.column]
    here = f"{where}: {name} (column {column.name})"
    written = column.unit.strip()
    silent = says_nothing(written)
    if entry.instead_of and entry.instead_of != written:
        raise InputError(f"{here}: instead_of = {entry.instead_of!r}, but the file says {written or 'no unit'!r}")
    if not entry.unit:
        if silent:
            raise InputError(
                f"{here}: the file says no unit; add unit = ... in the channel map, such as unit = {SI[quantity]!r}"
            )
        return find_unit(written, quantity, where=here)
    unit = find_unit(entry.unit, quantity, where=f"{here}, unit in the channel map")
    if not silent and not entry.scaled and not entry.instead_of:
        same = quantity_of(written) == quantity and find_unit(written, quantity, where=here) == unit
        if not same:
            raise InputError(
                f"{here}: the file says {written!r}, the channel map {entry.unit!r}; take the unit out of the map, "
                f"give a scale, or, if the file is wrong, write instead_of = {written!r} beside the unit"
            )
    return unit


def _in_si(signals: Signals, entry: MappedColumn, unit: Unit, *, in_place: bool) -> Array:
    values = signals[entry.column].values
    if not in_place or not values.flags.writeable:
        values = values.copy()
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is told of next
        if entry.scaled:
            values *= 1.0 if entry.scale is None else entry.scale
            values += entry.offset or 0.0
        values *= unit.factor
        values += unit.offset
        values *= entry.sign
        values += 0.0  # no negative zero
    return values


def _check_values(values: Array, where: str) -> None:
    if not values.size:
        raise InputError(f"{where} holds no samples; was the file cut off?")
    if np.isinf(values).any():
        raise InputError(f"{where} is infinite in sample {int(np.isinf(values).argmax()) + 1}")
    if np.isnan(values).all():
        raise InputError(f"{where} has no valid sample; leave the channel out or repair the file")
    largest = max(np.nanmax(values), -np.nanmin(values))
    if largest > _ABSURD:
        raise InputError(f"{where} reaches {largest:.3g} in SI units, which nothing measures; is the file damaged?")
