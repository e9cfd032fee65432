"""Read a CSV table strictly: every complaint names file, line and column."""

import csv
import io
import math
import re
import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, plain_digits, refuse_unknown
from tyre.base.paths import refuse_special

Check = Callable[[Any], Any]
COMMENT = re.compile(r'^((?:[^"#]|"[^"]*")*)#.*')  # outside quotes
UNIT_HINT = "units are in the column names (SI; angles in rad)"


@dataclass(frozen=True)
class Columns:
    """Columns with numbers and with words, and the line of each row in the file."""

    numbers: Mapping[str, Array]
    texts: Mapping[str, list[str]]
    lines: tuple[int, ...]


@dataclass(frozen=True)
class Cells:
    """A table as text.

    Attributes
    ----------
    path : Path
    text : str
        The whole file.
    separator : str
        Between the columns.
    logged : bool
        As of :func:`read_cells`.
    example : str
        Names of columns, for messages.
    """

    path: Path | Traversable
    text: str
    separator: str
    logged: bool
    example: str

    @cached_property
    def rows(self) -> list[tuple[int, list[str]]]:
        """Line in the file and cells of every row, the header first, each as wide as the header; no cell spans lines.

        Raises
        ------
        InputError
            A row of another length than the header, or one whose quotes do not close.
        """
        found = []
        for line, text in enumerate(self.text.split("\n"), 1):
            kept = text if self.logged else COMMENT.sub(r"\1", text).strip()
            if kept and not kept.isspace():
                quoted, where = not self.logged and '"' in kept, f"{self.path}, line {line}"
                found.append((line, _quoted(kept, where) if quoted else kept.split(self.separator)))
        width = len(found[0][1]) if found else 0
        for line, cells in found:
            if len(cells) != width:
                how = "was the file cut off?" if len(cells) < width else "name every column, separate by commas"
                how += " and write numbers with a point; decimal commas need semicolons" * (len(cells) > width)
                if self.separator == "," and ";" in "".join(found[0][1]):
                    how = "columns are separated by commas here, not semicolons, and numbers written with a point"
                counted = f"{len(cells)} cell{'s' * (len(cells) != 1)} where the header has {width} column"
                raise InputError(f"{self.path}, line {line}: {counted}{'s' * (width != 1)}; {how}")
        return found

    @cached_property
    def header(self) -> list[str]:
        """Names of the columns."""
        if self.logged:  # in the first line
            return [name.strip().strip('"') for name in self.text.partition("\n")[0].split(self.separator)]
        if not self.rows:
            raise InputError(
                f"{self.path}: the file is empty; the first line must name the columns: {self.example}, ..."
            )
        return [name.strip() for name in self.rows[0][1]]

    def column(self, place: int) -> list[str]:
        """Cells of one column below the header; ``place`` is the number of the column, from 0."""
        return [cells[place].strip() for _, cells in self.rows[1:]]

    def numbers(self, places: Sequence[int], *, missing: Collection[str] = ()) -> list[Array]:
        """Some columns as numbers.

        Parameters
        ----------
        places : sequence of int
            Indices of the columns, from 0.
        missing : collection of str, optional
            What stands for a value that is missing (it becomes NaN) where infinity is a number, too; without, every
            cell must be a finite number.

        Returns
        -------
        list of ndarray, shape (rows,)

        Raises
        ------
        InputError
            A cell that is no number.
        """
        fast = self._fast(places, missing) if self.logged else None
        return fast or [self._numbers(place, missing) for place in places]

    def checked(self, place: int, check: Check) -> Array:
        """One column as numbers, each given by a check.

        Parameters
        ----------
        place : int
            Index of the column, from 0.
        check : callable
            Of :mod:`tyre.base.checks`.

        Returns
        -------
        ndarray, shape (rows,)
        """
        from tyre.base.schema import read

        found = []
        for (line, _), cell in zip(self.rows[1:], self.column(place), strict=True):
            where = f"{self.path}, line {line}"
            found.append(read(check, _as_number(cell), where=where, section=self.header[place]))
        return np.array(found)

    def _numbers(self, place: int, missing: Collection[str]) -> Array:
        column = self.column(place)
        found = np.array([_number(cell.replace(",", ".") if self.separator == ";" else cell) for cell in column])
        for row in np.flatnonzero(~np.isfinite(found)):
            if not missing or (np.isnan(found[row]) and column[row] not in missing):
                what = "number" if missing else "finite number; correct it or take the row out"
                where = f"{self.path}, line {self.rows[row + 1][0]}"
                raise InputError(f"{where}: {self.header[place]} = {column[row][:40]!r} is not a {what}")
        return found

    def _fast(self, places: Sequence[int], missing: Collection[str]) -> list[Array] | None:
        """The same, ten times as fast, where every row is as it should be; else None."""
        import pandas as pd

        body = self.text.partition("\n")[2]
        if not body.strip():
            return None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", pd.errors.ParserWarning)  # rows too long are found by counting below
                frame = pd.read_csv(
                    io.StringIO(body), sep=self.separator, header=None, names=list(range(len(self.header))),
                    usecols=list(places), index_col=False, dtype=np.float64, na_values=list(missing),
                    decimal="," if self.separator == ";" and "," in body else ".", keep_default_na=False,
                    skipinitialspace=True, quoting=csv.QUOTE_NONE,
                )  # fmt: skip
        except (ValueError, OverflowError, pd.errors.ParserError):
            return None
        complete = body.count(self.separator) == (len(self.header) - 1) * len(frame)
        return [frame[place].to_numpy() for place in places] if complete else None


