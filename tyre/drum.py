"""What a drum does to cornering stiffness: lower than on a flat track by a power of the curvatures' ratio.

C_flat / C_drum = (1 + R / R_drum)^n, an empirical form; n of about 0.6 on the tyre measured on both by Dell'Orto et al.
The lateral stiffness of the standing tyre is taken as the same on both.
"""

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array


def log_curvature(*, wheel_radius: float, drum_radius: float | None) -> float:
    """Return ln(1 + R / R_drum), which the exponent multiplies in ln(C_flat / C_drum).

    Parameters
    ----------
    wheel_radius, drum_radius : float
        Of wheel with tyre and of the drum, m; a drum radius of None is a flat track, and gives 0.
    """
    return float(np.log1p(wheel_radius / drum_radius)) if drum_radius else 0.0


def flat_over_drum(*, exponent: ArrayLike, wheel_radius: float, drum_radius: float | None) -> Array:
    """Return the cornering stiffness on a flat track over that on a drum, (1 + R / R_drum)^n.

    Parameters
    ----------
    exponent : array_like
        n, dimensionless.
    wheel_radius, drum_radius : float
        m; as in `log_curvature`.

    Returns
    -------
    ndarray
        Dimensionless, of the shape of ``exponent``.
    """
    curved = log_curvature(wheel_radius=wheel_radius, drum_radius=drum_radius)
    return np.asarray(np.exp(np.asarray(exponent, dtype=np.float64) * curved))
