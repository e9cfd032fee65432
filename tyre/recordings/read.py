"""Recordings in files: CSV with units in its column names plus a TOML sidecar, or TYDEX."""

from pathlib import Path

import numpy as np

from tyre.base.csv_table import read_cells
from tyre.base.csv_text import csv_text
from tyre.base.errors import InputError, nearest
from tyre.base.files import write_text
from tyre.channels.channel_map import ChannelMap
from tyre.channels.draft import draft_words, refuse_unmapped
from tyre.channels.read import FORMATS
from tyre.channels.record import Record
from tyre.recordings.axes import signs
from tyre.recordings.check import check_channels
from tyre.recordings.mapped import QUANTITIES, mapped_records, one, recording_of, sidecar_of
from tyre.recordings.recording import Channel, PullTest, RigRun
from tyre.recordings.sidecar import Sidecar, read_sidecar, write_sidecar
from tyre.recordings.tydex import read_tydex
from tyre.recordings.units import Unit, split_unit

_QUANTITIES = {"time": "time", **QUANTITIES}
_PULL_COLUMNS = ("plate_displacement", "rim_displacement")
_WRITTEN_UNIT = {
    "time": ("s", 1.0),
    "slip_angle": ("deg", np.rad2deg(1.0)),
    "side_force": ("N", 1.0),
    "vertical_load": ("N", 1.0),
    "aligning_moment": ("Nm", 1.0),
    "inclination": ("deg", np.rad2deg(1.0)),
    "speed": ("km_h", 3.6),
    "temperature": ("C", 1.0),
    "plate_displacement": ("mm", 1e3),
    "rim_displacement": ("mm", 1e3),
}
_MISSING = ("", "NaN", "nan", "NAN", "NA", "NOTAVAIL")


def read_recording(path: str | Path) -> RigRun | PullTest:
    """Read one recording.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` file (its sidecar has the same stem and ends in ``.toml``), that sidecar itself, or a TYDEX file
        (``.tdx``). CSV columns carry their unit: ``time_s``, ``slip_angle_deg`` or ``slip_angle_rad``,
        ``side_force_N``, ``vertical_load_N``, and where recorded ``aligning_moment_Nm``, ``inclination_deg``,
        ``speed_km_h``, ``temperature_C``; a pull test has ``side_force_N``, ``plate_displacement_mm``,
        ``rim_displacement_mm`` and perhaps ``time_s``. Commas separate the columns; semicolons with decimal commas
        are understood too. Empty fields, ``NaN`` and ``NOTAVAIL`` are missing samples. With a channel map in its
        sidecar, a file of any format of :mod:`tyre.channels`, in any columns and units.

    Returns
    -------
    RigRun or PullTest
        SI units, adapted SAE axes; ``notes`` names the columns that were not used.

    Raises
    ------
    InputError
        When a file is missing, malformed, in unknown units, or beyond what a rig can measure.
    """
    path = Path(path)
    table = recording_of(path) if path.suffix.casefold() == ".toml" else path
    suffix = table.suffix.casefold()
    if suffix not in FORMATS:
        raise InputError(f"{table}: recordings end in {', '.join(FORMATS)} or .toml (their sidecar), not in {suffix!r}")
    sidecar = _sidecar(path, table)
    if sidecar is not None and sidecar.channel_map is not None:
        return rig_recording(one(mapped_records(table, sidecar, None), table), sidecar, table)
    if suffix == ".tdx":
        return read_tydex(table)
    if suffix != ".csv":
        refuse_unmapped(table, QUANTITIES)
    columns, notes = _read_columns(table)
    return _assemble(columns, sidecar or read_sidecar(table.with_suffix(".toml")), notes, table)


def read_events(path: str | Path, channel_map: ChannelMap | None = None) -> dict[str, RigRun | PullTest]:
    """Read every event of a recording that has a channel map.

    Parameters
    ----------
    path : str or Path
        The recording or its sidecar.
    channel_map : ChannelMap, optional
        Taken where the sidecar has none.

    Returns
    -------
    dict of str to RigRun or PullTest
        By the name of the event, in SI units and adapted SAE axes; the name is empty where there is one.

    Raises
    ------
    InputError
        As :func:`read_recording`; no sidecar.
    """
    path = Path(path)
    table = recording_of(path) if path.suffix.casefold() == ".toml" else path
    sidecar = _sidecar(path, table) or read_sidecar(table.with_suffix(".toml"))
    events = mapped_records(table, sidecar, channel_map)
    names = [record.event for record in events] if len(events) > 1 else [""]
    return {name: rig_recording(record, sidecar, table) for name, record in zip(names, events, strict=True)}


def _sidecar(path: Path, table: Path) -> Sidecar | None:
    return read_sidecar(path) if path is not table and path.is_file() else sidecar_of(table)


def rig_recording(record: Record, sidecar: Sidecar, path: Path) -> RigRun | PullTest:
    """One event of a recording as rig data, checked.

    Parameters
    ----------
    record : Record
        SI units, in the axes of the file.
    sidecar : Sidecar
    path : Path
        What messages call it.

    Raises
    ------
    InputError
        A channel that is lacking, or beyond what a rig can measure.
    """
    time = {"time": record.time} if record.timed else {}
    return _assemble({**time, **record.values}, sidecar, list(record.notes), path)


