"""Tyres that a formula describes: values at any load and pressure with assumed uncertainty."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.measured.plausible import negative_quantities, table_doubts
from tyre.measured.properties import (
    MEASURED_BESIDE,
    QUANTITIES,
    JointCovariance,
    JointProperties,
    TyreProperties,
    TyreSource,
    stated_range,
    stiffness_names,
    stiffness_note,
)


@dataclass(frozen=True, eq=False)
class FormulaTyre(TyreSource):
    """A tyre whose coefficients hold its linear properties over load and pressure."""

    relative_stiffness_sd: float = field(default=0.0, kw_only=True)  # assumed of C_alpha and of K_y, over the value

    def __post_init__(self) -> None:
        sd = self.relative_stiffness_sd
        if not (np.isfinite(sd) and sd >= 0):
            raise InputError(f"relative_stiffness_sd is {sd:g}; it must be finite and >= 0 (0.02 means 2 %)")

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """Notes on unusual values at the conditions worth looking at; see :mod:`tyre.measured.plausible`."""
        load, pressure = (
            grid.ravel() for grid in np.meshgrid(self.loads, self.pressures if self.pressures.size else np.nan)
        )
        with np.errstate(all="ignore"):
            values = self.linear(load=load, pressure=pressure)
        positive = {name: np.where(np.asarray(value) > 0, value, np.nan) for name, value in values.items()}
        return (*table_doubts(load, positive, where=self.label), *negative_quantities(load, values))

    @abstractmethod
    def lateral_force(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Lateral force (N) of the full curve, > 0 to the right for a slip angle (rad) > 0; refused without one."""

    @abstractmethod
    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Aligning moment (N m) of the full curve, > 0 turns the wheel to the right; refused without one."""

    def assuming(self, relative_sd: float, /) -> Self:
        """Return the same tyre with an assumed uncertainty."""
        return replace(self, relative_stiffness_sd=relative_sd)

    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at several conditions with their covariance."""
        load, pressure = self._columns(conditions)
        with np.errstate(all="ignore"):  # refused below
            values = self.linear(load=load, pressure=pressure)
        for name, unit in (("cornering_stiffness", "N/rad"), ("lateral_stiffness", "N/m"), ("relaxation_length", "m")):
            for n, value in enumerate(values.get(name, ())):
                if not 0 < value < np.inf:
                    raise InputError(
                        f"{self.label}: at {load[n]:g} N and {pressure[n] / PASCAL_PER_BAR:g} bar the coefficients "
                        f"give a {name.replace('_', ' ')} of {value:g} {unit}, which is not physical; stay nearer to "
                        f"the {stated_range(self)} {self.range_kind}"
                    )
        columns = [values.get(name, np.full(load.size, np.nan)) for name in QUANTITIES]
        c, k, length = (self.relative_stiffness_sd * column for column in columns)
        nothing = np.zeros(load.size)
        factor = np.stack([np.stack([c, nothing, length], 1).ravel(), np.stack([nothing, k, -length], 1).ravel()], 1)
        covariance = factor @ factor.T
        lateral = "the same is taken for its lateral stiffness"
        if "lateral_stiffness" not in values:
            lateral = "it holds no lateral stiffness"
        notes = (*self.notes, stiffness_note(self.relative_stiffness_sd), lateral)
        outside = f"extrapolated beyond the {stated_range(self)} {self.range_kind}"
        properties = []
        for n in range(load.size):
            origin = self.origin(load=load[n], pressure=pressure[n])
            fields: dict[str, Any] = {name: float(values[name][n]) for name in MEASURED_BESIDE if name in values}
            fields |= {name: float(column[n]) for name, column in zip(QUANTITIES, columns, strict=True)}
            properties.append(
                TyreProperties(
                    tyre=self.tyre,
                    surface=self.surface,
                    load=float(load[n]),
                    pressure=float(pressure[n]),
                    covariance=covariance[3 * n : 3 * n + 3, 3 * n : 3 * n + 3].copy(),
                    origin=origin,
                    notes=(*notes, outside) if origin == "extrapolated" else notes,
                    synthetic=self.synthetic,
                    cornering_stiffness_sd_stated=False,
                    lateral_stiffness_sd_stated=False,
                    unstated_sd_assumed=self.relative_stiffness_sd > 0.0,
                    surface_stated=self.surface_stated,
                    **fields,
                )
            )
        return JointProperties(tuple(properties), JointCovariance(stiffness_names(range(load.size)), covariance))
