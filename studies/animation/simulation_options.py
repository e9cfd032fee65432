"""What ``velotyre simulate`` reads from its options: initial states and inputs over time."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bicycle.responses.inputs import InputHistory, doublet, pulse, step
from bicycle.responses.response import column
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError, unknown
from tyre.channels.channel_map import ChannelMap
from tyre.channels.draft import draft_words, refuse_unmapped
from tyre.channels.record import read_records
from tyre.channels.units import SI

SHAPES: Mapping[str, tuple[Callable[..., InputHistory], bool]] = {
    "step": (step, False), "pulse": (pulse, True), "doublet": (doublet, True),
}  # fmt: skip
_QUANTITY = {unit: quantity for quantity, unit in SI.items()}
FILES = {"file": True, "steps": False}
"""Shapes that are read from a file: whether values are joined by straight lines; else each holds to the next."""
HOW = (
    "write NAME:step:SIZE[@START], NAME:pulse:SIZE@START+DURATION, NAME:doublet:SIZE@START+DURATION, "
    "NAME:file:FILE.csv (samples, straight lines between them) or NAME:steps:FILE.csv (each value holds to the next), "
    "in SI units and seconds, for example steer_torque:step:0.5@1.0"
)


def parse_initial(text: str) -> dict[str, float]:
    """State -> value (SI) from a ``text`` like ``lean=0.02,steer_rate=0.1``.

    Raises
    ------
    InputError
        Text of another form, or a state given twice.
    """
    values: dict[str, float] = {}
    for part in filter(None, text.split(",")):
        name, _, number = (piece.strip() for piece in part.partition("="))
        if name in values:
            raise InputError(f"initial {text!r}: {name} is given twice")
        try:
            values[name] = float(number)
        except ValueError:
            raise InputError(f"initial {text!r}: write STATE=NUMBER,... such as lean=0.02,steer_rate=0.1") from None
    return values


def parse_inputs(
    texts: Sequence[str], *, allowed: Mapping[str, str], channel_map: ChannelMap | None = None
) -> dict[str, InputHistory]:
    """Input -> history from ``texts`` like ``steer_torque:step:0.5@1.0``; see :data:`HOW`.

    ``allowed`` are the inputs of the model and their SI units; ``channel_map`` tells the columns of files.

    Raises
    ------
    InputError
        Text of another form, an unknown input or shape, an input given twice, or a file without the columns.
    """
    inputs: dict[str, InputHistory] = {}
    for text in texts:
        name, _, rest = text.partition(":")
        shape, _, value = rest.partition(":")
        if name not in allowed:
            raise InputError(f"input {text!r}: {unknown('input', name, allowed)}")
        if name in inputs:
            raise InputError(f"input {text!r}: {name} is given twice")
        if not value:
            raise InputError(f"input {text!r}: {HOW}")
        if shape in FILES:
            read = read_history(Path(value), name, allowed[name], channel_map)
            inputs[name] = replace(read, linear=FILES[shape])
        elif shape in SHAPES:
            inputs[name] = _shaped(text, shape, value)
        else:
            raise InputError(f"input {text!r}: {unknown('shape', shape, [*SHAPES, *FILES])}; {HOW}")
    return inputs


def check_within(inputs: Mapping[str, InputHistory], duration: float) -> None:
    """Refuse an input that starts outside the simulated time, 0 to ``duration`` (s).

    Raises
    ------
    InputError
        An input that starts before 0, or at or after ``duration``.
    """
    for name, history in inputs.items():
        if not 0 <= history.time[0] < duration:
            raise InputError(
                f"input {name} starts at {history.time[0]:g} s, outside the simulated time 0 .. {duration:g} s; "
                "move its start or take another --duration"
            )


def read_history(path: Path, name: str, unit: str, channel_map: ChannelMap | None = None) -> InputHistory:
    """The input ``name`` in ``unit`` from a CSV ``path`` with ``time_s`` and a column ``steer_torque_N_m``, say.

    With a ``channel_map`` that names it, from any columns, units and formats.

    Raises
    ------
    InputError
        A file without the columns, an input that lacks samples, several events.
    """
    if channel_map is not None:
        return _mapped_history(path, name, unit, channel_map)
    if path.suffix.casefold() not in ("", ".csv"):
        refuse_unmapped(path, {name: _QUANTITY[unit]})
    wanted = ("time_s", column(name, unit))
    try:
        numbers = read_columns(path, numbers=wanted, needed=wanted, others=True).numbers
    except InputError as error:
        words = "" if f"{path}, line" in str(error) else draft_words(path, {name: _QUANTITY[unit]})
        raise InputError(f"{error}; or give a channel map: {words}" if words else str(error)) from error
    try:
        return InputHistory(numbers["time_s"], numbers[wanted[1]])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _mapped_history(path: Path, name: str, unit: str, channel_map: ChannelMap) -> InputHistory:
    if name not in channel_map.channels:
        there = ", ".join(channel_map.channels)
        raise InputError(f"{path}: the channel map names no {name} (it names {there or 'nothing'}); add its column")
    found = read_records(path, channel_map.only([name]), {name: _QUANTITY[unit]})
    if len(found) > 1:
        raise InputError(f"{path}: holds the events {', '.join(record.event for record in found)}; keep one window")
    values = found[0].values[name]
    if not np.isfinite(values).all():
        raise InputError(f"{path}: {name} is missing in {np.count_nonzero(~np.isfinite(values))} samples; repair them")
    return InputHistory(found[0].time, values)


def _shaped(text: str, shape: str, value: str) -> InputHistory:
    make, lasts = SHAPES[shape]
    size, _, when = value.partition("@")
    start, _, duration = when.partition("+")
    try:
        numbers = [float(size), float(start or 0.0), *([float(duration)] if duration else [])]
    except ValueError:
        raise InputError(f"input {text!r}: {HOW}") from None
    if lasts != (len(numbers) == 3) or not np.isfinite(numbers).all():
        raise InputError(f"input {text!r}: {HOW}")
    timing = {"start": numbers[1], **({"duration": numbers[2]} if lasts else {})}
    try:
        return make(numbers[0], **timing)
    except InputError as error:
        raise InputError(f"input {text!r}: {error}") from error
