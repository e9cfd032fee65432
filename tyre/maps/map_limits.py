"""Conditions and values that a tyre map refuses."""

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.maps.map_notes import measured_range
from tyre.maps.stiffness_trend import Trend
from tyre.maps.tables import PASCAL_PER_BAR, MeasuredTable


def check_condition(table: MeasuredTable, cornering: Trend, *, load: float, pressure: float) -> None:
    """Refuse a condition of which a table says nothing.

    Parameters
    ----------
    table : MeasuredTable
    cornering : Trend
        Of its cornering stiffness.
    load, pressure : float
        N and Pa.

    Raises
    ------
    InputError
        A number that is not finite and positive, another load or pressure than the only one measured, or a pressure
        at which the law of the cornering stiffness ends.
    """
    for name, value, unit, lines in (("load", load, "N", table.loads), ("pressure", pressure, "Pa", table.pressures)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{table.label}: {name} is {value:g} {unit}; it must be finite and > 0.")
        if lines.size == 1 and not np.isclose(value, lines[0], rtol=1e-9):
            raise InputError(
                f"{table.label}: {name} is {value:g} {unit}, but it was measured at {lines[0]:g} {unit} "
                f"only, which says nothing about another {name}; ask for that one or measure more."
            )
    change = (pressure - cornering.parameters["NOMPRES"]) / cornering.parameters["NOMPRES"]
    for name in ("PPY1", "PPY2"):
        if 1 + cornering.parameters.get(name, 0.0) * change <= 0:
            raise InputError(
                f"{table.label}: at {pressure / PASCAL_PER_BAR:g} bar the fitted 1 + {name} dpi is not "
                f"positive, so the cornering stiffness is not physical; stay nearer to {measured_range(table)}."
            )


def check_physical(table: MeasuredTable, load: Array, pressure: Array, cornering: Array, lateral: Array) -> None:
    """Refuse an extrapolation to a stiffness that no tyre has.

    Parameters
    ----------
    table : MeasuredTable
    load, pressure : ndarray, shape (n,)
        N and Pa.
    cornering, lateral : ndarray, shape (n,)
        Predicted stiffnesses, N/rad and N/m.

    Raises
    ------
    InputError
        One that is not finite and positive.
    """
    for row, stiffness, name, unit in (
        *((row, value, "cornering stiffness", "N/rad") for row, value in enumerate(cornering)),
        *((row, value, "lateral stiffness", "N/m") for row, value in enumerate(lateral)),
    ):
        if not (np.isfinite(stiffness) and stiffness > 0):
            raise InputError(
                f"{table.label}: extrapolation to {load[row]:g} N, {pressure[row] / PASCAL_PER_BAR:g} bar "
                f"gives a {name} of {stiffness:g} {unit}, which is not physical; stay nearer to "
                f"{measured_range(table)}."
            )
