"""A tyre fitted by Pacejka-89 sets at several pressures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.magic_formula.formula_tyre import FormulaTyre
from tyre.magic_formula.pacejka89 import Pacejka89

LOADS = (200.0, 300.0, 400.0, 600.0, 800.0, 1000.0)
"""Wheel loads of bicycles at which a fit is looked at, N, as far as it goes."""


@dataclass(frozen=True, eq=False)
class Pacejka89Tyre(FormulaTyre):
    """A tyre with one fit per pressure (a :class:`tyre.tyre_source.TyreSource`); between them values are linear.

    Forces and moments are refused beyond the fitted loads and pressures; ``at`` goes on with the formula over load and
    linearly over pressure, and marks what it gives as extrapolated.

    Attributes
    ----------
    tyre, surface : str
        Name; ``flat`` or ``drum``.
    sets : tuple of Pacejka89
        By rising pressure.
    source : str
        Where the coefficients come from.
    notes : tuple of str
        What a reader of any value must be told.
    relative_stiffness_sd : float
        Assumed sd(C_Fy) / C_Fy and sd(K_y) / K_y, as the sets state none.
    """

    tyre: str
    surface: str
    sets: tuple[Pacejka89, ...]
    source: str
    notes: tuple[str, ...] = ()
    description = "Pacejka-89 coefficients"
    width = None

    def side_force(self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0) -> Array:
        """Side force.

        Parameters
        ----------
        slip_angle, load, camber : array_like
            rad, N, rad, broadcast.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            N, > 0 to the right.
        """
        return self._at(pressure, lambda fit: fit.side_force(slip_angle=slip_angle, load=load, camber=camber))

    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Aligning moment.

        Parameters
        ----------
        slip_angle, load, camber : array_like
            rad, N, rad, broadcast.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            N m, negative for positive slip at a positive trail.
        """
        return self._at(pressure, lambda fit: fit.aligning_moment(slip_angle=slip_angle, load=load, camber=camber))

    def cornering_stiffness(self, *, load: ArrayLike, pressure: float) -> Array:
        """Slope of the side force at zero slip.

        Parameters
        ----------
        load : array_like
            N.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            N/rad.
        """
        return self._at(pressure, lambda fit: fit.cornering_stiffness(load=load))

    def aligning_stiffness(self, *, load: ArrayLike, pressure: float) -> Array:
        """C_M = -dMz/d(slip) at zero slip.

        Parameters
        ----------
        load : array_like
            N.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            N m/rad.
        """
        return self._at(pressure, lambda fit: fit.aligning_stiffness(load=load))

    def pneumatic_trail(self, *, load: ArrayLike, pressure: float) -> Array:
        """C_M / C_Fy.

        Parameters
        ----------
        load : array_like
            N.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            m.
        """
        return self.aligning_stiffness(load=load, pressure=pressure) / self.cornering_stiffness(
            load=load, pressure=pressure
        )

    def camber_stiffness(self, *, load: ArrayLike, pressure: float) -> Array:
        """Slope of the side force over camber.

        Parameters
        ----------
        load : array_like
            N.
        pressure : float
            Pa.

        Returns
        -------
        ndarray
            N/rad.
        """
        return self._at(pressure, lambda fit: fit.camber_stiffness(load=load))

    @property
    def label(self) -> str:
        """``tyre on surface``, for messages."""
        return f"{self.tyre} on {self.surface}"

    @property
    def load_range(self) -> tuple[float, float]:
        """Loads for which the authors use the sets, N."""
        return 0.0, min(fit.load_max for fit in self.sets)

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Lowest and highest fitted pressure, Pa."""
        return self.sets[0].pressure, self.sets[-1].pressure

    @property
    def loads(self) -> Array:
        """Wheel loads of bicycles within the range, N."""
        return np.array([load for load in LOADS if load <= self.load_range[1]] or [self.load_range[1]])

    @property
    def pressures(self) -> Array:
        """Fitted pressures, Pa."""
        return np.array([fit.pressure for fit in self.sets])

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return what the sets hold at many conditions, linear in pressure; nothing is checked.

        C_M rather than the trail is linear, and C_Fy over K_y is the relaxation length.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            By the name of the field of `TyreProperties`, SI units.
        """
        every = [fit.linear(load=load) for fit in self.sets]
        for held in every:
            if "pneumatic_trail" in held:
                held["pneumatic_trail"] = held["pneumatic_trail"] * held["cornering_stiffness"]
        pressures = self.pressures
        upper = np.clip(np.searchsorted(pressures, pressure), 1, max(len(every) - 1, 1))
        found = {}
        for name in set.intersection(*map(set, every)):
            values = np.array([held[name] for held in every])
            if len(every) == 1:
                found[name] = values[0]
                continue
            share = (pressure - pressures[upper - 1]) / (pressures[upper] - pressures[upper - 1])
            columns = np.arange(len(load))
            found[name] = (1 - share) * values[upper - 1, columns] + share * values[upper, columns]
        if "pneumatic_trail" in found:
            found["pneumatic_trail"] = found["pneumatic_trail"] / found["cornering_stiffness"]
        if "lateral_stiffness" in found:
            found["relaxation_length"] = found["cornering_stiffness"] / found["lateral_stiffness"]
        return found

    @property
    def _described(self) -> tuple[str, str, str, tuple[str, ...]]:
        return self.tyre, self.surface, self.source, self.notes

    def _check(self, load: float, pressure: float) -> None:
        super()._check(load, pressure)
        low, high = self.pressure_range
        if low == high and not np.isclose(pressure, low, rtol=1e-9):
            raise InputError(
                f"{self.label}: pressure is {pressure / PASCAL_PER_BAR:g} bar, but it was fitted at "
                f"{low / PASCAL_PER_BAR:g} bar only, which says nothing about another pressure"
            )

    def _at(self, pressure: float, evaluate: Callable[[Pacejka89], Array]) -> Array:
        pressures = self.pressures
        if not pressures[0] <= pressure <= pressures[-1]:
            low, high = (end / PASCAL_PER_BAR for end in self.pressure_range)
            raise InputError(
                f"{self.tyre}: pressure {pressure / PASCAL_PER_BAR:g} bar is outside of the fitted {low:g} to "
                f"{high:g} bar"
            )
        upper = int(np.searchsorted(pressures, pressure))
        if pressures[upper] == pressure:
            return evaluate(self.sets[upper])
        share = (pressure - pressures[upper - 1]) / (pressures[upper] - pressures[upper - 1])
        return (1.0 - share) * evaluate(self.sets[upper - 1]) + share * evaluate(self.sets[upper])
