"""Measured tyres for many bicycles at once: the values of `TyreMap`, vectorised over load and pressure."""

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tyre import TyreMap
from tyre.maps.conditions_grid import ConditionsGrid
from tyre.maps.map_notes import stiffness_note
from tyre.maps.tables import PASCAL_PER_BAR

Array = NDArray[np.float64]
Choice = Mapping[str, NDArray[Any]]  # tyre, surface, pressure_bar, load_N of one wheel, (m,) each


class TyreTable:
    """Tyre maps by name and surface, kept in memory."""

    def __init__(self, relative_cornering_stiffness_sd: float) -> None:
        self.relative_sd = relative_cornering_stiffness_sd
        self.map = cache(self._load)
        self.factor = cache(self._factor)

    def _load(self, tyre: str, surface: str) -> TyreMap:
        found = TyreMap.load(tyre, surface=surface)
        if found.measured.cornering_stiffness_sd is None and self.relative_sd:
            return TyreMap.load(tyre, surface=surface, relative_cornering_stiffness_sd=self.relative_sd)
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
            for tyre, surface, rows in _groups(wheel["tyre"], wheel["surface"]):
                load, pressure = wheel["load_N"][rows], wheel["pressure_bar"][rows].astype(float) * PASCAL_PER_BAR
                found = self.map(tyre, surface)
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
        keys = [
            [(str(t), str(s), float(p), float(n)) for t, s, p, n in zip(
                w["tyre"], w["surface"], w["pressure_bar"], np.broadcast_to(load, len(z)), strict=True)]
            for w, load in zip(wheels, nominal_loads, strict=True)
        ]  # fmt: skip
        result = np.empty_like(z)
        pairs = list(zip(*keys, strict=True))
        for pair in dict.fromkeys(pairs):
            rows = np.array([other == pair for other in pairs])
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


def _groups(tyres: NDArray[Any], surfaces: NDArray[Any]) -> list[tuple[str, str, NDArray[np.intp]]]:
    names = list(zip(tyres.tolist(), surfaces.tolist(), strict=True))
    return [
        (tyre, surface, np.array([i for i, name in enumerate(names) if name == (tyre, surface)]))
        for tyre, surface in dict.fromkeys(names)
    ]
