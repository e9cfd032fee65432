"""The evaluation of a measured table at any load and pressure: values, origin, covariance, notes."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tyre.base.arrays import Array
from tyre.joint_properties import JointProperties
from tyre.maps.column_prediction import ColumnPrediction, predicted_column
from tyre.maps.joint import joint_covariance
from tyre.maps.map_limits import check_condition, check_physical
from tyre.maps.map_notes import condition_notes
from tyre.maps.prediction import MeasuredQuantity
from tyre.maps.stiffness_covariance import StiffnessCovariance, stiffness_covariance
from tyre.maps.stiffness_trend import Trend, fit_cornering_stiffness, fit_lateral_stiffness
from tyre.maps.tables import MeasuredTable
from tyre.properties import Origin, TyreProperties


@dataclass(frozen=True, eq=False)
class TableEvaluation:
    """What a table tells of conditions between and beyond the measured ones.

    Attributes
    ----------
    table : MeasuredTable
    relative_cornering_stiffness_sd : float
        Assumed where the table states none.
    """

    table: MeasuredTable
    relative_cornering_stiffness_sd: float

    @cached_property
    def cornering(self) -> Trend:
        """The MF6.1 form fitted to the measured C_Fy, N/rad."""
        return fit_cornering_stiffness(self.table.load, self.table.pressure, self.table.cornering_stiffness)

    @cached_property
    def lateral(self) -> Trend:
        """The linear trend of the measured K_y, N/m."""
        return fit_lateral_stiffness(self.table.load, self.table.pressure, self.table.lateral_stiffness)

    @property
    def cornering_stiffness_sd(self) -> Array:
        """Stated or assumed standard deviation of C_Fy at the measured conditions, N/rad, shape (N,)."""
        if self.table.cornering_stiffness_sd is not None:
            return self.table.cornering_stiffness_sd
        return self.relative_cornering_stiffness_sd * self.table.cornering_stiffness

    @cached_property
    def covariance(self) -> StiffnessCovariance:
        """Of the stiffnesses at the measured conditions."""
        return stiffness_covariance(self.table, self.cornering_stiffness_sd)

    def jointly(self, load: Array, pressure: Array) -> JointProperties:
        """Properties at several conditions with their covariance and degrees of freedom.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.

        Raises
        ------
        InputError
            A condition of which the table says nothing, or an extrapolation to a stiffness <= 0.
        """
        table = self.table
        for one_load, one_pressure in zip(load, pressure, strict=True):
            check_condition(table, self.cornering, load=float(one_load), pressure=float(one_pressure))
        cornering = MeasuredQuantity(table.load, table.pressure, self.cornering).at(load, pressure)
        lateral = MeasuredQuantity(table.load, table.pressure, self.lateral).at(load, pressure)
        check_physical(table, load, pressure, cornering.value, lateral.value)
        c_dof, k_dof = table.cornering_stiffness_dof, table.lateral_stiffness_dof
        dof = None if c_dof is None or k_dof is None else (c_dof, k_dof)
        joint = joint_covariance(cornering, lateral, self.covariance, dof)
        trails = None if self._trail is None else self._trail.at(load, pressure)
        routes = {name: column.at(load, pressure).estimates for name, column in self._direct.items()}
        properties = []
        for row, trail in enumerate(trails.estimates if trails else (None,) * load.size):
            origin = self.origin(load=float(load[row]), pressure=float(pressure[row]))
            covariance, freedom = joint.of(row)
            direct = {name: lengths[row] for name, lengths in routes.items()}
            properties.append(
                TyreProperties(
                    tyre=table.tyre,
                    surface=table.surface,
                    load=float(load[row]),
                    pressure=float(pressure[row]),
                    cornering_stiffness=float(cornering.value[row]),
                    lateral_stiffness=float(lateral.value[row]),
                    relaxation_length=float(cornering.value[row] / lateral.value[row]),
                    covariance=covariance,
                    origin=origin,
                    notes=self._notes(origin),
                    lateral_stiffness_origin=table.lateral_stiffness_origin,
                    synthetic=table.synthetic,
                    cornering_stiffness_sd_stated=table.cornering_stiffness_sd is not None,
                    degrees_of_freedom=freedom,
                    pneumatic_trail=None if trail is None else trail.value,
                    pneumatic_trail_sd=None if trail is None else trail.sd,
                    direct_relaxation_lengths={name: one for name, one in direct.items() if one is not None},
                )
            )
        return JointProperties(tuple(properties), joint, trails)

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Say whether a condition was measured, lies between the measured ones, or outside.

        Parameters
        ----------
        load, pressure : float
            N and Pa.
        """
        table = self.table
        if np.any(np.isclose(table.load, load, rtol=1e-9) & np.isclose(table.pressure, pressure, rtol=1e-9)):
            return "measured"
        for value, lines in ((load, table.loads), (pressure, table.pressures)):
            if value < lines[0] * (1 - 1e-9) or value > lines[-1] * (1 + 1e-9):
                return "extrapolated"
        return "interpolated"

    @cached_property
    def _trail(self) -> ColumnPrediction | None:
        return predicted_column(self.table.load, self.table.pressure, self.table.pneumatic_trail)

    @cached_property
    def _direct(self) -> dict[str, ColumnPrediction]:
        columns = {
            name: predicted_column(self.table.load, self.table.pressure, column)
            for name, column in self.table.direct_relaxation_length.items()
        }
        return {name: column for name, column in columns.items() if column is not None}

    def _notes(self, origin: Origin) -> tuple[str, ...]:
        return condition_notes(
            self.table, origin=origin, cornering=self.cornering, lateral=self.lateral,
            relative_cornering_stiffness_sd=self.relative_cornering_stiffness_sd,
        )  # fmt: skip
