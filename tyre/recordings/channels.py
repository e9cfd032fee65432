"""Channels in SI units on one time base, one record for every event of a recording."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tyre.formats import read_signals
from tyre.formats.channel_map import ChannelMap, Clock, MappedColumn, Mounting, Trigger, Window
from tyre.formats.signals import Signals
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.units import SI, Unit, find_unit, quantity_of, says_nothing
from tyre.recordings.clock import one_time_base
from tyre.recordings.draft import refuse_unmapped


@dataclass(frozen=True, eq=False)
class Record:
    """One event of a recording: ``time`` (n,) in s, rising, and ``values`` (n,) in SI units, NaN if missing."""

    source: str  # path, with ``#event`` if it holds several
    time: Array
    values: Mapping[str, Array]
    mountings: tuple[Mounting, ...] = ()  # that turned channels to the vehicle's axes
    notes: tuple[str, ...] = ()  # a line each, for the reader
    event: str = ""  # name of the event; empty of a whole recording
    timed: bool = True  # False: there are no times, ``time`` counts samples from 0


def read_records(
    path: Path, channel_map: ChannelMap, quantities: Mapping[str, str], *, timed: bool = True
) -> tuple[Record, ...]:
    """Read the channels of a map from a file, one record for every event."""
    if not channel_map.channels:
        refuse_unmapped(path, quantities, reading=channel_map.reading)
    signals = read_signals(path, map=channel_map)
    return records(signals, channel_map, quantities, timed=timed, own=True)


def records(
    signals: Signals, channel_map: ChannelMap, quantities: Mapping[str, str], *, timed: bool = True, own: bool = False
) -> tuple[Record, ...]:
    """Bring signals to SI units (``own`` ones in place), one time base and the vehicle's axes, and cut out events."""
    where = signals.source
    quantity_of_channel = _all_quantities(channel_map, quantities)
    values = _values_in_si(signals, channel_map, quantity_of_channel, in_place=own)
    own_times = any(signals[entry.column].time is not None for entry in channel_map.channels.values())
    untimed = not timed and channel_map.clock is None and not own_times
    if untimed:
        channel_map = replace(channel_map, clock=Clock(rate=1.0))

    time, values, notes = one_time_base(signals, channel_map, values)
    if abs(time[0]) > 1e6:  # s: a time of the calendar
        notes = (*notes, f"time is counted from its first sample, {time[0]:.10g} s")
        time = time - time[0]
    for mounting in channel_map.mountings:
        values |= _turn_to_vehicle(mounting, values)
        known_to = f" (known to {np.rad2deg(mounting.sd):g} deg, 1 sd)" if mounting.sd else ""
        notes = (*notes, f"{', '.join(mounting.channels)} turned from the axes of their sensor{known_to}")

    mapped = {name: x for name, x in values.items() if name in quantities}  # others turned a sensor or were a trigger
    notes = (*signals.notes, *notes)
    whole = Record(where, time, mapped, channel_map.mountings, notes, timed=not untimed)
    if not channel_map.windows:
        return (whole,)
    return _cut_events(whole, channel_map.windows, values, quantity_of_channel)


def _all_quantities(channel_map: ChannelMap, quantities: Mapping[str, str]) -> dict[str, str]:
    """Quantity of every channel of the map; those that no one asked for must turn a sensor or trigger an event."""
    by_channel = {name: quantities[name] for name in channel_map.channels if name in quantities}
    where = channel_map.source
    for mounting in channel_map.mountings:
        siblings = [by_channel[name] for name in mounting.channels if name in by_channel]
        for name in mounting.channels:
            if name not in channel_map.channels:
                raise InputError(f"{where}: [[mounting]] turns {name}, which is not in [channels]; add its column")
        if len(set(siblings)) != 1:
            fault = "none is a channel that is used" if not siblings else f"they measure {' and '.join(siblings)}"
            raise InputError(f"{where}: [[mounting]] of {', '.join(mounting.channels)}: {fault}")
        by_channel |= dict.fromkeys(mounting.channels, siblings[0])
    for window in channel_map.windows:
        if window.trigger is None or window.trigger.channel in by_channel:
            continue
        name = window.trigger.channel
        if name not in channel_map.channels:
            raise InputError(f"{where}: window {window.name!r} is triggered by {name}, which is not in [channels]")
        by_channel[name] = quantity_of(window.trigger.unit)
        if not by_channel[name]:
            raise InputError(f"{where}: window {window.name!r}: unit {window.trigger.unit!r} of its level is not known")
    allowed = quantities if len(by_channel) < len(channel_map.channels) else by_channel
    refuse_unknown("channel", channel_map.channels, allowed, where=f"{where}: [channels]")
    return by_channel


def _values_in_si(
    signals: Signals, channel_map: ChannelMap, quantities: Mapping[str, str], *, in_place: bool
) -> dict[str, Array]:
    """Values (n,) of every channel of the map in SI units; ``in_place`` where no other channel has the same column."""
    where = signals.source
    units = {name: _unit(signals, entry, quantities[name], where, name) for name, entry in channel_map.channels.items()}
    columns = {name: signals.find(entry.column) for name, entry in channel_map.channels.items()}
    used = list(columns.values())
    stamps = channel_map.clock and (channel_map.clock.column or channel_map.clock.index)
    if stamps:
        used.append(signals.find(stamps))
    values = {
        name: _in_si(signals, entry, units[name], in_place=in_place and used.count(columns[name]) == 1)
        for name, entry in channel_map.channels.items()
    }
    for name, x in values.items():
        _check_values(x, f"{where}: {name} (column {channel_map.channels[name].column})")
    return values


