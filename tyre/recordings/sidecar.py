"""The TOML sidecar of a CSV recording: what was tested, under which condition and in which axes."""

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.recordings.axes import CONVENTIONS, signs
from tyre.recordings.check import check_condition
from tyre.recordings.recording import Condition, PullTest, RigRun
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
_PLAIN_KEYS: dict[str, type | tuple[type, ...]] = {
    "kind": str,
    "tyre": str,
    "surface": str,
    "rim": str,
    "axes": str,
    "synthetic": bool,
    "note": (str, list),
}
_REQUIRED = {
    "tyre": "name of the tyre",
    "load": "load_N = vertical load",
    "pressure": "pressure_bar = inflation pressure",
    "surface": "'flat' or 'drum'",
    "axes": " / ".join(CONVENTIONS) + "; there is no default",
}
_SPELLINGS = (*_PLAIN_KEYS, "load_N", "pressure_bar", "drum_radius_m", "speed_km_h", "temperature_C", "camber_deg")


@dataclass(frozen=True)
class Sidecar:
    """Content of a sidecar in SI units; ``kind`` is None when the file leaves it to the columns."""

    condition: Condition
    axes: str
    kind: str | None
    synthetic: bool
    notes: tuple[str, ...]


def read_sidecar(path: Path) -> Sidecar:
    """Read a sidecar.

    Parameters
    ----------
    path : Path
        TOML file with ``tyre``, ``load_N``, ``pressure_bar``, ``surface`` (``flat``, or ``drum`` with
        ``drum_radius_m``) and ``axes``; optionally ``kind``, ``rim``, ``speed_km_h``, ``temperature_C``,
        ``camber_deg`` (> 0 leaning right), ``synthetic`` and ``note``. Any unit known to
        ``tyre.recordings.units`` may stand at the end of a key.

    Returns
    -------
    Sidecar

    Raises
    ------
    InputError
        For a missing file, invalid TOML, an unknown, missing or doubled key, or a value out of range.
    """
    try:
        table = tomllib.loads(path.read_bytes().decode("utf-8-sig"))
    except FileNotFoundError:
        raise InputError(
            f"{path}: the sidecar is missing; write one with tyre, load_N, pressure_bar, surface and axes"
        ) from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None
    return _interpret(table, str(path))


def _interpret(table: Mapping[str, Any], where: str) -> Sidecar:
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key in _PLAIN_KEYS:
            base, si = key, _plain_value(key, value, where)
        else:
            base, si = _quantity(key, value, where)
        if base in values:
            raise InputError(f"{where}: {base} is given twice, the second time as {key!r}; keep one")
        values[base] = si
    for key, meaning in _REQUIRED.items():
        if key not in values:
            raise InputError(f"{where}: key {key!r} is missing ({meaning})")
    kind = values.get("kind")
    if kind is not None and kind not in KINDS:
        raise InputError(f"{where}: kind = {kind!r} is not one of {', '.join(KINDS)}")
    signs(values["axes"], where=where)
    condition = Condition(
        tyre=values["tyre"],
        load=values["load"],
        pressure=values["pressure"],
        surface=values["surface"],
        drum_radius=values.get("drum_radius"),
        rim=values.get("rim"),
        speed=values.get("speed"),
        temperature=values.get("temperature"),
        camber=values.get("camber", 0.0),
    )
    check_condition(condition, where=where)
    note = values.get("note", [])
    return Sidecar(
        condition=condition,
        axes=values["axes"],
        kind=kind,
        synthetic=values.get("synthetic", False),
        notes=(note,) if isinstance(note, str) else tuple(note),
    )


def _plain_value(key: str, value: Any, where: str) -> Any:
    if not isinstance(value, _PLAIN_KEYS[key]) or (
        isinstance(value, list) and not all(isinstance(item, str) for item in value)
    ):
        expected = {"synthetic": "true or false", "note": "text or a list of texts"}.get(key, "text in quotes")
        raise InputError(f"{where}: {key} = {value!r} must be {expected}")
    if isinstance(value, str) and not value.strip():
        raise InputError(f"{where}: {key} is empty")
    return value


def _quantity(key: str, value: Any, where: str) -> tuple[str, float]:
    found = split_unit(key, _QUANTITIES, where=where)
    if found is None:
        near = difflib.get_close_matches(key, _SPELLINGS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(f"{where}: key {key!r} is unknown (known: {', '.join(_SPELLINGS)}){hint}")
    base, unit = found
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(float(value)):
        raise InputError(f"{where}: {key} = {value!r} must be a number")
    return base, unit.factor * float(value) + unit.offset


def write_sidecar(recording: RigRun | PullTest, path: Path) -> None:
    """Write the sidecar of a recording in the units the reader documents (N, bar, km/h, deg, m)."""
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
        table["note"] = "synthetic: computed by a simulation, not measured"
    path.write_text(tomli_w.dumps({key: value for key, value in table.items() if value is not None}), encoding="utf-8")


def _printed(value: float) -> float:
    """Twelve digits, so that a value read and written again stays as it was printed."""
    return float(f"{value:.12g}")
