"""Measured tyres for many bicycles at once: the values of `TyreMap`, vectorised over load and pressure."""

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.default_sd import CORNERING_STIFFNESS
from bicycle.files.model_file import MOST_BAR
from studies.sampling.bounded_draws import BoundedDraws
from studies.sampling.refused import Refused
from tyre import TyreMap
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.map_notes import stiffness_note
from tyre.maps.tables import PASCAL_PER_BAR
from tyre.maps.wheels import wheel_properties

NO_TYRE = "the tyre's table says nothing of the load or pressure"
BLOCKS = (np.array([0, 2]), np.array([1, 3]))  # cornering stiffness of both wheels, lateral stiffness of both
USED = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])  # C and K among C, K, relaxation length of two wheels
POSITIVE = (0.0, math.inf)
FACTORS = 4096  # kept in memory: a sampled pressure makes one for each item
Choice = Mapping[str, NDArray[Any]]  # tyre, surface, pressure_bar, load_N of one wheel, (m,) each


class TyreTable:
    """Tyre maps by name and surface, kept in memory."""

    def __init__(self, relative_cornering_stiffness_sd: float) -> None:
        self.relative_sd = relative_cornering_stiffness_sd
        self.map = cache(self._load)
        self.factor = lru_cache(FACTORS)(self._factor)

    def _load(self, tyre: str, surface: str) -> TyreMap:
        return TyreMap.of(tyre, surface=surface).assuming(self.relative_sd)

    def stiffnesses(
        self,
        wheels: Sequence[Choice],
        z: Array | None,
        nominal_loads: Sequence[Any],
        refused: Refused,
        *,
        linear: bool = False,
        share: float = 1.0,
    ) -> tuple[list[Array], list[Array], NDArray[np.bool_]]:
        """Cornering (N/rad) and lateral (N/m) stiffness of both wheels, and where an item's tyre is extrapolated.

        With standard normal ``z`` (m, 4) the relative deviations of a tyre at the wheel loads of the unvaried bicycle
        are drawn from their measured covariance, positive stiffnesses (``linear``: normal ones, ``share`` of the way);
        what the two wheels share stays shared. Conditions that a map refuses are marked in ``refused``.
        """  # fmt: skip
        count = len(wheels[0]["load_N"])
        stiffness = [np.empty((2, count)) for _ in wheels]
        outside = np.zeros(count, bool)
        conditions = [(wheel["load_N"].astype(float), wheel["pressure_bar"] * PASCAL_PER_BAR) for wheel in wheels]
        for k, wheel in enumerate(wheels):
            for rows in _alike(wheel["tyre"], wheel["surface"]):
                found = self.map(str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]]))
                _mark(found, *conditions[k], rows, refused)
        for (load, pressure), wheel, out in zip(conditions, wheels, stiffness, strict=True):
            for rows in _alike(wheel["tyre"], wheel["surface"]):
                found = self.map(str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]]))
                measured, bad = found.measured, refused.mask[rows]
                n, p = (np.where(bad, one[0], x[rows]) for one, x in (
                    (measured.load, load), (measured.pressure, pressure)))  # fmt: skip
                weights = ConditionsGrid(measured.load, measured.pressure).weights(n, p)
                for row, trend in enumerate((found.cornering_stiffness_trend, found.lateral_stiffness_trend)):
                    out[row, rows] = trend.evaluate(n, p)[0] + (weights * trend.residuals).sum(1)
                for value, lines in ((n, found.loads), (p, found.pressures)):
                    outside[rows] |= (value < lines[0] * (1 - 1e-9)) | (value > lines[-1] * (1 + 1e-9))
        if z is not None:
            away = self._relative(wheels, z, nominal_loads, refused, linear=linear)
            for k, out in enumerate(stiffness):
                out *= 1 + share * away[:, 2 * k : 2 * k + 2].T
        return [out[0] for out in stiffness], [out[1] for out in stiffness], outside

    def _relative(
        self, wheels: Sequence[Choice], z: Array, nominal_loads: Sequence[Any], refused: Refused, *, linear: bool
    ) -> Array:
        """Relative deviations (m, 4) of C and K, rear then front; 0 where an item is refused."""
        columns = [
            (wheel["tyre"], wheel["surface"], wheel["pressure_bar"], np.broadcast_to(load, len(z)))
            for wheel, load in zip(wheels, nominal_loads, strict=True)
        ]
        result = np.zeros_like(z)
        for rows in _alike(*columns[0], *columns[1]):
            at = rows[0]
            pair = [(str(t[at]), str(s[at]), float(p[at]), float(n[at])) for t, s, p, n in columns]
            used = rows[~refused.mask[rows]]
            try:
                joint = self.factor(*pair) if used.size else []
            except InputError as error:  # at the loads of the unvaried bicycle
                mask = np.zeros_like(refused.mask)
                mask[used] = True
                refused.add(NO_TYRE, mask, str(error))
                continue
            for block, draws in joint:
                drawn = np.ascontiguousarray(z[np.ix_(used, block)].T)
                result[np.ix_(used, block)] = (draws.linear(drawn) if linear else draws(drawn)).T - 1
        return result

    def _factor(self, *wheels: tuple[str, str, float, float]) -> list[tuple[NDArray[np.intp], BoundedDraws]]:
        """Draws of C and K of both wheels, rear then front, relative to their values, with the places they take.

        C and K are measured apart and drawn apart, unless the calibration of one load cell is in both: then the part of
        K that hangs on it is drawn with C.
        """
        maps = [self.map(tyre, surface) for tyre, surface, *_ in wheels]
        joint = wheel_properties(maps, [(load, pressure * PASCAL_PER_BAR) for _, _, pressure, load in wheels])
        mean = np.array([value for p in joint.properties for value in (p.cornering_stiffness, p.lateral_stiffness)])
        relative = joint.covariance[USED] / np.outer(mean, mean)
        cornering, lateral = BLOCKS
        root, shared = _root(relative[np.ix_(cornering, cornering)]), relative[np.ix_(lateral, cornering)]
        own = relative[np.ix_(lateral, lateral)]
        if not shared.any():
            return [(cornering, _positive(root)), (lateral, _positive(_root(own)))]
        carried = shared @ np.linalg.pinv(root).T
        whole = np.block([[root, np.zeros((2, 2))], [carried, _root(own - carried @ carried.T)]])
        return [(np.concatenate(BLOCKS), _positive(whole))]


