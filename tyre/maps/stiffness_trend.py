"""Smooth models of cornering and lateral stiffness over load and pressure, fitted to measured conditions.

They are trends: the map passes through the measured values and uses a trend only for the way between and beyond them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from tyre.base.arrays import Array


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


def kya(
    load: Array,
    pressure: Array,
    *,
    PKY1: float,
    PKY2: float,
    PPY1: float = 0.0,
    PPY2: float = 0.0,
    FNOMIN: float,
    NOMPRES: float,
) -> tuple[Array, Array]:
    """Return the cornering stiffness of MF6.1 without camber and its gradient.

    Kya = PKY1 FNOMIN (1 + PPY1 dpi) sin{2 atan[Fz / (PKY2 (1 + PPY2 dpi) FNOMIN)]}, dpi = (p - NOMPRES) / NOMPRES
    (Besselink, Schmeitz & Pacejka 2010, doi 10.1080/00423111003748088). Here Kya > 0: the side force grows with slip.

    Parameters
    ----------
    load, pressure : ndarray, shape (n,)
        Vertical load, N, and inflation pressure, Pa.
    PKY1, PKY2, PPY1, PPY2 : float
        Peak value over load (1/rad), load of the peak over FNOMIN, and their relative change with pressure.
    FNOMIN, NOMPRES : float
        Nominal load, N, and pressure, Pa.

    Returns
    -------
    value : ndarray, shape (n,)
        N/rad.
    gradient : ndarray, shape (n, 4)
        With respect to PKY1, PKY2, PPY1, PPY2.
    """
    dpi = (pressure - NOMPRES) / NOMPRES
    peak = FNOMIN * (1 + PPY1 * dpi)
    x = load / (PKY2 * (1 + PPY2 * dpi) * FNOMIN)
    shape = 2 * x / (1 + x**2)  # sin(2 atan x)
    slope = 2 * (1 - x**2) / (1 + x**2) ** 2
    gradient = np.column_stack(
        [
            peak * shape,
            -PKY1 * peak * slope * x / PKY2,
            PKY1 * FNOMIN * dpi * shape,
            -PKY1 * peak * slope * x * dpi / (1 + PPY2 * dpi),
        ]
    )
    return PKY1 * peak * shape, gradient


def fit_cornering_stiffness(load: Array, pressure: Array, value: Array) -> Trend:
    """Fit the MF6.1 form to measured cornering stiffness by least squares.

    Coefficients the conditions cannot determine are left out: PKY2 with one load, PPY1 and PPY2 with one pressure, and
    PPY2 with fewer than four conditions.

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/rad at the measured conditions.
    """
    return _fitted(*(np.ascontiguousarray(column, float).tobytes() for column in (load, pressure, value)))


@lru_cache(maxsize=256)  # a study reads the same few tables a thousand times
def _fitted(*columns: bytes) -> Trend:
    load, pressure, value = (np.frombuffer(column) for column in columns)
    from scipy.optimize import least_squares  # costs more than the rest of `import tyre`

    nominal = {"FNOMIN": float(np.median(np.unique(load))), "NOMPRES": float(np.median(np.unique(pressure)))}
    names = ("PKY1", "PKY2", "PPY1", "PPY2")
    start = np.array([value.max() / nominal["FNOMIN"], 1.5 * load.max() / nominal["FNOMIN"], 0.0, 0.0])
    several_loads, several_pressures = np.ptp(load) > 0, np.ptp(pressure) > 0
    free = np.array(
        [True, several_loads, several_pressures, several_loads and several_pressures and len(value) >= 4], dtype=bool
    )
    # 1 + PPY dpi stays positive over the measured pressures; PKY2 far above the loads is a straight line already
    widest = max(float(np.max(np.abs(pressure / nominal["NOMPRES"] - 1))), 1e-9)
    lower = np.array([0.0, 0.05 * load.max() / nominal["FNOMIN"], -0.95 / widest, -0.95 / widest])
    upper = np.array([np.inf, 50 * load.max() / nominal["FNOMIN"], np.inf, np.inf])

    def whole(fitted: Array) -> dict[str, float]:
        values = start.copy()
        values[free] = fitted
        return dict(zip(names, values.tolist(), strict=True))

    def misfit(fitted: Array) -> Array:
        return kya(load, pressure, **whole(fitted), **nominal)[0] - value

    def jacobian(fitted: Array) -> Array:
        return kya(load, pressure, **whole(fitted), **nominal)[1][:, free]

    solution = least_squares(
        misfit,
        start[free],
        jac=jacobian,
        bounds=(lower[free], upper[free]),
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=2000,
    )
    coefficients = whole(solution.x)

    def evaluate(at_load: Array, at_pressure: Array) -> tuple[Array, Array]:
        result, gradient = kya(at_load, at_pressure, **coefficients, **nominal)
        return result, gradient[:, free]

    used = {name: coefficients[name] for name, kept in zip(names, free, strict=True) if kept}
    form = "MF6.1 cornering stiffness, saturating in load, with pressure terms"
    return _trend(form, used | nominal, evaluate, load, pressure, value)


def fit_lateral_stiffness(load: Array, pressure: Array, value: Array) -> Trend:
    """Fit K = Cy0 (1 + PCFY1 dfz + PCFY3 dpi) by linear least squares, the linear terms of MF6.1's lateral stiffness.

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/m at the measured conditions.
    """
    nominal_load, nominal_pressure = float(np.median(np.unique(load))), float(np.median(np.unique(pressure)))
    several_loads, several_pressures = bool(np.ptp(load) > 0), bool(np.ptp(pressure) > 0)
    if len(value) < 3 and several_loads and several_pressures:
        several_loads = False

    def design(at_load: Array, at_pressure: Array) -> Array:
        columns = [np.ones_like(at_load)]
        if several_loads:
            columns.append(at_load / nominal_load - 1)
        if several_pressures:
            columns.append(at_pressure / nominal_pressure - 1)
        return np.column_stack(columns)

    solution = np.linalg.lstsq(design(load, pressure), value, rcond=None)[0]
    names = ["LATERAL_STIFFNESS"] + ["PCFY1"] * several_loads + ["PCFY3"] * several_pressures
    parameters = dict(zip(names, [solution[0], *(solution[1:] / solution[0])], strict=True))
    parameters |= {"FNOMIN": nominal_load, "NOMPRES": nominal_pressure}

    def evaluate(at_load: Array, at_pressure: Array) -> tuple[Array, Array]:
        rows = design(at_load, at_pressure)
        return rows @ solution, rows

    form = "lateral stiffness linear in load and pressure"
    return _trend(form, {key: float(item) for key, item in parameters.items()}, evaluate, load, pressure, value)


def _trend(
    form: str,
    parameters: dict[str, float],
    evaluate: Callable[[Array, Array], tuple[Array, Array]],
    load: Array,
    pressure: Array,
    value: Array,
) -> Trend:
    """Add residuals and the linear algebra of the fit."""
    fitted, gradient = evaluate(load, pressure)
    residuals = value - fitted
    # a coefficient at its bound leaves the gradient short of rank
    sensitivity: Array = np.asarray(np.linalg.pinv(gradient), dtype=np.float64)
    total = float(((value - value.mean()) ** 2).sum())
    return Trend(
        form=form,
        parameters=parameters,
        evaluate=evaluate,
        residuals=residuals,
        degrees_of_freedom=len(value) - int(np.linalg.matrix_rank(gradient)),
        r_squared=1 - float(residuals @ residuals) / total if total > 0 else float("nan"),
        parameter_shape=sensitivity @ sensitivity.T,
        sensitivity=sensitivity,
    )
