"""Identified coefficients of the canonical equations M q'' + v C1 q' + (g K0 + v^2 K2) q = T + H F, q = (lean, steer).

One row for each coefficient of each subset of the runs (a rider in an environment). ``difference_percent`` is that to
Whipple's value of the same rider; it is turned round to get that value. ``A`` stands for all riders or environments:
such unions hold the data of other rows and count only for Whipple's values.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError, is_number, shown, unknown

ROLL = ("M_phi_delta", "C1_phi_delta", "K0_phi_delta")
STEER = ("M_delta_delta", "C1_delta_phi", "C1_delta_delta", "K0_delta_delta", "K2_delta_delta", "H_delta_F")
COEFFICIENTS = (*ROLL, *STEER)
"""What the regressions of the roll and of the steer equation leave free (Moore 2012, canonical identification)."""

UNITS = {"M": "kg m^2", "C1": "kg m", "K0": "kg m", "K2": "kg", "H": "m"}
ALL = "A"
SPEEDS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0)  # m/s
BAND = (0.3, 3.0)  # Hz
FASTEST, HIGHEST = 60.0, 50.0
FEWEST = 4  # subsets from which a scatter can be had: Student's t with fewer has no variance
PERCENT = 0.1 / math.sqrt(12)  # rounding of a printed percentage
DISAGREE = 5.0  # sd by which two rows may differ on Whipple's value


@dataclass(frozen=True)
class CanonicalTable:
    """Coefficients (subsets, 9) in the order of :data:`COEFFICIENTS`, SI, and how they were excited.

    ``sd`` holds the stated one, the scatter between subsets, and the rounding of ``whipple``, which is None where the
    table does not give it: the bicycle's own coefficients are then the base.
    """

    subsets: tuple[str, ...]
    value: Array
    sd: Array
    whipple: Array | None
    speeds: tuple[float, ...] = SPEEDS
    band: tuple[float, float] = BAND


def unit(coefficient: str) -> str:
    """SI unit of a coefficient."""
    return UNITS[coefficient.split("_")[0]]


def read_canonical(table: Mapping[str, Any], folder: Path) -> tuple[CanonicalTable, tuple[str, ...]]:
    """The table ``[canonical]`` and notes on what was assumed.

    Raises
    ------
    InputError
        See :func:`read_columns`; also unknown coefficients, other units, repeated or missing rows, an sd that is not
        positive, fewer than four subsets, rows of a rider that disagree on Whipple's value, a wrong band or speed.
    """
    keys = ("table", "speeds_m_s", "band_hz")
    for key in table:
        if key not in keys:
            raise InputError(f"[canonical]: {unknown('key', key, keys)}")
    if not isinstance(table.get("table"), str):
        what = f"table = {shown(table['table'])} must be a path in quotes" if "table" in table else "no table"
        raise InputError(f'[canonical]: {what}; write table = "FILE.csv"')
    speeds = _ascending(table.get("speeds_m_s", list(SPEEDS)), "speeds_m_s", FASTEST, "m/s")
    band = _ascending(table.get("band_hz", list(BAND)), "band_hz", HIGHEST, "Hz")
    if len(band) != 2:
        raise InputError(f"[canonical]: band_hz has {len(band)} numbers; write [lowest, highest]")
    path = folder / table["table"]
    cells, differs = _cells(path)
    subsets = [key for key in dict.fromkeys(key[:2] for key in cells) if ALL not in key]
    if len(subsets) < FEWEST:
        raise InputError(
            f"{path}: {len(subsets)} subsets that share no runs ({ALL} is all of them); at least {FEWEST} are needed, "
            "for the scatter between them is their noise"
        )
    for subset in subsets:
        missing = [name for name in COEFFICIENTS if (*subset, name) not in cells]
        if missing:
            raise InputError(f"{path}: rider {subset[0]}, environment {subset[1]} lacks {', '.join(missing)}")
    value, stated = (np.array([[cells[*s, name][k] for name in COEFFICIENTS] for s in subsets]) for k in (0, 1))
    whipple, rounding = (None, np.zeros_like(value))
    if differs:
        both = np.array([[_whipple(path, cells, s[0], name) for name in COEFFICIENTS] for s in subsets])
        whipple, rounding = both[..., 0], both[..., 1]
    n = len(subsets)
    scatter = (value - whipple if whipple is not None else value).var(0, ddof=1)
    between = np.maximum(scatter - (stated**2).mean(0), 0) * (n - 1) / (n - 3)
    times = np.sqrt(scatter / (stated**2).mean(0))
    notes = [
        f"noise: the scatter between {n} subsets of the runs, {times.min():.1f} to {times.max():.0f} times the stated "
        f"sd, widened for its {n - 1} degrees of freedom (variance of Student's t); coefficients count as independent. "
        f"Being taken from these rows, it leaves a perfect model with chi^2 of about {len(COEFFICIENTS) * (n - 3)} of "
        f"{value.size}: goodness of fit says little here, held-out subsets and the posterior decide",
    ]
    unions = sorted({"-".join(key[:2]) for key in cells if ALL in key[:2]})
    if unions:
        notes.append(f"not used, because they hold the runs of other subsets: {', '.join(unions)}")
    names = tuple(f"{rider} on {environment}" for rider, environment in subsets)
    sd = np.sqrt(stated**2 + between + rounding**2)
    return CanonicalTable(names, value, sd, whipple, speeds, (band[0], band[1])), tuple(notes)


Cells = dict[tuple[str, str, str], tuple[float, float, float]]


def _cells(path: Path) -> tuple[Cells, bool]:
    """(rider, environment, coefficient) -> value, sd, difference in per cent; and whether there are differences."""
    texts = ("rider", "environment", "coefficient", "unit")
    columns = read_columns(
        path, numbers=("value", "sd", "difference_percent"), texts=texts, needed=(*texts, "value", "sd")
    )
    numbers, words = columns.numbers, columns.texts
    cells: Cells = {}
    lines: dict[tuple[str, str, str], int] = {}
    for row, name in enumerate(words["coefficient"]):
        where = f"{path}, line {columns.lines[row]}"
        if name not in COEFFICIENTS:
            raise InputError(f"{where}: {unknown('coefficient', name, COEFFICIENTS)}")
        if words["unit"][row] != unit(name):
            raise InputError(f"{where}: {name} is in {words['unit'][row]!r}; give it in {unit(name)!r}")
        key = (words["rider"][row], words["environment"][row], name)
        if "" in key:
            raise InputError(f"{where}: rider and environment need a name; {ALL} stands for all of them")
        if key in cells:
            raise InputError(f"{where}: the same rider, environment and coefficient as line {lines[key]}; keep one")
        sd = float(numbers["sd"][row])
        if sd <= 0:
            raise InputError(f"{where}: sd = {sd:g} must be positive: no identification is free of noise")
        differs = float(numbers["difference_percent"][row]) if "difference_percent" in numbers else math.nan
        cells[key], lines[key] = (float(numbers["value"][row]), sd, differs), columns.lines[row]
    return cells, "difference_percent" in numbers


def _whipple(path: Path, cells: Cells, rider: str, name: str) -> tuple[float, float]:
    """Whipple's value of a rider and its sd, from value / (1 + difference) of every row, weighted by their rounding.

    A value is taken as printed to the first digit of its sd.
    """
    rows = [c for (who, _, what), c in cells.items() if (who, what) == (rider, name)]
    value, sd, percent = np.array(rows).T
    ratio = 1 + percent / 100
    used = np.abs(ratio) > PERCENT / 100  # elsewhere zero over zero
    if not used.any():
        raise InputError(f"{path}: {name} of rider {rider} is zero in every row: Whipple's value cannot be had from it")
    value, ratio, digit = value[used], ratio[used], 10.0 ** np.floor(np.log10(sd[used]) + 1e-9) / math.sqrt(12)
    found = value / ratio
    error = np.hypot(digit / ratio, found / ratio * PERCENT / 100)
    weight = 1 / error**2
    mean = float(weight @ found / weight.sum())
    if (np.abs(found - mean) > DISAGREE * error).any():
        raise InputError(
            f"{path}: the rows of rider {rider} disagree on Whipple's {name} (value / (1 + difference_percent/100) is "
            f"{', '.join(f'{x:.4g}' for x in found)}); correct value or difference_percent"
        )
    return mean, float(1 / np.sqrt(weight.sum()))


def _ascending(given: Any, key: str, highest: float, what: str) -> tuple[float, ...]:
    if not isinstance(given, list) or len(given) < 2 or not all(is_number(x) for x in given):
        raise InputError(f"[canonical]: {key} = {given!r} must be a list of two or more numbers in {what}")
    numbers = [float(x) for x in given]
    if not all(0 < x <= highest for x in numbers) or sorted(set(numbers)) != numbers:
        raise InputError(f"[canonical]: {key} = {given!r} must rise and lie within 0 .. {highest:g} {what}")
    return tuple(numbers)
