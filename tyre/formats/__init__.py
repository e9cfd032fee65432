"""Recordings of laboratories in any format, read as signals: a format is a file of this room and a row of FORMATS."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from tyre.formats import child
from tyre.formats.channel_map import ChannelMap, Reading
from tyre.formats.signals import Contents, Signals, find_column
from tyre.ground.door import room
from tyre.ground.errors import InputError

T = TypeVar("T")
FORMATS: dict[str, str] = {
    **dict.fromkeys((".csv", ".tsv", ".txt", ".asc", ".dat"), "csv"),
    ".tdx": "tydex",
    **dict.fromkeys((".xlsx", ".xlsm", ".xls", ".ods"), "excel"),
    **dict.fromkeys((".parquet", ".pq"), "parquet"),
    ".mat": "matlab",
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), "hdf5"),
    ".tdms": "tdms",
    **dict.fromkeys((".mf4", ".mdf"), "mdf"),
}
"""Ending of a file -> the module of this room whose ``MODULE_contents`` lists its columns."""

OWN = ("csv", "tydex")
"""Modules that parse files themselves; what others' libraries parse is read apart, see :mod:`tyre.formats.child`."""


def contents(path: str | Path, *, reading: Reading | None = None) -> Contents:
    """List the columns of a recording, without their values; ``reading`` is what the file does not say of itself."""
    path = Path(path)
    form = FORMATS.get(path.suffix.casefold())
    if path.is_dir():
        endings = sorted(file.suffix for file in path.iterdir() if file.suffix.casefold() in FORMATS)
        raise InputError(f"{path} is a folder; give files: {path / '*'}{endings[0] if endings else '.csv'}")
    if form is None:
        raise InputError(f"{path}: recordings end in {', '.join(FORMATS)}, not in {path.suffix!r}")
    if not path.is_file():
        raise InputError(f"{path}: no such recording")

    if form not in OWN and child.apart():
        return child.list_in_child(path, reading or Reading())
    return contents_here(path, reading or Reading())


def contents_here(path: Path, reading: Reading) -> Contents:
    """List the columns of a recording in this process."""
    form = FORMATS[path.suffix.casefold()]
    module = import_module(f"tyre.formats.{form}")
    listing: Contents = _call_library(path, lambda: getattr(module, f"{form}_contents")(path, reading))
    if not listing.columns:
        raise InputError(f"{path}: holds no channels")
    if (count := len(listing.columns)) > 10_000:
        raise InputError(f"{path}: holds {count:,} channels, at most 10,000 are read; remove what is not measured")
    return replace(listing, load=lambda names, most: _call_library(path, lambda: list(listing.load(names, most))))


def table_rows(path: Path, kind: str) -> list[tuple[str, tuple[Any, ...]]]:
    """Read the rows, with places, of a workbook (its sheet ``kind``) or Parquet; of ``.mat`` one mapping."""
    return child.read_rows_in_child(path, kind) if child.apart() else rows_here(path, kind)


def rows_here(path: Path, kind: str) -> list[tuple[str, tuple[Any, ...]]]:
    """Read the rows of :func:`table_rows` in this process."""
    form = {".xlsx": "excel", ".mat": "matlab"}.get(path.suffix.casefold(), "parquet")
    module = import_module(f"tyre.formats.{form}")
    return _call_library(
        path, lambda: module.workbook_rows(path, kind) if form == "excel" else getattr(module, f"{form}_rows")(path)
    )


def read_signals(
    path: str | Path, *, map: ChannelMap | None = None, dbc: Sequence[Path] = (), most: int | None = None
) -> Signals:
    """Read a recording in any format of :data:`FORMATS`, at most so many first samples of each signal.

    With a ``map`` only its columns are read, as it says to read the file; ``dbc`` are databases that decode CAN frames,
    in place of those of the map.
    """
    path = Path(path)
    reading = map.reading if map else Reading()
    listing = contents(path, reading=replace(reading, dbc=tuple(dbc)) if dbc else reading)
    if map is None:
        names = [column.name for column in listing.columns]
    else:
        clock = map.clock and (map.clock.column or map.clock.index)
        mapped = [entry.column for entry in map.channels.values()] + ([clock] if clock else [])
        names = list(dict.fromkeys(find_column(name, listing.columns, where=str(path)) for name in mapped))
    signals = {signal.name: signal for signal in listing.load(names, most)}
    return Signals(str(path), signals, tuple(listing.notes), listing.rates)


def _call_library(path: Path, action: Callable[[], T]) -> T:
    """Do it, turning whatever a library raises of a damaged file into one message."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return action()
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"{path}: {error}") from error
    except MemoryError as error:
        raise InputError(f"{path}: takes more memory than is allowed; map fewer channels or cut the file") from error
    except Exception as error:
        reason = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
        raise InputError(
            f"{path}: cannot be read as {path.suffix.casefold()} ({reason}); is it damaged, cut off, or another format?"
        ) from error


__getattr__, __dir__ = room(
    __name__,
    {
        "channel_map": ("ChannelMap", "Clock", "MappedColumn", "Reading", "Resampling", "Trigger", "Window"),
        "sheet": ("read_sheet", "split_unit"),
        "signals": ("Column", "Signal", "Signals", "find_column"),
    },
)
