"""Cornering stiffness, lateral stiffness and relaxation length of a tyre over load and pressure, with covariance."""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.maps import map_frames
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.map_notes import condition_notes, measured_range
from tyre.maps.stiffness_trend import Trend, fit_cornering_stiffness, fit_lateral_stiffness
from tyre.maps.table_facts import TableFacts
from tyre.maps.table_io import read_folder, read_table, write_table
from tyre.maps.tables import MeasuredTable, common_lateral_stiffness
from tyre.properties import Origin, TyreProperties

if TYPE_CHECKING:
    import pandas as pd


def available_tyres(folder: Traversable | None = None) -> dict[str, tuple[str, ...]]:
    """Return the surfaces measured for each tyre of the packaged data, or of another folder of tyre tables."""
    surfaces: dict[str, tuple[str, ...]] = {}
    for table in read_folder(folder):
        surfaces[table.tyre] = (*surfaces.get(table.tyre, ()), table.surface)
    return {tyre: tuple(sorted(measured, reverse=True)) for tyre, measured in sorted(surfaces.items())}


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

    def __repr__(self) -> str:
        synthetic = ", synthetic" if self.measured.synthetic else ""
        return (
            f"<TyreMap of {self.measured.label}{synthetic}: {self.measured.load.size} conditions, "
            f"{measured_range(self).removeprefix('the measured ')}\n"
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

        Raises
        ------
        InputError
            No such tyre, or not measured on this surface; the message lists what there is.
        """
        tables = read_folder(folder)
        mine = [table for table in tables if table.tyre == tyre]
        if not mine:
            names = sorted({table.tyre for table in tables})
            near = difflib.get_close_matches(tyre, names, n=1)
            hint = f" (did you mean '{near[0]}'?)" if near else ""
            raise InputError(f"no tyre '{tyre}'{hint}; available are {', '.join(names) or 'none'}.")
        chosen = [table for table in mine if table.surface == surface]
        if not chosen:
            known = ", ".join(sorted((table.surface for table in mine), reverse=True))
            raise InputError(f"{tyre} was not measured on surface '{surface}', only on: {known}.")
        if len(chosen) > 1:
            raise InputError(f"{chosen[0].label} is defined by {len(chosen)} files; keep one.")
        across = [table for table in mine if "surface" in table.lateral_stiffness_shared_over]
        common_lateral_stiffness(across if chosen[0] in across else chosen)
        return cls(chosen[0], relative_cornering_stiffness_sd)

    @classmethod
    def from_file(cls, path: str | Path, *, relative_cornering_stiffness_sd: float = 0.0) -> "TyreMap":
        """Return the tyre of one table (``.csv`` with its ``.toml`` beside it, see `tyre.maps.tables`)."""
        table = read_table(path)
        common_lateral_stiffness([table])
        return cls(table, relative_cornering_stiffness_sd)

    def assuming(self, relative_sd: float, /) -> "TyreMap":
        """The same tyre with sd(C_Fy) / C_Fy assumed where its table states none; where it does, as it is."""
        if self.measured.cornering_stiffness_sd is not None:
            return self
        return replace(self, relative_cornering_stiffness_sd=relative_sd)

    def to_file(self, path: str | Path) -> None:
        """Write the measured table to ``path`` (.csv) and its sidecar; the assumption on C_Fy is not part of it."""
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
        return np.unique(self.measured.load)

    @property
    def pressures(self) -> Array:
        """Measured inflation pressures, Pa, ascending."""
        return np.unique(self.measured.pressure)

    @property
    def table(self) -> "pd.DataFrame":
        """The measured conditions with standard deviations in the units of the field, one row each."""
        return map_frames.measured_frame(self)

    @cached_property
    def cornering_stiffness_trend(self) -> Trend:
        """The MF6.1 form fitted to the measured C_Fy: parameters, residuals and misfit in N/rad."""
        return fit_cornering_stiffness(self.measured.load, self.measured.pressure, self.measured.cornering_stiffness)

    @cached_property
    def lateral_stiffness_trend(self) -> Trend:
        """The linear trend of the measured K_y: parameters, residuals and misfit in N/m."""
        return fit_lateral_stiffness(self.measured.load, self.measured.pressure, self.measured.lateral_stiffness)

    @property
    def fit_quality(self) -> "pd.DataFrame":
        """How well the smooth trends describe the measured values, one row per stiffness.

        ``smooth`` says whether the misfit stays within the measured standard deviation (None where none is stated);
        where it does not, the table and not the trend carries the result.
        """
        return map_frames.fit_quality_frame(self)

    @property
    def residuals(self) -> "pd.DataFrame":
        """Measured minus trend at every measured condition, in the units of the field."""
        return map_frames.residual_frame(self)

    def at(self, *, load: float, pressure: float) -> TyreProperties:
        """Return the properties at one vertical load (N) and inflation pressure (Pa); see `joint`."""
        return self.joint([(load, pressure)])[0][0]

    def joint(self, conditions: Sequence[tuple[float, float]]) -> tuple[tuple[TyreProperties, ...], Array]:
        """Return the properties at several conditions and the covariance of all of them together.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa, n of them.

        Returns
        -------
        properties : tuple of TyreProperties
            In the order asked for.
        covariance : ndarray, shape (3 n, 3 n)
            Of (C_Fy, K_y, relaxation length) of the first condition, then of the second, and so on; SI units. The
            relaxation length enters to first order, d(C/K) = (C/K) (dC/C - dK/K).

        Raises
        ------
        InputError
            A load or pressure that is not finite and positive, one the table cannot tell anything about (another
            pressure than the only one measured, say), or an extrapolation to C_Fy <= 0 or K_y <= 0.
        """
        if not conditions:
            raise InputError(f"{self.measured.label}: no condition asked for; give at least one (load N, pressure Pa).")
        for one_load, one_pressure in conditions:
            self._check_condition(float(one_load), float(one_pressure))
        load = np.array([float(condition[0]) for condition in conditions])
        pressure = np.array([float(condition[1]) for condition in conditions])
        cornering, cornering_carry, cornering_error = self._predict(self.cornering_stiffness_trend, load, pressure)
        lateral, lateral_carry, lateral_error = self._predict(self.lateral_stiffness_trend, load, pressure)
        for row, stiffness, name, unit in (
            *((row, value, "cornering stiffness", "N/rad") for row, value in enumerate(cornering)),
            *((row, value, "lateral stiffness", "N/m") for row, value in enumerate(lateral)),
        ):
            if not (np.isfinite(stiffness) and stiffness > 0):
                raise InputError(
                    f"{self.measured.label}: extrapolation to {load[row]:g} N, {pressure[row] / PASCAL_PER_BAR:g} bar "
                    f"gives a {name} of {stiffness:g} {unit}, which is not "
                    f"physical; stay nearer to {measured_range(self)}."
                )
        cornering_covariance = cornering_carry @ np.diag(self.cornering_stiffness_sd**2) @ cornering_carry.T
        lateral_covariance = lateral_carry @ self._lateral_stiffness_covariance @ lateral_carry.T
        length = cornering / lateral
        n = load.size
        to_properties = np.zeros((3 * n, 2 * n))  # from (C of all, K of all) to (C, K, length) of each
        to_properties[0::3, :n] = np.eye(n)
        to_properties[1::3, n:] = np.eye(n)
        to_properties[2::3, :n] = np.diag(length / cornering)
        to_properties[2::3, n:] = np.diag(-length / lateral)
        stiffness_covariance = np.zeros((2 * n, 2 * n))
        stiffness_covariance[:n, :n] = cornering_covariance + cornering_error
        stiffness_covariance[n:, n:] = lateral_covariance + lateral_error
        covariance = to_properties @ stiffness_covariance @ to_properties.T
        covariance = (covariance + covariance.T) / 2
        properties = []
        for row in range(n):
            origin = self.origin(load=load[row], pressure=pressure[row])
            properties.append(
                TyreProperties(
                    tyre=self.tyre,
                    surface=self.surface,
                    load=float(load[row]),
                    pressure=float(pressure[row]),
                    cornering_stiffness=float(cornering[row]),
                    lateral_stiffness=float(lateral[row]),
                    relaxation_length=float(length[row]),
                    covariance=covariance[3 * row : 3 * row + 3, 3 * row : 3 * row + 3].copy(),
                    origin=origin,
                    notes=condition_notes(self, origin),
                    lateral_stiffness_origin=self.measured.lateral_stiffness_origin,
                    synthetic=self.measured.synthetic,
                    cornering_stiffness_sd_stated=self.measured.cornering_stiffness_sd is not None,
                )
            )
        return tuple(properties), covariance

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Say whether a load (N) and pressure (Pa) were measured, lie between the measured ones, or outside."""
        if np.any(
            np.isclose(self.measured.load, load, rtol=1e-9) & np.isclose(self.measured.pressure, pressure, rtol=1e-9)
        ):
            return "measured"
        for value, lines in ((load, self.loads), (pressure, self.pressures)):
            if value < lines[0] * (1 - 1e-9) or value > lines[-1] * (1 + 1e-9):
                return "extrapolated"
        return "interpolated"

    def _predict(self, trend: Trend, load: Array, pressure: Array) -> tuple[Array, Array, Array]:
        """Value (n,), its weights on the measured values (n, N), and its own error covariance (n, n)."""
        grid = ConditionsGrid(self.measured.load, self.measured.pressure)
        weights = grid.weights(load, pressure)
        smooth, gradient = trend.evaluate(load, pressure)
        _, measured_gradient = trend.evaluate(self.measured.load, self.measured.pressure)
        left = (
            gradient - weights @ measured_gradient
        )  # what the interpolated differences do not take off the trend's error
        error = grid.prediction_error(load, pressure) + left @ trend.parameter_shape @ left.T
        return smooth + weights @ trend.residuals, weights + left @ trend.sensitivity, trend.misfit**2 * error

    @property
    def cornering_stiffness_sd(self) -> Array:
        """Stated or assumed standard deviation of C_Fy at the measured conditions, N/rad, shape (N,)."""
        if self.measured.cornering_stiffness_sd is not None:
            return self.measured.cornering_stiffness_sd
        return self.relative_cornering_stiffness_sd * self.measured.cornering_stiffness

    @property
    def _lateral_stiffness_covariance(self) -> Array:
        sd = self.measured.lateral_stiffness_sd
        keys = [self.measured.sharing_key(row) for row in range(sd.size)]
        shared = np.array([[one == other for other in keys] for one in keys], dtype=np.float64)
        return np.asarray(np.outer(sd, sd) * shared)

    def _check_condition(self, load: float, pressure: float) -> None:
        for name, value, unit, lines in (
            ("load", load, "N", self.loads),
            ("pressure", pressure, "Pa", self.pressures),
        ):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{self.measured.label}: {name} is {value:g} {unit}; it must be finite and > 0.")
            if lines.size == 1 and not np.isclose(value, lines[0], rtol=1e-9):
                raise InputError(
                    f"{self.measured.label}: {name} is {value:g} {unit}, but it was measured at {lines[0]:g} {unit} "
                    f"only, which says nothing about another {name}; ask for that one or measure more."
                )
        trend = self.cornering_stiffness_trend.parameters
        change = (pressure - trend["NOMPRES"]) / trend["NOMPRES"]
        for name in ("PPY1", "PPY2"):
            if 1 + trend.get(name, 0.0) * change <= 0:
                raise InputError(
                    f"{self.measured.label}: at {pressure / PASCAL_PER_BAR:g} bar the fitted 1 + {name} dpi is not "
                    f"positive, so the cornering stiffness is not physical; stay nearer to {measured_range(self)}."
                )
