"""Which column of a file is which channel, in what unit and with what sign: the channel map of a laboratory."""

import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tyre.base.checks import any_table, number, refused, text
from tyre.base.errors import InputError, refuse_unknown
from tyre.base.schema import maybe, needed, read, table
from tyre.base.toml_file import read_toml
from tyre.channels.clock import Clock
from tyre.channels.mounting import Mounting, read_mountings
from tyre.channels.reading import Reading
from tyre.channels.resampling import Resampling, read_resampling
from tyre.channels.windows import Window, read_windows

TABLES = ("channels", "reading", "mounting", "resampling", "windows")
"""Tables of a file that make a channel map."""

_TEXT = text(blank=False)


def _sign(value: Any) -> float:
    if isinstance(value, bool) or value not in (1, -1):
        raise refused(value, "must be 1 or -1")
    return float(value)


CHANNEL = table(
    {
        needed("column", 'column is missing; write column = "NAME" as the file has it'): _TEXT,
        maybe("unit"): _TEXT,
        maybe("sign", 1.0): _sign,
        maybe("scale"): number(),
        maybe("offset"): number(),
        maybe("instead_of"): _TEXT,
    }
)
TIME = table({maybe("column"): _TEXT, maybe("unit"): _TEXT, maybe("index"): _TEXT, maybe("rate_hz"): number(above=0)})


@dataclass(frozen=True)
class MappedColumn:
    """A channel of a map: sign * (scale * number in the file + offset), in a unit.

    Attributes
    ----------
    column : str
        Name in the file.
    unit : str
        Of the result; that which the file writes where empty.
    sign : float
        +1 or -1.
    scale, offset : float, optional
        From counts or volts to ``unit``; None where the file holds numbers in a unit.
    instead_of : str
        The unit that the file writes, where it is wrong.
    """

    column: str
    unit: str = ""
    sign: float = 1.0
    scale: float | None = None
    offset: float | None = None
    instead_of: str = ""

    @property
    def scaled(self) -> bool:
        """Whether a scale or an offset is given."""
        return self.scale is not None or self.offset is not None


@dataclass(frozen=True)
class ChannelMap:
    """Which column is which channel.

    Attributes
    ----------
    channels : mapping of str to MappedColumn
        By the name of the channel; ``time`` is not among them.
    clock : Clock, optional
        The time of samples; None where the file gives each channel its own.
    mountings : tuple of Mounting
    resampling : Resampling, optional
        None refuses channels of several rates.
    windows : tuple of Window
        Events; the whole recording where empty.
    reading : Reading
    source : str
        Where the map comes from, for messages.
    """

    channels: Mapping[str, MappedColumn] = field(default_factory=dict)
    clock: Clock | None = None
    mountings: tuple[Mounting, ...] = ()
    resampling: Resampling | None = None
    windows: tuple[Window, ...] = ()
    reading: Reading = field(default_factory=Reading)
    source: str = "channel map"

    @classmethod
    def from_table(cls, content: Mapping[str, Any], folder: Path, *, where: str) -> "ChannelMap":
        """The map in the tables ``[channels]``, ``[reading]``, ``[[mounting]]``, ``[resampling]``, ``[[windows]]``.

        Parameters
        ----------
        content : mapping
            These tables; ``channels`` may also be a file that holds them, beside which others replace its own.
        folder : Path
            Where the files that they name are.
        where : str
            What a message begins with.

        Raises
        ------
        InputError
            An unknown key, or a value that is not allowed.
        """
        refuse_unknown("table", content, TABLES, where=where)
        channels = content.get("channels", {})
        if isinstance(channels, str):
            base = cls.from_file(folder / channels)
        else:
            base = cls(*_channels(channels, where), source=where)
        parts: dict[str, Any] = {}
        if "reading" in content:
            parts["reading"] = Reading.from_table(content["reading"], folder, where=where)
        if "mounting" in content:
            parts["mountings"] = read_mountings(content["mounting"], where=where)
        if "resampling" in content:
            parts["resampling"] = read_resampling(content["resampling"], where=where)
        if "windows" in content:
            parts["windows"] = read_windows(content["windows"], where=where)
        return replace(base, **parts)

    @classmethod
    def from_file(cls, path: Path) -> "ChannelMap":
        """The map of the TOML file at ``path``, which holds nothing else.

        Raises
        ------
        InputError
            No such file, no TOML, an unknown key, or a value that is not allowed.
        """
        content = read_toml(path, "channel map")
        if not isinstance(content.get("channels", {}), Mapping):
            raise InputError(f"{path}: channels = {content['channels']!r} must be a table: write [channels]")
        return cls.from_table(content, path.parent, where=str(path))

    def only(self, names: Collection[str]) -> "ChannelMap":
        """This map with the channels of ``names`` alone, and those that turn their sensors or trigger events."""
        mountings = tuple(mounting for mounting in self.mountings if set(mounting.channels) & set(names))
        triggers = [window.trigger.channel for window in self.windows if window.trigger]
        kept = {*names, *triggers, *(name for mounting in mountings for name in mounting.channels)}
        channels = {name: entry for name, entry in self.channels.items() if name in kept}
        return replace(self, channels=channels, mountings=mountings)

    def with_channels(self, texts: Sequence[str]) -> "ChannelMap":
        """This map with channels of the command line put in, or in place of its own.

        Parameters
        ----------
        texts : sequence of str
            Each ``NAME=COLUMN [UNIT] [SIGN]``, such as ``roll_rate=IMU.gyro_x deg/s -1``; ``time=COLUMN [UNIT]`` or
            ``time=RATE Hz``. A name with blanks stands in quotes.

        Raises
        ------
        InputError
            Text of another form, or a channel given twice.
        """
        channels, clock, seen = dict(self.channels), self.clock, set()
        for given in texts:
            name, entry = _from_text(given)
            if name in seen:
                raise InputError(f"channel {given!r}: {name} is given twice")
            seen.add(name)
            if isinstance(entry, Clock):
                clock = entry
            else:
                channels[name] = entry
        return replace(self, channels=channels, clock=clock)


