"""Parquet files, batch by batch, only the columns that are wanted; or a whole table with its words."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.csv import names_and_units
from tyre.formats.signals import Column, Contents, Signal, check_budget
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import LARGEST
from tyre.ground.progress import optional_module


def parquet_contents(path: Path, reading: Reading) -> Contents:
    """List the columns with numbers or times."""
    parquet = optional_module("pyarrow.parquet", extra="formats")
    with parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
    columns: dict[str, tuple[str, str]] = {}  # name in the file and unit
    for field in schema:
        if _is_channel(field.type):
            metadata = {key.decode().casefold(): text.decode() for key, text in (field.metadata or {}).items()}
            ((name, unit),) = names_and_units([field.name])
            dated = "datetime" if "timestamp" in str(field.type) else "s" if "duration" in str(field.type) else ""
            columns[name] = field.name, dated or metadata.get("unit") or metadata.get("units") or unit

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        arrays = _read(path, [columns[name][0] for name in names], most)
        return [Signal(name, x, columns[name][1]) for name, x in zip(names, arrays, strict=True)]

    return Contents(tuple(Column(name, unit) for name, (_, unit) in columns.items()), load)


def parquet_rows(path: Path) -> list[tuple[str, tuple[Any, ...]]]:
    """Names of the columns and then all rows, each with its place; empty text for what is missing."""
    parquet = optional_module("pyarrow.parquet", extra="formats")
    metadata = parquet.read_metadata(path)
    if (cells := metadata.num_rows * metadata.num_columns) > LARGEST:
        raise InputError(f"{path}: holds {cells:,} cells, at most {LARGEST:,} are read of a table")
    frame = parquet.read_table(path).to_pandas()
    if frame.index.name is not None:
        frame = frame.reset_index()
    rows = [("header", tuple(map(str, frame.columns)))]
    for number, row in enumerate(frame.itertuples(index=False), 1):
        cells = ("" if cell is None or (isinstance(cell, float) and math.isnan(cell)) else cell for cell in row)
        rows.append((f"row {number}", tuple(cell.strip() if isinstance(cell, str) else cell for cell in cells)))
    return rows


def _is_channel(kind: Any) -> bool:
    from pyarrow import types

    return bool(
        types.is_integer(kind)
        or types.is_floating(kind)
        or types.is_decimal(kind)
        or types.is_timestamp(kind)
        or types.is_duration(kind)
        or types.is_boolean(kind)
    )


def _read(path: Path, names: list[str], most: int | None) -> list[Array]:
    parquet = optional_module("pyarrow.parquet", extra="formats")
    with parquet.ParquetFile(path, page_checksum_verification=True, pre_buffer=False) as file:
        rows = file.metadata.num_rows if most is None else min(most, file.metadata.num_rows)
        check_budget(path, [rows] * len(names))
        columns = [np.empty(rows) for _ in names]
        starts: list[int | None] = [None] * len(names)
        rows_read = 0
        for batch in file.iter_batches(1 << 16, columns=names, use_threads=False):
            count = min(batch.num_rows, rows - rows_read)
            for place, name in enumerate(names):
                values = batch.column(name)
                if starts[place] is None and "timestamp" in str(values.type):
                    starts[place] = _ticks(values)[0]
                columns[place][rows_read : rows_read + count] = _numbers(values, starts[place])[:count]
            rows_read += count
            if rows_read == rows:
                break
    if rows_read != rows:
        raise ValueError(f"{rows_read} rows where {rows} are announced")
    return columns


def _numbers(values: Any, start: int | None) -> Array:
    import pyarrow as pa

    if pa.types.is_timestamp(values.type) or pa.types.is_duration(values.type):
        per_second = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[values.type.unit]
        seconds = (_ticks(values) - (start or 0)) / per_second
        seconds[np.asarray(values.is_null())] = np.nan
        return np.asarray(seconds, float)
    return np.asarray(values.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False), float)


def _ticks(values: Any) -> Any:
    import pyarrow as pa

    return values.cast(pa.int64()).fill_null(0).to_numpy(zero_copy_only=False)
