"""The solution of a slip-sweep fit: robust least squares, parameters in SI units, their covariance."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tyre.fits.noise import correlated_covariance
from tyre.fits.sweep_model import HIGH, LOW, NAMES, SweepModel
from tyre.recordings.recording import Channel

_MARGIN = 3.0  # standard deviations, beyond which the robust loss grows linearly
_AT_BOUND = 1e-6  # of the distance between the bounds


@dataclass(frozen=True)
class SweepSolution:
    """Fitted parameters of a slip sweep.

    Attributes
    ----------
    values, sd : dict
        SI units, by the names of :data:`tyre.fits.sweep_model.NAMES`; the sd is nan where a value rests on a bound,
        0 where it is not fitted.
    covariance : ndarray, shape (9, 9)
        SI units, in the order of these names; zero where a parameter is not fitted or rests on a bound.
    dof : float
        Degrees of freedom behind the covariance.
    residuals : ndarray, shape (m,)
        Computed minus measured side force of the settled blocks, N.
    settled : bool
        False where the search stopped before it converged.
    """

    values: dict[str, float]
    sd: dict[str, float]
    covariance: NDArray[np.float64]
    dof: float
    residuals: Channel
    settled: bool

    def sd_of_sum(self, **weights: float) -> float:
        """Standard deviation of a weighted sum of parameters (SI).

        ``weights`` holds a factor for each name; the others count nothing.
        """
        row = np.array([weights.get(name, 0.0) for name in NAMES])
        return float(np.sqrt(row @ self.covariance @ row))


def solve_sweep(model: SweepModel) -> SweepSolution:
    """Fit a sweep: first by plain least squares, then with a soft L1 loss at three standard deviations of that.

    Parameters
    ----------
    model : SweepModel
    """
    sigma = 1.0

    def residual(values: Channel) -> Channel:
        return model.residuals(model.expanded(values))[0] / sigma

    def jacobian(values: Channel) -> NDArray[np.float64]:
        return model.residuals(model.expanded(values))[1][:, model.free] / sigma

    limits = (LOW[model.free], HIGH[model.free])
    first = solve_least_squares(residual, model.start[model.free], jacobian=jacobian, bounds=limits, tolerance=1e-7)
    sigma = max(1.4826 * float(np.median(np.abs(first.fun))), 1e-9 * model.force_scale)
    solution = solve_least_squares(residual, first.x, jacobian=jacobian, bounds=limits, loss="soft_l1", margin=_MARGIN)
    scaled = model.expanded(solution.x)
    covariance, resting, dof = _covariance(solution, model.free, limits)
    covariance *= np.outer(model.units, model.units)
    sd = np.sqrt(np.diag(covariance))
    sd[resting] = np.nan
    return SweepSolution(
        values=dict(zip(NAMES, (scaled * model.units).tolist(), strict=True)),
        sd=dict(zip(NAMES, sd.tolist(), strict=True)),
        covariance=covariance,
        dof=dof,
        residuals=model.residuals(scaled)[0],
        settled=solution.status != 0,
    )


def solve_least_squares(
    residual: Callable[[Channel], Channel],
    start: Channel,
    *,
    jacobian: Callable[[Channel], NDArray[np.float64]],
    bounds: tuple[Any, Any] = (-np.inf, np.inf),
    loss: Any = "linear",
    margin: float = 1.0,
    tolerance: float = 1e-14,
) -> Any:
    """Minimise a sum of squares (or of a robust loss): scipy's trust-region reflective solver, run to rounding.

    Parameters
    ----------
    residual : callable
        Parameters (p,) -> residuals (n,).
    start : ndarray, shape (p,)
    jacobian : callable
        Parameters (p,) -> derivatives of the residuals (n, p). Differences would cost the last digits.
    bounds : tuple
        Lower and upper bounds.
    loss : str
        ``linear`` or ``soft_l1``.
    margin : float
        Residual beyond which a robust loss grows linearly, in its unit.
    tolerance : float
        Relative change of cost, parameters and gradient at which to stop.

    Returns
    -------
    scipy.optimize.OptimizeResult
    """
    return least_squares(
        residual,
        start,
        jac=jacobian,
        bounds=bounds,
        loss=loss,
        f_scale=margin,
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
        max_nfev=400,
    )


def _covariance(
    solution: Any, free: NDArray[np.bool_], limits: tuple[Channel, Channel]
) -> tuple[NDArray[np.float64], NDArray[np.intp], float]:
    """Covariance (9, 9) of the scaled parameters, the numbers of those at a bound, and the degrees of freedom."""
    low, high = limits
    at_bound = (solution.x - low < _AT_BOUND * (high - low)) | (high - solution.x < _AT_BOUND * (high - low))
    inner = np.flatnonzero(~at_bound)
    weight = 1.0 / np.sqrt(1.0 + (solution.fun / _MARGIN) ** 2)  # derivative of the soft L1 loss
    small, dof = correlated_covariance(solution.jac[:, inner], weight * solution.fun)
    full = np.zeros((len(NAMES), len(NAMES)))
    fitted = np.flatnonzero(free)
    full[np.ix_(fitted[inner], fitted[inner])] = small
    return full, fitted[at_bound], dof
