"""Magic Formula coefficients of a .tir file fitted to measured stiffnesses over load and pressure."""

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.magic_formula import mf61
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral

_PKY2_BOUNDS = (0.05, 50.0)


def fit_mf61(
    *, load: ArrayLike, pressure: ArrayLike, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike
) -> MF61Lateral:
    """Fit the MF-Tyre 6.1 form to measured stiffnesses: the coefficients are those of the trends of a `TyreMap`.

    Parameters
    ----------
    load, pressure, cornering_stiffness, lateral_stiffness : array_like, shape (n,)
        N, Pa, N/rad, N/m, one entry per condition.

    Returns
    -------
    MF61Lateral
        FNOMIN and NOMPRES are the middle one of the measured loads and pressures. With one pressure the pressure terms
        are zero, with one load PCFY1 is; PCFY2 always is (:func:`tyre.magic_formula.mf61.fit_lateral_stiffness`).

    Raises
    ------
    InputError
        When shapes differ, a value is not positive, or there are no conditions.
    """
    fz, p, c, k = _columns(load, pressure, cornering_stiffness, lateral_stiffness)
    cornering, lateral = mf61.fit_cornering_stiffness(fz, p, c), mf61.fit_lateral_stiffness(fz, p, k)
    return MF61Lateral(
        fnomin=cornering.nominal["FNOMIN"],
        nompres=cornering.nominal["NOMPRES"],
        pky1=-cornering.coefficients["PKY1"],
        pky2=cornering.coefficients["PKY2"],
        ppy1=cornering.coefficients["PPY1"],
        ppy2=cornering.coefficients["PPY2"],
        lateral_stiffness=lateral.coefficients["LATERAL_STIFFNESS"],
        pcfy1=lateral.coefficients["PCFY1"],
        pcfy2=0.0,
        pcfy3=lateral.coefficients["PCFY3"],
        load_range=(float(fz.min()), float(fz.max())),
        pressure_range=(float(p.min()), float(p.max())),
    )


def fit_mf52(
    *, load: ArrayLike, pressure: float, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike,
    unloaded_radius: float,
) -> MF52Lateral:  # fmt: skip
    """Fit the MF-Tyre 5.2 form at one pressure.

    Parameters
    ----------
    load, cornering_stiffness, lateral_stiffness : array_like, shape (n,)
        N, N/rad and N/m, one entry per condition.
    pressure : float
        Pa.
    unloaded_radius : float
        Of the tyre, m.

    Returns
    -------
    MF52Lateral
        FNOMIN is the middle of the measured loads.

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


def _arch(relative_load: Array, value: Array) -> tuple[float, float]:
    """Height and load of the maximum of value = height sin(2 atan(relative_load / position))."""
    if len(np.unique(relative_load)) == 1:
        return float(np.mean(value) / mf61.saturation(np.mean(relative_load))), 1.0
    from scipy.optimize import least_squares

    solved = least_squares(
        lambda x: x[0] * mf61.saturation(relative_load / x[1]) / value - 1.0, [float(np.mean(value)), 1.0],
        bounds=([0.0, _PKY2_BOUNDS[0]], [np.inf, _PKY2_BOUNDS[1]]), xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    return float(solved.x[0]), float(solved.x[1])


def _middle(values: Array) -> float:
    return float(values.min() + values.max()) / 2.0


def _columns(*arrays: ArrayLike) -> list[Array]:
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
