"""Measured tyre tables: stiffness of one tyre on one surface at the measured conditions."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
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
        One standard deviation, N/rad, independent between conditions; None where the source states none.
    lateral_stiffness_sd : ndarray, shape (N,)
        One standard deviation, N/m.
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

    def __post_init__(self) -> None:
        if self.surface not in SURFACES:
            raise InputError(f"{self.label}: surface is '{self.surface}'; allowed are {listed(SURFACES)}.")
        for dimension in self.lateral_stiffness_shared_over:
            if dimension not in SHAREABLE:
                raise InputError(
                    f"{self.label}: lateral_stiffness_shared_over has '{dimension}'; allowed are {listed(SHAREABLE)}."
                )
        names = ["load", "pressure", "cornering_stiffness", "lateral_stiffness", "lateral_stiffness_sd"]
        names += ["cornering_stiffness_sd"] * (self.cornering_stiffness_sd is not None)
        for name in names:
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
            if array.ndim != 1 or array.size == 0 or array.shape != self.load.shape:
                raise InputError(
                    f"{self.label}: {name} has shape {array.shape}; every column needs the shape of load, "
                    f"{self.load.shape}, with at least one condition."
                )
            allowed = array >= 0 if name.endswith("_sd") else array > 0
            for row in np.flatnonzero(~(np.isfinite(array) & allowed)):
                limit = ">= 0" if name.endswith("_sd") else "> 0"
                raise InputError(
                    f"{self.label}: {name} of condition {row + 1} is {array[row]:g}; it must be finite and {limit}."
                )
        seen: set[tuple[float, float]] = set()
        for condition in zip(self.load.tolist(), self.pressure.tolist(), strict=True):
            if condition in seen:
                raise InputError(
                    f"{self.label}: {condition[0]:g} N at {condition[1] / PASCAL_PER_BAR:g} bar appears twice; "
                    "combine repeats into one condition."
                )
            seen.add(condition)

    @property
    def label(self) -> str:
        """``tyre on surface``, for messages."""
        return f"{self.tyre} on {self.surface}"

    @property
    def relaxation_length(self) -> Array:
        """Cornering over lateral stiffness, m, shape (N,)."""
        return np.asarray(self.cornering_stiffness / self.lateral_stiffness)

    def sharing_key(self, row: int) -> tuple[float | str, ...]:
        """What conditions with a common lateral-stiffness error have in common; unique where nothing is shared."""
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
