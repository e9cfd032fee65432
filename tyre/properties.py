"""What a tyre is to a bicycle at one condition: cornering stiffness, lateral stiffness and relaxation length."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Origin = Literal["measured", "interpolated", "extrapolated"]


@dataclass(frozen=True, eq=False)
class TyreProperties:
    """Linear side-force properties of one tyre at one load and pressure, with covariance.

    Attributes
    ----------
    tyre, surface : str
        Name of the tyre; ``flat`` or ``drum``.
    load : float
        Vertical load, N.
    pressure : float
        Inflation pressure, Pa.
    cornering_stiffness : float
        C_Fy = dFy/d(alpha) at zero slip, N/rad.
    lateral_stiffness : float
        K_y = dFy/d(lateral tyre deflection), N/m.
    relaxation_length : float
        C_Fy / K_y, m (Dell'Orto et al., eq. 3).
    covariance : ndarray, shape (3, 3)
        Of (cornering stiffness, lateral stiffness, relaxation length), SI units.
    origin : {"measured", "interpolated", "extrapolated"}
        How the values came about at this load and pressure.
    lateral_stiffness_origin : str
        How the lateral stiffness of the table came about where no pull test on this surface measured it.
    synthetic : bool
        True where no rig measured the tyre.
    cornering_stiffness_sd_stated : bool
        False where the source states none, and an assumed one is in the covariance.
    notes : tuple of str
        What a reader of a result must be told (an assumption, a borrowed stiffness, a misfit).
    """

    tyre: str
    surface: str
    load: float
    pressure: float
    cornering_stiffness: float
    lateral_stiffness: float
    relaxation_length: float
    covariance: NDArray[np.float64] = field(repr=False)
    origin: Origin
    notes: tuple[str, ...] = ()
    lateral_stiffness_origin: str = "measured"
    synthetic: bool = False
    cornering_stiffness_sd_stated: bool = True

    @property
    def inside(self) -> bool:
        """False where the values are extrapolated beyond the measured loads or pressures."""
        return self.origin != "extrapolated"

    @property
    def cornering_stiffness_sd(self) -> float:
        """One standard deviation of C_Fy, N/rad."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def lateral_stiffness_sd(self) -> float:
        """One standard deviation of K_y, N/m."""
        return float(np.sqrt(self.covariance[1, 1]))

    @property
    def relaxation_length_sd(self) -> float:
        """One standard deviation of the relaxation length, m."""
        return float(np.sqrt(self.covariance[2, 2]))
