"""Read the seat geometry of a bicycle: a small TOML file, or the raw measurements of the neighbouring project."""

import math
from collections.abc import Iterable, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.rider.posture import POSTURES
from bicycle.rider.seat_geometry import DEFAULT_SD, FRAME_KEYS, HAND_KEYS, HUBS, RANGES, SADDLE, SeatGeometry
from tyre.base.errors import InputError, is_number, shown, unknown
from tyre.base.paths import data_root
from tyre.base.toml_file import read_toml

TOP_KEYS = ("description", "source", "values", "sd", "assumed", "posture")
RAW = ("lcs", "hbb", "lsp", "lst", "lamst", "whb", "LhbR", "LhbF")
"""What the raw ``*Measured.txt`` of BicycleParameters says of seat and bar (m, rad)."""


def packaged_geometry(bicycle_name: str) -> Traversable | None:
    """The packaged geometry of the packaged bicycle ``bicycle_name``; None where there is none."""
    file = data_root().joinpath("riders", "seat_geometry", f"{bicycle_name}.toml")
    return file if file.is_file() else None


def read_geometry(path: Path | Traversable, posture: str) -> SeatGeometry:
    """Read a geometry for a posture; what the file leaves out stays out.

    A TOML file has ``[values]`` with keys of :data:`bicycle.rider.seat_geometry.RANGES`, optionally ``[sd]`` with the
    same keys, ``assumed`` (a list of keys that are not measured) and tables ``[posture.drops]`` (or another posture)
    with keys of the hands that replace those of ``[values]``.

    Parameters
    ----------
    path : Path or Traversable
        ``.toml``, or the ``.txt`` of the neighbouring project.
    posture : str
        A key of :data:`bicycle.rider.posture.POSTURES`.

    Raises
    ------
    InputError
        No such file, unknown keys, values outside what is allowed, hands described twice or by half.
    """
    if path.name.lower().endswith(".txt"):
        return _raw(path)
    content = read_toml(path, "geometry file")
    for key in content:
        _known(path, "key", key, TOP_KEYS)
    values = _table(path, content, "values", tuple(RANGES))
    own = _table(path, _mapping(path, content, "posture", POSTURES), posture, HAND_KEYS)
    if any(key in own for key in (*HUBS, *SADDLE)):
        values = {key: value for key, value in values.items() if key not in (*HUBS, *SADDLE)}
    values |= own
    for key, value in values.items():
        low, high = RANGES[key]
        if not low <= value <= high:
            raise InputError(f"{path}: {key} = {value:g} is outside {low:g} to {high:g}; is the unit right?")
    _check_hands(path, values)
    sd = _table(path, content, "sd", tuple(RANGES))
    if any(value < 0 for value in sd.values()):
        raise InputError(f"{path}: a standard deviation must not be negative")
    assumed = content.get("assumed", [])
    if not isinstance(assumed, list):
        raise InputError(f"{path}: assumed = {shown(assumed)} must be a list of keys")
    for key in assumed:
        _known(path, "assumed key", key, tuple(values))
    kept = {key: sd.get(key, DEFAULT_SD[key]) for key in values}
    return SeatGeometry(values, kept, tuple(assumed), str(content.get("source", "")) or path.name)


def _raw(path: Path | Traversable) -> SeatGeometry:
    """Seat and bar of a file of ``key = value+/-sd`` lines; its many other keys are other measurements."""
    if not path.is_file():
        raise InputError(f"{path}: no such geometry file")
    found, spread = {}, {}
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").splitlines():
        key, _, value = line.partition("#")[0].replace("±", "+/-").partition("=")
        if key.strip() in RAW:
            number, _, sd = value.partition("+/-")
            try:
                found[key.strip()] = float(number)
                if sd.strip():
                    spread[key.strip()] = float(sd)
            except ValueError as error:
                raise InputError(f"{path}: {key.strip()} = {value.strip()!r} is not a number") from error
    missing = [key for key in RAW if key not in found]
    if missing:
        raise InputError(f"{path}: seat and bar need {', '.join(RAW)}; missing: {', '.join(missing)}")
    values = {
        **dict(zip(FRAME_KEYS, _frame(found), strict=True)),
        "hand_width_m": found["whb"], HUBS[0]: found["LhbR"], HUBS[1]: found["LhbF"],
    }  # fmt: skip
    sources = {**dict(zip(FRAME_KEYS, ("lcs", "hbb", "lamst", "lst"), strict=True)), "hand_width_m": "whb"}
    sources |= {HUBS[0]: "LhbR", HUBS[1]: "LhbF"}
    stated = {key: spread.get(raw, math.nan) for key, raw in sources.items()}
    stated["saddle_distance_m"] = math.hypot(spread.get("lsp", math.nan), spread.get("lst", math.nan))
    stated["seat_tube_angle_deg"] = math.degrees(stated["seat_tube_angle_deg"])
    kept = {key: DEFAULT_SD[key] if math.isnan(s) else s for key, s in stated.items()}
    return SeatGeometry(values, kept, (), path.name)


def _frame(raw: Mapping[str, float]) -> tuple[float, float, float, float]:
    return raw["lcs"], raw["hbb"], math.degrees(raw["lamst"]), raw["lsp"] + raw["lst"]


def _check_hands(path: object, values: Mapping[str, float]) -> None:
    given = [tuple(key in values for key in pair) for pair in (HUBS, SADDLE)]
    if any(any(pair) and not all(pair) for pair in given) or all(all(pair) for pair in given):
        raise InputError(
            f"{path}: give the hands either by {HUBS[0]} and {HUBS[1]} or by {SADDLE[0]} and {SADDLE[1]}, or leave "
            "all four out"
        )


def _mapping(path: object, content: Mapping[str, Any], name: str, allowed: Iterable[str]) -> Mapping[str, Any]:
    table = content.get(name, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{path}: {name} = {shown(table)} must be a table [{name}]")
    for key in table:
        _known(path, name, key, tuple(allowed))
    return table


def _table(path: object, content: Mapping[str, Any], name: str, allowed: Iterable[str]) -> dict[str, float]:
    table = _mapping(path, content, name, allowed)
    for key, value in table.items():
        if not is_number(value) or not math.isfinite(value):
            raise InputError(f"{path}: {key} = {shown(value)} of [{name}] must be a finite number")
    return {key: float(value) for key, value in table.items()}


def _known(path: object, kind: str, key: str, allowed: Iterable[str]) -> None:
    if key not in allowed:
        raise InputError(f"{path}: {unknown(kind, key, allowed)}")
