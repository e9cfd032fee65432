"""MATLAB files of versions 4 to 7.3: vectors, matrices, structures, tables and timetables."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.hdf5 import refuse_foreign
from tyre.formats.signals import Column, Contents, Signal, check_budget, columns_of, seconds
from tyre.ground.errors import InputError, hint
from tyre.ground.progress import optional_module

NAMES, UNITS = ("name", "names", "channel", "channels"), ("unit", "units")
"""Fields of a structure that say what the variables beside it are called and measured in."""


def matlab_contents(path: Path, reading: Reading) -> Contents:
    """List the channels: ``x``, ``s.field``, ``imu.gyro`` of a timetable, ``m(1)`` of a matrix."""
    matio = optional_module("matio", extra="formats")
    h5py = optional_module("h5py", extra="formats")
    if h5py.is_hdf5(path):  # version 7.3
        with h5py.File(path, "r") as file:
            refuse_foreign(h5py, path, file)
    shapes = matio.whosmat(str(path))
    check_budget(path, [math.prod(shape or ()) for name, (shape, _) in shapes.items() if reading.table in ("", name)])
    if reading.table and reading.table not in shapes:
        raise InputError(
            f"{path}: no variable {reading.table!r}{hint(reading.table, shapes)}; there are {', '.join(shapes)}"
        )
    content = matio.load_from_mat(str(path), variable_names=reading.table or None, add_table_attrs=True)
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    signals = {signal.name: signal for name, value in variables.items() for signal in _signals(name, value)}
    units = {name: unit for value in variables.values() for name, unit in _listed_units(value)}
    signals |= {name: replace(signals[name], unit=unit) for name, unit in units.items() if name in signals and unit}

    def load(names: Sequence[str], most: int | None) -> Iterator[Signal]:
        for name in names:
            signal = signals[name]
            time = None if signal.time is None else signal.time[:most]
            yield Signal(name, signal.values[:most], signal.unit, time)

    own_times = bool(signals) and all(signal.time is not None for signal in signals.values())
    columns = tuple(Column(signal.name, signal.unit) for signal in signals.values())
    return Contents(columns, load, own_times=own_times)


def matlab_rows(path: Path) -> list[tuple[str, tuple[Any, ...]]]:
    """Read the variables of a file as one mapping: structures as mappings, arrays as flat lists."""
    from scipy.io import loadmat, whosmat

    try:
        check_budget(path, [math.prod(shape) for _, shape, _ in whosmat(path)])
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError as error:  # version 7.3 is HDF5
        raise InputError(f"{path}: saved as version 7.3; save it with -v7") from error
    return [("", ({key: _unwrap(value) for key, value in content.items() if not key.startswith("__")},))]


def _unwrap(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _unwrap(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_unwrap(entry) for entry in value]
    if isinstance(value, np.ndarray):  # what was measured may lie beside the coefficients
        return np.ravel(value).tolist() if value.size <= 1000 else f"{value.size} numbers"
    return getattr(value, "item", lambda: value)()


def _listed_units(value: Any) -> Iterator[tuple[str, str]]:
    """Names and units that stand side by side in a structure (``channel.name``, ``channel.units``)."""
    fields = getattr(getattr(value, "dtype", None), "names", None) or ()
    name, unit = (next((field for field in fields if field.casefold() in words), "") for words in (NAMES, UNITS))
    if not (name and unit):
        return
    for entry in value.reshape(-1):
        names, units = _texts(entry[name]), _texts(entry[unit])
        yield from zip(names, units, strict=True) if len(names) == len(units) else ()


def _texts(value: Any) -> list[str]:
    """Texts of a cell array or of one text."""
    if isinstance(value, str):
        return [value.strip()]
    if getattr(value, "dtype", None) is None or value.dtype.kind not in "OU":
        return []
    return [text for entry in value.reshape(-1) for text in _texts(entry)]


def _signals(name: str, value: Any) -> Iterator[Signal]:
    if hasattr(value, "columns"):
        yield from _columns_of_frame(name, value)
    elif getattr(value, "dtype", None) is not None and value.dtype.names:
        entries = value.reshape(-1)
        for place, entry in enumerate(entries, 1):
            outer = name if len(entries) == 1 else f"{name}({place})"
            unit = next((_texts(entry[field]) for field in value.dtype.names if field.casefold() in UNITS), [])
            for field in value.dtype.names:
                for signal in _signals(f"{outer}.{field}", entry[field]):
                    yield replace(signal, unit=unit[0]) if len(unit) == 1 and not signal.unit else signal
    elif getattr(value, "dtype", None) is not None and value.dtype.kind == "m":
        yield Signal(name, seconds(value.reshape(-1)), "s")
    else:
        yield from columns_of(name, value, base=1)


def _columns_of_frame(name: str, frame: Any) -> Iterator[Signal]:
    """Columns of a table with numbers, with its times if its rows have some."""
    time = seconds(frame.index.to_numpy()) if frame.index.dtype.kind in "mM" else None
    units = [str(unit) for unit in frame.attrs.get("varUnits", [])]
    units = units if len(units) == frame.shape[1] else [""] * frame.shape[1]
    for column, unit in zip(frame.columns, units, strict=True):
        values = frame[column].to_numpy()
        if values.dtype.kind in "mM":
            yield Signal(f"{name}.{column}", seconds(values), "s" if values.dtype.kind == "m" else "datetime", time)
        elif values.dtype.kind in "fiub":
            yield Signal(f"{name}.{column}", values.astype(float), unit, time)
