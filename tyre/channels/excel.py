"""Spreadsheets: names, units and samples as in a text table."""

from collections.abc import Sequence
from datetime import datetime, time, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, hint
from tyre.base.optional import optional_module
from tyre.channels.csv_header import header
from tyre.channels.csv_layout import MISSING
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal


def excel_contents(path: Path, reading: Reading) -> Contents:
    """Columns of one sheet.

    Parameters
    ----------
    path : Path
    reading : Reading
        ``sheet`` (else the only one that is not empty), ``names_line``, ``units_line`` and ``first_line``.

    Raises
    ------
    InputError
        No such sheet, or no table of numbers on it; loading a column refuses a cell that is no number.
    """
    rows, sheet = _sheet(path, reading)
    where = f"{path}, sheet {sheet!r}"
    first = _first_row(rows, reading)
    if first is None:
        raise InputError(f"{where}: no table of numbers was found; give names_line and first_line in [reading]")
    width = max(len(row) - next((i for i, cell in enumerate(reversed(row)) if cell != ""), len(row)) for row in rows)
    text = [[cell if isinstance(cell, str) else repr(cell) for cell in row[:width]] for row in rows[: first + 1]]
    names, units, passed = header(where, text, first, width, reading, ".")
    body = [row for row in rows[first:] if any(cell != "" for cell in row)]
    dates = [any(isinstance(row[place], datetime) for row in body[:20]) for place in range(width)]
    units = tuple("datetime" if dated else unit for dated, unit in zip(dates, units, strict=True))

    def load(names_wanted: Sequence[str], most: int | None) -> list[Signal]:
        places = [names.index(name) for name in names_wanted]
        return [
            Signal(names[place], _column(rows[: None if most is None else first + most], first, place, where, names),
                   units[place])
            for place in places
        ]  # fmt: skip

    columns = tuple(Column(name, unit) for name, unit in zip(names, units, strict=True))
    notes = [f"lines above the names of the columns that were passed over: {passed}"] if passed else []
    return Contents(str(path), columns, load, notes)


def _sheet(path: Path, reading: Reading) -> tuple[list[list[Any]], str]:
    calamine = optional_module("python_calamine", extra="formats")
    with calamine.load_workbook(path) as book:
        names = list(book.sheet_names)
        if reading.sheet and reading.sheet not in names:
            raise InputError(
                f"{path}: no sheet {reading.sheet!r}{hint(reading.sheet, names)}; there are {', '.join(names)}"
            )
        found = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False)
                 for name in ([reading.sheet] if reading.sheet else names)}  # fmt: skip
    filled = [name for name, rows in found.items() if any(any(cell != "" for cell in row) for row in rows)]
    if not filled:
        raise InputError(f"{path}: every sheet is empty")
    if len(filled) > 1:
        raise InputError(f"{path}: has the sheets {', '.join(filled)}; name one, as sheet = ... in [reading]")
    return found[filled[0]], filled[0]


def _first_row(rows: list[list[Any]], reading: Reading) -> int | None:
    if reading.first_line:
        return reading.first_line - 1 if reading.first_line <= len(rows) else None
    start = max(reading.names_line, reading.units_line)
    usual = max((_count(row) for row in rows), default=0)
    for index, row in enumerate(rows):
        if index >= start and _count(row) > 0.5 * usual:
            return index
    return None


def _count(row: list[Any]) -> int:
    return sum(not isinstance(cell, str | bool) for cell in row)


def _column(rows: list[list[Any]], first: int, place: int, where: str, names: Sequence[str]) -> Array:
    found, start = [], None
    for line, row in enumerate(rows[first:], first + 1):
        if all(cell == "" for cell in row):
            continue
        cell = row[place]
        if isinstance(cell, datetime):
            start = start or cell
            found.append((cell - start).total_seconds())
        elif isinstance(cell, timedelta):
            found.append(cell.total_seconds())
        elif isinstance(cell, int | float) and not isinstance(cell, bool):
            found.append(float(cell))
        elif isinstance(cell, str) and cell.strip() in MISSING:
            found.append(np.nan)
        else:
            what = "a time of day without a date" if isinstance(cell, time) else "not a number"
            raise InputError(f"{where}, row {line}: {names[place]} = {cell!r:.60} is {what}; empty cells are missing")
    return np.array(found, float)
