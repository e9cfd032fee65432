"""Tyres for many bicycles at once: what a `TyreSource` holds, vectorised over load and pressure."""

import math
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.default_sd import CORNERING_STIFFNESS
from bicycle.files.wheel_tyres import MOST_BAR
from studies.sampling.bounded_draws import BoundedDraws
from studies.sampling.refused import Refused
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.find_tyre import read_tyre
from tyre.properties import MEASURED_BESIDE, parameters_of_effects, stiffness_note
from tyre.tyre_source import TyreSource
from tyre.wheels import wheel_properties

NO_TYRE = "the tyre's table says nothing of the load or pressure"
BLOCKS = (np.array([0, 2]), np.array([1, 3]))  # cornering stiffness of both wheels, lateral stiffness of both
USED = np.ix_([0, 1, 3, 4], [0, 1, 3, 4])  # C and K among C, K, relaxation length of two wheels
STIFFNESSES = ("cornering_stiffness", "lateral_stiffness")
POSITIVE = (0.0, math.inf)
FACTORS = 4096  # kept in memory: a sampled pressure makes one for each item
Choice = Mapping[str, NDArray[Any]]  # tyre, surface, pressure_bar, load_N of one wheel, (m,) each


class TyreTable:
    """Tyres by name and surface, kept in memory."""

    def __init__(self, relative_cornering_stiffness_sd: float) -> None:
        self.relative_sd = relative_cornering_stiffness_sd
        self.map = cache(self._load)
        self.factor = lru_cache(FACTORS)(self._factor)

    def _load(self, tyre: str, surface: str) -> TyreSource:
        found: TyreSource = read_tyre(tyre, surface=surface).assuming(self.relative_sd)
        return found

    def values(
        self,
        wheels: Sequence[Choice],
        wanted: Sequence[Sequence[str]],
        z: Array | None,
        nominal_loads: Sequence[Any],
        refused: Refused,
        *,
        linear: bool = False,
        share: float = 1.0,
    ) -> tuple[list[dict[str, Array]], NDArray[np.bool_]]:
        """Properties of the tyres of both wheels by name, (m,) each, and where an item's tyre is extrapolated.

        ``wanted`` are the names of :class:`tyre.TyreProperties` for each wheel; a tyre that holds nothing of one gives
        NaN. With standard normal ``z`` (m, 4) the relative deviations of a tyre at the wheel loads of the unvaried
        bicycle are drawn from their measured covariance, positive stiffnesses (``linear``: normal ones, ``share`` of
        the way); what the two wheels share stays shared. Conditions that a tyre refuses are marked in ``refused``.

        Parameters
        ----------
        nominal_loads : sequence of object
            Of both wheels of the unvaried bicycle, N.
        """
        count = len(wheels[0]["load_N"])
        found = [{name: np.full(count, np.nan) for name in (*STIFFNESSES, *MEASURED_BESIDE)} for _ in wheels]
        outside = np.zeros(count, bool)
        conditions = [(wheel["load_N"].astype(float), wheel["pressure_bar"] * PASCAL_PER_BAR) for wheel in wheels]
        for k, wheel in enumerate(wheels):
            for rows in _alike(wheel["tyre"], wheel["surface"]):
                tyre = self.map(str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]]))
                _mark(tyre, *conditions[k], rows, refused)
        for (load, pressure), wheel, values, names in zip(conditions, wheels, found, wanted, strict=True):
            for rows in _alike(wheel["tyre"], wheel["surface"]):
                tyre = self.map(str(wheel["tyre"][rows[0]]), str(wheel["surface"][rows[0]]))
                bad, usual = refused.mask[rows], (tyre.loads, tyre.pressures)
                n, p = (np.where(bad, x[rows] if not len(one) else one[0], x[rows])
                        for one, x in zip(usual, (load, pressure), strict=True))  # fmt: skip
                held = tyre.linear(load=n, pressure=p)
                for name in values:
                    values[name][rows] = held[name] if name in held else _one_by_one(tyre, name, names, n, p)
                for value, (low, high) in ((n, tyre.load_range), (p, tyre.pressure_range)):
                    outside[rows] |= (value < low * (1 - 1e-9)) | (value > high * (1 + 1e-9))
        if z is not None:
            away = self._relative(wheels, z, nominal_loads, refused, linear=linear)
            for k, values in enumerate(found):
                for column, name in enumerate(STIFFNESSES):
                    values[name] *= 1 + share * away[:, 2 * k + column]
        for values, (load, _) in zip(found, conditions, strict=True):
            values["relaxation_length"] = values["cornering_stiffness"] / values["lateral_stiffness"]
            values |= parameters_of_effects(values, load=load)
        return found, outside

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
        relative[~np.isfinite(relative)] = 0.0  # of a tyre that holds no lateral stiffness
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


def _mark(found: TyreSource, load: Array, pressure: Array, rows: NDArray[np.intp], refused: Refused) -> None:
    """Mark the items whose load (N) or pressure (Pa) the tyre refuses, with its own message for the first."""
    rows = rows[~refused.mask[rows]]
    if not rows.size or not _message(found, load[rows], pressure[rows]):
        return
    bad, said = np.zeros_like(refused.mask), ""
    for row in rows:
        message = _message(found, load[row : row + 1], pressure[row : row + 1])
        bad[row], said = bool(message), said or message
    refused.add(NO_TYRE, bad, said)


def _message(found: TyreSource, load: Array, pressure: Array) -> str:
    """What the tyre says against the corners of these conditions; empty where all are possible."""
    if pressure.max() > MOST_BAR * PASCAL_PER_BAR:
        bar = pressure.max() / PASCAL_PER_BAR
        return f"pressure_bar = {bar:g} must be a number above 0 and up to {MOST_BAR:g} bar"
    for corner in {(a, b) for a in (load.min(), load.max()) for b in (pressure.min(), pressure.max())}:
        try:
            found.at(load=corner[0], pressure=corner[1])
        except InputError as error:
            return str(error)
    return ""


def _one_by_one(tyre: TyreSource, name: str, names: Sequence[str], load: Array, pressure: Array) -> Array | float:
    """What a tyre says of one property condition by condition, if it is wanted and the tyre cannot tell it at once."""
    if name not in names:
        return math.nan
    asked, at = np.unique(np.column_stack([load, pressure]), axis=0, return_inverse=True)
    said = [getattr(tyre.at(load=one[0], pressure=one[1]), name) for one in asked]
    return np.array([math.nan if value is None else value for value in said])[at.ravel()]


def said_of_stiffness(warnings: Sequence[str], relative_cornering_stiffness_sd: float) -> tuple[str, ...]:
    """``warnings`` of a model file with what a sweep assumes of C_Fy in place of the default.

    ``relative_cornering_stiffness_sd`` is a ratio to the stiffness.
    """
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
