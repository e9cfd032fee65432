"""TDMS files of LabVIEW: channels with their properties of unit and time step."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.channel_map import Reading
from tyre.formats.signals import Column, Contents, Signal, check_budget, seconds
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.progress import optional_module


def tdms_contents(path: Path, reading: Reading) -> Contents:
    """Channels as ``group/channel``; those with a time step (``wf_increment``) have their own times."""
    nptdms = optional_module("nptdms", extra="tdms")
    log = optional_module("nptdms.log", extra="tdms").log_manager
    log.set_level(logging.CRITICAL)  # what it says of damage becomes a note or an error of ours
    with nptdms.TdmsFile.open(path) as file:
        groups = [group.name for group in file.groups()]
        if reading.table and reading.table not in groups:
            raise InputError(f"{path}: no group {reading.table!r}; there are {', '.join(groups)}")
        listed = [
            (f"{group.name}/{channel.name}", group.name, channel.name, _unit(channel), _timed(channel))
            for group in file.groups()
            if reading.table in ("", group.name)
            for channel in group.channels()
            if channel.dtype.kind in "fiubmM" and len(channel)
        ]
        cut = getattr(status := getattr(file, "file_status", None), "incomplete_final_segment", False)
        ends = (getattr(status, "channel_statuses", None) or {}).values()
        if not cut and any(end.read_length < end.expected_length for end in ends):
            raise InputError(f"{path}: its channels announce more samples than it holds; is it damaged?")
        notes = ["the last segment is incomplete: the recording was cut off"] if cut else []
    homes = {name: (group, channel, unit) for name, group, channel, unit, _ in listed}

    def load(names: Sequence[str], most: int | None) -> list[Signal]:
        with nptdms.TdmsFile.open(path) as file:
            check_budget(path, [len(file[homes[name][0]][homes[name][1]]) for name in names], most)
            return [_signal(file, name, *homes[name], most) for name in names]

    own_times = bool(listed) and all(timed for *_, timed in listed)
    return Contents(tuple(Column(name, unit) for name, _, _, unit, _ in listed), load, notes, own_times)


def _signal(file: Any, name: str, group: str, short: str, unit: str, most: int | None) -> Signal:
    channel = file[group][short]
    values = channel[:] if most is None else channel[:most]
    if values.dtype.kind in "mM":
        return Signal(name, seconds(values), unit)
    time: Array | None = None
    if _timed(channel):
        first = float(channel.properties.get("wf_start_offset", 0.0))
        steps = np.arange(len(values), dtype=float)
        time = first + steps * float(channel.properties["wf_increment"])
    return Signal(name, values.astype(float), unit, time)


def _unit(channel: Any) -> str:
    if channel.dtype.kind in "mM":
        return "datetime" if channel.dtype.kind == "M" else "s"
    return str(
        next((channel.properties[key] for key in ("unit_string", "unit", "Unit") if key in channel.properties), "")
    )


def _timed(channel: Any) -> bool:
    return float(channel.properties.get("wf_increment", 0.0) or 0.0) > 0.0
