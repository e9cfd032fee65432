"""Text tables of laboratories, of any size: their layout is found, their samples are read block by block."""

import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.signals import Column, Contents, Signal
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import refuse_special
from tyre.ground.progress import progress_bar
from tyre.ground.text_table import fast_numbers, number_in, refuse_huge_line
from tyre.ground.units import find_unit, quantity_of

MISSING = ("", "NaN", "nan", "NAN", "NA", "N/A", "#N/A", "null", "NOTAVAIL", "-")
"""Texts that stand for a missing sample."""

BLOCK = 1 << 22  # bytes that are read at once
_HEAD = 1 << 18  # bytes in which the layout must show
_LARGE = 1 << 26  # bytes; larger files show how far they are read
_SAMPLE = 60  # lines by which delimiter and decimal sign are told
_NUMBER = {sign: re.compile(rf"[+-]?(\d+{re.escape(sign)}?\d*|{re.escape(sign)}\d+)([eE][+-]?\d+)?") for sign in ".,"}
_BRACKETS = re.compile(r"^(.*\S)\s*[\[(]([^\[\]()]*)[\])]$")
_DATE = re.compile(r"\d{4}-\d\d-\d\d([T ]\d\d:\d\d(:\d\d(\.\d+)?)?(Z|[+-]\d\d:?\d\d)?)?")
_OF_DAY = re.compile(r"(\d{1,2}):(\d\d):(\d\d)(?:[:.,](\d+))?")
_NUMBER_OF_RATE = r"(?P<number>\d+(?:[.,]\d+)?)"
_RATE = re.compile(
    r"\b(?P<word>(?:sampl\w*|update|output|acquisition|logging|scan|data|abtast|mess)[\s_-]*"
    r"(?:rate|freq(?:uency|uenz)?)|fs)\b\W*(?P<label>k?Hz)?\W*"
    + _NUMBER_OF_RATE
    + r"\s*(?P<unit>k?Hz|S/s|sps|samples/s\w*)?(?![\w.])",
    re.IGNORECASE,
)
_INTERVAL = re.compile(
    r"\b(?:sampl\w*|abtast)[\s_-]*(?:interval|intervall|period|periode)\b\W*(?P<label>ms|us|sec|s)?\W*"
    + _NUMBER_OF_RATE
    + r"\s*(?P<unit>ms|us|sec|s)?(?![\w.])",
    re.IGNORECASE,
)
_COMMENTS = ("#", "%", "//")  # signs with which a line of comment begins
GARBLED = 200  # lines, one of which may be damaged: it counts as a missing sample
_CANDIDATES = tuple((delimiter, sign) for delimiter in ("\t", ";", ",", "|", "blanks") for sign in ".,")
_MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}


@dataclass(frozen=True)
class _Layout:
    """Layout of a text table; ``first_line`` counts from 1, ``dates`` and ``numeric`` are numbers of columns from
    0."""

    encoding: str  # name of a codec of Python
    line_end: str | None  # between lines; None if it is a carriage return, which may else be a damaged byte
    delimiter: str  # between cells, or ``blanks``
    decimal: str  # decimal sign
    names: tuple[str, ...]  # of the columns
    units: tuple[str, ...]  # of the columns, as the file writes them; empty if it does not
    dates: frozenset[int]
    numeric: tuple[int, ...]
    first_line: int
    trailing: bool  # True if each line of samples ends with a delimiter, an empty cell more
    notes: tuple[str, ...]  # a line each, for the reader
    rates: tuple[float, ...] = ()  # Hz, that the lines above the samples state

    @property
    def width(self) -> int:
        """Number of cells of a line of samples."""
        return len(self.names) + self.trailing


def csv_contents(path: Path, reading: Reading) -> Contents:
    """List the columns of a text table; loading one refuses a cell that is no number."""
    layout = _find_layout(path, reading)
    notes = list(layout.notes)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        places = [layout.names.index(name) for name in names]
        values, damage_notes = _columns(path, layout, places, most)
        notes.extend(damage_notes)
        return [Signal(layout.names[p], x, layout.units[p]) for p, x in zip(places, values, strict=True)]

    columns = tuple(Column(name, unit) for name, unit in zip(layout.names, layout.units, strict=True))
    return Contents(columns, load, notes, rates=layout.rates)


