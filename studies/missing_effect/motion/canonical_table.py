"""Identified coefficients of the canonical equations M q'' + v C1 q' + (g K0 + v^2 K2) q = T + H F, q = (lean, steer).

One row for each coefficient of each subset of the runs (a rider in an environment). ``difference_percent`` is that to
Whipple's value of the same rider; it is turned round to get that value. ``A`` stands for all riders or environments:
such unions hold the data of other rows and count only for Whipple's values.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.checks import Check, refused, remarked
from tyre.base.csv_table import read_columns
from tyre.base.errors import InputError, is_number, unknown
from tyre.base.plausible import LARGEST, SMALLEST
from tyre.base.schema import maybe, path_key, read, table

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
TOO_WIDE = 0.01  # scatter in stated sd: subsets that agree so well are not known so badly
LONE = 100.0  # times what all other subsets have: no rider makes that
PERCENT = 0.1 / math.sqrt(12)  # rounding of a printed percentage
DISAGREE = 5.0  # sd by which two rows may differ on Whipple's value


def _ascending(highest: float, what: str, *, pair: bool = False) -> Check:
    def check(given: Any) -> tuple[float, ...]:
        if not isinstance(given, list) or len(given) < 2 or not all(is_number(x) for x in given):
            raise refused(given, f"must be a list of two or more numbers in {what}")
        numbers = [float(x) for x in given]
        if not all(0 < x <= highest for x in numbers) or sorted(set(numbers)) != numbers:
            raise refused(given, f"must rise and lie within 0 .. {highest:g} {what}")
        if pair and len(numbers) != 2:
            raise remarked(f"has {len(numbers)} numbers; write [lowest, highest]")
        return tuple(numbers)

    return check


TABLE = table(
    {
        **path_key("table", "FILE.csv"),
        maybe("speeds_m_s", list(SPEEDS)): _ascending(FASTEST, "m/s"),
        maybe("band_hz", list(BAND)): _ascending(HIGHEST, "Hz", pair=True),
    }
)


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
    """SI unit of a ``coefficient``."""
    return UNITS[coefficient.split("_")[0]]


def _refuse_lone(path: Path, subsets: Sequence[tuple[str, str]], value: Array) -> None:
    """Refuse a coefficient that is far from that of all other subsets: in another unit, or mistyped."""
    for place, name in enumerate(COEFFICIENTS):
        size = np.abs(value[:, place])
        for row, (rider, environment) in enumerate(subsets):
            others = float(np.delete(size, row).max())
            if others > 0 and size[row] > LONE * others:
                raise InputError(
                    f"{path}: {name} = {value[row, place]:g} {unit(name)} of {rider}, {environment} is "
                    f"{size[row] / others:.3g} times the largest of the other subsets; is it in another unit?"
                )


def read_canonical(content: Mapping[str, Any], folder: Path) -> tuple[CanonicalTable, tuple[str, ...]]:
    """The table ``[canonical]`` and notes on what was assumed.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the file that it names is.

    Raises
    ------
    InputError
        See :func:`read_columns`; also unknown coefficients, other units, repeated or missing rows, an sd that is not
        positive, fewer than four subsets, rows of a rider that disagree on Whipple's value, a wrong band or speed.
    """
    given = read(TABLE, content, section="canonical")
    path = folder / given["table"]
    cells, differs = _cells(path)
    subsets = _subsets(path, cells)
    value, stated = (np.array([[cells[*s, name][k] for name in COEFFICIENTS] for s in subsets]) for k in (0, 1))
    _refuse_lone(path, subsets, value)
    whipple, rounding = (None, np.zeros_like(value))
    if differs:
        both = np.array([[_whipple(path, cells, s[0], name) for name in COEFFICIENTS] for s in subsets])
        whipple, rounding = both[..., 0], both[..., 1]
    between, note = _between(value if whipple is None else value - whipple, stated)
    notes = [note]
    unions = sorted({"-".join(key[:2]) for key in cells if ALL in key[:2]})
    if unions:
        notes.append(f"not used, because they hold the runs of other subsets: {', '.join(unions)}")
    names = tuple(f"{rider} on {environment}" for rider, environment in subsets)
    sd = np.sqrt(stated**2 + between + rounding**2)
    return CanonicalTable(names, value, sd, whipple, given["speeds_m_s"], given["band_hz"]), tuple(notes)


def _subsets(path: Path, cells: "Cells") -> list[tuple[str, str]]:
    """Rider and environment of the subsets that share no runs, each with every coefficient."""
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
    return subsets


def _between(differences: Array, stated: Array) -> tuple[Array, str]:
    """Variance (9,) between subsets beyond the stated sd (subsets, 9), and what is said of it."""
    n = len(differences)
    scatter = differences.var(0, ddof=1)
    times = np.sqrt(scatter / (stated**2).mean(0))
    note = (
        f"noise: the scatter between {n} subsets of the runs, {times.min():.2g} to {times.max():.2g} times the stated "
        f"sd, widened for its {n - 1} degrees of freedom (variance of Student's t); coefficients count as independent. "
        f"Being taken from these rows, it leaves a perfect model with chi^2 of about {len(COEFFICIENTS) * (n - 3)} of "
        f"{stated.size}: goodness of fit says little here, held-out subsets and the posterior decide"
    )
    if times.max() < TOO_WIDE:
        note += (
            f". The stated sd of every coefficient is more than {1 / TOO_WIDE:g} times that scatter and hides whatever "
            "is missing: see their units"
        )
    return np.maximum(scatter - (stated**2).mean(0), 0) * (n - 1) / (n - 3), note


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
        for column, value in numbers.items():
            if abs(value[row]) > LARGEST or (column == "sd" and sd < SMALLEST):
                raise InputError(
                    f"{where}: {column} = {value[row]:g} must be a number that can be measured, from {SMALLEST:g} to "
                    f"{LARGEST:g} in size"
                )
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
