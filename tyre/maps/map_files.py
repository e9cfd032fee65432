"""Files of measured tyre tables: a CSV per tyre and surface with a TOML sidecar, or a plain table."""

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.formats.sheet import split_row
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, nearest_name
from tyre.ground.files import data_root, read_text, read_toml, replacing, write_text
from tyre.ground.schema import Check, flag, list_of, maybe, needed, number, read, table, text
from tyre.ground.text_table import read_cells, read_columns, refuse_huge_line
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.plain_table import PlainTable, read_plain_table
from tyre.measured.plausible import LARGEST, SMALLEST, negative_quantities, table_doubts
from tyre.measured.tables import CommonCalibration, MeasuredColumn, MeasuredTable, common_lateral_stiffness, listed

_BOUNDS = f"must be finite and > 0, from {SMALLEST:g} to {LARGEST:g}"
POSITIVE = number(above=0, least=SMALLEST, most=LARGEST, says=_BOUNDS)
_WORDS = text()
_NAMES = list_of(text(), "must be a list of texts in quotes")
_RESOLUTION = ("cornering_stiffness_N_per_deg", "relaxation_length_mm")
_GAINS = ("force", "slip", "displacement")
_GAIN = number(says="must be a number, 0.003 for 0.3 %")
SIDECAR = table(
    {
        needed(key, f"key '{key}' is missing; a tyre table must state its tyre, surface and source"): text(blank=False)
        for key in ("tyre", "surface", "source")
    }
    | {
        maybe("description", ""): _WORDS,
        maybe("synthetic", False): flag,
        maybe("notes", []): _NAMES,
        maybe("width_mm"): POSITIVE,
        maybe("drum_diameter_m"): POSITIVE,
        maybe("relaxation_length_sd_mm"): POSITIVE,
        maybe("lateral_stiffness_shared_over", []): _NAMES,
        maybe("lateral_stiffness_origin", "measured"): _WORDS,
        maybe("resolution"): table(
            {needed(key, f"give both {listed(_RESOLUTION)}"): POSITIVE for key in _RESOLUTION},
            kind="key of resolution:",
        ),
        maybe("calibration"): table(
            {needed(key, f"give {listed(_GAINS)}; 0 is a gain known exactly"): _GAIN for key in _GAINS},
            kind="key of calibration:",
        ),
    }
)


def read_sidecar(path: Traversable) -> dict[str, Any]:
    """Check and return the keys of a sidecar."""
    keys: dict[str, Any] = read(SIDECAR, read_toml(path, "sidecar", where=path.name), where=path.name, dotted=True)
    try:
        return keys | ({"calibration": CommonCalibration(**keys["calibration"])} if "calibration" in keys else {})
    except InputError as error:
        raise InputError(f"{path.name}: {error}.") from error


def without_sidecar(table: Path, words: Mapping[str, str]) -> dict[str, Any]:
    """Keys of a table that has no sidecar: ``words`` of its columns, comments such as ``# tyre: ...``, else assumed."""
    statements = dict(words)
    for line in read_text(table, fallback="latin-1").splitlines():
        match = re.fullmatch(r"\s*#\s*(tyre|surface|source|description)\s*[:=]\s*(.*?)\s*", line)
        if match:
            statements.setdefault(match[1], match[2].strip("\"'"))
    assumed = [
        f"{key} = {value!r}" for key, value in (("tyre", table.stem), ("surface", "flat")) if key not in statements
    ]
    notes = [f"{table.name} has no sidecar {table.stem}.toml; taken is {' and '.join(assumed)}"] if assumed else []
    content = {"tyre": table.stem, "surface": "flat", "source": "not stated"} | statements
    keys: dict[str, Any] = read(SIDECAR, content, where=table.name, dotted=True)
    return keys | {"notes": notes, "surface_stated": "surface" in statements}


REQUIRED = ("load_N", "pressure_bar", "cornering_stiffness_N_per_deg")
STIFFNESS = ("relaxation_length_mm", "lateral_stiffness_N_per_mm")
SD = ("cornering_stiffness_sd_N_per_deg", "relaxation_length_sd_mm", "lateral_stiffness_sd_N_per_mm")
CORRELATION, DOF = "stiffness_correlation", ("cornering_stiffness_dof", "lateral_stiffness_dof")
TRAIL, CAMBER = "pneumatic_trail", "camber_stiffness"
DIRECT = {"slip step": "relaxation_length_slip_step", "two sweep rates": "relaxation_length_two_rates"}

