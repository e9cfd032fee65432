"""Measurement data format (ASAM MDF 3 and 4), also not finalised; CAN frames decoded with databases."""

import logging
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, wraps
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.signals import Column, Contents, Signal, check_budget
from tyre.ground.errors import InputError
from tyre.ground.progress import optional_module

LARGEST = 64_000_000  # bytes of a database
_DBC = re.compile(rb"(\xef\xbb\xbf)?(\s|//[^\n]*\n)*(VERSION|NS_|BS_|BU_|BO_|CM_)\b")
_POWERS = re.compile(r"(?:\*\*|\^)\s*(?:(?!\d(?![\d.]))|\d\s*(?:\*\*|\^))")  # but to one digit, or chained
_ARITHMETIC = re.compile(
    r"\s+|[-+*/^()]|X1?\b|(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|(?:a?(?:sin|cos|tan)h?|exp|log10|log|ln|sqrt|abs|inf|nan)\b",
    re.IGNORECASE,
)
_MASTER = (2, 3)  # channel types that are the times of others
_NOT_DECODED = ("CAN_DataFrame", "CAN_RemoteFrame", "CAN_ErrorFrame", "CAN_OverloadFrame", "LIN_Frame")


def mdf_contents(path: Path, reading: Reading) -> Contents:
    """Channels by name, ``group/channel`` where several groups have the name; each has its own times."""
    with _open_table(path, reading) as (mdf, notes):
        places = _places(mdf)
        frames = any(channel.name.startswith(_NOT_DECODED) for channel in _channels(mdf))
    if frames and not places:
        raise InputError(
            f"{path}: holds CAN frames that are not decoded; give their databases, dbc = [...] in [reading]"
        )
    columns = tuple(Column(name, unit) for name, (_, _, unit) in places.items())

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        with _open_table(path, reading) as (mdf, _):
            groups = [mdf.groups[places[name][0]].channel_group for name in names]
            check_budget(path, [2 * int(group.cycles_nr) for group in groups], most)
            return [_signal(path, mdf, name, *places[name], most) for name in names]

    return Contents(columns, load, notes, own_times=True)


@contextmanager
def _open_table(path: Path, reading: Reading) -> Iterator[tuple[Any, list[str]]]:
    asammdf = optional_module("asammdf", extra="can")
    _guard_formulas()
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)  # what it says of damage becomes one error of ours
    notes = []
    with path.open("rb") as file:
        start = file.read(8)
    if start not in (b"MDF     ", b"UnFinMF "):
        raise InputError(f"{path}: no measurement file (it begins with {start!r}); is it damaged or another format?")
    if start == b"UnFinMF ":
        notes.append("the file was not finalised when the logger stopped: read as far as it was written")
    databases = [(_database(file, path), 0) for file in reading.dbc]
    mdf = asammdf.MDF(path)
    try:
        if not reading.dbc:
            yield mdf, notes
            return
        with mdf.extract_bus_logging({"CAN": databases}) as decoded:
            if not any(True for _ in _channels(decoded)):
                raise InputError(f"{path}: {', '.join(map(str, reading.dbc))} decode none of its CAN frames")
            yield decoded, notes
    finally:
        mdf.close()


@cache
def _guard_formulas() -> None:
    """Let the library convert by arithmetic alone: it evaluates formulas of a file as Python, which may do anything.

    Also of times, of what the library reads as it opens a file, and of conversions within conversions.
    """
    for module in ("asammdf.blocks.v4_blocks", "asammdf.blocks.v2_v3_blocks"):
        conversion = import_module(module).ChannelConversion
        conversion.convert = _convert_by_arithmetic(conversion.convert)


def _convert_by_arithmetic(convert: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(convert)
    def guarded(self: Any, *values: Any, **how: Any) -> Any:
        if not _is_arithmetic(formula := _formula(self)):
            raise ValueError(f"the formula {formula[:60]!r} is not evaluated")
        return convert(self, *values, **how)

    return guarded


def _formula(conversion: Any) -> str:
    return str(getattr(conversion, "formula", "") or "")


def _is_arithmetic(formula: str) -> bool:
    """True if a ``formula`` holds numbers, X, operators and functions alone, and no powers that take for ever."""
    brief = len(formula) <= 500 and formula.count("**") + formula.count("^") <= 4
    return brief and not _POWERS.search(formula) and not _ARITHMETIC.sub("", formula)


def _database(file: Path, path: Path) -> Any:
    """Parse a CAN database as what its content is: other types, which may hold code, never reach the library."""
    from asammdf.blocks.utils import load_can_database

    if not file.is_file():
        raise InputError(f"{path}: [reading]: no such database {file}")
    content = file.read_bytes() if file.stat().st_size <= LARGEST else b""
    kind = "dbc" if _DBC.match(content) else "arxml" if b"<AUTOSAR" in content[:4096] and b"<!" not in content else ""
    database = load_can_database(f"database.{kind}", contents=content) if kind else None
    if database is None:
        most = LARGEST // 1_000_000
        raise InputError(f"{path}: [reading]: {file} is no CAN database in text as .dbc or .arxml, of up to {most} MB")
    return database


def _channels(mdf: Any) -> Iterator[Any]:
    for group in mdf.groups:
        yield from group.channels


def _places(mdf: Any) -> dict[str, tuple[int, int, str]]:
    """Name -> group, index and unit of every channel that is no time and no bus frame."""
    listed = []
    for place, group in enumerate(mdf.groups):
        title = getattr(group.channel_group, "acq_name", "") or getattr(group.channel_group, "comment", "")
        for index, channel in enumerate(group.channels):
            frame = channel.name.split(".")[0] in _NOT_DECODED
            if channel.channel_type not in _MASTER and not frame and index != mdf.masters_db.get(place):
                unit = channel.unit or (channel.conversion.unit if channel.conversion else "") or ""
                listed.append((channel.name, title or f"group {place}", place, index, unit.strip()))
    places: dict[str, tuple[int, int, str]] = {}
    names = [name for name, *_ in listed]
    for name, title, place, index, unit in listed:
        whole = name if names.count(name) == 1 else f"{title}/{name}"
        places[whole if whole not in places else f"{title} ({place})/{name}"] = (place, index, unit)
    return places


def _signal(path: Path, mdf: Any, name: str, group: int, index: int, unit: str, most: int | None) -> Signal:
    conversion = mdf.groups[group].channels[index].conversion
    if not _is_arithmetic(formula := _formula(conversion)):
        raise InputError(f"{path}: {name} is converted by the formula {formula[:60]!r}, which is not evaluated")
    signal = mdf.get(group=group, index=index, record_count=most)
    values, announced = signal.samples, int(mdf.groups[group].channel_group.cycles_nr)
    if len(values) != (announced if most is None else min(most, announced)):
        raise InputError(f"{path}: {name} announces {announced} samples and holds {len(values)}; is the file damaged?")
    if values.ndim != 1 or values.dtype.kind not in "fiub":
        raise InputError(f"{path}: {name} holds no plain numbers; map another channel")
    samples = values.astype(float)
    if signal.invalidation_bits is not None:
        samples[np.asarray(signal.invalidation_bits, bool)] = np.nan
    return Signal(name, samples, unit, np.asarray(signal.timestamps, float))
