"""TYDEX 1.3 as a document: header, constants, channels and data, read from and written to the columns of the manual.

Layout after Unrau & Zamow, TYDEX-Format, Description and Reference Manual, release 1.3 (1997), section 2.2: keywords
begin with ``**``; a line of a table has the name in columns 1-10, the description in 11-40, the unit in 41-50; then a
constant has its value from column 51, a channel its conversion factor (51-60), the offset of the measured value
(61-70) and the offset of the physical value (71-80); data have fields of ten columns. Lines that begin with ``!``
are comments.
"""

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.signals import Column, Contents, Signal
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, nearest_name, plain_digits
from tyre.ground.files import read_text

NOT_AVAILABLE = "NOTAVAIL"
_SINGLE = ("HEADER", "CONSTANTS", "MEASURCHANNELS", "MEASURDATA", "END")
_KEYWORDS = (*_SINGLE, "COMMENTS", "MODELDEFINITION", "MODELPARAMETERS", "MODELCOEFFICIENTS", "MODELCHANNELS",
             "MODELOUTPUTS", "MODELEND")  # fmt: skip
_KEYWORD_LINE = re.compile(r"^\*\*[^\r\n]*(?:\r\n|\r|\n|\Z)", re.MULTILINE)
_DECIMAL_COMMA = re.compile(r"(?<=\d),(?=\d)")
_FIELD = 10  # columns
_TOO_WIDE = "{source}: channel {name} reaches {largest:g}, too wide for its field"


@dataclass(frozen=True)
class Entry:
    """One line of ``**HEADER`` or ``**CONSTANTS``; ``value`` is None if the file says NOTAVAIL or nothing."""

    name: str  # as in column 1, such as FZW
    description: str  # in words
    unit: str  # as the file writes it
    value: str | None  # as the file writes it


@dataclass(frozen=True)
class ChannelEntry:
    """One line of ``**MEASURCHANNELS``: (measured + ``measured_offset``) * ``factor`` + ``physical_offset``."""

    name: str  # as in column 1, such as SLIPANGL
    description: str  # in words
    unit: str  # of the result
    factor: float = 1.0
    measured_offset: float = 0.0
    physical_offset: float = 0.0


E = TypeVar("E", Entry, ChannelEntry)


@dataclass(frozen=True)
class TydexDocument:
    """Text under every keyword of a TYDEX file, the words behind ``**MEASURDATA``, and its name in messages."""

    bodies: Mapping[str, str]  # keyword without its ** -> lines below it
    announced: str  # number of rows as the file writes it behind ``**MEASURDATA``; empty if none
    source: str  # path, for messages

    @cached_property
    def header(self) -> dict[str, Entry]:
        """Entries of ``**HEADER`` by name."""
        return self._read_entries("HEADER", _entry)

    @cached_property
    def constants(self) -> dict[str, Entry]:
        """Entries of ``**CONSTANTS`` by name."""
        return self._read_entries("CONSTANTS", _entry)

    @cached_property
    def channels(self) -> dict[str, ChannelEntry]:
        """Channels by name, in the order of the data columns."""
        return self._read_entries("MEASURCHANNELS", _channel)

    def _read_entries(self, keyword: str, read: Callable[[str, str], E]) -> dict[str, E]:
        where, entries = f"{self.source}, **{keyword}", dict[str, E]()
        for line in _plain_line_ends(self.bodies.get(keyword, "")).split("\n"):
            if not line.strip() or line.lstrip()[0] == "!":
                continue
            entry = read(line.expandtabs(_FIELD), where)
            if entry.name in entries:
                label = f"channel {entry.name}" if isinstance(entry, ChannelEntry) else entry.name
                raise InputError(f"{where}: {label} is listed twice; keep one")
            entries[entry.name] = entry
        return entries

    @cached_property
    def measured(self) -> Array:
        """Numbers of ``**MEASURDATA`` as printed, shape (rows, channels); NOTAVAIL is NaN."""
        rows = self.announced
        announced = int(rows) if rows.isascii() and rows.isdigit() and len(rows) < 12 else None
        return _numbers(self.bodies.get("MEASURDATA", ""), len(self.channels), announced, self.source)

    def physical(self, name: str) -> Array:
        """Values of the channel ``name`` in its own unit, factor and offsets applied, shape (rows,)."""
        channel = self.channels[name]
        printed = self.measured[:, list(self.channels).index(name)]
        if (channel.factor, channel.measured_offset, channel.physical_offset) == (1.0, 0.0, 0.0):
            return printed.copy()
        return (printed + channel.measured_offset) * channel.factor + channel.physical_offset


