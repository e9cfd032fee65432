"""How a text table is laid out: encoding, delimiter, decimal sign, where names, units and samples begin."""

import csv
import re
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tyre.base.errors import InputError
from tyre.base.paths import refuse_special
from tyre.channels.csv_header import NUMBER, are_units, header
from tyre.channels.reading import Reading

HEAD = 1 << 18  # bytes in which the layout must show
MISSING = ("", "NaN", "nan", "NAN", "NA", "N/A", "#N/A", "null", "NOTAVAIL", "-")
"""What stands for a sample that is missing."""

_DATE = re.compile(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:?\d\d)?)?")
_CANDIDATES = tuple((delimiter, sign) for delimiter in ("\t", ";", ",", "|", "blanks") for sign in ".,"
                    if (delimiter, sign) != (",", ","))  # fmt: skip
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_SAMPLE = 60  # lines by which delimiter and decimal sign are told


@dataclass(frozen=True)
class Layout:
    """Layout of a text table.

    Attributes
    ----------
    encoding, delimiter, decimal : str
        ``blanks`` separates by any number of blanks.
    names, units : tuple of str
        Of every column.
    dates : frozenset of int
        Numbers of the columns, from 0, that hold dates and times.
    first_line : int
        Line of the first sample, from 1.
    trailing : bool
        Every line of samples ends with a delimiter.
    notes : tuple of str
    """

    encoding: str
    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    dates: frozenset[int]
    first_line: int
    trailing: bool
    notes: tuple[str, ...]


def split(line: str, delimiter: str) -> list[str]:
    """Cells of one line, without blanks around them.

    Parameters
    ----------
    line : str
    delimiter : str
        One character, or ``blanks``.
    """
    if delimiter == "blanks":
        return line.split()
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            return [cell.strip() for cell in line.split(delimiter)]
    return [cell.strip() for cell in line.split(delimiter)]


def find_layout(path: Path, reading: Reading) -> Layout:
    """Find the layout from the beginning of a file.

    Parameters
    ----------
    path : Path
    reading : Reading
        What is said of it already.

    Raises
    ------
    InputError
        No such file, no text, no samples, names that cannot be told from samples or that stand twice.
    """
    lines, encoding, notes = _head(path, reading)
    delimiter, decimal, width, first = _table(path, lines, reading)
    rows = [split(line, delimiter) for line in lines]
    body = [row for row in rows[first : first + _SAMPLE] if any(row)]
    above = next((row for row in reversed(rows[:first]) if any(row)), [])
    trailing = (
        width > 1 and delimiter != "blanks" and all(len(row) == width and row[-1] == "" for row in body)
        and (len(above) < width or not above[-1])
    )  # fmt: skip
    kept = width - 1 if trailing else width
    names, units, passed = header(str(path), rows, first, kept, reading, decimal)
    notes += [f"lines above the names of the columns that were passed over: {passed}"] if passed else []
    dates = frozenset(
        place for place in range(kept)
        if (cells := [row[place] for row in body if len(row) > place and row[place] not in MISSING])
        and all(_DATE.fullmatch(cell) for cell in cells)
    )  # fmt: skip
    units = tuple("datetime" if place in dates else unit for place, unit in enumerate(units))
    return Layout(encoding, delimiter, decimal, names, units, dates, first + 1, trailing, tuple(notes))


def _head(path: Path, reading: Reading) -> tuple[list[str], str, list[str]]:
    refuse_special(path)
    try:
        with path.open("rb") as file:
            raw = file.read(HEAD)
    except FileNotFoundError:
        raise InputError(f"{path}: no such recording") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a recording ({error.strerror})") from None
    notes: list[str] = []
    encoding = reading.encoding or next((name for mark, name in _MARKS.items() if raw.startswith(mark)), "")
    if not encoding:
        encoding = "utf-8"
        try:
            raw.decode(encoding)
        except UnicodeDecodeError as error:
            if error.end < len(raw) - 4:
                encoding = "cp1252"
                notes.append("not UTF-8: read as Windows-1252; else give encoding in [reading]")
    try:
        text = raw.decode(encoding, errors="replace")
    except LookupError:
        raise InputError(f"{path}: [reading]: encoding = {encoding!r} is not known") from None
    if "\0" in text:
        raise InputError(f"{path}: no text table (it holds zero bytes); is it another format, or UTF-16 without mark?")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if len(raw) == HEAD and len(lines) > 1:
        lines.pop()  # cut by us
    if not any(line.strip() for line in lines):
        raise InputError(f"{path}: the file is empty")
    return lines, encoding, notes


def _table(path: Path, lines: list[str], reading: Reading) -> tuple[str, str, int, int]:
    """Delimiter, decimal sign, cells a line and index of the first line of samples: what makes the most of numbers."""
    best: tuple[tuple[float, ...], tuple[str, str, int, int]] | None = None
    start = (reading.first_line or max(reading.names_line, reading.units_line) + 1) - 1
    filled = [index for index, line in enumerate(lines) if line.strip()]
    for delimiter, decimal in _CANDIDATES if not reading.delimiter else ((reading.delimiter, s) for s in ".,"):
        if reading.decimal not in ("", decimal):
            continue
        sample = [split(lines[index], delimiter) for index in filled[len(filled) // 2 :][-_SAMPLE:] if index >= start]
        if not sample:
            continue
        width = Counter(len(row) for row in sample).most_common(1)[0][0]
        whole = [row for row in sample if len(row) == width]
        shares = [_share_of_numbers([row[place] for row in whole], decimal) for place in range(width)]
        numeric = [place for place, share in enumerate(shares) if share >= 0.5]
        first = _first(lines, filled, delimiter, decimal, width, numeric, start) if numeric else None
        if first is None:
            continue
        above = [index for index in filled if index < first]
        header = not above or len(split(lines[above[-1]], delimiter)) in (width, width - 1, width + 1)
        columns = max(width - (delimiter != "blanks" and all(row[-1] == "" for row in whole)), 1)
        score = (
            float(header),
            sum(shares[place] for place in numeric) / columns,
            float(len(numeric)),
            -first,
            len(whole) / len(sample),
        )
        if best is None or score > best[0]:
            best = score, (delimiter, decimal, width, first)
    if best is None:
        raise InputError(
            f"{path}: no table of numbers was found in its lines; say how it is laid out with delimiter, decimal, "
            "names_line and first_line in [reading]"
        )
    return best[1]


def _share_of_numbers(cells: list[str], decimal: str) -> float:
    filled = [cell for cell in cells if cell not in MISSING]
    hits = sum(NUMBER[decimal].fullmatch(cell) is not None for cell in filled)
    return hits / len(filled) if filled else 0.0


def _first(
    lines: list[str], filled: list[int], delimiter: str, decimal: str, width: int, numeric: list[int], start: int
) -> int | None:
    """Index of the first line in which most of the columns of numbers hold numbers."""
    for place, index in enumerate(filled):
        if index < start:
            continue
        row = split(lines[index], delimiter)
        if start and index >= start:
            return index
        hits = sum(
            len(row) > column and (NUMBER[decimal].fullmatch(row[column]) is not None or row[column] in MISSING[1:])
            for column in numeric
        )
        if len(row) != width or hits <= 0.5 * len(numeric):
            continue
        if not any(are_units(split(lines[later], delimiter)) for later in filled[place + 1 : place + 4]):
            return index  # else it is a result of a testing machine, above the table itself
    return None
