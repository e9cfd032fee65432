"""MATLAB files of versions 4 to 7.3: vectors, matrices, structures, tables and timetables."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tyre.channel_map import Reading
from tyre.errors import InputError, hint
from tyre.progress import optional_module
from tyre.signals import Column, Contents, Signal, columns_of, seconds


def matlab_contents(path: Path, reading: Reading) -> Contents:
    """List the channels: ``x``, ``s.field``, ``imu.gyro`` of a timetable, ``m(1)`` of a matrix."""
    matio = optional_module("matio", extra="formats")
    if reading.table:
        known = list(matio.whosmat(str(path)))
        if reading.table not in known:
            raise InputError(
                f"{path}: no variable {reading.table!r}{hint(reading.table, known)}; there are {', '.join(known)}"
            )
    content = matio.load_from_mat(str(path), variable_names=reading.table or None, add_table_attrs=True)
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    found = {signal.name: signal for name, value in variables.items() for signal in _signals(name, value)}

    def load(names: Sequence[str], most: int | None) -> Iterator[Signal]:
        for name in names:
            signal = found[name]
            time = None if signal.time is None else signal.time[:most]
            yield Signal(name, signal.values[:most], signal.unit, time)

    own = bool(found) and all(signal.time is not None for signal in found.values())
    columns = tuple(Column(signal.name, signal.unit) for signal in found.values())
    return Contents(columns, load, own_times=own)


def _signals(name: str, value: Any) -> Iterator[Signal]:
    if hasattr(value, "columns"):
        yield from _columns_of_frame(name, value)
    elif getattr(value, "dtype", None) is not None and value.dtype.names:
        entries = value.reshape(-1)
        for place, entry in enumerate(entries, 1):
            outer = name if len(entries) == 1 else f"{name}({place})"
            for field in value.dtype.names:
                yield from _signals(f"{outer}.{field}", entry[field])
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
