"""Magic Formula coefficients of a .tir file fitted to measured stiffnesses over load and pressure."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from tyre.base.errors import InputError
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral, Values

_PKY2_BOUNDS = (0.05, 50.0)


def fit_mf61(
    *, load: ArrayLike, pressure: ArrayLike, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike
) -> MF61Lateral:
    """Fit the MF-Tyre 6.1 form to measured stiffnesses; FNOMIN and NOMPRES are the middle of the measured range.

    Parameters
    ----------
    load, pressure, cornering_stiffness, lateral_stiffness : array_like, shape (n,)
        N, Pa, N/rad, N/m, one entry per condition.

    Returns
    -------
    MF61Lateral
        With one pressure the pressure terms are zero; with fewer than three loads PCFY2 is, with one load PCFY1 too
        (and PKY2 is 1).

    Raises
    ------
    InputError
        When shapes differ, a value is not positive, or there are no conditions.
    """
    fz, p, c, k = _columns(load, pressure, cornering_stiffness, lateral_stiffness)
    fnomin, nompres = _middle(fz), _middle(p)
    loads, pressures = len(np.unique(fz)), len(np.unique(p))
    dpi, dfz = p / nompres - 1.0, fz / fnomin - 1.0

    free = np.array([True, loads > 1, pressures > 1, pressures > 1 and loads > 1])
    start = np.array([float(np.mean(c)) / fnomin, 1.0, 0.0, 0.0])

    def model(values: Values) -> Values:
        whole = start.copy()
        whole[free] = values
        pky1, pky2, ppy1, ppy2 = whole
        return fnomin * pky1 * (1.0 + ppy1 * dpi) * np.sin(2.0 * np.arctan(fz / (pky2 * (1.0 + ppy2 * dpi) * fnomin)))

    lowest = np.array([0.0, _PKY2_BOUNDS[0], -2.0, -2.0])[free]
    highest = np.array([np.inf, _PKY2_BOUNDS[1], 2.0, 2.0])[free]
    lateral = start.copy()
    lateral[free] = _solve(lambda values: model(values) / c - 1.0, start[free], lowest, highest)
    stiffness, pcfy1, pcfy2, pcfy3 = _fit_lateral(dfz, dpi, k, loads, pressures)
    return MF61Lateral(
        fnomin=fnomin,
        nompres=nompres,
        pky1=-float(lateral[0]),
        pky2=float(lateral[1]),
        ppy1=float(lateral[2]),
        ppy2=float(lateral[3]),
        lateral_stiffness=stiffness,
        pcfy1=pcfy1,
        pcfy2=pcfy2,
        pcfy3=pcfy3,
        load_range=(float(fz.min()), float(fz.max())),
        pressure_range=(float(p.min()), float(p.max())),
    )


def fit_mf52(
    *, load: ArrayLike, pressure: float, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike,
    unloaded_radius: float,
) -> MF52Lateral:  # fmt: skip
    """Fit the MF-Tyre 5.2 form at one pressure (Pa); ``unloaded_radius`` in m, the rest as for ``fit_mf61``.

    Raises
    ------
    InputError
        When shapes differ or a value is not positive.
    """
    fz, _, c, k = _columns(load, np.full(np.shape(load), pressure), cornering_stiffness, lateral_stiffness)
    if not unloaded_radius > 0.0:
        raise InputError(f"unloaded radius is {unloaded_radius:g} m, it must be positive")
    fnomin = _middle(fz)
    pky1, pky2 = _arch(fz / fnomin, c / fnomin)
    pty1, pty2 = _arch(fz / fnomin, c / k / unloaded_radius)
    return MF52Lateral(
        fnomin=fnomin,
        pressure=float(pressure),
        unloaded_radius=float(unloaded_radius),
        pky1=-pky1,
        pky2=pky2,
        pty1=pty1,
        pty2=pty2,
        load_range=(float(fz.min()), float(fz.max())),
    )


def _arch(relative_load: Values, value: Values) -> tuple[float, float]:
    """Height and load of the maximum of value = height sin(2 atan(relative_load / position))."""
    if len(np.unique(relative_load)) == 1:
        return float(np.mean(value) / np.sin(2.0 * np.arctan(np.mean(relative_load)))), 1.0

    def misfit(x: Values) -> Values:
        return x[0] * np.sin(2.0 * np.arctan(relative_load / x[1])) / value - 1.0

    start = np.array([float(np.mean(value)), 1.0])
    solved = _solve(misfit, start, np.array([0.0, _PKY2_BOUNDS[0]]), np.array([np.inf, _PKY2_BOUNDS[1]]))
    return float(solved[0]), float(solved[1])


def _fit_lateral(
    dfz: Values, dpi: Values, stiffness: Values, loads: int, pressures: int
) -> tuple[float, float, float, float]:
    free = np.array([True, loads > 1, loads > 2, pressures > 1])
    scale = float(np.mean(stiffness))

    def model(values: Values) -> Values:
        whole = np.zeros(4)
        whole[free] = values
        return whole[0] * (1.0 + whole[1] * dfz + whole[2] * dfz**2) * (1.0 + whole[3] * dpi)

    start = np.array([1.0, 0.0, 0.0, 0.0])[free]
    whole = np.zeros(4)
    whole[free] = _solve(lambda x: model(x) / (stiffness / scale) - 1.0, start, -np.inf, np.inf)
    return float(whole[0]) * scale, float(whole[1]), float(whole[2]), float(whole[3])


def _solve(
    misfit: Callable[[Values], Values], start: Values, lowest: Values | float, highest: Values | float
) -> Values:
    solved = least_squares(misfit, start, bounds=(lowest, highest), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return np.asarray(solved.x)


def _middle(values: Values) -> float:
    return float(values.min() + values.max()) / 2.0


def _columns(*arrays: ArrayLike) -> list[Values]:
    columns = [np.atleast_1d(np.asarray(array, dtype=np.float64)) for array in arrays]
    shapes = {column.shape for column in columns}
    if len(shapes) != 1 or columns[0].ndim != 1 or not columns[0].size:
        raise InputError(
            "load, pressure and the two stiffnesses must be lists of one length, with one condition or more"
        )
    for name, column in zip(("load", "pressure", "cornering stiffness", "lateral stiffness"), columns, strict=True):
        if not (np.isfinite(column) & (column > 0.0)).all():
            raise InputError(f"{name} must be positive everywhere, its smallest value is {column.min():g}")
    return columns
