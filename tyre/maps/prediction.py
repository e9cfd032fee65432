"""A quantity measured at some conditions, predicted at others: a smooth trend plus the interpolated differences."""

from dataclasses import dataclass

from tyre.base.arrays import Array
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.stiffness_trend import Trend


@dataclass(frozen=True, eq=False)
class Prediction:
    """A quantity at n conditions, from N measured ones.

    Attributes
    ----------
    value : ndarray, shape (n,)
        SI units.
    carry : ndarray, shape (n, N)
        How the values follow the measured ones: rows of the unit matrix at measured conditions.
    error : ndarray, shape (n, n)
        Covariance of what the law between the measured conditions leaves open; zero at measured ones.
    error_dof : int
        Degrees of freedom of the misfit behind ``error``.
    """

    value: Array
    carry: Array
    error: Array
    error_dof: int


@dataclass(frozen=True, eq=False)
class MeasuredQuantity:
    """One quantity at the measured conditions and its trend.

    Attributes
    ----------
    load, pressure : ndarray, shape (N,)
        N and Pa.
    trend : Trend
        Fitted to the quantity at these conditions.
    """

    load: Array
    pressure: Array
    trend: Trend

    def at(self, load: Array, pressure: Array) -> Prediction:
        """Predict the quantity.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.
        """
        grid = ConditionsGrid(self.load, self.pressure)
        weights = grid.weights(load, pressure)
        smooth, gradient = self.trend.evaluate(load, pressure)
        _, measured_gradient = self.trend.evaluate(self.load, self.pressure)
        # what the interpolated differences do not take off the trend's error
        left = gradient - weights @ measured_gradient
        error = grid.prediction_error(load, pressure) + left @ self.trend.parameter_shape @ left.T
        return Prediction(
            value=smooth + weights @ self.trend.residuals,
            carry=weights + left @ self.trend.sensitivity,
            error=self.trend.misfit**2 * error,
            error_dof=self.trend.degrees_of_freedom,
        )
