"""What the tyres of a model file give to its effects at any loads and pressures, for many of them at once."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.files.tyre_values import values_of_tyres
from bicycle.files.wheel_tyres import EXTRAPOLATE, MOST_BAR, TYRE_KEYS, wheel_sources
from bicycle.model import Model
from bicycle.parameter_key import WHEELS, ParameterKey
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.properties import parameters_of_effects
from tyre.tyre_source import TyreSource, out_of_reach

PressureBar = Mapping[str, Any]
LoadN = Mapping[str, Any]
EDGE = 1e-9  # of a condition: so far outside is on the edge


@dataclass(frozen=True)
class TyreConditions:
    """The tyres of a model file.

    Attributes
    ----------
    sources : mapping of str to TyreSource
        By wheel.
    pressure_bar, load_N : dict of str to float
        By wheel, of the model as it stands.
    given : dict of str to str
        Parameter of an effect that the tyres give -> property of a tyre.
    extrapolate : bool
        Whether conditions out of reach of the tyre are taken.
    """

    sources: Mapping[str, TyreSource]
    pressure_bar: dict[str, float]
    load_N: dict[str, float]
    given: dict[str, str]
    extrapolate: bool

    @classmethod
    def of(cls, content: Mapping[str, Any], model: Model) -> "TyreConditions | None":
        """Those of the ``content`` of a model file with absolute paths, and its ``model``; None where it names none."""
        tables = content.get("effects", {})
        law = next((table for table in tables.values() if "tyre" in table), None)
        if law is None:
            return None
        tyre, surface, bar = (
            {wheel: value[wheel] if isinstance(value, Mapping) else value for wheel in WHEELS}
            for value in map(law.get, TYRE_KEYS)
        )
        loads = dict(zip(WHEELS, model.bicycle.static_loads, strict=True))
        pressures = {wheel: float(value) for wheel, value in bar.items()}
        extrapolate = bool(law.get(EXTRAPOLATE, False))
        return cls(wheel_sources(tyre, surface), pressures, loads, values_of_tyres(tables), extrapolate)

    def values(self, load_N: LoadN, pressure_bar: PressureBar) -> dict[str, Array]:
        """Parameters of effects that the tyres give, by name, (m,) each.

        Parameters
        ----------
        load_N, pressure_bar : mapping of str to array_like, shape (m,)
            By wheel, N and bar.
        """
        found: dict[str, Array] = {}
        for wheel in WHEELS:
            wanted = {key: name for key, name in self.given.items() if ParameterKey.parse(key).wheel == wheel}
            load, pressure = np.broadcast_arrays(
                np.atleast_1d(np.asarray(load_N[wheel], float)),
                np.atleast_1d(np.asarray(pressure_bar[wheel], float)) * PASCAL_PER_BAR,
            )
            held = dict(self.sources[wheel].linear(load=load, pressure=pressure)) if wanted else {}
            held = parameters_of_effects(held, load=load) if wanted else held
            for key, name in wanted.items():
                if name not in held:
                    held[name] = self._one_by_one(wheel, name, load, pressure)
                found[key] = np.asarray(held[name], float)
        return found

    def _one_by_one(self, wheel: str, name: str, load: Array, pressure: Array) -> Array:
        asked, at = np.unique(np.column_stack([load, pressure]), axis=0, return_inverse=True)
        found = [getattr(self.sources[wheel].at(load=n, pressure=p), name) for n, p in asked]
        return np.array(found, float)[at.ravel()]

    def check(self, load_N: LoadN, pressure_bar: PressureBar) -> None:
        """Refuse conditions that a tyre does not take.

        Parameters
        ----------
        load_N, pressure_bar : mapping of str to array_like, shape (m,)
            By wheel, N and bar.

        Raises
        ------
        InputError
            A condition that is impossible, or out of reach of the tyre unless the file allows to extrapolate.
        """
        for wheel, source in self.sources.items():
            loads, bars = np.atleast_1d(load_N[wheel]), np.atleast_1d(pressure_bar[wheel])
            for load in {float(loads.min()), float(loads.max())}:
                for bar in {float(bars.min()), float(bars.max())}:
                    if not (0 < bar <= MOST_BAR and load > 0):
                        raise InputError(
                            f"{wheel} wheel at {load:g} N, {bar:g} bar: give loads above 0 N, and pressures above 0 "
                            f"and up to {MOST_BAR:g} bar"
                        )
                    beyond = out_of_reach(source, load=load, pressure=bar * PASCAL_PER_BAR)
                    if beyond and not self.extrapolate:
                        raise InputError(
                            f"{wheel} wheel: {beyond}; take a range nearer to the tests, or, if a guess will do, "
                            f"--{EXTRAPOLATE}"
                        )
                    source.at(load=load, pressure=bar * PASCAL_PER_BAR)

    def inside(self, load_N: LoadN, pressure_bar: PressureBar) -> NDArray[np.bool_]:
        """Whether both tyres are measured, or interpolated, at conditions.

        Parameters
        ----------
        load_N, pressure_bar : mapping of str to array_like, shape (m,)
            By wheel, N and bar.

        Returns
        -------
        ndarray of bool, shape (m,)
        """
        good: Any = True
        for wheel, source in self.sources.items():
            pressure = np.asarray(pressure_bar[wheel], float) * PASCAL_PER_BAR
            for value, (low, high) in (
                (np.asarray(load_N[wheel], float), source.load_range), (pressure, source.pressure_range),
            ):  # fmt: skip
                good = good & (value >= low * (1 - EDGE)) & (value <= high * (1 + EDGE))
        return np.atleast_1d(np.asarray(good, bool))
