"""A length measured beside the stiffnesses (pneumatic trail, say) at any load and pressure: linear in both."""

from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array
from tyre.estimate import Estimate
from tyre.joint_properties import JointLengths, effective_degrees_of_freedom
from tyre.maps.measured_column import MeasuredColumn
from tyre.maps.prediction import MeasuredQuantity
from tyre.maps.stiffness_trend import Trend


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

    def at(self, load: Array, pressure: Array) -> JointLengths:
        """The length at several conditions; unknown at another load or pressure than the only one measured.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.
        """
        prediction = self.quantity.at(load, pressure)
        covariance = prediction.carry @ np.diag(self.sd**2) @ prediction.carry.T + prediction.error
        spread = [
            np.outer(column, column) * sd**2 / np.sqrt(dof)
            for column, sd, dof in zip(prediction.carry.T, self.sd, self.dof, strict=True)
            if np.isfinite(dof)
        ]
        if prediction.error_dof > 0:
            spread.append(prediction.error / np.sqrt(prediction.error_dof))
        told = self._told(load, pressure)
        estimates = tuple(
            Estimate(
                float(prediction.value[row]), float(np.sqrt(covariance[row, row])),
                effective_degrees_of_freedom(gradient, covariance, spread),
            ) if told[row] else None
            for row, gradient in enumerate(np.eye(load.size))
        )  # fmt: skip
        covariance[~told, :] = covariance[:, ~told] = np.nan
        return JointLengths(estimates, covariance, tuple(spread))

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
    trend = _linear_trend(load[here], pressure[here], column.value[here])
    return ColumnPrediction(MeasuredQuantity(load[here], pressure[here], trend), column.sd[here], column.dof[here])


def _linear_trend(load: Array, pressure: Array, value: Array) -> Trend:
    """A plane over load and pressure, of as many terms as the conditions can tell apart."""
    at_load, at_pressure = float(load.mean()), float(pressure.mean())
    several_loads = bool(np.ptp(load) > 0) and (len(value) > 2 or not np.ptp(pressure) > 0)
    several_pressures = bool(np.ptp(pressure) > 0)

    def design(n: Array, p: Array) -> Array:
        columns = [np.ones_like(n)] + [n / at_load - 1] * several_loads + [p / at_pressure - 1] * several_pressures
        return np.column_stack(columns)

    rows = design(load, pressure)
    sensitivity = np.asarray(np.linalg.pinv(rows), dtype=np.float64)
    solution = sensitivity @ value
    residuals = value - rows @ solution
    total = float(((value - value.mean()) ** 2).sum())

    def evaluate(n: Array, p: Array) -> tuple[Array, Array]:
        return design(n, p) @ solution, design(n, p)

    return Trend(
        form="linear in load and pressure",
        parameters=dict(zip(["mean"] + ["load"] * several_loads + ["pressure"] * several_pressures,
                            solution.tolist(), strict=True)),
        evaluate=evaluate,
        residuals=residuals,
        degrees_of_freedom=len(value) - int(np.linalg.matrix_rank(rows)),
        r_squared=1 - float(residuals @ residuals) / total if total > 0 else float("nan"),
        parameter_shape=sensitivity @ sensitivity.T,
        sensitivity=sensitivity,
    )  # fmt: skip
