"""Columns of a modal table as people head them: a unit in brackets or behind, and frequency with damping ratio.

An eigenvalue -zeta w0 +- i w0 sqrt(1 - zeta^2) has the natural frequency w0 and the damping ratio zeta; the frequency
of the oscillation that is seen is that of its imaginary part.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tyre.formats.sheet import split_unit
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.schema import Check, number, read
from tyre.ground.text_table import Columns, read_cells, read_columns
from tyre.ground.units import factor_to_si, find_unit

KIND = "table; a path in a file is relative to that file"
SD = "_sd"


@dataclass(frozen=True)
class Quantity:
    """Quantity that a column may hold."""

    names: tuple[str, ...]  # headings that people write
    units: Mapping[str, float]  # factor to SI by unit
    column: str = ""  # empty: of what a root is computed from


PER_SECOND = {"1/s": 1.0, "s^-1": 1.0, "s-1": 1.0, "rad/s": 1.0}
HERTZ = {"hz": 2 * math.pi, "rad/s": 1.0, "1/min": 2 * math.pi / 60}
RATIO = {"": 1.0, "-": 1.0, "1": 1.0, "%": 0.01, "percent": 0.01}
SPEEDS = {text: find_unit(text, "speed", where="").factor for text in ("m/s", "km/h", "kmh", "kph", "mph", "ft/s")}
QUANTITIES = {
    "speed": Quantity(("speed", "forward_speed", "velocity", "v"), SPEEDS, "speed_m_s"),
    "real": Quantity(("real", "real_part"), PER_SECOND, "real_1_s"),
    "imag": Quantity(("imag", "imag_part", "imaginary", "imaginary_part"), PER_SECOND, "imag_rad_s"),
    "frequency": Quantity(("frequency", "damped_frequency", "freq"), HERTZ),
    "natural_frequency": Quantity(("natural_frequency", "undamped_frequency"), HERTZ),
    "damping_ratio": Quantity(("damping_ratio", "zeta"), RATIO),
}
DAMPED = (
    "{column}: taken as the frequency of the oscillation, imag_rad_s = 2 pi f; head a natural frequency "
    "natural_frequency"
)


@dataclass(frozen=True)
class Heading:
    """A column of a file: what it holds (a key of :data:`QUANTITIES`, or that of its sd, or a column of the table)."""

    column: str  # as the file spells it
    holds: str  # empty where it is not understood
    factor: float = 1.0  # to SI


def read_modal_columns(
    path: Path, *, numbers: Mapping[str, Check], texts: Sequence[str], needed: Sequence[str], units: Mapping[str, str]
) -> tuple[Columns, list[str]]:
    """Read a modal table: columns ``numbers`` (in SI) and ``texts``, however they are headed, and notes.

    ``needed`` columns must be there, else an InputError names them; cells are checked. ``units`` are the SI units
    of further columns, the parameters of effects.
    """
    header = read_cells(path, kind=KIND, example=", ".join(needed)).header
    if len(header) == 1:  # another separator, or too little: the plain reader says which
        return read_columns(path, numbers=numbers, texts=texts, needed=needed), []
    column_names = (*numbers, *texts)
    headings = [_heading(name, column_names, units, path) for name in header]
    foreign = [h.column for h in headings if h.holds and h.column not in column_names and h.holds not in texts]
    if all(heading.holds in ("", heading.column) and heading.column not in foreign for heading in headings):
        return read_columns(path, numbers=numbers, texts=texts, needed=needed), []
    _refuse_twice(headings, path)
    loose = number()
    checks = dict(numbers) | {name: lambda cell: np.nan if cell == "" else loose(cell) for name in foreign}
    words = [heading.column for heading in headings if heading.holds in texts]
    table = read_columns(path, numbers=checks, texts=words, needed=())
    si = {h.holds: h.factor * table.numbers[h.column] for h in headings if h.column in table.numbers}
    roots, notes = _roots(si, {heading.holds: heading.column for heading in headings}, path)
    si = {name: values for name, values in si.items() if name in numbers} | roots
    for name in si.keys() - set(header):  # those that were read as they are headed were checked then
        section = next((heading.column for heading in headings if heading.holds == name), name)
        for line, value in zip(table.lines, si[name].tolist(), strict=True):
            read(numbers[name], "" if math.isnan(value) else value, where=f"{path}, line {line}", section=section)
    named = {heading.holds: table.texts[heading.column] for heading in headings if heading.column in table.texts}
    missing = [name for name in needed if name not in si and name not in named]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; there are {', '.join(header)}")
    return replace(table, numbers=si, texts=named), notes


def _heading(column: str, column_names: Iterable[str], units: Mapping[str, str], path: Path) -> Heading:
    """Quantity of a ``column`` by its name, and its factor to SI; the quantity is "" if the name is not understood."""
    if column in column_names:
        return Heading(column, column)
    base, unit = split_unit(column)
    location = f"{path}: column {column!r}"
    if base in units:
        return Heading(column, base, float(factor_to_si(unit, units[base], where=location)) if unit else 1.0)
    plain = re.sub(r"[\s_-]+", "_", base.casefold()).strip("_")
    stems = {
        name + end: (key, end) for key, quantity in QUANTITIES.items() for name in quantity.names for end in (SD, "")
    }
    stem = next((stem for stem in stems if plain == stem or plain.startswith(f"{stem}_")), "")
    if not stem:
        return Heading(column, plain if plain in column_names else "")
    key, end = stems[stem]
    behind = plain.removeprefix(stem).strip("_").replace("_", "/")
    return Heading(column, _sd_of(key) if end else _value_of(key), _factor(key, unit or behind, location))


def _factor(key: str, unit: str, location: str) -> float:
    """Factor from a ``unit`` to SI of the quantity ``key``; InputError if it is none of its units."""
    units = QUANTITIES[key].units
    plain = re.sub(r"\s", "", unit.casefold())
    if plain not in units:
        problem = f"unit {unit!r} is not one of" if unit else "no unit; write one of"
        allowed = [text for text in units if text]
        raise InputError(f"{location}: {problem} {', '.join(allowed)} in brackets, such as {key} [{allowed[0]}]")
    return units[plain]


def _value_of(key: str) -> str:
    """Name of the column of the table for a quantity; ``key`` where a root is computed from it, as damping ratios."""
    return QUANTITIES[key].column or key


def _sd_of(key: str) -> str:
    """Name of the column with the standard deviations of the quantity ``key``."""
    return {"speed": "speed_sd_m_s", "real": "real_sd_1_s", "imag": "imag_sd_rad_s"}.get(key, key + SD)


def _refuse_twice(headings: Sequence[Heading], path: Path) -> None:
    """Raise InputError if two columns hold the same quantity."""
    for heading in headings:
        columns = [h.column for h in headings if h.holds == heading.holds]
        if heading.holds and len(columns) > 1:
            raise InputError(f"{path}: the columns {' and '.join(columns)} give the same; keep one")


def _roots(si: Mapping[str, Array], column: Mapping[str, str], path: Path) -> tuple[dict[str, Array], list[str]]:
    """Real and imaginary part (1/s, rad/s) and their sd from frequencies and damping ratios in ``si``, and notes.

    Of ``si`` columns (n,) by what they hold; ``column`` is the heading of each. Sd add up as of independent errors.
    """
    ways = [name for name in ("imag_rad_s", "frequency", "natural_frequency") if name in si]
    if len(ways) > 1:
        raise InputError(f"{path}: the columns {' and '.join(column[name] for name in ways)} give the same; keep one")
    way = ways[0] if ways else ""
    notes = [DAMPED.format(column=column[way])] if way == "frequency" else []
    sd = si.get("imag_sd_rad_s" if way == "imag_rad_s" else f"{way}_sd")
    if "damping_ratio" not in si:
        if way == "natural_frequency":
            raise InputError(f"{path}: {column[way]} needs a column damping_ratio")
        if way != "frequency":
            return {}, notes
        return {"imag_rad_s": si[way]} | ({} if sd is None else {"imag_sd_rad_s": sd}), notes
    if "real_1_s" in si:
        raise InputError(f"{path}: {column['damping_ratio']} and {column['real_1_s']} give the same; keep one")
    if not way:
        raise InputError(f"{path}: {column['damping_ratio']} needs a column frequency or natural_frequency")
    ratio, ratio_sd, frequency = si["damping_ratio"], si.get("damping_ratio_sd"), si[way]
    if (np.abs(ratio) >= 1).any() or (frequency[np.isfinite(ratio)] == 0).any():
        raise InputError(
            f"{path}: {column['damping_ratio']} must lie between -1 and 1 (in % write damping_ratio [%]), with a "
            "frequency above 0; a root without oscillation has real [1/s] alone"
        )
    imaginary_share = np.sqrt(1 - ratio**2)  # imaginary part over |root|
    is_natural = way == "natural_frequency"
    natural = frequency if is_natural else frequency / imaginary_share
    parts = {"real_1_s": -ratio * natural}
    if way != "imag_rad_s":
        parts["imag_rad_s"] = imaginary_share * natural if is_natural else frequency
    if way != "imag_rad_s" and sd is not None:
        by_ratio = ratio * natural / imaginary_share * ratio_sd if is_natural and ratio_sd is not None else 0.0
        parts["imag_sd_rad_s"] = np.hypot(imaginary_share * sd if is_natural else sd, by_ratio)
    if ratio_sd is not None:
        by_frequency = 0.0 if sd is None else (ratio if is_natural else ratio / imaginary_share) * sd
        parts["real_sd_1_s"] = np.hypot(
            (natural if is_natural else natural / imaginary_share**2) * ratio_sd, by_frequency
        )
    return parts, notes
