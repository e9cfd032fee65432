"""The channel map of a laboratory: which column is which channel, in what unit and sign, and how the file is read."""

import math
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml
from tyre.ground.schema import (
    Table,
    any_table,
    anything,
    list_of,
    maybe,
    needed,
    number,
    read,
    refusal,
    remarked,
    table,
    table_refusal,
    text,
    whole_number,
)
from tyre.ground.text_table import number_in

TABLES = ("channels", "reading", "mounting", "resampling", "windows")
"""Tables of a file that make a channel map."""

ORDERS = tuple(
    "".join(order)
    for axes in ("xyz", "XYZ")
    for order in {(a, b, c) for a in axes for b in axes for c in axes if a != b != c}
)
"""Sequences of three axes, small letters about axes that stand still, capitals about axes that turn along."""


@dataclass(frozen=True)
class MappedColumn:
    """A channel of a map: sign * (scale * number in the file + offset), in a unit (empty: as the file writes it)."""

    column: str  # name in the file
    unit: str = ""  # of scale * number + offset; empty: as the file writes it
    sign: float = 1.0  # +1 or -1
    scale: float | None = None  # factor on the number in the file; None: 1
    offset: float | None = None  # in ``unit``, added after the scale; None: 0
    instead_of: str = ""  # wrong unit in the file that ``unit`` replaces

    @property
    def scaled(self) -> bool:
        """True if a scale or an offset is given."""
        return self.scale is not None or self.offset is not None


@dataclass(frozen=True)
class Clock:
    """The time of samples: a ``column`` in ``unit``, a counter ``index`` with a ``rate``, or a ``rate`` in Hz."""

    column: str = ""
    unit: str = ""
    index: str = ""
    rate: float = 0.0


@dataclass(frozen=True)
class Reading:
    """Ways to read a file that does not state them; empty and 0 are detected."""

    delimiter: str = ""  # between cells, or ``blanks``
    decimal: str = ""  # decimal sign
    encoding: str = ""  # of the text, a name of Python's codecs
    names_line: int = 0  # line of the names of columns, from 1
    units_line: int = 0  # line of their units, from 1
    first_line: int = 0  # line of the first sample, from 1
    sheet: str = ""  # of a spreadsheet
    table: str = ""  # table or group to read, of a file with several
    dbc: tuple[Path, ...] = ()  # files that decode messages of a CAN bus


@dataclass(frozen=True, eq=False)
class Mounting:
    """Rotation of three channels from the axes of a sensor to those of the vehicle: v = R v_sensor; its sd in rad."""

    # names of the channels along the sensor's x, y and z axis; the vehicle's once turned
    channels: tuple[str, str, str]
    rotation: Array  # (3, 3), R
    sd: float = 0.0  # rad, standard deviation of the angles; 0 if none is stated


@dataclass(frozen=True)
class Resampling:
    """Linear interpolation at equal steps of a ``rate`` in Hz, or at the times of the channel ``like``."""

    rate: float = 0.0
    like: str = ""


@dataclass(frozen=True)
class Trigger:
    """A level, ``above`` it or below it, in ``unit``, that ``channel`` crosses; ``before`` and ``after`` it in s."""

    channel: str  # name
    level: float  # in ``unit``
    above: bool  # True: an event begins where the channel rises above the level
    unit: str  # of the level
    before: float  # s, of the event before the crossing
    after: float  # s, of the event after the crossing


@dataclass(frozen=True)
class Window:
    """A stretch: from ``first`` to ``last`` s after the first sample, or one about every crossing of a ``trigger``."""

    name: str = ""  # of the event, or of its events before their numbers
    first: float = 0.0
    last: float = math.inf
    trigger: Trigger | None = None


