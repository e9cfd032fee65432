"""What the calibration of a rig leaves uncertain: gains that all conditions of a table have in common."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError

LARGEST = 0.5  # a gain known no better is not calibrated


@dataclass(frozen=True)
class CommonCalibration:
    """Relative standard deviations of the rig's gains; their errors are the same at every condition of a table.

    With d the relative error of each gain, dC/C = d_force - d_slip and dK/K = d_force - d_displacement: the load cell
    is common to both stiffnesses and cancels in the relaxation length C/K. (Two load cells: count them with slip and
    displacement, and give force = 0.)

    Attributes
    ----------
    force, slip, displacement : float
        Gain of the side-force cell, of the slip-angle sensor and of the dial gauges; 0.003 is 0.3 %.

    Raises
    ------
    InputError
        A number outside 0 .. 0.5.
    """

    force: float
    slip: float
    displacement: float

    def __post_init__(self) -> None:
        for name in ("force", "slip", "displacement"):
            value = getattr(self, name)
            if not 0.0 <= value < LARGEST:
                raise InputError(
                    f"calibration.{name} = {value!r} must be a relative standard deviation from 0 to {LARGEST:g}"
                )

    @property
    def relative_covariance(self) -> Array:
        """Of (C, K), each over its value, shape (2, 2)."""
        shared = self.force**2
        return np.array([[shared + self.slip**2, shared], [shared, shared + self.displacement**2]])
