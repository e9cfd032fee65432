"""A table of numbers and words from CSV, a workbook or Parquet: cells with the place that a message names."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tyre.formats import table_rows
from tyre.ground.errors import InputError
from tyre.ground.files import read_text
from tyre.ground.text_table import refuse_huge_line, split_quoted

ENDINGS = (".csv", ".xlsx", ".parquet")
_DECIMAL_COMMA = re.compile(r"(?<![\d.,])([+-]?\d+),(\d+)(?!\d*[.,])")
_UNIT_IN_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]")
MOST_COLUMNS = 1_000
ROW = "#"  # bicycles.csv#NAME is one of the rows, two_tyres.csv#NAME one of the tyres
Rows = list[tuple[str, tuple[Any, ...]]]


@dataclass(frozen=True)
class Sheet:
    """A table as it stands in a file: its header, and rows of a place (``line 3``) and cells, texts or numbers each."""

    path: Path  # of the file
    header: tuple[str, ...]  # names of the columns
    rows: tuple[tuple[str, tuple[Any, ...]], ...]  # place, such as ``line 3``, and its cells


def read_sheet(path: Path, *, kind: str) -> Sheet:
    """Read a table whose first row names the columns; lines of a CSV that begin with ``#`` are passed over."""
    if not path.is_file():
        raise InputError(f"{path}: no such table of {kind}")
    suffix = path.suffix.lower()
    rows = _csv(path) if suffix == ".csv" else table_rows(path, kind)
    rows = [(place, cells) for place, cells in rows if any(cell != "" for cell in cells)]
    if len(rows) < 2:
        raise InputError(f"{path}: the table of {kind} has no rows below the one that names the columns")
    header = tuple(str(name).strip() for name in rows[0][1])
    if len(header) > MOST_COLUMNS:
        raise InputError(f"{path}: holds {len(header):,} columns; a table of {kind} has at most {MOST_COLUMNS:,}")
    for number, name in enumerate(header, 1):
        if not name:
            raise InputError(f"{path}: column {number} has no name")
        if header.count(name) > 1:
            raise InputError(f"{path}: the column {name!r} is given twice; keep one")
    for place, cells in rows[1:]:
        if len(cells) != len(header):
            raise InputError(f"{path}, {place}: {len(cells)} cells where the header has {len(header)} columns")
    return Sheet(path, header, tuple(rows[1:]))


def split_unit(column: str) -> tuple[str, str]:
    """Split the name of a column and the unit in its brackets, ``w [mm]`` or ``w (mm)``; the unit may be empty."""
    match = _UNIT_IN_BRACKETS.fullmatch(column.strip())
    return (match["name"].strip(), match["unit"].strip()) if match else (column.strip(), "")


def split_row(text: str) -> tuple[Path, str]:
    """Split the file of a table and the name of what is chosen in it (``FILE#NAME``), empty where nothing is."""
    file, mark, name = text.rpartition(ROW)
    if mark and Path(file).suffix.lower() in ENDINGS and not Path(text).is_file():
        return Path(file), name
    return Path(text), ""


def _csv(path: Path) -> Rows:
    lines = [
        (n, line) for n, line in enumerate(read_text(path).splitlines(), 1) if line.strip() and not line.startswith("#")
    ]
    mark = next((separator for separator in ";\t" if lines and separator in lines[0][1]), ",")
    rows: Rows = []
    for number, line in lines:
        refuse_huge_line(line, where=f"{path}, line {number}")
        cells = split_quoted(line, mark, where=f"{path}, line {number}")
        plain = (_DECIMAL_COMMA.sub(r"\1.\2", cell) if mark != "," else cell for cell in cells)
        rows.append((f"line {number}", tuple(plain)))
    return rows
