"""Files of measured tyre tables: one CSV per tyre and surface with a TOML sidecar of the same name.

CSV columns, one row per condition (comma separated, decimal point):

- ``load_N``, ``pressure_bar``, ``cornering_stiffness_N_per_deg``;
- ``relaxation_length_mm`` or ``lateral_stiffness_N_per_mm``, of which one is cornering stiffness over the other;
- optional: the same names with ``_sd`` before the unit, e.g. ``cornering_stiffness_sd_N_per_deg``: one standard
  deviation, which holds the calibration of the rig;
- optional, with ``cornering_stiffness_sd_N_per_deg`` and ``lateral_stiffness_sd_N_per_mm``: ``stiffness_correlation``
  (of both stiffnesses at that condition, calibration included) and ``cornering_stiffness_dof``,
  ``lateral_stiffness_dof`` (degrees of freedom behind the standard deviations, ``inf`` where these are known well);
- optional, empty where it was not measured: ``pneumatic_trail_mm``, ``pneumatic_trail_sd_mm`` and, if known,
  ``pneumatic_trail_dof``; likewise ``relaxation_length_slip_step_mm`` and ``relaxation_length_two_rates_mm``, the
  relaxation length by other routes than the ratio of the stiffnesses.

Tables of others may name columns and units in other ways (:mod:`tyre.maps.named_columns`). Without a sidecar the
comments ``# tyre: NAME``, ``# surface: flat`` and ``# source: ...`` at the head of the CSV are read, and what is not
said there is assumed and told.

Sidecar keys: ``tyre``, ``surface`` (``flat`` or ``drum``), ``source``; optional ``description``, ``synthetic``,
``lateral_stiffness_origin`` (in words, where no pull test on this surface measured it),
``notes``, ``width_mm``, ``drum_diameter_m``, ``relaxation_length_sd_mm`` (one standard deviation for every row),
``lateral_stiffness_shared_over`` (of ``load``, ``pressure``, ``surface``: conditions that differ only in these got
their lateral stiffness from the same pull tests, so its error is common to them), ``[calibration]`` (``force``,
``slip``, ``displacement``: relative standard deviations of the rig's gains, whose errors are common to all rows, see
:class:`tyre.maps.calibration.CommonCalibration`) and ``[resolution]`` (one unit of the
last printed digit; with it, conditions that share a lateral stiffness are checked to agree within the rounding).
"""

import csv
import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from tyre.bands import table_doubts
from tyre.base.arrays import Array
from tyre.base.csv_table import read_cells, read_columns
from tyre.base.errors import InputError
from tyre.base.files import replacing, write_text
from tyre.base.paths import data_root
from tyre.base.schema import read
from tyre.base.units import PASCAL_PER_BAR
from tyre.maps.measured_column import MeasuredColumn
from tyre.maps.named_columns import read_named_columns
from tyre.maps.table_cells import COLUMNS, CORRELATION, DIRECT, DOF, REQUIRED, SD, STIFFNESS, TRAIL
from tyre.maps.table_sidecar import listed, read_sidecar, without_sidecar
from tyre.maps.tables import MeasuredTable


def read_folder(folder: Traversable | None = None) -> list[MeasuredTable]:
    """Read every table (``.csv`` with its ``.toml``) of the packaged ``tyres`` folder, or of another one, by name.

    Parameters
    ----------
    folder : path, optional
        Default: the packaged tyres.

    Raises
    ------
    InputError
        No such folder, or a table that cannot be read.
    """
    if folder is None:
        return list(_packaged())
    return _read_all(folder)


@cache
def _packaged() -> tuple[MeasuredTable, ...]:
    """The packaged tables, read once: they do not change, and nobody can change their arrays."""
    return tuple(_read_all(data_root() / "tyres"))


def _read_all(folder: Traversable) -> list[MeasuredTable]:
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
    """Write a table and its sidecar so that `read_table` gives the same values back to rounding.

    Parameters
    ----------
    table : MeasuredTable
    path : path
        Of the .csv; the .toml comes beside it.

    Raises
    ------
    InputError
        Another ending than .csv.
    """
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
    for name in (CORRELATION, *DOF):
        if getattr(table, name) is not None:
            columns[name] = getattr(table, name)
    columns |= _written_column(TRAIL, table.pneumatic_trail)
    for route, name in DIRECT.items():
        columns |= _written_column(name, table.direct_relaxation_length.get(route))
    keys: dict[str, Any] = {"tyre": table.tyre, "surface": table.surface, "source": table.source or "not stated"}
    keys |= {"description": table.description} if table.description else {}
    keys |= {"lateral_stiffness_origin": table.lateral_stiffness_origin, "synthetic": table.synthetic}
    keys |= {"notes": list(table.notes)} if table.notes else {}
    keys |= {"width_mm": table.width * 1e3} if table.width is not None else {}
    keys |= {"drum_diameter_m": table.drum_diameter} if table.drum_diameter is not None else {}
    if table.lateral_stiffness_shared_over:
        keys["lateral_stiffness_shared_over"] = list(table.lateral_stiffness_shared_over)
    if table.calibration is not None:
        keys["calibration"] = asdict(table.calibration)
    if table.resolution is not None:
        keys["resolution"] = {
            "cornering_stiffness_N_per_deg": math.radians(table.resolution[0]),
            "relaxation_length_mm": table.resolution[1] * 1e3,
        }
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        cells = ([_cell(value) for value in array.tolist()] for array in columns.values())
        writer.writerows(zip(*cells, strict=True))
    write_text(path.with_suffix(".toml"), tomli_w.dumps(keys))