def names_and_units(cells: Sequence[str]) -> list[tuple[str, str]]:
    """Split cells such as ``Fy [N]`` into name and unit; columns without a name are numbered from 1."""
    pairs = []
    for place, cell in enumerate(cells, 1):
        match = _BRACKETS.match(cell)
        is_unit = match is not None and (match.group(2) in ("", "-", "1") or quantity_of(match.group(2)) != "")
        name, unit = match.groups() if match and is_unit else (cell, "")
        pairs.append((name or f"column {place}", unit))
    return pairs


def read_header(
    where: str, rows: list[list[str]], first: int, width: int, reading: Reading, decimal: str
) -> tuple[tuple[str, ...], tuple[str, ...], list[str]]:
    """Read names and units of columns from the ``rows`` above the ``first`` one of samples (from 0), and a note."""
    filled_above = [index for index in range(first) if any(rows[index])]
    if reading.names_line:
        if reading.names_line > first:
            raise InputError(f"{where}: [reading]: names_line = {reading.names_line} must be above the samples")
        block = [reading.names_line - 1]
    else:
        block = _lines_of_names(where, rows, filled_above, width, reading, decimal)
    units_row = reading.units_line - 1 if reading.units_line else None
    if units_row is None and len(block) > 1 and _are_units(_strip_row(rows[block[-1]], width)):
        units_row = block.pop()
    parts = [_strip_row(rows[index], width) for index in block]
    joined = [".".join(filter(None, cells)) for cells in zip(*parts, strict=True)] if parts else [""] * width
    if len(joined) != width:
        raise InputError(f"{where}: {len(joined)} names of columns where the samples have {width} columns")
    pairs = names_and_units(joined)
    units = [unit for _, unit in pairs]
    if units_row is not None:
        row = _strip_row(rows[units_row], width)
        if len(row) != width:
            raise InputError(f"{where}, line {units_row + 1}: {len(row)} units where there are {width} columns")
        units = [unit.strip("[]()") or old for unit, old in zip(row, units, strict=True)]
    names = [name for name, _ in pairs]
    twice = {name for name in names if names.count(name) > 1}
    names = [f"{name} (column {place})" if name in twice else name for place, name in enumerate(names, 1)]
    passed = len([index for index in filled_above if index < min(block, default=0)])
    notes = [f"lines above the names of the columns that were passed over: {passed}"] if passed else []
    used = {*block, units_row}
    between = len([index for index in filled_above if index > min(block, default=first) and index not in used])
    notes += [f"lines of comment below the names of the columns that were passed over: {between}"] if between else []
    return tuple(names), tuple(units), notes


def _lines_of_names(
    where: str, rows: list[list[str]], filled_above: list[int], width: int, reading: Reading, decimal: str
) -> list[int]:
    """Lines with names, and perhaps units, right above the samples: as wide as they, without numbers or blank lines.

    A line that begins with the sign of a comment is a title or a remark, unless no other line can hold the names.
    """
    block: list[int] = []
    remarks: list[int] = []  # comments that would fit as names
    fitting = True
    for index in reversed(filled_above):
        if reading.units_line and index == reading.units_line - 1:
            continue
        row = _strip_row(rows[index], width)
        numbers = [cell for cell in row if _NUMBER[decimal].fullmatch(cell)] if not _are_places(row) else []
        if is_comment(rows[index]):
            fitting = fitting and len(row) == width and not numbers
            if fitting:
                remarks.insert(0, index)
            continue
        is_title = bool(block) and (
            index + 1 not in filled_above or sum(map(bool, row)) < 0.5 * width
        )  # a title, padded
        if len(row) != width or is_title:
            break
        if numbers and not block and len(numbers) < width:
            raise InputError(
                f"{where}, line {index + 1}: names of columns were expected above the samples, it holds "
                f"{numbers[0]!r}; correct the line, or give names_line and first_line in [reading]"
            )
        if numbers:
            break
        block.insert(0, index)
    block = _with_remarks(block, remarks, rows, width)
    if filled_above and not block and not reading.first_line:
        last = filled_above[-1]
        raise InputError(
            f"{where}, line {last + 1}: {len(rows[last])} cells above samples of {width} columns; "
            "no names of columns were found: give names_line in [reading]"
        )
    return block


