"""Covariance of cornering and lateral stiffness at the measured conditions of a table, with what they have in common.

Three parts: the calibration, common to all conditions and through the load cell to both stiffnesses; the lateral
stiffness that conditions share because the same pull tests gave it; and each condition's own scatter.
"""

from typing import NamedTuple

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.maps.tables import PASCAL_PER_BAR, MeasuredTable

ROUNDING = 1e-9  # relative: of a file's digits


class StiffnessCovariance(NamedTuple):
    """Blocks of the covariance of the measured stiffnesses C and K, SI units, shape (N, N) each.

    ``own_cornering`` and ``own_lateral`` are the parts of the first and last that scatter between recordings caused.
    """

    cornering: Array
    cornering_lateral: Array
    lateral: Array
    own_cornering: Array
    own_lateral: Array


def stiffness_covariance(table: MeasuredTable, cornering_stiffness_sd: Array) -> StiffnessCovariance:
    """Covariance of the stiffnesses of a table.

    Parameters
    ----------
    table : MeasuredTable
    cornering_stiffness_sd : ndarray, shape (N,)
        Stated or assumed, N/rad.

    Raises
    ------
    InputError
        Standard deviations or correlations that cannot hold the calibration they are said to hold.
    """
    c, k = table.cornering_stiffness, table.lateral_stiffness
    c_sd, k_sd = cornering_stiffness_sd, table.lateral_stiffness_sd
    keys = [table.sharing_key(row) for row in range(k.size)]
    same = np.array([[one == other for other in keys] for one in keys], dtype=np.float64)
    if table.calibration is None and table.stiffness_correlation is None:
        own_c, own_k = np.diag(c_sd**2), np.asarray(np.outer(k_sd, k_sd) * same)
        return StiffnessCovariance(own_c, np.zeros((k.size, k.size)), own_k, own_c, own_k)
    common = np.zeros((2, 2)) if table.calibration is None else table.calibration.relative_covariance
    c_left = _left_over(table, "cornering_stiffness", c_sd / c, float(common[0, 0]))
    k_left = _left_over(table, "lateral_stiffness", k_sd / k, float(common[1, 1]))
    own = np.zeros_like(c)
    if table.stiffness_correlation is not None:
        own = table.stiffness_correlation * (c_sd / c) * (k_sd / k) - common[0, 1]
        for row in np.flatnonzero(np.abs(own) > np.sqrt(c_left * k_left) + ROUNDING * (c_sd / c) * (k_sd / k)):
            raise InputError(
                f"{_where(table, int(row))}: a correlation of {table.stiffness_correlation[row]:.3g} between cornering "
                "and lateral stiffness cannot be, with these standard deviations and the calibration common to all "
                "conditions; correct stiffness_correlation or leave it out"
            )
    own_c = np.diag(c_left) * np.outer(c, c)
    own_k = np.sqrt(np.outer(k_left, k_left)) * same * np.outer(k, k)
    found = StiffnessCovariance(
        own_c + common[0, 0] * np.outer(c, c), (np.diag(own) + common[0, 1]) * np.outer(c, k),
        own_k + common[1, 1] * np.outer(k, k), own_c, own_k,
    )  # fmt: skip
    relative = np.block([[found.cornering, found.cornering_lateral], [found.cornering_lateral.T, found.lateral]])
    relative /= np.outer(np.append(c, k), np.append(c, k))
    if np.linalg.eigvalsh(relative)[0] < -ROUNDING * np.abs(relative).max():
        raise InputError(
            f"{table.label}: a lateral stiffness that conditions share (lateral_stiffness_shared_over) cannot have "
            "these correlations with their cornering stiffnesses; leave stiffness_correlation out"
        )
    return found


def _left_over(table: MeasuredTable, name: str, relative_sd: Array, common: float) -> Array:
    """Relative variance of each condition alone."""
    left = relative_sd**2 - common
    for row in np.flatnonzero(left < -ROUNDING * common):
        raise InputError(
            f"{_where(table, int(row))}: the standard deviation of the {name.replace('_', ' ')} is "
            f"{100 * relative_sd[row]:.3g} %, less than the {100 * np.sqrt(common):.3g} % of the calibration that is "
            "common to all conditions; standard deviations hold the calibration, so add it or lower [calibration]"
        )
    return np.maximum(left, 0.0)


def _where(table: MeasuredTable, row: int) -> str:
    return f"{table.label}, {table.load[row]:g} N at {table.pressure[row] / PASCAL_PER_BAR:g} bar"
