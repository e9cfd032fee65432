"""A length measured at some conditions of a table beside the stiffnesses, such as the pneumatic trail."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError


@dataclass(frozen=True, eq=False)
class MeasuredColumn:
    """Values of one quantity at the conditions of a table, NaN where it was not measured.

    Attributes
    ----------
    value, sd : ndarray, shape (N,)
        SI units; both are numbers or both NaN.
    dof : ndarray, shape (N,)
        Degrees of freedom behind the standard deviation; infinite where nothing is said.

    Raises
    ------
    InputError
        Shapes that differ, a value without standard deviation, a negative standard deviation, or dof <= 0.
    """

    value: Array
    sd: Array
    dof: Array

    def __post_init__(self) -> None:
        for name in ("value", "sd", "dof"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not self.value.shape == self.sd.shape == self.dof.shape or self.value.ndim != 1:
            raise InputError(
                f"value, sd and dof have shapes {self.value.shape}, {self.sd.shape} and {self.dof.shape}; "
                "each needs one number for every condition"
            )
        for row in np.flatnonzero(np.isnan(self.value) != np.isnan(self.sd)):
            raise InputError(f"condition {row + 1} has a value without its standard deviation or the reverse")
        for row in np.flatnonzero(self.known & ~(np.isfinite(self.value) & np.isfinite(self.sd) & (self.sd >= 0))):
            raise InputError(
                f"condition {row + 1} is {self.value[row]:g} with a standard deviation of {self.sd[row]:g}; "
                "both must be finite and the latter >= 0"
            )
        for row in np.flatnonzero(self.known & ~(self.dof > 0)):
            raise InputError(f"condition {row + 1} has {self.dof[row]:g} degrees of freedom; there must be more than 0")

    @property
    def known(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Where it was measured, shape (N,)."""
        return np.asarray(~np.isnan(self.value))
