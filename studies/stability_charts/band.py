"""How well a boundary is known, over the whole chart: the band in which it lies with 95 %, to first order."""

import numpy as np
from scipy.spatial import KDTree

from tyre.base.arrays import Array

BAND = 1.96  # standard deviations: 95 %
CELLS = 300  # along each axis
_LEAST = 1e-12  # of the axes: a boundary without spread
_BETWEEN = 6  # points in place of one of the boundary


def band_of(shares: Array, sd: Array) -> tuple[Array, Array]:
    """How far each point of the chart is from a boundary, in half widths of the band of its nearest point.

    Parameters
    ----------
    shares : ndarray, shape (m, 2)
        Points of the boundary in order, 0 to 1 along each axis.
    sd : ndarray, shape (m,)
        Standard deviation along its normal, in shares of the axes.

    Returns
    -------
    share : ndarray, shape (k,)
        Along each axis, from 0 to 1.
    away : ndarray, shape (k, k)
        First index along the first axis; up to 1 inside the band.
    """
    share = np.linspace(0, 1, CELLS + 1)
    grid = np.stack(np.meshgrid(share, share, indexing="ij"), -1).reshape(-1, 2)
    point = np.arange(len(shares))
    between = np.linspace(0, len(point) - 1, _BETWEEN * len(point))
    dense = np.stack([np.interp(between, point, along) for along in shares.T], -1)
    away, at = KDTree(dense).query(grid)
    away = away / np.maximum(BAND * np.interp(between, point, sd)[at], _LEAST)
    return share, away.reshape(CELLS + 1, CELLS + 1)