def _with_remarks(block: list[int], remarks: list[int], rows: list[list[str]], width: int) -> list[int]:
    """Add to the lines of a header those comments (``remarks``, of the width of the table) that it cannot do without:
    the nearest one if no line names the columns, and one right above the samples in which every word is a unit."""
    units = [index for index in remarks if _are_units(_strip_row(rows[index], width), strict=True)]
    last = max([*block, *remarks], default=-1)
    named = [index for index in block if len(block) > 1 or not _are_units(_strip_row(rows[index], width))]
    if named:
        return [*block, last] if last in units else block
    names = [index for index in remarks if index not in units and index < min(block, default=len(rows))]
    if not names:
        return block or remarks[-1:]
    if block:
        return [names[-1], *block]
    return [names[-1], last] if last in units else [names[-1]]


def is_comment(row: Sequence[str]) -> bool:
    """True if a line of a header begins with the sign of a comment."""
    return bool(row) and row[0].startswith(_COMMENTS)


def _strip_row(row: list[str], width: int) -> list[str]:
    """A line of the header without the mark of a comment and without a delimiter at its end."""
    cells = list(row)
    if is_comment(cells):
        mark = next(mark for mark in _COMMENTS if cells[0].startswith(mark))
        cells[0] = cells[0].removeprefix(mark).strip()
        if not cells[0] and len(cells) == width + 1:
            cells = cells[1:]
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return cells


def _are_units(cells: list[str], *, strict: bool = False) -> bool:
    """True if at least half of the filled cells of a line (``strict``: all of them) are units, and one is known."""
    are_units = [quantity_of(cell) != "" or cell.strip("[]()") in ("-", "%", "1") for cell in cells if cell]
    return sum(are_units) >= (1.0 if strict else 0.5) * len(are_units) and any(map(quantity_of, cells))


def _are_places(cells: list[str]) -> bool:
    """True if the cells count the columns, from 0 or 1: a header of bare numbers."""
    if len(cells) < 3 or not all(cell.isascii() and cell.isdigit() for cell in cells):
        return False
    return [int(cell) - int(cells[0]) for cell in cells] == list(range(len(cells))) and int(cells[0]) < 2


def _split(line: str, delimiter: str) -> list[str]:
    """Cells of one line, without blanks around them."""
    if delimiter == "blanks":
        return line.split()
    if '"' in line:
        try:
            return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]
        except (csv.Error, StopIteration):
            pass
    return [cell.strip() for cell in line.split(delimiter)]


def _find_layout(path: Path, reading: Reading) -> _Layout:
    lines, encoding, line_end, notes = _head(path, reading)
    delimiter, decimal, width, first = _table(path, lines, reading)
    rows = [_split(line, delimiter) for line in lines]
    following = rows[first + 1] if first + 1 < len(rows) else []
    if not reading.first_line and not reading.names_line and _are_places(rows[first]) and not _are_places(following):
        title = next((row for row in reversed(rows[:first]) if any(row)), [])
        if len(title) != width:
            reading, first = replace(reading, names_line=first + 1), first + 1
    body = [row for row in rows[first : first + _SAMPLE] if any(row)]
    header_row = next((row for row in reversed(rows[:first]) if any(row)), [])
    trailing = (
        width > 1
        and delimiter != "blanks"
        and all(len(row) == width and row[-1] == "" for row in body)
        and (len(header_row) < width or not header_row[-1])
    )
    names, units, header_notes = read_header(str(path), rows, first, width - trailing, reading, decimal)
    dates = frozenset(
        place
        for place in range(width - trailing)
        if (cells := [row[place] for row in body if len(row) > place and row[place] not in MISSING])
        and all(_DATE.fullmatch(cell) or _OF_DAY.fullmatch(cell) for cell in cells)
    )
    signs = decimal if delimiter == "," else ".,"
    numeric = tuple(
        place
        for place in range(width - trailing)
        if place in dates or _share_of_numbers([row[place] for row in body if len(row) > place], signs) > 0.5
    )
    units = tuple("datetime" if place in dates else unit for place, unit in enumerate(units))
    rates = stated_rates(lines[:first])
    return _Layout(
        encoding,
        line_end,
        delimiter,
        decimal,
        names,
        units,
        dates,
        numeric,
        first + 1,
        trailing,
        (*notes, *header_notes),
        rates,
    )


