"""Smooth models of cornering and lateral stiffness over load and pressure, fitted to measured conditions.

They are trends: the map passes through the measured values and uses a trend only for the way between and beyond them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tyre.base.arrays import Array
from tyre.magic_formula import mf61


@dataclass(frozen=True, eq=False)
class Trend:
    """A fitted smooth model of one stiffness and how well it fits the measured conditions.

    Attributes
    ----------
    form : str
        The model in words.
    parameters : dict of str to float
        Fitted and nominal values by their Magic Formula names.
    evaluate : callable (load N, pressure Pa) -> (value (n,), gradient (n, p))
        Stiffness in SI units and its derivative with respect to the fitted parameters.
    residuals : ndarray, shape (N,)
        Measured minus model at the measured conditions, SI units.
    degrees_of_freedom : int
        Measured conditions minus fitted parameters.
    parameter_shape : ndarray, shape (p, p)
        (J' J)^-1; times misfit^2 it is the covariance of the parameters.
    sensitivity : ndarray, shape (p, N)
        (J' J)^-1 J': how the parameters follow the measured values.
    """

    form: str
    parameters: dict[str, float]
    evaluate: Callable[[Array, Array], tuple[Array, Array]] = field(repr=False)
    residuals: Array = field(repr=False)
    degrees_of_freedom: int
    r_squared: float
    parameter_shape: Array = field(repr=False)
    sensitivity: Array = field(repr=False)

    @property
    def misfit(self) -> float:
        """Standard deviation of the residuals, sqrt(SS / degrees of freedom), SI units; 0 where none are left."""
        if self.degrees_of_freedom < 1:
            return 0.0
        return float(np.sqrt(self.residuals @ self.residuals / self.degrees_of_freedom))


def fit_cornering_stiffness(load: Array, pressure: Array, value: Array) -> Trend:
    """Fit the MF6.1 law to measured cornering stiffness (:func:`tyre.magic_formula.mf61.fit_cornering_stiffness`).

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/rad at the measured conditions.
    """
    form = "MF6.1 cornering stiffness, saturating in load, with pressure terms"
    fit = mf61.fit_cornering_stiffness(load, pressure, value)
    return _trend(form, fit, mf61.CORNERING, mf61.cornering_stiffness, mf61.cornering_stiffness_gradient,
                  load, pressure, value)  # fmt: skip


def fit_lateral_stiffness(load: Array, pressure: Array, value: Array) -> Trend:
    """Fit the MF6.1 law to measured lateral stiffness (:func:`tyre.magic_formula.mf61.fit_lateral_stiffness`).

    It is bilinear in load and pressure, so the map stays bilinear in the measured values inside their grid.

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/m at the measured conditions.
    """
    form = "MF6.1 lateral stiffness, linear in load and in pressure"
    fit = mf61.fit_lateral_stiffness(load, pressure, value)
    return _trend(form, fit, mf61.LATERAL, mf61.lateral_stiffness, mf61.lateral_stiffness_gradient,
                  load, pressure, value)  # fmt: skip


def _trend(
    form: str,
    fit: mf61.Fit,
    names: tuple[str, ...],
    law: Callable[..., Array],
    gradient: Callable[..., Array],
    load: Array,
    pressure: Array,
    value: Array,
) -> Trend:
    """Add residuals and the linear algebra of the fit."""
    columns = [names.index(name) for name in fit.free]

    def evaluate(at_load: Array, at_pressure: Array) -> tuple[Array, Array]:
        known = fit.coefficients | fit.nominal
        return law(at_load, at_pressure, **known), gradient(at_load, at_pressure, **known)[:, columns]

    fitted, slopes = evaluate(load, pressure)
    residuals = value - fitted
    # a coefficient at its bound leaves the gradient short of rank
    sensitivity: Array = np.asarray(np.linalg.pinv(slopes), dtype=np.float64)
    total = float(((value - value.mean()) ** 2).sum())
    return Trend(
        form=form,
        parameters={name: fit.coefficients[name] for name in fit.free} | fit.nominal,
        evaluate=evaluate,
        residuals=residuals,
        degrees_of_freedom=len(value) - int(np.linalg.matrix_rank(slopes)),
        r_squared=1 - float(residuals @ residuals) / total if total > 0 else float("nan"),
        parameter_shape=sensitivity @ sensitivity.T,
        sensitivity=sensitivity,
    )
