"""Rig recordings in files with a sidecar (CSV with units in its column names, a laboratory's own columns), or TYDEX.

TYDEX W-axes are ISO axes, so signs are turned on the way. W-channels are read first; if a file has only H-axes
(wheel-parallel to the road), these serve for side force, load and aligning moment, and the recording's notes say so.
Names of our own, all allowed by the format: ``RIMDISPW`` (lateral displacement of the rim in a pull test, beside
``LATDISPW`` of the plate), ``DRUMRAD`` (radius of the drum), ``TESTKIND``, ``RIMIDENT``, ``DATAORIG``.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tyre.formats import FORMATS
from tyre.formats.channel_map import TABLES, ChannelMap
from tyre.formats.tydex import ChannelEntry, Entry, TydexDocument, document_text, read_document
from tyre.ground.errors import InputError, nearest_name, read_number
from tyre.ground.files import read_toml, write_text
from tyre.ground.schema import Check, flag, maybe, number, read, refusal, table, text
from tyre.ground.text_table import csv_text, read_cells
from tyre.ground.units import PASCAL_PER_BAR, Unit, find_unit, unit_in_name
from tyre.recordings.channels import Record, read_records
from tyre.recordings.draft import or_map, refuse_unmapped
from tyre.recordings.recording import (
    CHANNELS,
    COMPUTED_NOTE,
    CONVENTIONS,
    Channel,
    Condition,
    PullTest,
    RigRun,
    check_channels,
    check_condition,
    signs,
)
from tyre.recordings.run_checks import TOLERANCES

EVERY = {name: channel.quantity for name, channel in CHANNELS.items()}
QUANTITIES = {name: quantity for name, quantity in EVERY.items() if name != "time"}
"""Channels of a rig beside ``time``, and what each measures."""

_PULL_COLUMNS = ("plate_displacement", "rim_displacement")
_MISSING = ("", "NaN", "nan", "NAN", "NA", "NOTAVAIL")


def _note(value: Any) -> tuple[str, ...]:
    notes = [value] if isinstance(value, str) else value
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise refusal(value, "must be text or a list of texts")
    return tuple(notes)


_KINDS = ("slip_sweep", "slip_step", "steady", "pull_test")
_TEXT = text(blank=False)
_PLAIN_KEYS: dict[str, Check] = {
    "kind": text(f"is not one of {', '.join(_KINDS)}", allowed=_KINDS),
    "tyre": _TEXT,
    "surface": _TEXT,
    "rim": _TEXT,
    "axes": _TEXT,
    "synthetic": flag,
    "note": _note,
    "recording": _TEXT,
    "rigid_rim": flag,
}
_CONDITION = {
    "load": "force", "pressure": "pressure", "drum_radius": "length", "speed": "speed", "temperature": "temperature",
    "camber": "angle",
}  # fmt: skip
_USUAL_KEYS = ("load_N", "pressure_bar", "drum_radius_m", "speed_km_h", "temperature_C", "camber_deg")
_REQUIRED = {
    "tyre": "name of the tyre",
    "surface": "'flat' or 'drum'",
    "axes": " / ".join(CONVENTIONS) + "; there is no default",
}


@dataclass(frozen=True)
class Sidecar:
    """Content of a sidecar in SI units; ``kind`` is None when the file leaves it to the columns."""

    condition: Condition  # NaN for a load or pressure that it leaves to the channels
    axes: str  # ``ISO``, ``SAE`` or ``adapted SAE``: signs of the file's channels
    kind: str | None = None  # as in :class:`RigRun`, or ``pull_test``; None: the columns tell
    synthetic: bool = False  # True if a program computed the recording
    notes: tuple[str, ...] = ()  # what a reader of any result must know
    channel_map: ChannelMap | None = None  # which column is which channel; None: by their names
    recording: str = ""  # name of the recording's file if it differs from the sidecar's; else empty
    rigid_rim: bool = False  # True: the rim cannot move, and its displacement is taken as zero


def read_sidecar(path: Path) -> Sidecar:
    """Read a sidecar in TOML: the condition and axes, the tables of a channel map; units stand at the end of keys."""
    where = str(path)
    remedy = "the sidecar is missing; write one with tyre, load_N, pressure_bar, surface and axes"
    content = read_toml(path, "sidecar", absent=remedy)
    tables = {key: content.pop(key) for key in TABLES if key in content}
    units = {key: found for key in content if (found := unit_in_name(key, _CONDITION, where=where))}
    keys = dict.fromkeys([*_PLAIN_KEYS, *TABLES, *_USUAL_KEYS, *units])
    declared = table({maybe(key): _PLAIN_KEYS.get(key, number(says="must be a number")) for key in keys})
    values: dict[str, Any] = {}
    for key, value in read(declared, content, where=where).items():
        base, unit = units.get(key, (key, None))
        if base in values:
            raise InputError(f"{where}: {base} is given twice, the second time as {key!r}; keep one")
        values[base] = value if unit is None else unit.factor * value + unit.offset
    for key, meaning in _REQUIRED.items():
        if key not in values:
            raise InputError(f"{where}: key {key!r} is missing ({meaning})")
    values["notes"] = values.pop("note", ())
    settings = {field.name: values.pop(field.name) for field in fields(Sidecar) if field.name in values}
    signs(settings["axes"], where=where)
    condition = Condition(**dict.fromkeys(("load", "pressure", "camber"), np.nan) | values)
    check_condition(condition, where=where)
    channel_map = ChannelMap.from_table(tables, path.parent, where=where) if tables else None
    return Sidecar(condition, **settings, channel_map=channel_map)


def write_sidecar(recording: RigRun | PullTest, path: Path) -> None:
    """Write the sidecar of a recording in the units the reader documents (N, bar, km/h, deg, m)."""
    condition = recording.condition
    content: dict[str, Any] = {
        "kind": recording.kind if isinstance(recording, RigRun) else "pull_test",
        "tyre": condition.tyre,
        "load_N": condition.load,
        "pressure_bar": _round_printed(condition.pressure / PASCAL_PER_BAR),
        "surface": condition.surface,
        "drum_radius_m": condition.drum_radius,
        "rim": condition.rim,
        "speed_km_h": None if condition.speed is None else _round_printed(condition.speed * 3.6),
        "temperature_C": condition.temperature,
        "camber_deg": _round_printed(np.rad2deg(condition.camber)),
        "axes": recording.axes,
        "synthetic": True if recording.synthetic else None,
        "note": list(recording.notes) or (COMPUTED_NOTE if recording.synthetic else None),
    }
    write_text(path, tomli_w.dumps({key: value for key, value in content.items() if value is not None}))


def _round_printed(value: float) -> float:
    """Twelve digits, so that a value read and written again stays as it was printed."""
    return float(f"{value:.12g}")


def recording_of(sidecar: Path) -> Path:
    """Find the file that a sidecar describes: the one it names, else that of its stem (several are refused)."""
    return _described_file(sidecar, read_sidecar(sidecar).recording if sidecar.is_file() else "")


def _described_file(sidecar: Path, recording: str) -> Path:
    """Find the file beside a sidecar: the ``recording`` that it names, or if empty that of its stem."""
    if recording:
        return sidecar.parent / recording
    candidates = [
        path
        for path in sorted(sidecar.parent.iterdir() if sidecar.parent.is_dir() else ())
        if path.stem == sidecar.stem and path.suffix.casefold() in FORMATS
    ]
    if len(candidates) > 1:
        names = ", ".join(path.name for path in candidates)
        raise InputError(f"{sidecar}: describes {names}; write recording = {candidates[0].name!r} or rename the others")
    return candidates[0] if candidates else sidecar.with_suffix(".csv")


def read_recording(path: str | Path) -> RigRun | PullTest:
    """Read one recording.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` file (its sidecar has the same stem and ends in ``.toml``), that sidecar itself, or a TYDEX file
        (``.tdx``). CSV columns carry their unit: ``time_s``, ``slip_angle_deg`` or ``slip_angle_rad``,
        ``side_force_N``, ``vertical_load_N``, and where recorded ``aligning_moment_Nm``, ``inclination_deg``,
        ``speed_km_h``, ``temperature_C``, ``pressure_bar``; a pull test has ``side_force_N``,
        ``plate_displacement_mm``, ``rim_displacement_mm`` and perhaps ``time_s``. Commas separate the columns;
        semicolons with decimal commas
        are understood too. Empty fields, ``NaN`` and ``NOTAVAIL`` are missing samples. With a channel map in its
        sidecar, a file of any format of :mod:`tyre.formats`, in any columns and units.

    Returns
    -------
    RigRun or PullTest
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


def read_events(path: str | Path, channel_map: ChannelMap | None = None) -> dict[str, RigRun | PullTest]:
    """Read every event by name ("" of the only one); ``channel_map`` serves where the sidecar has no map of its own."""
    from tyre.fits.segments import split  # here: it brings most of scipy; a file that is refused need not wait for it

    file, sidecar = file_and_sidecar(Path(path))
    suffix = file.suffix.casefold()
    if suffix not in FORMATS:
        raise InputError(f"{file}: recordings end in {', '.join(FORMATS)} or .toml (their sidecar), not in {suffix!r}")
    own_map = sidecar.channel_map if sidecar is not None else None
    if own_map is not None or channel_map is not None:
        sidecar = sidecar or read_sidecar(file.with_suffix(".toml"))
        chosen = _choose_map(own_map or ChannelMap(), channel_map)
        pull = "plate_displacement" in chosen.channels  # dial gauges are often read by hand
        records = read_records(file, chosen, QUANTITIES, timed=not pull and sidecar.kind != "steady")
        names = [record.event for record in records] if len(records) > 1 else [""]
        return split({name: rig_recording(record, sidecar, file) for name, record in zip(names, records, strict=True)})
    if suffix == ".tdx":
        return split({"": _tydex_recording(file)})
    if suffix != ".csv":
        refuse_unmapped(file, QUANTITIES)
    columns, notes = _read_columns(file)
    return split({"": _assemble(columns, sidecar or read_sidecar(file.with_suffix(".toml")), notes, file)})


def _choose_map(own: ChannelMap, common: ChannelMap | None) -> ChannelMap:
    """Take a sidecar's ``own`` map if it names channels, else the ``common`` one with the other parts of its own."""
    if own.channels or common is None:
        return own
    parts = {name: getattr(own, name) for name in ("mountings", "resampling", "windows")}
    if own.reading != ChannelMap().reading:
        parts["reading"] = own.reading
    return replace(common, **{name: part for name, part in parts.items() if part})


def file_and_sidecar(path: Path) -> tuple[Path, Sidecar | None]:
    """Find the recording and read the sidecar (None if there is none) of a ``path`` that is one of the two."""
    is_sidecar = path.suffix.casefold() == ".toml"
    if is_sidecar and path.is_file():
        sidecar = read_sidecar(path)
        return _described_file(path, sidecar.recording), sidecar
    file = _described_file(path, "") if is_sidecar else path
    beside = file.with_suffix(".toml")
    return file, read_sidecar(beside) if beside.is_file() else None


def rig_recording(record: Record, sidecar: Sidecar, path: Path) -> RigRun | PullTest:
    """Turn one event (SI units, in the axes of the file) into rig data, checked."""
    # conversion leaves readings that were equal apart by rounding, and turning points hinge on ties
    columns = {name: _round_channel(x) for name, x in record.values.items()}
    time = {"time": _round_channel(record.time)} if record.timed else {}
    return _assemble({**time, **columns}, sidecar, list(record.notes), path)


def _round_channel(channel: Channel) -> Channel:
    """Round to twelve digits of the largest value."""
    largest = float(np.nanmax(np.abs(channel), initial=0.0))
    return channel if not 0.0 < largest < np.inf else np.round(channel, 11 - int(np.floor(np.log10(largest))))


def write_csv(recording: RigRun | PullTest, path: str | Path) -> None:
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


def _assemble(columns: dict[str, Channel], sidecar: Sidecar, notes: list[str], path: Path) -> RigRun | PullTest:
    turn = signs(sidecar.axes, where=str(path))
    pull = any(name in columns for name in _PULL_COLUMNS)
    if sidecar.kind is not None and pull != (sidecar.kind == "pull_test"):
        raise InputError(f"{path}: the sidecar declares kind = {sidecar.kind!r}, the columns are {', '.join(columns)}")
    if pull and sidecar.rigid_rim:
        if "rim_displacement" in columns:
            raise InputError(f"{path}: rigid_rim = true, but rim_displacement is recorded; take one of them out")
        if "plate_displacement" in columns:
            columns = {**columns, "rim_displacement": np.zeros(len(columns["plate_displacement"]))}
    if sidecar.kind == "steady":
        columns = _number_points(columns, sidecar)
    needed = ("side_force", *_PULL_COLUMNS) if pull else ("time", "slip_angle", "side_force", "vertical_load")
    lacking = next((name for name in needed if name not in columns), "")
    names = ", ".join(columns)
    if lacking and sidecar.channel_map is None:
        with or_map(path, QUANTITIES):
            more = STEADY if lacking == "time" else ""
            raise InputError(f"{path}: column {lacking}_{CHANNELS[lacking].unit} is missing (found: {names}){more}")
    if lacking:
        more = "; or write rigid_rim = true if it cannot move" if lacking == "rim_displacement" else ""
        more = STEADY if lacking == "time" else more
        raise InputError(f"{path}: [channels] names no {lacking} (it names {names}); add its column{more}")
    load = columns.get("vertical_load")
    if load is not None and turn["vertical_load"] < 0.0 and np.nanmedian(load) > 0.0:
        turn["vertical_load"] = 1.0  # a load cell in SAE axes may well print the load as a positive number
    channels: Any = {name: channel * turn[name] + 0.0 for name, channel in columns.items()}
    everything = (*sidecar.notes, *(note for note in notes if note not in sidecar.notes))
    common: dict[str, Any] = {"source": path, "synthetic": sidecar.synthetic}
    recording: RigRun | PullTest
    if pull:
        used: Any = {name: channels[name] for name in (*needed, "time") if name in channels}
        unused = sorted(set(channels) - set(used))
        if unused:
            everything = (*everything, f"columns not used in a pull test: {', '.join(unused)}")
        lacking = next((name for name in ("load", "pressure") if np.isnan(getattr(sidecar.condition, name))), "")
        if lacking:
            raise InputError(
                f"{path}: key {lacking!r} is missing in the sidecar; a pull test is not cut by its channels"
            )
        condition = replace(sidecar.condition, camber=float(np.nan_to_num(sidecar.condition.camber)))
        recording = PullTest(condition, sidecar.axes, **used, **common, notes=everything)
    else:
        kind: Any = sidecar.kind or "slip_sweep"
        recording = RigRun(sidecar.condition, sidecar.axes, **channels, **common, kind=kind, notes=everything)
    check_channels(recording, where=str(path))
    return recording


STEADY = '; or write kind = "steady" into the sidecar if each row is a settled point of its own'


def _number_points(columns: dict[str, Channel], sidecar: Sidecar) -> dict[str, Channel]:
    """Number settled points in place of their time; a declared load serves points of one load without its channel."""
    count = len(next(iter(columns.values())))
    columns = {"time": np.arange(count, dtype=float), **{name: x for name, x in columns.items() if name != "time"}}
    if "vertical_load" not in columns and np.isfinite(sidecar.condition.load):
        declared = signs(sidecar.axes)["vertical_load"] * sidecar.condition.load
        columns["vertical_load"] = np.full(count, declared)
    return columns


def _read_columns(path: Path) -> tuple[dict[str, Channel], list[str]]:
    """Read velotyre's own columns; a file with others is shown with a draft of a channel map."""
    with or_map(path, QUANTITIES):
        cells = read_cells(path, kind="recording", example="time_s, slip_angle_deg", logged=True)
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
        with or_map(path, QUANTITIES):
            raise InputError(f"{path}, row 1: no known column name (found: {', '.join(names)[:200]})")
    return place_and_unit, [f"columns not used: {', '.join(unused)}"] if unused else []


# channel -> TYDEX names in order of preference, description, unit as written
_TYDEX = {
    "time": (("RUNTIME",), "Running time", "s"),
    "slip_angle": (("SLIPANGL",), "Slip angle", "deg"),
    "side_force": (("FYW", "FYH"), "Lateral force, W-axes", "N"),
    "vertical_load": (("FZW", "FZH"), "Vertical force, W-axes", "N"),
    "aligning_moment": (("MZW", "MZH"), "Aligning moment, W-axes", "Nm"),
    "inclination": (("INCLANGL",), "Inclination angle", "deg"),
    "pressure": (("INFLPRES",), "Inflation pressure", "bar"),
    "speed": (("TRAJVELW", "TRAJVELH", "LONGVEL"), "Trajectory velocity", "km/h"),
    "temperature": (("TYRETEMP",), "Tyre temperature", "degC"),
    "plate_displacement": (("LATDISPW",), "Lateral displacement, plate", "mm"),
    "rim_displacement": (("RIMDISPW",), "Lateral displacement, rim", "mm"),
}
_PULL_CHANNELS = ("time", "side_force", "plate_displacement", "rim_displacement")


def _tydex_recording(path: Path) -> RigRun | PullTest:
    """Read TYDEX in SI units and adapted SAE axes; ``axes`` is ``ISO``, that of the format."""
    document = read_document(path)
    notes: list[str] = []
    measured = _tydex_channels(document, notes)
    slip = measured.get("slip_angle")
    sweeps = slip is not None and np.isfinite(slip).any() and np.nanmax(slip) - np.nanmin(slip) > np.deg2rad(0.5)
    pull = "plate_displacement" in measured and not sweeps
    used = _PULL_CHANNELS if pull else [name for name in _TYDEX if name not in _PULL_CHANNELS[2:]]
    for name in used[1:3] if pull else used[:4]:
        if name not in measured:
            names = " or ".join(_TYDEX[name][0])
            raise InputError(f"{path}: channel {names} is missing (found: {', '.join(document.channels)})")
    sidecar = _tydex_sidecar(document, measured, notes)
    unused = [name for name in document.channels if not any(name in _TYDEX[key][0] for key in used)]
    if unused:
        notes.append(f"channels not used: {', '.join(unused)}")
    channels = {name: measured[name] for name in used if name in measured}
    if pull and "rim_displacement" not in channels:
        sidecar = replace(sidecar, rigid_rim=True)
        notes.append("no channel RIMDISPW: the rim is taken as rigid, its displacement as zero")
    return _assemble(channels, sidecar, notes, path)


def write_tydex(recording: RigRun | PullTest, path: str | Path) -> None:
    """Write a recording as a ``.tdx`` file of TYDEX 1.3 in ISO W-axes, whatever axes it was recorded in."""
    path = Path(path)
    if path.suffix.casefold() != ".tdx":
        raise InputError(f"{path}: a TYDEX file must end in .tdx")
    turn = signs("ISO")
    entries, columns = [], []
    for name, ((tydex_name, *_), description, unit) in _TYDEX.items():
        channel: Channel | None = getattr(recording, name, None)
        if channel is not None:
            entries.append(ChannelEntry(tydex_name, description, unit))
            columns.append(channel * (turn[name] * CHANNELS[name].factor) + 0.0)
    header = [
        Entry("RELEASE", "Release of TYDEX-Format", "", "1.3"),
        Entry("MEASID", "Measurement ID", "", path.stem),
        Entry("SUPPLIER", "Data supplier", "", "velotyre"),
    ]
    comments = "SYNTHETIC: computed by a simulation, not measured" if recording.synthetic else "Written by velotyre"
    content = document_text(
        header=header,
        comments=comments,
        constants=_constants(recording),
        channels=entries,
        measured=np.column_stack(columns),
        source=str(path),
    )
    write_text(path, content)


def tydex_sidecar(path: str | Path) -> Sidecar | None:
    """Make a sidecar of the constants of a TYDEX file; None if they do not make one."""
    try:
        document = read_document(path)
        return _tydex_sidecar(document, _tydex_channels(document, []), [])
    except InputError:
        return None


def _tydex_channels(document: TydexDocument, notes: list[str]) -> dict[str, Channel]:
    """Channels in SI units, in the ISO axes of the file."""
    channels: dict[str, Channel] = {}
    for name, (candidates, *_) in _TYDEX.items():
        tydex_name = next((candidate for candidate in candidates if candidate in document.channels), None)
        if tydex_name is None:
            continue
        entry = document.channels[tydex_name]
        unit = find_unit(entry.unit, EVERY[name], where=f"{document.source}, channel {tydex_name}")
        channels[name] = unit.factor * document.physical(tydex_name) + unit.offset
        if tydex_name in ("FYH", "FZH", "MZH"):
            notes.append(f"{tydex_name} (H-axes) stands in for {candidates[0]} (W-axes)")
        if entry.measured_offset:
            notes.append(f"{tydex_name}: offset of the measured value added before the conversion factor")
    return channels


def _constant(document: TydexDocument, *names: str) -> str | None:
    """Text of the first constant that is there."""
    return next((entry.value for name in names if (entry := document.constants.get(name)) and entry.value), None)


def _constant_number(document: TydexDocument, name: str, quantity: str) -> float | None:
    value, where = _constant(document, name), f"{document.source}, constant {name}"
    if value is None:
        return None
    try:
        number = read_number(value)
    except ValueError:
        raise InputError(f"{where}: {value[:40]!r} is not a number with a decimal point") from None
    unit = find_unit(document.constants[name].unit, quantity, where=where)
    return unit.factor * number + unit.offset


def _tydex_sidecar(document: TydexDocument, channels: dict[str, Channel], notes: list[str]) -> Sidecar:
    """Condition and kind by the constants, else by the medians of channels, which ``notes`` tell."""
    tyre = _constant(document, "IDENTITY", "TYREDES", "MANUFACT")
    if tyre is None:
        identity = document.header.get("MEASID")
        tyre = identity.value if identity and identity.value else Path(document.source).stem
        notes.append(f"no constant IDENTITY: the tyre is called {tyre!r} after the measurement")

    def value_of(name: str, *exact: str, nominal: str = "", remarks: list[str] = notes) -> float | None:
        """One number: a constant, else a nominal value near the measured median, else that median."""
        quantity = EVERY[name]
        constants = (_constant_number(document, constant, quantity) for constant in exact)
        exactly = next((value for value in constants if value is not None), None)
        channel = channels.get(name)
        if channel is None or not np.isfinite(channel).any():
            return _constant_number(document, nominal, quantity) if exactly is None else exactly
        tolerance = next((candidate for candidate in TOLERANCES.values() if candidate.channel == name), None)
        if tolerance is not None and tolerance.outside(channel) > tolerance.beyond:  # several levels
            if exactly is not None:
                remarks.append(f"{name.replace('_', ' ')}: its channel varies, so the constant is not taken")
            return np.nan
        if exactly is not None:
            return exactly
        median = float(np.nanmedian(channel))
        value = _constant_number(document, nominal, quantity)
        if value is not None and abs(median - value) <= 0.25 * abs(value):
            return value
        remarks.append(
            f"{name.replace('_', ' ')} of the condition is the median of its channel, {median:.6g} in SI units"
        )
        return median

    load = value_of("vertical_load", "FZW", "FZH", nominal="FNOMIN")
    pressure = value_of("pressure", "INFLPRES", nominal="NOMPRES")
    if load is None or pressure is None:
        missing = "load (constant FZW or FNOMIN)" if load is None else "pressure (constant INFLPRES or NOMPRES)"
        raise InputError(f"{document.source}: no {missing} and no such channel; add the constant")
    camber = value_of("inclination", "INCLANGL") if "INCLANGL" in document.constants else None
    radius = _constant_number(document, "DRUMRAD", "length")
    if radius is None:
        _check_flat(document, notes)
    condition = Condition(
        tyre=tyre,
        load=load,
        pressure=pressure,
        surface="flat" if radius is None else "drum",
        drum_radius=radius,
        rim=_constant(document, "RIMIDENT"),
        speed=value_of("speed", "LONGVEL", "TRAJVELW", "TRAJVELH"),
        temperature=value_of("temperature", "AMBITEMP", "TYRETEMP", remarks=[]),
        camber=np.nan if camber is None else camber,
    )
    check_condition(condition, where=document.source)
    kind = "slip_step" if _constant(document, "TESTKIND") == "slip_step" else None
    return Sidecar(condition, "ISO", kind, _constant(document, "DATAORIG") == "SYNTHETIC", notes=())


def _check_flat(document: TydexDocument, notes: list[str]) -> None:
    """Refuse a drum without a radius; note a surface that nothing names."""
    words = " ".join(
        _constant(document, name) or "" for name in ("TRCKSURF", "SURFACE", "TESTRIG", "LOCATION")
    ).casefold()
    if "drum" in words or "trommel" in words:
        raise InputError(f"{document.source}: was measured on a drum, but constant DRUMRAD (its radius) is missing")
    if "flat" not in words and "belt" not in words:
        notes.append("no constant names the surface (TRCKSURF, DRUMRAD): taken as flat")


def _constants(recording: RigRun | PullTest) -> list[Entry]:
    condition = recording.condition
    bar, speed = condition.pressure / PASCAL_PER_BAR, condition.speed
    camber = None if getattr(recording, "inclination", None) is not None else np.rad2deg(condition.camber)
    entries: list[tuple[str, str, str, float | str | None]] = [
        ("IDENTITY", "Identity of the tyre", "", condition.tyre),
        ("FNOMIN", "Nominal vertical load", "N", condition.load),
        ("NOMPRES", "Nominal inflation pressure", "bar", bar),
        ("TRCKSURF", "Surface of track", "", condition.surface),
        ("TESTKIND", "Kind of test", "", recording.kind if isinstance(recording, RigRun) else "pull_test"),
        ("DRUMRAD", "Radius of the drum", "m", condition.drum_radius),
        ("RIMIDENT", "Identity of the rim", "", condition.rim),
        ("LONGVEL", "Longitudinal velocity", "km/h", None if speed is None else speed * 3.6),
        ("AMBITEMP", "Ambient temperature", "degC", condition.temperature),
        ("INCLANGL", "Inclination angle", "deg", camber),
        ("DATAORIG", "Origin of the data", "", "SYNTHETIC" if recording.synthetic else None),
    ]
    return [
        Entry(name, description, unit, value if isinstance(value, str) else f"{value:.10g}")
        for name, description, unit, value in entries
        if value is not None
    ]
