"""A tyre given by formulas whose source states no uncertainty: what .tir files and Pacejka-89 coefficients share."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from tyre.bands import table_doubts
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.joint_properties import JointCovariance, JointProperties
from tyre.properties import Origin, TyreProperties, stiffness_note
from tyre.tyre_source import stated_range


@dataclass(frozen=True, eq=False)
class FormulaTyre(ABC):
    """A tyre whose coefficients hold its linear properties over load and pressure (a `TyreSource`).

    ``relative_stiffness_sd`` is the assumed sd of C_Fy over C_Fy and that of K_y over K_y, independent of each other.
    One set of coefficients describes all conditions, so each error is common to all of them.
    """

    relative_stiffness_sd: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.relative_stiffness_sd) and self.relative_stiffness_sd >= 0):
            raise InputError(
                f"relative_stiffness_sd is {self.relative_stiffness_sd:g}; it must be finite and >= 0 (0.02 means 2 %)"
            )

    @abstractmethod
    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Values by name of a field of `TyreProperties` at ``load`` (N), ``pressure`` (Pa), (n,), where known."""

    @property
    @abstractmethod
    def label(self) -> str:
        """``tyre on surface``, for messages."""

    @property
    @abstractmethod
    def load_range(self) -> tuple[float, float]:
        """Loads for which the formula holds, N."""

    @property
    @abstractmethod
    def pressure_range(self) -> tuple[float, float]:
        """Pressures for which the formula holds, Pa."""

    @property
    def range_kind(self) -> str:
        """What the ranges are, in words."""
        return f"for which {self.label} holds"

    @property
    def synthetic(self) -> bool:
        """Whether a note says that no rig measured the tyre."""
        return any("synthetic" in note.lower() for note in self._described[3])

    @property
    @abstractmethod
    def _described(self) -> tuple[str, str, str, tuple[str, ...]]:
        """Tyre, surface, source, notes."""

    @property
    @abstractmethod
    def loads(self) -> Array:
        """Conditions worth looking at, N, ascending."""

    @property
    @abstractmethod
    def pressures(self) -> Array:
        """Conditions worth looking at, Pa, ascending."""

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What is unusual of its values at these conditions; see :func:`tyre.bands.table_doubts`."""
        load, pressure = (grid.ravel() for grid in np.meshgrid(self.loads, self.pressures))
        with np.errstate(all="ignore"):
            values = self.linear(load=load, pressure=pressure)
        positive = {name: np.where(np.asarray(value) > 0, value, np.nan) for name, value in values.items()}
        return table_doubts(load, positive, where=self.label)

    def assuming(self, relative_sd: float, /) -> Self:
        """Return the same tyre with an assumed uncertainty.

        Parameters
        ----------
        relative_sd : float
            sd(C_Fy) / C_Fy and sd(K_y) / K_y, dimensionless.
        """
        return replace(self, relative_stiffness_sd=relative_sd)

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Say whether the formula is stated to hold at a condition: a fit is ``interpolated`` there.

        Parameters
        ----------
        load, pressure : float
            N and Pa.
        """
        for value, (low, high) in ((load, self.load_range), (pressure, self.pressure_range)):
            if not low * (1 - 1e-9) <= value <= high * (1 + 1e-9):
                return "extrapolated"
        return "interpolated"

    def at(self, *, load: float, pressure: float) -> TyreProperties:
        """Return the properties at one condition; see `joint`.

        Parameters
        ----------
        load, pressure : float
            N and Pa.
        """
        return self.joint([(load, pressure)])[0][0]

    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at several conditions with their covariance; see `joint`.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa.
        """
        properties, covariance = self.joint(conditions)
        return JointProperties(properties, JointCovariance(covariance, None))

    def joint(self, conditions: Sequence[tuple[float, float]]) -> tuple[tuple[TyreProperties, ...], Array]:
        """Return the properties at several conditions and the covariance of all of them together.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa, n of them.

        Returns
        -------
        properties : tuple of TyreProperties
            In the order asked for.
        covariance : ndarray, shape (3 n, 3 n)
            Of (C_Fy, K_y, relaxation length) of the first condition, then of the second, and so on; SI units. NaN where
            the formula holds no lateral stiffness.

        Raises
        ------
        InputError
            A load or pressure that is not finite and positive, one of which the formula says nothing, or an
            extrapolation to a stiffness that is not positive.
        """
        if not conditions:
            raise InputError(f"{self.label}: no condition asked for; give at least one (load N, pressure Pa).")
        for one_load, one_pressure in conditions:
            self._check(float(one_load), float(one_pressure))
        load, pressure = (np.array([float(condition[k]) for condition in conditions]) for k in (0, 1))
        with np.errstate(all="ignore"):  # refused below
            values = self.linear(load=load, pressure=pressure)
        self._check_positive(values, load, pressure)
        unknown = np.full(load.size, np.nan)
        columns = [values.get(name, unknown) for name in ("cornering_stiffness", "lateral_stiffness")]
        columns.append(values.get("relaxation_length", unknown))
        c, k, length = (self.relative_stiffness_sd * column for column in columns)
        nothing = np.zeros(load.size)
        factor = np.stack([np.stack([c, nothing, length], 1).ravel(), np.stack([nothing, k, -length], 1).ravel()], 1)
        covariance = factor @ factor.T
        tyre, surface, _, notes = self._described

        def held(name: str, n: int) -> float | None:
            return float(values[name][n]) if name in values else None

        origins = [self.origin(load=condition[0], pressure=condition[1]) for condition in conditions]
        properties = tuple(
            TyreProperties(
                tyre=tyre, surface=surface, load=float(load[n]), pressure=float(pressure[n]),
                cornering_stiffness=float(columns[0][n]), lateral_stiffness=float(columns[1][n]),
                relaxation_length=float(columns[2][n]),
                covariance=covariance[3 * n : 3 * n + 3, 3 * n : 3 * n + 3].copy(),
                origin=origins[n],
                notes=self._notes(notes, origins[n], lateral="lateral_stiffness" in values), synthetic=self.synthetic,
                cornering_stiffness_sd_stated=False, lateral_stiffness_sd_stated=False,
                pneumatic_trail=held("pneumatic_trail", n), camber_stiffness=held("camber_stiffness", n),
                twisting_stiffness=held("twisting_stiffness", n),
                overturning_stiffness=held("overturning_stiffness", n),
            )
            for n in range(load.size)
        )  # fmt: skip
        return properties, covariance

    def _notes(self, notes: tuple[str, ...], origin: Origin, *, lateral: bool) -> tuple[str, ...]:
        said = [*notes, stiffness_note(self.relative_stiffness_sd)]
        said.append("the same is taken for its lateral stiffness" if lateral else "it holds no lateral stiffness")
        if origin == "extrapolated":
            said.append(f"extrapolated beyond the {stated_range(self)} {self.range_kind}")
        return tuple(said)

    def _check(self, load: float, pressure: float) -> None:
        for name, value, unit in (("load", load, "N"), ("pressure", pressure, "Pa")):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{self.label}: {name} is {value:g} {unit}; it must be finite and > 0.")

    def _check_positive(self, values: Mapping[str, Array], load: Array, pressure: Array) -> None:
        for name, unit in (("cornering_stiffness", "N/rad"), ("lateral_stiffness", "N/m"), ("relaxation_length", "m")):
            for n, value in enumerate(values.get(name, ())):
                if not 0 < value < np.inf:
                    raise InputError(
                        f"{self.label}: at {load[n]:g} N and {pressure[n] / PASCAL_PER_BAR:g} bar the coefficients "
                        f"give a {name.replace('_', ' ')} of {value:g} {unit}, which is not physical; stay nearer to "
                        f"the {stated_range(self)} {self.range_kind}"
                    )
