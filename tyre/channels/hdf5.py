"""HDF5 files: every dataset of numbers, with the unit in its attributes."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.errors import InputError
from tyre.base.optional import optional_module
from tyre.channels.arrays import columns_of
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal

_UNITS = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")


def hdf5_contents(path: Path, reading: Reading) -> Contents:
    """Datasets of numbers by their path: ``imu/gyro``, ``imu/gyro[0]`` of a matrix, ``imu.x`` of a compound.

    Parameters
    ----------
    path : Path
    reading : Reading
        ``table``: the only group or dataset to be read.

    Raises
    ------
    InputError
        No such group.
    """
    h5py = optional_module("h5py", extra="formats")
    with h5py.File(path, "r") as file:
        if reading.table and reading.table not in file:
            raise InputError(f"{path}: no group {reading.table!r}; there are {', '.join(file)}")
        columns = {
            column.name: (name, unit)
            for name, dataset in _datasets(h5py, file, reading.table)
            for column, unit in _listed(name, dataset)
        }

    def load(names: Sequence[str], most: int | None) -> Iterator[Signal]:
        kept: dict[str, dict[str, Signal]] = {}
        with h5py.File(path, "r") as file:
            for name in names:
                home, unit = columns[name]
                if home not in kept:
                    kept[home] = {signal.name: signal for signal in _signals(home, file[home], unit)}
                signal = kept[home][name]
                yield Signal(name, signal.values[:most], signal.unit)

    return Contents(str(path), tuple(Column(name, unit) for name, (_, unit) in columns.items()), load)


def _datasets(h5py: Any, file: Any, root: str) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found.append((f"{root}/{name}" if root and name else name or root, item))

    start = file[root] if root else file
    if isinstance(start, h5py.Dataset):
        note("", start)
    else:
        start.visititems(note)
    return found


def _listed(name: str, dataset: Any) -> Iterator[tuple[Column, str]]:
    """Columns of a dataset, told from its shape alone."""
    unit = _unit(dataset)
    if dataset.dtype.names:
        for field in dataset.dtype.names:
            if dataset.dtype[field].kind in "fiub" and dataset.size > 1:
                yield Column(f"{name}.{field}", unit), unit
        return
    if dataset.dtype.kind not in "fiub" or not 1 <= dataset.ndim <= 2 or dataset.size < 2:
        return
    stand_in = np.broadcast_to(np.zeros((), dataset.dtype), dataset.shape)
    width = min(dataset.shape)
    if dataset.ndim == 1 or width == 1:
        yield Column(name, unit), unit
    else:
        yield from (
            (Column(signal.name, unit), unit) for signal in columns_of(name, stand_in[: 2 * width, : 2 * width])
        )


def _signals(name: str, dataset: Any, unit: str) -> Iterator[Signal]:
    values = dataset[()]
    if dataset.dtype.names:
        for field in dataset.dtype.names:
            yield from columns_of(f"{name}.{field}", values[field], unit)
    else:
        yield from columns_of(name, values, unit)


def _unit(dataset: Any) -> str:
    for key in _UNITS:
        if key in dataset.attrs:
            given = dataset.attrs[key]
            given = given.reshape(-1)[0] if isinstance(given, np.ndarray) and given.size else given
            return given.decode("utf-8", "replace") if isinstance(given, bytes) else str(given)
    return ""
