"""What a tyre is to a bicycle at one condition: cornering stiffness, lateral stiffness and relaxation length."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tyre.fits.estimate import Estimate

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
    degrees_of_freedom : ndarray, shape (3,), or None
        Behind the variances of (cornering stiffness, lateral stiffness, relaxation length), infinite where they are
        known well; None where the source states none.
    pneumatic_trail, pneumatic_trail_sd : float or None
        Distance of the side force behind the contact centre at zero slip and its standard deviation, m; None where
        the aligning moment was not measured.
    direct_relaxation_lengths : mapping of str to Estimate
        Relaxation length by other routes than C_Fy / K_y, by the name of the route, m.
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
    degrees_of_freedom: NDArray[np.float64] | None = None
    pneumatic_trail: float | None = None
    pneumatic_trail_sd: float | None = None
    direct_relaxation_lengths: Mapping[str, Estimate] = field(default_factory=dict)

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
