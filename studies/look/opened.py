"""Open a recording: all its channels that hold numbers, their time, and which column is which channel."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bicycle.identification.recording import QUANTITIES as OF_MOTION
from studies.reporting.markdown_text import one_line, render_file
from tyre.fits.recording_files import QUANTITIES as OF_RIG
from tyre.fits.sidecar import Sidecar, file_and_sidecar
from tyre.formats import contents
from tyre.formats.channel_map import ChannelMap, Reading
from tyre.formats.signals import Column, Contents, Signals, join_names
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import GRAVITY, SI, find_unit, quantity_of
from tyre.recordings.clock import GAP, check_clock, damaged_times, sample_times, usual_rate
from tyre.recordings.draft import UNKNOWN, Guess, guesses, unit_of
from tyre.recordings.signal_quality import Quality, quality

CLOCK_UNITS = (  # with the factor to s and the least usual step; days are those of a spreadsheet
    ("s", 1.0, 1.2e-5), ("ms", 1e-3, 1e-3), ("us", 1e-6, 2e3), ("ns", 1e-9, 1e6), ("d", 86_400.0, 1e-9),
)  # fmt: skip
SAME_RATE = 0.02  # relative difference of two rates that mean the same
LONGEST_STEP = 1.0  # s; a column of times with longer steps is rather in ms, or counts samples


@dataclass(frozen=True, eq=False)
class Opened:
    """A file with all that can be read of it."""

    path: Path  # of the file
    signals: Signals  # of the channels that hold numbers
    unread: dict[str, str]  # column -> why it cannot be read
    columns: tuple[Column, ...]  # all that the file lists
    quality: dict[str, Quality]  # whole name of a column -> what its samples are like
    clock: Guess | None  # the column that is taken as the time
    time: Array | None  # (n,) s, of the channels that follow ``clock``; None where nothing says the time
    clock_notes: tuple[str, ...]  # what is odd about the times, or why there are none
    reading: Reading  # how the file was read

    def time_of(self, name: str) -> Array:
        """Times of the channel ``name``, s; numbers of samples from 0 where the file has none."""
        signal = self.signals.signals[name]
        for time in (signal.time, self.time):
            if time is not None and time.size == signal.values.size:
                return time
        return np.arange(signal.values.size, dtype=float)


def open_recording(path: Path, channel_map: ChannelMap | None = None, dbc: Sequence[Path] = ()) -> Opened:
    """Open a recording."""
    reading = channel_map.reading if channel_map else Reading()
    if dbc:
        reading = replace(reading, dbc=tuple(dbc))
    source = contents(path, reading=reading)
    columns, (signals, unread) = source.columns, _load(path, source)
    columns_read = signals.columns
    clock, time, notes = _time(signals, channel_map)
    qualities = {column.name: quality(signals.signals[column.name].values) for column in columns_read}
    return Opened(path, signals, unread, columns, qualities, clock, time, notes, reading)


def _load(path: Path, source: Contents) -> tuple[Signals, dict[str, str]]:
    """All columns at once; one by one where one of them cannot be read."""

    def load(names: Sequence[str]) -> Signals:
        signals = {signal.name: signal for signal in source.load(names, None)}
        return Signals(str(path), signals, tuple(source.notes), source.rates)

    names = [column.name for column in source.columns]
    unread = dict[str, str]()
    try:
        return load(names), {}
    except InputError:
        if len(names) > 1000:  # one by one they would take minutes
            raise
    for name in names:
        try:
            load([name])
        except InputError as error:
            unread[name] = str(error).removeprefix(f"{path}, ").removeprefix(f"{path}: ")
    return load([name for name in names if name not in unread] or names), unread


def _time(signals: Signals, channel_map: ChannelMap | None) -> tuple[Guess | None, Array | None, tuple[str, ...]]:
    """The column of times, the times in s, and what is odd about them."""
    times_of_channels = {id(s.time): s.time for s in signals.signals.values() if s.time is not None}
    clock, guess = channel_map.clock if channel_map else None, None
    if times_of_channels and clock is None:
        return (
            None,
            None,
            tuple(dict.fromkeys(note for time in times_of_channels.values() for note in _clock_oddities(time))),
        )
    if clock is None:
        guess = guess_clock(signals)
        if guess is None:
            return None, None, ("no column could be the time",)
        if guess.unit == UNKNOWN:
            return guess, None, (f"{guess.column.name}: its unit cannot be guessed, so no rate is known",)
        clock = guess.clock
    name = clock.column or clock.index
    try:
        stamps = signals[name] if name else None
        unit = clock.unit or (stamps.unit if clock.column and stamps else "s")
        factor = 1.0 if unit == "datetime" else find_unit(unit, "time", where=f"{signals.source}: time").factor
        count = stamps.values.size if stamps else max(s.values.size for s in signals.signals.values())
        time = sample_times(clock, None if stamps is None else stamps.values, count, factor, where=signals.source)
    except InputError as error:
        return None, None, (str(error).removeprefix(f"{signals.source}: "),)
    guess = guess or (Guess(Column(stamps.name, stamps.unit), clock.unit) if stamps else None)
    doubts = (f"{guess.column.name or 'no column'}: {guess.doubt}",) if guess and guess.doubt else ()
    return guess, time, (*doubts, *_clock_oddities(time), *_against_header(signals, time))


def _against_header(signals: Signals, time: Array) -> list[str]:
    """Say that the times (s) have another rate than every one that the header states."""
    rate = usual_rate(time)
    if not signals.rates or not np.isfinite(rate) or any(_alike(rate, header_rate) for header_rate in signals.rates):
        return []
    header_rates = " and ".join(f"{header_rate:.6g}" for header_rate in signals.rates)
    return [f"the header states {header_rates} Hz, the times make it {rate:.6g} Hz: which of them is right?"]


def _alike(rate: float, other_rate: float) -> bool:
    """True if two rates (Hz) mean the same."""
    return abs(rate / other_rate - 1) < SAME_RATE


def guess_clock(signals: Signals) -> Guess | None:
    """Guess the column of the time: one whose unit is known, else one that is plausible in s, ms, µs or ns."""
    candidates: list[Guess] = []
    columns = list(signals.columns)
    while guess := guesses(columns, {"time": "time"}).get("time"):
        candidates.append(guess)
        columns.remove(guess.column)
    values = {name: signal.values for name, signal in signals.signals.items()}
    rising = [name for name, x in values.items() if x.size > 1 and (x[1:] > x[:-1]).all()]
    if not candidates:
        time_quantities = ("time", "datetime")
        timed = [c for c in signals.columns if c.name in rising and (quantity_of(c.unit) or c.unit) in time_quantities]
        if timed:
            return Guess(timed[0], "", "a rising column in a unit of time, its name is not specific")
        return _at_equal_steps(signals)
    ranked = []
    for place, guess in enumerate(candidates):
        x = values[guess.column.name]
        steps = np.diff(x[np.isfinite(x)])
        usual = float(np.median(steps)) if steps.size else 0.0
        rank = 0
        if guess.unit == UNKNOWN and usual > 0:
            rank, unit = next(
                (
                    (rank, unit)
                    for rank, (unit, factor, least) in enumerate(CLOCK_UNITS, 1)
                    if least <= usual and usual * factor < LONGEST_STEP and not (unit == "ms" and usual == 1.0)
                ),
                (9, UNKNOWN),
            )
            guess = _by_header(replace(guess, unit=unit), x, signals)
        name = guess.column.name
        uneven = bool(steps.size) and bool(np.ptp(np.quantile(steps, [0.05, 0.95])) > 0.1 * abs(usual))
        arrival = not _MEASURED.search(name)
        ranked.append((name not in rising, rank, arrival, uneven, place, guess))
    return min(ranked, key=lambda entry: entry[:-1])[-1]


_MEASURED = re.compile(r"header.*stamp", re.IGNORECASE)
"""Name of a time that ROS takes where a sample is measured; its others are times of arrival."""


def _by_header(guess: Guess, values: Array, signals: Signals) -> Guess:
    """Weigh the unit guessed of a column of times against the rates that the header states: these beat a guess."""
    counts = 1 / usual_rate(values)  # a sample; not rounded stamps' median
    hertz = next((1 / (counts * factor) for name, factor, _ in CLOCK_UNITS if name == guess.unit), np.nan)
    agrees = any(_alike(hertz, rate) for rate in signals.rates)
    if signals.rates and not agrees:
        if len(signals.rates) > 1:
            return replace(guess, unit=UNKNOWN)
        if not (values == np.round(values)).all():
            return _at_equal_steps(signals) or guess
        (rate,) = signals.rates
        doubt = f"the header states {rate:.6g} Hz, so a sample lasts {counts:.6g} counts"
        return Guess(guess.column, "", doubt, rate=rate * counts)
    if guess.unit == UNKNOWN:
        return guess
    word = "days of a spreadsheet" if guess.unit == "d" else guess.unit
    doubt = f"the file states no unit of time; taken as {word}: {hertz:.6g} Hz"
    doubt += ", as the header states" if agrees else ""
    doubt += "; the time of measurement, not of arrival" if _MEASURED.search(guess.column.name) else ""
    return replace(guess, doubt=doubt)


def _at_equal_steps(signals: Signals) -> Guess | None:
    """Guess samples at equal steps of the only rate that the header states."""
    if len(signals.rates) != 1:
        return None
    (rate,) = signals.rates
    return Guess(Column(""), "", f"equal steps at the {rate:.6g} Hz that the header states", rate=rate)


def _is_uneven(time: Array) -> bool:
    """True if steps differ or single samples are missing, without a gap that resampling leaves open."""
    sound = time[~damaged_times(time)]
    longest = float(np.diff(sound).max(initial=0.0)) * usual_rate(sound) if np.isfinite(sound).all() else 0.0
    return 1.05 < longest <= GAP


def _clock_oddities(time: Array) -> list[str]:
    damaged = damaged_times(time)
    count = int(np.count_nonzero(damaged))
    damage = [f"samples whose time is missing or out of order, treated as missing: {count}"] if count else []
    try:
        return [*damage, *check_clock(time[~damaged], where="time")]
    except InputError as error:
        return [str(error).removeprefix("time: ")]


ROLLING = ("slip_angle", "lateral_force", "vertical_load")
PULL = ("lateral_force", "plate_displacement")
MOTION = ("roll_rate", "lean", "steer", "steer_rate", "yaw_rate", "lateral_acceleration")
TORQUES = ("steer_torque", "lean_torque")
QUANTITIES = {**OF_RIG, **OF_MOTION}


ORIGINS = {
    "map": "by {source}",
    "sidecar's map": "by the sidecar {sidecar}",
    "sidecar": "of a rig by the names of the columns, with the sidecar {sidecar}",
    "guess": "guessed from names and units",
}


@dataclass(frozen=True, eq=False)
class Roles:
    """Channels of one file."""

    opened: Opened  # the file
    command_map: ChannelMap | None  # given in the command line
    sidecar: Sidecar | None  # beside the file
    guessed: Mapping[str, Guess]  # channels guessed, where no map is given; their units may be unknown

    @property
    def origin(self) -> str:
        """Source of the channels."""
        mapped = self.sidecar is not None and self.sidecar.channel_map is not None
        case = "map" if self.command_map else "sidecar's map" if mapped else "sidecar" if self.sidecar else "guess"
        source = self.command_map.source if self.command_map else ""
        return ORIGINS[case].format(source=source, sidecar=self.opened.path.with_suffix(".toml").name)

    @property
    def map(self) -> ChannelMap | None:
        """The map that is given, by the command line or by the sidecar."""
        sidecar_map = self.sidecar.channel_map if self.sidecar else None
        return sidecar_map if sidecar_map is not None and sidecar_map.channels else self.command_map

    def names(self, channels: Sequence[str]) -> dict[str, str]:
        """Channel -> column, of the ``channels`` that there are."""
        if self.map is not None:
            return {name: entry.column for name, entry in self.map.channels.items() if name in channels}
        return {name: self.guessed[name].column.name for name in channels if name in self.guessed}

    def unknown_units(self, channels: Sequence[str]) -> dict[str, str]:
        """Channel -> column, of those ``channels`` whose unit only the user knows."""
        if self.map is not None:
            return {}
        by_channel: dict[str, Guess] = dict(self.guessed)
        if self.opened.clock is not None:
            by_channel["time"] = self.opened.clock
        return {
            name: guess.column.name
            for name in channels
            if (guess := by_channel.get(name)) is not None and guess.unit == UNKNOWN
        }

    def lines(self, channels: Sequence[str]) -> list[str]:
        """Lines of a channel map for the ``channels``, with the time; where no map is given."""
        clock = self.opened.clock
        time = [clock.line("time")] if clock is not None else []
        return [*time, *(self.guessed[name].line(name) for name in channels if name in self.guessed)]

    def map_of(self, channels: Sequence[str]) -> ChannelMap:
        """The map given, else that of the guesses for the ``channels`` whose units are known."""
        if self.map is not None:
            return self.map
        unsure = self.unknown_units([*channels, "time"])
        lines = [line for line in self.lines(channels) if line.partition(" ")[0] not in unsure]
        content = tomllib.loads("\n".join(["[channels]", *lines, *self.resampling(channels)]))
        guessed_map = ChannelMap.from_table(content, self.opened.path.parent, where=str(self.opened.path))
        return replace(guessed_map, reading=self.opened.reading)

    def resampling(self, channels: Sequence[str]) -> list[str]:
        """Lines of a map that bring the ``channels`` to one rate, where the file holds several."""
        unsure = self.unknown_units(channels)
        columns = [column for name, column in self.names(channels).items() if name not in unsure]
        times = [self.opened.time_of(column) for column in columns]
        rates = []
        for column, time in zip(columns, times, strict=True):
            samples = self.opened.quality[column]
            regular = (
                samples.missing > 0.2 * samples.samples and samples.longest_missing < GAP
            )  # at a lower rate than the rows
            rates.append(usual_rate(time) * (1 - samples.missing / samples.samples if regular else 1.0))
        sparse = any(rate < 0.99 * usual_rate(time) for rate, time in zip(rates, times, strict=True))
        one_time = all(time.size == times[0].size and np.array_equal(time, times[0]) for time in times)
        holes = any(name in MOTION for name in channels) and any(map(_is_uneven, times))
        if not times or (one_time and not sparse and not holes) or not min(rates) > 0:
            return []
        return ["", "[resampling]", f"rate_hz = {min(rates):.6g}  # CHECK: the lowest rate of these channels"]

    def is_timed(self, columns: Mapping[str, str]) -> bool:
        """True if the times of the channels ``columns`` (channel -> column) are known."""
        clock = self.map.clock if self.map else self.opened.clock
        return clock is not None or all(self.opened.signals[column].time is not None for column in columns.values())

    def lacking(self, *names: str) -> str:
        """Remedy for the channels ``names`` that no column could be."""
        units = {name: QUANTITIES.get(name, "time") for name in names}
        fitting = {quantity: self._free(quantity) for quantity in (*units.values(), "")}
        taken = [
            f"{column} is taken as {name}"
            for name, column in self.names([*QUANTITIES]).items()
            if not fitting.get(QUANTITIES[name], [""])
        ]
        content = {"units": units, "fitting": fitting, "silent": fitting.pop(""), "si": SI, "taken": taken}
        filters = {"listed": lambda columns: join_names(columns, most=4)}
        return one_line(render_file("studies.look", "lacking.txt.j2", content, escaped=False, filters=filters))

    def _free(self, quantity: str) -> list[str]:
        """Columns that are no channel yet and measure a ``quantity`` (empty: in no unit that is known)."""
        used_columns = set(self.names([*QUANTITIES]).values())
        used_columns |= {self.opened.clock.column.name} if self.opened.clock else set()
        return [
            column.name
            for column in self.opened.signals.columns
            if column.name not in used_columns
            and quantity_of(unit_of(column)) == quantity
            and not self.opened.quality[column.name].dead
        ]


def roles(opened: Opened, command_map: ChannelMap | None) -> Roles:
    """Find the channels of an opened file; ``command_map`` is that of the command line."""
    sidecar = _sidecar(opened.path)
    columns = [c for c in opened.signals.columns if opened.clock is None or c.name != opened.clock.column.name]
    live = [c for c in columns if opened.quality[c.name].samples > opened.quality[c.name].missing]
    guessed = guesses(live, OF_RIG)
    rolling = {guessed[name].column.name for name in guessed} if set(ROLLING) <= set(guessed) else set()
    guessed |= guesses([column for column in live if column.name not in rolling], OF_MOTION)
    for needed in (ROLLING, ("lateral_force", "plate_displacement")):
        if "lateral_force" in guessed or any(name in guessed for name in needed):
            guessed |= _by_unit(live, guessed, needed)
    guessed |= _by_unit(live, guessed, ("speed", "temperature", "pressure"))
    if "lateral_force" not in guessed:
        guessed |= _by_unit(live, guessed, PULL, all_or_none=True)
    return Roles(opened, command_map, sidecar, guessed)


def _sidecar(path: Path) -> Sidecar | None:
    sidecar = path.with_suffix(".toml")
    if not sidecar.is_file():
        return None
    text = sidecar.read_text(encoding="utf-8", errors="replace")
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{sidecar}: the sidecar is no TOML ({error}); correct or remove it") from error
    return file_and_sidecar(path)[1] if "axes" in content or "tyre" in content else None


def _by_unit(
    columns: Sequence[Column], guessed: Mapping[str, Guess], needed: Sequence[str], *, all_or_none: bool = False
) -> dict[str, Guess]:
    """Channels needed whose quantity a single free column measures; with ``both``, all of them or none."""
    more: dict[str, Guess] = {}
    for name in needed:
        if name in guessed:
            continue
        used_columns = {guess.column.name for guess in (*guessed.values(), *more.values())}
        fitting = [c for c in columns if c.name not in used_columns and quantity_of(unit_of(c)) == OF_RIG[name]]
        if len(fitting) == 1:
            (column,) = fitting
            doubt = f"the only column in a unit of {OF_RIG[name]}, its name is not specific"
            more[name] = Guess(column, "" if column.unit else unit_of(column), doubt)
    return {} if all_or_none and len(more) < len([name for name in needed if name not in guessed]) else more


RATES = ("roll_rate", "steer_rate", "yaw_rate")


def oddities(roles: Roles, column: str) -> tuple[str, ...]:
    """List what is odd about a ``column`` for what it measures: an offset of a rate, gravity, a wrong sign."""
    samples = roles.opened.quality[column]
    unit = roles.opened.signals.signals[column].unit
    if samples.dead:
        return ()
    remarks = []
    names = {
        name: roles.opened.signals.find(column_name)
        for name, column_name in roles.names([*RATES, "lean", "steer"]).items()
    }
    measured_channels = [name for name, whole in names.items() if whole == column]
    values = roles.opened.signals.signals[column].values
    if any(name in RATES for name in measured_channels):
        spread = 1.4826 * float(np.nanmedian(np.abs(values - samples.median)))
        if abs(samples.median) > 0.3 * spread:
            remarks.append(f"median {samples.median:.3g}, straight on it would be 0: an offset, or a long bend?")
    if quantity_of(unit) == "acceleration":
        middle = find_unit(unit, "acceleration", where=column).factor * samples.median
        if abs(abs(middle) / GRAVITY - 1) < 0.05:
            remarks.append(f"shows gravity: its axis points {'up' if middle > 0 else 'down'} or the unit is another")
    for angle, rate in (("lean", "roll_rate"), ("steer", "steer_rate")):
        if rate in measured_channels and angle in names and _agreement(roles, names[angle], column) < -0.5:
            remarks.append(f"runs against the change of {angle} ({names[angle]}): one of the two needs sign = -1")
    return tuple(remarks)


def _agreement(roles: Roles, angle: str, rate: str) -> float:
    """Correlation of a rate with the change of an angle over some samples; 0 where it cannot be computed."""
    signals = roles.opened.signals.signals
    if signals[angle].values.size != signals[rate].values.size or signals[rate].values.size < 50:
        return 0.0
    time, x, y = roles.opened.time_of(rate), signals[angle].values, signals[rate].values
    span = max(x.size // 500, 5)
    change = x[span:] - x[:-span]
    total = np.cumsum(np.nan_to_num(y[:-1]) * np.diff(time))
    meant = total[span - 1 :] - np.concatenate([[0.0], total[:-span]])
    good = np.isfinite(change) & np.isfinite(meant)
    if good.sum() < 50 or np.ptp(change[good]) == 0 or np.ptp(meant[good]) == 0:
        return 0.0
    return float(np.corrcoef(change[good], meant[good])[0, 1])