# field of a MeasuredTable -> its column, and the factor to SI units
FIELDS = {
    "load": ("load_N", 1.0),
    "pressure": ("pressure_bar", PASCAL_PER_BAR),
    "cornering_stiffness": ("cornering_stiffness_N_per_deg", math.degrees(1.0)),
    "lateral_stiffness": ("lateral_stiffness_N_per_mm", 1e3),
    "cornering_stiffness_sd": ("cornering_stiffness_sd_N_per_deg", math.degrees(1.0)),
    "lateral_stiffness_sd": ("lateral_stiffness_sd_N_per_mm", 1e3),
    **{name: (name, 1.0) for name in (CORRELATION, *DOF)},
}

ONLY_OWN = (CORRELATION, *DOF, *(f"{name}{end}" for name in DIRECT.values() for end in ("_mm", "_sd_mm", "_dof")))
_NOT_NEGATIVE = number(least=0, most=LARGEST, says="must be finite and >= 0")
_FREEDOM = number(above=0, endless=True, says="must be > 0 (inf where the standard deviation is known well)")
_ANY = number(least=-LARGEST, most=LARGEST, says="must be finite, or empty where it was not measured")
COLUMNS: dict[str, Check] = (
    dict.fromkeys((*REQUIRED, *STIFFNESS), POSITIVE)
    | dict.fromkeys(SD, _NOT_NEGATIVE)
    | dict.fromkeys(DOF, _FREEDOM)
    | {CORRELATION: number(least=-1, most=1, says="must be from -1 to 1")}
    | {
        f"{name}{end}": lambda value, check=check: float("nan") if value == "" else check(value)
        for name in (TRAIL, *DIRECT.values())
        for end, check in (("_mm", _ANY), ("_sd_mm", _NOT_NEGATIVE), ("_dof", _FREEDOM))
    }
    | {
        f"{CAMBER}{end}": lambda value, check=check: float("nan") if value == "" else check(value)
        for end, check in (("_N_per_deg", _ANY), ("_sd_N_per_deg", _NOT_NEGATIVE), ("_dof", _FREEDOM))
    }
)


def read_folder(folder: Traversable | None = None) -> list[MeasuredTable]:
    """Read every table (``.csv`` with its ``.toml``) of the packaged ``tyres`` folder, or of another one, by name."""
    if folder is None:
        return list(_read_packaged())
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder of tyre tables.")
    stems = sorted(item.name.removesuffix(".csv") for item in folder.iterdir() if item.name.endswith(".csv"))
    return [_parse(folder / f"{stem}.csv", folder / f"{stem}.toml") for stem in stems]


@cache
def _read_packaged() -> tuple[MeasuredTable, ...]:
    """Read the packaged tables once: they do not change, and nobody can change their arrays."""
    return tuple(read_folder(data_root() / "tyres"))


def read_table(file: str | Path) -> MeasuredTable:
    """Read a tyre table from its CSV (or the path of its sidecar); ``two_tyres.csv#NAME`` is one tyre of several."""
    file, tyre = split_row(str(file))
    if file.suffix not in (".csv", ".toml"):
        formula_hint = "(read_tyre reads .tir and Pacejka-89 files)"
        raise InputError(
            f"{file}: a tyre table is a .csv with a .toml beside it; give the path of either {formula_hint}."
        )
    return _parse(file.with_suffix(".csv"), file.with_suffix(".toml"), tyre)


def write_table(table: MeasuredTable, path: str | Path) -> None:
    """Write a table and its sidecar so that `read_table` gives the same values back to rounding."""
    import tomli_w

    path = Path(path)
    if path.suffix != ".csv":
        raise InputError(f"{path}: a tyre table is written as .csv; its sidecar .toml follows by itself.")
    columns: dict[str, Array] = {
        column: getattr(table, name) / factor
        for name, (column, factor) in FIELDS.items()
        if getattr(table, name) is not None
    }
    direct = {name: table.direct_relaxation_length.get(route) for route, name in DIRECT.items()}
    for name, column in {TRAIL: table.pneumatic_trail, **direct}.items():
        if column is not None:
            columns |= {f"{name}_mm": column.value * 1e3, f"{name}_sd_mm": column.sd * 1e3}
            columns[f"{name}_dof"] = np.where(column.known, column.dof, np.nan)
    if table.camber_stiffness is not None:
        columns[f"{CAMBER}_N_per_deg"] = np.radians(table.camber_stiffness.value)
        if table.camber_stiffness.stated:
            columns[f"{CAMBER}_sd_N_per_deg"] = np.radians(table.camber_stiffness.sd)
            columns[f"{CAMBER}_dof"] = np.where(table.camber_stiffness.known, table.camber_stiffness.dof, np.nan)
    printed = table.resolution and (math.radians(table.resolution[0]), table.resolution[1] * 1e3)
    keys: dict[str, Any] = {
        name: getattr(table, name) for name in ("tyre", "surface", "lateral_stiffness_origin", "synthetic")
    } | {
        "source": table.source or "not stated",
        "description": table.description or None,
        "notes": list(table.notes) or None,
        "width_mm": None if table.width is None else table.width * 1e3,
        "drum_diameter_m": table.drum_diameter,
        "calibration": table.calibration and asdict(table.calibration),
        "lateral_stiffness_shared_over": list(table.lateral_stiffness_shared_over) or None,
        "resolution": printed and dict(zip(_RESOLUTION, printed, strict=True)),
    }
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        rows = np.column_stack(list(columns.values())).tolist()
        writer.writerows([["" if math.isnan(value) else repr(value) for value in row] for row in rows])
    write_text(path.with_suffix(".toml"), tomli_w.dumps({k: v for k, v in keys.items() if v is not None}))


