"""The TOML sidecar of a CSV recording: what was tested, under which condition and in which axes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tyre.base.checks import Check, flag, number, refused, text
from tyre.base.errors import InputError
from tyre.base.files import write_text
from tyre.base.schema import maybe, read, table
from tyre.base.toml_file import read_toml
from tyre.base.units import PASCAL_PER_BAR
from tyre.channels.channel_map import TABLES, ChannelMap
from tyre.recordings.axes import CONVENTIONS, signs
from tyre.recordings.check import check_condition
from tyre.recordings.recording import COMPUTED_NOTE, Condition, PullTest, RigRun
from tyre.recordings.units import split_unit

KINDS = ("slip_sweep", "slip_step", "pull_test")
_QUANTITIES = {
    "load": "force",
    "pressure": "pressure",
    "drum_radius": "length",
    "speed": "speed",
    "temperature": "temperature",
    "camber": "angle",
}


def _note(value: Any) -> tuple[str, ...]:
    notes = [value] if isinstance(value, str) else value
    if not isinstance(notes, list) or not all(isinstance(note, str) for note in notes):
        raise refused(value, "must be text or a list of texts")
    return tuple(notes)


_TEXT = text(blank=False)
_PLAIN_KEYS: dict[str, Check] = {
    "kind": text(f"is not one of {', '.join(KINDS)}", allowed=KINDS), "tyre": _TEXT, "surface": _TEXT, "rim": _TEXT,
    "axes": _TEXT, "synthetic": flag, "note": _note, "recording": _TEXT,
    "rigid_rim": flag,
}  # fmt: skip
_REQUIRED = {
    "tyre": "name of the tyre",
    "load": "load_N = vertical load",
    "pressure": "pressure_bar = inflation pressure",
    "surface": "'flat' or 'drum'",
    "axes": " / ".join(CONVENTIONS) + "; there is no default",
}
_SPELLINGS = (
    *_PLAIN_KEYS,
    *TABLES,
    "load_N",
    "pressure_bar",
    "drum_radius_m",
    "speed_km_h",
    "temperature_C",
    "camber_deg",
)


@dataclass(frozen=True)
class Sidecar:
    """Content of a sidecar in SI units; ``kind`` is None when the file leaves it to the columns.

    ``channel_map`` is None where the columns have velotyre's names; ``recording`` is a file with another stem;
    ``rigid_rim`` says that a pull test without rim displacement was made on a rim that does not move.
    """

    condition: Condition
    axes: str
    kind: str | None
    synthetic: bool
    notes: tuple[str, ...]
    channel_map: ChannelMap | None = None
    recording: str = ""
    rigid_rim: bool = False


def read_sidecar(path: Path) -> Sidecar:
    """Read a sidecar.

    Parameters
    ----------
    path : Path
        TOML file with ``tyre``, ``load_N``, ``pressure_bar``, ``surface`` (``flat``, or ``drum`` with
        ``drum_radius_m``) and ``axes``; optionally ``kind``, ``rim``, ``speed_km_h``, ``temperature_C``,
        ``camber_deg`` (> 0 leaning right), ``synthetic``, ``note``, the tables of a channel map
        (:mod:`tyre.channels.channel_map`), ``recording``, a file whose stem is another one, and ``rigid_rim``: true
        where a pull test has no rim displacement because its rim cannot move. Any unit known to
        ``tyre.recordings.units`` may stand at the end of a key.

    Returns
    -------
    Sidecar

    Raises
    ------
    InputError
        For a missing file, invalid TOML, an unknown, missing or doubled key, or a value out of range.
    """
    remedy = "the sidecar is missing; write one with tyre, load_N, pressure_bar, surface and axes"
    content = read_toml(path, "sidecar", absent=remedy)
    tables = {key: content.pop(key) for key in TABLES if key in content}
    sidecar = _interpret(content, str(path))
    return (
        replace(sidecar, channel_map=ChannelMap.from_table(tables, path.parent, where=str(path))) if tables else sidecar
    )


def _interpret(content: Mapping[str, Any], where: str) -> Sidecar:
    units = {key: found for key in content if (found := split_unit(key, _QUANTITIES, where=where))}
    quantity = number(says="must be a number")
    declared = {maybe(key): _PLAIN_KEYS.get(key, quantity) for key in dict.fromkeys([*_SPELLINGS, *units])}
    values: dict[str, Any] = {}
    for key, value in read(table(declared), content, where=where).items():
        base, unit = units.get(key, (key, None))
        if base in values:
            raise InputError(f"{where}: {base} is given twice, the second time as {key!r}; keep one")
        values[base] = value if unit is None else unit.factor * value + unit.offset
    for key, meaning in _REQUIRED.items():
        if key not in values:
            raise InputError(f"{where}: key {key!r} is missing ({meaning})")
    axes, kind = values.pop("axes"), values.pop("kind", None)
    synthetic, notes = values.pop("synthetic", False), values.pop("note", ())
    recording, rigid = values.pop("recording", ""), values.pop("rigid_rim", False)
    signs(axes, where=where)
    condition = Condition(**values)
    check_condition(condition, where=where)
    return Sidecar(condition, axes, kind, synthetic, notes, recording=recording, rigid_rim=rigid)


def write_sidecar(recording: RigRun | PullTest, path: Path) -> None:
    """Write the sidecar of a recording in the units the reader documents (N, bar, km/h, deg, m).

    Parameters
    ----------
    recording : RigRun or PullTest
    path : Path
        ``.toml``, beside the CSV.
    """
    condition = recording.condition
    table: dict[str, Any] = {
        "kind": recording.kind if isinstance(recording, RigRun) else "pull_test",
        "tyre": condition.tyre,
        "load_N": condition.load,
        "pressure_bar": _printed(condition.pressure / PASCAL_PER_BAR),
        "surface": condition.surface,
        "drum_radius_m": condition.drum_radius,
        "rim": condition.rim,
        "speed_km_h": None if condition.speed is None else _printed(condition.speed * 3.6),
        "temperature_C": condition.temperature,
        "camber_deg": _printed(np.rad2deg(condition.camber)),
        "axes": recording.axes,
        "synthetic": True if recording.synthetic else None,
        "note": list(recording.notes) or None,
    }
    if recording.synthetic and not recording.notes:
        table["note"] = COMPUTED_NOTE
    write_text(path, tomli_w.dumps({key: value for key, value in table.items() if value is not None}))


def _printed(value: float) -> float:
    """Twelve digits, so that a value read and written again stays as it was printed."""
    return float(f"{value:.12g}")
