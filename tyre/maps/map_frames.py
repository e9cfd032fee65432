"""What a tyre map holds as data frames, in the units of the field (N/deg, N/mm, mm, bar)."""

from typing import TYPE_CHECKING

import numpy as np

from tyre.base.arrays import Array
from tyre.base.units import PASCAL_PER_BAR
from tyre.maps.stiffness_covariance import StiffnessCovariance
from tyre.maps.stiffness_trend import Trend
from tyre.maps.tables import MeasuredTable

if TYPE_CHECKING:
    import pandas as pd


def measured_frame(table: MeasuredTable, covariance: StiffnessCovariance) -> "pd.DataFrame":
    """The measured conditions with standard deviations, one row each.

    Parameters
    ----------
    table : MeasuredTable
    covariance : StiffnessCovariance
        At its conditions.
    """
    import pandas as pd

    c, k, length = table.cornering_stiffness, table.lateral_stiffness, table.relaxation_length
    cornering, both, lateral = (np.diag(block) for block in covariance[:3])
    relative = np.sqrt(np.maximum(cornering / c**2 + lateral / k**2 - 2 * both / (c * k), 0.0))
    columns = {
        "tyre": table.tyre,
        "surface": table.surface,
        "load_N": table.load,
        "pressure_bar": table.pressure / PASCAL_PER_BAR,
        "cornering_stiffness_N_per_deg": np.radians(c),
        "cornering_stiffness_sd_N_per_deg": np.radians(np.sqrt(cornering)),
        "lateral_stiffness_N_per_mm": k / 1e3,
        "lateral_stiffness_sd_N_per_mm": table.lateral_stiffness_sd / 1e3,
        "relaxation_length_mm": length * 1e3,
        "relaxation_length_sd_mm": relative * length * 1e3,
    }
    if table.pneumatic_trail is not None:
        columns |= {
            "pneumatic_trail_mm": table.pneumatic_trail.value * 1e3,
            "pneumatic_trail_sd_mm": table.pneumatic_trail.sd * 1e3,
        }
    return pd.DataFrame(columns)


def fit_quality_frame(
    table: MeasuredTable, *, cornering: Trend, lateral: Trend, cornering_stiffness_sd: Array
) -> "pd.DataFrame":
    """How well the smooth trends describe the measured values, one row per stiffness.

    Parameters
    ----------
    table : MeasuredTable
    cornering, lateral : Trend
        Of the stiffnesses.
    cornering_stiffness_sd : ndarray, shape (N,)
        Stated or assumed, N/rad.
    """
    import pandas as pd

    rows = []
    for name, trend, unit, scale, value, sd in (
        ("cornering stiffness", cornering, "N/deg", np.pi / 180, table.cornering_stiffness, cornering_stiffness_sd),
        ("lateral stiffness", lateral, "N/mm", 1e-3, table.lateral_stiffness, table.lateral_stiffness_sd),
    ):
        rows.append(
            {
                "quantity": name,
                "form": trend.form,
                "unit": unit,
                "misfit": trend.misfit * scale,
                "misfit_percent": 100 * trend.misfit / float(value.mean()),
                "largest_residual": float(np.abs(trend.residuals).max()) * scale,
                "r_squared": trend.r_squared,
                "degrees_of_freedom": trend.degrees_of_freedom,
                "smooth": bool(trend.misfit <= np.sqrt(np.mean(sd**2))) if sd.any() else None,
            }
        )
    return pd.DataFrame(rows)


def residual_frame(table: MeasuredTable, *, cornering: Trend, lateral: Trend) -> "pd.DataFrame":
    """Measured minus trend at every measured condition.

    Parameters
    ----------
    table : MeasuredTable
    cornering, lateral : Trend
        Of the stiffnesses.
    """
    import pandas as pd

    return pd.DataFrame(
        {
            "load_N": table.load,
            "pressure_bar": table.pressure / PASCAL_PER_BAR,
            "cornering_stiffness_residual_N_per_deg": np.radians(cornering.residuals),
            "lateral_stiffness_residual_N_per_mm": lateral.residuals / 1e3,
        }
    )
