"""A measured tyre: its conditions as a table, what they have in common, and their range in words."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR


@dataclass(frozen=True)
class CommonCalibration:
    """Relative standard deviations of the rig's gains; their errors are the same at every condition of a table.

    With d the relative error of each gain, dC/C = d_force - d_slip and dK/K = d_force - d_displacement: the load cell
    is common to both stiffnesses and cancels in the relaxation length C/K. (Two load cells: count them with slip and
    displacement, and give force = 0.)
    """

    force: float  # gain of the lateral force cell; 0.003 is 0.3 %
    slip: float  # of the slip-angle sensor
    displacement: float  # of the dial gauges

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value < 0.5:  # a gain known no better is not calibrated
                raise InputError(
                    f"calibration.{name} = {value!r} must be a relative standard uncertainty from 0 to 0.5"
                )

    @property
    def relative_covariance(self) -> Array:
        """Covariance of (C, K), each over its value, shape (2, 2)."""
        shared = self.force**2
        return np.array([[shared + self.slip**2, shared], [shared, shared + self.displacement**2]])


def _read_only(values: Any) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class MeasuredColumn:
    """Values of one quantity at the conditions of a table, NaN where it was not measured."""

    value: Array  # (N,), SI units
    sd: Array  # (N,), SI units; NaN like the value, or everywhere where none is stated
    dof: Array  # (N,), degrees of freedom behind the standard deviation; infinite if none are stated

    def __post_init__(self) -> None:
        for name in ("value", "sd", "dof"):
            object.__setattr__(self, name, _read_only(getattr(self, name)))
        if not self.value.shape == self.sd.shape == self.dof.shape or self.value.ndim != 1:
            shapes = ", ".join(str(array.shape) for array in (self.value, self.sd, self.dof))
            raise InputError(f"value, sd and dof have shapes {shapes}; each needs one number for every condition")
        for row in np.flatnonzero(self.stated & (np.isnan(self.value) != np.isnan(self.sd))):
            raise InputError(f"condition {row + 1} has a value without its standard deviation or the reverse")
        sound = np.isfinite(self.value) & ((np.isfinite(self.sd) & (self.sd >= 0)) | (not self.stated))
        for row in np.flatnonzero(self.known & ~sound):
            raise InputError(
                f"condition {row + 1} is {self.value[row]:g} with a standard deviation of {self.sd[row]:g}; "
                "both must be finite and the latter >= 0"
            )
        for row in np.flatnonzero(self.known & ~(self.dof > 0)):
            raise InputError(f"condition {row + 1} has {self.dof[row]:g} degrees of freedom; there must be more than 0")

    @property
    def known(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """True at a condition where it was measured, shape (N,)."""
        return np.asarray(~np.isnan(self.value))

    @property
    def stated(self) -> bool:
        """False where the source states no standard deviation."""
        return not np.isnan(self.sd).all()


SURFACES = ("flat", "drum")
SHAREABLE = ("load", "pressure", "surface")


def listed(names: Iterable[str]) -> str:
    """Quote and join names for a message."""
    return ", ".join(f"'{name}'" for name in names)


def _is_positive(values: Array) -> Any:
    """True (N,) for conditions at which a value is finite and > 0."""
    return np.isfinite(values) & (values > 0)


def _is_sd(values: Array) -> Any:
    """True (N,) for conditions at which a value is finite and >= 0."""
    return np.isfinite(values) & (values >= 0)


# column of a measured table -> which of its values (N,) are allowed, and the same in words; the load comes first, as
# the others must have its shape
COLUMN_LIMITS: dict[str, tuple[Callable[[Array], Any], str]] = {
    "load": (_is_positive, "finite and > 0"),
    "pressure": (_is_positive, "finite and > 0"),
    "cornering_stiffness": (_is_positive, "finite and > 0"),
    "lateral_stiffness": (_is_positive, "finite and > 0"),
    "lateral_stiffness_sd": (_is_sd, "finite and >= 0"),
    "cornering_stiffness_sd": (_is_sd, "finite and >= 0"),
    "stiffness_correlation": (lambda values: np.abs(values) <= 1, "from -1 to 1"),
    "cornering_stiffness_dof": (lambda values: values > 0, "> 0"),
    "lateral_stiffness_dof": (lambda values: values > 0, "> 0"),
}


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
        C_alpha, N/rad, and K_y, N/m; the relaxation length is their ratio.
    cornering_stiffness_sd : ndarray, shape (N,), or None
        One standard deviation, N/rad; None where the source states none. Independent between conditions but for
        ``calibration``, which it holds.
    lateral_stiffness_sd : ndarray, shape (N,), or None
        One standard deviation, N/m; None where the source states none. It holds the calibration too.
    calibration : CommonCalibration or None
        Gains of the rig, whose errors are common to all conditions and, the load cell's, to both stiffnesses.
    stiffness_correlation : ndarray, shape (N,), or None
        Correlation of C_alpha and K_y at each condition; None: what the calibration makes it.
    cornering_stiffness_dof, lateral_stiffness_dof : ndarray, shape (N,), or None
        Degrees of freedom behind the standard deviations; both or none.
    pneumatic_trail : MeasuredColumn or None
        Distance of the lateral force behind the contact centre at zero slip, m.
    camber_stiffness : MeasuredColumn or None
        Lateral force per camber at zero slip, N/rad.
    direct_relaxation_length : mapping of str to MeasuredColumn
        Relaxation length measured by other routes than C_alpha / K_y, by the name of the route, m.
    lateral_stiffness_shared_over : tuple of str
        Conditions that differ only in these (``load``, ``pressure``, ``surface``) share their lateral-stiffness error.
    resolution : tuple of float or None
        One unit of the last printed digit of cornering stiffness (N/rad) and relaxation length (m).
    source, description : str
        Where the numbers come from, and what the tyre is.
    notes : tuple of str
        What a reader of any value must know.
    lateral_stiffness_origin : str
        How the lateral stiffness came about, in words, where it was not measured in a lateral stiffness test on this
        surface.
    synthetic : bool
        True where no rig measured this.
    drum_diameter, width : float or None
        m.
    surface_stated : bool
        False where the source names no surface and a flat one is taken.
    """

    tyre: str
    surface: str
    load: Array
    pressure: Array
    cornering_stiffness: Array
    lateral_stiffness: Array
    lateral_stiffness_sd: Array | None = None
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
    camber_stiffness: MeasuredColumn | None = None
    direct_relaxation_length: Mapping[str, MeasuredColumn] = field(default_factory=dict)
    surface_stated: bool = True

    def __post_init__(self) -> None:
        if self.surface not in SURFACES:
            raise InputError(f"{self.label}: surface is '{self.surface}'; allowed are {listed(SURFACES)}.")
        for dimension in set(self.lateral_stiffness_shared_over) - set(SHAREABLE):
            raise InputError(
                f"{self.label}: lateral_stiffness_shared_over has '{dimension}'; allowed are {listed(SHAREABLE)}."
            )
        for name, (is_allowed, allowed) in COLUMN_LIMITS.items():
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _read_only(getattr(self, name)))
                self._check_shape(name, getattr(self, name))
                self._check_values(name, is_allowed, allowed)
        for name in ("calibration", "stiffness_correlation", "cornering_stiffness_dof"):
            for stiffness in ("cornering", "lateral"):
                if getattr(self, f"{stiffness}_stiffness_sd") is None and getattr(self, name) is not None:
                    raise InputError(
                        f"{self.label}: {name} is given, but no standard deviation of the {stiffness} stiffness that "
                        f"it could belong to; give {stiffness}_stiffness_sd too."
                    )
        if (self.cornering_stiffness_dof is None) != (self.lateral_stiffness_dof is None):
            raise InputError(f"{self.label}: degrees of freedom of one stiffness only; give those of both or of none")
        further = {"pneumatic_trail": self.pneumatic_trail, "camber_stiffness": self.camber_stiffness}
        for name, column in {**further, **self.direct_relaxation_length}.items():
            if column is not None:
                self._check_shape(name, column.value)
        conditions, counts = np.unique(np.column_stack([self.load, self.pressure]), axis=0, return_counts=True)
        for load, pressure in conditions[counts > 1]:
            at = f"{load:g} N at {pressure / PASCAL_PER_BAR:g} bar"
            raise InputError(f"{self.label}: {at} appears twice; combine repeats into one condition.")

    def __repr__(self) -> str:
        return f"<MeasuredTable of {self.ranges}>"

    @property
    def ranges(self) -> str:
        """Name, number of conditions, and their ranges in the units of the field, in two lines."""
        load, bar = self.load, self.pressure / PASCAL_PER_BAR
        c, k = np.radians(self.cornering_stiffness), self.lateral_stiffness / 1e3
        length = self.relaxation_length * 1e3
        return (
            f"{self.label}{', synthetic' if self.synthetic else ''}: {load.size} conditions, "
            f"{load.min():g}-{load.max():g} N and {bar.min():g}-{bar.max():g} bar\n"
            f" cornering stiffness {c.min():.1f}-{c.max():.1f} N/deg, lateral stiffness {k.min():.1f}-{k.max():.1f} "
            f"N/mm, relaxation length {length.min():.0f}-{length.max():.0f} mm"
        )

    def _check_values(self, name: str, is_allowed: Callable[[Array], Any], allowed: str) -> None:
        """Refuse a column with a value that is not ``allowed``, in words."""
        values = getattr(self, name)
        for row in np.flatnonzero(~is_allowed(values)):
            raise InputError(f"{self.label}: {name} of condition {row + 1} is {values[row]:g}; it must be {allowed}.")

    def _check_shape(self, name: str, array: Array) -> None:
        """Refuse a column that has not one value for every condition."""
        if array.ndim != 1 or array.size == 0 or array.shape != self.load.shape:
            raise InputError(
                f"{self.label}: {name} has shape {array.shape}; every column needs the shape of load, "
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

    def condition(self, row: int) -> str:
        """Name the condition in ``row`` (index from 0), for messages."""
        return f"{self.label}, {self.load[row]:g} N at {self.pressure[row] / PASCAL_PER_BAR:g} bar"

    @property
    def relaxation_length(self) -> Array:
        """Cornering over lateral stiffness, m, shape (N,)."""
        return np.asarray(self.cornering_stiffness / self.lateral_stiffness)

    def sharing_key(self, row: int) -> tuple[float | str, ...]:
        """Return the key that conditions (``row``, from 0) with a common lateral-stiffness error share."""
        if not self.lateral_stiffness_shared_over:
            return (self.surface, row)
        values: dict[str, float | str] = {"load": float(self.load[row]), "pressure": float(self.pressure[row])}
        values["surface"] = self.surface
        return tuple(values[name] for name in SHAREABLE if name not in self.lateral_stiffness_shared_over)


def common_lateral_stiffness(tables: Iterable[MeasuredTable]) -> dict[tuple[float | str, ...], tuple[float, float]]:
    """Return the interval of lateral stiffness (N/m) that each group of sharing conditions has in common."""
    common: dict[tuple[float | str, ...], tuple[float, float]] = {}
    for table in tables:
        if table.resolution is None or not table.lateral_stiffness_shared_over:
            continue
        stiffness_half, length_half = table.resolution[0] / 2, table.resolution[1] / 2
        low = (table.cornering_stiffness - stiffness_half) / (table.relaxation_length + length_half)
        high = (table.cornering_stiffness + stiffness_half) / (table.relaxation_length - length_half)
        for row in range(table.load.size):
            key = table.sharing_key(row)
            lowest, highest = common.get(key, (0.0, math.inf))
            common[key] = (max(lowest, float(low[row])), min(highest, float(high[row])))
            if common[key][0] > common[key][1]:
                raise InputError(
                    f"{table.condition(row)}: the lateral stiffness, {table.lateral_stiffness[row] / 1e3:.2f} N/mm, "
                    "differs from the other conditions declared to share it by more than the rounding of the printed "
                    "digits; correct the number or lateral_stiffness_shared_over."
                )
    return common
