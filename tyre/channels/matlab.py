"""MATLAB files of versions 4 to 7.3: vectors, matrices, structures, tables and timetables."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError, hint
from tyre.base.optional import optional_module
from tyre.channels.arrays import columns_of, columns_of_frame
from tyre.channels.reading import Reading
from tyre.channels.signals import Column, Contents, Signal


def matlab_contents(path: Path, reading: Reading) -> Contents:
    """Everything in the file that is a channel: ``x``, ``s.field``, ``imu.gyro`` of a timetable, ``m(1)`` of a matrix.

    Parameters
    ----------
    path : Path
    reading : Reading
        ``table``: the only variable to be read.

    Raises
    ------
    InputError
        No such variable.
    """
    matio = optional_module("matio", extra="formats")
    if reading.table:
        known = list(matio.whosmat(str(path)))
        if reading.table not in known:
            raise InputError(
                f"{path}: no variable {reading.table!r}{hint(reading.table, known)}; there are {', '.join(known)}"
            )
    content = matio.load_from_mat(str(path), variable_names=reading.table or None, add_table_attrs=True)
    found = {
        signal.name: signal
        for name, value in content.items() if not name.startswith("__") for signal in _signals(name, value)
    }  # fmt: skip

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        return [_first(found[name], most) for name in names]

    own = bool(found) and all(signal.time is not None for signal in found.values())
    columns = tuple(Column(signal.name, signal.unit) for signal in found.values())
    return Contents(str(path), columns, load, own_times=own)


def _signals(name: str, value: Any) -> Iterator[Signal]:
    if hasattr(value, "columns"):
        units = [str(unit) for unit in value.attrs.get("varUnits", [])]
        yield from columns_of_frame(name, value, units)
    elif getattr(value, "dtype", None) is not None and value.dtype.names:
        entries = value.reshape(-1)
        for place, entry in enumerate(entries, 1):
            outer = name if len(entries) == 1 else f"{name}({place})"
            for field in value.dtype.names:
                yield from _signals(f"{outer}.{field}", entry[field])
    elif getattr(value, "dtype", None) is not None and value.dtype.kind == "m":
        from tyre.channels.arrays import seconds

        yield Signal(name, seconds(value.reshape(-1)), "s")
    else:
        yield from columns_of(name, value, base=1)


def _first(signal: Signal, most: int | None) -> Signal:
    time = None if signal.time is None else signal.time[:most]
    return Signal(signal.name, signal.values[:most], signal.unit, time)
