"""The speeds at which a demand is missed most: every local maximum along speed, sharpened."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from bicycle.linear_model import LinearModel
from bicycle.modal.named_modes import modes
from studies.design.demand import Demand, members, worst
from tyre.base.arrays import Array, Complex

NEAR = 1e-7  # of the speed: how sharply a maximum is found


@dataclass(frozen=True)
class Peak:
    """A demand, a speed (m/s), the root there (1/s) and by how much it misses the demand (1/s; below 0: keeps it)."""

    demand: Demand
    speed: float
    root: complex
    excess: float


def peaks(linear: LinearModel, demands: Sequence[Demand], speeds: Array) -> list[Peak]:
    """Local maxima of the excess of every demand along speed, the ends of the range included.

    Parameters
    ----------
    linear : LinearModel
    demands : sequence of Demand
    speeds : ndarray, shape (m,)
        m/s, rising.
    """
    branches = modes(linear, speeds).branches
    return [
        peak
        for demand in demands
        for peak in _of(linear, demand, speeds, *worst(demand, members(branches, demand.mode)))
    ]


def _of(linear: LinearModel, demand: Demand, speeds: Array, roots: Complex, there: NDArray[np.bool_]) -> list[Peak]:
    excess = np.where(there, demand.excess(np.nan_to_num(roots)), -np.inf)
    left, right = np.r_[-np.inf, excess[:-1]], np.r_[excess[1:], -np.inf]
    found = []
    for k in np.flatnonzero((excess >= left) & (excess >= right) & there).tolist():
        a, b = max(k - 1, 0), min(k + 1, len(speeds) - 1)
        peak = Peak(demand, float(speeds[k]), complex(roots[k]), float(excess[k]))
        found.append(_sharpened(linear, peak, speeds[a : b + 1], roots[a : b + 1]))
    return found


def _sharpened(linear: LinearModel, peak: Peak, speeds: Array, roots: Complex) -> Peak:
    """The maximum between the neighbours of a node, of the root that leads from one to the other."""
    if np.isnan(roots).any():
        return peak

    def root(speed: float) -> complex:
        near = np.interp(speed, speeds, roots.real) + 1j * np.interp(speed, speeds, roots.imag)
        values = linear.eigenvalues(speed)
        return complex(values[np.abs(values - near).argmin()])

    found = minimize_scalar(
        lambda v: -float(peak.demand.excess(root(v))), bounds=(speeds[0], speeds[-1]), method="bounded",
        options={"xatol": NEAR * peak.speed + 1e-9, "maxiter": 60},
    )  # fmt: skip
    best = root(float(found.x))
    excess = float(peak.demand.excess(best))
    return Peak(peak.demand, float(found.x), best, excess) if excess > peak.excess else peak


def at_speeds(linear: LinearModel, asked: Sequence[tuple[Demand, float]]) -> list[Peak]:
    """The root that misses a demand most at given speeds, where there is one.

    Parameters
    ----------
    linear : LinearModel
    asked : sequence of (Demand, float)
        Demand and speed in m/s.
    """
    speeds = np.array([speed for _, speed in asked])
    branches = modes(linear, speeds).branches
    found = []
    for k, (demand, speed) in enumerate(asked):
        roots, there = worst(demand, members(branches, demand.mode)[k : k + 1])
        if there[0]:
            found.append(Peak(demand, speed, complex(roots[0]), float(demand.excess(roots[0]))))
    return found
