"""Cornering stiffness, lateral stiffness and relaxation length of a measured tyre over load and pressure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tyre.arrays import Array
from tyre.errors import InputError
from tyre.magic_formula import CORNERING, LATERAL
from tyre.map_files import find_table, read_table, write_table
from tyre.properties import JointProperties, Origin, TyreProperties, TyreSource, stated_range, stiffness_note
from tyre.tables import MeasuredTable, common_lateral_stiffness
from tyre.trend import (
    StiffnessCovariance,
    Trend,
    fit_law,
    grid_weights,
    joint_covariance,
    predicted_column,
    stiffness_covariance,
)
from tyre.units import PASCAL_PER_BAR

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class TyreMap(TyreSource):
    """A measured tyre on one surface, evaluated at any load and pressure.

    The measured conditions are returned as they stand. Between them the value is a smooth trend plus the bilinearly
    interpolated difference of the measured values from it; beyond them the difference fades out over one interval of
    the grid, and the result is marked extrapolated. The trend of C_Fy is the MF6.1 form, that of K_y is linear in load
    and pressure (so inside the grid K_y is simply bilinear in the measured values).

    The covariance has three parts: the measured standard deviations, carried by the same weights (errors of a lateral
    stiffness shared between conditions stay shared); the misfit of the trend, which measures how much a tyre departs
    from a smooth law between neighbouring conditions, times the interpolation error of `ConditionsGrid`; and the
    uncertainty of the trend itself, which matters outside. The last two vanish at measured conditions.

    Attributes
    ----------
    measured : MeasuredTable
        The measured conditions.
    relative_cornering_stiffness_sd : float
        Assumed sd(C_Fy) / C_Fy for tables that state none (the paper's do not), mostly common to all conditions; as
        much of K_y if the table states none of it either. It adds to the uncertainty of the relaxation length.

    Raises
    ------
    InputError
        The assumption is negative, not finite, or given although the table states its own.
    """

    measured: MeasuredTable
    relative_cornering_stiffness_sd: float = 0.0

    def __post_init__(self) -> None:
        table, assumed = self.measured, self.relative_cornering_stiffness_sd
        if not (np.isfinite(assumed) and assumed >= 0):
            raise InputError(f"relative_cornering_stiffness_sd is {assumed:g}; it must be finite and >= 0 (0.02: 2 %)")
        if assumed > 0 and table.cornering_stiffness_sd is not None and table.lateral_stiffness_sd is not None:
            raise InputError(f"{table.label} states its own standard deviations; leave the assumption out")
        same = ("tyre", "surface", "surface_stated", "label", "description", "source", "notes", "synthetic", "width")
        vars(self).update({name: getattr(table, name) for name in (*same, "loads", "pressures")})
        vars(self)["load_range"] = float(table.load.min()), float(table.load.max())
        vars(self)["pressure_range"] = float(table.pressure.min()), float(table.pressure.max())
        vars(self)["range_kind"] = f"at which {table.label} was measured"
        _ = self._covariance  # refuses a table that contradicts itself

    def __repr__(self) -> str:
        table, synthetic = self.measured, ", synthetic" if self.synthetic else ""
        c, k = np.radians(table.cornering_stiffness), table.lateral_stiffness / 1e3
        length = table.relaxation_length * 1e3
        return (
            f"<TyreMap of {self.label}{synthetic}: {table.load.size} conditions, {stated_range(self)}\n"
            f" cornering stiffness {c.min():.1f}-{c.max():.1f} N/deg, lateral stiffness {k.min():.1f}-{k.max():.1f} "
            f"N/mm, relaxation length {length.min():.0f}-{length.max():.0f} mm>"
        )

    @classmethod
    def load(
        cls, tyre: str, *, surface: str = "flat", relative_cornering_stiffness_sd: float = 0.0,
        folder: Traversable | None = None,
    ) -> "TyreMap":  # fmt: skip
        """Return a tyre of the packaged data, or of another folder of tyre tables.

        Parameters
        ----------
        tyre, surface : str
            Name of the tyre; ``flat`` or ``drum``.
        relative_cornering_stiffness_sd : float
            As that of the class.
        folder : path, optional
            Default: the packaged tyres.

        Raises
        ------
        InputError
            No such tyre, or not measured on this surface; the message lists what there is.
        """
        return cls(find_table(tyre, surface=surface, folder=folder), relative_cornering_stiffness_sd)

    @classmethod
    def from_file(cls, path: str | Path, *, relative_cornering_stiffness_sd: float = 0.0) -> "TyreMap":
        """Return the tyre of one table (``.csv`` with its ``.toml`` beside it, see `tyre.map_files`).

        Parameters
        ----------
        path : path
            Of either file.
        relative_cornering_stiffness_sd : float
            As that of the class.
        """
        table = read_table(path)
        common_lateral_stiffness([table])
        return cls(table, relative_cornering_stiffness_sd)

    def to_file(self, path: str | Path) -> None:
        """Write the measured table and its sidecar; the assumption on C_Fy is not part of it.

        Parameters
        ----------
        path : path
            Of the .csv; the .toml comes beside it.
        """
        write_table(self.measured, path)

    def assuming(self, relative_sd: float, /) -> "TyreMap":
        """Return the same tyre with sd / value (0.03 is 3 %) assumed of stiffnesses of which its table states none."""
        if self.measured.cornering_stiffness_sd is not None and self.measured.lateral_stiffness_sd is not None:
            return self
        return replace(self, relative_cornering_stiffness_sd=relative_sd)

    @cached_property
    def cornering_stiffness_trend(self) -> Trend:
        """The MF6.1 form fitted to the measured C_Fy: parameters, residuals and misfit in N/rad."""
        return fit_law(CORNERING, self.measured.load, self.measured.pressure, self.measured.cornering_stiffness)

    @cached_property
    def lateral_stiffness_trend(self) -> Trend:
        """The linear trend of the measured K_y: parameters, residuals and misfit in N/m."""
        return fit_law(LATERAL, self.measured.load, self.measured.pressure, self.measured.lateral_stiffness)

    @cached_property
    def _covariance(self) -> StiffnessCovariance:
        return stiffness_covariance(self.measured, assumed=self.relative_cornering_stiffness_sd)

    @property
    def table(self) -> "pd.DataFrame":
        """The measured conditions with standard deviations in the units of the field, one row each."""
        import pandas as pd

        table = self.measured
        c, k, length = table.cornering_stiffness, table.lateral_stiffness, table.relaxation_length
        cornering, both, lateral = (np.diag(block) for block in self._covariance[:3])
        relative = np.sqrt(np.maximum(cornering / c**2 + lateral / k**2 - 2 * both / (c * k), 0.0))
        columns = {
            "tyre": table.tyre,
            "surface": table.surface,
            "load_N": table.load,
            "pressure_bar": table.pressure / PASCAL_PER_BAR,
            "cornering_stiffness_N_per_deg": np.radians(c),
            "cornering_stiffness_sd_N_per_deg": np.radians(np.sqrt(cornering)),
            "lateral_stiffness_N_per_mm": k / 1e3,
            "lateral_stiffness_sd_N_per_mm": np.sqrt(lateral) / 1e3,
            "relaxation_length_mm": length * 1e3,
            "relaxation_length_sd_mm": relative * length * 1e3,
        }
        if table.pneumatic_trail is not None:
            columns["pneumatic_trail_mm"] = table.pneumatic_trail.value * 1e3
            columns["pneumatic_trail_sd_mm"] = table.pneumatic_trail.sd * 1e3
        return pd.DataFrame(columns)

    def jointly(self, conditions: Sequence[tuple[float, float]]) -> JointProperties:
        """Return the properties at several conditions with their covariance and degrees of freedom.

        Parameters
        ----------
        conditions : sequence of (load, pressure)
            N and Pa, n of them.

        Returns
        -------
        JointProperties
            At measured conditions the covariance is the table's own; what its conditions have in common (calibration,
            shared pull tests) the asked ones have in common too.

        Raises
        ------
        InputError
            A load or pressure that is not finite and positive, one the table cannot tell anything about (another
            pressure than the only one measured, say), or an extrapolation to C_Fy <= 0 or K_y <= 0.
        """
        table = self.measured
        load, pressure = self._columns(conditions)
        cornering = self.cornering_stiffness_trend.at(load, pressure)
        lateral = self.lateral_stiffness_trend.at(load, pressure)
        for name, unit, values in (("cornering", "N/rad", cornering.value), ("lateral", "N/m", lateral.value)):
            for bad in np.flatnonzero(~(np.isfinite(values) & (values > 0))):
                raise InputError(
                    f"{table.label}: extrapolation to {load[bad]:g} N, {pressure[bad] / PASCAL_PER_BAR:g} bar gives a "
                    f"{name} stiffness of {values[bad]:g} {unit}, which is not physical; stay nearer to the measured "
                    f"{stated_range(self)}."
                )
        c_dof, k_dof = table.cornering_stiffness_dof, table.lateral_stiffness_dof
        dof = None if c_dof is None or k_dof is None else (c_dof, k_dof)
        joint = joint_covariance(cornering, lateral, self._covariance, dof)
        trails = None
        if table.pneumatic_trail is not None and table.pneumatic_trail.known.any():
            trails = predicted_column(table, table.pneumatic_trail, load, pressure)
        routes = {
            name: predicted_column(table, column, load, pressure).estimates
            for name, column in table.direct_relaxation_length.items()
        }
        properties = []
        for row in range(load.size):
            origin, here = self.origin(load=load[row], pressure=pressure[row]), trails and trails.estimates[row]
            covariance, freedom = joint.of(row)
            properties.append(
                TyreProperties(
                    tyre=table.tyre, surface=table.surface, load=float(load[row]), pressure=float(pressure[row]),
                    cornering_stiffness=float(cornering.value[row]), lateral_stiffness=float(lateral.value[row]),
                    relaxation_length=float(cornering.value[row] / lateral.value[row]), covariance=covariance,
                    origin=origin, notes=self._notes(origin), degrees_of_freedom=freedom, synthetic=table.synthetic,
                    lateral_stiffness_origin=table.lateral_stiffness_origin,
                    cornering_stiffness_sd_stated=table.cornering_stiffness_sd is not None,
                    lateral_stiffness_sd_stated=table.lateral_stiffness_sd is not None,
                    surface_stated=table.surface_stated,
                    pneumatic_trail=here.value if here else None, pneumatic_trail_sd=here.sd if here else None,
                    direct_relaxation_lengths={
                        name: length for name, lengths in routes.items() if (length := lengths[row]) is not None
                    },
                )
            )  # fmt: skip
        return JointProperties(tuple(properties), joint, trails)

    def origin(self, *, load: float, pressure: float) -> Origin:
        """Tell if a ``load`` (N) and ``pressure`` (Pa) were measured, lie between measured ones, or outside."""
        table = self.measured
        if np.any(np.isclose(table.load, load, rtol=1e-9) & np.isclose(table.pressure, pressure, rtol=1e-9)):
            return "measured"
        return super().origin(load=load, pressure=pressure)

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """C_Fy, K_y and relaxation length at many conditions, as ``at`` gives them for one; nothing is checked."""
        # a sum over each row: the same to the last bit however many conditions are asked together
        weights = grid_weights(self.measured.load, self.measured.pressure, load, pressure)
        cornering, lateral = (
            trend.evaluate(load, pressure)[0] + (weights * trend.residuals).sum(1)
            for trend in (self.cornering_stiffness_trend, self.lateral_stiffness_trend)
        )
        return {
            "cornering_stiffness": cornering,
            "lateral_stiffness": lateral,
            "relaxation_length": cornering / lateral,
        }

    def _notes(self, origin: Origin) -> tuple[str, ...]:
        """List the assumptions, borrowed numbers, and the misfit of smooth laws, behind a value of this origin."""
        table, cornering, lateral = self.measured, self.cornering_stiffness_trend, self.lateral_stiffness_trend
        notes = ["synthetic: no rig measured this tyre"] * table.synthetic + list(table.notes)
        if table.cornering_stiffness_sd is None:
            notes.append(stiffness_note(self.relative_cornering_stiffness_sd))
        if table.lateral_stiffness_sd is None:
            notes.append(stiffness_note(self.relative_cornering_stiffness_sd, "lateral"))
        if origin == "measured":
            return tuple(notes)
        way, law = "between measured conditions", "bilinear in the measured values"
        if origin == "extrapolated":
            way, law = f"extrapolated beyond the measured {stated_range(self)}", "linear trend in load and pressure"
        notes.append(
            f"cornering stiffness {way}: MF6.1 form through the measured values, "
            f"misfit {np.radians(cornering.misfit):.1f} N/deg"
        )
        jumps, stated = "", float(np.sqrt(np.mean(np.diag(self._covariance.lateral))))
        if lateral.misfit > stated > 0:
            jumps = f", more than its measured {stated / 1e3:.1f} N/mm: it jumps, and no smooth law describes it"
        notes.append(f"lateral stiffness {way}: {law}, misfit of a linear law {lateral.misfit / 1e3:.1f} N/mm{jumps}")
        for name, trend in (("cornering", cornering), ("lateral", lateral)):
            if trend.degrees_of_freedom < 1:
                notes.append(f"too few conditions to estimate the misfit of the {name} stiffness; it counts as zero")
        return tuple(notes)

    def _refuse(self, load: float, pressure: float) -> None:
        table, law = self.measured, self.cornering_stiffness_trend.parameters
        for name, value, unit, lines in (
            ("load", load, "N", table.loads),
            ("pressure", pressure, "Pa", table.pressures),
        ):
            if lines.size == 1 and not np.isclose(value, lines[0], rtol=1e-9):
                raise InputError(
                    f"{table.label}: {name} is {value:g} {unit}, but it was measured at {lines[0]:g} {unit} "
                    f"only, which says nothing about another {name}; ask for that one or measure more."
                )
        for name in ("PPY1", "PPY2"):
            if 1 + law.get(name, 0.0) * (pressure / law["NOMPRES"] - 1) <= 0:
                raise InputError(
                    f"{table.label}: at {pressure / PASCAL_PER_BAR:g} bar the fitted 1 + {name} dpi is not positive, "
                    f"so the cornering stiffness is not physical; stay nearer to the measured {stated_range(self)}."
                )
