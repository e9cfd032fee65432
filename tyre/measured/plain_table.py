"""Plain tables of tyres whose header names quantities and units in the ways of other laboratories."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tyre.formats.sheet import ROW, Rows, Sheet, read_sheet, split_unit
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, hint, is_number, nearest_name, shown
from tyre.ground.number_with_sd import MeasuredNumber, measured_number
from tyre.ground.text_table import number_in
from tyre.ground.units import factor_to_si, is_unit

# quantities and their units in a tyre table, and the names of columns in small letters
UNITS: Mapping[str, str] = {
    "load": "N", "pressure": "bar", "cornering_stiffness": "N/deg", "lateral_stiffness": "N/mm",
    "relaxation_length": "mm", "pneumatic_trail": "mm", "camber_stiffness": "N/deg",
}  # fmt: skip
NAMES: Mapping[str, str] = {name: name for name in UNITS} | {
    "fz": "load",
    "f_z": "load",
    "vertical_load": "load",
    "wheel_load": "load",
    "normal_load": "load",
    "p": "pressure",
    "inflation_pressure": "pressure",
    "inflation": "pressure",
    "c": "cornering_stiffness",
    "c_alpha": "cornering_stiffness",
    "calpha": "cornering_stiffness",
    "c_fy": "cornering_stiffness",
    "cfy": "cornering_stiffness",
    "k": "lateral_stiffness",
    "k_y": "lateral_stiffness",
    "ky": "lateral_stiffness",
    "sigma": "relaxation_length",
    "sigma_alpha": "relaxation_length",
    "relaxation": "relaxation_length",
    "trail": "pneumatic_trail",
    "c_gamma": "camber_stiffness",
    "cgamma": "camber_stiffness",
}
# what the words of a column are about, and columns of the camber at which a row was measured, in small letters
WORDS: Mapping[str, str] = {
    "tyre": "tyre",
    "tire": "tyre",
    "tyre_name": "tyre",
    "tire_name": "tyre",
    "surface": "surface",
}
CAMBERS = ("camber", "camber_angle", "inclination", "inclination_angle")
MAY_BE_EMPTY = ("pneumatic_trail", "camber_stiffness")
TYPING_ERROR = 0.85  # share of letters in common with a known name: vertical_ and lateral_stiffness have 0.8


class Column(NamedTuple):
    """A column of a plain table."""

    quantity: str  # name in velotyre, a key of :data:`UNITS`
    spread: bool  # it holds standard deviations
    unit: str  # in which the cells are written; ``%`` of some standard deviations


@dataclass(frozen=True)
class PlainTable:
    """The rows of one tyre."""

    columns: Mapping[str, Array]  # by the names of velotyre, such as load_N
    places: list[str]  # of the rows in the file: line 3
    words: dict[str, str]  # tyre and surface, where a column names them
    notes: list[str]  # a line each, for the reader


def read_plain_table(path: Path, *, tyre: str = "") -> PlainTable:
    """Read a table whose header names quantities and units in other ways; ``tyre`` chooses one of several."""
    sheet = read_sheet(path, kind="tyre conditions")
    notes: list[str] = []
    rows, words = _rows_of_one_tyre(sheet, tyre, notes)
    columns = {n: column for n, name in enumerate(sheet.header) if (column := _column(name, path))}
    unused = [name for n, name in enumerate(sheet.header) if n not in columns]
    unused = [name for name in unused if _plain_name(name) not in (*WORDS, *CAMBERS)]
    if unused:
        notes.append(f"columns of {path.name} that are not used: {', '.join(unused)}")
    order = sorted(columns, key=lambda n: columns[n].spread)  # values first, then their standard deviations
    numbers: list[dict[str, float]] = []
    for place, cells in rows:
        row: dict[str, float] = {}
        for n in order:
            where = f"{path}, {place}, column {sheet.header[n]!r}"
            cell = _cell(cells[n], columns[n], row, where=where)
            if twice := set(cell) & set(row):
                raise InputError(f"{where}: two columns give {twice.pop()}; keep one")
            row |= cell
        numbers.append(row)
        if odd := set(row) ^ set(numbers[0]):
            raise InputError(f"{path}, {place}: {min(odd)} is there in some rows only; give it in all or in none")
    places = [place for place, _ in rows]
    arrays = {key: np.array([row[key] for row in numbers]) for key in numbers[0]}
    return PlainTable(_one_length(arrays, path, places), places, words, notes)


def _plain_name(column: str) -> str:
    return split_unit(column)[0].lower().replace(" ", "_")


def _rows_of_one_tyre(sheet: Sheet, tyre: str, notes: list[str]) -> tuple[Rows, dict[str, str]]:
    """Rows of the upright wheel with the chosen ``tyre``, and the words on them."""
    rows: Rows = list(sheet.rows)
    words: dict[str, str] = {}
    about = {WORDS[name]: n for n, column in enumerate(sheet.header) if (name := _plain_name(column)) in WORDS}
    if tyre and "tyre" not in about:
        raise InputError(f"{sheet.path}: no column states which rows are of the tyre {tyre!r}; name it tyre")
    for key, n in sorted(about.items(), reverse=True):  # the tyre first
        texts = list(dict.fromkeys(str(cells[n]).strip() for _, cells in rows))
        chosen = tyre if key == "tyre" and tyre else texts[0]
        if "" in texts:
            raise InputError(f"{sheet.path}: column {sheet.header[n]!r} is empty in a row; fill it in all rows")
        if chosen not in texts:
            raise InputError(f"{sheet.path}: no tyre {chosen!r}{hint(chosen, texts)}; there are {', '.join(texts)}")
        if len(texts) > 1 and key == "tyre" and not tyre:
            raise InputError(
                f"{sheet.path}: holds the tyres {', '.join(texts)}; choose one, as {sheet.path.name}{ROW}{chosen}"
            )
        if len(texts) > 1 and key == "surface":
            raise InputError(f"{sheet.path}: holds the surfaces {', '.join(texts)}; write a table for each")
        words[key] = chosen
        rows = [(place, cells) for place, cells in rows if str(cells[n]).strip() == chosen]
    for n, name in enumerate(sheet.header):
        if _plain_name(name) in CAMBERS:
            leaning = [place for place, cells in rows if number_in(str(cells[n])) != 0]
            rows = [(place, cells) for place, cells in rows if place not in leaning]
            if not rows:
                raise InputError(
                    f"{sheet.path}: column {name!r} is 0 in no row; stiffnesses are those of an upright wheel"
                )
            if leaning:
                notes.append(f"{sheet.path.name}: rows of a leaning wheel ({name} not 0) are not used: {len(leaning)}")
    return rows, words


def _cell(cell: Any, column: Column, row: Mapping[str, float], *, where: str) -> dict[str, float]:
    """Return the numbers that a cell gives by their names; ``row`` holds the values of its row."""
    quantity, spread, unit = column
    key = _key(quantity, sd=spread)
    if quantity in MAY_BE_EMPTY and cell == "":
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
    name = f"{quantity}_sd" if sd else quantity
    return f"{name}_{UNITS[quantity].replace('/', '_per_')}"


def _column(name: str, path: Path) -> Column | None:
    """Quantity and unit of a column; None where its name is none that is known, nor near to one."""
    base, unit = split_unit(name)
    if base.lower() in ("sd", "std", "u"):  # sd(C)
        base, unit = f"{base} {unit}", ""
    match = re.match(r"^(?:sd|std|u)[ _(]+(.*?)\)?$|^(.*?)[ _](?:sd|std)$", base, re.IGNORECASE)
    base, spread = (match[1] or match[2], True) if match else (base, False)
    # ``load_kN`` or ``C_sd_N_per_rad`` is split after the longest name whose rest is a unit
    parts = base.replace(" ", "_").split("_")
    for count in range(len(parts) - 1, 0, -1):
        if unit:
            break
        start, unit_text = parts[:count], "_".join(parts[count:])
        sd = len(start) > 1 and start[-1].lower() in ("sd", "std")
        if "_".join(start[: len(start) - sd]).lower() in NAMES and is_unit(unit_text):
            base, spread, unit = "_".join(start[: len(start) - sd]), spread or sd, unit_text
            break
    quantity = NAMES.get(base.strip().lower().replace(" ", "_"))
    where = f"{path}, column {name!r}"
    if quantity is None:
        suggestion = nearest_name(
            _plain_name(name), [*(_key(known_unit) for known_unit in UNITS), *NAMES], cutoff=TYPING_ERROR
        )
        if suggestion:
            raise InputError(
                f"{path}: unknown column {shown(name)}; did you mean {suggestion!r}? else give it another name"
            )
        return None
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
