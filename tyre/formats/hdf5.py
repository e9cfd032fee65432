"""HDF5 files: every dataset of numbers, with the unit in its attributes."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.signals import Column, Contents, Signal, check_budget, columns_of
from tyre.ground.errors import InputError, shown
from tyre.ground.files import DEEPEST
from tyre.ground.progress import optional_module

_UNITS = ("unit", "units", "Unit", "Units", "UNIT", "UNITS")


def hdf5_contents(path: Path, reading: Reading) -> Contents:
    """Datasets of numbers by their path: ``imu/gyro``, ``imu/gyro[0]`` of a matrix, ``imu.x`` of a compound."""
    h5py = optional_module("h5py", extra="formats")
    with h5py.File(path, "r") as file:
        refuse_foreign(h5py, path, file)
        if reading.table and file.get(reading.table) is None:  # not there, or a link to what is not there
            raise InputError(f"{path}: no group {reading.table!r}; there are {', '.join(file)}")
        columns = {
            signal.name: (name, signal.unit)
            for name, dataset in _datasets(h5py, file, reading.table)
            for signal in _signals(name, _zero_sample(dataset), _unit(dataset))
        }

    def load(names: Sequence[str], most: int | None) -> Iterator[Signal]:
        loaded: dict[str, dict[str, Signal]] = {}
        with h5py.File(path, "r") as file:
            check_budget(path, [file[home].size for home in {columns[name][0] for name in names}])
            for name in names:
                home, unit = columns[name]
                if home not in loaded:
                    loaded[home] = {signal.name: signal for signal in _signals(home, file[home][()], unit)}
                signal = loaded[home][name]
                yield Signal(name, signal.values[:most], signal.unit)

    return Contents(tuple(Column(name, unit) for name, (_, unit) in columns.items()), load)


def refuse_foreign(h5py: Any, path: Path, file: Any) -> None:
    """Refuse links and datasets that lead to other files, which the one at ``path`` may name as it likes.

    All links of the file are looked at before one is followed: a soft link cannot leave a file that holds no others.
    """

    def name_foreign(name: str, link: Any) -> str | None:
        return f"{name} (to {shown(link.filename)})" if isinstance(link, h5py.ExternalLink) else None

    if foreign := file.visititems_links(name_foreign):  # stops at the first that has a name
        raise InputError(f"{path}: {foreign} is a link to another file, which is not read; copy what it names into one")

    def check(name: str, item: Any) -> None:
        if name.count("/") > DEEPEST:  # to go through them takes the square of their number
            raise InputError(f"{path}: groups lie in groups, more than {DEEPEST} deep; copy what is measured higher")
        if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise InputError(f"{path}: {name} has its values in other files, which are not read; copy them into one")
        if isinstance(item, h5py.Dataset):
            check_budget(path, [math.prod(item.chunks or ())])  # a chunk is unpacked whole

    file.visititems(check)


def _datasets(h5py: Any, file: Any, root: str) -> list[tuple[str, Any]]:
    datasets: list[tuple[str, Any]] = []

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.shape is not None:
            datasets.append((f"{root}/{name}" if root and name else name or root, item))

    start = file[root] if root else file
    if isinstance(start, h5py.Dataset):
        note("", start)
    else:
        start.visititems(note)
    return datasets


def _zero_sample(dataset: Any) -> Any:
    """Zeros of the type and proportions of a dataset, but only as many as show its columns."""
    width = min(dataset.shape) if len(dataset.shape) > 1 else 1
    zeros = np.broadcast_to(np.zeros((), dataset.dtype), dataset.shape)
    return np.asarray(zeros[tuple(slice(2 * min(width, 10_000)) for _ in dataset.shape)])


def _signals(name: str, values: Any, unit: str) -> Iterator[Signal]:
    if values.dtype.names:
        for field in values.dtype.names:
            yield from columns_of(f"{name}.{field}", values[field], unit)
    else:
        yield from columns_of(name, values, unit)


def _unit(dataset: Any) -> str:
    for key in _UNITS:
        if key in dataset.attrs:
            unit = dataset.attrs[key]
            unit = unit.reshape(-1)[0] if isinstance(unit, np.ndarray) and unit.size else unit
            return unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
    return ""
