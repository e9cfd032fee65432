"""Files of measured tyre tables: one CSV per tyre and surface with a TOML sidecar of the same name.

CSV columns, one row per condition (comma separated, decimal point):

- ``load_N``, ``pressure_bar``, ``cornering_stiffness_N_per_deg``;
- ``relaxation_length_mm`` or ``lateral_stiffness_N_per_mm``, of which one is cornering stiffness over the other;
- optional: the same names with ``_sd`` before the unit, e.g. ``cornering_stiffness_sd_N_per_deg``.

Sidecar keys: ``tyre``, ``surface`` (``flat`` or ``drum``), ``source``; optional ``description``, ``synthetic``,
``lateral_stiffness_origin`` (in words, where no pull test on this surface measured it),
``notes``, ``width_mm``, ``drum_diameter_m``, ``relaxation_length_sd_mm`` (one standard deviation for every row),
``lateral_stiffness_shared_over`` (of ``load``, ``pressure``, ``surface``: conditions that differ only in these got
their lateral stiffness from the same pull tests, so its error is common to them) and ``[resolution]`` (one unit of the
last printed digit; with it, conditions that share a lateral stiffness are checked to agree within the rounding).
"""

import csv
import io
import math
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.paths import data_root
from tyre.base.units import PASCAL_PER_BAR
from tyre.maps.table_sidecar import listed, read_sidecar, suggestion
from tyre.maps.tables import MeasuredTable

_REQUIRED_COLUMNS = ("load_N", "pressure_bar", "cornering_stiffness_N_per_deg")
_STIFFNESS_COLUMNS = ("relaxation_length_mm", "lateral_stiffness_N_per_mm")
_SD_COLUMNS = ("cornering_stiffness_sd_N_per_deg", "relaxation_length_sd_mm", "lateral_stiffness_sd_N_per_mm")


def read_folder(folder: Traversable | None = None) -> list[MeasuredTable]:
    """Read every table (``.csv`` with its ``.toml``) of the packaged ``tyres`` folder, or of another one, by name."""
    folder = folder if folder is not None else data_root() / "tyres"
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder of tyre tables.")
    stems = sorted(item.name.removesuffix(".csv") for item in folder.iterdir() if item.name.endswith(".csv"))
    return [_parse(folder / f"{stem}.csv", folder / f"{stem}.toml") for stem in stems]


def read_table(file: str | Path) -> MeasuredTable:
    """Read a tyre table from its CSV (or the path of its sidecar).

    Parameters
    ----------
    file : path
        The ``.csv`` or ``.toml``; the other one lies beside it.

    Returns
    -------
    MeasuredTable
        In SI units. Of relaxation length and lateral stiffness the missing one is computed; with a relaxation length
        the relative standard deviation of the lateral stiffness is that of the relaxation length.

    Raises
    ------
    InputError
        A missing file, column or key, an unknown one, a cell that is no number, or a non-positive value.
    """
    file = Path(file)
    if file.suffix not in (".csv", ".toml"):
        raise InputError(
            f"{file}: a tyre table is a .csv with a .toml beside it; give the path of either (read_tyre reads .tir and "
            "Pacejka-89 files)."
        )
    return _parse(file.with_suffix(".csv"), file.with_suffix(".toml"))


def write_table(table: MeasuredTable, path: str | Path) -> None:
    """Write ``path`` (.csv) and its sidecar so that `read_table` gives the same values back to rounding."""
    import tomli_w

    path = Path(path)
    if path.suffix != ".csv":
        raise InputError(f"{path}: a tyre table is written as .csv; its sidecar .toml follows by itself.")
    columns: dict[str, Array] = {
        "load_N": table.load,
        "pressure_bar": table.pressure / PASCAL_PER_BAR,
        "cornering_stiffness_N_per_deg": np.radians(table.cornering_stiffness),
        "lateral_stiffness_N_per_mm": table.lateral_stiffness / 1e3,
        "lateral_stiffness_sd_N_per_mm": table.lateral_stiffness_sd / 1e3,
    }
    if table.cornering_stiffness_sd is not None:
        columns["cornering_stiffness_sd_N_per_deg"] = np.radians(table.cornering_stiffness_sd)
    keys: dict[str, Any] = {"tyre": table.tyre, "surface": table.surface, "source": table.source or "not stated"}
    keys |= {"description": table.description} if table.description else {}
    keys |= {"lateral_stiffness_origin": table.lateral_stiffness_origin, "synthetic": table.synthetic}
    keys |= {"notes": list(table.notes)} if table.notes else {}
    keys |= {"width_mm": table.width * 1e3} if table.width is not None else {}
    keys |= {"drum_diameter_m": table.drum_diameter} if table.drum_diameter is not None else {}
    if table.lateral_stiffness_shared_over:
        keys["lateral_stiffness_shared_over"] = list(table.lateral_stiffness_shared_over)
    if table.resolution is not None:
        keys["resolution"] = {
            "cornering_stiffness_N_per_deg": math.radians(table.resolution[0]),
            "relaxation_length_mm": table.resolution[1] * 1e3,
        }
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(zip(*([repr(value) for value in array.tolist()] for array in columns.values()), strict=True))
    path.with_suffix(".toml").write_text(tomli_w.dumps(keys), encoding="utf-8")