def tydex_contents(path: Path, reading: Reading) -> Contents:
    """List the channels under ``**MEASURCHANNELS``, in the units and axes of the file."""
    document = read_document(path)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        return [Signal(name, document.physical(name)[:most], document.channels[name].unit) for name in names]

    columns = tuple(Column(channel.name, channel.unit) for channel in document.channels.values())
    return Contents(columns, load)


def read_document(path: str | Path) -> TydexDocument:
    """Read the TYDEX file ``path`` (UTF-8 or Latin-1) without interpreting it."""
    return _split_sections(read_text(Path(path), fallback="latin-1"), str(path))


def _split_sections(text: str, source: str) -> TydexDocument:
    """Split a text into its sections; refuse an unknown keyword, one that is there twice, a file without its ends."""
    marks = list(_KEYWORD_LINE.finditer(text))
    bodies: dict[str, str] = {}
    names, announced = [], ""
    for mark, following in zip(marks, [*(later.start() for later in marks[1:]), len(text)], strict=False):
        words = mark.group()[2:].split()
        name = words[0].upper() if words else ""
        if name not in _KEYWORDS:
            suggestion = nearest_name(name, _KEYWORDS)
            hint = f"; did you mean **{suggestion}?" if suggestion else ""
            raise InputError(f"{source}: keyword **{name[:40]} is unknown to TYDEX 1.3{hint}")
        names.append(name)
        bodies[name] = bodies.get(name, "") + text[mark.end() : following]
        if name == "MEASURDATA":
            announced = words[1] if len(words) > 1 else ""
    for name in _SINGLE:
        if names.count(name) > 1:
            raise InputError(f"{source}: keyword **{name} stands {names.count(name)} times; a file holds one test")
    if "HEADER" not in names:
        raise InputError(f"{source}: keyword **HEADER is missing; is this a TYDEX file?")
    if "END" not in names:
        raise InputError(f"{source}: keyword **END is missing; the file seems to be cut off")
    if "," in (data := bodies.get("MEASURDATA", "")) and "." not in data:  # decimal commas, in the whole file
        bodies |= {name: _DECIMAL_COMMA.sub(".", bodies.get(name, "")) for name in _SINGLE[1:4]}
    return TydexDocument(bodies, announced, source)


def document_text(
    *,
    header: Sequence[Entry],
    comments: str,
    constants: Sequence[Entry],
    channels: Sequence[ChannelEntry],
    measured: Array,
    source: str,
) -> str:
    """Write a document with data ``measured`` (rows, channels) of as many decimals as fit; NaN becomes NOTAVAIL."""
    rows = {
        "HEADER": "".join(_line(entry, entry.value) for entry in header),
        "COMMENTS": comments + "\n",
        "CONSTANTS": "".join(_line(entry, entry.value) for entry in constants),
        "MEASURCHANNELS": "".join(
            _line(c, f"{c.factor:<10.6g}{c.measured_offset:<10.6g}{c.physical_offset:<10.6g}") for c in channels
        ),
        "MEASURDATA": _print_numbers(measured, [channel.name for channel in channels], source),
    }
    return "".join(f"**{name}\n{body}\n" for name, body in rows.items()) + "**END\n"


def _line(entry: Entry | ChannelEntry, value: str | None) -> str:
    text = " ".join((NOT_AVAILABLE if value is None else value).split("\n"))
    return f"{entry.name:<10}{entry.description[:29]:<30}{entry.unit[:9]:<10}{text}".rstrip() + "\n"


def _print_numbers(measured: Array, names: Sequence[str], source: str) -> str:
    rounded = np.empty_like(measured)
    template = ""
    for index, name in enumerate(names):
        largest = float(np.nanmax(np.abs(measured[:, index]), initial=0.0))
        digits = len(str(int(largest + 0.5))) if np.isfinite(largest) else _FIELD
        if digits > _FIELD - 3:
            raise InputError(_TOO_WIDE.format(source=source, name=name, largest=largest))
        decimals = _FIELD - 3 - digits
        rounded[:, index] = np.round(measured[:, index], decimals) + 0.0  # no negative zero
        template += f"%{_FIELD}.{decimals}f"
    text = "".join([(template + "\n") % tuple(row) for row in rounded.tolist()])
    return text.replace("       nan", f"  {NOT_AVAILABLE}")


