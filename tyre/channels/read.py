"""Read a laboratory recording in any format as signals."""

import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TypeVar

from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.reading import Reading
from tyre.channels.signals import Contents, Signals, find_column

T = TypeVar("T")
TEXT = (".csv", ".tsv", ".txt", ".asc", ".dat")
FORMATS: dict[str, str] = {
    **dict.fromkeys(TEXT, "csv_rows.csv_contents"), ".tdx": "tydex.tydex_contents",
    **dict.fromkeys((".xlsx", ".xlsm", ".xls", ".ods"), "excel.excel_contents"),
    **dict.fromkeys((".parquet", ".pq"), "parquet.parquet_contents"), ".mat": "matlab.matlab_contents",
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), "hdf5.hdf5_contents"), ".tdms": "tdms.tdms_contents",
    **dict.fromkeys((".mf4", ".mdf"), "mdf.mdf_contents"),
}  # fmt: skip
"""Ending of a file -> who lists its contents."""


def contents(path: str | Path, *, reading: Reading | None = None) -> Contents:
    """Columns of a recording, without their values.

    Parameters
    ----------
    path : str or Path
        In any format of :data:`FORMATS`.
    reading : Reading, optional
        What the file does not say of itself.

    Returns
    -------
    Contents

    Raises
    ------
    InputError
        No such file, an ending that is not known, a library that is not installed, or a file that is damaged.
    """
    path = Path(path)
    where = FORMATS.get(path.suffix.casefold())
    if where is None:
        raise InputError(f"{path}: recordings end in {', '.join(FORMATS)}, not in {path.suffix!r}")
    if not path.is_file():
        raise InputError(f"{path}: {'is a folder; give a file' if path.is_dir() else 'no such recording'}")
    module, _, function = where.partition(".")
    found: Contents = _guarded(
        path, lambda: getattr(import_module(f"tyre.channels.{module}"), function)(path, reading or Reading())
    )
    if not found.columns:
        raise InputError(f"{path}: holds no channels")
    return found


def read_signals(
    path: str | Path,
    *,
    map: ChannelMap | None = None,
    dbc: Sequence[Path] = (),
    most: int | None = None,
) -> Signals:
    """Read a recording.

    Parameters
    ----------
    path : str or Path
        In any format of :data:`FORMATS`.
    map : ChannelMap, optional
        Only its columns are read, as it says to read the file; without, all are.
    dbc : sequence of Path
        Databases that decode CAN frames, in place of those of the map.
    most : int, optional
        So many first samples of each signal, at most.

    Returns
    -------
    Signals

    Raises
    ------
    InputError
        As :func:`contents`; a column of the map that is not there, a value that is no number.
    """
    path = Path(path)
    reading = map.reading if map else Reading()
    if dbc:
        from dataclasses import replace

        reading = replace(reading, dbc=tuple(dbc))
    found = contents(path, reading=reading)
    if map is None:
        names = [column.name for column in found.columns]
    else:
        clock = map.clock and (map.clock.column or map.clock.index)
        wanted = [entry.column for entry in map.channels.values()] + ([clock] if clock else [])
        names = list(dict.fromkeys(find_column(name, found.columns, where=str(path)) for name in wanted))
    signals = _guarded(path, lambda: {signal.name: signal for signal in found.load(names, most)})
    return Signals(str(path), signals, tuple(found.notes))


def _guarded(path: Path, action: Callable[[], T]) -> T:
    """Do it, turning whatever a library raises of a damaged file into one message."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return action()
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"{path}: {error}") from error
    except Exception as error:
        said = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
        raise InputError(
            f"{path}: cannot be read as {path.suffix.casefold()} ({said}); is it damaged, cut off, or another format?"
        ) from error