def _parse(table_path: Traversable, sidecar_path: Traversable) -> MeasuredTable:
    if not table_path.is_file():
        raise InputError(f"{table_path}: no such tyre table.")
    if not sidecar_path.is_file():
        raise InputError(
            f"{table_path}: its sidecar {sidecar_path.name} is missing; it must say tyre, surface and source."
        )
    name = table_path.name
    keys = read_sidecar(sidecar_path.name, sidecar_path.read_text(encoding="utf-8"))
    columns = _columns(name, table_path.read_text(encoding="utf-8-sig"))
    cornering = np.degrees(columns["cornering_stiffness_N_per_deg"])  # N/deg to N/rad
    relative_sd = np.zeros_like(cornering)
    if "relaxation_length_mm" in columns:
        length = columns["relaxation_length_mm"] / 1e3
        lateral = cornering / length
        if "relaxation_length_sd_mm" in columns and "relaxation_length_sd_mm" in keys:
            raise InputError(f"{name}: relaxation_length_sd_mm stands in the table and in its sidecar; keep one.")
        if "relaxation_length_sd_mm" in columns or "relaxation_length_sd_mm" in keys:
            sd = columns.get("relaxation_length_sd_mm", np.full_like(length, keys.get("relaxation_length_sd_mm", 0.0)))
            relative_sd = sd / 1e3 / length
    else:
        lateral = columns["lateral_stiffness_N_per_mm"] * 1e3
        if "relaxation_length_sd_mm" in keys or "relaxation_length_sd_mm" in columns:
            raise InputError(
                f"{name}: relaxation_length_sd_mm is given, but the column relaxation_length_mm is not there."
            )
    lateral_sd = relative_sd * lateral
    if "lateral_stiffness_sd_N_per_mm" in columns:
        if relative_sd.any():
            raise InputError(
                f"{name}: standard deviations of relaxation length and lateral stiffness; keep one of them."
            )
        lateral_sd = columns["lateral_stiffness_sd_N_per_mm"] * 1e3
    sd_column = columns.get("cornering_stiffness_sd_N_per_deg")
    resolution = keys.get("resolution")
    return MeasuredTable(
        tyre=keys["tyre"],
        surface=keys["surface"],
        load=columns["load_N"],
        pressure=columns["pressure_bar"] * PASCAL_PER_BAR,
        cornering_stiffness=cornering,
        lateral_stiffness=lateral,
        lateral_stiffness_sd=lateral_sd,
        cornering_stiffness_sd=None if sd_column is None else np.degrees(sd_column),
        lateral_stiffness_shared_over=tuple(keys.get("lateral_stiffness_shared_over", ())),
        resolution=(
            (math.degrees(resolution["cornering_stiffness_N_per_deg"]), resolution["relaxation_length_mm"] / 1e3)
            if resolution
            else None
        ),
        source=keys["source"],
        description=keys.get("description", ""),
        lateral_stiffness_origin=keys.get("lateral_stiffness_origin", "measured"),
        notes=tuple(keys.get("notes", ())),
        synthetic=keys.get("synthetic", False),
        drum_diameter=keys.get("drum_diameter_m"),
        width=keys["width_mm"] / 1e3 if "width_mm" in keys else None,
    )


def _columns(name: str, text: str) -> dict[str, Array]:
    rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    header = [cell.strip() for cell in rows[0]] if rows else []
    known = (*_REQUIRED_COLUMNS, *_STIFFNESS_COLUMNS, *_SD_COLUMNS)
    for column in header:
        if column not in known:
            raise InputError(
                f"{name}: unknown column '{column}'{suggestion(column, known)}; allowed are {listed(known)}."
            )
        if header.count(column) > 1:
            raise InputError(f"{name}: column '{column}' appears twice; keep one.")
    for column in _REQUIRED_COLUMNS:
        if column not in header:
            raise InputError(f"{name}: column '{column}' is missing; the first line must name the columns.")
    if sum(column in header for column in _STIFFNESS_COLUMNS) != 1:
        raise InputError(f"{name}: give one of the columns {listed(_STIFFNESS_COLUMNS)}; each follows from the other.")
    if len(rows) < 2:
        raise InputError(f"{name}: no conditions below the column names; at least one row is needed.")
    values = np.empty((len(rows) - 1, len(header)))
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(header):
            raise InputError(
                f"{name}, row {number}: {len(row)} cells under {len(header)} columns; fill or remove them."
            )
        for place, (column, cell) in enumerate(zip(header, row, strict=True)):
            try:
                value = float(cell)
            except ValueError as error:
                raise InputError(f"{name}, row {number}: {column} is '{cell}', which is not a number.") from error
            sd = column in _SD_COLUMNS
            if not math.isfinite(value) or value < 0 or (value == 0 and not sd):
                raise InputError(
                    f"{name}, row {number}: {column} is {cell}; it must be finite and {'>= 0' if sd else '> 0'}."
                )
            values[number - 2, place] = value
    return {column: values[:, place] for place, column in enumerate(header)}
