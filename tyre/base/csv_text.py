"""Tables as CSV files that a spreadsheet opens without running what is in them."""

from pathlib import Path
from typing import TYPE_CHECKING

from tyre.base.files import write_text

if TYPE_CHECKING:
    import pandas as pd

FORMULA = ("=", "+", "-", "@", "\t")
"""What a cell begins with that a spreadsheet takes for a formula."""


def harmless(cell: object) -> object:
    """A ``cell`` as it is, or behind ``'`` where it is text that a spreadsheet would run; a number as text is none."""
    if not (isinstance(cell, str) and cell.startswith(FORMULA)):
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


def csv_text(table: "pd.DataFrame", *, number_format: str | None = None) -> str:
    """A ``table`` with its column names as CSV, lines ended by ``\\n``; text that would be a formula is quoted.

    Parameters
    ----------
    table : DataFrame
        Its index is left out.
    number_format : str, optional
        Such as ``%.10g``; all digits without.
    """
    import numpy as np
    from pandas.api.types import is_numeric_dtype

    safe = table.rename(columns=harmless)
    if number_format is not None and safe.size and (safe.dtypes == np.float64).all():
        numbers = safe.to_numpy()
        if not np.isnan(numbers).any():  # a recording: in one go, several times as fast
            line = ",".join([number_format] * numbers.shape[1]) + "\n"
            head: str = safe.iloc[:0].to_csv(index=False, lineterminator="\n")
            return head + line * len(numbers) % tuple(numbers.ravel().tolist())
    for place in range(safe.shape[1]):
        if not is_numeric_dtype(safe.dtypes.iloc[place]):
            safe.isetitem(place, [harmless(cell) for cell in safe.iloc[:, place]])
    text: str = safe.to_csv(index=False, lineterminator="\n", float_format=number_format)
    return text


def write_csv(target: str | Path, table: "pd.DataFrame", *, number_format: str | None = None) -> None:
    """Write a ``table`` to ``target`` as :func:`csv_text` says it, completely or not at all.

    Parameters
    ----------
    target : path
    table : DataFrame
    number_format : str, optional
        As in :func:`csv_text`.
    """
    write_text(target, csv_text(table, number_format=number_format))
