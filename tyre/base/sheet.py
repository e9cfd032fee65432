"""A table of numbers and words from CSV, an Excel workbook or Parquet: cells with the place that a message names."""

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError
from tyre.base.optional import optional_module

ENDINGS = (".csv", ".xlsx", ".parquet")
_DECIMAL_COMMA = re.compile(r"(?<![\d.,])([+-]?\d+),(\d+)(?!\d*[.,])")
_UNIT_IN_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]()]*)[\])]")


@dataclass(frozen=True)
class Sheet:
    """A table as it stands in a file.

    Attributes
    ----------
    path : Path
    header : tuple of str
        Names of the columns.
    rows : tuple of (str, tuple)
        Place of each row (``line 3``) and its cells, a text or a number each, empty text where there is nothing.
    """

    path: Path
    header: tuple[str, ...]
    rows: tuple[tuple[str, tuple[Any, ...]], ...]


def read_sheet(path: Path, *, kind: str) -> Sheet:
    """Read a table whose first row names the columns; lines of a CSV that begin with ``#`` are passed over.

    Columns of a CSV are separated by commas, or by semicolons or tabs where its header is; with semicolons and tabs
    numbers may have decimal commas.

    Parameters
    ----------
    path : Path
        ``.csv``, ``.xlsx`` or ``.parquet``.
    kind : str
        What it should be, for messages; the sheet of a workbook that is taken if there are several.

    Raises
    ------
    InputError
        No such file or not of its format, no rows, a column without a name or named twice, a row of another length;
        or the package that reads the format is not installed.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such table of {kind}")
    rows = list({".csv": _csv, ".xlsx": _workbook, ".parquet": _parquet}[path.suffix.lower()](path, kind))
    rows = [(place, cells) for place, cells in rows if any(cell != "" for cell in cells)]
    if len(rows) < 2:
        raise InputError(f"{path}: the table of {kind} has no rows below the one that names the columns")
    header = tuple(str(name).strip() for name in rows[0][1])
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
    """The name of a column and the unit in its brackets, ``w [mm]`` or ``w (mm)``; the unit is empty without.

    Parameters
    ----------
    column : str
    """
    match = _UNIT_IN_BRACKETS.fullmatch(column.strip())
    return (match["name"].strip(), match["unit"].strip()) if match else (column.strip(), "")


def _csv(path: Path, kind: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text in UTF-8 ({error.reason}); save it as CSV in UTF-8") from error
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        return
    mark = next((one for one in ";\t" if one in lines[0][1]), ",")
    for number, line in lines:
        try:
            (cells,) = csv.reader([line], delimiter=mark, skipinitialspace=True, strict=True)
        except csv.Error as error:
            raise InputError(f"{path}, line {number}: not CSV ({error}); see the quotation marks") from error
        plain = (cell.strip() for cell in cells)
        yield f"line {number}", tuple(_DECIMAL_COMMA.sub(r"\1.\2", c) if mark != "," else c for c in plain)


def _workbook(path: Path, kind: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    import pandas as pd

    _needed("openpyxl", path)
    try:
        book = pd.read_excel(path, sheet_name=None, header=None, dtype=object, engine="openpyxl")
    except Exception as error:  # whatever the package meets in a file that is no workbook
        raise InputError(f"{path}: not an Excel workbook ({' '.join(str(error).split())[:80]})") from error
    filled = {str(name): frame for name, frame in book.items() if not frame.empty}
    if len(filled) > 1 and kind not in filled:
        raise InputError(f"{path}: several sheets have data ({', '.join(filled)}); name the one to read {kind!r}")
    frame = filled.get(kind, next(iter(filled.values()), None))
    for number, row in enumerate(() if frame is None else frame.itertuples(index=False), 1):
        yield f"row {number}", tuple(_cell(cell) for cell in row)


def _parquet(path: Path, kind: str) -> Iterator[tuple[str, tuple[Any, ...]]]:
    import pandas as pd

    _needed("pyarrow", path)
    try:
        frame = pd.read_parquet(path, engine="pyarrow")
    except Exception as error:  # whatever the package meets in a file that is no Parquet
        raise InputError(f"{path}: not a Parquet file ({' '.join(str(error).split())[:80]})") from error
    if frame.index.name is not None:
        frame = frame.reset_index()
    yield "header", tuple(map(str, frame.columns))
    for number, row in enumerate(frame.itertuples(index=False), 1):
        yield f"row {number}", tuple(_cell(cell) for cell in row)


def _needed(package: str, path: Path) -> None:
    try:
        optional_module(package, extra="formats")
    except ImportError as error:
        raise InputError(f"{path}: {error}") from error


def _cell(cell: Any) -> Any:
    """A cell of a workbook: a number, or text without blanks around it, empty where there is nothing."""
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return ""
    return cell.strip() if isinstance(cell, str) else cell
