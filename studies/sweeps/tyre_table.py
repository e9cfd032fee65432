"""Measured tyres for many bicycles at once: the values of `TyreMap`, vectorised over load and pressure."""

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.model_file import MOST_BAR
from tyre import TyreMap
from tyre.errors import InputError
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.map_notes import stiffness_note
from tyre.maps.tables import PASCAL_PER_BAR

Array = NDArray[np.float64]
FACTORS = 4096  # kept in memory: a sampled pressure makes one for each item
Choice = Mapping[str, NDArray[Any]]  # tyre, surface, pressure_bar, load_N of one wheel, (m,) each


class TyreTable:
    """Tyre maps by name and surface, kept in memory."""

    def __init__(self, relative_cornering_stiffness_sd: float) -> None:
        self.relative_sd = relative_cornering_stiffness_sd
        self.map = cache(self._load)
        self.factor = lru_cache(FACTORS)(self._factor)

    def _load(self, tyre: str, surface: str) -> TyreMap:
        found = TyreMap.of(tyre, surface=surface)
        if found.measured.cornering_stiffness_sd is None and self.relative_sd:
            return TyreMap.of(tyre, surface=surface, relative_cornering_stiffness_sd=self.relative_sd)
        return found

    def stiffnesses(
        self, wheels: Sequence[Choice], z: Array | None, nominal_loads: Sequence[Any]
    ) -> tuple[list[Array], list[Array], NDArray[np.bool_]]:
        """Cornering (N/rad) and lateral (N/m) stiffness of both wheels, and where an item's tyre is extrapolated.

        With standard normal ``z`` (m, 4) the measured covariance at the wheel loads of the unvaried bicycle is drawn
        from; what the two wheels share stays shared.

        Raises
        ------
        InputError
            A condition the tyre map refuses.
        """
        count = len(wheels[0]["load_N"])
        stiffness = [np.empty((2, count)) for _ in wheels]
        outside = np.zeros(count, bool)
        for wheel, out in zip(wheels, stiffness, strict=True):
            for rows in _alike(wheel["tyre"], wheel["surface"]):
                load, bar = wheel["load_N"][rows], wheel["pressure_bar"][rows].astype(float)
                most = bar.max()
                if most > MOST_BAR:
                    raise InputError(f"pressure_bar = {most:g} must be a number above 0 and up to {MOST_BAR:g} bar")
                pressure = bar * PASCAL_PER_BAR
                found = self.map(str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]]))
                for corner in {(a, b) for a in (load.min(), load.max()) for b in (pressure.min(), pressure.max())}:
                    found.at(load=corner[0], pressure=corner[1])  # the map's own checks and messages
                grid = ConditionsGrid(found.measured.load, found.measured.pressure)
                weights = grid.weights(load, pressure)
                for row, trend in enumerate((found.cornering_stiffness_trend, found.lateral_stiffness_trend)):
                    out[row, rows] = trend.evaluate(load, pressure)[0] + (weights * trend.residuals).sum(1)
                for value, lines in ((load, found.loads), (pressure, found.pressures)):
                    outside[rows] |= (value < lines[0] * (1 - 1e-9)) | (value > lines[-1] * (1 + 1e-9))
        if z is not None:
            drawn = self._drawn(wheels, z, nominal_loads)
            for k, out in enumerate(stiffness):
                out += drawn[:, 2 * k : 2 * k + 2].T
        for wheel, out in zip(wheels, stiffness, strict=True):
            for row in np.flatnonzero(~(out > 0).all(0))[:1]:
                self.map(str(wheel["tyre"][row]), str(wheel["surface"][row])).at(
                    load=wheel["load_N"][row], pressure=wheel["pressure_bar"][row] * PASCAL_PER_BAR
                )  # refuses it; if not, the effect refuses the drawn value
        return [out[0] for out in stiffness], [out[1] for out in stiffness], outside

    def _drawn(self, wheels: Sequence[Choice], z: Array, nominal_loads: Sequence[Any]) -> Array:
        columns = [
            (wheel["tyre"], wheel["surface"], wheel["pressure_bar"], np.broadcast_to(load, len(z)))
            for wheel, load in zip(wheels, nominal_loads, strict=True)
        ]
        result = np.empty_like(z)
        for rows in _alike(*columns[0], *columns[1]):
            at = rows[0]
            pair = [(str(t[at]), str(s[at]), float(p[at]), float(n[at])) for t, s, p, n in columns]
            result[rows] = (self.factor(*pair) * z[rows][:, None, :]).sum(-1)
        return result

    def _factor(self, *wheels: tuple[str, str, float, float]) -> Array:
        """Square root of the covariance of C and K, rear then front, shape (4, 4)."""
        (tyre, surface, *_), (other_tyre, other_surface, *_) = wheels
        conditions = [(load, pressure * PASCAL_PER_BAR) for _, _, pressure, load in wheels]
        covariance = np.zeros((4, 4))
        if (tyre, surface) == (other_tyre, other_surface):
            used = [0, 1, 3, 4]
            covariance[:] = self.map(tyre, surface).joint(conditions)[1][np.ix_(used, used)]
        else:
            for k, (name, on, *_) in enumerate(wheels):
                at = slice(2 * k, 2 * k + 2)
                covariance[at, at] = self.map(name, on).joint(conditions[k : k + 1])[1][:2, :2]
        root = np.zeros((4, 4))
        for block in ([0, 2], [1, 3]):  # C and K are measured apart
            values, vectors = np.linalg.eigh(covariance[np.ix_(block, block)])
            root[np.ix_(block, block)] = vectors * np.sqrt(np.maximum(values, 0))
        return root


def said_of_stiffness(warnings: Sequence[str], relative_cornering_stiffness_sd: float) -> tuple[str, ...]:
    """Warnings of a model file with what a sweep assumes of C_Fy in place of what the file alone does: nothing."""
    plain, assumed = stiffness_note(0.0), stiffness_note(relative_cornering_stiffness_sd)
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