@dataclass(frozen=True)
class ChannelMap:
    """Which column is which channel (``time`` is the ``clock``); without ``resampling`` several rates are refused."""

    channels: Mapping[str, MappedColumn] = field(default_factory=dict)  # name of a channel -> its column
    clock: Clock | None = None
    mountings: tuple[Mounting, ...] = ()  # sensors whose axes are not the vehicle's
    resampling: Resampling | None = None
    windows: tuple[Window, ...] = ()  # events that are cut out; none: the whole recording
    reading: Reading = field(default_factory=Reading)  # how the file is to be read
    source: str = "channel map"  # what messages call the map

    @classmethod
    def from_table(cls, content: Mapping[str, Any], folder: Path, *, where: str) -> "ChannelMap":
        """Read the :data:`TABLES`; ``channels`` may be a file in ``folder`` that holds them, replaced by those here."""
        parts = read(_TABLES, content, where=where)
        channels = parts.pop("channels", {})
        if isinstance(channels, str):
            base = cls.from_file(folder / channels)
        else:
            columns = read(_CHANNELS, channels, where=f"{where}: [channels]")
            base = cls(clock=columns.pop("time", None), channels=columns, source=where)
        if "reading" in parts:
            reading = parts["reading"]
            parts["reading"] = replace(reading, dbc=tuple(folder / path for path in reading.dbc))
        if "mounting" in parts:
            parts["mountings"] = parts.pop("mounting")
        return replace(base, **parts)

    @classmethod
    def from_file(cls, path: Path) -> "ChannelMap":
        """Read the map of the TOML file at ``path``, which holds nothing else."""
        content = read_toml(path, "channel map")
        if not isinstance(content.get("channels", {}), Mapping):
            raise InputError(f"{path}: channels = {content['channels']!r} must be a table: write [channels]")
        return cls.from_table(content, path.parent, where=str(path))

    def only(self, names: Collection[str]) -> "ChannelMap":
        """Keep the channels of ``names`` alone, and those that turn their sensors or trigger events."""
        mountings = tuple(mounting for mounting in self.mountings if set(mounting.channels) & set(names))
        triggers = [window.trigger.channel for window in self.windows if window.trigger]
        kept_names = {*names, *triggers, *(name for mounting in mountings for name in mounting.channels)}
        channels = {name: entry for name, entry in self.channels.items() if name in kept_names}
        return replace(self, channels=channels, mountings=mountings)

    def with_channels(self, texts: Sequence[str]) -> "ChannelMap":
        """Put in channels of the command line, each ``NAME=COLUMN [UNIT] [SIGN]``, or ``time=RATE Hz``."""
        entries: dict[str, Any] = {}
        for option in texts:
            name, entry = _from_text(option)
            if name in entries:
                raise InputError(f"channel {option!r}: {name} is given twice")
            entries[name] = entry
        clock = entries.pop("time", self.clock)
        return replace(self, channels={**self.channels, **entries}, clock=clock)


_HEADING = re.compile(r"""([^'"]*[^'"\s])\s+([\[(][^\[\]()'"]+[\])])(?:\s+([+-]?1))?""")
"""A column as the heading has it, its unit in brackets, and a sign."""


def _from_text(option: str) -> tuple[str, MappedColumn | Clock]:
    name, equals, column_text = (part.strip() for part in option.partition("="))
    heading = _HEADING.fullmatch(column_text)
    try:
        words = [word for word in heading.groups() if word] if heading else shlex.split(column_text, posix=True)
    except ValueError:
        words = []
    if name == "time" and len(words) == 2 and words[1].casefold() == "hz":
        rate = number_in(words[0])
        if not 0 < rate < math.inf:
            raise InputError(f"channel {option!r}: {words[0]!r} is no rate; write time=200 Hz")
        return name, Clock(rate=rate)
    how = "write NAME=COLUMN [UNIT] [SIGN], such as roll_rate='Gyro X' deg/s -1"
    if not name or not equals or not 1 <= len(words) <= 3:
        raise InputError(f"channel {option!r}: {how}")
    column, *unit_and_sign = words
    if name == "time":
        if len(unit_and_sign) > 1:
            raise InputError(f"channel {option!r}: write time=COLUMN [UNIT] or time=RATE Hz")
        return name, Clock(column, unit="".join(unit_and_sign))
    sign = {"-1": -1.0, "1": 1.0, "+1": 1.0}.get(unit_and_sign[-1]) if unit_and_sign else None
    if len(unit_and_sign) == 2 and sign is None:
        raise InputError(f"channel {option!r}: the sign {words[-1]!r} must be 1 or -1; {how}")
    return name, MappedColumn(column, "".join(unit_and_sign[: 1 if sign is None else -1]), sign=sign or 1.0)


# ---------------------------------------------------------------------- what a channel map in TOML may hold


def _file_or_table(value: Any) -> Any:
    """Check that ``value`` is the path of another map, or a table of channels."""
    return value if isinstance(value, str) else any_table(value)


