"""Modal data: eigenvalues of named modes at speeds, optionally with mode-shape ratios, with standard deviations."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from bicycle.identification.repeats import Repeats, repeats, surprise
from bicycle.modal.known_modes import known_modes
from bicycle.model import Model
from studies.missing_effect.motion.row_settings import Settings, read_settings, said, settable
from tyre.base.csv_table import Columns, read_columns
from tyre.base.errors import InputError, unknown
from tyre.base.plausible import LARGEST
from tyre.base.schema import path_key, read, table

RATIOS = ("steer_over_lean", "yaw_over_lean")
EIGENVALUE = ("real_1_s", "imag_rad_s")
SD = ("real_sd_1_s", "imag_sd_rad_s")
SHAPE = tuple(f"{ratio}_{part}" for ratio in RATIOS for part in ("re", "im", "sd"))
UNUSED = ("speed_min_m_s", "speed_max_m_s")
NUMBERS = ("speed_m_s", *EIGENVALUE, *SD, *SHAPE, *UNUSED)
FASTEST = 60.0  # m/s; above it a speed is surely in km/h
FASTEST_ROOT = 200.0  # 1/s, about 30 Hz
DEFAULT_SD = 0.03  # of |eigenvalue|, where neither sd nor repeats are there
DEFAULT_RATIO_SD = 0.05
MOST_ROWS = 5000  # beyond, a diagnosis takes hours and tells no more than the means
SMALLEST_SD, LARGEST_RATIO = 1e-5, 1e5
TABLE = table(path_key("table", "FILE.csv"))
FEWEST_REPEATS = 5  # degrees of freedom of all repeats together
ALIKE, CHANCE = 0.01, 0.01  # speeds of repeats that may refute stated sd, as a share; probability that sound ones are


@dataclass(frozen=True)
class ModalPoint:
    """One eigenvalue (1/s; imaginary part >= 0) with 1-sigma of its parts, and shape ratios ``name -> (value, sd)``.

    ``settings`` are what effects of the model had set otherwise there (:mod:`.row_settings`).
    """

    speed: float
    mode: str
    eigenvalue: complex
    sd: tuple[float, float]
    ratios: Mapping[str, tuple[complex, float]] = field(default_factory=dict)
    group: str = ""
    settings: Settings = ()

    @property
    def called(self) -> str:
        """The mode, with the settings where there are any: ``weave (steer_assist.gain = 8)``."""
        return f"{self.mode} ({', '.join(said(self.settings))})" if self.settings else self.mode


def read_modal(
    content: Mapping[str, Any], folder: Path, model: Model, uncertainty: Mapping[str, float]
) -> tuple[tuple[ModalPoint, ...], tuple[str, ...]]:
    """Points of the table ``[modal]`` and notes on what was assumed.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the file that it names is.
    model : Model
        The base model, whose effects' parameters may be columns.
    uncertainty : mapping
        1-sigma (SI) that the file gives, by parameter.

    Raises
    ------
    InputError
        See :func:`read_columns` and :func:`.read_settings`; also unknown modes, speeds or eigenvalues out of range, a
        standard deviation that is not positive, half a ratio, a repeated row, fewer than three points.
    """
    path = folder / read(TABLE, content, section="modal")["table"]
    columns = read_columns(
        path, numbers=(*NUMBERS, *settable(model)), texts=("mode", "group"), needed=("speed_m_s", "mode", *EIGENVALUE)
    )
    if (count := len(columns.lines)) > MOST_ROWS:
        raise InputError(
            f"{path}: {count} rows are more than {MOST_ROWS}; average the runs at each speed and give their means with "
            "the standard deviations of the means, or a part of the rows"
        )
    settings = read_settings(path, columns, model, uncertainty)
    points = tuple(replace(_point(path, row, columns), settings=known) for row, known in enumerate(settings))
    if len(points) < 3:
        raise InputError(f"{path}: has {len(points)} of the 3 or more rows that are needed; give several speeds")
    _refuse_repeats(path, points, columns.lines)
    points, notes = _with_sd(points, [name in columns.numbers for name in SD])
    unused = [name for name in UNUSED if name in columns.numbers]
    notes = (*notes, *([f"{', '.join(unused)}: read, but not used"] if unused else []))
    if settings[0]:
        keys = ", ".join(key for key, _ in settings[0])
        notes = (*notes, f"{keys}: known in each row of the table, without uncertainty")
    return points, notes


def _point(path: Path, row: int, columns: Columns) -> ModalPoint:
    where, texts = f"{path}, line {columns.lines[row]}", columns.texts
    cell = {name: float(column[row]) for name, column in columns.numbers.items()}
    mode, speed = texts["mode"][row], cell["speed_m_s"]
    if mode not in known_modes():
        raise InputError(f"{where}: {unknown('mode', mode, known_modes())}")
    if not 0 < speed <= FASTEST:
        raise InputError(f"{where}: speed_m_s = {speed:g} is outside 0 .. {FASTEST:g} m/s; is it in km/h?")
    root = complex(cell["real_1_s"], cell["imag_rad_s"])
    if root.imag < 0 or abs(root) > FASTEST_ROOT:
        raise InputError(
            f"{where}: the eigenvalue {root:g} is not possible: give the one with imag_rad_s >= 0, below "
            f"{FASTEST_ROOT:g} 1/s, in rad/s and not in Hz"
        )
    for name in (*SD, *(f"{ratio}_sd" for ratio in RATIOS)):
        if name in cell and cell[name] < SMALLEST_SD:
            raise InputError(
                f"{where}: {name} = {cell[name]:g} must be {SMALLEST_SD:g} or more: no measurement is free of noise; "
                "leave the column out if the value is not known"
            )
        if name in cell and cell[name] > LARGEST:
            raise InputError(
                f"{where}: {name} = {cell[name]:g} must be {LARGEST:g} or less; leave the row out if it tells nothing"
            )
    ratios = {}
    for ratio in RATIOS:
        parts = [f"{ratio}_re" in cell, f"{ratio}_im" in cell]
        if any(parts) != all(parts) or (f"{ratio}_sd" in cell and not all(parts)):
            raise InputError(f"{path}: a ratio needs both columns {ratio}_re and {ratio}_im")
        if all(parts):
            value = complex(cell[f"{ratio}_re"], cell[f"{ratio}_im"])
            if abs(value) > LARGEST_RATIO:
                raise InputError(
                    f"{where}: {ratio} = {value:g} is not possible: a ratio of two rates, below {LARGEST_RATIO:g}"
                )
            ratios[ratio] = (value, cell.get(f"{ratio}_sd", 0.0))
    sd = (cell.get(SD[0], 0.0), cell.get(SD[1], 0.0))
    return ModalPoint(speed, mode, root, sd, ratios, texts["group"][row] if "group" in texts else "")


def _refuse_repeats(path: Path, points: tuple[ModalPoint, ...], lines: tuple[int, ...]) -> None:
    seen: dict[tuple[float, str, complex], int] = {}
    for row, point in enumerate(points):
        key = (point.speed, point.called, point.eigenvalue)
        if key in seen:
            raise InputError(
                f"{path}, line {lines[row]}: the same run as line {lines[seen[key]]} (equal speed, mode and "
                "eigenvalue); keep one, or it counts twice"
            )
        seen[key] = row


def _with_sd(points: tuple[ModalPoint, ...], given: list[bool]) -> tuple[tuple[ModalPoint, ...], tuple[str, ...]]:
    """Fill in missing standard deviations, and add what repeats scatter beyond the stated ones."""
    notes = []
    eigenvalue_sd = np.array([point.sd for point in points])
    sizes = np.array([abs(point.eigenvalue) for point in points])
    for part, name in enumerate(SD):
        series = [(rows, _scatter(points, rows, part)) for rows in _series(points)]
        freedom = sum(found.freedom for _, found in series)
        if freedom < FEWEST_REPEATS:
            if not given[part]:
                eigenvalue_sd[:, part] = DEFAULT_SD * sizes
                few = f"too few repeats ({freedom} of {FEWEST_REPEATS} degrees of freedom)"
                few = few if freedom else "there are no repeats"
                notes.append(f"{name} is missing and {few}: {DEFAULT_SD:.0%} of |eigenvalue| is assumed")
            continue
        if given[part] and not _refuted(points, part):
            continue
        before = eigenvalue_sd[:, part].copy()
        for rows, found in series:
            if given[part] or found.freedom:
                eigenvalue_sd[rows, part] = found.sd
        lone = eigenvalue_sd[:, part] == 0  # a mode without repeats among others with
        eigenvalue_sd[lone, part] = DEFAULT_SD * sizes[lone]
        after = eigenvalue_sd[:, part]
        if lone.all():  # a real mode has no frequency that could scatter
            notes.append(f"{name} is missing and repeats do not differ: {DEFAULT_SD:.0%} of |eigenvalue| is assumed")
        elif not given[part]:
            notes.append(
                f"{name} is missing: the scatter of repeats ({freedom} degrees of freedom) is used, "
                f"{_range(after[~lone])}"
            )
            if lone.any():
                notes.append(f"{name}: {lone.sum()} rows of modes without repeats; {DEFAULT_SD:.0%} is assumed there")
        elif (wider := after > 1.001 * before).any():
            notes.append(
                f"repeats scatter more than {name} says: {wider.sum()} of {len(points)} rows are widened, to "
                f"{_range(after[wider])}"
            )
        for rows, found in series:
            for place in found.aside:
                point = points[rows[place]]
                notes.append(
                    f"{name}: the {point.called} at {point.speed:g} m/s lies far outside the scatter of its repeats; "
                    f"it alone is widened, to {after[rows[place]]:.3g}"
                )
    if any(sd == 0 for point in points for _, sd in point.ratios.values()):
        notes.append(f"a shape ratio without sd: {DEFAULT_RATIO_SD:g} is assumed for both parts")
    filled = tuple(
        replace(
            point, sd=(float(sd[0]), float(sd[1])),
            ratios={name: (value, s or DEFAULT_RATIO_SD) for name, (value, s) in point.ratios.items()},
        )
        for point, sd in zip(points, eigenvalue_sd, strict=True)
    )  # fmt: skip
    return filled, tuple(notes)


def _refuted(points: tuple[ModalPoint, ...], part: int) -> bool:
    """Whether repeats of all modes together scatter more than chance allows where the stated sd are right."""
    every = [surprise(*_columns(points, rows, part), same=ALIKE) for rows in _series(points)]
    return bool(chi2.sf(sum(total for total, _ in every), max(sum(freedom for _, freedom in every), 1)) < CHANCE)


def _range(values: Any) -> str:
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return low if low == high else f"{low} to {high}"


def _series(points: tuple[ModalPoint, ...]) -> list[list[int]]:
    """Rows of one mode at one setting."""
    found: dict[str, list[int]] = {}
    for row, point in enumerate(points):
        found.setdefault(point.called, []).append(row)
    return list(found.values())


def _scatter(points: tuple[ModalPoint, ...], rows: list[int], part: int) -> Repeats:
    return repeats(*_columns(points, rows, part))


def _columns(
    points: tuple[ModalPoint, ...], rows: list[int], part: int
) -> tuple[list[float], list[float], list[float]]:
    """Speeds, real or imaginary parts, and their sd, of some rows."""
    roots = [points[row].eigenvalue for row in rows]
    values = [(root.real, root.imag)[part] for root in roots]
    return [points[row].speed for row in rows], values, [points[row].sd[part] for row in rows]