def stated_rates(lines: Sequence[str]) -> tuple[float, ...]:
    """Rates of sampling, Hz, that the ``lines`` of a header state: ``Sample rate: 100 Hz``, ``sample interval;10 ms``.

    Other rates may be given there (of a serial line, a filter), so a number without Hz is taken of sampling alone.
    """
    rates: list[float] = []
    for line in lines:
        if match := _RATE.search(line):
            unit = (match["unit"] or match["label"] or "").casefold()
            number = float(match["number"].replace(",", ".")) * (1000.0 if unit.startswith("k") else 1.0)
            if number > 0 and (unit or match["word"].casefold().startswith(("sampl", "abtast", "fs"))):
                rates.append(number)
        elif match := _INTERVAL.search(line):
            unit = (match["unit"] or match["label"] or "").casefold()
            number = float(match["number"].replace(",", "."))
            if number > 0 and unit:
                rates.append(1.0 / (number * find_unit(unit, "time", where=line).factor))
    return tuple(dict.fromkeys(rates))


def _head(path: Path, reading: Reading) -> tuple[list[str], str, str | None, list[str]]:
    """First lines of a file, its encoding and line end, and a note if the encoding was guessed."""
    refuse_special(path)
    try:
        with path.open("rb") as file:
            raw = file.read(_HEAD)
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a recording ({error.strerror})") from None
    notes: list[str] = []
    encoding = reading.encoding or next((name for mark, name in _MARKS.items() if raw.startswith(mark)), "")
    if not encoding:
        encoding = "utf-8" if _is_utf8(raw) else "cp1252"
        if encoding == "cp1252":
            notes.append("not UTF-8: read as Windows-1252; else give encoding in [reading]")
    try:
        text = raw.decode(encoding, errors="replace")
    except LookupError:
        raise InputError(f"{path}: [reading]: encoding = {encoding!r} is not known") from None
    line_end = "\n" if "\n" in text else None
    text = text.replace("\r\n", "\n")
    lines = (text if line_end else text.replace("\r", "\n")).split("\n")
    if GARBLED * sum("\0" in line for line in lines) > len(lines):
        raise InputError(f"{path}: no text table (it holds zero bytes); is it another format, or UTF-16 without mark?")
    if len(raw) == _HEAD and len(lines) > 1:
        lines.pop()  # cut by us
    if not any(line.strip() for line in lines):
        raise InputError(f"{path}: the file is empty")
    for number, line in enumerate(lines, 1):
        refuse_huge_line(line, where=f"{path}, line {number}")
    return lines, encoding, line_end, notes


def _is_utf8(raw: bytes) -> bool:
    """True if a text is in UTF-8: its first line beyond ASCII decides, for later ones may be damaged."""
    first = next((line for line in raw.split(b"\n") if not line.isascii()), b"")
    try:
        first.decode("utf-8")
    except UnicodeDecodeError as error:
        return error.end >= len(first) - 4 and raw.endswith(first)  # cut by us
    return True


