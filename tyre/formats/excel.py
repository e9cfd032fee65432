"""Spreadsheets: names, units and samples as in a text table, or a whole sheet with its words."""

import re
import zipfile
from collections.abc import Sequence
from datetime import date, datetime, time, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.csv import MISSING, read_header, since_first
from tyre.formats.signals import Column, Contents, Signal
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, hint
from tyre.ground.progress import optional_module

Rows = list[list[Any]]
LARGEST = 250_000_000  # bytes of an unpacked spreadsheet
CELLS = 20_000_000  # of a sheet, from its first row and column to its last
BLOCK = 1 << 22  # bytes of a sheet that are looked at at once
_PLACE = re.compile(rb'\br="([A-Z]{1,4})(\d{1,9})"')


def excel_contents(path: Path, reading: Reading) -> Contents:
    """List the columns of the sheet that is named, else of the only one that is not empty."""
    sheets = _sheets(path)
    if reading.sheet:
        if reading.sheet not in sheets:
            suggestion = hint(reading.sheet, sheets)
            sheet_names = ", ".join(sheets)
            raise InputError(f"{path}: no sheet {reading.sheet!r}{suggestion}; there are {sheet_names}")
        sheets = {reading.sheet: sheets[reading.sheet]}
    sheets = {name: rows for name, rows in sheets.items() if any(map(_filled, rows))}
    if not sheets:
        raise InputError(f"{path}: every sheet is empty")
    if len(sheets) > 1:
        raise InputError(f"{path}: has the sheets {', '.join(sheets)}; name one, as sheet = ... in [reading]")
    ((sheet, rows),) = sheets.items()
    where = f"{path}, sheet {sheet!r}"
    first = _first_row(rows, reading)
    if first is None:
        raise InputError(f"{where}: no table of numbers was found; give names_line and first_line in [reading]")
    width = max(len(row) - next((i for i, cell in enumerate(reversed(row)) if cell != ""), len(row)) for row in rows)
    text = [[cell if isinstance(cell, str) else repr(cell) for cell in row[:width]] for row in rows[: first + 1]]
    names, units, notes = read_header(where, text, first, width, reading, ".")
    body = [row for row in rows[first:] if _filled(row)]
    dates = [any(isinstance(row[place], datetime | time) for row in body[:20]) for place in range(width)]
    units = tuple("datetime" if dated else unit for dated, unit in zip(dates, units, strict=True))

    def load(wanted_names: Sequence[str], most: int | None) -> list[Signal]:
        rows_read = rows[: None if most is None else first + most]
        places = [names.index(name) for name in wanted_names]
        return [Signal(names[p], _column(rows_read, first, p, where, names[p]), units[p]) for p in places]

    columns = tuple(Column(name, unit) for name, unit in zip(names, units, strict=True))
    return Contents(columns, load, notes)


def workbook_rows(path: Path, kind: str) -> list[tuple[str, tuple[Any, ...]]]:
    """Rows of the only sheet with data, or of that called ``kind``, each with its place; whole numbers are int."""
    sheets = {name: rows for name, rows in _sheets(path).items() if any(map(_filled, rows))}
    if len(sheets) > 1 and kind not in sheets:
        raise InputError(f"{path}: several sheets have data ({', '.join(sheets)}); name the one to read {kind!r}")
    rows = sheets.get(kind, next(iter(sheets.values()), []))
    return [(f"row {number}", tuple(map(_convert_cell, row))) for number, row in enumerate(rows, 1)]


def _convert_cell(cell: Any) -> Any:
    if isinstance(cell, float) and cell.is_integer():
        return int(cell)
    return cell.strip() if isinstance(cell, str) else cell


def _sheets(path: Path) -> dict[str, Rows]:
    calamine = optional_module("python_calamine", extra="formats")
    size = path.stat().st_size
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as parts:
            size = sum(part.file_size for part in parts.infolist())
            if size <= LARGEST:
                _refuse_far_cells(path, parts)
    if size > LARGEST:
        raise InputError(
            f"{path}: holds {size / 1e6:,.0f} MB once unpacked, at most {LARGEST / 1e6:,.0f} MB are read of a "
            "spreadsheet; export the table as CSV"
        )
    with calamine.load_workbook(path) as book:
        return {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names}


def _refuse_far_cells(path: Path, parts: zipfile.ZipFile) -> None:
    """Ask the size of each sheet before it is read: two cells far apart make a table of all those between them."""
    for part in parts.namelist():
        if not re.fullmatch(r"xl/worksheets/[^/]*\.xml", part):
            continue
        rows, columns, end = 0, 0, b""
        with parts.open(part) as stream:
            while block := stream.read(BLOCK):
                for letters, row in _PLACE.findall(end + block):
                    rows = max(rows, int(row))
                    columns = max(columns, _number_of(letters))
                end = block[-40:]  # may hold the beginning of a place
        if rows * columns > CELLS:
            raise InputError(
                f"{path}: its cells reach to row {rows:,} and column {columns:,}, which are {rows * columns:,} cells; "
                f"at most {CELLS:,} are read: delete what lies far from the table, or export it as CSV"
            )


@cache
def _number_of(letters: bytes) -> int:
    """Number of a column from 1: ``AB`` is 28."""
    number = 0
    for letter in letters:
        number = 26 * number + letter - ord("A") + 1
    return number


def _filled(row: list[Any]) -> bool:
    return any(cell != "" for cell in row)


def _first_row(rows: Rows, reading: Reading) -> int | None:
    """Index of the first row in which about as many cells as usual are numbers."""
    if reading.first_line:
        return reading.first_line - 1 if reading.first_line <= len(rows) else None
    counts = [sum(not isinstance(cell, str | bool) for cell in row) for row in rows]
    start = max(reading.names_line, reading.units_line)
    return next((i for i, count in enumerate(counts) if i >= start and count > 0.5 * max(counts)), None)


def _column(rows: Rows, first: int, place: int, where: str, name: str) -> Array:
    samples, start = list[float](), None
    of_day = False
    for line, row in enumerate(rows[first:], first + 1):
        if not _filled(row):
            continue
        cell = row[place]
        if isinstance(cell, date) and not isinstance(cell, datetime):  # at midnight a moment reads as a day
            cell = datetime.combine(cell, time())
        if isinstance(cell, datetime):
            start = start or cell
            samples.append((cell - start).total_seconds())
        elif isinstance(cell, timedelta):
            samples.append(cell.total_seconds())
        elif isinstance(cell, time):
            of_day = True
            samples.append(3600.0 * cell.hour + 60.0 * cell.minute + cell.second + 1e-6 * cell.microsecond)
        elif isinstance(cell, int | float) and not isinstance(cell, bool):
            samples.append(float(cell))
        elif isinstance(cell, str) and cell.strip() in MISSING:
            samples.append(np.nan)
        else:
            raise InputError(f"{where}, row {line}: {name} = {cell!r:.60} is not a number; empty cells are missing")
    return since_first(np.array(samples)) if of_day else np.array(samples, float)
