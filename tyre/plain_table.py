"""Plain tables of tyres whose header names quantities and units in the ways of other laboratories."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tyre.arrays import Array
from tyre.errors import InputError, is_number, unknown
from tyre.measured_number import MeasuredNumber, measured_number
from tyre.sheet import read_sheet, split_unit
from tyre.units import factor_to_si, is_unit

# quantities and their units in a tyre table, and the names of columns in small letters
UNITS: Mapping[str, str] = {
    "load": "N", "pressure": "bar", "cornering_stiffness": "N/deg", "lateral_stiffness": "N/mm",
    "relaxation_length": "mm", "pneumatic_trail": "mm",
}  # fmt: skip
NAMES: Mapping[str, str] = {name: name for name in UNITS} | {
    "fz": "load", "f_z": "load", "vertical_load": "load", "wheel_load": "load", "normal_load": "load",
    "p": "pressure", "inflation_pressure": "pressure",
    "c": "cornering_stiffness", "c_alpha": "cornering_stiffness", "calpha": "cornering_stiffness",
    "c_fy": "cornering_stiffness", "cfy": "cornering_stiffness",
    "k": "lateral_stiffness", "k_y": "lateral_stiffness", "ky": "lateral_stiffness",
    "sigma": "relaxation_length", "sigma_alpha": "relaxation_length", "relaxation": "relaxation_length",
    "trail": "pneumatic_trail",
}  # fmt: skip


class Column(NamedTuple):
    """A column of a plain table."""

    quantity: str
    spread: bool  # it holds standard deviations
    unit: str


def read_named_columns(path: Path) -> dict[str, Array]:
    """Read the columns of a table whose header names quantities and units in other ways."""
    sheet = read_sheet(path, kind="tyre conditions")
    columns = [_column(name, path) for name in sheet.header]
    order = sorted(range(len(columns)), key=lambda n: columns[n].spread)  # values first, then their standard deviations
    found: list[dict[str, float]] = []
    for place, cells in sheet.rows:
        row: dict[str, float] = {}
        for n in order:
            where = f"{path}, {place}, column {sheet.header[n]!r}"
            given = _cell(cells[n], columns[n], row, where=where)
            if twice := set(given) & set(row):
                raise InputError(f"{where}: two columns give {twice.pop()}; keep one")
            row |= given
        found.append(row)
        if odd := set(row) ^ set(found[0]):
            raise InputError(f"{path}, {place}: {min(odd)} is there in some rows only; give it in all or in none")
    arrays = {key: np.array([row[key] for row in found]) for key in found[0]} if found else {}
    return _one_length(arrays, path, [place for place, _ in sheet.rows])


def _cell(cell: Any, column: Column, row: Mapping[str, float], *, where: str) -> dict[str, float]:
    """Return the numbers that a cell gives by their names; ``row`` holds the values of its row."""
    quantity, spread, unit = column
    key = _key(quantity, sd=spread)
    if quantity == "pneumatic_trail" and cell == "":
        return {key: math.nan}
    text = repr(float(cell)) if is_number(cell) else str(cell)
    if unit == "%":
        if _key(quantity) not in row:
            raise InputError(f"{where}: a standard deviation of {quantity}, but no column of it")
        number = measured_number(text.rstrip("% "), where=where, key=quantity)
        number = MeasuredNumber(number.value * abs(row[_key(quantity)]) / 100, number.sd)
    else:
        number = measured_number(text, where=where, key=quantity, si=UNITS[quantity], unit=unit)
    if spread and number.sd is not None:
        raise InputError(f"{where}: a standard deviation has none of its own; give one number")
    return {key: number.value} | ({} if number.sd is None else {_key(quantity, sd=True): number.sd})


def _key(quantity: str, *, sd: bool = False) -> str:
    return f"{quantity}{'_sd' * sd}_{UNITS[quantity].replace('/', '_per_')}"


def _column(name: str, path: Path) -> Column:
    base, unit = split_unit(name)
    if base.lower() in ("sd", "std", "u"):  # sd(C)
        base, unit = f"{base} {unit}", ""
    match = re.match(r"^(?:sd|std|u)[ _(]+(.*?)\)?$|^(.*?)[ _](?:sd|std)$", base, re.IGNORECASE)
    base, spread = (match[1] or match[2], True) if match else (base, False)
    # ``load_kN`` or ``C_sd_N_per_rad`` is split after the longest name whose rest is a unit
    parts = base.replace(" ", "_").split("_")
    for count in range(len(parts) - 1, 0, -1) if not unit else ():
        start, rest = parts[:count], "_".join(parts[count:])
        sd = len(start) > 1 and start[-1].lower() in ("sd", "std")
        if "_".join(start[: len(start) - sd]).lower() in NAMES and is_unit(rest):
            base, spread, unit = "_".join(start[: len(start) - sd]), spread or sd, rest
            break
    quantity = NAMES.get(base.strip().lower().replace(" ", "_"))
    where = f"{path}, column {name!r}"
    if quantity is None:
        words = unknown("column", name, [*(_key(one) for one in UNITS), *NAMES])
        raise InputError(f"{path}: {words}; units stand in brackets or behind: C [N/deg], load_kN")
    if not unit:
        raise InputError(f"{where}: no unit; write it in brackets, {base} [{UNITS[quantity]}]")
    if unit == "%" and not spread:
        raise InputError(f"{where}: only a standard deviation is given in per cent")
    if unit != "%":
        factor_to_si(unit, UNITS[quantity], where=where)
    return Column(quantity, spread, unit)


def _one_length(columns: dict[str, Array], path: Path, places: list[str]) -> dict[str, Array]:
    """Drop one of relaxation length and lateral stiffness, which must agree, if both are there."""
    length, stiffness, cornering = (_key(q) for q in ("relaxation_length", "lateral_stiffness", "cornering_stiffness"))
    if not {length, stiffness, cornering} <= set(columns):
        return columns
    expected = np.degrees(columns[cornering]) / columns[stiffness]  # N/rad over N/mm: mm
    off = np.abs(columns[length] - expected) > 0.05 * np.abs(expected)  # rounding of a source
    if off.any():
        row = int(np.argmax(off))
        raise InputError(
            f"{path}, {places[row]}: relaxation length {columns[length][row]:.4g} mm, but cornering over lateral "
            f"stiffness is {expected[row]:.4g} mm; correct one of the three, or leave one column out"
        )
    spreads = [_key(q, sd=True) in columns for q in ("relaxation_length", "lateral_stiffness")]
    left_out = "lateral_stiffness" if spreads == [True, False] else "relaxation_length"
    return {key: values for key, values in columns.items() if not key.startswith(left_out)}
