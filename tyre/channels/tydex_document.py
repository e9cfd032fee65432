"""TYDEX 1.3 as a document: every byte kept, header, constants, channels and data to be had as values.

Layout after Unrau & Zamow, TYDEX-Format, Description and Reference Manual, release 1.3 (1997), section 2.2: keywords
begin with ``**``; a line of a table has the name in columns 1-10, the description in 11-40, the unit in 41-50; then a
constant has its value from column 51, a channel its conversion factor (51-60), the offset of the measured value
(61-70) and the offset of the physical value (71-80); data stand in fields of ten columns. Lines that begin with ``!``
are comments.
"""

import re
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tyre.base.errors import InputError, nearest, plain_digits
from tyre.base.files import write_bytes

NOT_AVAILABLE = "NOTAVAIL"
KEYWORDS = (
    "HEADER",
    "COMMENTS",
    "CONSTANTS",
    "MEASURCHANNELS",
    "MEASURDATA",
    "MODELDEFINITION",
    "MODELPARAMETERS",
    "MODELCOEFFICIENTS",
    "MODELCHANNELS",
    "MODELOUTPUTS",
    "MODELEND",
    "END",
)
_SINGLE = ("HEADER", "CONSTANTS", "MEASURCHANNELS", "MEASURDATA", "END")
KEYWORD_LINE = re.compile(r"^\*\*[^\r\n]*(?:\r\n|\r|\n|\Z)", re.MULTILINE)
FIELD = 10


@dataclass(frozen=True)
class Section:
    """One keyword with everything up to the next: ``line`` is the keyword's own line, ``body`` the rest, verbatim."""

    name: str
    line: str
    body: str


@dataclass(frozen=True)
class Entry:
    """One line of ``**HEADER`` or ``**CONSTANTS``; ``value`` is None where the file says NOTAVAIL or nothing."""

    name: str
    description: str
    unit: str
    value: str | None


@dataclass(frozen=True)
class ChannelEntry:
    """One line of ``**MEASURCHANNELS``: (measured + ``measured_offset``) * ``factor`` + ``physical_offset``."""

    name: str
    description: str
    unit: str
    factor: float = 1.0
    measured_offset: float = 0.0
    physical_offset: float = 0.0


@dataclass(frozen=True)
class TydexDocument:
    """A TYDEX file, lossless: ``text`` is the file to the last blank.

    Attributes
    ----------
    sections : tuple of Section
        In the order of the file; text before the first keyword is a section without a name.
    source : str
        Name for error messages.
    """

    sections: tuple[Section, ...]
    source: str = "TYDEX text"

    @property
    def text(self) -> str:
        """The whole file."""
        return "".join(section.line + section.body for section in self.sections)

    def body(self, keyword: str) -> str:
        """Text under ``keyword``, empty when the file does not have it."""
        return "".join(section.body for section in self.sections if section.name == keyword)

    @cached_property
    def header(self) -> dict[str, Entry]:
        """Entries of ``**HEADER`` by name."""
        return _entries(self.body("HEADER"), f"{self.source}, **HEADER")

    @cached_property
    def comments(self) -> str:
        """Text of ``**COMMENTS`` without blanks at its ends."""
        return self.body("COMMENTS").strip()

    @cached_property
    def constants(self) -> dict[str, Entry]:
        """Entries of ``**CONSTANTS`` by name."""
        return _entries(self.body("CONSTANTS"), f"{self.source}, **CONSTANTS")

    @cached_property
    def channels(self) -> dict[str, ChannelEntry]:
        """Channels by name, in the order of the data columns."""
        where = f"{self.source}, **MEASURCHANNELS"
        channels: dict[str, ChannelEntry] = {}
        for line in _table_lines(self.body("MEASURCHANNELS")):
            channel = _channel(line, where)
            if channel.name in channels:
                raise InputError(f"{where}: channel {channel.name} is listed twice; keep one")
            channels[channel.name] = channel
        return channels

    @cached_property
    def measured(self) -> NDArray[np.float64]:
        """Numbers of ``**MEASURDATA`` as printed, shape (rows, channels); NOTAVAIL is NaN."""
        return _numbers(self.body("MEASURDATA"), len(self.channels), self._announced_rows, self.source)

    @property
    def _announced_rows(self) -> int | None:
        lines = [section.line.split() for section in self.sections if section.name == "MEASURDATA"]
        rows = lines[0][1] if lines and len(lines[0]) > 1 else ""
        return int(rows) if rows.isascii() and rows.isdigit() and len(rows) < 12 else None

    def physical(self, name: str) -> NDArray[np.float64]:
        """Values of the channel ``name`` in its own unit, factor and offsets applied, shape (rows,).

        Raises
        ------
        InputError
            When the file has no such channel.
        """
        if name not in self.channels:
            raise InputError(f"{self.source}: has no channel {name} (found: {', '.join(self.channels)})")
        channel = self.channels[name]
        printed = self.measured[:, list(self.channels).index(name)]
        if (channel.factor, channel.measured_offset, channel.physical_offset) == (1.0, 0.0, 0.0):
            return printed.copy()
        return (printed + channel.measured_offset) * channel.factor + channel.physical_offset