def _sign(value: Any) -> float:
    """Check a sign, 1 or -1."""
    if isinstance(value, bool) or value not in (1, -1):
        raise refusal(value, "must be 1 or -1")
    return float(value)


_TEXT = text(blank=False)
_CHANNEL = table(
    {
        needed("column", 'column is missing; write column = "NAME" as the file has it'): _TEXT,
        maybe("unit"): _TEXT,
        maybe("sign", 1.0): _sign,
        maybe("scale"): number(),
        maybe("offset"): number(),
        maybe("instead_of"): _TEXT,
    }
)


def _channel(value: Any) -> MappedColumn:
    """Check the column of a channel: its name alone, or a table."""
    column = MappedColumn(**_CHANNEL({"column": value} if isinstance(value, str) else value))
    if column.scale == 0:
        raise remarked(": scale = 0 makes every sample the same")
    if column.scaled and not column.unit:
        raise remarked(": scale and offset need the unit of their result; add unit = ...")
    if column.instead_of and not column.unit:
        raise remarked(": instead_of needs the right unit; add unit = ...")
    return column


_TIME = table({maybe("column"): _TEXT, maybe("unit"): _TEXT, maybe("index"): _TEXT, maybe("rate_hz"): number(above=0)})


def _clock(value: Any) -> Clock:
    """Check the clock: a name of a column alone, or a table."""
    keys = _TIME({"column": value} if isinstance(value, str) else value)
    column, unit, index, rate = (keys.get(key) for key in ("column", "unit", "index", "rate_hz"))
    if column and (index or rate):
        raise remarked(": give either a column, or a rate_hz (with or without an index)")
    if not column and not rate:
        raise remarked(
            ": give column = NAME with its unit, rate_hz = RATE of equally spaced samples, or index = NAME of "
            "a column that counts samples, with its rate_hz"
        )
    if unit and not column:
        raise remarked(": unit belongs to a column of times; remove it")
    return Clock(column or "", unit or "", index or "", rate or 0.0)


_CHANNELS = Table({maybe("time"): _clock}, (anything, _channel))


def _delimiter(value: Any) -> str:
    """Check the delimiter of cells."""
    says = 'must be one character in quotes, "\\t" for tabs, or "blanks"'
    delimiter: str = text(says)(value)
    if len(delimiter) > 1 and delimiter != "blanks":
        raise refusal(value, says)
    return delimiter


_LINE = whole_number(least=1)
_READING = table(
    {
        maybe("delimiter"): _delimiter,
        maybe("decimal"): text('must be "." or ","', allowed=(".", ",")),
        maybe("encoding"): _TEXT,
        maybe("names_line"): _LINE,
        maybe("units_line"): _LINE,
        maybe("first_line"): _LINE,
        maybe("sheet"): _TEXT,
        maybe("table"): _TEXT,
        maybe("dbc"): list_of(_TEXT, 'must be a list of files: ["powertrain.dbc"]', least=1),
    }
)


def _reading(value: Any) -> Reading:
    """Check how a file is read; the paths of its databases are as written."""
    keys = _READING(value)
    return Reading(**keys | {"dbc": tuple(Path(name) for name in keys.get("dbc", ()))})


_ROW = list_of(number(), "must be rows of three numbers", least=3, most=3)
_MOUNTING = table(
    {
        needed("channels", "channels is missing; name the three channels of the sensor's x, y and z axis"): list_of(
            _TEXT, "must be three names of channels, along the sensor's x, y and z axis", least=3, most=3
        ),
        maybe("matrix"): list_of(_ROW, "must be three rows of three numbers", least=3, most=3),
        maybe("angles_deg"): list_of(number(), "must be three angles in degrees", least=3, most=3),
        maybe("order"): text(
            'must be three axes: "zyx" about axes that stand still, "ZYX" about axes that turn along', allowed=ORDERS
        ),
        maybe("sd_deg", 0.0): number(least=0, most=90),
    }
)


