"""The sidecar of a rig recording: a file in TOML with the condition, the axes and perhaps a channel map."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tyre.formats import FORMATS
from tyre.formats.channel_map import TABLES, ChannelMap
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml, write_text
from tyre.ground.schema import Check, flag, maybe, number, read, refusal, table, text
from tyre.ground.units import PASCAL_PER_BAR, unit_in_name
from tyre.recordings.recording import (
    COMPUTED_NOTE,
    CONVENTIONS,
    Condition,
    LateralStiffnessTest,
    RigRun,
    check_condition,
    signs,
)


def _note(value: Any) -> tuple[str, ...]:
    notes = [value] if isinstance(value, str) else value
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise refusal(value, "must be text or a list of texts")
    return tuple(notes)


_KINDS = ("slip_sweep", "slip_step", "steady", "lateral_stiffness")
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
    kind: str | None = None  # as in :class:`RigRun`, or ``lateral_stiffness``; None: the columns tell
    synthetic: bool = False  # True if a program computed the recording
    notes: tuple[str, ...] = ()  # what a reader of any result must know
    channel_map: ChannelMap | None = None  # which column is which channel; None: by their names
    recording: str = ""  # name of the recording's file if it differs from the sidecar's; else empty
    rigid_rim: bool = False  # True: the rim cannot move, and its displacement is taken as zero


def read_sidecar(path: Path) -> Sidecar:
    """Read a sidecar in TOML: the condition and axes, the tables of a channel map; keys end with their units."""
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


def write_sidecar(recording: RigRun | LateralStiffnessTest, path: Path) -> None:
    """Write the sidecar of a recording in the units the reader documents (N, bar, km/h, deg, m)."""
    condition = recording.condition
    content: dict[str, Any] = {
        "kind": recording.kind if isinstance(recording, RigRun) else "lateral_stiffness",
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


def _described_file(sidecar: Path, recording: str) -> Path:
    """Find the recording of a sidecar: the ``recording`` that it names, or if empty that of its stem."""
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


def file_and_sidecar(path: Path) -> tuple[Path, Sidecar | None]:
    """Find the recording and read the sidecar (None if there is none) of a ``path`` that is one of the two."""
    is_sidecar = path.suffix.casefold() == ".toml"
    if is_sidecar and path.is_file():
        sidecar = read_sidecar(path)
        return _described_file(path, sidecar.recording), sidecar
    file = _described_file(path, "") if is_sidecar else path
    beside = file.with_suffix(".toml")
    return file, read_sidecar(beside) if beside.is_file() else None
