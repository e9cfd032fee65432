"""Smooth laws of a measured quantity over load and pressure, and what is interpolated between conditions."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from tyre.ground.arrays import Array
from tyre.laws import magic_formula as mf61


def grid_weights(
    grid_load: Array, grid_pressure: Array, load: Array, pressure: Array, *, other: tuple[Array, Array] | None = None
) -> Array:
    """Weight of every measured condition (N,) at the asked ones (n,), shape (n, N); bilinear inside the grid.

    They are the correlations of the field that a trend leaves. With ``other`` conditions, those between the asked and
    the other ones.
    """
    weights = np.ones(())
    other_load, other_pressure = other or (grid_load, grid_pressure)
    for grid, points, other_points in ((grid_load, load, other_load), (grid_pressure, pressure, other_pressure)):
        lines = np.unique(grid)
        distance = np.abs(_line_number(lines, points)[:, None] - _line_number(lines, other_points)[None, :])
        weights = weights * np.maximum(0.0, 1.0 - distance)
    return weights


def _line_number(lines: Array, value: Array) -> Array:
    """Position in units of measured lines, continued beyond the outer ones with the outer interval."""
    if lines.size == 1:
        return np.asarray(value / lines[0] - 1.0)
    number = np.interp(value, lines, np.arange(lines.size))
    steps_below = np.minimum(value - lines[0], 0.0) / (lines[1] - lines[0])
    steps_above = np.maximum(value - lines[-1], 0.0) / (lines[-1] - lines[-2])
    return np.asarray(number + steps_below + steps_above)


@dataclass(frozen=True, eq=False)
class Prediction:
    """A quantity at n conditions, from N measured ones."""

    value: Array  # (n,), SI units
    carry: Array  # (n, N), how the values follow the measured ones: rows of the unit matrix at measured conditions
    error: Array  # (n, n), covariance of what the law between the measured conditions leaves open; zero at them
    error_dof: int  # degrees of freedom of the misfit behind ``error``


@dataclass(frozen=True, eq=False)
class Trend:
    """A smooth model fitted to one quantity at N measured conditions, SI units."""

    parameters: dict[str, float]  # fitted and nominal values by their Magic Formula names
    # value and its derivative with respect to the fitted parameters
    evaluate: Callable[[Array, Array], tuple[Array, Array]] = field(repr=False)
    load: Array = field(repr=False)  # (N,), N
    pressure: Array = field(repr=False)  # (N,), Pa
    measured: Array = field(repr=False)  # (N,)

    @cached_property
    def residuals(self) -> Array:
        """Measured minus model, shape (N,)."""
        return np.asarray(self.measured - self.evaluate(self.load, self.pressure)[0])

    @cached_property
    def sensitivity(self) -> Array:
        """Slopes (p, N) of the fitted parameters by the measured values, (J' J)^-1 J'."""
        # a coefficient at its bound leaves the gradient short of rank
        return np.asarray(np.linalg.pinv(self.evaluate(self.load, self.pressure)[1]), dtype=np.float64)

    @cached_property
    def degrees_of_freedom(self) -> int:
        """Measured conditions minus fitted parameters."""
        return len(self.measured) - int(np.linalg.matrix_rank(self.evaluate(self.load, self.pressure)[1]))

    @property
    def misfit(self) -> float:
        """Standard deviation of the residuals, sqrt(SS / degrees of freedom), SI units; 0 without any degrees."""
        if self.degrees_of_freedom < 1:
            return 0.0
        return float(np.sqrt(self.residuals @ self.residuals / self.degrees_of_freedom))

    def at(self, load: Array, pressure: Array) -> Prediction:
        """Predict the quantity: the model plus the interpolated residuals."""
        grid = self.load, self.pressure
        weights = grid_weights(*grid, load, pressure)
        smooth, gradient = self.evaluate(load, pressure)
        # what the interpolated differences do not take off the error of the model
        uncorrected = gradient - weights @ self.evaluate(*grid)[1]
        error = grid_weights(*grid, load, pressure, other=(load, pressure)) - weights @ weights.T
        added_weights = uncorrected @ self.sensitivity
        error += added_weights @ added_weights.T
        return Prediction(
            smooth + weights @ self.residuals, weights + added_weights, self.misfit**2 * error, self.degrees_of_freedom
        )


def fit_law(law: mf61.Law, load: Array, pressure: Array, value: Array) -> Trend:
    """Fit a law of MF6.1 to measured stiffness (:func:`tyre.laws.magic_formula.fit`)."""
    fit = mf61.fit(law, load, pressure, value)
    coefficients = fit.coefficients | fit.nominal

    def evaluate(at_load: Array, at_pressure: Array) -> tuple[Array, Array]:
        slopes = law.gradient(at_load, at_pressure, **coefficients)[:, fit.free]
        return law.value(at_load, at_pressure, **coefficients), slopes

    parameters = {law.names[n]: fit.coefficients[law.names[n]] for n in fit.free} | fit.nominal
    return Trend(parameters, evaluate, load, pressure, value)


def fit_plane(load: Array, pressure: Array, value: Array) -> Trend:
    """A plane over load and pressure, of as many terms as the conditions can determine."""
    at_load, at_pressure = float(load.mean()), float(pressure.mean())
    several_loads = bool(np.ptp(load) > 0) and (len(value) > 2 or not np.ptp(pressure) > 0)
    several_pressures = bool(np.ptp(pressure) > 0)

    def design(n: Array, p: Array) -> Array:
        columns = [np.ones_like(n)]
        if several_loads:
            columns.append(n / at_load - 1)
        if several_pressures:
            columns.append(p / at_pressure - 1)
        return np.column_stack(columns)

    solution = np.asarray(np.linalg.pinv(design(load, pressure)), dtype=np.float64) @ value

    def evaluate(n: Array, p: Array) -> tuple[Array, Array]:
        return design(n, p) @ solution, design(n, p)

    names = ["mean"]
    if several_loads:
        names.append("load")
    if several_pressures:
        names.append("pressure")
    parameters = dict(zip(names, solution.tolist(), strict=True))
    return Trend(parameters, evaluate, load, pressure, value)


# a plane replaces the product of MF6.1, which a .tir file holds, only if it leaves less than this share of its misfit
PLANE_MISFIT_SHARE = 0.5
# probability with which measurement errors alone leave more than what is reported as a departure from linear laws
DEPARTURE_PROBABILITY = 0.01


def fit_linear_law(load: Array, pressure: Array, value: Array) -> Trend:
    """Fit MF6.1's law of lateral stiffness (N/m), or a plane where this is clearly nearer to the measured values.

    MF6.1 has a product of a factor linear in load and one linear in pressure. It differs from a plane by a term in
    load times pressure, so a stiffness that is exactly a plane has residuals from the product. One degree of freedom
    does not distinguish them.
    """
    product, plane = _linear_laws(load, pressure, value)
    clearly_nearer = plane.degrees_of_freedom > 1 and plane.misfit < PLANE_MISFIT_SHARE * product.misfit
    return plane if clearly_nearer else product


def departs_from_linear_laws(load: Array, pressure: Array, value: Array, *, sd: float) -> bool:
    """True if both laws have a misfit that the measured ``sd`` of a ``value`` does not explain (chi-squared)."""
    from scipy.special import chdtri  # costs more than the rest of `import tyre`

    return all(
        law.degrees_of_freedom > 0
        and sd > 0
        and law.misfit**2 > sd**2 * chdtri(law.degrees_of_freedom, DEPARTURE_PROBABILITY) / law.degrees_of_freedom
        for law in _linear_laws(load, pressure, value)
    )


def _linear_laws(load: Array, pressure: Array, value: Array) -> tuple[Trend, Trend]:
    """The product of MF6.1 and a plane; twice the product where they are the same, without both load and pressure."""
    product, plane = fit_law(mf61.LATERAL, load, pressure, value), fit_plane(load, pressure, value)
    return product, plane if len(plane.parameters) == 3 else product