def parse(text: str, *, source: str = "TYDEX text") -> TydexDocument:
    """Split a TYDEX ``text`` into its sections; messages call it ``source``.

    Raises
    ------
    InputError
        When there is no **HEADER, no **END (a file cut off), an unknown keyword or one that stands twice.
    """
    marks = list(KEYWORD_LINE.finditer(text))
    sections = [Section("", "", text[: marks[0].start()])] if marks and marks[0].start() else []
    following_starts = [mark.start() for mark in marks[1:]] + [len(text)]
    for mark, following in zip(marks, following_starts, strict=False):
        words = mark.group()[2:].split()
        name = words[0].upper() if words else ""
        if name not in KEYWORDS:
            near = nearest(name, KEYWORDS)
            hint = f"; did you mean **{near}?" if near else ""
            raise InputError(f"{source}: keyword **{name[:40]} is unknown to TYDEX 1.3{hint}")
        sections.append(Section(name, mark.group(), text[mark.end() : following]))
    names = [section.name for section in sections]
    for name in _SINGLE:
        if names.count(name) > 1:
            raise InputError(f"{source}: keyword **{name} stands {names.count(name)} times; a file holds one test")
    if "HEADER" not in names:
        raise InputError(f"{source}: keyword **HEADER is missing; is this a TYDEX file?")
    if "END" not in names:
        raise InputError(f"{source}: keyword **END is missing; the file seems to be cut off")
    return TydexDocument(tuple(sections), source)


def read_document(path: str | Path) -> TydexDocument:
    """Read the TYDEX file ``path`` (UTF-8 or Latin-1) without interpreting it.

    Raises
    ------
    InputError
        When the file cannot be read or is not TYDEX.
    """
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return parse(text, source=str(path))


def write_document(document: TydexDocument, path: str | Path) -> None:
    """Write ``document`` to ``path`` in UTF-8, line ends as they are in its text."""
    write_bytes(path, document.text.encode("utf-8"))


def _table_lines(body: str) -> list[str]:
    lines = _plain_line_ends(body).split("\n")
    return [line.expandtabs(FIELD) for line in lines if line.strip() and line.lstrip()[0] != "!"]


def _plain_line_ends(text: str) -> str:
    return text.replace("\r\n", "\n").replace("\r", "\n") if "\r" in text else text