def _unit(signals: Signals, entry: MappedColumn, quantity: str, where: str, name: str) -> Unit:
    """Unit of the numbers of one channel; two units that contradict each other are refused."""
    column = signals[entry.column]
    place = f"{where}: {name} (column {column.name})"
    written = column.unit.strip()
    silent = says_nothing(written)
    if entry.instead_of and entry.instead_of != written:
        raise InputError(f"{place}: instead_of = {entry.instead_of!r}, but the file states {written or 'no unit'!r}")
    if not entry.unit:
        if silent:
            raise InputError(
                f"{place}: the file states no unit; add unit = ... in the channel map, such as unit = {SI[quantity]!r}"
            )
        return find_unit(written, quantity, where=place)
    unit = find_unit(entry.unit, quantity, where=f"{place}, unit in the channel map")
    if not silent and not entry.scaled and not entry.instead_of:
        agrees = quantity_of(written) == quantity and find_unit(written, quantity, where=place) == unit
        if not agrees:
            raise InputError(
                f"{place}: the file states {written!r}, the channel map {entry.unit!r}; take the unit out of the map, "
                f"give a scale, or, if the file is wrong, write instead_of = {written!r} next to the unit"
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
    if largest > 1e12:  # in any SI unit of a channel
        raise InputError(f"{where} reaches {largest:.3g} in SI units, beyond any sensor; is the file damaged?")


def _turn_to_vehicle(mounting: Mounting, values: Mapping[str, Array]) -> dict[str, Array]:
    """Turn the three channels (n,) of a sensor, all in one SI unit, to the axes of the vehicle."""
    sensor = [values[name] for name in mounting.channels]
    return {
        name: sum((factor * x for factor, x in zip(row, sensor, strict=True)), np.zeros_like(sensor[0]))
        for name, row in zip(mounting.channels, mounting.rotation, strict=True)
    }


def _cut_events(
    whole: Record, windows: tuple[Window, ...], values: Mapping[str, Array], quantities: Mapping[str, str]
) -> tuple[Record, ...]:
    """Cut a record into the events of its windows; ``values`` (n,) in SI units hold the channels of triggers, too."""
    where, time = whole.source, whole.time
    levels = {}
    for window in windows:
        if window.trigger is not None:
            name = window.trigger.channel
            unit = find_unit(window.trigger.unit, quantities[name], where=f"{where}, trigger of window {window.name!r}")
            levels[window.name] = values[name], unit.factor * window.trigger.level + unit.offset
    events, notes = _events(windows, time, levels, where)
    cut_out = []
    for name, span in events.items():
        samples = span.stop - span.start
        if samples < 2:
            raise InputError(f"{where}: event {name} holds {samples} samples; make its window longer")
        cut = {key: x[span] for key, x in whole.values.items()}
        source = f"{where}#{name}" if len(events) > 1 else where
        cut_out.append(
            replace(whole, source=source, time=time[span], values=cut, event=name, notes=(*whole.notes, *notes))
        )
    return tuple(cut_out)


def _events(
    windows: tuple[Window, ...], time: Array, levels: Mapping[str, tuple[Array, float]], where: str
) -> tuple[dict[str, slice], list[str]]:
    """Samples of every event by name (crossings of a trigger are numbered), and notes on events that are cut."""
    events: dict[str, slice] = {}
    notes = []
    start, length = float(time[0]), float(time[-1] - time[0])
    for window in windows:
        if window.trigger is None:
            if window.first >= length or (math.isfinite(window.last) and window.last > length * (1 + 1e-9) + 1e-9):
                raise InputError(
                    f"{where}: window {window.name!r} from {window.first:g} to {window.last:g} s is not inside the "
                    f"recording, which lasts {length:g} s"
                )
            events[window.name] = _slice_between(time, start + window.first, start + window.last)
            continue
        values, level = levels[window.name]
        spans, left_out = _crossings(window.trigger, time, values, level)
        if not spans:
            low, high = np.nanmin(values), np.nanmax(values)
            more = f"; {left_out} events are cut off by the ends of the recording" if left_out else ""
            raise InputError(
                f"{where}: {window.trigger.channel} gives no event: it ranges from {low:.6g} to {high:.6g} and the "
                f"level is {level:.6g}, in SI units{more}"
            )
        events |= {f"{window.name}.{number}": span for number, span in enumerate(spans, 1)}
        if left_out:
            notes.append(
                f"{left_out} events of window {window.name!r} are cut off by an end of the recording: rejected"
            )
    return events, notes


def _crossings(trigger: Trigger, time: Array, values: Array, level: float) -> tuple[list[slice], int]:
    is_beyond = values > level if trigger.above else values < level
    rising = np.flatnonzero(is_beyond[1:] & ~is_beyond[:-1] & np.isfinite(values[:-1])) + 1
    spans, left_out, busy = [], 0, -math.inf
    for sample in rising:
        moment = float(time[sample])
        if moment <= busy:
            continue
        busy = moment + trigger.after
        if moment - trigger.before < time[0] - 1e-9 or busy > time[-1] + 1e-9:
            left_out += 1
        else:
            spans.append(_slice_between(time, moment - trigger.before, busy))
    return spans, left_out


def _slice_between(time: Array, first: float, last: float) -> slice:
    return slice(int(np.searchsorted(time, first - 1e-9)), int(np.searchsorted(time, last + 1e-9, side="right")))
