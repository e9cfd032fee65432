"""A first channel map, guessed from the names and units of columns, ready to be corrected and pasted."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shlex import quote

from tyre.formats import contents
from tyre.formats.channel_map import Clock, Reading
from tyre.formats.signals import Column, Contents, join_names
from tyre.ground.errors import InputError
from tyre.ground.units import SI, quantity_of

_NAMES = {
    "time": r"^t$|^et$|time|zeit|stamp|elapsed|millis|micros|seconds",
    "slip_angle": r"slip|alpha|^sa$|schr(ä|ae)glauf",
    "lateral_force": r"\bfy|side.?force|lat.*force|seitenkraft|querkraft",
    "vertical_load": r"\bfz|load|vert.*force|normal.?force|radlast",
    "aligning_moment": r"\bmz|align|r(ü|ue)ckstell",
    "inclination": r"incl|camber|gamma|sturz|^ia$",
    "speed": r"speed|veloc|^v$|geschw|trajvel",  # of no rotation, see _ROTATION
    "temperature": r"temp",
    "pressure": r"press|druck|^p$|inflpres",
    "plate_displacement": r"plate|table|platte",
    "rim_displacement": r"rim|felge",
    "roll_rate": r"(roll|lean).?(rate|vel|dot)|phi.?dot|(gyro(scope)?|omega|rate|gyr|w|ang\w*.?vel(ocity)?).?x$|^p$",
    "lean": r"lean(?!.?(rate|torque))|roll(?!.?(rate|vel|acc|torque|dot))|phi$",
    "steer_rate": r"steer.*(rate|vel|speed|dot)|delta.?dot",
    "steer_torque": r"steer.*(torque|moment|trq|tq)|t.?delta$",
    "steer": r"steer(?!.*(rate|vel|torque|moment|speed|dot|trq|tq))|delta$|handlebar|lenk",
    "yaw_rate": r"yaw.?(rate|vel)|(gyro(scope)?|omega|rate|gyr|w|ang\w*.?vel(ocity)?).?z$|psi.?dot|gier|^r$",
    "lateral_acceleration": r"lat.*acc|acc?(el)?.?y$|^ay$",
    "lean_torque": r"(lean|roll).*(torque|moment)",
    "lateral_push": r"push|\bfy|lat.*force",
}
"""Channel -> usual names of its column."""

_TIMES = {"millis": "ms", "micros": "us", "nanos": "ns", "seconds": "s"}
"""Word in the name of a column of times -> its unit."""
_ROTATION = re.compile(r"ang|rot|roll|yaw|pitch|lean|steer|gyro|spin|winkel|dreh|gier|lenk", re.IGNORECASE)
"""Words in the name of a velocity that is no speed, unless its unit is that of one."""
_OF_A_PHONE = "gyroscope"
_OF_ROS = re.compile(r"angular_velocity[./][xyz]$")
"""Name of a column of ROS's message sensor_msgs/Imu, whose definition says rad/s about the axes of the sensor."""

UNKNOWN = "?"
"""Unit of a guess that only the user knows."""

_LACKING = '# {name} = {{column = "?", unit = "{unit}"}}'
_WORDS = """the columns are {columns}. A first draft of a map, guessed from names and units; check it, signs above \
all:

{draft}
#"""  # what others append is a comment


@dataclass(frozen=True)
class Guess:
    """A ``column`` that may be a channel, its ``unit`` if the file does not state it, and a ``doubt`` to be checked."""

    column: Column  # of an empty name: samples at equal steps
    unit: str = ""
    doubt: str = ""
    rate: float = 0.0  # 1/s, with which the column counts; 0 of any other column

    @property
    def clock(self) -> Clock:
        """The time of samples, if the guess is one of the time."""
        if self.rate:
            return Clock(index=self.column.name, rate=self.rate)
        return Clock(self.column.name, self.unit)

    def line(self, name: str) -> str:
        """Write the line of the channel ``name`` of a channel map, in TOML."""
        if self.rate:
            index = f"index = {_quote(self.column.name)}, " if self.column.name else ""
            return f"{name} = {{{index}rate_hz = {self.rate:.10g}}}  # CHECK: {self.doubt}"
        unit = f", unit = {_quote(self.unit)}" if self.unit else ""
        note = f"  # the file states {self.column.unit}" if not unit and self.column.unit else ""
        if self.unit == UNKNOWN:
            note = "  # FILL IN the unit"
        elif self.doubt:
            note = f"  # CHECK: {self.doubt}"
        return f"{name} = {{column = {_quote(self.column.name)}{unit}}}{note}"


def draft_map(columns: Sequence[Column], quantities: Mapping[str, str], *, clock: bool = True) -> str:
    """Write a table ``[channels]`` guessed from names and units, with a line for ``time`` if a ``clock`` is needed."""
    channels = {"time": "time", **quantities} if clock else dict(quantities)
    by_channel = guesses(columns, channels)
    lines = [by_channel[name].line(name) for name in channels if name in by_channel]
    lacking = [_LACKING.format(name=name, unit=SI[kind]) for name, kind in channels.items() if name not in by_channel]
    return "\n".join(["[channels]", *lines, *lacking])


