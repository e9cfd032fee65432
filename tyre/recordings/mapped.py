"""Recordings of a rig in a laboratory's own columns: which file, which channels, one recording an event."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.read import FORMATS
from tyre.channels.record import Record, read_records
from tyre.recordings.sidecar import Sidecar, read_sidecar

QUANTITIES = {
    "slip_angle": "angle",
    "side_force": "force",
    "vertical_load": "force",
    "aligning_moment": "moment",
    "inclination": "angle",
    "speed": "speed",
    "temperature": "temperature",
    "plate_displacement": "length",
    "rim_displacement": "length",
}
"""Channels of a rig beside ``time``, and what each measures."""


def recording_of(sidecar: Path) -> Path:
    """The file that a sidecar describes: the one it names, else that of its stem.

    Parameters
    ----------
    sidecar : Path
        ``.toml``.

    Raises
    ------
    InputError
        Several files of its stem; a sidecar that cannot be read.
    """
    named = read_sidecar(sidecar).recording if sidecar.is_file() else ""
    if named:
        return sidecar.parent / named
    there = [path for path in sorted(sidecar.parent.glob(f"{_plain(sidecar.stem)}.*"))
             if path.stem == sidecar.stem and path.suffix.casefold() in FORMATS]  # fmt: skip
    if len(there) > 1:
        names = ", ".join(path.name for path in there)
        raise InputError(f"{sidecar}: describes {names}; write recording = {there[0].name!r} or rename the others")
    return there[0] if there else sidecar.with_suffix(".csv")


def _plain(stem: str) -> str:
    """A stem whose signs mean themselves where files are searched."""
    return "".join(f"[{sign}]" if sign in "*?[" else sign for sign in stem)


def sidecar_of(path: Path) -> Sidecar | None:
    """The sidecar beside a recording at ``path``; None where there is none."""
    beside = path.with_suffix(".toml")
    return read_sidecar(beside) if beside.is_file() else None


def mapped_records(path: Path, sidecar: Sidecar, channel_map: ChannelMap | None) -> tuple[Record, ...]:
    """Channels in SI units, in the axes of the file, one record an event.

    Parameters
    ----------
    path : Path
        The recording.
    sidecar : Sidecar
        Its own channel map is taken first.
    channel_map : ChannelMap, optional
        Taken where the sidecar has none.

    Raises
    ------
    InputError
        As :func:`tyre.channels.record.read_records`.
    """
    chosen = sidecar.channel_map or channel_map or ChannelMap()
    if not chosen.channels and channel_map is not None:
        chosen = replace(channel_map, **_own(chosen))
    pull = "plate_displacement" in chosen.channels  # dial gauges are often read by hand
    return read_records(path, chosen, QUANTITIES, timed=not pull)


def _own(given: ChannelMap) -> dict[str, Any]:
    """Tables of a sidecar without channels, to replace those of the map of the command line."""
    parts = {name: getattr(given, name) for name in ("mountings", "resampling", "windows")}
    parts |= {"reading": given.reading} if given.reading != ChannelMap().reading else {}
    return {name: part for name, part in parts.items() if part}


def one(events: Sequence[Record], path: Path) -> Record:
    """The only one of some ``events`` of the file at ``path``.

    Raises
    ------
    InputError
        Several.
    """
    if len(events) > 1:
        names = ", ".join(record.event for record in events)
        raise InputError(f"{path}: holds the events {names}; one recording is needed here: keep one window")
    return events[0]