def _table(path: Path, lines: list[str], reading: Reading) -> tuple[str, str, int, int]:
    """Delimiter, decimal sign, cells a line and index of the first line of samples: what makes the most of numbers."""
    best: tuple[tuple[float, ...], tuple[str, str, int, int]] | None = None
    start = (reading.first_line or max(reading.names_line, reading.units_line) + 1) - 1
    filled = [index for index, line in enumerate(lines) if line.strip()]
    for delimiter, decimal in _CANDIDATES if not reading.delimiter else ((reading.delimiter, s) for s in ".,"):
        quoted = any('"' in lines[index] for index in filled[-_SAMPLE:])  # decimal commas between commas need quotes
        if reading.decimal not in ("", decimal) or ((delimiter, decimal) == (",", ",") and not quoted):
            continue
        sample = [_split(lines[index], delimiter) for index in filled[len(filled) // 2 :][-_SAMPLE:] if index >= start]
        if not sample:
            continue
        width = Counter(len(row) for row in sample).most_common(1)[0][0]
        whole = [row for row in sample if len(row) == width]
        shares = [_share_of_numbers([row[place] for row in whole], decimal) for place in range(width)]
        numeric = [place for place, share in enumerate(shares) if share >= 0.5]
        first = _first(lines, filled, delimiter, decimal, width, numeric, start) if numeric else None
        if first is None:
            continue
        rows_above = [_split(lines[index], delimiter) for index in filled if index < first]
        named = [row for row in rows_above if not is_comment(row)] or rows_above
        header = not named or len(named[-1]) in (width, width - 1, width + 1)
        columns = max(width - (delimiter != "blanks" and all(row[-1] == "" for row in whole)), 1)
        filled_share = sum(shares[place] for place in numeric) / columns
        head = [cell for index in filled[:_SAMPLE] for cell in _split(lines[index], delimiter)]
        alike = _share_of_numbers(head, decimal)
        score = (float(header), filled_share, float(len(numeric)), -first, alike, len(whole) / len(sample))
        if best is None or score > best[0]:
            best = score, (delimiter, decimal, width, first)
    if best is None:
        raise InputError(
            f"{path}: no table of numbers was found in its lines; describe its layout with delimiter, decimal, "
            "names_line and first_line in [reading]"
        )
    return best[1]


def _share_of_numbers(cells: list[str], signs: str) -> float:
    """Share of the filled cells that are numbers with one of the decimal ``signs``."""
    filled = [cell for cell in cells if cell not in MISSING]
    hits = sum(any(_NUMBER[sign].fullmatch(cell) for sign in signs) for cell in filled)
    return hits / len(filled) if filled else 0.0


def _first(
    lines: list[str], filled: list[int], delimiter: str, decimal: str, width: int, numeric: list[int], start: int
) -> int | None:
    """Index of the first line in which most of the columns of numbers hold numbers, of either decimal sign."""
    signs = decimal if delimiter == "," else ".,"
    for place, index in enumerate(filled):
        if index < start:
            continue
        if start:
            return index
        row = _split(lines[index], delimiter)
        hits = sum(
            len(row) > column
            and (row[column] in MISSING[1:] or any(_NUMBER[sign].fullmatch(row[column]) for sign in signs))
            for column in numeric
        )
        if len(row) != width or hits <= 0.5 * len(numeric):
            continue
        if not any(_are_units(_split(lines[later], delimiter)) for later in filled[place + 1 : place + 4]):
            return index  # else it is a result of a testing machine, above the table itself
    return None


def _columns(path: Path, layout: _Layout, places: list[int], most: int | None) -> tuple[list[Array], list[str]]:
    columns = [np.empty(0) for _ in places]
    rows, notes, garbled = 0, [], list[str]()
    size = path.stat().st_size
    with progress_bar(total=size, desc=path.name, unit="B", unit_scale=True, show=size > _LARGE) as bar:
        for text, line, bytes_read, ended in _blocks(path, layout):
            if not ended:
                notes.append(f"line {line}, the last one, has no line end and may be cut off: rejected")
                continue
            block, damaged = _samples(path, layout, places, text, line)
            garbled += damaged
            if len(garbled) > max(50, rows / GARBLED):
                raise InputError(garbled[0])
            count = len(block[0]) if block else 0
            if block and rows + count > columns[0].size:
                room = int((rows + count) * max(1.25, 1.05 * size / max(bytes_read, 1) if not rows else 0.0))
                for place, x in enumerate(columns):
                    columns[place] = np.empty(room)  # pages that are never written take no memory
                    columns[place][:rows] = x[:rows]
            for x, values in zip(columns, block, strict=True):
                x[rows : rows + count] = values
            rows += count
            bar.update(bytes_read)
            if most is not None and rows >= most:
                break
    if len(garbled) * GARBLED > rows + len(garbled):
        raise InputError(garbled[0])
    if garbled:
        first = garbled[0].removeprefix(f"{path}, ")
        notes.append(f"damaged lines treated as missing samples: {len(garbled)}, the first {first}")
    if not rows and places:
        raise InputError(f"{path}: has names of columns but no samples; was the file cut off?")
    columns = [x[: rows if most is None else min(rows, most)] for x in columns]
    for k, place in enumerate(places):
        if place in layout.dates:
            columns[k] = since_first(columns[k])
    return columns, notes


def since_first(seconds: Array) -> Array:
    """Times in s since the first one, of dates or of times of the day, which restart at midnight."""
    midnights = np.cumsum(np.diff(seconds, prepend=seconds[0]) < -43_200)
    return np.asarray(np.round(seconds - seconds[0] + 86_400 * midnights, 6))


def _blocks(path: Path, layout: _Layout) -> Iterator[tuple[str, int, int, bool]]:
    """Text of whole lines, number of its first line, bytes read, and whether its last line has an end."""
    line, unfinished, ready = 1, "", False
    with path.open("r", encoding=layout.encoding, errors="replace", newline=layout.line_end) as file:
        while text := file.read(BLOCK):
            text = (unfinished + text).replace("\r\n", "\n")
            cut = text.rfind("\n") + 1
            text, unfinished = text[:cut], text[cut:]
            if not ready:
                lines = text.split("\n", layout.first_line - 1)
                if len(lines) < layout.first_line:
                    unfinished = text + unfinished
                    continue
                text, line, ready = lines[-1], layout.first_line, True
            if text:
                yield text, line, len(text), True
                line += text.count("\n")
    if unfinished.strip() and (ready or layout.first_line == 1):
        yield unfinished, line, len(unfinished), False


def _samples(path: Path, layout: _Layout, places: list[int], text: str, line: int) -> tuple[list[Array], list[str]]:
    """Samples of a block, and what is wrong with the damaged lines that are left out: fast if every row is sound."""
    if '"' not in text and "\0" not in text and layout.delimiter != "blanks" and not layout.dates.intersection(places):
        fast = fast_numbers(text, layout.delimiter, places, width=layout.width, decimal=layout.decimal, missing=MISSING)
        if fast and all(not np.isinf(x).any() for x in fast):
            return fast, []
    columns: list[list[float]] = [[] for _ in places]
    damaged: list[str] = []
    checked_places = dict.fromkeys((*layout.numeric, *places))
    rows = [(line + k, _split(row, layout.delimiter)) for k, row in enumerate(text.split("\n")) if row.strip()]
    for (number, cells), decimal in zip(rows, _decimals([cells for _, cells in rows], layout), strict=True):
        where = f"{path}, line {number}"
        try:
            if len(cells) != layout.width:
                short = len(cells) < layout.width
                how = "was the file cut off?" if short else "is the delimiter inside a number or a text?"
                raise InputError(f"{where}: {len(cells)} cells where others have {layout.width}; {how}")
            read = {
                p: (
                    _date(cells[p], f"{where}: {layout.names[p]}")
                    if p in layout.dates
                    else _number(cells[p], decimal, f"{where}: {layout.names[p]}")
                )
                for p in checked_places
            }
        except InputError as error:
            damaged.append(str(error))
            continue
        for place, x in zip(places, columns, strict=True):
            x.append(read[place])
    return [np.array(column, float) for column in columns], damaged


def _decimals(rows: list[list[str]], layout: _Layout) -> list[str]:
    """Decimal sign of every row: that of the table, but for a part of it that begins or ends with the other sign."""
    table_sign, other_sign = layout.decimal, "." if layout.decimal == "," else ","
    if layout.delimiter == ",":
        return [table_sign] * len(rows)
    places = [place for place in layout.numeric if place not in layout.dates]
    with_own, with_other = (
        [
            k
            for k, cells in enumerate(rows)
            if any(sign in cells[p] and _NUMBER[sign].fullmatch(cells[p]) for p in places if p < len(cells))
        ]
        for sign in (table_sign, other_sign)
    )
    mixed = with_own and with_other and not (with_own[-1] < with_other[0] or with_other[-1] < with_own[0])
    if len(with_other) < 3 or mixed:  # a few cells are rather damaged, or have a point between thousands
        return [table_sign] * len(rows)
    return [other_sign if with_other[0] <= k <= with_other[-1] else table_sign for k in range(len(rows))]


def _number(cell: str, decimal: str, where: str) -> float:
    if cell in MISSING:
        return np.nan
    if decimal == "," and "." in cell:
        raise InputError(
            f"{where} = {cell[:40]!r} has a decimal point in a table with decimal commas; correct it, or give "
            "decimal in [reading]"
        )
    value = number_in(cell, decimal=decimal)
    if not np.isfinite(value):
        raise InputError(f"{where} = {cell[:40]!r} is not a finite number; missing samples are empty or NaN")
    return value


def _date(cell: str, where: str) -> float:
    """A date in s since 2000, in steps of 1e-6 s or finer, or a time of the day in s."""
    if match := _OF_DAY.fullmatch(cell):
        hours, minutes, whole, part = match.groups()
        return 3600.0 * int(hours) + 60.0 * int(minutes) + float(f"{whole}.{part or 0}")
    try:
        moment = datetime.fromisoformat(cell)
    except ValueError:
        raise InputError(f"{where} = {cell[:40]!r} is not a date and time such as 2026-03-01T12:00:00.005") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return (moment - datetime(2000, 1, 1, tzinfo=UTC)).total_seconds()