@dataclass(frozen=True)
class _ColumnWords:
    """What the unit and the name of a ``column`` say of what it measures."""

    column: Column
    quantity: str  # that its unit measures; empty if no known one
    # ends of its name that are units (``deg_s``, ``kN``), the longest first -> what each measures
    ends: Mapping[str, str]

    @classmethod
    def of(cls, column: Column) -> "_ColumnWords":
        """Look up the unit of a ``column`` and the last words of its name."""
        parts = re.split(r"[_\s]+", column.name)
        words = ["_".join(parts[-count:]) for count in (2, 1) if len(parts) > count]
        quantity, *of_words = [quantity_of(text) for text in (column.unit, *words)]
        ends = {word: measured for word, measured in zip(words, of_words, strict=True) if measured}
        return cls(column, quantity, ends)

    @property
    def spellings(self) -> tuple[str, ...]:
        """Its name: whole, without unit, without its groups, and without ``_``."""
        plain = re.sub(r"[_\W]*(?:" + "|".join(map(re.escape, self.ends or ["\0"])) + r")$", "", self.column.name)
        return (self.column.name, plain, self.column.spellings[1], plain.replace("_", " "))


def unit_of(column: Column) -> str:
    """Unit that the file states for a ``column``, else the end of its name that is a unit (``F_kgf``); or empty."""
    return column.unit or next(iter(_ColumnWords.of(column).ends), "")


def guesses(columns: Sequence[Column], quantities: Mapping[str, str]) -> dict[str, Guess]:
    """Guess the columns of the wanted channels from what each measures; each column is taken once."""
    named = [_ColumnWords.of(column) for column in columns]
    phone = [column.name for column in columns if _OF_A_PHONE in column.name.casefold()]
    by_channel: dict[str, Guess] = {}
    for name, quantity in quantities.items():
        used = [guess.column.name for guess in by_channel.values()]
        likely = _find_likely(name, quantity, [candidate for candidate in named if candidate.column.name not in used])
        if likely is not None:
            by_channel[name] = _guess(likely, quantity, phone)
    return by_channel


def _guess(likely: _ColumnWords, quantity: str, phone: Sequence[str]) -> Guess:
    """Guess the unit of a likely column, with a doubt; ``phone`` names the columns of a phone's gyroscope."""
    column = likely.column
    has_unit = likely.quantity == quantity or column.unit == "datetime"
    of_name = next((end for end, measured in likely.ends.items() if measured == quantity), "")
    if quantity == "time" and not of_name:
        of_name = next((unit for word, unit in _TIMES.items() if word in column.name.casefold()), "")
    doubt = ""
    if column.name in phone and quantity == "angular rate":
        doubt = f"the axes of a phone are its own: {join_names(phone)}"
    if not has_unit and quantity == "angular rate" and _OF_ROS.search(column.name):
        of_name, doubt = "rad/s", "rad/s by the definition of the message; the axes are those of the sensor"
    return Guess(column, "" if has_unit else of_name or UNKNOWN, doubt)


def draft_words(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> str:
    """List the columns of a file with a draft of a map, to end a message; '' if the file cannot be read at all."""
    try:
        return _words_of(contents(path, reading=reading), quantities)
    except InputError:
        return ""


def _words_of(file_contents: Contents, quantities: Mapping[str, str]) -> str:
    """List the columns of a file with a draft of a map."""
    columns = [f"{column.name} [{column.unit}]" if column.unit else column.name for column in file_contents.columns]
    draft = draft_map(file_contents.columns, quantities, clock=not file_contents.own_times)
    return _WORDS.format(columns=join_names(columns), draft=draft)


class UnmappedError(InputError):
    """Columns whose names are not recognised: a channel map assigns columns to channels."""


@contextmanager
def or_map(path: Path, quantities: Mapping[str, str]) -> Iterator[None]:
    """Add the columns of the file at ``path`` and a draft of a map to an :class:`UnmappedError`, if it can be read."""
    try:
        yield
    except UnmappedError as error:
        words = draft_words(path, quantities)
        more = f"; rename it or put a channel map into the sidecar: {words}" if words else ""
        raise InputError(f"{error}{more}") from error


def refuse_unmapped(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> None:
    """Refuse a file without a channel map, showing its columns and a draft of a map."""
    words = _words_of(contents(path, reading=reading), quantities)
    raise InputError(f"{path}: no channel map assigns columns to channels; {words}")


@contextmanager
def looking(path: Path) -> Iterator[None]:
    """Add the next step, a look at the recording at ``path``, to an error of reading it."""
    try:
        yield
    except InputError as error:
        if not path.is_file():
            raise
        how_to_look = f"`velotyre look {quote(str(path))}` shows what is in it and what it can be used for"
        raise InputError(f"{error}; {how_to_look}") from error


def _find_likely(name: str, quantity: str, columns: Sequence[_ColumnWords]) -> _ColumnWords | None:
    """Find the column of the right unit, or of none, whose name is like that of the channel; rather one with a unit."""
    pattern = re.compile(_NAMES.get(name, re.escape(name).replace("_", ".?")), re.IGNORECASE)
    without_unit = None
    for candidate in columns:
        column = candidate.column
        if candidate.quantity not in ("", quantity) and not (quantity == "time" and column.unit == "datetime"):
            continue
        if name == "speed" and not candidate.quantity and _ROTATION.search(column.name):
            continue
        if any(pattern.search(spelling) for spelling in candidate.spellings):
            if candidate.quantity == quantity:
                return candidate
            without_unit = without_unit or candidate
    return without_unit


def _quote(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a string of JSON is one of TOML
