"""CSV tables: read strictly (every complaint names file, line and column), and written so that no cell is a formula.

The reader of laboratories' text tables (:mod:`tyre.formats.csv`) uses the same splitting and number parsing.
"""

import csv
import io
import math
import re
import warnings
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, plain_digits, refuse_unknown
from tyre.ground.files import refuse_special, write_text
from tyre.ground.schema import Check, read

if TYPE_CHECKING:
    import pandas as pd

_COMMENT = re.compile(r'^((?:[^"#]|"[^"]*")*)#.*')  # outside quotes
_UNIT_HINT = "units are in the column names (SI; angles in rad)"


LONGEST_LINE, LONGEST_WORD, MOST_CELLS = 200_000, 1_000, 10_000  # characters, characters, cells of a line


def refuse_huge_line(line: str, *, where: str) -> None:
    """Refuse a line that no table has, before any pattern is matched with it."""
    if len(line) > LONGEST_LINE:
        raise InputError(
            f"{where}: {len(line):,} characters in a line, at most {LONGEST_LINE:,} are read; is it a table with a "
            "line end after each row?"
        )
    cells = 1 + max(line.count(separator) for separator in "\t;,|")
    if cells > MOST_CELLS:
        raise InputError(f"{where}: {cells:,} cells in a line, at most {MOST_CELLS:,} are read; remove columns")
    longest = max(re.split(r"[\s;,|]", line), key=len)
    if len(longest) > LONGEST_WORD:
        raise InputError(
            f"{where}: {longest[:20]!r}... has {len(longest):,} characters, at most {LONGEST_WORD:,} are read of a "
            "number or a word"
        )


def split_quoted(line: str, separator: str, *, where: str) -> list[str]:
    """Split a line whose cells may be in quotes; quotes that do not close are refused."""
    try:
        (cells,) = csv.reader([line], delimiter=separator, skipinitialspace=True, strict=True)
    except csv.Error as error:
        raise InputError(f"{where}: not CSV ({error}); see the quotation marks") from error
    return [cell.strip() for cell in cells]


def number_in(cell: str, *, decimal: str = ".") -> float:
    """Read a cell as a number; NaN if it is none."""
    try:
        return float(cell.replace(",", ".") if decimal == "," else cell) if plain_digits(cell) else math.nan
    except ValueError:
        return math.nan


def fast_numbers(
    text: str, separator: str, places: Sequence[int], *, width: int, decimal: str, missing: Collection[str]
) -> list[Array] | None:
    """Read some columns of ``text`` by pandas, ten times as fast, if every row is as it should be; else give None."""
    import pandas as pd

    exact = {"float_precision": "round_trip"} if int(pd.__version__.partition(".")[0]) < 3 else {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pd.errors.ParserWarning)  # rows too long are found by counting below
            frame = pd.read_csv(
                io.StringIO(text),
                sep=separator,
                header=None,
                names=list(range(width)),
                usecols=list(places),
                index_col=False,
                dtype=np.float64,
                na_values=list(missing),
                decimal=decimal,
                keep_default_na=False,
                skipinitialspace=True,
                quoting=csv.QUOTE_NONE,
                **exact,
            )  # type: ignore[call-overload]
    except (ValueError, OverflowError, pd.errors.ParserError):
        return None
    raw = np.frombuffer(text.encode(errors="replace"), np.uint8)
    ends = np.append(np.flatnonzero(raw == ord("\n")), raw.size)  # a cell too many and one too few would make it up
    cells = np.diff(np.searchsorted(np.flatnonzero(raw == ord(separator)), ends), prepend=0)
    complete = np.count_nonzero(cells == width - 1) >= len(frame) and np.isin(cells, (0, width - 1)).all()
    return [frame[place].to_numpy() for place in places] if complete else None


NO_NUMBER = ("", "nan", "NaN", "NAN")


@dataclass(frozen=True)
class Columns:
    """Columns with numbers and with words, and the line of each row in the file."""

    numbers: Mapping[str, Array]  # name -> (n,), in the unit of the file
    texts: Mapping[str, list[str]]  # name -> a text for each of the n rows
    lines: tuple[int, ...]  # (n,), line in the file of each row, from 1


