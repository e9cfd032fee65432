"""The Magic Formula of the lateral force, and the coefficients of MF6.1 for small slip and camber."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array


class Curve(NamedTuple):
    """The Magic Formula of unit peak and its derivatives, each of the broadcast shape, dimensionless.

    ``by_slip`` is with respect to the reduced slip u = B x, ``by_shape`` to C, ``by_curvature`` to E.
    """

    value: Array  # -1 to 1
    by_slip: Array
    by_shape: Array
    by_curvature: Array


def magic_formula(reduced_slip: ArrayLike, *, shape_factor: ArrayLike, curvature_factor: ArrayLike) -> Array:
    """Return sin{C atan[u - E (u - atan u)]}, the Magic Formula of unit peak."""
    return np.sin(np.asarray(shape_factor) * np.arctan(_bend_slip(np.asarray(reduced_slip), curvature_factor)))


def magic_formula_derivatives(
    reduced_slip: ArrayLike, *, shape_factor: ArrayLike, curvature_factor: ArrayLike
) -> Curve:
    """Return the Magic Formula of unit peak with its derivatives; arguments as in `magic_formula`."""
    u, shape = np.asarray(reduced_slip), np.asarray(shape_factor)
    bent = _bend_slip(u, curvature_factor)
    angle = np.arctan(bent)
    cosine = np.cos(shape * angle)
    by_bent = shape * cosine / (1 + bent * bent)
    return Curve(
        np.sin(shape * angle),
        by_bent * (1 - np.asarray(curvature_factor) * u * u / (1 + u * u)),
        angle * cosine,
        by_bent * (np.arctan(u) - u),
    )


def normalised_lateral_force(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    vertical_shift: ArrayLike = 0.0,
    horizontal_shift: ArrayLike = 0.0,
) -> Array:
    """Return the lateral force over the vertical load, Fy/Fz.

    Fy/Fz = D sin{C atan[B x - E (B x - atan(B x))]} + Sv with x = slip angle + Sh (the horizontal shift is Pacejka's).
    """
    curve = magic_formula(
        np.asarray(stiffness_factor) * (np.asarray(slip_angle) + np.asarray(horizontal_shift)),
        shape_factor=shape_factor,
        curvature_factor=curvature_factor,
    )
    return np.asarray(np.asarray(peak_factor) * curve + np.asarray(vertical_shift), dtype=np.float64)


def normalised_lateral_force_slope(
    slip_angle: ArrayLike,
    *,
    stiffness_factor: ArrayLike,
    shape_factor: ArrayLike,
    peak_factor: ArrayLike,
    curvature_factor: ArrayLike,
    horizontal_shift: ArrayLike = 0.0,
) -> Array:
    """Return d(Fy/Fz)/d(slip angle); Sv does not enter."""
    curve = magic_formula_derivatives(
        np.asarray(stiffness_factor) * (np.asarray(slip_angle) + np.asarray(horizontal_shift)),
        shape_factor=shape_factor,
        curvature_factor=curvature_factor,
    )
    return np.asarray(np.asarray(peak_factor) * np.asarray(stiffness_factor) * curve.by_slip, dtype=np.float64)


def _bend_slip(u: Array, curvature: ArrayLike) -> Array:
    return np.asarray(u - np.asarray(curvature) * (u - np.arctan(u)))


def saturation(relative_load: ArrayLike, *, exponent: float = 2.0) -> Array:
    """Return sin(PKY4 atan x): how stiffness and relaxation length rise with the load, and fall beyond x = 1."""
    return np.asarray(np.sin(exponent * np.arctan(np.asarray(relative_load, dtype=np.float64))))


def cornering_stiffness(
    load: ArrayLike,
    pressure: ArrayLike,
    *,
    PKY1: float,
    PKY2: float,
    PPY1: float = 0.0,
    PPY2: float = 0.0,
    PKY4: float = 2.0,
    FNOMIN: float,
    NOMPRES: float,
) -> Array:
    """Return Kya of MF6.1 without camber."""
    dpi = (np.asarray(pressure, dtype=np.float64) - NOMPRES) / NOMPRES
    relative = np.asarray(load, dtype=np.float64) / (PKY2 * (1 + PPY2 * dpi) * FNOMIN)
    return np.asarray(PKY1 * FNOMIN * (1 + PPY1 * dpi) * saturation(relative, exponent=PKY4))


def cornering_stiffness_gradient(
    load: Array,
    pressure: Array,
    *,
    PKY1: float,
    PKY2: float,
    PPY1: float = 0.0,
    PPY2: float = 0.0,
    FNOMIN: float,
    NOMPRES: float,
) -> Array:
    """Return the derivatives of Kya (PKY4 = 2) with respect to PKY1, PKY2, PPY1 and PPY2."""
    dpi = (pressure - NOMPRES) / NOMPRES
    peak, x = FNOMIN * (1 + PPY1 * dpi), load / (PKY2 * (1 + PPY2 * dpi) * FNOMIN)
    shape, slope = saturation(x), 2 * (1 - x**2) / (1 + x**2) ** 2
    by_pky2, by_ppy1 = -PKY1 * peak * slope * x / PKY2, PKY1 * FNOMIN * dpi * shape
    return np.column_stack([peak * shape, by_pky2, by_ppy1, PKY2 * by_pky2 * dpi / (1 + PPY2 * dpi)])


def lateral_stiffness(
    load: ArrayLike,
    pressure: ArrayLike,
    *,
    LATERAL_STIFFNESS: float,
    PCFY1: float = 0.0,
    PCFY2: float = 0.0,
    PCFY3: float = 0.0,
    FNOMIN: float,
    NOMPRES: float,
) -> Array:
    """Return Cy of MF6.1."""
    dfz = np.asarray(load, dtype=np.float64) / FNOMIN - 1
    dpi = np.asarray(pressure, dtype=np.float64) / NOMPRES - 1
    return np.asarray(LATERAL_STIFFNESS * (1 + PCFY1 * dfz + PCFY2 * dfz**2) * (1 + PCFY3 * dpi))


def lateral_stiffness_gradient(
    load: Array,
    pressure: Array,
    *,
    LATERAL_STIFFNESS: float,
    PCFY1: float,
    PCFY3: float,
    FNOMIN: float,
    NOMPRES: float,
) -> Array:
    """Return the derivatives of Cy (PCFY2 = 0) with respect to LATERAL_STIFFNESS, PCFY1 and PCFY3."""
    dfz, dpi = load / FNOMIN - 1, pressure / NOMPRES - 1
    by_load, by_pressure = 1 + PCFY1 * dfz, 1 + PCFY3 * dpi
    return np.column_stack(
        [by_load * by_pressure, LATERAL_STIFFNESS * dfz * by_pressure, LATERAL_STIFFNESS * by_load * dpi]
    )


class Law(NamedTuple):
    """A law of MF6.1 over load and pressure that can be fitted to measured conditions."""

    names: tuple[str, ...]  # of the coefficients that are fitted
    value: Callable[..., Array]  # of loads (n,), N, pressures (n,), Pa, and coefficients by name: (n,), N/rad or N/m
    gradient: Callable[..., Array]  # of the same: (n, p), derivatives with respect to the p ``names``


# saturating in load, with pressure terms; and linear in load and in pressure
CORNERING = Law(("PKY1", "PKY2", "PPY1", "PPY2"), cornering_stiffness, cornering_stiffness_gradient)
LATERAL = Law(("LATERAL_STIFFNESS", "PCFY1", "PCFY3"), lateral_stiffness, lateral_stiffness_gradient)


class Fit(NamedTuple):
    """A law fitted to measured conditions."""

    coefficients: dict[str, float]  # by Magic Formula name; what the conditions cannot determine has a neutral value
    nominal: dict[str, float]  # FNOMIN, N, and NOMPRES, Pa: the middle ones of the measured loads and pressures
    free: list[int]  # numbers of the fitted coefficients


def fit(law: Law, load: Array, pressure: Array, value: Array) -> Fit:
    """Fit a law to measured stiffness (N/rad or N/m) at loads (N) and pressures (Pa) by least squares."""
    return _fit_cached(law, *(np.ascontiguousarray(column, float).tobytes() for column in (load, pressure, value)))


@lru_cache(maxsize=256)  # a study reads the same few tables a thousand times
def _fit_cached(law: Law, *columns: bytes) -> Fit:
    from scipy.optimize import least_squares  # costs more than the rest of `import tyre`

    load, pressure, value = (np.frombuffer(column) for column in columns)
    nominal = {"FNOMIN": float(np.median(np.unique(load))), "NOMPRES": float(np.median(np.unique(pressure)))}
    loads = bool(np.ptp(load) > 0)
    pressures = bool(np.ptp(pressure) > 0)
    count = len(value)
    if law is CORNERING:
        most, scale = load.max() / nominal["FNOMIN"], 1.0
        start = np.array([value.max() / nominal["FNOMIN"], 1.5 * most, 0.0, 0.0])
        free = np.flatnonzero([True, loads, pressures, loads and pressures and count >= 4])
        # 1 + PPY dpi stays positive over the measured pressures; PKY2 far above the loads is a straight line already
        widest = max(float(np.max(np.abs(pressure / nominal["NOMPRES"] - 1))), 1e-9)
        lower = np.array([0.0, 0.05 * most, -0.95 / widest, -0.95 / widest])
        upper = np.array([np.inf, 50 * most, np.inf, np.inf])
    else:
        scale = float(value.mean())
        start = np.array([1.0, 0.0, 0.0])
        free = np.flatnonzero([True, loads and (count >= 3 or not pressures), pressures])
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)

    def whole(fitted: Array) -> dict[str, float]:
        values = start.copy()
        values[free] = fitted
        return dict(zip(law.names, values.tolist(), strict=True)) | nominal

    solution = least_squares(
        lambda x: law.value(load, pressure, **whole(x)) - value / scale,
        start[free],
        jac=lambda x: law.gradient(load, pressure, **whole(x))[:, free],
        bounds=(lower[free], upper[free]),
        x_scale="jac",
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
        max_nfev=2000,
    )
    coefficients = whole(solution.x)
    coefficients[law.names[0]] *= scale
    return Fit({name: coefficients[name] for name in law.names}, nominal, free.tolist())
