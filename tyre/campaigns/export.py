"""A fitted campaign as files that other programs read: measured tables and tyre property files (.tir)."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tyre.base.arrays import Array
from tyre.base.files import slugs
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import Campaign
from tyre.campaigns.condition import ConditionResult
from tyre.estimate import Calibration, Estimate
from tyre.maps.calibration import CommonCalibration
from tyre.maps.measured_column import MeasuredColumn
from tyre.maps.table_io import write_table
from tyre.maps.tables import MeasuredTable


def write_tables(campaign: Campaign, out: Path, *, wheel_radius: float) -> tuple[list[Path], list[str]]:
    """Write one measured table per tyre and surface, and its .tir files (MF6.1; MF5.2 per pressure).

    Parameters
    ----------
    campaign : Campaign
    out : Path
        Tables go to ``maps/``, property files to ``tir/``.
    wheel_radius : float
        m.

    Returns
    -------
    paths : list of Path
    remarks : list of str
        What could not be exported, and why.
    """
    tables, remarks = measured_tables(campaign)
    paths: list[Path] = []
    for folder in ("maps", "tir"):
        (out / folder).mkdir(parents=True, exist_ok=True)
    stems = slugs(table.tyre for table in tables)
    for table in tables:
        name = f"{stems[table.tyre]}_{table.surface}"
        path = out / "maps" / f"{name}.csv"
        write_table(table, path)
        paths += [path, *_write_property_files(table, out / "tir", name, wheel_radius)]
    return paths, remarks


def measured_tables(campaign: Campaign) -> tuple[list[MeasuredTable], list[str]]:
    """The conditions of a campaign as one table per tyre and surface, with all that is known of their uncertainty.

    Parameters
    ----------
    campaign : Campaign

    Returns
    -------
    tables : list of MeasuredTable
    remarks : list of str
        Which conditions are in no table, and why.
    """
    groups: dict[tuple[str, str], list[ConditionResult]] = defaultdict(list)
    for condition in campaign.conditions:
        groups[condition.tyre, condition.surface].append(condition)
    tables: list[MeasuredTable] = []
    remarks: list[str] = []
    for (tyre, surface), members in groups.items():
        complete = [c for c in members if c.cornering_stiffness is not None and c.lateral_stiffness is not None]
        if len(complete) < len(members):
            missing = len(members) - len(complete)
            remarks.append(f"{tyre} on {surface}: {missing} conditions without C or K are not in the map")
        if complete:
            tables.append(_table(complete, campaign))
    return tables, remarks


def _table(conditions: Sequence[ConditionResult], campaign: Campaign) -> MeasuredTable:
    synthetic = any(item.synthetic for item in conditions)
    borrowed = any(item.borrowed_stiffness for item in conditions)
    notes = ["standard deviations include calibration, which is common to all conditions of the campaign"]
    notes += ["synthetic: from the rig simulator, not measured"] if synthetic else []
    notes += ["lateral stiffness is that of the flat track"] if borrowed else []
    radius = next((item.drum_radius for item in conditions if item.drum_radius), None)
    c = _column([item.cornering_stiffness for item in conditions])
    k = _column([item.lateral_stiffness for item in conditions])
    routes = sorted({route for item in conditions for route in item.direct})
    first = conditions[0]
    return MeasuredTable(
        tyre=first.tyre,
        surface=first.surface,
        load=np.array([item.load for item in conditions]),
        pressure=np.array([item.pressure for item in conditions]),
        cornering_stiffness=c.value,
        cornering_stiffness_sd=c.sd,
        lateral_stiffness=k.value,
        lateral_stiffness_sd=k.sd,
        source=f"fitted from the rig recordings in {campaign.folder.name}",
        notes=tuple(notes),
        lateral_stiffness_origin="flat-track value" if borrowed else "measured",
        synthetic=synthetic,
        drum_diameter=2.0 * radius if radius and first.surface == "drum" else None,
        calibration=_common(campaign.settings.calibration),
        stiffness_correlation=np.array([_correlation(item) for item in conditions]),
        cornering_stiffness_dof=c.dof,
        lateral_stiffness_dof=k.dof,
        pneumatic_trail=_measured([item.pneumatic_trail for item in conditions]),
        direct_relaxation_length={
            route: column
            for route in routes
            if (column := _measured([item.direct.get(route) for item in conditions])) is not None
        },
    )


def _common(calibration: Calibration) -> CommonCalibration:
    return CommonCalibration(force=calibration.force, slip=calibration.slip, displacement=calibration.displacement)


def _correlation(condition: ConditionResult) -> float:
    """Of cornering and lateral stiffness; 0 where one of them is exact."""
    covariance = np.zeros((3, 3)) if condition.covariance is None else condition.covariance
    scale = float(np.sqrt(covariance[0, 0] * covariance[1, 1]))
    return float(covariance[0, 1]) / scale if scale > 0.0 else 0.0


def _column(estimates: Sequence[Estimate | None]) -> MeasuredColumn:
    rows = [(np.nan, np.nan, np.inf) if e is None else (e.value, e.sd, e.dof) for e in estimates]
    return MeasuredColumn(*(np.array(column) for column in zip(*rows, strict=True)))


def _measured(estimates: Sequence[Estimate | None]) -> MeasuredColumn | None:
    """The column of a quantity; None where it was measured at no condition."""
    return _column(estimates) if any(estimate is not None for estimate in estimates) else None


def _write_property_files(table: MeasuredTable, folder: Path, name: str, wheel_radius: float) -> list[Path]:
    from tyre.magic_formula.tir_fit import fit_mf52, fit_mf61
    from tyre.magic_formula.tir_write import write_tir

    load, pressure = table.load, table.pressure
    c, k = table.cornering_stiffness, table.lateral_stiffness
    common: dict[str, Any] = {"tyre": table.tyre, "surface": table.surface, "notes": table.notes}
    paths = [folder / f"{name}_mf61.tir"]
    model = fit_mf61(load=load, pressure=pressure, cornering_stiffness=c, lateral_stiffness=k)
    write_tir(model, paths[0], unloaded_radius=wheel_radius, **common)
    for value in np.unique(pressure):
        here: Array = pressure == value
        paths.append(folder / f"{name}_{value / PASCAL_PER_BAR:.2f}bar_mf52.tir")
        old = fit_mf52(
            load=load[here],
            pressure=float(value),
            cornering_stiffness=c[here],
            lateral_stiffness=k[here],
            unloaded_radius=wheel_radius,
        )
        write_tir(old, paths[-1], **common)
    return paths
