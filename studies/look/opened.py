"""A recording opened for a look: all its channels that hold numbers, their time and their quality."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap, MappedColumn
from tyre.channels.clock import check_clock
from tyre.channels.draft import UNKNOWN, Guess, guesses
from tyre.channels.quality import Quality, quality
from tyre.channels.read import contents, read_signals
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Signal, Signals
from tyre.channels.units import find_unit, quantity_of

LONGEST_STEP = 1.0  # s; a column of times with longer steps is rather in ms, or counts samples


@dataclass(frozen=True, eq=False)
class Opened:
    """A file with all that can be read of it.

    Attributes
    ----------
    path : Path
    signals : Signals
        Of the channels that hold numbers.
    unread : dict of str to str
        Column -> why it cannot be read.
    columns : tuple of Column
        All that the file lists.
    quality : dict of str to Quality
    clock : Guess, optional
        The column that is taken as the time; None where each channel has its own, or no column could be it.
    time : ndarray, shape (n,), optional
        s, of the channels that follow ``clock``; None where nothing says the time.
    clock_notes : tuple of str
        What is odd about the times, or why there are none.
    reading : Reading
    """

    path: Path
    signals: Signals
    unread: dict[str, str]
    columns: tuple[Column, ...]
    quality: dict[str, Quality]
    clock: Guess | None
    time: Array | None
    clock_notes: tuple[str, ...]
    reading: Reading

    def time_of(self, name: str) -> Array:
        """Times of the channel ``name``, s; numbers of samples from 0 where nothing says them."""
        signal = self.signals.signals[name]
        for time in (signal.time, self.time):
            if time is not None and time.size == signal.values.size:
                return time
        return np.arange(signal.values.size, dtype=float)


def open_recording(path: Path, channel_map: ChannelMap | None = None, dbc: Sequence[Path] = ()) -> Opened:
    """Open a recording.

    Parameters
    ----------
    path : Path
    channel_map : ChannelMap, optional
        Says how to read the file, and its clock.
    dbc : sequence of Path
        Databases that decode CAN frames.

    Raises
    ------
    InputError
        A file that cannot be read, or of which no channel holds numbers.
    """
    reading = channel_map.reading if channel_map else Reading()
    if dbc:
        reading = replace(reading, dbc=tuple(dbc))
    columns = contents(path, reading=reading).columns
    signals, unread = _load(path, columns, reading)
    there = signals.columns
    clock, time, notes = _time(signals, channel_map)
    found = {column.name: quality(signals.signals[column.name].values) for column in there}
    return Opened(path, signals, unread, columns, found, clock, time, notes, reading)


def _load(path: Path, columns: Sequence[Column], reading: Reading) -> tuple[Signals, dict[str, str]]:
    """All columns at once; one by one where one of them cannot be read."""

    def load(names: Sequence[str]) -> Signals:
        return read_signals(path, map=ChannelMap({name: MappedColumn(name) for name in names}, reading=reading))

    try:
        return load([column.name for column in columns]), {}
    except InputError as error:
        first = error
    found: dict[str, Signal] = {}
    unread: dict[str, str] = {}
    notes: tuple[str, ...] = ()
    for column in columns:
        try:
            signals = load([column.name])
        except InputError as error:
            unread[column.name] = str(error).removeprefix(f"{path}, ").removeprefix(f"{path}: ")
            continue
        found |= signals.signals
        notes = signals.notes
    if not found:
        raise first
    return Signals(str(path), found, notes), unread


def _time(signals: Signals, channel_map: ChannelMap | None) -> tuple[Guess | None, Array | None, tuple[str, ...]]:
    """The column of times, the times in s, and what is odd about them."""
    own = {id(s.time): s.time for s in signals.signals.values() if s.time is not None}
    if own and not (channel_map and channel_map.clock):
        notes = [note for time in own.values() for note in _odd(time)]
        return None, None, tuple(dict.fromkeys(notes))
    if channel_map and channel_map.clock:
        return _mapped_time(signals, channel_map)
    guess = guess_clock(signals)
    if guess is None:
        return None, None, ("no column could be the time",)
    if guess.unit == UNKNOWN:
        return guess, None, (f"{guess.column.name}: its unit cannot be guessed, so no rate is known",)
    unit = guess.unit or guess.column.unit
    factor = 1.0 if unit == "datetime" else find_unit(unit, "time", where=signals.source).factor
    time = factor * signals.signals[guess.column.name].values
    said = (f"{guess.column.name}: {guess.doubt}",) if guess.doubt else ()
    return guess, time, (*said, *_odd(time))


def _mapped_time(signals: Signals, channel_map: ChannelMap) -> tuple[Guess | None, Array | None, tuple[str, ...]]:
    clock = channel_map.clock
    assert clock is not None
    name = clock.column or clock.index
    try:
        stamps = signals[name] if name else None
        unit = clock.unit or (stamps.unit if clock.column and stamps else "s")
        factor = 1.0 if unit == "datetime" else find_unit(unit, "time", where=f"{signals.source}: time").factor
        count = stamps.values.size if stamps else max(s.values.size for s in signals.signals.values())
        time = clock.times(None if stamps is None else stamps.values, count, factor, where=signals.source)
    except InputError as error:
        return None, None, (_said(error, signals.source),)
    guess = Guess(Column(stamps.name, stamps.unit), clock.unit) if stamps else None
    return guess, time, tuple(_odd(time))


def guess_clock(signals: Signals) -> Guess | None:
    """The column that may be the time; its unit is taken as s or ms where the file says none and that is plausible.

    ``signals`` are those of the file.
    """
    found = guesses(signals.columns, {"time": "time"}).get("time")
    if found is None:
        timed = [c for c in signals.columns if quantity_of(c.unit) == "time" and _rises(signals.signals[c.name].values)]
        found = Guess(timed[0], "", "a rising column in a unit of time, its name says little") if timed else None
    if found is None or found.unit != UNKNOWN:
        return found
    values = signals.signals[found.column.name].values
    steps = np.diff(values[np.isfinite(values)])
    usual = float(np.median(steps)) if steps.size else 0.0
    if not usual > 0:
        return found
    for unit, factor in (("s", 1.0), ("ms", 1e-3)):
        if usual * factor < LONGEST_STEP and not (unit == "ms" and usual == 1.0):
            return replace(
                found, unit=unit, doubt=f"the file says no unit of time; taken as {unit}: {1 / (usual * factor):.6g} Hz"
            )
    return found


def _rises(values: Array) -> bool:
    return bool(values.size > 1 and (np.diff(values) > 0).all())


def _odd(time: Array) -> list[str]:
    try:
        return list(check_clock(time, where="time"))
    except InputError as error:
        return [_said(error, "time")]


def _said(error: InputError, where: str) -> str:
    return str(error).removeprefix(f"{where}: ")


def rate(time: Array) -> float:
    """Samples a second by the usual step of ``time`` (s, shape (n,)); NaN where there is none.

    That is the mean of the steps within a fifth of the median, if any: loggers round the times that they write.
    """
    steps = np.diff(time)
    usual = float(np.nanmedian(steps)) if steps.size and np.isfinite(steps).any() else 0.0
    if not usual > 0:
        return float("nan")
    near = steps[np.abs(steps - usual) <= 0.2 * usual]
    return float(1 / (near.mean() if near.size else usual))
