"""Branches of eigenvalues along any one number that the state matrix depends on, and where they cross the axis."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from bicycle.eigenvalues.decomposition import eigensystem, projected
from bicycle.modal.matching import Nodes
from bicycle.modal.tracking import in_branches, refine
from tyre.base.arrays import Array, Complex

SMALLEST_STEP = 2.0**-26  # of the range
SLOPE_STEP = 1e-6  # of the range, for d(A)/d(number); slopes only say where roots are heading


class BranchCrossing(NamedTuple):
    """Branch number ``branch`` crosses the imaginary axis at ``value`` with the root ``root`` (1/s)."""

    branch: int
    value: float
    root: complex
    destabilising: bool


def follow_branches(matrices: Callable[[Array], Array], values: Array) -> tuple[Array, Complex]:
    """Track every eigenvalue along a number.

    Parameters
    ----------
    matrices : callable
        Values (m,) of the number -> state matrices (m, n, n), 1/s.
    values : ndarray, shape (m,)
        Increasing; more are put in between where roots come close.

    Returns
    -------
    values, eigenvalues : ndarray, shape (k,) and (k, n)
        All values, and eigenvalues (1/s), one column a branch.
    """
    low, high = values[0], values[-1]

    def compute(at: Array) -> Nodes:
        """Eigenvalues, their slopes and vectors; one-sided differences of the matrices at the ends of the range."""
        h = SLOPE_STEP * (high - low)
        ahead, behind = np.minimum(at + h, high), np.maximum(at - h, low)
        matrix, up, down = np.split(matrices(np.concatenate([at, ahead, behind])), 3)
        roots, right, left = eigensystem(matrix)
        slopes = projected(left, (up - down) / (ahead - behind)[:, None, None], right)
        return Nodes(at, *(x.astype(complex) for x in (roots, slopes, right, left)))

    tracked, _ = in_branches(*refine(compute(values), compute, SMALLEST_STEP * (high - low)))
    return tracked.speeds, tracked.values


def branch_crossings(matrices: Callable[[Array], Array], values: Array, eigenvalues: Complex) -> list[BranchCrossing]:
    """Where branches cross the imaginary axis; one that crosses and comes back between two values is not seen.

    Parameters
    ----------
    matrices : callable
        As in :func:`follow_branches`.
    values, eigenvalues : ndarray, shape (k,) and (k, n)
        What :func:`follow_branches` gave.

    Returns
    -------
    list of BranchCrossing
        By value, then by frequency.
    """
    crossings = []
    for k, i in np.argwhere((eigenvalues.real[:-1] > 0) != (eigenvalues.real[1:] > 0)):
        ends = eigenvalues[[k, k + 1], i]
        if (ends.imag < 0).any():
            continue

        def near(value: float, a: float = values[k], b: float = values[k + 1], ends: Complex = ends) -> complex:
            t = (value - a) / (b - a)
            candidates = np.linalg.eigvals(matrices(np.array([value]))[0])
            return complex(candidates[np.abs(candidates - (1 - t) * ends[0] - t * ends[1]).argmin()])

        sides = [near(value).real > 0 for value in values[[k, k + 1]]]
        if sides[0] == sides[1]:  # rounding moved a root that lies on the axis
            continue
        value = float(brentq(lambda x, near=near: near(x).real, values[k], values[k + 1], xtol=1e-14, rtol=1e-13))
        crossings.append(BranchCrossing(int(i), value, near(value), bool(ends[1].real > ends[0].real)))
    return sorted(crossings, key=lambda crossing: (crossing.value, abs(crossing.root.imag)))
