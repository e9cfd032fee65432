"""Rig recordings in files with a sidecar (CSV with units in its column names, a laboratory's own columns), or TYDEX."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tyre.fits.sidecar import Sidecar, file_and_sidecar, read_sidecar, write_sidecar
from tyre.fits.tydex_recording import read_tydex
from tyre.formats import FORMATS
from tyre.formats.channel_map import ChannelMap
from tyre.ground.errors import InputError, nearest_name
from tyre.ground.files import write_text
from tyre.ground.text_table import csv_text, read_cells
from tyre.ground.units import Unit, unit_in_name
from tyre.recordings.channels import Record, read_records
from tyre.recordings.draft import UnmappedError, or_map, refuse_unmapped
from tyre.recordings.recording import (
    CHANNELS,
    Channel,
    Condition,
    LateralStiffnessTest,
    RigRun,
    check_channels,
    signs,
)
from tyre.recordings.run_checks import TOLERANCES

EVERY = {name: channel.quantity for name, channel in CHANNELS.items()}
QUANTITIES = {name: quantity for name, quantity in EVERY.items() if name != "time"}
"""Channels of a rig other than ``time``, and the quantity of each."""

_PULL_COLUMNS = ("plate_displacement", "rim_displacement")
_MISSING = ("", "NaN", "nan", "NAN", "NA", "NOTAVAIL")


def read_recording(path: str | Path) -> RigRun | LateralStiffnessTest:
    """Read one recording.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` file (its sidecar has the same stem and ends in ``.toml``), that sidecar itself, or a TYDEX file
        (``.tdx``). CSV columns carry their unit: ``time_s``, ``slip_angle_deg`` or ``slip_angle_rad``,
        ``lateral_force_N``, ``vertical_load_N``, and where recorded ``aligning_moment_Nm``, ``inclination_deg``,
        ``speed_km_h``, ``temperature_C``, ``pressure_bar``; a lateral stiffness test has ``lateral_force_N``,
        ``plate_displacement_mm``, ``rim_displacement_mm`` and perhaps ``time_s``. Commas separate the columns;
        semicolons with decimal commas
        are understood too. Empty fields, ``NaN`` and ``NOTAVAIL`` are missing samples. With a channel map in its
        sidecar, a file of any format of :mod:`tyre.formats`, in any columns and units.

    Returns
    -------
    RigRun or LateralStiffnessTest
        SI units, adapted SAE axes; ``notes`` names the columns that were not used.

    Raises
    ------
    InputError
        When a file is missing, malformed, in unknown units, or beyond what a rig can measure.
    """
    events = read_events(path)
    first = next(iter(events.values()))
    if len(events) > 1:
        names = ", ".join(events)
        raise InputError(f"{first.source}: holds the events {names}; one recording is needed here: keep one window")
    return first


def read_events(path: str | Path, channel_map: ChannelMap | None = None) -> dict[str, RigRun | LateralStiffnessTest]:
    """Read every event by name ("" of the only one); ``channel_map`` serves where the sidecar has no map of its own."""
    from tyre.fits.segments import split  # here: it brings most of scipy; a file that is refused need not wait for it

    file, sidecar = file_and_sidecar(Path(path))
    suffix = file.suffix.casefold()
    if suffix not in FORMATS:
        raise InputError(f"{file}: recordings end in {', '.join(FORMATS)} or .toml (their sidecar), not in {suffix!r}")
    own_map = sidecar.channel_map if sidecar is not None else None
    is_mapped = own_map is not None or channel_map is not None
    if not is_mapped and suffix not in (".csv", ".tdx"):
        refuse_unmapped(file, QUANTITIES)
    with or_map(file, QUANTITIES):
        if is_mapped:
            sidecar = sidecar or read_sidecar(file.with_suffix(".toml"))
            events = _read_mapped(file, sidecar, _choose_map(own_map or ChannelMap(), channel_map))
        elif suffix == ".tdx":
            events = {"": _assemble(*read_tydex(file), file)}
        else:
            columns, notes = _read_columns(file)
            events = {"": _assemble(columns, sidecar or read_sidecar(file.with_suffix(".toml")), notes, file)}
    return split(events)


def _read_mapped(file: Path, sidecar: Sidecar, channel_map: ChannelMap) -> dict[str, RigRun | LateralStiffnessTest]:
    """Read the channels of a map from a ``file`` of any format, one recording for every event by its name."""
    pull = "plate_displacement" in channel_map.channels  # dial gauges are often read by hand
    records = read_records(file, channel_map, QUANTITIES, timed=not pull and sidecar.kind != "steady")
    names = [record.event for record in records] if len(records) > 1 else [""]
    return {name: rig_recording(record, sidecar, file) for name, record in zip(names, records, strict=True)}


def _choose_map(own: ChannelMap, common: ChannelMap | None) -> ChannelMap:
    """Take a sidecar's ``own`` map if it names channels, else the ``common`` one with the other parts of its own."""
    if own.channels or common is None:
        return own
    parts = {name: getattr(own, name) for name in ("mountings", "resampling", "windows")}
    if own.reading != ChannelMap().reading:
        parts["reading"] = own.reading
    return replace(common, **{name: part for name, part in parts.items() if part})


SMALLEST = 1e-290
"""Largest value, SI, of a channel below which ten to the power of its digits is no number."""


def rig_recording(record: Record, sidecar: Sidecar, path: Path) -> RigRun | LateralStiffnessTest:
    """Turn one event (SI units, in the axes of the file) into rig data, checked."""
    # conversion leaves readings that were equal apart by rounding, and turning points hinge on ties
    columns = {name: _round_channel(x) for name, x in record.values.items()}
    time = {"time": _round_channel(record.time)} if record.timed else {}
    return _assemble({**time, **columns}, sidecar, list(record.notes), path)


def _round_channel(channel: Channel) -> Channel:
    """Round to twelve digits of the largest value; what is too small for numpy to round stays."""
    largest = float(np.nanmax(np.abs(channel), initial=0.0))
    return np.round(channel, 11 - int(np.floor(np.log10(largest)))) if SMALLEST < largest < np.inf else channel


def write_csv(recording: RigRun | LateralStiffnessTest, path: str | Path) -> None:
    """Write a recording as CSV plus sidecar (of the same stem), in the axes it declares."""
    import pandas as pd

    path = Path(path)
    if path.suffix.casefold() != ".csv":
        raise InputError(f"{path}: a CSV recording must end in .csv")
    turn = signs(recording.axes, where=str(path))
    columns = {}
    for name, kind in CHANNELS.items():
        channel = getattr(recording, name, None)
        if channel is not None:
            columns[f"{name}_{kind.unit}"] = channel * (turn[name] * kind.factor) + 0.0  # no negative zero
    write_text(path, csv_text(pd.DataFrame(columns), number_format="%.12g"))
    write_sidecar(recording, path.with_suffix(".toml"))


def _assemble(
    columns: dict[str, Channel], sidecar: Sidecar, notes: list[str], path: Path
) -> RigRun | LateralStiffnessTest:
    """Make rig data of ``columns`` (n,) in SI units, in the axes that the sidecar declares, and check them."""
    turn = signs(sidecar.axes, where=str(path))
    pull = any(name in columns for name in _PULL_COLUMNS)
    if sidecar.kind is not None and pull != (sidecar.kind == "lateral_stiffness"):
        raise InputError(f"{path}: the sidecar declares kind = {sidecar.kind!r}, the columns are {', '.join(columns)}")
    if pull and sidecar.rigid_rim:
        columns = _add_still_rim(columns, path)
    if sidecar.kind == "steady":
        columns = _number_points(columns, turn["vertical_load"] * sidecar.condition.load)
    needed = ("lateral_force", *_PULL_COLUMNS) if pull else ("time", "slip_angle", "lateral_force", "vertical_load")
    _refuse_lacking(columns, needed, sidecar, path)

    load = columns.get("vertical_load")
    if load is not None and turn["vertical_load"] < 0.0 and np.nanmedian(load) > 0.0:
        turn["vertical_load"] = 1.0  # a load cell in SAE axes may well print the load as a positive number
    channels: Any = {name: channel * turn[name] + 0.0 for name, channel in columns.items()}
    everything = (*sidecar.notes, *(note for note in notes if note not in sidecar.notes))
    common: dict[str, Any] = {"source": path, "synthetic": sidecar.synthetic}
    recording: RigRun | LateralStiffnessTest
    if pull:
        used: Any = {name: channels[name] for name in (*needed, "time") if name in channels}
        unused = sorted(set(channels) - set(used) - {tolerance.channel for tolerance in TOLERANCES.values()})
        if unused:
            everything = (*everything, f"columns not used in a lateral stiffness test: {', '.join(unused)}")
        everything = (*everything, *_measured_otherwise(sidecar.condition, channels))
        levels = _levels_of_pull(sidecar.condition, channels, path)
        condition = _condition_of_pull(replace(sidecar.condition, **levels), path)
        recording = LateralStiffnessTest(condition, sidecar.axes, **used, **common, notes=everything)
    else:
        kind: Any = sidecar.kind or "slip_sweep"
        recording = RigRun(sidecar.condition, sidecar.axes, **channels, **common, kind=kind, notes=everything)
    check_channels(recording, where=str(path))
    return recording


def _add_still_rim(columns: dict[str, Channel], path: Path) -> dict[str, Channel]:
    """Add the displacement (m) of a rim that cannot move, 0; refuse one that is recorded."""
    if "rim_displacement" in columns:
        raise InputError(f"{path}: rigid_rim = true, but rim_displacement is recorded; remove one of them")
    if "plate_displacement" not in columns:
        return columns
    return {**columns, "rim_displacement": np.zeros(len(columns["plate_displacement"]))}


def _refuse_lacking(columns: dict[str, Channel], needed: tuple[str, ...], sidecar: Sidecar, path: Path) -> None:
    """Refuse a recording without one of the ``needed`` channels, in words for a file with or without a channel map."""
    lacking = next((name for name in needed if name not in columns), "")
    if not lacking:
        return
    names = ", ".join(columns)
    more = STEADY if lacking == "time" else ""
    if sidecar.channel_map is None:
        raise UnmappedError(f"{path}: column {lacking}_{CHANNELS[lacking].unit} is missing (found: {names}){more}")
    if lacking == "rim_displacement":
        more = "; or write rigid_rim = true if it cannot move"
    raise InputError(f"{path}: [channels] names no {lacking} (it names {names}); add its column{more}")


def _levels_of_pull(condition: Condition, channels: Mapping[str, Channel], path: Path) -> dict[str, Any]:
    """Levels (SI) of the channels (n,) for what a ``condition`` of a lateral stiffness test leaves to them.

    They are rounded as those of a slip sweep are, so that both are of one condition.
    """
    levels: dict[str, Any] = {}
    for quantity, tolerance in TOLERANCES.items():
        channel = channels.get(tolerance.channel)
        if channel is None or not np.isnan(getattr(condition, quantity)) or not np.isfinite(channel).any():
            continue
        if tolerance.outside(channel) > tolerance.beyond:
            raise InputError(
                f"{path}: the {quantity} varies during the lateral stiffness test; select the test itself with "
                f"[[windows]], or declare its {quantity} in the sidecar"
            )
        levels[quantity] = float(tolerance.nominal(float(np.nanmedian(channel))))
    return levels


def _measured_otherwise(condition: Condition, channels: Mapping[str, Channel]) -> list[str]:
    """Notes on channels (n,) of a lateral stiffness test that contradict what its ``condition`` declares."""
    notes = []
    for quantity, tolerance in TOLERANCES.items():
        channel, declared = channels.get(tolerance.channel), getattr(condition, quantity)
        if channel is None or np.isnan(declared) or not np.isfinite(channel).any():
            continue
        median = float(np.nanmedian(channel))
        if abs(median - declared) > tolerance.width(declared):
            median_shown, declared_shown = median / tolerance.size, declared / tolerance.size
            notes.append(
                f"median {quantity} is {median_shown:.4g} {tolerance.unit}, declared are {declared_shown:.4g} "
                f"{tolerance.unit}"
            )
    return notes


def _condition_of_pull(condition: Condition, path: Path) -> Condition:
    """Condition of a lateral stiffness test, upright unless it has a camber; no load or pressure is refused."""
    lacking = next((name for name in ("load", "pressure") if np.isnan(getattr(condition, name))), "")
    if lacking:
        raise InputError(f"{path}: key {lacking!r} is missing in the sidecar, and no channel has it")
    return replace(condition, camber=float(np.nan_to_num(condition.camber)))


STEADY = '; or write kind = "steady" into the sidecar if each row is a steady point'


def _number_points(columns: dict[str, Channel], load: float) -> dict[str, Channel]:
    """Number settled points in place of their time; without a channel of the load all have the declared one.

    ``load`` is in N, in the axes of the file; NaN if none is declared.
    """
    count = len(next(iter(columns.values())))
    columns = {"time": np.arange(count, dtype=float), **{name: x for name, x in columns.items() if name != "time"}}
    if "vertical_load" not in columns and np.isfinite(load):
        columns["vertical_load"] = np.full(count, load)
    return columns


def _read_columns(path: Path) -> tuple[dict[str, Channel], list[str]]:
    """Read velotyre's own columns (n,) in SI units, with a note on those that are not used."""
    try:
        cells = read_cells(path, kind="recording", example="time_s, slip_angle_deg", logged=True)
    except InputError as error:
        raise UnmappedError(str(error)) from error
    place_and_unit, notes = _identify(cells.header, path)
    columns = cells.numbers([place for place, _ in place_and_unit.values()], missing=_MISSING)
    units = [unit for _, unit in place_and_unit.values()]
    channels = {b: u.factor * x + u.offset for b, u, x in zip(place_and_unit, units, columns, strict=True)}
    if not len(columns[0]):
        raise InputError(f"{path}: has column names but no rows; was the file cut off?")
    return channels, notes


def _identify(names: list[str], path: Path) -> tuple[dict[str, tuple[int, Unit]], list[str]]:
    """Place and unit of every known column, and a note on those that are not used."""
    place_and_unit: dict[str, tuple[int, Unit]] = {}
    unused = []
    for index, name in enumerate(names):
        base_and_unit = unit_in_name(name, EVERY, where=str(path))
        if base_and_unit is None:
            suggestion = nearest_name(name.rpartition("_")[0], EVERY, cutoff=0.8)
            if suggestion:
                raise InputError(f"{path}: column {name!r} is unknown; did you mean {suggestion!r} with its unit?")
            unused.append(name)
            continue
        base, unit = base_and_unit
        if base in place_and_unit:
            raise InputError(
                f"{path}: {base} is in two columns, {names[place_and_unit[base][0]]!r} and {name!r}; keep one"
            )
        place_and_unit[base] = (index, unit)
    if not place_and_unit:
        raise UnmappedError(f"{path}, row 1: no known column name (found: {', '.join(names)[:200]})")
    return place_and_unit, [f"columns not used: {', '.join(unused)}"] if unused else []
