"""The channel map of a laboratory: which column is which channel, in what unit and sign, and how the file is read."""

import math
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.files import read_toml
from tyre.ground.schema import (
    any_table,
    anything,
    list_of,
    maybe,
    needed,
    number,
    read,
    refusal,
    table,
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


def _sign(value: Any) -> float:
    if isinstance(value, bool) or value not in (1, -1):
        raise refusal(value, "must be 1 or -1")
    return float(value)


_DELIMITER = 'must be one character in quotes, "\\t" for tabs, or "blanks"'
_TEXT = text(blank=False)
_LINE = whole_number(least=1)
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
_TIME = table({maybe("column"): _TEXT, maybe("unit"): _TEXT, maybe("index"): _TEXT, maybe("rate_hz"): number(above=0)})
_READING = table(
    {
        maybe("delimiter"): text(_DELIMITER),
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
_NAMES = list_of(_TEXT, "must be three names of channels, along the sensor's x, y and z axis", least=3, most=3)
_ROW = list_of(number(), "must be rows of three numbers", least=3, most=3)
_MOUNTING = table(
    {
        needed("channels", "channels is missing; name the three channels of the sensor's x, y and z axis"): _NAMES,
        maybe("matrix"): list_of(_ROW, "must be three rows of three numbers", least=3, most=3),
        maybe("angles_deg"): list_of(number(), "must be three angles in degrees", least=3, most=3),
        maybe("order"): text(
            'must be three axes: "zyx" about axes that stand still, "ZYX" about axes that turn along', allowed=ORDERS
        ),
        maybe("sd_deg", 0.0): number(least=0, most=90),
    }
)
_MOUNTINGS = list_of(anything, "must be tables: write [[mounting]] with channels for each sensor", least=1)
_RESAMPLING = table({maybe("rate_hz"): number(above=0), maybe("like"): _TEXT})
_TRIGGER = table(
    {
        needed("channel", "channel is missing; name the channel that crosses a level"): _TEXT,
        maybe("above"): number(),
        maybe("below"): number(),
        needed("unit", "unit is missing; give the unit of the level"): _TEXT,
        maybe("before_s", 0.0): number(least=0),
        needed("after_s", "after_s is missing; say how long an event lasts after the crossing, in s"): number(above=0),
    }
)
_WINDOW = table(
    {
        maybe("name"): _TEXT,
        maybe("from_s"): number(least=0),
        maybe("to_s"): number(above=0),
        maybe("trigger"): any_table,
    }
)
_WINDOWS = list_of(anything, "must be tables: write [[windows]] with from_s and to_s, or with a trigger", least=1)


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

    def times(self, values: Array | None, count: int, factor: float, *, where: str) -> Array:
        """Times of ``count`` samples in s, from the values of the column (``factor`` to s) or counter, if any."""
        if values is None:
            return np.arange(count) / self.rate
        if self.index:
            if not np.isfinite(values).all() or (values != np.round(values)).any():
                raise InputError(f"{where}: {self.index} does not count samples: it must hold whole numbers")
            return (values - values[0]) / self.rate
        return factor * values


@dataclass(frozen=True)
class Reading:
    """Ways to read a file that does not say it itself; empty and 0 are found out."""

    delimiter: str = ""  # between cells, or ``blanks``
    decimal: str = ""  # decimal sign
    encoding: str = ""  # of the text, a name of Python's codecs
    names_line: int = 0  # line of the names of columns, from 1
    units_line: int = 0  # line of their units, from 1
    first_line: int = 0  # line of the first sample, from 1
    sheet: str = ""  # of a spreadsheet
    table: str = ""  # table or group to read, of a file with several
    dbc: tuple[Path, ...] = ()  # files that decode messages of a CAN bus

    @classmethod
    def from_table(cls, content: Any, folder: Path, *, where: str) -> "Reading":
        """Read the table ``[reading]``, whose files lie in ``folder``."""
        settings: Mapping[str, Any] = read(_READING, content, where=where, section="reading")
        if len(delimiter := settings.get("delimiter", "")) > 1 and delimiter != "blanks":
            raise InputError(f"{where}: [reading]: delimiter = {delimiter!r} {_DELIMITER}")
        return cls(**(dict(settings) | {"dbc": tuple(folder / name for name in settings.get("dbc", ()))}))


@dataclass(frozen=True, eq=False)
class Mounting:
    """Rotation of three channels from the axes of a sensor to those of the vehicle: v = R v_sensor; its sd in rad."""

    # names of the channels along the sensor's x, y and z axis; the vehicle's once turned
    channels: tuple[str, str, str]
    rotation: Array  # (3, 3), R
    sd: float = 0.0  # rad, standard deviation of the angles; 0 if none is stated

    def turned(self, values: Mapping[str, Array]) -> dict[str, Array]:
        """Turn the three channels of ``values``, each of shape (n,) in one SI unit."""
        sensor = [values[name] for name in self.channels]
        return {
            name: sum((factor * x for factor, x in zip(row, sensor, strict=True)), np.zeros_like(sensor[0]))
            for name, row in zip(self.channels, self.rotation, strict=True)
        }


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
            parts["mountings"] = _mountings(content["mounting"], where)
        if "resampling" in content:
            settings = read(_RESAMPLING, content["resampling"], where=where, section="resampling")
            if len(settings) != 1:
                raise InputError(f"{where}: [resampling]: give either rate_hz or like")
            parts["resampling"] = Resampling(settings.get("rate_hz", 0.0), settings.get("like", ""))
        if "windows" in content:
            parts["windows"] = _windows(content["windows"], where)
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


def _channels(content: Any, where: str) -> tuple[dict[str, MappedColumn], Clock | None]:
    columns: dict[str, MappedColumn] = {}
    clock = None
    for name, entry in read(any_table, content, where=where, section="channels").items():
        keys = {"column": entry} if isinstance(entry, str) else entry
        place = f"{where}: [channels]"
        if name == "time":
            clock = _clock(read(_TIME, keys, where=place, section=name), f"{place}: time")
            continue
        channel = columns[name] = MappedColumn(**read(_CHANNEL, keys, where=place, section=name))
        if channel.scale == 0:
            raise InputError(f"{place}: {name}: scale = 0 makes every sample the same")
        if channel.scaled and not channel.unit:
            raise InputError(f"{place}: {name}: scale and offset need the unit of their result; add unit = ...")
        if channel.instead_of and not channel.unit:
            raise InputError(f"{place}: {name}: instead_of needs the right unit; add unit = ...")
    return columns, clock


def _clock(keys: Mapping[str, Any], where: str) -> Clock:
    column, unit, index, rate = (keys.get(key) for key in ("column", "unit", "index", "rate_hz"))
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


def _from_text(option: str) -> tuple[str, MappedColumn | Clock]:
    name, equals, column_text = (part.strip() for part in option.partition("="))
    try:
        words = shlex.split(column_text, posix=True)
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


def _mountings(content: Any, where: str) -> tuple[Mounting, ...]:
    mountings = []
    for place, entry in enumerate(read(_MOUNTINGS, content, where=where, section="mounting"), 1):
        entry_label = f"{where}: [[mounting]] number {place}"
        keys = read(_MOUNTING, entry, where=entry_label)
        names = tuple(keys["channels"])
        if len(set(names)) < 3:
            raise InputError(f"{entry_label}: channels = {list(names)} names a channel twice; give x, y and z")
        mountings.append(Mounting(names, _rotation(keys, entry_label), float(np.deg2rad(keys["sd_deg"]))))
    return tuple(mountings)


def _rotation(keys: Mapping[str, Any], where: str) -> Array:
    if ("matrix" in keys) == ("angles_deg" in keys):
        raise InputError(f"{where}: give the rotation either as matrix or as angles_deg with their order")
    if "angles_deg" in keys:
        if "order" not in keys:
            raise InputError(f'{where}: angles_deg needs its order, such as order = "ZYX"; see the documentation')
        from scipy.spatial.transform import Rotation

        return np.asarray(Rotation.from_euler(keys["order"], keys["angles_deg"], degrees=True).as_matrix(), float)
    if "order" in keys:
        raise InputError(f"{where}: order belongs to angles_deg; take it out beside a matrix")
    matrix = np.array(keys["matrix"], float)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3:
        raise InputError(
            f"{where}: the rows of matrix are not three perpendicular unit vectors (within 0.001); it is no rotation"
        )
    if np.linalg.det(matrix) < 0:
        raise InputError(
            f"{where}: matrix mirrors (its determinant is -1): give a left-handed sensor's axis sign = -1 in [channels]"
        )
    u, _, v = np.linalg.svd(matrix)
    return np.asarray(u @ v, float)  # the nearest rotation: printed matrices are rounded


def _windows(content: Any, where: str) -> tuple[Window, ...]:
    windows: list[Window] = []
    for place, entry in enumerate(read(_WINDOWS, content, where=where, section="windows"), 1):
        entry_label = f"{where}: [[windows]] number {place}"
        keys = read(_WINDOW, entry, where=entry_label)
        if ("from_s" in keys or "to_s" in keys) == ("trigger" in keys):
            raise InputError(f"{entry_label}: give either from_s and to_s, or a trigger")
        name = keys.get("name", str(place))
        if name in [window.name for window in windows]:
            raise InputError(f"{entry_label}: the name {name!r} is given twice")
        first, last = keys.get("from_s", 0.0), keys.get("to_s", math.inf)
        if last <= first:
            raise InputError(f"{entry_label}: to_s = {last:g} must be later than from_s = {first:g}")
        windows.append(Window(name, first, last, _trigger(keys["trigger"], entry_label) if "trigger" in keys else None))
    return tuple(windows)


def _trigger(content: Mapping[str, Any], where: str) -> Trigger:
    keys = read(_TRIGGER, content, where=where, section="trigger")
    if ("above" in keys) == ("below" in keys):
        raise InputError(f"{where}: a trigger needs one level, above or below")
    is_rising, level = "above" in keys, keys.get("above", keys.get("below"))
    return Trigger(keys["channel"], level, is_rising, keys["unit"], keys["before_s"], keys["after_s"])
