"""A length measured beside the stiffnesses (pneumatic trail, say) at any load and pressure: linear in both."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.fits.estimate import Estimate
from tyre.maps.joint import effective_degrees_of_freedom
from tyre.maps.measured_column import MeasuredColumn
from tyre.maps.prediction import MeasuredQuantity
from tyre.maps.stiffness_trend import fit_lateral_stiffness


@dataclass(frozen=True, eq=False)
class ColumnPrediction:
    """The conditions at which a length was measured, and its linear trend.

    Attributes
    ----------
    quantity : MeasuredQuantity
        At these M conditions.
    sd, dof : ndarray, shape (M,)
        m, and degrees of freedom behind it.
    """

    quantity: MeasuredQuantity
    sd: Array
    dof: Array

    def at(self, load: Array, pressure: Array) -> tuple[tuple[Estimate | None, ...], Array]:
        """The length, and its covariance between the conditions.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.

        Returns
        -------
        values : tuple of Estimate or None
            m; None where the length was measured at one load or pressure only, and not at this one.
        covariance : ndarray, shape (n, n)
            m^2; NaN in their rows and columns.
        """
        prediction = self.quantity.at(load, pressure)
        covariance = prediction.carry @ np.diag(self.sd**2) @ prediction.carry.T + prediction.error
        spread = [
            np.outer(column, column) * sd**2 / np.sqrt(dof)
            for column, sd, dof in zip(prediction.carry.T, self.sd, self.dof, strict=True)
        ]
        if prediction.error_dof > 0:
            spread.append(prediction.error / np.sqrt(prediction.error_dof))
        told = self._told(load, pressure)
        covariance[~told, :] = covariance[:, ~told] = np.nan
        values: list[Estimate | None] = []
        for row, gradient in enumerate(np.eye(load.size)):
            if told[row]:
                dof = effective_degrees_of_freedom(gradient, np.nan_to_num(covariance), spread)
                values.append(Estimate(float(prediction.value[row]), float(np.sqrt(covariance[row, row])), dof))
            else:
                values.append(None)
        return tuple(values), covariance

    def _told(self, load: Array, pressure: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        told = np.ones(load.size, dtype=bool)
        for asked, measured in ((load, self.quantity.load), (pressure, self.quantity.pressure)):
            if np.ptp(measured) == 0.0:
                told &= np.isclose(asked, measured[0], rtol=1e-9)
        return told


def predicted_column(load: Array, pressure: Array, column: MeasuredColumn | None) -> ColumnPrediction | None:
    """What a column of a table tells of any condition; None where it was nowhere measured.

    Parameters
    ----------
    load, pressure : ndarray, shape (N,)
        N and Pa at the conditions of the table.
    column : MeasuredColumn or None
    """
    if column is None or not column.known.any():
        return None
    here = column.known
    trend = fit_lateral_stiffness(load[here], pressure[here], column.value[here])
    return ColumnPrediction(MeasuredQuantity(load[here], pressure[here], trend), column.sd[here], column.dof[here])
