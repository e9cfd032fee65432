"""Bench tests of the steering: the torque that holds or turns it while the bicycle stands.

A row is one reading: a torque, or a force at a lever arm, with the steer angle, and the rate or the direction in which
the steering was turning. Units stand in the names of the columns: ``steer_deg``, ``steer_torque_N_m``,
``lever_arm_mm``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.responses.response import LINEAR_UP_TO
from tyre.base.checks import number
from tyre.base.csv_table import Columns, read_cells, read_columns
from tyre.base.errors import InputError, refuse_unknown, unknown
from tyre.base.schema import path_key, read, table
from tyre.channels.units import find_unit

QUANTITIES = {
    "steer_torque_sd": "moment", "steer_torque": "moment", "steer_rate": "angular rate", "steer": "angle",
    "force_sd": "force", "force": "force", "lever_arm": "length", "front_load": "force",
}  # fmt: skip
"""What the columns with units measure; a name is one of these and a unit, the longest that fits."""

TESTS = {"hold": "held still", "sweep": "turned slowly up and down", "damper": "turned at a steady rate"}
CONDITIONS = {
    "lifted": "front wheel off the ground", "free_plate": "front wheel on a plate that slides and turns freely",
    "floor": "front wheel on the floor",
}  # fmt: skip
DIRECTIONS = {"up": 1.0, "down": -1.0, "": 0.0}
EXAMPLES = (
    "steer_torque_N_m", "steer_torque_sd_N_m", "steer_rate_rad_s", "steer_rad", "force_N", "force_sd_N", "lever_arm_m",
    "front_load_N",
)  # fmt: skip
"""A column of each of these, in SI."""

OTHER_UNITS = "a number's unit stands in its name, and may be another one (steer_deg, lever_arm_mm)"
TEXTS = ("test", "condition", "direction", "group")
TABLE = table(path_key("table", "FILE.csv"))
FEWEST = 3
LARGEST = {"rate": (50.0, "rad/s"), "torque": (1e3, "N m"), "arm": (2.0, "m"), "load": (1e4, "N")}
ANY = number()


@dataclass(frozen=True)
class Reading:
    """One reading: ``torque`` (N m, to the right) at ``steer`` (rad) and ``rate`` (rad/s), with its ``sd``.

    ``direction`` is 1 where the steering was turning to the right, -1 to the left, 0 where it was held; ``arm`` (m) is
    that of a force, 0 of a torque; ``load`` (N) that of the front wheel, nan where it was not measured.
    """

    test: str
    condition: str
    steer: float
    rate: float
    direction: float
    torque: float
    sd: float
    arm: float = 0.0
    load: float = math.nan
    group: str = ""


def read_bench(content: Mapping[str, Any], folder: Path) -> tuple[tuple[Reading, ...], tuple[str, ...]]:
    """Readings of the table ``[bench]``, and notes on what was assumed.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the file that it names is.

    Raises
    ------
    InputError
        See :func:`read_columns`; also a column without unit or in one of another quantity, a test, condition or
        direction that is not known, a number out of range, a torque and a force in one row or neither, a force without
        its arm, no sd, a damper test without its rate, a load of a lifted wheel, a row twice, fewer than three rows.
    """
    path = folder / read(TABLE, content, section="bench")["table"]
    factors = _columns(path)
    columns = read_columns(
        path, numbers=dict.fromkeys(factors, _cell), texts=TEXTS, needed=("test", "condition"),
    )  # fmt: skip
    named = {name: stem for name, (stem, _) in factors.items()}
    if "steer" not in named.values():
        raise InputError(f"{path}: the column steer_deg or steer_rad is missing; every reading is at a steer angle")
    angle = next(name for name, stem in named.items() if stem == "steer")
    unit = (angle.removeprefix("steer").lstrip("_"), factors[angle][1])
    readings: list[Reading] = []
    lines: dict[str, int] = {}
    for row, line in enumerate(columns.lines):
        where = f"{path}, line {line}"
        cells = {stem: float(columns.numbers[name][row]) * factors[name][1] for name, stem in named.items()}
        reading = _reading(where, cells, {name: columns.texts.get(name, [""] * (row + 1))[row] for name in TEXTS}, unit)
        same = repr(reading)
        if same in lines:
            raise InputError(f"{where}: the same reading as line {lines[same]}; keep one, or it counts twice")
        lines[same] = line
        readings.append(reading)
    if len(readings) < FEWEST:
        raise InputError(f"{path}: {len(readings)} row(s) cannot be diagnosed; give at least {FEWEST} readings")
    return tuple(readings), _notes(readings, columns)


def _cell(value: Any) -> float:
    """A number, or an empty cell."""
    return math.nan if value == "" else float(ANY(value))


def _columns(path: Path) -> dict[str, tuple[str, float]]:
    """Of each column with a unit: what it is, and the factor to SI."""
    header = read_cells(
        path, kind="table; paths are relative to the file that names it", example="test, condition"
    ).header
    found: dict[str, tuple[str, float]] = {}
    for name in header:
        stem = next((stem for stem in QUANTITIES if name == stem or name.startswith(f"{stem}_")), None)
        if stem is None:
            refuse_unknown("column", [name], [*TEXTS, *EXAMPLES], where=str(path), more=OTHER_UNITS)
            continue
        if stem in (other for other, _ in found.values()):
            raise InputError(f"{path}: two columns give the {stem}; keep one")
        unit, quantity = name.removeprefix(stem).lstrip("_"), QUANTITIES[stem]
        plain = unit.replace("_", "") if quantity in ("moment", "force", "length") else unit
        found[name] = (stem, find_unit(plain, quantity, where=f"{path}: column {name}").factor)
    return found


def _reading(where: str, cells: Mapping[str, float], texts: Mapping[str, str], angle: tuple[str, float]) -> Reading:
    """A reading; ``angle`` is the unit of the steer angle and its factor to rad, for what is said of it."""
    for name, allowed in (("test", TESTS), ("condition", CONDITIONS), ("direction", DIRECTIONS)):
        if texts[name] not in allowed:
            raise InputError(f"{where}: {unknown(name, texts[name], [word for word in allowed if word])}")
    test, condition, direction = texts["test"], texts["condition"], DIRECTIONS[texts["direction"]]
    steer, rate = cells["steer"], cells.get("steer_rate", math.nan)
    if not abs(steer) <= LINEAR_UP_TO:
        within = f"+-{LINEAR_UP_TO:g} rad ({math.degrees(LINEAR_UP_TO):.0f} deg)"
        within = within if angle[1] == 1 else f"+-{LINEAR_UP_TO / angle[1]:.4g} {angle[0]}"
        raise InputError(
            f"{where}: the steer angle is {steer / angle[1]:g} {angle[0]}; give one within {within}, beyond which the "
            "geometry is not linear"
        )
    torque, sd, arm = _torque(where, cells)
    if test == "damper" and not abs(rate) > 0:
        raise InputError(f"{where}: a damper test needs a steer_rate other than 0")
    if test != "damper" and not (math.isnan(rate) or rate == 0):
        raise InputError(f"{where}: a {test} test has no steer_rate; call it a damper test, or leave the cell empty")
    if test == "sweep" and not direction:
        raise InputError(f"{where}: a sweep needs a direction, up (to the right) or down")
    if test == "damper":
        if direction and direction != math.copysign(1.0, rate):
            raise InputError(
                f"{where}: the direction {texts['direction']} is not that of the steer_rate, {rate:g} rad/s"
            )
        direction = math.copysign(1.0, rate)
    load = cells.get("front_load", math.nan)
    if condition == "lifted" and load > 0:
        raise InputError(f"{where}: a lifted wheel carries no front_load; leave the cell empty")
    rate = rate if test == "damper" else 0.0
    for what, value in (("rate", rate), ("torque", torque), ("arm", arm), ("load", load)):
        most, unit = LARGEST[what]
        if abs(value) > most or (what == "load" and value < 0):
            raise InputError(f"{where}: the {what} is {value:g} {unit}; it must lie within 0 .. {most:g} in size")
    return Reading(test, condition, steer, rate, direction, torque, sd, arm, load, texts["group"])


def _torque(where: str, cells: Mapping[str, float]) -> tuple[float, float, float]:
    """Torque (N m), its sd, and the arm of the force (m), 0 where the torque was read."""
    there = [stem for stem in ("steer_torque", "force") if not math.isnan(cells.get(stem, math.nan))]
    if len(there) != 1:
        fault = "both say the same; keep one" if there else "is missing: give a torque, or a force and its lever_arm"
        raise InputError(f"{where}: {'steer_torque and force ' if there else 'the torque '}{fault}")
    arm = 1.0
    if there == ["force"]:
        arm = cells.get("lever_arm", math.nan)
        if not arm > 0:
            raise InputError(f"{where}: a force needs a positive lever_arm, its distance from the steer axis")
    if f"{there[0]}_sd" not in cells:
        raise InputError(
            f"{where}: the column {there[0]}_sd is missing, with its unit, such as {there[0]}_sd_"
            f"{'N' if there == ['force'] else 'N_m'}; give the scatter of repeated readings or the scale's division"
        )
    sd = cells[f"{there[0]}_sd"]
    if not sd > 0:
        raise InputError(
            f"{where}: {there[0]}_sd must be positive; give the scatter of repeated readings or the scale's division"
        )
    return cells[there[0]] * arm, sd * arm, arm if there == ["force"] else 0.0


def _notes(readings: list[Reading], columns: Columns) -> tuple[str, ...]:
    notes = []
    where = {reading.condition for reading in readings}
    if any(r.test == "hold" and not r.direction for r in readings):
        notes.append("a hold without a direction counts as the middle of what dry friction allows")
    if where - {"lifted"} and any(math.isnan(r.load) for r in readings if r.condition != "lifted"):
        notes.append(
            "front_load is not given: the front wheel carries what the bicycle's parameters say, rider included"
        )
    if "floor" in where:
        notes.append("on the floor: the tyre slides in its patch, and the rear frame, held upright, is free to yaw")
    return tuple(notes)
