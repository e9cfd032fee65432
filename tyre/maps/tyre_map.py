"""Cornering stiffness, lateral stiffness and relaxation length of a tyre over load and pressure, with covariance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.joint_properties import JointProperties
from tyre.maps import map_frames
from tyre.maps.find_table import find_table
from tyre.maps.map_notes import measured_range
from tyre.maps.stiffness_trend import Trend
from tyre.maps.table_evaluation import TableEvaluation
from tyre.maps.table_facts import TableFacts
from tyre.maps.table_io import read_table, write_table
from tyre.maps.tables import MeasuredTable, common_lateral_stiffness
from tyre.properties import Origin, TyreProperties

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class TyreMap(TableFacts):
    """A measured tyre on one surface, evaluated at any load and pressure.

    The measured conditions are returned as they stand. Between them the value is a smooth trend plus the bilinearly
    interpolated difference of the measured values from it; beyond them the difference fades out over one interval of
    the grid, and the result is marked extrapolated. The trend of C_Fy is the MF6.1 form, that of K_y is linear in load
    and pressure (so inside the grid K_y is simply bilinear in the measured values).

    The covariance has three parts: the measured standard deviations, carried by the same weights (errors of a lateral
    stiffness shared between conditions stay shared); the misfit of the trend, which measures how much a tyre departs
    from a smooth law between neighbouring conditions, times the interpolation error of `ConditionsGrid`; and the
    uncertainty of the trend itself, which matters outside. The last two vanish at measured conditions.

    Attributes
    ----------
    measured : MeasuredTable
        The measured conditions.
    relative_cornering_stiffness_sd : float
        Assumed sd(C_Fy) / C_Fy, independent between conditions, for tables that state none (the paper's do not).
        It adds to the uncertainty of the relaxation length, whose stated part is carried by K_y.

    Raises
    ------
    InputError
        The assumption is negative, not finite, or given although the table states its own.
    """

    measured: MeasuredTable
    relative_cornering_stiffness_sd: float = 0.0

    def __post_init__(self) -> None:
        assumed = self.relative_cornering_stiffness_sd
        if not (np.isfinite(assumed) and assumed >= 0):
            raise InputError(
                f"relative_cornering_stiffness_sd is {assumed:g}; it must be finite and >= 0 (0.02 means 2 % of C_Fy)."
            )
        if assumed > 0 and self.measured.cornering_stiffness_sd is not None:
            raise InputError(
                f"relative_cornering_stiffness_sd is {assumed:g}, but the table of {self.measured.label} states its "
                "own standard deviations; leave the assumption out."
            )
        _ = self._evaluation.covariance  # refuses a table that contradicts itself

    def __repr__(self) -> str:
        synthetic = ", synthetic" if self.measured.synthetic else ""
        return (
            f"<TyreMap of {self.measured.label}{synthetic}: {self.measured.load.size} conditions, "
            f"{measured_range(self.measured).removeprefix('the measured ')}\n"
            f" cornering stiffness {self._span(np.radians(self.measured.cornering_stiffness), 1)} N/deg, "
            f"lateral stiffness {self._span(self.measured.lateral_stiffness / 1e3, 1)} N/mm, relaxation length "
            f"{self._span(self.measured.relaxation_length * 1e3, 0)} mm>"
        )

    @staticmethod
    def _span(values: Array, digits: int) -> str:
        return f"{values.min():.{digits}f}-{values.max():.{digits}f}"

    @classmethod
    def load(
        cls,
        tyre: str,
        *,
        surface: str = "flat",
        relative_cornering_stiffness_sd: float = 0.0,
        folder: Traversable | None = None,
    ) -> "TyreMap":
        """Return a tyre of the packaged data, or of another folder of tyre tables.

        Parameters
        ----------
        tyre, surface : str
            Name of the tyre; ``flat`` or ``drum``.
        relative_cornering_stiffness_sd : float
            As that of the class.
        folder : path, optional
            Default: the packaged tyres.

        Raises
        ------
        InputError
            No such tyre, or not measured on this surface; the message lists what there is.
        """
        return cls(find_table(tyre, surface=surface, folder=folder), relative_cornering_stiffness_sd)

    @classmethod
    def from_file(cls, path: str | Path, *, relative_cornering_stiffness_sd: float = 0.0) -> "TyreMap":
        """Return the tyre of one table (``.csv`` with its ``.toml`` beside it, see `tyre.maps.table_io`).

        Parameters
        ----------
        path : path
            Of either file.
        relative_cornering_stiffness_sd : float
            As that of the class.
        """
        table = read_table(path)
        common_lateral_stiffness([table])
        return cls(table, relative_cornering_stiffness_sd)

    def assuming(self, relative_sd: float, /) -> "TyreMap":
        """The same tyre with sd(C_Fy) / C_Fy assumed where its table states none; where it does, as it is.

        Parameters
        ----------
        relative_sd : float
            0.03 is 3 %.
        """
        if self.measured.cornering_stiffness_sd is not None:
            return self
        return replace(self, relative_cornering_stiffness_sd=relative_sd)

    def to_file(self, path: str | Path) -> None:
        """Write the measured table and its sidecar; the assumption on C_Fy is not part of it.

        Parameters
        ----------
        path : path
            Of the .csv; the .toml comes beside it.
        """
        write_table(self.measured, path)

    @property
    def tyre(self) -> str:
        """Name of the tyre."""
        return self.measured.tyre

    @property
    def surface(self) -> str:
        """``flat`` or ``drum``."""
        return self.measured.surface

    @property
    def loads(self) -> Array:
        """Measured vertical loads, N, ascending."""
        return self.measured.loads

    @property
    def pressures(self) -> Array:
        """Measured inflation pressures, Pa, ascending."""
        return self.measured.pressures

    @property
    def table(self) -> "pd.DataFrame":
        """The measured conditions with standard deviations in the units of the field, one row each."""
        return map_frames.measured_frame(self.measured, self._evaluation.covariance)

    @property
    def cornering_stiffness_trend(self) -> Trend:
        """The MF6.1 form fitted to the measured C_Fy: parameters, residuals and misfit in N/rad."""
        return self._evaluation.cornering

    @property
    def lateral_stiffness_trend(self) -> Trend:
        """The linear trend of the measured K_y: parameters, residuals and misfit in N/m."""
        return self._evaluation.lateral

    @property
    def fit_quality(self) -> "pd.DataFrame":
        """How well the smooth trends describe the measured values, one row per stiffness.

        ``smooth`` says whether the misfit stays within the measured standard deviation (None where none is stated);
        where it does not, the table and not the trend carries the result.
        """
        return map_frames.fit_quality_frame(
            self.measured, cornering=self.cornering_stiffness_trend, lateral=self.lateral_stiffness_trend,
            cornering_stiffness_sd=self.cornering_stiffness_sd,
        )  # fmt: skip

    @property
    def residuals(self) -> "pd.DataFrame":
        """Measured minus trend at every measured condition, in the units of the field."""
        return map_frames.residual_frame(
            self.measured, cornering=self.cornering_stiffness_trend, lateral=self.lateral_stiffness_trend
        )

    def at(self, *, load: float, pressure: float) -> TyreProperties:
        """Return the properties at one condition; see `jointly`.

        Parameters
        ----------
        load, pressure : float
            Vertical load, N, and inflation pressure, Pa.
        """
        return self.joint([(load, pressure)])[0][0]

    def joint(self, conditions: Sequence[tuple[float, float]]) -> tuple[tuple[TyreProperties, ...], Array]:
        """Return the properties at several conditions and the covariance of all of them together; see `jointly`.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa, n of them.

        Returns
        -------
        properties : tuple of TyreProperties
        covariance : ndarray, shape (3 n, 3 n)
            Of (C_Fy, K_y, relaxation length) of the first condition, then of the second, and so on; SI units.
        """
        found = self.jointly(conditions)
        return found.properties, found.covariance

    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at several conditions with their covariance and degrees of freedom.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa, n of them.

        Returns
        -------
        JointProperties
            At measured conditions the covariance is the table's own; what its conditions have in common (calibration,
            shared pull tests) the asked ones have in common too.

        Raises
        ------
        InputError
            A load or pressure that is not finite and positive, one the table cannot tell anything about (another
            pressure than the only one measured, say), or an extrapolation to C_Fy <= 0 or K_y <= 0.
        """
        if not conditions:
            raise InputError(f"{self.measured.label}: no condition asked for; give at least one (load N, pressure Pa).")
        load, pressure = (np.array([float(condition[axis]) for condition in conditions]) for axis in (0, 1))
        return self._evaluation.jointly(load, pressure)

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Say whether a condition was measured, lies between the measured ones, or outside.

        Parameters
        ----------
        load, pressure : float
            N and Pa.
        """
        return self._evaluation.origin(load=load, pressure=pressure)

    @property
    def cornering_stiffness_sd(self) -> Array:
        """Stated or assumed standard deviation of C_Fy at the measured conditions, N/rad, shape (N,)."""
        return self._evaluation.cornering_stiffness_sd

    @cached_property
    def _evaluation(self) -> TableEvaluation:
        return TableEvaluation(self.measured, self.relative_cornering_stiffness_sd)