def _mounting(value: Any) -> Mounting:
    """Check how a sensor is mounted; its rotation is given in one of two ways."""
    keys = _MOUNTING(value)
    names = tuple(keys["channels"])
    if len(set(names)) < 3:
        raise table_refusal(f"channels = {list(names)} names a channel twice; give x, y and z")
    if ("matrix" in keys) == ("angles_deg" in keys):
        raise table_refusal("give the rotation either as matrix or as angles_deg with their order")
    if "angles_deg" in keys and "order" not in keys:
        raise table_refusal('angles_deg needs its order, such as order = "ZYX"; see the documentation')
    if "matrix" in keys and "order" in keys:
        raise table_refusal("order belongs to angles_deg; delete it or the matrix")
    rotation = _nearest_rotation(keys["matrix"]) if "matrix" in keys else _euler(keys["order"], keys["angles_deg"])
    return Mounting(names, rotation, float(np.deg2rad(keys["sd_deg"])))


def _euler(order: str, angles: Sequence[float]) -> Array:
    """Rotation matrix (3, 3) of three ``angles`` in degrees about the axes of ``order``."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_euler(order, angles, degrees=True).as_matrix(), float)


def _nearest_rotation(rows: Sequence[Sequence[float]]) -> Array:
    """Rotation matrix (3, 3) nearest to a printed one, whose numbers are rounded; what is no rotation is refused."""
    matrix = np.array(rows, float)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3:
        raise table_refusal(
            "the rows of matrix are not three perpendicular unit vectors (within 0.001); it is no rotation"
        )
    if np.linalg.det(matrix) < 0:
        raise table_refusal(
            "matrix mirrors (its determinant is -1): give a left-handed sensor's axis sign = -1 in [channels]"
        )
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v, float)


_RESAMPLING = table({maybe("rate_hz"): number(above=0), maybe("like"): _TEXT})


def _resampling(value: Any) -> Resampling:
    """Check to what steps a recording is resampled."""
    keys = _RESAMPLING(value)
    if len(keys) != 1:
        raise table_refusal("give either rate_hz or like")
    return Resampling(keys.get("rate_hz", 0.0), keys.get("like", ""))


_TRIGGER = table(
    {
        needed("channel", "channel is missing; name the channel that crosses a level"): _TEXT,
        maybe("above"): number(),
        maybe("below"): number(),
        needed("unit", "unit is missing; give the unit of the level"): _TEXT,
        maybe("before_s", 0.0): number(least=0),
        needed("after_s", "after_s is missing; state how long an event lasts after the crossing, in s"): number(
            above=0
        ),
    }
)
_WINDOW = table(
    {maybe("name"): _TEXT, maybe("from_s"): number(least=0), maybe("to_s"): number(above=0), maybe("trigger"): _TRIGGER}
)


def _window(value: Any) -> Window:
    """Check a window, from one time to another or about the crossings of a level; its name may be empty."""
    keys = _WINDOW(value)
    if ("from_s" in keys or "to_s" in keys) == ("trigger" in keys):
        raise table_refusal("give either from_s and to_s, or a trigger")
    first, last = keys.get("from_s", 0.0), keys.get("to_s", math.inf)
    if last <= first:
        raise table_refusal(f"to_s = {last:g} must be later than from_s = {first:g}")
    if "trigger" not in keys:
        return Window(keys.get("name", ""), first, last)
    level = keys["trigger"]
    if ("above" in level) == ("below" in level):
        raise table_refusal("a trigger needs one level, above or below")
    trigger = Trigger(
        level["channel"],
        level=level.get("above", level.get("below")),
        above="above" in level,
        unit=level["unit"],
        before=level["before_s"],
        after=level["after_s"],
    )
    return Window(keys.get("name", ""), trigger=trigger)


_WINDOWS = list_of(
    _window, "must be tables: write [[windows]] with from_s and to_s, or with a trigger", least=1, strict=False
)


def _windows(value: Any) -> tuple[Window, ...]:
    """Check the windows, each called by its own name or by its number."""
    windows: list[Window] = []
    for place, window in enumerate(_WINDOWS(value)):
        name = window.name or str(place + 1)
        if name in [earlier.name for earlier in windows]:
            raise table_refusal(f"the name {name!r} is given twice", place)
        windows.append(replace(window, name=name))
    return tuple(windows)


_MOUNTINGS = list_of(
    _mounting, "must be tables: write [[mounting]] with channels for each sensor", least=1, strict=False
)
_TABLES = table(
    {
        maybe("channels"): _file_or_table,
        maybe("reading"): _reading,
        maybe("mounting"): lambda value: tuple(_MOUNTINGS(value)),
        maybe("resampling"): _resampling,
        maybe("windows"): _windows,
    },
    kind="table",
)
