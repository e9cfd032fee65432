"""Signals as a file holds them: each channel with its name, its unit as written, and its own time base."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, hint


@dataclass(frozen=True)
class Column:
    """A channel that a file lists: its ``name``, its ``unit`` as written (empty if the file says none)."""

    name: str
    unit: str = ""

    @property
    def spellings(self) -> tuple[str, ...]:
        """Other ways to name it: with its unit in brackets, and without its groups."""
        short = self.name
        for separator in "./\\":
            short = short.rpartition(separator)[2] or short
        names = (self.name, short)
        with_units = (f"{name} {left}{self.unit}{right}" for name in names for left, right in ("[]", "()"))
        return tuple(dict.fromkeys((*names, *with_units)))


@dataclass(frozen=True, eq=False)
class Signal:
    """One channel of a file: ``values`` (n,) in ``unit``, NaN if missing; ``time`` (s) if it has its own time base."""

    name: str  # of its column in the file
    values: Array
    unit: str = ""
    time: Array | None = None


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals of one file by name, and notes on lines passed over or an encoding that was taken."""

    source: str  # path, for messages
    signals: Mapping[str, Signal]  # by the whole name of the column
    notes: tuple[str, ...] = ()  # a line each, for the reader
    rates: tuple[float, ...] = ()  # Hz, rates of sampling that the header states

    def __getitem__(self, name: str) -> Signal:
        """Give the signal called ``name``, by its whole name or by any spelling that only one signal has."""
        return self.signals[self.find(name)]

    def find(self, name: str) -> str:
        """Find the whole name of a signal, see :func:`find_column`."""
        return find_column(name, self.columns, where=self.source)

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Names and units of all signals."""
        return tuple(Column(signal.name, signal.unit) for signal in self.signals.values())


BUDGET = 100_000_000
"""Numbers that are read of one recording at once: 0.8 GB."""


def check_budget(path: Path, samples: Iterable[int], most: int | None = None) -> None:
    """Refuse a recording whose channels of so many ``samples`` hold more numbers than memory, before they are read.

    No packing makes what was measured so small that a byte holds 20 numbers.
    """
    sizes = [size if most is None else min(size, most) for size in samples]
    allowed = min(BUDGET, 1_000_000 + 20 * path.stat().st_size)
    if sum(sizes) > allowed or len(sizes) > 10_000:
        raise InputError(
            f"{path}: {len(sizes)} channels of up to {max(sizes):,} samples are {sum(sizes):,} numbers, at most "
            f"{allowed:,} of 10,000 channels are read at once of a file of this size; map fewer or cut the file"
        )


Load = Callable[[Sequence[str], int | None], Iterable[Signal]]


@dataclass(frozen=True, eq=False)
class Contents:
    """Columns that a file lists, and how to load some of them, at most so many first samples of each (None: all)."""

    columns: tuple[Column, ...]  # in the order of the file
    load: Load  # names of columns and most samples -> their signals
    notes: list[str] = field(default_factory=list)  # a line each, for the reader
    own_times: bool = False  # True if the file itself holds the times of its channels
    rates: tuple[float, ...] = ()  # Hz, rates of sampling that the header states


_SEVERAL = "{where}: {name!r} is several columns: {fitting}; give the whole name"
_NONE = "{where}: no column {name!r} that holds numbers; there are {names}{hint}"


def find_column(name: str, columns: Iterable[Column], *, where: str) -> str:
    """Find the whole name of a column that is given whole, without its groups, or with its unit in brackets."""
    columns = tuple(columns)
    plain_name = " ".join(name.split())
    for spelled in (lambda column: column.spellings[:1], lambda column: column.spellings):
        fitting = [c.name for c in columns if plain_name in [" ".join(text.split()) for text in spelled(c)]]
        if len(fitting) > 1:
            raise InputError(_SEVERAL.format(where=where, name=name, fitting=", ".join(fitting)))
        if fitting:
            return fitting[0]
    names = [column.name for column in columns]
    raise InputError(_NONE.format(where=where, name=name, names=join_names(names), hint=hint(name, names)))


def join_names(names: Sequence[str], *, most: int = 40) -> str:
    """Join names in one line, cut if they are more than ``most``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more if names else "none"


def columns_of(name: str, values: Any, unit: str = "", *, base: int = 0) -> Iterator[Signal]:
    """Give the channels of a vector or a matrix, whose longer side are the samples; none of text or a single number."""
    values = np.asarray(values)
    if values.dtype.kind not in "fiub" or values.ndim == 0 or values.size < 2:
        return
    values = values.reshape(-1) if max(values.shape) == values.size else values
    if values.ndim == 1:
        yield Signal(name, values.astype(float), unit)
    elif values.ndim == 2:
        for place, column in enumerate(values.T if values.shape[0] >= values.shape[1] else values):
            yield Signal(f"{name}({place + 1})" if base else f"{name}[{place}]", column.astype(float), unit)


def seconds(stamps: Any) -> Array:
    """Convert numpy's durations to s, or dates to s since the first one."""
    if stamps.dtype.kind == "M" and stamps.size:
        stamps = stamps - stamps[0]
    values = stamps.astype("timedelta64[ns]").astype(np.int64) / 1e9
    values[np.isnat(stamps)] = np.nan
    return np.asarray(values, float)