@dataclass(frozen=True)
class Cells:
    """A table as text; ``logged`` as in :func:`read_cells`, ``example`` names columns for messages."""

    path: Path | Traversable  # of the file, for messages
    text: str  # of the whole file
    separator: str  # between cells
    logged: bool
    example: str

    @cached_property
    def rows(self) -> list[tuple[int, list[str]]]:
        """Line in the file and cells of every row, the header first; a row of another width than the header is
        refused."""
        rows = []
        for line, text in enumerate(self.text.split("\n"), 1):
            refuse_huge_line(text, where=f"{self.path}, line {line}")
            content = text if self.logged else _COMMENT.sub(r"\1", text).strip()
            if content and not content.isspace():
                quoted = not self.logged and '"' in content
                where = f"{self.path}, line {line}"
                rows.append(
                    (line, split_quoted(content, ",", where=where) if quoted else content.split(self.separator))
                )
        width = len(rows[0][1]) if rows else 0
        for line, cells in rows:
            if len(cells) != width:
                how = "was the file cut off?" if len(cells) < width else "name every column, separate by commas"
                if len(cells) > width:
                    how += " and write numbers with a point; decimal commas need semicolons"
                if self.separator == "," and ";" in "".join(rows[0][1]):
                    how = "columns are separated by commas here, not semicolons, and numbers written with a point"
                cells_here = f"{len(cells)} {'cell' if len(cells) == 1 else 'cells'}"
                columns = f"{width} {'column' if width == 1 else 'columns'}"
                raise InputError(f"{self.path}, line {line}: {cells_here} where the header has {columns}; {how}")
        return rows

    @cached_property
    def header(self) -> list[str]:
        """Names of the columns; of a logger's file in the first line."""
        if self.logged:
            return [name.strip().strip('"') for name in self.text.partition("\n")[0].split(self.separator)]
        if not self.rows:
            raise InputError(
                f"{self.path}: the file is empty; the first line must name the columns: {self.example}, ..."
            )
        return [name.strip() for name in self.rows[0][1]]

    def column(self, place: int) -> list[str]:
        """Cells of column number ``place`` (from 0) below the header."""
        return [cells[place].strip() for _, cells in self.rows[1:]]

    def numbers(self, places: Sequence[int], *, missing: Collection[str] = ()) -> list[Array]:
        """Read some columns as numbers."""
        body = self.text.partition("\n")[2]
        decimal = "," if self.separator == ";" else "."
        fast = None
        if self.logged and body.strip():
            fast = fast_numbers(
                body,
                self.separator,
                places,
                width=len(self.header),
                missing=missing,
                decimal=decimal if "," in body else ".",
            )
        return fast or [self._numbers(place, decimal, missing) for place in places]

    def check_column(self, place: int, check: Check) -> Array:
        """Read one column as numbers, each given by a :class:`Check`; an empty cell is checked as ``""``."""
        numbers = []
        for (line, _), cell in zip(self.rows[1:], self.column(place), strict=True):
            number = number_in(cell)
            value = cell if math.isnan(number) and cell.lower() != "nan" else number
            numbers.append(read(check, value, where=f"{self.path}, line {line}", section=self.header[place]))
        return np.array(numbers)

    def _numbers(self, place: int, decimal: str, missing: Collection[str]) -> Array:
        column = self.column(place)
        numbers = np.array([number_in(cell, decimal=decimal) for cell in column])
        for row in np.flatnonzero(~np.isfinite(numbers)):
            endless = self.logged and np.isinf(numbers[row])
            if not missing or not (endless or column[row] in missing):
                wanted_kind = "number" if self.logged and missing else "finite number; correct it or take the row out"
                where = f"{self.path}, line {self.rows[row + 1][0]}"
                raise InputError(f"{where}: {self.header[place]} = {column[row][:40]!r} is not a {wanted_kind}")
        return numbers