def _parse(table_path: Traversable, sidecar_path: Traversable, tyre: str = "") -> MeasuredTable:
    if not table_path.is_file():
        raise InputError(f"{table_path}: no such tyre table.")
    name = table_path.name
    plain = _columns(table_path, tyre)
    columns = plain.columns
    if sidecar_path.is_file():
        keys = read_sidecar(sidecar_path) | plain.words
    else:
        keys = without_sidecar(Path(str(table_path)), plain.words)
    if sum(column in columns for column in STIFFNESS) != 1:
        raise InputError(f"{name}: give one of the columns {listed(STIFFNESS)}; each follows from the other.")
    values = {field: columns[column] * factor for field, (column, factor) in FIELDS.items() if column in columns}
    length_sd, relative_sd = "relaxation_length_sd_mm", np.zeros_like(values["load"])
    if "relaxation_length_mm" in columns:
        for name_of_both in ("calibration", CORRELATION, *DOF):
            if name_of_both in keys or name_of_both in columns:
                raise InputError(
                    f"{name}: {name_of_both} is about both stiffnesses; give the column lateral_stiffness_N_per_mm in "
                    "place of relaxation_length_mm."
                )
        if length_sd in columns and length_sd in keys:
            raise InputError(f"{name}: relaxation_length_sd_mm is in the table and in its sidecar; keep one.")
        relative_sd = columns.get(length_sd, keys.get(length_sd, 0.0) + relative_sd) / columns["relaxation_length_mm"]
        values["lateral_stiffness"] = values["cornering_stiffness"] / (columns["relaxation_length_mm"] / 1e3)
    elif length_sd in keys or length_sd in columns:
        raise InputError(f"{name}: relaxation_length_sd_mm is given, but the column relaxation_length_mm is not.")
    if relative_sd.any():
        if "lateral_stiffness_sd" in values:
            raise InputError(f"{name}: standard deviations of relaxation length and lateral stiffness; keep one.")
        values["lateral_stiffness_sd"] = relative_sd * values["lateral_stiffness"]
    trail, length = _read_column(name, TRAIL, columns), values["cornering_stiffness"] / values["lateral_stiffness"]
    camber = _camber_column(name, columns)
    further_columns = {TRAIL: trail, CAMBER: camber}
    judged = {**values, "relaxation_length": length}
    judged |= {quantity: column.value for quantity, column in further_columns.items() if column is not None}
    doubts = table_doubts(values["load"], judged, where=name, places=plain.places)
    doubts += negative_quantities(values["load"], judged)
    if resolution := keys.get("resolution"):
        units = math.degrees(resolution["cornering_stiffness_N_per_deg"]), resolution["relaxation_length_mm"] / 1e3
    direct = {route: _read_column(name, stem, columns) for route, stem in DIRECT.items()}
    return MeasuredTable(
        tyre=keys["tyre"],
        surface=keys["surface"],
        **values,
        lateral_stiffness_shared_over=tuple(keys["lateral_stiffness_shared_over"]),
        resolution=units if resolution else None,
        source=keys["source"],
        description=keys["description"],
        lateral_stiffness_origin=keys["lateral_stiffness_origin"],
        notes=tuple(dict.fromkeys((*keys["notes"], *plain.notes, *doubts))),
        synthetic=keys["synthetic"],
        drum_diameter=keys.get("drum_diameter_m"),
        width=keys["width_mm"] / 1e3 if "width_mm" in keys else None,
        calibration=keys.get("calibration"),
        surface_stated=keys.get("surface_stated", True),
        pneumatic_trail=trail,
        camber_stiffness=camber,
        direct_relaxation_length={route: column for route, column in direct.items() if column is not None},
    )


