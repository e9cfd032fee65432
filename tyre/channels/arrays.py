"""Arrays of several dimensions, and tables, as channels."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.channels.signals import Signal


def columns_of(name: str, values: Any, unit: str = "", *, base: int = 0) -> Iterator[Signal]:
    """The channels in an array of numbers; none in text, complex numbers or a single number.

    Parameters
    ----------
    name : str
    values : ndarray
        In ``unit``; a vector, or a matrix whose longer side are the samples (the rows of a square one).
    unit : str
    base : int
        Number of the first column of a matrix: 0 is written ``name[0]``, 1 ``name(1)``.
    """
    values = np.asarray(values)
    if values.dtype.kind not in "fiub" or values.ndim == 0 or values.size < 2:
        return
    values = values.reshape(-1) if max(values.shape) == values.size else values
    if values.ndim == 1:
        yield Signal(name, values.astype(float), unit)
    elif values.ndim == 2:
        for place, column in enumerate(values.T if values.shape[0] >= values.shape[1] else values):
            yield Signal(f"{name}({place + 1})" if base else f"{name}[{place}]", column.astype(float), unit)


def columns_of_frame(name: str, frame: Any, units: list[str]) -> Iterator[Signal]:
    """The columns of a table with numbers, with its times where its rows have some.

    Parameters
    ----------
    name : str
    frame : pandas.DataFrame
    units : list of str
        Of the columns, as written; may be empty.
    """
    time = seconds(frame.index.to_numpy()) if frame.index.dtype.kind in "mM" else None
    units = units if len(units) == frame.shape[1] else [""] * frame.shape[1]
    for column, unit in zip(frame.columns, units, strict=True):
        values = frame[column].to_numpy()
        if values.dtype.kind in "mM":
            yield Signal(f"{name}.{column}", seconds(values), "s" if values.dtype.kind == "m" else "datetime", time)
        elif values.dtype.kind in "fiub":
            yield Signal(f"{name}.{column}", values.astype(float), unit, time)


def seconds(stamps: Any) -> Array:
    """Durations in s, or dates in s since the first one.

    Parameters
    ----------
    stamps : ndarray, shape (n,)
        Of numpy's durations or dates.
    """
    if stamps.dtype.kind == "M" and stamps.size:
        stamps = stamps - stamps[0]
    found = stamps.astype("timedelta64[ns]").astype(np.int64) / 1e9
    found[np.isnat(stamps)] = np.nan
    return np.asarray(found, float)
