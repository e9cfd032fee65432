"""Tyre tables of others: columns under common names, each with a unit, made those of :mod:`tyre.maps.table_io`."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError, is_number, unknown
from tyre.base.measured_number import MeasuredNumber, measured_number
from tyre.base.sheet import read_sheet, split_unit
from tyre.base.unit_words import factor_to_si, is_unit

UNITS: Mapping[str, str] = {
    "load": "N", "pressure": "bar", "cornering_stiffness": "N/deg", "lateral_stiffness": "N/mm",
    "relaxation_length": "mm", "pneumatic_trail": "mm",
}  # fmt: skip
"""Quantities and their units in a tyre table."""
NAMES: Mapping[str, str] = {name: name for name in UNITS} | {
    "fz": "load", "f_z": "load", "vertical_load": "load", "wheel_load": "load", "normal_load": "load",
    "p": "pressure", "inflation_pressure": "pressure",
    "c": "cornering_stiffness", "c_alpha": "cornering_stiffness", "calpha": "cornering_stiffness",
    "c_fy": "cornering_stiffness", "cfy": "cornering_stiffness",
    "k": "lateral_stiffness", "k_y": "lateral_stiffness", "ky": "lateral_stiffness",
    "sigma": "relaxation_length", "sigma_alpha": "relaxation_length", "relaxation": "relaxation_length",
    "trail": "pneumatic_trail",
}  # fmt: skip
"""Names of columns, small letters, by quantity."""
WORDS = ("tyre", "surface", "source", "description")
AGREE = 0.05
"""Relative difference of a relaxation length and C/K that rounding may make."""
_SD = re.compile(r"^(?:sd|std|u)[ _(]+(.*?)\)?$|^(.*?)[ _](?:sd|std)$", re.IGNORECASE)


class Column(NamedTuple):
    """Quantity of a column, whether it is of a standard deviation, and its unit."""

    quantity: str
    spread: bool
    unit: str


def read_named_columns(path: Path) -> dict[str, Array]:
    """Columns of a table whose header names quantities and units in other ways.

    ``C [kN/rad]``, ``Fz (N)``, ``pressure_psi``, ``cornering_stiffness_sd_N_per_rad``, ``sd(K) [N/mm]``,
    ``relaxation_length_sd [%]``. A cell holds a number, or text such as ``95.2 ± 1.1``.

    Parameters
    ----------
    path : Path
        ``.csv``.

    Returns
    -------
    dict of str to ndarray, shape (rows,)
        Under the names and in the units of :mod:`tyre.maps.table_io`.

    Raises
    ------
    InputError
        An unknown column, one without unit or with one of another quantity, a cell that is no number, or a relaxation
        length that is not C/K.
    """
    sheet = read_sheet(path, kind="tyre conditions")
    columns = [_column(name, path) for name in sheet.header]
    order = sorted(range(len(columns)), key=lambda n: columns[n].spread)  # values first, then their standard deviations
    found: dict[str, list[float]] = {}
    for place, cells in sheet.rows:
        row: dict[str, float] = {}
        for n in order:
            where = f"{path}, {place}, column {sheet.header[n]!r}"
            for key, value in _cell(cells[n], columns[n], row, where=where):
                if key in row:
                    raise InputError(f"{where}: two columns give {key}; keep one")
                row[key] = value
        if found and set(row) != set(found):
            odd = sorted(set(row) ^ set(found))[0]
            raise InputError(f"{path}, {place}: {odd} is there in some rows only; give it in all or in none")
        for key, value in row.items():
            found.setdefault(key, []).append(value)
    arrays = {key: np.array(values) for key, values in found.items()}
    return _one_length(arrays, path, [place for place, _ in sheet.rows])


def _cell(cell: Any, column: Column, row: Mapping[str, float], *, where: str) -> Iterator[tuple[str, float]]:
    """Names and numbers of the tyre table that a cell gives; ``row`` holds the values of its row."""
    quantity, spread, unit = column
    key = _key(quantity, sd=spread)
    if quantity == "pneumatic_trail" and cell == "":
        yield key, float("nan")
        return
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
    yield key, number.value
    if number.sd is not None:
        yield _key(quantity, sd=True), number.sd


def comments(path: Path) -> dict[str, str]:
    """What ``# tyre: ...``, ``# surface: ...`` and the like say at the head of a CSV.

    Parameters
    ----------
    path : Path
    """
    found: dict[str, str] = {}
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").splitlines():
        match = re.fullmatch(r"\s*#\s*(\w+)\s*[:=]\s*(.*?)\s*", line)
        if match and match[1] in WORDS:
            found.setdefault(match[1], match[2].strip("\"'"))
    return found


def _key(quantity: str, *, sd: bool = False) -> str:
    return f"{quantity}{'_sd' * sd}_{UNITS[quantity].replace('/', '_per_')}"


def _column(name: str, path: Path) -> Column:
    base, unit = split_unit(name)
    if base.lower() in ("sd", "std", "u"):  # sd(C)
        base, unit = f"{base} {unit}", ""
    match = _SD.match(base)
    if match:
        base = match[1] or match[2]
    spread = match is not None
    if not unit:
        base, spread, unit = _behind(base, spread=spread)
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


def _behind(base: str, *, spread: bool) -> tuple[str, bool, str]:
    """``load_kN`` or ``C_sd_N_per_rad``: the longest name at the start whose rest is a unit."""
    parts = base.replace(" ", "_").split("_")
    for count in range(len(parts) - 1, 0, -1):
        start, rest = parts[:count], "_".join(parts[count:])
        sd = len(start) > 1 and start[-1].lower() in ("sd", "std")
        name = "_".join(start[:-1] if sd else start)
        if name.lower() in NAMES and is_unit(rest):
            return name, spread or sd, rest
    return base, spread, ""


def _one_length(columns: dict[str, Array], path: Path, places: list[str]) -> dict[str, Array]:
    """The columns with one of relaxation length and lateral stiffness, which must agree where both are there."""
    length, stiffness, cornering = (_key(q) for q in ("relaxation_length", "lateral_stiffness", "cornering_stiffness"))
    if not {length, stiffness, cornering} <= set(columns):
        return columns
    expected = np.degrees(columns[cornering]) / columns[stiffness]  # N/rad over N/mm: mm
    off = np.abs(columns[length] - expected) > AGREE * np.abs(expected)
    if off.any():
        row = int(np.argmax(off))
        raise InputError(
            f"{path}, {places[row]}: relaxation length {columns[length][row]:.4g} mm, but cornering over lateral "
            f"stiffness is {expected[row]:.4g} mm; correct one of the three, or leave one column out"
        )
    spreads = [_key(q, sd=True) in columns for q in ("relaxation_length", "lateral_stiffness")]
    left_out = "lateral_stiffness" if spreads == [True, False] else "relaxation_length"
    return {key: values for key, values in columns.items() if not key.startswith(left_out)}
