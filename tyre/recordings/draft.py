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
from tyre.formats.signals import Column, join_names
from tyre.ground.errors import InputError
from tyre.ground.units import SI, quantity_of

_NAMES = {
    "time": r"^t$|^et$|time|zeit|stamp|elapsed|millis|micros|seconds",
    "slip_angle": r"slip|alpha|^sa$|schr(ä|ae)glauf",
    "side_force": r"\bfy|side.?force|lat.*force|seitenkraft|querkraft",
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
    "lateral_force": r"\bfy|lat.*force",
}
"""Channel -> usual names of its column."""

_TIMES = {"millis": "ms", "micros": "us", "nanos": "ns", "seconds": "s"}
"""Word in the name of a column of times -> its unit."""
_ROTATION = re.compile(r"ang|rot|roll|yaw|pitch|lean|steer|gyro|spin|winkel|dreh|gier|lenk", re.IGNORECASE)
"""Words in the name of a velocity that is no speed, unless its unit says so."""
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
    """A ``column`` that may be a channel, its ``unit`` if the file does not say it, and a ``doubt`` to be checked."""

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
        note = f"  # the file says {self.column.unit}" if not unit and self.column.unit else ""
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


def guesses(columns: Sequence[Column], quantities: Mapping[str, str]) -> dict[str, Guess]:
    """Guess the columns of the wanted channels from what each measures; each column is taken once."""
    by_channel: dict[str, Guess] = {}
    for name, quantity in quantities.items():
        used = [guess.column.name for guess in by_channel.values()]
        column = _guess(name, quantity, [column for column in columns if column.name not in used])
        if column is not None:
            has_unit = quantity_of(column.unit) == quantity or column.unit == "datetime"
            of_name = next((end for end in _unit_words(column.name) if quantity_of(end) == quantity), "")
            if quantity == "time" and not of_name:
                of_name = next((unit for word, unit in _TIMES.items() if word in column.name.casefold()), "")
            phone = [c.name for c in columns if _OF_A_PHONE in c.name.casefold()]
            turned = column.name in phone and quantity == "angular rate"
            doubt = f"the axes of a phone are its own: {join_names(phone)}" if turned else ""
            if not has_unit and quantity == "angular rate" and _OF_ROS.search(column.name):
                of_name, doubt = "rad/s", "rad/s by the definition of the message; the axes are those of the sensor"
            by_channel[name] = Guess(column, "" if has_unit else of_name or UNKNOWN, doubt)
    return by_channel


def draft_words(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> str:
    """List the columns of a file with a draft of a map, to end a message; '' if the file cannot be read at all."""
    try:
        file_contents = contents(path, reading=reading)
    except InputError:
        return ""
    columns = [f"{column.name} [{column.unit}]" if column.unit else column.name for column in file_contents.columns]
    draft = draft_map(file_contents.columns, quantities, clock=not file_contents.own_times)
    return _WORDS.format(columns=join_names(columns), draft=draft)


@contextmanager
def or_map(path: Path, quantities: Mapping[str, str]) -> Iterator[None]:
    """Add the columns of the file at ``path`` and a draft of a map to an error of its names, if it can be read."""
    try:
        yield
    except InputError as error:
        words = draft_words(path, quantities)
        more = f"; rename it or put a channel map into the sidecar: {words}" if words else ""
        raise InputError(f"{error}{more}") from error


def refuse_unmapped(path: Path, quantities: Mapping[str, str], *, reading: Reading | None = None) -> None:
    """Refuse a file without a channel map, showing its columns and a draft of a map."""
    contents(path, reading=reading)  # says why it cannot be read
    words = draft_words(path, quantities, reading=reading)
    raise InputError(f"{path}: no channel map says which column is which channel; {words}")


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


def _guess(name: str, quantity: str, columns: Sequence[Column]) -> Column | None:
    """The column of the right unit, or of none, whose name is like that of the channel; rather one with a unit."""
    pattern = re.compile(_NAMES.get(name, re.escape(name).replace("_", ".?")), re.IGNORECASE)
    fitting: list[tuple[bool, int, Column]] = []
    for column in columns:
        measured = quantity_of(column.unit)
        if measured not in ("", quantity) and not (quantity == "time" and column.unit == "datetime"):
            continue
        if name == "speed" and not measured and _ROTATION.search(column.name):
            continue
        plain = re.sub(r"[_\W]*(?:" + "|".join(map(re.escape, _unit_words(column.name))) + r")$", "", column.name)
        if any(pattern.search(part) for part in (column.name, plain, column.spellings[1], re.sub("_", " ", plain))):
            fitting.append((measured != quantity, len(fitting), column))
    return min(fitting)[2] if fitting else None


def _unit_words(name: str) -> list[str]:
    """Ends of a name that are units: ``deg_s``, ``kN``."""
    parts = re.split(r"[_\s]+", name)
    ends = ["_".join(parts[-count:]) for count in (2, 1) if len(parts) > count]
    return [end for end in ends if quantity_of(end)] or ["\0"]


def _quote(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a string of JSON is one of TOML
