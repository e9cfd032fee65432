"""Samples of a text table of any size: read block by block, only the columns that are wanted."""

import csv
import io
import warnings
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, plain_digits
from tyre.base.progress import progress_bar
from tyre.channels.csv_layout import MISSING, Layout, find_layout, split
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal

BLOCK = 1 << 22  # bytes
LARGE = 1 << 26  # bytes; larger files show how far they are read


def csv_contents(path: Path, reading: Reading) -> Contents:
    """Columns of a text table.

    Parameters
    ----------
    path : Path
    reading : Reading

    Raises
    ------
    InputError
        As :func:`tyre.channels.csv_layout.find_layout`; loading a column refuses a cell that is no number.
    """
    layout = find_layout(path, reading)
    notes = list(layout.notes)

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        places = [layout.names.index(name) for name in names]
        values, said = _columns(path, layout, places, most)
        notes.extend(said)
        return [
            Signal(name, x, layout.units[place]) for name, place, x in zip(names, places, values, strict=True)
        ]  # fmt: skip

    columns = tuple(Column(name, unit) for name, unit in zip(layout.names, layout.units, strict=True))
    return Contents(str(path), columns, load, notes)


def _columns(path: Path, layout: Layout, places: list[int], most: int | None) -> tuple[list[Array], list[str]]:
    found = [np.empty(0) for _ in places]
    rows, notes = 0, []
    size = path.stat().st_size
    with progress_bar(total=size, desc=path.name, unit="B", unit_scale=True, show=size > LARGE) as bar:
        for text, line, done, ended in _blocks(path, layout):
            if not ended:
                notes.append(f"line {line}, the last one, has no line end and may be cut off: left out")
                continue
            block = _block(path, layout, places, text, line)
            count = len(block[0]) if block else 0
            if block and rows + count > found[0].size:
                room = int((rows + count) * max(1.25, 1.05 * size / max(done, 1) if not rows else 0.0))
                found = [_enlarged(x, rows, room) for x in found]
            for x, values in zip(found, block, strict=True):
                x[rows : rows + count] = values
            rows += count
            bar.update(done)
            if most is not None and rows >= most:
                break
    if not rows and places:
        raise InputError(f"{path}: has names of columns but no samples; was the file cut off?")
    found = [x[: rows if most is None else min(rows, most)] for x in found]
    return [_since_first(x) if place in layout.dates else x for place, x in zip(places, found, strict=True)], notes


def _enlarged(values: Array, rows: int, room: int) -> Array:
    """An array with ``room``, of which the first ``rows`` are kept: pages that are never written take no memory."""
    larger = np.empty(room)
    larger[:rows] = values[:rows]
    return larger


def _blocks(path: Path, layout: Layout) -> Iterator[tuple[str, int, int, bool]]:
    """Text of whole lines, number of its first line, bytes read, and whether its last line has an end."""
    line, rest, ready = 1, "", False
    with path.open("r", encoding=layout.encoding, errors="replace", newline=None) as file:
        while text := file.read(BLOCK):
            text = rest + text
            cut = text.rfind("\n") + 1
            text, rest = text[:cut], text[cut:]
            if not ready:
                lines = text.split("\n", layout.first_line - 1)
                if len(lines) < layout.first_line:
                    rest = text + rest
                    continue
                text, line, ready = lines[-1], layout.first_line, True
            if text:
                yield text, line, len(text), True
                line += text.count("\n")
    if rest.strip() and (ready or layout.first_line == 1):
        yield rest, line, len(rest), False


def _block(path: Path, layout: Layout, places: list[int], text: str, line: int) -> list[Array]:
    plain = '"' not in text and layout.delimiter != "blanks" and not layout.dates.intersection(places)
    fast = _fast(layout, places, text) if plain else None
    return fast or _slow(path, layout, places, text, line)


def _fast(layout: Layout, places: list[int], text: str) -> list[Array] | None:
    """By pandas, where every row is as it should be; else None."""
    import pandas as pd

    width = len(layout.names) + layout.trailing
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pd.errors.ParserWarning)  # rows too long are found by counting below
            frame = pd.read_csv(
                io.StringIO(text), sep=layout.delimiter, header=None, names=list(range(width)), usecols=places,
                index_col=False, dtype=np.float64, na_values=list(MISSING), decimal=layout.decimal,
                keep_default_na=False, skipinitialspace=True, quoting=csv.QUOTE_NONE, **_exact(),
            )  # fmt: skip
    except (ValueError, OverflowError, pd.errors.ParserError):
        return None
    values = [frame[place].to_numpy() for place in places]
    complete = text.count(layout.delimiter) == (width - 1) * len(frame)
    return values if complete and all(not np.isinf(x).any() for x in values) else None


@cache
def _exact() -> dict[str, Any]:
    """Numbers to the last bit: what pandas must be told before version 3."""
    import pandas as pd

    return {"float_precision": "round_trip"} if int(pd.__version__.partition(".")[0]) < 3 else {}


def _slow(path: Path, layout: Layout, places: list[int], text: str, line: int) -> list[Array]:
    """Line by line: blames the line that is not as it should be."""
    width = len(layout.names) + layout.trailing
    found: list[list[float]] = [[] for _ in places]
    for number, row in enumerate(text.split("\n"), line):
        if not row.strip():
            continue
        cells = split(row, layout.delimiter)
        if len(cells) != width:
            how = "was the file cut off?" if len(cells) < width else "is the delimiter inside a number or a text?"
            raise InputError(f"{path}, line {number}: {len(cells)} cells where others have {width}; {how}")
        for column, place in zip(found, places, strict=True):
            where = f"{path}, line {number}: {layout.names[place]}"
            column.append(_date(cells[place], where) if place in layout.dates else _number(cells[place], layout, where))
    return [np.array(column, float) for column in found]


def _number(cell: str, layout: Layout, where: str) -> float:
    if cell in MISSING:
        return np.nan
    if layout.decimal == "," and "." in cell:
        raise InputError(
            f"{where} = {cell[:40]!r} has a decimal point in a table with decimal commas; mend it, or give "
            "decimal in [reading]"
        )
    try:
        value = float(cell.replace(",", ".") if layout.decimal == "," else cell) if plain_digits(cell) else np.nan
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{where} = {cell[:40]!r} is not a finite number; missing samples are empty or NaN")
    return value


def _date(cell: str, where: str) -> float:
    """A date in s since 2000, in steps of 1e-6 s or finer."""
    from datetime import UTC, datetime

    try:
        moment = datetime.fromisoformat(cell)
    except ValueError:
        raise InputError(f"{where} = {cell[:40]!r} is not a date and time such as 2026-03-01T12:00:00.005") from None
    moment = moment if moment.tzinfo else moment.replace(tzinfo=UTC)
    return (moment - datetime(2000, 1, 1, tzinfo=UTC)).total_seconds()


def _since_first(values: Array) -> Array:
    return np.round(values - values[0], 6) if values.size else values