def _columns(path: Traversable, tyre: str) -> PlainTable:
    """Read the columns of a table; a header in other names than velotyre's own is read by its units."""
    header = read_cells(path, kind="tyre table", example=", ".join(REQUIRED)).text.lstrip("\ufeff \r\n")
    names = next((line for line in header.splitlines() if line.strip() and not line.startswith("#")), "")
    refuse_huge_line(names, where=f"{path}, names of the columns")
    try:
        header_names = [
            name.strip() for cells in csv.reader([names.partition("#")[0]], skipinitialspace=True) for name in cells
        ]
    except csv.Error as error:
        raise InputError(f"{path}: the names of the columns are not CSV ({error}); see the quotation marks") from error
    foreign = [name for name in header_names if name not in COLUMNS]
    if not (names and isinstance(path, Path) and (foreign or tyre)):
        columns = read_columns(path, numbers=COLUMNS, needed=REQUIRED)
        return PlainTable(columns.numbers, [f"line {line}" for line in columns.lines], {}, [])
    for name in header_names:
        if name in ONLY_OWN:
            raise InputError(
                f"{path}: {name} is read only where all columns have names of velotyre; take out {', '.join(foreign)}"
            )
    plain = read_plain_table(path, tyre=tyre)
    missing = [name for name in REQUIRED if name not in plain.columns]
    if missing:
        raise InputError(
            f"{path}: the column {', '.join(missing)} is missing{''.join(f'; {note}' for note in plain.notes)}"
        )
    for name in sorted(plain.columns.keys() & {*REQUIRED, *STIFFNESS, *SD}):
        for place, value in zip(plain.places, plain.columns[name], strict=True):
            read(COLUMNS[name], float(value), where=f"{path}, {place}", section=name, dotted=True)
    return plain


def _read_column(file: str, name: str, columns: Mapping[str, Array]) -> MeasuredColumn | None:
    value, sd, dof = (columns.get(f"{name}{end}") for end in ("_mm", "_sd_mm", "_dof"))
    if value is None and sd is None and dof is None:
        return None
    if value is None or sd is None:
        raise InputError(f"{file}: {name}_mm and {name}_sd_mm belong together; give both columns or none.")
    dof = np.full_like(value, np.inf) if dof is None else np.where(np.isnan(dof), np.inf, dof)
    try:
        return MeasuredColumn(value / 1e3, sd / 1e3, dof)
    except InputError as error:
        raise InputError(f"{file}: {name}_mm of {error}.") from error


def _camber_column(file: str, columns: Mapping[str, Array]) -> MeasuredColumn | None:
    """Camber stiffness, with its standard deviation where one is stated."""
    value = columns.get(f"{CAMBER}_N_per_deg")
    if value is None or np.isnan(value).all():
        return None
    sd, dof = columns.get(f"{CAMBER}_sd_N_per_deg"), columns.get(f"{CAMBER}_dof")
    sd = np.full_like(value, np.nan) if sd is None else sd
    dof = np.full_like(value, np.inf) if dof is None else np.where(np.isnan(dof), np.inf, dof)
    try:
        return MeasuredColumn(np.degrees(value), np.degrees(sd), dof)
    except InputError as error:
        raise InputError(f"{file}: {CAMBER}_N_per_deg of {error}.") from error


def available_tyres(folder: Traversable | None = None) -> dict[str, tuple[str, ...]]:
    """Return the surfaces measured for each tyre of the packaged data, or of another folder of tyre tables.

    Parameters
    ----------
    folder : path, optional
        Default: the packaged tyres.

    Raises
    ------
    InputError
        A table of the folder that cannot be read.
    """
    surfaces: dict[str, tuple[str, ...]] = {}
    for measured_table in read_folder(folder):
        known_surfaces = surfaces.get(measured_table.tyre, ())
        surfaces[measured_table.tyre] = (*known_surfaces, measured_table.surface)
    return {tyre: tuple(sorted(measured, reverse=True)) for tyre, measured in sorted(surfaces.items())}


def no_tyre(tyre: str, available: Iterable[str], more: str = "") -> InputError:
    """Make the error of a ``tyre`` that is none of the ``available`` ones; ``more`` ends it."""
    suggestion = nearest_name(tyre, names := sorted(available))
    hint = f" (did you mean '{suggestion}'?)" if suggestion else ""
    return InputError(f"no tyre '{tyre}'{hint}; available are {', '.join(names) or 'none'}{more}.")


def find_table(tyre: str, *, surface: str, folder: Traversable | None = None) -> MeasuredTable:
    """Return the table of a tyre on a surface, checked against those it shares lateral stiffness tests with."""
    tables = read_folder(folder)
    of_tyre = [table for table in tables if table.tyre == tyre]
    if not of_tyre:
        raise no_tyre(tyre, {table.tyre for table in tables})
    chosen = [table for table in of_tyre if table.surface == surface]
    if not chosen:
        surfaces = ", ".join(sorted((table.surface for table in of_tyre), reverse=True))
        raise InputError(f"{tyre} was not measured on surface '{surface}', only on: {surfaces}.")
    if len(chosen) > 1:
        raise InputError(f"{chosen[0].label} is defined by {len(chosen)} files; keep one.")
    across = [table for table in of_tyre if "surface" in table.lateral_stiffness_shared_over]
    common_lateral_stiffness(across if chosen[0] in across else chosen)
    return chosen[0]