def write_csv(recording: RigRun | PullTest, path: str | Path) -> None:
    """Write a recording as CSV plus sidecar, in the axes it declares.

    Parameters
    ----------
    recording : RigRun or PullTest
    path : str or Path
        Ends in ``.csv``; the sidecar gets the same stem.

    Raises
    ------
    InputError
        When the path does not end in ``.csv`` or the axes are unknown.
    """
    import pandas as pd

    path = Path(path)
    if path.suffix.casefold() != ".csv":
        raise InputError(f"{path}: a CSV recording must end in .csv")
    turn = _signs_of_columns(recording.axes, where=str(path))
    columns = {}
    for name, (unit, factor) in _WRITTEN_UNIT.items():
        channel = getattr(recording, name, None)
        if channel is not None:
            columns[f"{name}_{unit}"] = channel * (turn.get(name, 1.0) * factor) + 0.0  # no negative zero
    write_text(path, csv_text(pd.DataFrame(columns), number_format="%.12g"))
    write_sidecar(recording, path.with_suffix(".toml"))


def _signs_of_columns(axes: str, *, where: str) -> dict[str, float]:
    convention = signs(axes, where=where)
    return {
        "slip_angle": convention.slip_angle,
        "side_force": convention.lateral,
        "vertical_load": convention.vertical_force,
        "aligning_moment": convention.aligning_moment,
        "inclination": convention.inclination,
        "plate_displacement": convention.lateral,
        "rim_displacement": convention.lateral,
    }


def _assemble(columns: dict[str, Channel], sidecar: Sidecar, notes: list[str], path: Path) -> RigRun | PullTest:
    turn = _signs_of_columns(sidecar.axes, where=str(path))
    pull = any(name in columns for name in _PULL_COLUMNS)
    if sidecar.kind is not None and pull != (sidecar.kind == "pull_test"):
        raise InputError(f"{path}: the sidecar declares kind = {sidecar.kind!r}, the columns are {', '.join(columns)}")
    if pull and sidecar.rigid_rim:
        if "rim_displacement" in columns:
            raise InputError(f"{path}: rigid_rim = true, but rim_displacement is recorded; take one of them out")
        if "plate_displacement" in columns:
            columns = {**columns, "rim_displacement": np.zeros(len(columns["plate_displacement"]))}
    needed = ("side_force", *_PULL_COLUMNS) if pull else ("time", "slip_angle", "side_force", "vertical_load")
    for name in needed:
        if name not in columns:
            found = ", ".join(columns)
            if sidecar.channel_map is not None:
                more = "; or write rigid_rim = true if it cannot move" if name == "rim_displacement" else ""
                raise InputError(f"{path}: [channels] names no {name} (it names {found}); add its column{more}")
            raise InputError(
                f"{path}: column {name}_{_WRITTEN_UNIT[name][0]} is missing (found: {found}){_or_map(path)}"
            )
    load = columns.get("vertical_load")
    if load is not None and turn["vertical_load"] < 0.0 and np.nanmedian(load) > 0.0:
        turn["vertical_load"] = 1.0  # a load cell in SAE axes may well print the load as a positive number
    channels = {name: channel * turn.get(name, 1.0) + 0.0 for name, channel in columns.items()}
    everything = (*sidecar.notes, *(note for note in notes if note not in sidecar.notes))
    recording: RigRun | PullTest
    if pull:
        unused = sorted(set(channels) - {*needed, "time"})
        if unused:
            everything = (*everything, f"columns not used in a pull test: {', '.join(unused)}")
        recording = PullTest(
            condition=sidecar.condition,
            axes=sidecar.axes,
            side_force=channels["side_force"],
            plate_displacement=channels["plate_displacement"],
            rim_displacement=channels["rim_displacement"],
            time=channels.get("time"),
            source=path,
            synthetic=sidecar.synthetic,
            notes=everything,
        )
    else:
        recording = RigRun(
            condition=sidecar.condition,
            axes=sidecar.axes,
            **channels,
            source=path,
            synthetic=sidecar.synthetic,
            kind="slip_step" if sidecar.kind == "slip_step" else "slip_sweep",
            notes=everything,
        )
    check_channels(recording, where=str(path))
    return recording


def _read_columns(path: Path) -> tuple[dict[str, Channel], list[str]]:
    try:
        cells = read_cells(path, kind="recording", example="time_s, slip_angle_deg", logged=True)
    except InputError as error:
        raise InputError(f"{error}{_or_map(path)}") from error
    wanted, notes = _identify(cells.header, str(path))
    places = [place for place, _ in wanted.values()]
    columns = zip(wanted, cells.numbers(places, missing=_MISSING), strict=True)
    found = {base: wanted[base][1].factor * column + wanted[base][1].offset for base, column in columns}
    if not len(next(iter(found.values()))):
        raise InputError(f"{path}: has column names but no rows; was the file cut off?")
    return found, notes


def _identify(names: list[str], where: str) -> tuple[dict[str, tuple[int, Unit]], list[str]]:
    wanted: dict[str, tuple[int, Unit]] = {}
    unused = []
    for index, name in enumerate(names):
        found = split_unit(name, _QUANTITIES, where=where)
        if found is None:
            near = nearest(name.rpartition("_")[0], _QUANTITIES, cutoff=0.8)
            if near:
                raise InputError(f"{where}: column {name!r} is unknown; did you mean {near!r} with its unit?")
            unused.append(name)
            continue
        base, unit = found
        if base in wanted:
            raise InputError(f"{where}: {base} is in two columns, {names[wanted[base][0]]!r} and {name!r}; keep one")
        wanted[base] = (index, unit)
    if not wanted:
        raise InputError(
            f"{where}, row 1: no known column name (found: {', '.join(names)[:200]}){_or_map(Path(where))}"
        )
    return wanted, [f"columns not used: {', '.join(unused)}"] if unused else []


def _or_map(path: Path) -> str:
    words = draft_words(path, QUANTITIES)
    return f"; rename it or put a channel map into the sidecar: {words}" if words else ""
