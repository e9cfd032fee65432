"""Read a CSV table of numbers strictly: every complaint names file, line and column."""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, unknown

COMMENT = re.compile(r'^((?:[^"#]|"[^"]*")*)#.*')  # outside quotes
UNIT_HINT = "units are in the column names (SI; angles in rad)"


@dataclass(frozen=True)
class Columns:
    """Columns with numbers and with words, and the line of each row in the file."""

    numbers: Mapping[str, Array]
    texts: Mapping[str, list[str]]
    lines: tuple[int, ...]


def read_columns(path: Path, *, numbers: Sequence[str], texts: Sequence[str] = (), needed: Sequence[str]) -> Columns:
    """Columns of a CSV file with a header line; ``#`` outside quotes begins a comment, empty lines are passed over.

    Parameters
    ----------
    path : Path
    numbers, texts : sequences of str
        Allowed columns with numbers and with words.
    needed : sequence of str
        Columns that must be there.

    Raises
    ------
    InputError
        No such file, an unknown, repeated or missing column, an empty table, a row of another length than the header,
        a cell that is not a finite number.
    """
    lines, rows = _cells(path)
    if not rows:
        raise InputError(f"{path}: the file is empty; the first line must name the columns: {', '.join(needed)}, ...")
    header, rows, lines = rows[0], rows[1:], lines[1:]
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise InputError(f"{path}: columns are separated by commas here, numbers written with a point (0.1)")
    for number, name in enumerate(header, 1):
        if not name:
            raise InputError(f"{path}: column {number} has no name; {UNIT_HINT}")
        if name not in (*numbers, *texts):
            raise InputError(f"{path}: {unknown('column', name, [*numbers, *texts])}; {UNIT_HINT}")
        if header.count(name) > 1:
            raise InputError(f"{path}: the column {name} is given twice; keep one")
    missing = [name for name in needed if name not in header]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; {UNIT_HINT}")
    if not rows:
        raise InputError(f"{path}: the table has no rows")
    for line, row in zip(lines, rows, strict=True):
        if len(row) != len(header):
            raise InputError(
                f"{path}, line {line}: {len(row)} cells where the header has {len(header)} columns; name every column, "
                "separate by commas and write numbers with a point"
            )
    columns = dict(zip(header, zip(*rows, strict=True), strict=True))
    return Columns(
        {name: _numbers(path, name, column, lines) for name, column in columns.items() if name in numbers},
        {name: list(column) for name, column in columns.items() if name in texts},
        tuple(lines),
    )


def _cells(path: Path) -> tuple[list[int], list[list[str]]]:
    """Line numbers and cells of every line that is neither empty nor a comment; no cell spans lines."""
    try:
        text = path.read_text(encoding="utf-8-sig")  # spreadsheets write a byte-order mark
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such table; paths are relative to the measurement file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a table ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text in UTF-8 ({error.reason}); save it as CSV in UTF-8") from error
    lines, rows = [], []
    for number, line in enumerate(text.split("\n"), 1):
        kept = COMMENT.sub(r"\1", line).strip()
        if not kept:
            continue
        try:
            (row,) = csv.reader([kept], skipinitialspace=True, strict=True)
        except csv.Error as error:
            raise InputError(f"{path}, line {number}: not CSV ({error}); see the quotation marks") from error
        lines.append(number)
        rows.append([cell.strip() for cell in row])
    return lines, rows


def _numbers(path: Path, name: str, cells: Sequence[str], lines: Sequence[int]) -> Array:
    found = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            found[row] = math.nan if "_" in cell else float(cell)  # Python reads 1_0 as 10
        except ValueError:
            found[row] = math.nan
        if not math.isfinite(found[row]):
            raise InputError(
                f"{path}, line {lines[row]}: {name} = {cell!r} is not a finite number; correct it or take the row out"
            )
    return found