def _channels(content: Any, where: str) -> tuple[dict[str, MappedColumn], Clock | None]:
    found: dict[str, MappedColumn] = {}
    clock = None
    for name, entry in read(any_table, content, where=where, section="channels").items():
        here, section = f"{where}: [channels]", name
        given = {"column": entry} if isinstance(entry, str) else entry
        if name == "time":
            clock = _clock(read(TIME, given, where=here, section=section), f"{here}: time")
            continue
        checked = read(CHANNEL, given, where=here, section=section)
        found[name] = MappedColumn(**checked)
        _check(found[name], f"{here}: {name}")
    return found, clock


def _clock(given: Mapping[str, Any], where: str) -> Clock:
    column, unit, index, rate = (given.get(key) for key in ("column", "unit", "index", "rate_hz"))
    if column and (index or rate):
        raise InputError(f"{where}: give either a column, or a rate_hz (with or without an index)")
    if not column and not rate:
        raise InputError(
            f"{where}: give column = NAME with its unit, rate_hz = RATE of equally spaced samples, or index = NAME of "
            "a column that counts samples, with its rate_hz"
        )
    if unit and not column:
        raise InputError(f"{where}: unit belongs to a column of times; take it out")
    return Clock(column or "", unit or "", index or "", rate or 0.0)


def _check(entry: MappedColumn, where: str) -> None:
    if entry.scale == 0:
        raise InputError(f"{where}: scale = 0 makes every sample the same")
    if entry.scaled and not entry.unit:
        raise InputError(f"{where}: scale and offset need the unit of their result; add unit = ...")
    if entry.instead_of and not entry.unit:
        raise InputError(f"{where}: instead_of needs the right unit; add unit = ...")


def _from_text(given: str) -> tuple[str, MappedColumn | Clock]:
    how = "write NAME=COLUMN [UNIT] [SIGN], such as roll_rate='Gyro X' deg/s -1"
    name, equals, rest = given.partition("=")
    name = name.strip()
    try:
        words = shlex.split(rest, posix=True)
    except ValueError:
        words = []
    if not name or not equals or not 1 <= len(words) <= 3:
        raise InputError(f"channel {given!r}: {how}")
    if name == "time":
        return name, _clock_from_words(given, words)
    sign = {"-1": -1.0, "1": 1.0, "+1": 1.0}.get(words[-1]) if len(words) > 1 else None
    if len(words) == 3 and sign is None:
        raise InputError(f"channel {given!r}: the sign {words[-1]!r} must be 1 or -1; {how}")
    unit = words[1] if len(words) == 3 or (len(words) == 2 and sign is None) else ""
    return name, MappedColumn(words[0], unit, sign if sign is not None else 1.0)


def _clock_from_words(given: str, words: Sequence[str]) -> Clock:
    if len(words) == 2 and words[1].casefold() == "hz":
        try:
            rate = float(words[0])
        except ValueError:
            rate = 0.0
        if not 0 < rate < float("inf"):
            raise InputError(f"channel {given!r}: {words[0]!r} is no rate; write time=200 Hz")
        return Clock(rate=rate)
    if len(words) > 2:
        raise InputError(f"channel {given!r}: write time=COLUMN [UNIT] or time=RATE Hz")
    return Clock(words[0], words[1] if len(words) == 2 else "")
