"""Read a CSV table of numbers strictly: every complaint names file, line and column."""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tyre.errors import InputError, unknown

Array = NDArray[np.float64]
UNIT_HINT = "units are in the column names (SI; angles in rad)"


def read_columns(
    path: Path, *, numbers: Sequence[str], texts: Sequence[str] = (), needed: Sequence[str]
) -> tuple[dict[str, Array], dict[str, list[str]]]:
    """Columns of a CSV file with a header line.

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
        No such file, an unknown, repeated or missing column, an empty table, a cell that is not a finite number.
    """
    import pandas as pd

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)  # more cells than the header has columns
            frame = pd.read_csv(
                path, dtype=str, keep_default_na=False, skipinitialspace=True, comment="#", index_col=False
            )
    except FileNotFoundError as error:
        raise InputError(f"{path}: no such table; paths are relative to the measurement file") from error
    except pd.errors.ParserWarning as error:
        raise InputError(f"{path}: rows have more cells than the header has columns; name every column") from error
    except (pd.errors.EmptyDataError, pd.errors.ParserError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a CSV table: {' '.join(str(error).split())}") from error
    columns = [str(name).strip() for name in frame.columns]
    frame.columns = pd.Index(columns)
    for name in columns:
        if name not in (*numbers, *texts):
            base = name.removesuffix(".1")
            if base in columns and base != name:
                raise InputError(f"{path}: the column {base} is given twice; keep one")
            raise InputError(f"{path}: {unknown('column', name, [*numbers, *texts])}; {UNIT_HINT}")
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; {UNIT_HINT}")
    if not len(frame):
        raise InputError(f"{path}: the table has no rows")
    return (
        {name: _numbers(path, name, list(frame[name])) for name in columns if name in numbers},
        {name: [text.strip() for text in frame[name]] for name in columns if name in texts},
    )


def _numbers(path: Path, name: str, cells: list[str]) -> Array:
    found = np.empty(len(cells))
    for row, cell in enumerate(cells):
        try:
            found[row] = float(cell)
        except ValueError:
            found[row] = math.nan
        if not math.isfinite(found[row]):
            raise InputError(
                f"{path}, line {row + 2}: {name} = {cell.strip()!r} is not a finite number; "
                "correct it or take the row out"
            )
    return found
