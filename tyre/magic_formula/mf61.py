"""Cornering and lateral stiffness of MF-Tyre 6.1 over load and pressure: one evaluation of each law, and one fit.

Besselink, Schmeitz & Pacejka (2010), doi 10.1080/00423111003748088; Pacejka, Tire and Vehicle Dynamics, 3rd ed. 2012,
eqs. 4.E25 and A3.9; at zero camber, with dpi = (p - NOMPRES) / NOMPRES and dfz = (Fz - FNOMIN) / FNOMIN:

    Kya = PKY1 FNOMIN (1 + PPY1 dpi) sin{PKY4 atan[Fz / (PKY2 (1 + PPY2 dpi) FNOMIN)]}
    Cy  = LATERAL_STIFFNESS (1 + PCFY1 dfz + PCFY2 dfz^2) (1 + PCFY3 dpi)

Here Kya > 0: the side force grows with slip (a .tir file in ISO signs has PKY1 < 0). What a table of measured
conditions is fitted with is what its .tir file holds.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array

CORNERING = ("PKY1", "PKY2", "PPY1", "PPY2")
LATERAL = ("LATERAL_STIFFNESS", "PCFY1", "PCFY3")


def saturation(relative_load: ArrayLike, *, exponent: float = 2.0) -> Array:
    """Return sin(PKY4 atan x): how stiffness and relaxation length rise with the load, and fall beyond x = 1.

    Parameters
    ----------
    relative_load : array_like
        x, load over the load of the largest value (for PKY4 = 2), dimensionless.
    exponent : float
        PKY4, dimensionless.

    Returns
    -------
    ndarray
        Dimensionless, of the shape of ``relative_load``.
    """
    return np.asarray(np.sin(exponent * np.arctan(np.asarray(relative_load, dtype=np.float64))))


def cornering_stiffness(
    load: ArrayLike, pressure: ArrayLike, *, PKY1: float, PKY2: float, PPY1: float = 0.0, PPY2: float = 0.0,
    PKY4: float = 2.0, FNOMIN: float, NOMPRES: float,
) -> Array:  # fmt: skip
    """Return Kya of MF6.1 without camber.

    Parameters
    ----------
    load, pressure : array_like
        Vertical load, N, and inflation pressure, Pa, broadcast.
    PKY1, PKY2, PPY1, PPY2 : float
        Peak value over load (1/rad), load of the peak over FNOMIN, and their relative change with pressure.
    PKY4 : float
        Shape, dimensionless.
    FNOMIN, NOMPRES : float
        Nominal load, N, and pressure, Pa.

    Returns
    -------
    ndarray
        N/rad, of the broadcast shape.
    """
    dpi = (np.asarray(pressure, dtype=np.float64) - NOMPRES) / NOMPRES
    relative = np.asarray(load, dtype=np.float64) / (PKY2 * (1 + PPY2 * dpi) * FNOMIN)
    return np.asarray(PKY1 * FNOMIN * (1 + PPY1 * dpi) * saturation(relative, exponent=PKY4))


def cornering_stiffness_gradient(
    load: Array, pressure: Array, *, PKY1: float, PKY2: float, PPY1: float = 0.0, PPY2: float = 0.0,
    FNOMIN: float, NOMPRES: float,
) -> Array:  # fmt: skip
    """Return the derivatives of Kya (PKY4 = 2) with respect to PKY1, PKY2, PPY1 and PPY2.

    Parameters
    ----------
    load, pressure : ndarray, shape (n,)
        N and Pa.
    PKY1, PKY2, PPY1, PPY2, FNOMIN, NOMPRES : float
        As in `cornering_stiffness`.

    Returns
    -------
    ndarray, shape (n, 4)
        N/rad.
    """
    dpi = (pressure - NOMPRES) / NOMPRES
    peak, x = FNOMIN * (1 + PPY1 * dpi), load / (PKY2 * (1 + PPY2 * dpi) * FNOMIN)
    shape, slope = saturation(x), 2 * (1 - x**2) / (1 + x**2) ** 2
    return np.column_stack(
        [
            peak * shape,
            -PKY1 * peak * slope * x / PKY2,
            PKY1 * FNOMIN * dpi * shape,
            -PKY1 * peak * slope * x * dpi / (1 + PPY2 * dpi),
        ]
    )


def lateral_stiffness(
    load: ArrayLike, pressure: ArrayLike, *, LATERAL_STIFFNESS: float, PCFY1: float = 0.0, PCFY2: float = 0.0,
    PCFY3: float = 0.0, FNOMIN: float, NOMPRES: float,
) -> Array:  # fmt: skip
    """Return Cy of MF6.1.

    Parameters
    ----------
    load, pressure : array_like
        N and Pa, broadcast.
    LATERAL_STIFFNESS : float
        At FNOMIN and NOMPRES, N/m.
    PCFY1, PCFY2, PCFY3 : float
        Relative change with load, with its square and with pressure.
    FNOMIN, NOMPRES : float
        Nominal load, N, and pressure, Pa.

    Returns
    -------
    ndarray
        N/m, of the broadcast shape.
    """
    dfz = np.asarray(load, dtype=np.float64) / FNOMIN - 1
    dpi = np.asarray(pressure, dtype=np.float64) / NOMPRES - 1
    return np.asarray(LATERAL_STIFFNESS * (1 + PCFY1 * dfz + PCFY2 * dfz**2) * (1 + PCFY3 * dpi))


@dataclass(frozen=True)
class Fit:
    """A law fitted to measured conditions.

    Attributes
    ----------
    coefficients : dict of str to float
        Every coefficient of the law by its Magic Formula name; those that the conditions cannot determine at a value
        that does not matter there.
    nominal : dict of str to float
        FNOMIN, N, and NOMPRES, Pa: the middle ones of the measured loads and pressures.
    free : tuple of str
        Which coefficients were fitted.
    """

    coefficients: dict[str, float]
    nominal: dict[str, float]
    free: tuple[str, ...]


def fit_cornering_stiffness(load: Array, pressure: Array, value: Array) -> Fit:
    """Fit Kya to measured cornering stiffness by least squares.

    Coefficients the conditions cannot determine are left out: PKY2 with one load, PPY1 and PPY2 with one pressure, and
    PPY2 with fewer than four conditions.

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/rad at the measured conditions.

    Returns
    -------
    Fit
    """
    return _cornering(*_columns(load, pressure, value))


def fit_lateral_stiffness(load: Array, pressure: Array, value: Array) -> Fit:
    """Fit Cy, without the square of the load, to measured lateral stiffness by least squares.

    PCFY1 is left out with one load (or two conditions that differ in both), PCFY3 with one pressure. A square of the
    load would fit three loads exactly and mislead beyond them.

    Parameters
    ----------
    load, pressure, value : ndarray, shape (N,)
        N, Pa and N/m at the measured conditions.

    Returns
    -------
    Fit
    """
    return _lateral(*_columns(load, pressure, value))


def _columns(*columns: Array) -> tuple[bytes, ...]:
    return tuple(np.ascontiguousarray(column, float).tobytes() for column in columns)


@lru_cache(maxsize=256)  # a study reads the same few tables a thousand times
def _cornering(*columns: bytes) -> Fit:
    load, pressure, value = (np.frombuffer(column) for column in columns)
    nominal = _nominal(load, pressure)
    start = np.array([value.max() / nominal["FNOMIN"], 1.5 * load.max() / nominal["FNOMIN"], 0.0, 0.0])
    loads, pressures = bool(np.ptp(load) > 0), bool(np.ptp(pressure) > 0)
    free = np.array([True, loads, pressures, loads and pressures and len(value) >= 4])
    # 1 + PPY dpi stays positive over the measured pressures; PKY2 far above the loads is a straight line already
    widest = max(float(np.max(np.abs(pressure / nominal["NOMPRES"] - 1))), 1e-9)
    lower = np.array([0.0, 0.05 * load.max() / nominal["FNOMIN"], -0.95 / widest, -0.95 / widest])
    upper = np.array([np.inf, 50 * load.max() / nominal["FNOMIN"], np.inf, np.inf])
    return _fitted(
        CORNERING, start, free, nominal,
        lambda **c: cornering_stiffness(load, pressure, **c, **nominal) - value,
        lambda **c: cornering_stiffness_gradient(load, pressure, **c, **nominal),
        (lower[free], upper[free]),
    )  # fmt: skip


@lru_cache(maxsize=256)
def _lateral(*columns: bytes) -> Fit:
    load, pressure, value = (np.frombuffer(column) for column in columns)
    nominal = _nominal(load, pressure)
    loads, pressures = bool(np.ptp(load) > 0), bool(np.ptp(pressure) > 0)
    free = np.array([True, loads and (len(value) >= 3 or not pressures), pressures])
    scale = float(value.mean())
    found = _fitted(
        LATERAL, np.array([1.0, 0.0, 0.0]), free, nominal,
        lambda **c: lateral_stiffness(load, pressure, **c, **nominal) - value / scale,
        lambda **c: lateral_stiffness_gradient(load, pressure, **c, **nominal),
        (-np.inf, np.inf),
    )  # fmt: skip
    found.coefficients["LATERAL_STIFFNESS"] *= scale
    return found


def lateral_stiffness_gradient(
    load: Array, pressure: Array, *, LATERAL_STIFFNESS: float, PCFY1: float, PCFY3: float, FNOMIN: float,
    NOMPRES: float,
) -> Array:  # fmt: skip
    """Return the derivatives of Cy (PCFY2 = 0) with respect to LATERAL_STIFFNESS, PCFY1 and PCFY3.

    Parameters
    ----------
    load, pressure : ndarray, shape (n,)
        N and Pa.
    LATERAL_STIFFNESS, PCFY1, PCFY3, FNOMIN, NOMPRES : float
        As in `lateral_stiffness`.

    Returns
    -------
    ndarray, shape (n, 3)
        Dimensionless, then N/m.
    """
    dfz, dpi = load / FNOMIN - 1, pressure / NOMPRES - 1
    by_load, by_pressure = 1 + PCFY1 * dfz, 1 + PCFY3 * dpi
    return np.column_stack(
        [by_load * by_pressure, LATERAL_STIFFNESS * dfz * by_pressure, LATERAL_STIFFNESS * by_load * dpi]
    )


def _nominal(load: Array, pressure: Array) -> dict[str, float]:
    return {"FNOMIN": float(np.median(np.unique(load))), "NOMPRES": float(np.median(np.unique(pressure)))}


def _fitted(
    names: tuple[str, ...], start: Array, free: Any, nominal: dict[str, float], misfit: Callable[..., Array],
    gradient: Callable[..., Array], bounds: tuple[Any, Any],
) -> Fit:  # fmt: skip
    from scipy.optimize import least_squares  # costs more than the rest of `import tyre`

    def whole(fitted: Array) -> dict[str, float]:
        values = start.copy()
        values[free] = fitted
        return dict(zip(names, values.tolist(), strict=True))

    solution = least_squares(
        lambda x: misfit(**whole(x)), start[free], jac=lambda x: gradient(**whole(x))[:, free], bounds=bounds,
        x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14, max_nfev=2000,
    )  # fmt: skip
    return Fit(whole(solution.x), nominal, tuple(name for name, kept in zip(names, free, strict=True) if kept))