def _columns(line: str, where: str) -> tuple[str, str, str, str]:
    """Name, description, unit and the rest; by columns, or by wide gaps where a writer missed the columns."""
    name = line.split(maxsplit=1)[0]
    if len(name) > FIELD:
        raise InputError(f"{where}: name {name[:40]!r} is longer than its field of {FIELD} columns")
    torn = any(len(line) > cut and line[cut - 1 : cut + 1].strip() == line[cut - 1 : cut + 1] for cut in (40, 50))
    if line[0] != " " and not torn:
        return name, line[len(name) : 40].strip(), line[40:50].strip(), line[50:].strip()
    parts = re.split(r"\s{2,}", line.strip()[len(name) :].strip())
    if len(parts) < 2:
        raise InputError(f"{where}: the line of {name} keeps to no columns: {line.strip()[:80]!r}")
    middle = parts[1:-1]
    return name, parts[0], middle[0] if middle else "", " ".join([*middle[1:], parts[-1]])


def _entries(body: str, where: str) -> dict[str, Entry]:
    entries: dict[str, Entry] = {}
    for line in _table_lines(body):
        name, description, unit, value = _columns(line, where)
        if name in entries:
            raise InputError(f"{where}: {name} is listed twice; keep one")
        entries[name] = Entry(name, description, unit, None if value in ("", NOT_AVAILABLE) else value)
    return entries


def _channel(line: str, where: str) -> ChannelEntry:
    name, description, unit, rest = _columns(line, where)
    fields = rest.split()
    if len(fields) > 3:
        raise InputError(f"{where}: channel {name} has {len(fields)} numbers after its unit, at most 3 are allowed")
    numbers = [1.0, 0.0, 0.0]
    for index, field in enumerate(fields):
        if field == NOT_AVAILABLE:
            continue
        try:
            numbers[index] = float(field)
        except ValueError:
            what = ("conversion factor", "offset of the measured value", "offset of the physical value")[index]
            raise InputError(f"{where}: {what} of {name} is {field[:40]!r}, not a number") from None
    if not np.isfinite(numbers).all() or numbers[0] == 0.0:
        raise InputError(f"{where}: conversion factor of {name} is {numbers[0]:g}, it must be finite and not zero")
    return ChannelEntry(name, description, unit, *numbers)


def _numbers(body: str, width: int, announced: int | None, source: str) -> NDArray[np.float64]:
    if width == 0:
        raise InputError(f"{source}: lists no channels under **MEASURCHANNELS")
    body = _plain_line_ends(body)
    if "!" in body:
        body = re.sub(r"^[ \t]*![^\n]*", "", body, flags=re.MULTILINE)
    clean = body.replace(NOT_AVAILABLE, "nan")
    rows = sum(1 for _ in re.finditer(r"^[^\S\n]*\S", clean, re.MULTILINE))
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # numpy's word for text that is no number
        try:
            flat = np.fromstring(clean, sep=" ", dtype=np.float64)
        except (ValueError, DeprecationWarning):
            flat = np.empty(0)
    if flat.size != rows * width:
        flat = np.array([_row(line, width, source) for line in clean.split("\n") if line.strip()])
    if flat.size == 0:
        raise InputError(f"{source}: **MEASURDATA holds no rows; was the file cut off?")
    if announced is not None and announced != rows:
        raise InputError(f"{source}: **MEASURDATA announces {announced} rows and holds {rows}; was the file cut off?")
    return flat.reshape(-1, width)


def _row(line: str, width: int, source: str) -> list[float]:
    """One row of data the slow way: by blanks, else by fields of ten columns; blames the row."""
    shown = line.strip()[:80]
    by_blanks = line.split()
    by_columns = [line[start : start + FIELD] for start in range(0, len(line.rstrip()), FIELD)]
    for fields in (by_blanks, by_columns):
        if len(fields) == width and plain_digits(line):
            try:
                return [float(field) for field in fields]
            except ValueError:
                continue
    if len(by_blanks) == width:
        raise InputError(f"{source}: row {shown!r} of **MEASURDATA is not made of numbers with decimal points")
    raise InputError(
        f"{source}: row {shown!r} of **MEASURDATA has {len(by_blanks)} values for {width} channels; "
        "was the file cut off?"
    )
