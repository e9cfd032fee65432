"""Smooth trends over load and pressure with their covariance, and interpolation of what they leave."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from tyre import magic_formula as mf61
from tyre.arrays import Array
from tyre.errors import InputError
from tyre.properties import Estimate, JointCovariance, JointLengths, effective_degrees_of_freedom
from tyre.tables import MeasuredColumn, MeasuredTable


def grid_weights(
    grid_load: Array, grid_pressure: Array, load: Array, pressure: Array, *, other: tuple[Array, Array] | None = None
) -> Array:
    """Weight of every measured condition (N,) at the asked ones (n,), shape (n, N); bilinear inside the grid.

    They are the correlations of the field that a trend leaves. With ``other`` conditions, those between the asked and
    the other ones.
    """
    weights = np.ones(())
    other_load, other_pressure = other or (grid_load, grid_pressure)
    for grid, one, two in ((grid_load, load, other_load), (grid_pressure, pressure, other_pressure)):
        lines = np.unique(grid)
        distance = np.abs(_line_number(lines, one)[:, None] - _line_number(lines, two)[None, :])
        weights = weights * np.maximum(0.0, 1.0 - distance)
    return weights


def _line_number(lines: Array, value: Array) -> Array:
    """Position in units of measured lines, continued beyond the outer ones with the outer interval."""
    if lines.size == 1:
        return np.asarray(value / lines[0] - 1.0)
    number = np.interp(value, lines, np.arange(lines.size))
    below = np.minimum(value - lines[0], 0.0) / (lines[1] - lines[0])
    above = np.maximum(value - lines[-1], 0.0) / (lines[-1] - lines[-2])
    return np.asarray(number + below + above)


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

    form: str  # the model in words
    parameters: dict[str, float]  # fitted and nominal values by their Magic Formula names
    # value and its derivative with respect to the fitted parameters
    evaluate: Callable[[Array, Array], tuple[Array, Array]] = field(repr=False)
    load: Array = field(repr=False)  # (N,), N
    pressure: Array = field(repr=False)  # (N,), Pa
    residuals: Array = field(repr=False)  # (N,), measured minus model
    degrees_of_freedom: int  # measured conditions minus fitted parameters
    r_squared: float
    parameter_shape: Array = field(repr=False)  # (p, p), (J' J)^-1: covariance of the parameters over misfit^2
    sensitivity: Array = field(repr=False)  # (p, N), (J' J)^-1 J': how the parameters follow the measured values

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
        left = gradient - weights @ self.evaluate(*grid)[1]
        error = grid_weights(*grid, load, pressure, other=(load, pressure)) - weights @ weights.T
        error += left @ self.parameter_shape @ left.T
        carry = weights + left @ self.sensitivity
        return Prediction(smooth + weights @ self.residuals, carry, self.misfit**2 * error, self.degrees_of_freedom)


def fit_law(law: mf61.Law, load: Array, pressure: Array, value: Array) -> Trend:
    """Fit a law of MF6.1 to measured stiffness (:func:`tyre.magic_formula.fit`)."""
    fit = mf61.fit(law, load, pressure, value)
    known = fit.coefficients | fit.nominal

    def evaluate(at_load: Array, at_pressure: Array) -> tuple[Array, Array]:
        slopes = law.gradient(at_load, at_pressure, **known)[:, fit.free]
        return law.value(at_load, at_pressure, **known), slopes

    parameters = {law.names[n]: fit.coefficients[law.names[n]] for n in fit.free} | fit.nominal
    return _trend(law.form, parameters, evaluate, load, pressure, value)


def _trend(
    form: str, parameters: dict[str, float], evaluate: Callable[[Array, Array], tuple[Array, Array]],
    load: Array, pressure: Array, value: Array,
) -> Trend:  # fmt: skip
    """Add residuals and the linear algebra of the fit."""
    fitted, slopes = evaluate(load, pressure)
    residuals = value - fitted
    # a coefficient at its bound leaves the gradient short of rank
    sensitivity: Array = np.asarray(np.linalg.pinv(slopes), dtype=np.float64)
    total = float(((value - value.mean()) ** 2).sum())
    return Trend(
        form=form, parameters=parameters, evaluate=evaluate, load=load, pressure=pressure, residuals=residuals,
        degrees_of_freedom=len(value) - int(np.linalg.matrix_rank(slopes)),
        r_squared=1 - float(residuals @ residuals) / total if total > 0 else float("nan"),
        parameter_shape=sensitivity @ sensitivity.T, sensitivity=sensitivity,
    )  # fmt: skip


def predicted_column(table: MeasuredTable, column: MeasuredColumn, load: Array, pressure: Array) -> JointLengths:
    """Predict a length of a table; unknown at another load or pressure than the only one measured."""
    here = column.known
    if not here.any():
        return JointLengths((None,) * load.size, np.full((load.size, load.size), np.nan), ())
    trend = _linear_trend(table.load[here], table.pressure[here], column.value[here])
    prediction = trend.at(load, pressure)
    covariance = prediction.carry @ np.diag(column.sd[here] ** 2) @ prediction.carry.T + prediction.error
    spread = [
        np.outer(carry, carry) * sd**2 / np.sqrt(dof)
        for carry, sd, dof in zip(prediction.carry.T, column.sd[here], column.dof[here], strict=True)
        if np.isfinite(dof)
    ]
    if prediction.error_dof > 0:
        spread.append(prediction.error / np.sqrt(prediction.error_dof))
    told = np.ones(load.size, dtype=bool)
    for asked, measured in ((load, trend.load), (pressure, trend.pressure)):
        if np.ptp(measured) == 0.0:
            told &= np.isclose(asked, measured[0], rtol=1e-9)
    sd = np.sqrt(np.diag(covariance))
    dof = [effective_degrees_of_freedom(gradient, covariance, spread) for gradient in np.eye(load.size)]
    estimates = tuple(
        Estimate(float(prediction.value[row]), float(sd[row]), dof[row]) if told[row] else None
        for row in range(load.size)
    )
    covariance[~told, :] = covariance[:, ~told] = np.nan
    return JointLengths(estimates, covariance, tuple(spread))


def _linear_trend(load: Array, pressure: Array, value: Array) -> Trend:
    """A plane over load and pressure, of as many terms as the conditions can tell apart."""
    at_load, at_pressure = float(load.mean()), float(pressure.mean())
    several_loads = bool(np.ptp(load) > 0) and (len(value) > 2 or not np.ptp(pressure) > 0)
    several_pressures = bool(np.ptp(pressure) > 0)

    def design(n: Array, p: Array) -> Array:
        columns = [np.ones_like(n)] + [n / at_load - 1] * several_loads + [p / at_pressure - 1] * several_pressures
        return np.column_stack(columns)

    solution = np.asarray(np.linalg.pinv(design(load, pressure)), dtype=np.float64) @ value

    def evaluate(n: Array, p: Array) -> tuple[Array, Array]:
        return design(n, p) @ solution, design(n, p)

    names = ["mean"] + ["load"] * several_loads + ["pressure"] * several_pressures
    parameters = dict(zip(names, solution.tolist(), strict=True))
    return _trend("linear in load and pressure", parameters, evaluate, load, pressure, value)


class StiffnessCovariance(NamedTuple):
    """Blocks of the covariance of the measured stiffnesses C and K, SI units, shape (N, N) each."""

    cornering: Array
    cornering_lateral: Array
    lateral: Array
    own_cornering: Array
    own_lateral: Array


# share of the variance of an assumed standard deviation that all conditions of a table have in common: a gain of the
# rig moves all of them, while the tables of Dell'Orto et al. scatter by 1.2 to 2.2 % about a smooth law
ASSUMED_IN_COMMON = 0.8


def stiffness_covariance(table: MeasuredTable, *, assumed: float = 0.0, rounding: float = 1e-9) -> StiffnessCovariance:
    """Covariance of the stiffnesses of a table; ``rounding`` is that of a file's digits, relative.

    ``assumed`` is the relative standard deviation of a stiffness for which the table states none.
    """
    c, k = table.cornering_stiffness, table.lateral_stiffness
    keys = [table.sharing_key(row) for row in range(k.size)]
    same = np.array([[one == other for other in keys] for one in keys], dtype=np.float64)
    free, gain = (np.sqrt(share) * assumed for share in (1 - ASSUMED_IN_COMMON, ASSUMED_IN_COMMON))
    c_sd = free * c if table.cornering_stiffness_sd is None else table.cornering_stiffness_sd
    k_sd = free * k if table.lateral_stiffness_sd is None else table.lateral_stiffness_sd
    common_c = gain**2 * np.outer(c, c) * (table.cornering_stiffness_sd is None)
    common_k = gain**2 * np.outer(k, k) * (table.lateral_stiffness_sd is None)
    if table.calibration is None and table.stiffness_correlation is None:
        own_c, own_k = np.diag(c_sd**2), np.asarray(np.outer(k_sd, k_sd) * same)
        return StiffnessCovariance(own_c + common_c, np.zeros((k.size, k.size)), own_k + common_k, own_c, own_k)
    common = np.zeros((2, 2)) if table.calibration is None else table.calibration.relative_covariance
    c_left = _left_over(table, "cornering stiffness", c_sd / c, float(common[0, 0]), rounding)
    k_left = _left_over(table, "lateral stiffness", k_sd / k, float(common[1, 1]), rounding)
    own = np.zeros_like(c)
    if table.stiffness_correlation is not None:
        own = table.stiffness_correlation * (c_sd / c) * (k_sd / k) - common[0, 1]
        for row in np.flatnonzero(np.abs(own) > np.sqrt(c_left * k_left) + rounding * (c_sd / c) * (k_sd / k)):
            raise InputError(
                f"{table.condition(int(row))}: a correlation of {table.stiffness_correlation[row]:.3g} between "
                "cornering and lateral stiffness cannot be, with these standard deviations and the common calibration; "
                "correct stiffness_correlation or leave it out"
            )
    own_c = np.diag(c_left) * np.outer(c, c)
    own_k = np.sqrt(np.outer(k_left, k_left)) * same * np.outer(k, k)
    found = StiffnessCovariance(
        own_c + common[0, 0] * np.outer(c, c), (np.diag(own) + common[0, 1]) * np.outer(c, k),
        own_k + common[1, 1] * np.outer(k, k), own_c, own_k,
    )  # fmt: skip
    relative = np.block([[found.cornering, found.cornering_lateral], [found.cornering_lateral.T, found.lateral]])
    relative /= np.outer(np.append(c, k), np.append(c, k))
    if np.linalg.eigvalsh(relative)[0] < -rounding * np.abs(relative).max():
        raise InputError(
            f"{table.label}: a lateral stiffness that conditions share (lateral_stiffness_shared_over) cannot have "
            "these correlations with their cornering stiffnesses; leave stiffness_correlation out"
        )
    return found


def _left_over(table: MeasuredTable, name: str, relative_sd: Array, common: float, rounding: float) -> Array:
    """Relative variance of each condition alone."""
    left = relative_sd**2 - common
    for row in np.flatnonzero(left < -rounding * common):
        raise InputError(
            f"{table.condition(int(row))}: the standard deviation of the {name} is "
            f"{100 * relative_sd[row]:.3g} %, less than the {100 * np.sqrt(common):.3g} % of the calibration that is "
            "common to all conditions; standard deviations hold the calibration, so add it or lower [calibration]"
        )
    return np.maximum(left, 0.0)


def joint_covariance(
    cornering: Prediction,
    lateral: Prediction,
    measured: StiffnessCovariance,
    dof: tuple[Array, Array] | None,
) -> JointCovariance:
    """Covariance of both stiffnesses and their ratio at n conditions.

    The relaxation length enters to first order, d(C/K) = (C/K) (dC/C - dK/K). Repeatability is pooled over a campaign,
    so the scatters of its conditions are known equally badly: their degrees of freedom do not add up.
    """
    n = cornering.value.size
    length = cornering.value / lateral.value
    to_properties = np.zeros((3 * n, 2 * n))  # from (C of all, K of all) to (C, K, length) of each
    to_properties[0::3, :n] = np.eye(n)
    to_properties[1::3, n:] = np.eye(n)
    to_properties[2::3, :n] = np.diag(length / cornering.value)
    to_properties[2::3, n:] = np.diag(-length / lateral.value)
    stiffness = np.zeros((2 * n, 2 * n))
    stiffness[:n, :n] = cornering.carry @ measured.cornering @ cornering.carry.T + cornering.error
    stiffness[n:, n:] = lateral.carry @ measured.lateral @ lateral.carry.T + lateral.error
    stiffness[:n, n:] = cornering.carry @ measured.cornering_lateral @ lateral.carry.T
    stiffness[n:, :n] = stiffness[:n, n:].T
    covariance = to_properties @ stiffness @ to_properties.T
    covariance = (covariance + covariance.T) / 2
    if dof is None:
        return JointCovariance(covariance, None)
    spread = []
    for half, prediction, total, own, freedom in (
        (to_properties[:, :n], cornering, measured.cornering, measured.own_cornering, dof[0]),
        (to_properties[:, n:], lateral, measured.lateral, measured.own_lateral, dof[1]),
    ):
        # a stated number of degrees of freedom is that of the whole standard deviation: own^4/dof_own = sd^4/dof
        known = np.diag(own) > 0
        ratio = np.divide(np.diag(total), np.diag(own), out=np.zeros(own.shape[0]), where=known)
        root = np.sqrt(ratio) / freedom**0.25
        scatter = prediction.carry @ (own * np.outer(root, root)) @ prediction.carry.T
        spread += [half @ scatter @ half.T]
        if prediction.error_dof > 0:
            spread += [half @ prediction.error @ half.T / np.sqrt(prediction.error_dof)]
    return JointCovariance(covariance, tuple(spread))
