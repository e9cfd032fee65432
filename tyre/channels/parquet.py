"""Parquet files, batch by batch, only the columns that are wanted."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.optional import optional_module
from tyre.base.progress import progress_bar
from tyre.channels.csv_header import named
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal

BATCH = 1 << 16  # rows
LARGE = 1 << 23  # samples; more show how far they are read


def parquet_contents(path: Path, reading: Reading) -> Contents:
    """Columns with numbers or times of a Parquet file.

    Parameters
    ----------
    path : Path
    reading : Reading
        Holds nothing for this format.
    """
    parquet = optional_module("pyarrow.parquet", extra="formats")
    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
    columns, places = [], {}
    for field in schema:
        if not _is_channel(field.type):
            continue
        metadata = {key.decode().casefold(): text.decode() for key, text in (field.metadata or {}).items()}
        ((name, unit),) = named([field.name])
        dated = "datetime" if "timestamp" in str(field.type) else "s" if "duration" in str(field.type) else ""
        unit = dated or metadata.get("unit") or metadata.get("units") or unit
        columns.append(Column(name, unit))
        places[name] = field.name

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        units = {column.name: column.unit for column in columns}
        arrays = _read(path, [places[name] for name in names], most)
        return [Signal(name, x, units[name]) for name, x in zip(names, arrays, strict=True)]

    return Contents(str(path), tuple(columns), load)


def _is_channel(kind: Any) -> bool:
    from pyarrow import types

    return bool(
        types.is_integer(kind) or types.is_floating(kind) or types.is_decimal(kind) or types.is_timestamp(kind)
        or types.is_duration(kind) or types.is_boolean(kind)
    )  # fmt: skip


def _read(path: Path, names: list[str], most: int | None) -> list[Array]:
    parquet = optional_module("pyarrow.parquet", extra="formats")
    with parquet.ParquetFile(path, page_checksum_verification=True, pre_buffer=False) as file:
        rows = file.metadata.num_rows if most is None else min(most, file.metadata.num_rows)
        found = [np.empty(rows) for _ in names]
        starts: list[int | None] = [None] * len(names)
        done = 0
        with progress_bar(total=rows, desc=path.name, unit="row", show=rows * len(names) > LARGE) as bar:
            for batch in file.iter_batches(BATCH, columns=names, use_threads=False):
                count = min(batch.num_rows, rows - done)
                for place, name in enumerate(names):
                    values = batch.column(name)
                    if starts[place] is None and "timestamp" in str(values.type):
                        starts[place] = _ticks(values)[0]
                    found[place][done : done + count] = _numbers(values, starts[place])[:count]
                done += count
                bar.update(count)
                if done == rows:
                    break
    if done != rows:
        raise ValueError(f"{done} rows where {rows} are announced")
    return found


def _numbers(values: Any, start: int | None) -> Array:
    import pyarrow as pa

    if pa.types.is_timestamp(values.type) or pa.types.is_duration(values.type):
        per_second = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[values.type.unit]
        ticks = _ticks(values) - (start or 0)
        seconds = ticks / per_second
        seconds[np.asarray(values.is_null())] = np.nan
        return np.asarray(seconds, float)
    return np.asarray(values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), float)


def _ticks(values: Any) -> Any:
    import pyarrow as pa

    return values.cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False)