def read_columns(
    path: Path | Traversable,
    *,
    numbers: Collection[str] | Mapping[str, Check],
    texts: Sequence[str] = (),
    needed: Sequence[str],
    others: bool = False,
    blank: Collection[str] = (),
) -> Columns:
    """Read a CSV file with a header line; ``#`` outside quotes begins a comment, empty lines are passed over.

    Cells of the ``blank`` columns may be empty or ``nan``: NaN.
    """
    cells = read_cells(path, kind="table; a path in a file is relative to that file", example=", ".join(needed))
    header = cells.header
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise InputError(f"{path}: columns are separated by commas here, numbers written with a point (0.1)")
    if "" in header:
        raise InputError(f"{path}: column {header.index('') + 1} has no name; {_UNIT_HINT}")
    if not others:
        refuse_unknown("column", header, [*numbers, *texts], where=str(path), more=_UNIT_HINT)
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"{path}: the column {name} is given twice; keep one")
    missing = [name for name in needed if name not in header]
    if missing:
        what_there_is = f"there are {', '.join(header)}" if others else _UNIT_HINT
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; {what_there_is}")
    if not cells.rows[1:]:
        raise InputError(f"{path}: the table has no rows")
    names = [name for name in header if name in numbers]
    if isinstance(numbers, Mapping):
        values = [cells.check_column(header.index(name), numbers[name]) for name in names]
    else:
        values = [cells.numbers([header.index(name)], missing=NO_NUMBER if name in blank else ())[0] for name in names]
    words = {name: cells.column(place) for place, name in enumerate(header) if name in texts}
    return Columns(dict(zip(names, values, strict=True)), words, tuple(line for line, _ in cells.rows[1:]))


def read_cells(path: Path | Traversable, *, kind: str, example: str, logged: bool = False) -> Cells:
    """Read the cells of a table, which messages call a ``kind``; below the header of a ``logged`` one also Latin-1."""
    refuse_special(path)
    if path.is_dir():
        raise InputError(f"{path} is a folder; give files: {path}/*.csv")
    try:
        raw = path.read_bytes().removeprefix(b"\xef\xbb\xbf")  # spreadsheets write a byte-order mark
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such {kind}") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a {kind.partition(';')[0]} ({error.strerror})") from error
    first, body = raw.partition(b"\n")[0] if logged else raw, b""
    try:
        head = first.decode("utf-8")
        body = raw[len(first) :]
        text = head + body.decode("utf-8")
    except UnicodeDecodeError as error:
        if not body:
            raise InputError(f"{path}: not text in UTF-8 ({error.reason}); save it as CSV in UTF-8") from error
        text = head + body.decode("latin-1")
    head = text.partition("\n")[0]
    if "\0" in text or (logged and not head.strip()):
        raise InputError(f"{path}: no CSV; the first line must name the columns: {example}, ...")
    refuse_huge_line(head, where=f"{path}, line 1")
    separator = ";" if logged and ";" in head else ","
    last = text[text.rfind("\n") + 1 :]  # of a row without a line end; a comment ends a number, too
    if last.strip() and last != head and last.count(separator) >= head.count(separator) and (logged or "#" not in last):
        raise InputError(
            f"{path}, line {text.count(chr(10)) + 1}: the last row ends with {last[-12:]!r} and no line end, so the "
            "file may be cut off inside a number; complete the row and end it with a line break"
        )
    return Cells(path, text, separator, logged, example)


def escape_formula(cell: object) -> object:
    """Put ``'`` before a text that a spreadsheet would run as a formula; a number as text is none."""
    if not (isinstance(cell, str) and cell.startswith(("=", "+", "-", "@", "\t"))):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def csv_text(table: "pd.DataFrame", *, number_format: str | None = None) -> str:
    """Write a ``table`` (without its index) as CSV text; ``number_format`` such as ``%.10g``, else all digits."""
    from pandas.api.types import is_numeric_dtype

    safe = table.rename(columns=escape_formula)
    if number_format is not None and safe.size and (safe.dtypes == np.float64).all():
        numbers = safe.to_numpy()
        if not np.isnan(numbers).any():  # a recording: in one go, several times as fast
            line = ",".join([number_format] * numbers.shape[1]) + "\n"
            head: str = safe.iloc[:0].to_csv(index=False, lineterminator="\n")
            return head + line * len(numbers) % tuple(numbers.ravel().tolist())
    for place in range(safe.shape[1]):
        if not is_numeric_dtype(safe.dtypes.iloc[place]):
            safe.isetitem(place, [escape_formula(cell) for cell in safe.iloc[:, place]])
    text: str = safe.to_csv(index=False, lineterminator="\n", float_format=number_format)
    return text


def write_csv(target: str | Path, table: "pd.DataFrame", *, number_format: str | None = None) -> None:
    """Write a ``table`` to ``target`` as :func:`csv_text` does, completely or not at all."""
    write_text(target, csv_text(table, number_format=number_format))