def _root(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0)))


def _positive(root: Array) -> BoundedDraws:
    return BoundedDraws(np.ones(len(root)), root, [POSITIVE] * len(root))


def _mark(found: TyreMap, load: Array, pressure: Array, rows: NDArray[np.intp], refused: Refused) -> None:
    """Mark the items whose load (N) or pressure (Pa) the map refuses, with its own message for the first."""
    rows = rows[~refused.mask[rows]]
    if not rows.size or not _message(found, load[rows], pressure[rows]):
        return
    bad, said = np.zeros_like(refused.mask), ""
    for row in rows:
        message = _message(found, load[row : row + 1], pressure[row : row + 1])
        bad[row], said = bool(message), said or message
    refused.add(NO_TYRE, bad, said)


def _message(found: TyreMap, load: Array, pressure: Array) -> str:
    """What the map says against the corners of these conditions; empty where all are possible."""
    if pressure.max() > MOST_BAR * PASCAL_PER_BAR:
        bar = pressure.max() / PASCAL_PER_BAR
        return f"pressure_bar = {bar:g} must be a number above 0 and up to {MOST_BAR:g} bar"
    for corner in {(a, b) for a in (load.min(), load.max()) for b in (pressure.min(), pressure.max())}:
        try:
            found.at(load=corner[0], pressure=corner[1])
        except InputError as error:
            return str(error)
    return ""


def said_of_stiffness(warnings: Sequence[str], relative_cornering_stiffness_sd: float) -> tuple[str, ...]:
    """Warnings of a model file with what a sweep assumes of C_Fy in place of the default."""
    plain, assumed = stiffness_note(CORNERING_STIFFNESS), stiffness_note(relative_cornering_stiffness_sd)
    return tuple(warning.replace(plain, assumed) for warning in warnings)


def _alike(*columns: NDArray[Any]) -> list[NDArray[np.intp]]:
    """Rows that are equal in every column (m,), together."""
    code = np.zeros(len(columns[0]), np.intp)
    for column in columns:
        if any(column.strides):  # else one value, broadcast
            values, at = np.unique(column, return_inverse=True)
            code = np.unique(code * len(values) + at, return_inverse=True)[1]
    order = np.argsort(code, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(code[order])) + 1)