def _parse(table_path: Traversable, sidecar_path: Traversable) -> MeasuredTable:
    if not table_path.is_file():
        raise InputError(f"{table_path}: no such tyre table.")
    name = table_path.name
    keys = read_sidecar(sidecar_path) if sidecar_path.is_file() else without_sidecar(Path(str(table_path)))
    columns, places = _columns(table_path)
    if sum(column in columns for column in STIFFNESS) != 1:
        raise InputError(f"{name}: give one of the columns {listed(STIFFNESS)}; each follows from the other.")
    cornering = np.degrees(columns["cornering_stiffness_N_per_deg"])  # N/deg to N/rad
    relative_sd = np.zeros_like(cornering)
    if "relaxation_length_mm" in columns:
        for given in ("calibration", CORRELATION, *DOF):
            if given in keys or given in columns:
                raise InputError(
                    f"{name}: {given} is about both stiffnesses; give the column lateral_stiffness_N_per_mm in place "
                    "of relaxation_length_mm."
                )
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
    trail = _read_column(name, TRAIL, columns)
    doubts = table_doubts(
        columns["load_N"],
        {"cornering_stiffness": cornering, "lateral_stiffness": lateral, "relaxation_length": cornering / lateral}
        | ({} if trail is None else {"pneumatic_trail": trail.value}),
        where=name,
        places=places,
    )
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
        lateral_stiffness_shared_over=tuple(keys["lateral_stiffness_shared_over"]),
        resolution=(
            (math.degrees(resolution["cornering_stiffness_N_per_deg"]), resolution["relaxation_length_mm"] / 1e3)
            if resolution
            else None
        ),
        source=keys["source"],
        description=keys["description"],
        lateral_stiffness_origin=keys["lateral_stiffness_origin"],
        notes=tuple(dict.fromkeys((*keys["notes"], *doubts))),
        synthetic=keys["synthetic"],
        drum_diameter=keys.get("drum_diameter_m"),
        width=keys["width_mm"] / 1e3 if "width_mm" in keys else None,
        calibration=keys.get("calibration"),
        stiffness_correlation=columns.get(CORRELATION),
        cornering_stiffness_dof=columns.get(DOF[0]),
        lateral_stiffness_dof=columns.get(DOF[1]),
        pneumatic_trail=trail,
        direct_relaxation_length={
            route: column for route, stem in DIRECT.items() if (column := _read_column(name, stem, columns)) is not None
        },
    )


def _columns(path: Traversable) -> tuple[Mapping[str, Array], list[str]]:
    """Columns of a table and what each row is called; of the own form as they are, of another by name and unit."""
    header = read_cells(path, kind="tyre table", example=", ".join(REQUIRED)).text.lstrip("\ufeff \r\n")
    names = next((line for line in header.splitlines() if line.strip() and not line.startswith("#")), "")
    try:
        own = [name.strip() for cells in csv.reader([names.partition("#")[0]], skipinitialspace=True) for name in cells]
    except csv.Error as error:
        raise InputError(f"{path}: the names of the columns are not CSV ({error}); see the quotation marks") from error
    if names and isinstance(path, Path) and any(name not in COLUMNS for name in own):
        found = read_named_columns(path)
        missing = [name for name in REQUIRED if name not in found]
        if missing:
            raise InputError(f"{path}: the column {', '.join(missing)} is missing")
        for name in (*REQUIRED, *STIFFNESS, *SD):
            for row, value in enumerate(found.get(name, ()), 1):
                read(COLUMNS[name], float(value), where=f"{path}, row {row}", section=name, dotted=True)
        return found, [f"row {row}" for row in range(1, len(found["load_N"]) + 1)]
    plain = read_columns(path, numbers=COLUMNS, needed=REQUIRED)
    return plain.numbers, [f"line {line}" for line in plain.lines]


def _written_column(name: str, column: MeasuredColumn | None) -> dict[str, Array]:
    if column is None:
        return {}
    dof = np.where(column.known, column.dof, np.nan)
    return {f"{name}_mm": column.value * 1e3, f"{name}_sd_mm": column.sd * 1e3, f"{name}_dof": dof}


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


def _cell(value: float) -> str:
    """A number as it is read back; nothing where none was measured."""
    return "" if math.isnan(value) else repr(value)