def read_columns(
    path: Path | Traversable,
    *,
    numbers: Collection[str] | Mapping[str, Check],
    texts: Sequence[str] = (),
    needed: Sequence[str],
    others: bool = False,
) -> Columns:
    """Columns of a CSV file with a header line; ``#`` outside quotes begins a comment, empty lines are passed over.

    Parameters
    ----------
    path : Path
    numbers : collection of str, or mapping of str to callable
        Allowed columns with numbers; the checks (:mod:`tyre.base.schema`) of their cells, if these may be anything else
        than a finite number: an empty cell is checked as ``""``.
    texts : sequence of str
        Allowed columns with words.
    needed : sequence of str
        Columns that must be there.
    others : bool
        Other columns may be there, and are passed over.

    Raises
    ------
    InputError
        No such file, an unknown, repeated or missing column, an empty table, a row of another length than the header,
        a cell that is not a finite number.
    """
    kind = "table; paths are relative to the file that names it"
    cells = read_cells(path, kind=kind, example=", ".join(needed))
    header = cells.header
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        raise InputError(f"{path}: columns are separated by commas here, numbers written with a point (0.1)")
    if "" in header:
        raise InputError(f"{path}: column {header.index('') + 1} has no name; {UNIT_HINT}")
    if not others:
        refuse_unknown("column", header, [*numbers, *texts], where=str(path), more=UNIT_HINT)
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"{path}: the column {name} is given twice; keep one")
    missing = [name for name in needed if name not in header]
    if missing:
        there = f"there are {', '.join(header)}" if others else UNIT_HINT
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; {there}")
    if not cells.rows[1:]:
        raise InputError(f"{path}: the table has no rows")
    names = [name for name in header if name in numbers]
    if isinstance(numbers, Mapping):
        values = [cells.checked(header.index(name), numbers[name]) for name in names]
    else:
        values = cells.numbers([header.index(name) for name in names])
    words = {name: cells.column(place) for place, name in enumerate(header) if name in texts}
    return Columns(dict(zip(names, values, strict=True)), words, tuple(line for line, _ in cells.rows[1:]))


def read_cells(path: Path | Traversable, *, kind: str, example: str, logged: bool = False) -> Cells:
    """Cells of a table, empty lines passed over.

    Parameters
    ----------
    path : Path
    kind : str
        What it should be, for the message: ``recording``.
    example : str
        Names of columns, for the message.
    logged : bool
        A data logger wrote it: quotes and ``#`` are letters as others, columns may be separated by semicolons (then
        numbers may have decimal commas), and below the header any bytes are text.

    Raises
    ------
    InputError
        No such file, one that is not text, or a last row without a line end.
    """
    text = _text(path, kind, logged=logged)
    head = text.partition("\n")[0]
    if "\0" in text or (logged and not head.strip()):
        raise InputError(f"{path}: no CSV; the first line must name the columns: {example}, ...")
    separator = ";" if logged and ";" in head else ","
    last = text[text.rfind("\n") + 1 :]  # of a row without a line end; a comment ends a number, too
    if last.strip() and last != head and last.count(separator) >= head.count(separator) and (logged or "#" not in last):
        raise InputError(
            f"{path}, line {text.count(chr(10)) + 1}: the last row ends with {last[-12:]!r} and no line end, so the "
            "file may be cut off inside a number; complete the row and end it with a line break"
        )
    return Cells(path, text, separator, logged, example)


def _text(path: Path | Traversable, kind: str, *, logged: bool) -> str:
    refuse_special(path)
    try:
        raw = path.read_bytes().removeprefix(b"\xef\xbb\xbf")  # spreadsheets write a byte-order mark
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such {kind}") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read as a {kind.partition(';')[0]} ({error.strerror})") from error
    head = raw.partition(b"\n")[0] if logged else raw
    try:
        head.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not text in UTF-8 ({error.reason}); save it as CSV in UTF-8") from error
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return head.decode("utf-8") + raw[len(head) :].decode("latin-1")


def _quoted(line: str, where: str) -> list[str]:
    try:
        return next(csv.reader([line], skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise InputError(f"{where}: not CSV ({error}); see the quotation marks") from error


def _as_number(cell: str) -> float | str:
    """A number, or the text that is none."""
    return cell if math.isnan(number := _number(cell)) and cell.lower() != "nan" else number


def _number(cell: str) -> float:
    try:
        return float(cell) if plain_digits(cell) else math.nan
    except ValueError:
        return math.nan
