"""What a tyre is to a bicycle at one condition: cornering stiffness, lateral stiffness and relaxation length."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tyre.estimate import Estimate

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
        K_y = dFy/d(lateral tyre deflection), N/m; NaN where the source holds none.
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
    lateral_stiffness_sd_stated : bool
        The same of the lateral stiffness, and so of the relaxation length.
    notes : tuple of str
        What a reader of a result must be told (an assumption, a borrowed stiffness, a misfit).
    degrees_of_freedom : ndarray, shape (3,), or None
        Behind the variances of (cornering stiffness, lateral stiffness, relaxation length), infinite where they are
        known well; None where the source states none.
    pneumatic_trail, pneumatic_trail_sd : float or None
        t = -dMz/dFy at zero slip without camber, and one standard deviation, m; None where not known, as below.
    direct_relaxation_lengths : mapping of str to Estimate
        Relaxation length by other routes than C_Fy / K_y, by the name of the route, m.
    camber_stiffness : float or None
        C_gamma = dFy/d(camber) at zero slip, N/rad, > 0 where a lean to the right pushes to the right.
    twisting_stiffness : float or None
        What dMz/d(camber) is beside the moment -t Fy of the camber force, N m/rad, > 0 into the lean.
    overturning_stiffness : float or None
        -dMx/d(camber) about the point where wheel plane and ground meet, without side force, N m/rad, > 0 where the
        load moves towards the lean.
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
    lateral_stiffness_sd_stated: bool = True
    pneumatic_trail: float | None = None
    pneumatic_trail_sd: float | None = None
    direct_relaxation_lengths: Mapping[str, Estimate] = field(default_factory=dict)
    camber_stiffness: float | None = None
    twisting_stiffness: float | None = None
    overturning_stiffness: float | None = None

    @property
    def aligning_stiffness(self) -> float | None:
        """C_M = -dMz/d(slip) = t C_Fy at zero slip, N m/rad; None where the trail is not known."""
        return None if self.pneumatic_trail is None else self.pneumatic_trail * self.cornering_stiffness

    @property
    def crown_radius(self) -> float | None:
        """Radius (m) of a round tread on which the load moves as the overturning moment says; None where not known."""
        return None if self.overturning_stiffness is None else self.overturning_stiffness / self.load

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


MEASURED_BESIDE = ("pneumatic_trail", "camber_stiffness", "twisting_stiffness", "overturning_stiffness")
"""Fields of `TyreProperties` that a tyre may hold beside its stiffnesses."""

FOLLOWS_FROM = {"aligning_stiffness": "pneumatic_trail", "crown_radius": "overturning_stiffness"}
"""Properties that follow from one of these fields (and the cornering stiffness or the load)."""


def parameters_of_effects(values: Mapping[str, Any], *, load: Any) -> dict[str, Any]:
    """Add the properties of `TyreProperties` that follow from its fields, as far as those are there.

    Parameters
    ----------
    values : mapping of str to ndarray
        Fields by name, SI units.
    load : ndarray
        Vertical load, N.
    """
    found = dict(values)
    if "pneumatic_trail" in values:
        found["aligning_stiffness"] = values["pneumatic_trail"] * values["cornering_stiffness"]
    if "overturning_stiffness" in values:
        found["crown_radius"] = values["overturning_stiffness"] / load
    return found


def stiffness_note(relative_sd: float) -> str:
    """What is taken for the uncertainty of C_Fy where a source states none.

    Parameters
    ----------
    relative_sd : float
        sd(C_Fy) / C_Fy that is assumed, dimensionless.
    """
    taken = (
        f"assumed is {100 * relative_sd:g} % (one standard deviation)"
        if relative_sd
        else "none is assumed, so it counts as exact where it was measured"
    )
    return f"the source states no uncertainty of the cornering stiffness; {taken}"
