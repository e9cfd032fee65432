"""What a tyre map says in words about its values."""

import numpy as np

from tyre.base.units import PASCAL_PER_BAR
from tyre.maps.stiffness_trend import Trend
from tyre.maps.tables import MeasuredTable
from tyre.properties import Origin, stiffness_note


def measured_range(table: MeasuredTable) -> str:
    """The measured loads and pressures, for messages.

    Parameters
    ----------
    table : MeasuredTable
    """
    loads, pressures = table.loads, table.pressures / PASCAL_PER_BAR
    return f"the measured {loads[0]:g}-{loads[-1]:g} N and {pressures[0]:g}-{pressures[-1]:g} bar"


def condition_notes(
    table: MeasuredTable,
    *,
    origin: Origin,
    cornering: Trend,
    lateral: Trend,
    relative_cornering_stiffness_sd: float,
) -> tuple[str, ...]:
    """What must be told about a value of this origin: assumptions, borrowed numbers, and the misfit of smooth laws.

    Parameters
    ----------
    table : MeasuredTable
    origin : {"measured", "interpolated", "extrapolated"}
    cornering, lateral : Trend
        Of the stiffnesses.
    relative_cornering_stiffness_sd : float
        Assumed where the table states none; a ratio.
    """
    notes = list(table.notes)
    if table.synthetic:
        notes.insert(0, "synthetic: no rig measured this tyre")
    if table.cornering_stiffness_sd is None:
        notes.append(stiffness_note(relative_cornering_stiffness_sd))
    if origin == "measured":
        return tuple(notes)
    way = "between measured conditions" if origin == "interpolated" else f"extrapolated beyond {measured_range(table)}"
    notes.append(
        f"cornering stiffness {way}: MF6.1 form through the measured values, "
        f"misfit {np.radians(cornering.misfit):.1f} N/deg"
    )
    stated = float(np.sqrt(np.mean(table.lateral_stiffness_sd**2)))
    jumps = (
        f", more than its measured {stated / 1e3:.1f} N/mm: it jumps between conditions, and no smooth law describes it"
        if lateral.misfit > stated > 0
        else ""
    )
    law = "bilinear in the measured values" if origin == "interpolated" else "linear trend in load and pressure"
    notes.append(f"lateral stiffness {way}: {law}, misfit of a linear law {lateral.misfit / 1e3:.1f} N/mm{jumps}")
    for name, trend in (("cornering", cornering), ("lateral", lateral)):
        if trend.degrees_of_freedom < 1:
            notes.append(f"too few conditions to estimate the misfit of the {name} stiffness; it is counted as zero")
    return tuple(notes)
