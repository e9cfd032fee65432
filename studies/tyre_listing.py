"""What a list of tyres shows of each, be it a measured table or a formula."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from tyre import TyreMap, TyreSource, available_tyres, read_tyre
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.find_tyre import packaged_formulas

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = {
    "cornering_stiffness": ("cornering_stiffness_N_per_deg", np.pi / 180),
    "lateral_stiffness": ("lateral_stiffness_N_per_mm", 1e-3),
    "relaxation_length": ("relaxation_length_mm", 1e3),
    "camber_stiffness": ("camber_stiffness_N_per_deg", np.pi / 180),
    "pneumatic_trail": ("pneumatic_trail_mm", 1e3),
    "twisting_stiffness": ("twisting_stiffness_N_m_per_rad", 1.0),
    "overturning_stiffness": ("overturning_stiffness_N_m_per_rad", 1.0),
}
"""Field of `TyreProperties` -> name and factor in the units of the field."""


def listed_tyres(tyre: str | None, surface: str | None) -> list[TyreSource]:
    """The tyre that is named, or all packaged ones: measured tables first, then formulas.

    Parameters
    ----------
    tyre : str, optional
        Name or file.
    surface : str, optional
        ``flat`` or ``drum``.
    """
    if tyre:
        return [read_tyre(tyre, surface=surface)]
    tables: list[TyreSource] = [
        TyreMap.load(name, surface=on)
        for name, measured in available_tyres().items() for on in measured if surface in (None, on)
    ]  # fmt: skip
    return [*tables, *(one for one in packaged_formulas().values() if surface in (None, one.surface))]


def tyre_record(tyre: TyreSource) -> dict[str, Any]:
    """One tyre as JSON has it.

    Parameters
    ----------
    tyre : TyreSource
    """
    load, pressure = conditions(tyre)
    held = _held(tyre, load, pressure)
    return {
        "tyre": tyre.tyre, "surface": tyre.surface, "description": tyre.description, "source": tyre.source,
        "synthetic": tyre.synthetic, "loads_N": tyre.loads.tolist(),
        "pressures_bar": (tyre.pressures / PASCAL_PER_BAR).round(9).tolist(), "conditions": int(load.size),
        **{
            name: (held[field] * factor).tolist() if field in held else []
            for field, (name, factor) in COLUMNS.items()
            if field in held or field in ("cornering_stiffness", "relaxation_length")
        },
        "notes": list(tyre.notes),
    }  # fmt: skip


def shown_conditions(tyre: TyreSource) -> "pd.DataFrame":
    """Measured conditions of a table; of a formula what it holds at loads and pressures in its range.

    Parameters
    ----------
    tyre : TyreSource

    Raises
    ------
    InputError
        A file of one pressure that it does not state.
    """
    import pandas as pd

    if isinstance(tyre, TyreMap):
        stated = tyre.measured.cornering_stiffness_sd is not None
        return tyre.table if stated else tyre.table.assign(cornering_stiffness_sd_N_per_deg=None)  # 0 would be exact
    load, pressure = conditions(tyre)
    if not load.size:
        raise InputError(f"{tyre.label}: the file states no pressure, so there is nothing to list")
    held = _held(tyre, load, pressure)
    columns = {name: held[field] * factor for field, (name, factor) in COLUMNS.items() if field in held}
    return pd.DataFrame({"load_N": load, "pressure_bar": pressure / PASCAL_PER_BAR} | columns)


def _held(tyre: TyreSource, load: Array, pressure: Array) -> Mapping[str, Array]:
    if isinstance(tyre, TyreMap):  # as they were measured, to the last digit
        fields = ("cornering_stiffness", "lateral_stiffness", "relaxation_length")
        return {name: getattr(tyre.measured, name) for name in fields}
    return tyre.linear(load=load, pressure=pressure) if load.size else {}


def conditions(tyre: TyreSource) -> tuple[Array, Array]:
    """Loads (N) and pressures (Pa) of a list: the measured ones, or each load with each pressure.

    Parameters
    ----------
    tyre : TyreSource
    """
    if isinstance(tyre, TyreMap):
        return tyre.measured.load, tyre.measured.pressure
    load, pressure = np.meshgrid(tyre.loads, tyre.pressures, indexing="ij")
    return load.ravel(), pressure.ravel()
