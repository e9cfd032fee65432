"""Read the seat geometry of a bicycle: a small TOML file, or the raw measurements of the neighbouring project."""

import math
from collections.abc import Mapping
from importlib.resources.abc import Traversable
from pathlib import Path

from bicycle.rider.posture import POSTURES
from bicycle.rider.seat_geometry import DEFAULT_SD, FRAME_KEYS, HAND_KEYS, HUBS, RANGES, SADDLE, SeatGeometry
from tyre.base.checks import Check, list_of, number, text
from tyre.base.errors import InputError, refuse_unknown
from tyre.base.key_value import read_key_values
from tyre.base.paths import data_root
from tyre.base.schema import by_name, maybe, read, table
from tyre.base.toml_file import read_toml


def _within(key: str) -> Check:
    low, high = RANGES[key]
    return number(least=low, most=high, outside=f"is outside {low:g} to {high:g}; is the unit right?")


GEOMETRY = table(
    {
        maybe("description", ""): text(), maybe("source", ""): text(),
        maybe("values", {}): table({maybe(key): _within(key) for key in RANGES}, kind="values"),
        maybe("sd", {}): by_name(
            number(least=0, outside="where a standard deviation must not be negative"), RANGES, kind="sd"
        ),
        maybe("assumed", []): list_of(text(), "must be a list of keys"),
        maybe("posture", {}): by_name(table({maybe(key): _within(key) for key in HAND_KEYS}), POSTURES, kind="posture"),
    }
)  # fmt: skip
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
    content = read(GEOMETRY, read_toml(path, "geometry file"), where=str(path))
    values, own = content["values"], content["posture"].get(posture, {})
    if any(key in own for key in (*HUBS, *SADDLE)):
        values = {key: value for key, value in values.items() if key not in (*HUBS, *SADDLE)}
    values = values | own
    _check_hands(path, values)
    refuse_unknown("assumed key", content["assumed"], values, where=str(path))
    kept = {key: content["sd"].get(key, DEFAULT_SD[key]) for key in values}
    return SeatGeometry(values, kept, tuple(content["assumed"]), content["source"] or path.name)


def _raw(path: Path | Traversable) -> SeatGeometry:
    """Seat and bar of a file of ``key = value+/-sd`` lines; its many other keys are other measurements."""
    if not path.is_file():
        raise InputError(f"{path}: no such geometry file")
    found, spread = read_key_values(path, RAW, kind="measurement", others=True)
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
