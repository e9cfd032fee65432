"""What a tyre map holds as data frames, in the units of the field (N/deg, N/mm, mm, bar)."""

from typing import TYPE_CHECKING

import numpy as np

from tyre.base.units import PASCAL_PER_BAR

if TYPE_CHECKING:
    import pandas as pd

    from tyre.maps.tyre_map import TyreMap


def measured_frame(tyre_map: "TyreMap") -> "pd.DataFrame":
    """The measured conditions with standard deviations, one row each."""
    import pandas as pd

    measured, cornering_sd = tyre_map.measured, tyre_map.cornering_stiffness_sd
    length = measured.relaxation_length
    relative = np.hypot(
        cornering_sd / measured.cornering_stiffness, measured.lateral_stiffness_sd / measured.lateral_stiffness
    )
    return pd.DataFrame(
        {
            "tyre": measured.tyre,
            "surface": measured.surface,
            "load_N": measured.load,
            "pressure_bar": measured.pressure / PASCAL_PER_BAR,
            "cornering_stiffness_N_per_deg": np.radians(measured.cornering_stiffness),
            "cornering_stiffness_sd_N_per_deg": np.radians(cornering_sd),
            "lateral_stiffness_N_per_mm": measured.lateral_stiffness / 1e3,
            "lateral_stiffness_sd_N_per_mm": measured.lateral_stiffness_sd / 1e3,
            "relaxation_length_mm": length * 1e3,
            "relaxation_length_sd_mm": relative * length * 1e3,
        }
    )


def fit_quality_frame(tyre_map: "TyreMap") -> "pd.DataFrame":
    """How well the smooth trends describe the measured values, one row per stiffness."""
    import pandas as pd

    rows = []
    for name, trend, unit, scale, value, sd in (
        (
            "cornering stiffness",
            tyre_map.cornering_stiffness_trend,
            "N/deg",
            np.pi / 180,
            tyre_map.measured.cornering_stiffness,
            tyre_map.cornering_stiffness_sd,
        ),
        (
            "lateral stiffness",
            tyre_map.lateral_stiffness_trend,
            "N/mm",
            1e-3,
            tyre_map.measured.lateral_stiffness,
            tyre_map.measured.lateral_stiffness_sd,
        ),
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


def residual_frame(tyre_map: "TyreMap") -> "pd.DataFrame":
    """Measured minus trend at every measured condition."""
    import pandas as pd

    return pd.DataFrame(
        {
            "load_N": tyre_map.measured.load,
            "pressure_bar": tyre_map.measured.pressure / PASCAL_PER_BAR,
            "cornering_stiffness_residual_N_per_deg": np.radians(tyre_map.cornering_stiffness_trend.residuals),
            "lateral_stiffness_residual_N_per_mm": tyre_map.lateral_stiffness_trend.residuals / 1e3,
        }
    )