def _plain_line_ends(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _columns(line: str, where: str) -> tuple[str, str, str, str]:
    """Name, description, unit and the rest; by columns, or by wide gaps where a writer missed the columns."""
    name = line.split(maxsplit=1)[0]
    if len(name) > _FIELD:
        raise InputError(
            f"{where}: name {name[:40]!r} is longer than its field of {_FIELD} columns; shorten it, or put a blank "
            "between a name that fills the field and its description"
        )
    torn = any(len(line) > cut and line[cut - 1 : cut + 1].strip() == line[cut - 1 : cut + 1] for cut in (40, 50))
    if line[0] != " " and not torn:
        return name, line[len(name) : 40].strip(), line[40:50].strip(), line[50:].strip()
    parts = re.split(r"\s{2,}", line.strip()[len(name) :].strip())
    if len(parts) < 2:
        raise InputError(f"{where}: the line of {name} keeps to no columns: {line.strip()[:80]!r}")
    middle = parts[1:-1]
    return name, parts[0], middle[0] if middle else "", " ".join([*middle[1:], parts[-1]])


def _entry(line: str, where: str) -> Entry:
    name, description, unit, value = _columns(line, where)
    return Entry(name, description, unit, None if value in ("", NOT_AVAILABLE) else value)


def _channel(line: str, where: str) -> ChannelEntry:
    name, description, unit, numbers_text = _columns(line, where)
    fields = numbers_text.split()
    if len(fields) > 3:
        raise InputError(f"{where}: channel {name} has {len(fields)} numbers after its unit, at most 3 are allowed")
    numbers = [1.0, 0.0, 0.0]
    for index, field in enumerate(fields):
        if field == NOT_AVAILABLE:
            continue
        try:
            numbers[index] = float(field)
        except ValueError:
            field_name = ("conversion factor", "offset of the measured value", "offset of the physical value")[index]
            raise InputError(f"{where}: {field_name} of {name} is {field[:40]!r}, not a number") from None
    if not np.isfinite(numbers).all() or numbers[0] == 0.0:
        raise InputError(f"{where}: conversion factor of {name} is {numbers[0]:g}, it must be finite and not zero")
    return ChannelEntry(name, description, unit, *numbers)


def _numbers(body: str, width: int, announced: int | None, source: str) -> Array:
    if width == 0:
        raise InputError(f"{source}: lists no channels under **MEASURCHANNELS")
    body = re.sub(r"^[ \t]*![^\n]*", "", _plain_line_ends(body), flags=re.MULTILINE)
    clean = body.replace(NOT_AVAILABLE, "nan")
    rows = sum(1 for _ in re.finditer(r"^[^\S\n]*\S", clean, re.MULTILINE))
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # numpy's word for text that is no number
        try:
            flat = np.fromstring(clean, sep=" ", dtype=np.float64)
        except (ValueError, DeprecationWarning):
            flat = np.empty(0)
    if flat.size != rows * width or any(len(line.split()) not in (0, width) for line in clean.split("\n")):
        flat = np.array([_row(line, width, source) for line in clean.split("\n") if line.strip()])
    if flat.size == 0:
        raise InputError(f"{source}: **MEASURDATA holds no rows; was the file cut off?")
    if announced is not None and announced != rows:
        raise InputError(f"{source}: **MEASURDATA announces {announced} rows and holds {rows}; was the file cut off?")
    return flat.reshape(-1, width)


def _row(line: str, width: int, source: str) -> list[float]:
    """One row of data the slow way: by blanks, else by fields of ten columns; blames the row."""
    beginning = line.strip()[:80]
    by_blanks = line.split()
    by_columns = [line[start : start + _FIELD] for start in range(0, len(line.rstrip()), _FIELD)]
    for fields in (by_blanks, by_columns):
        if len(fields) == width and plain_digits(line):
            try:
                return [float(field) for field in fields]
            except ValueError:
                continue
    if len(by_blanks) == width:
        raise InputError(f"{source}: row {beginning!r} of **MEASURDATA is not made of numbers with decimal points")
    raise InputError(
        f"{source}: row {beginning!r} of **MEASURDATA has {len(by_blanks)} values for {width} channels; "
        "was the file cut off?"
    )
