"""Measured tyre tables: stiffness of one tyre on one surface at the measured conditions."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.maps.calibration import CommonCalibration
from tyre.maps.measured_column import MeasuredColumn
from tyre.maps.table_sidecar import listed

SURFACES = ("flat", "drum")
SHAREABLE = ("load", "pressure", "surface")


@dataclass(frozen=True, eq=False)
class MeasuredTable:
    """Cornering and lateral stiffness of one tyre on one surface at the measured conditions, SI units.

    Attributes
    ----------
    tyre, surface : str
        Name of the tyre; ``flat`` or ``drum``.
    load, pressure : ndarray, shape (N,)
        Vertical load, N, and inflation pressure, Pa.
    cornering_stiffness, lateral_stiffness : ndarray, shape (N,)
        C_Fy, N/rad, and K_y, N/m; the relaxation length is their ratio.
    cornering_stiffness_sd : ndarray, shape (N,), or None
        One standard deviation, N/rad; None where the source states none. Independent between conditions but for
        ``calibration``, which it holds.
    lateral_stiffness_sd : ndarray, shape (N,)
        One standard deviation, N/m; it holds the calibration too.
    calibration : CommonCalibration or None
        Gains of the rig, whose errors are common to all conditions and, the load cell's, to both stiffnesses.
    stiffness_correlation : ndarray, shape (N,), or None
        Correlation of C_Fy and K_y at each condition; None: what the calibration makes it.
    cornering_stiffness_dof, lateral_stiffness_dof : ndarray, shape (N,), or None
        Degrees of freedom behind the standard deviations; both or none.
    pneumatic_trail : MeasuredColumn or None
        Distance of the side force behind the contact centre at zero slip, m.
    direct_relaxation_length : mapping of str to MeasuredColumn
        Relaxation length measured by other routes than C_Fy / K_y, by the name of the route, m.
    lateral_stiffness_shared_over : tuple of str
        Conditions that differ only in these (``load``, ``pressure``, ``surface``) share their lateral-stiffness error.
    resolution : tuple of float or None
        One unit of the last printed digit of cornering stiffness (N/rad) and relaxation length (m).
    source, description : str
        Where the numbers come from, and what the tyre is.
    notes : tuple of str
        What a reader of any value must be told.
    lateral_stiffness_origin : str
        How the lateral stiffness came about, in words, where it was not measured in a pull test on this surface.
    synthetic : bool
        True where no rig measured this.
    drum_diameter, width : float or None
        m.
    """

    tyre: str
    surface: str
    load: Array
    pressure: Array
    cornering_stiffness: Array
    lateral_stiffness: Array
    lateral_stiffness_sd: Array
    cornering_stiffness_sd: Array | None = None
    lateral_stiffness_shared_over: tuple[str, ...] = ()
    resolution: tuple[float, float] | None = None
    source: str = ""
    description: str = ""
    notes: tuple[str, ...] = ()
    lateral_stiffness_origin: str = "measured"
    synthetic: bool = False
    drum_diameter: float | None = None
    width: float | None = None
    calibration: CommonCalibration | None = None
    stiffness_correlation: Array | None = None
    cornering_stiffness_dof: Array | None = None
    lateral_stiffness_dof: Array | None = None
    pneumatic_trail: MeasuredColumn | None = None
    direct_relaxation_length: Mapping[str, MeasuredColumn] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.surface not in SURFACES:
            raise InputError(f"{self.label}: surface is '{self.surface}'; allowed are {listed(SURFACES)}.")
        for dimension in self.lateral_stiffness_shared_over:
            if dimension not in SHAREABLE:
                raise InputError(
                    f"{self.label}: lateral_stiffness_shared_over has '{dimension}'; allowed are {listed(SHAREABLE)}."
                )
        for name in ("load", "pressure", "cornering_stiffness", "lateral_stiffness"):
            self._keep(name, (0.0, math.inf), "finite and > 0", low_allowed=False)
        self._keep("lateral_stiffness_sd", (0.0, math.inf), "finite and >= 0")
        self._keep("cornering_stiffness_sd", (0.0, math.inf), "finite and >= 0")
        self._keep("stiffness_correlation", (-1.0, 1.0), "from -1 to 1")
        for name in ("cornering_stiffness_dof", "lateral_stiffness_dof"):
            self._keep(name, (0.0, math.inf), "> 0", low_allowed=False, infinite=True)
        self._check_columns()
        seen: set[tuple[float, float]] = set()
        for condition in zip(self.load.tolist(), self.pressure.tolist(), strict=True):
            if condition in seen:
                raise InputError(
                    f"{self.label}: {condition[0]:g} N at {condition[1] / PASCAL_PER_BAR:g} bar appears twice; "
                    "combine repeats into one condition."
                )
            seen.add(condition)

    def _keep(
        self, name: str, limits: tuple[float, float], allowed: str, *, low_allowed: bool = True, infinite: bool = False
    ) -> None:
        """Keep a column as a read-only array of the shape of ``load``, with values within the limits; or None."""
        if getattr(self, name) is None:
            return
        array = np.array(getattr(self, name), dtype=np.float64)
        array.setflags(write=False)
        object.__setattr__(self, name, array)
        if array.ndim != 1 or array.size == 0 or array.shape != self.load.shape:
            raise InputError(
                f"{self.label}: {name} has shape {array.shape}; every column needs the shape of load, "
                f"{self.load.shape}, with at least one condition."
            )
        inside = ((array >= limits[0]) if low_allowed else (array > limits[0])) & (array <= limits[1])
        for row in np.flatnonzero(~(inside & (np.isfinite(array) | (infinite & ~np.isnan(array))))):
            raise InputError(f"{self.label}: {name} of condition {row + 1} is {array[row]:g}; it must be {allowed}.")

    def _check_columns(self) -> None:
        if self.cornering_stiffness_sd is None:
            for name in ("calibration", "stiffness_correlation", "cornering_stiffness_dof"):
                if getattr(self, name) is not None:
                    raise InputError(
                        f"{self.label}: {name} is given, but no standard deviation of the cornering stiffness that it "
                        "could belong to; give cornering_stiffness_sd too."
                    )
        if (self.cornering_stiffness_dof is None) != (self.lateral_stiffness_dof is None):
            raise InputError(
                f"{self.label}: degrees of freedom of one stiffness only; give those of both or of none "
                "(inf where a standard deviation is known well)."
            )
        for name, column in {"pneumatic_trail": self.pneumatic_trail, **self.direct_relaxation_length}.items():
            if column is not None and column.value.shape != self.load.shape:
                raise InputError(
                    f"{self.label}: {name} has shape {column.value.shape}; every column needs the shape of load, "
                    f"{self.load.shape}, with at least one condition."
                )

    @property
    def loads(self) -> Array:
        """Measured vertical loads, N, ascending."""
        return np.unique(self.load)

    @property
    def pressures(self) -> Array:
        """Measured inflation pressures, Pa, ascending."""
        return np.unique(self.pressure)

    @property
    def label(self) -> str:
        """``tyre on surface``, for messages."""
        return f"{self.tyre} on {self.surface}"

    @property
    def relaxation_length(self) -> Array:
        """Cornering over lateral stiffness, m, shape (N,)."""
        return np.asarray(self.cornering_stiffness / self.lateral_stiffness)

    def sharing_key(self, row: int) -> tuple[float | str, ...]:
        """What conditions with a common lateral-stiffness error have in common; unique where nothing is shared.

        Parameters
        ----------
        row : int
            Number of the condition, from 0.
        """
        if not self.lateral_stiffness_shared_over:
            return (self.surface, row)
        values: dict[str, float | str] = {
            "load": float(self.load[row]),
            "pressure": float(self.pressure[row]),
            "surface": self.surface,
        }
        return tuple(values[name] for name in SHAREABLE if name not in self.lateral_stiffness_shared_over)


def common_lateral_stiffness(tables: Iterable[MeasuredTable]) -> dict[tuple[float | str, ...], tuple[float, float]]:
    """Return the interval of lateral stiffness (N/m) that each group of sharing conditions has in common.

    Every printed cornering stiffness and relaxation length is an interval of half a unit of the last digit to both
    sides, and so is their ratio; conditions that got one lateral stiffness must have a common part of these intervals.

    Parameters
    ----------
    tables : iterable of MeasuredTable
        Of one tyre; those without ``resolution`` or shared stiffness are passed over.

    Raises
    ------
    InputError
        The intervals of a group have no common part: the declaration or a number is wrong.
    """
    common: dict[tuple[float | str, ...], tuple[float, float]] = {}
    for table in tables:
        if table.resolution is None or not table.lateral_stiffness_shared_over:
            continue
        stiffness_half, length_half = table.resolution[0] / 2, table.resolution[1] / 2
        low = (table.cornering_stiffness - stiffness_half) / (table.relaxation_length + length_half)
        high = (table.cornering_stiffness + stiffness_half) / (table.relaxation_length - length_half)
        for row in range(table.load.size):
            key = table.sharing_key(row)
            below, above = common.get(key, (0.0, math.inf))
            common[key] = (max(below, float(low[row])), min(above, float(high[row])))
            if common[key][0] > common[key][1]:
                raise InputError(
                    f"{table.label}: the lateral stiffness at {table.load[row]:g} N, "
                    f"{table.pressure[row] / PASCAL_PER_BAR:g} bar, {table.lateral_stiffness[row] / 1e3:.2f} N/mm, "
                    "differs from the other conditions declared to share it by more than the rounding of the printed "
                    "digits; "
                    "correct the number or lateral_stiffness_shared_over."
                )
    return common
