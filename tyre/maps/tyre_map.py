"""Cornering stiffness, lateral stiffness and relaxation length of a measured tyre over load and pressure."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.units import PASCAL_PER_BAR
from tyre.laws import magic_formula as mf61
from tyre.maps.map_files import find_table, read_table, write_table
from tyre.maps.trend import (
    Prediction,
    Trend,
    departs_from_linear_laws,
    fit_law,
    fit_linear_law,
    fit_plane,
    grid_weights,
)
from tyre.measured.properties import (
    Estimate,
    JointCovariance,
    JointProperties,
    Origin,
    TyreProperties,
    TyreSource,
    stated_range,
    stiffness_names,
    stiffness_note,
)
from tyre.measured.tables import MeasuredColumn, MeasuredTable, common_lateral_stiffness

if TYPE_CHECKING:
    import pandas as pd


def predicted_column(
    table: MeasuredTable, column: MeasuredColumn, load: Array, pressure: Array, name: str = ""
) -> tuple[list[Estimate | None], JointCovariance]:
    """Predict a column of a table; unknown at another load or pressure than the only one measured."""
    measured_rows = column.known
    if not measured_rows.any():
        return [None] * load.size, JointCovariance()
    trend = fit_plane(table.load[measured_rows], table.pressure[measured_rows], column.value[measured_rows])
    predictable = np.ones(load.size, dtype=bool)
    for targets, measured in ((load, trend.load), (pressure, trend.pressure)):
        if np.ptp(measured) == 0.0:
            predictable &= np.isclose(targets, measured[0], rtol=1e-9)
    prediction = trend.at(load[predictable], pressure[predictable])
    if not column.stated:
        values = iter(prediction.value.tolist())
        return [
            Estimate(next(values), np.nan) if is_predictable else None for is_predictable in predictable
        ], JointCovariance()
    covariance = prediction.carry @ np.diag(column.sd[measured_rows] ** 2) @ prediction.carry.T + prediction.error
    spread = [
        np.outer(carry, carry) * sd**2 / np.sqrt(dof)
        for carry, sd, dof in zip(prediction.carry.T, column.sd[measured_rows], column.dof[measured_rows], strict=True)
        if np.isfinite(dof)
    ]
    if prediction.error_dof > 0:
        spread.append(prediction.error / np.sqrt(prediction.error_dof))
    joint = JointCovariance(tuple(f"{name}.{row}" for row in np.flatnonzero(predictable)), covariance, tuple(spread))
    values = zip(prediction.value.tolist(), joint.sd.items(), strict=True)
    estimates = iter([Estimate(value, sd, joint.dof(row)) for value, (row, sd) in values])
    return [next(estimates) if is_predictable else None for is_predictable in predictable], joint


class StiffnessCovariance(NamedTuple):
    """Covariance of N measured stiffnesses C, then of as many K, SI units."""

    whole: Array  # (2 N, 2 N)
    own: tuple[Array, Array]  # (N, N) of C and of K, without what all conditions have in common


# share of the variance of an assumed standard deviation that all conditions of a table have in common: a gain of the
# rig moves all of them, while the tables of Dell'Orto et al. scatter by 1.2 to 2.2 % about a smooth law
ASSUMED_IN_COMMON = 0.8


def stiffness_covariance(table: MeasuredTable, *, assumed: float) -> StiffnessCovariance:
    """Covariance of the stiffnesses of a table, with the relative sd ``assumed`` of one for which it states none."""
    rounding = 1e-9  # of a file's digits, relative
    c, k = table.cornering_stiffness, table.lateral_stiffness
    keys = [table.sharing_key(row) for row in range(k.size)]
    shares_error = np.array([[row_key == column_key for column_key in keys] for row_key in keys], dtype=np.float64)
    c_sd, k_sd = (
        np.full_like(value, assumed) if sd is None else sd / value
        for value, sd in ((c, table.cornering_stiffness_sd), (k, table.lateral_stiffness_sd))
    )
    unstated = [table.cornering_stiffness_sd is None, table.lateral_stiffness_sd is None]
    common = ASSUMED_IN_COMMON * assumed**2 * np.diag(unstated)
    if table.calibration is not None:
        common = table.calibration.relative_covariance
    c_left = _left_over(table, "cornering stiffness", c_sd, float(common[0, 0]), rounding)
    k_left = _left_over(table, "lateral stiffness", k_sd, float(common[1, 1]), rounding)
    cross = np.zeros_like(c)
    if table.stiffness_correlation is not None:
        cross = table.stiffness_correlation * c_sd * k_sd - common[0, 1]
        for row in np.flatnonzero(np.abs(cross) > np.sqrt(c_left * k_left) + rounding * c_sd * k_sd):
            raise InputError(
                f"{table.condition(int(row))}: a correlation of {table.stiffness_correlation[row]:.3g} between "
                "cornering and lateral stiffness cannot be, with these standard deviations and the common calibration; "
                "correct stiffness_correlation or leave it out"
            )
    separate = np.diag(c_left), np.sqrt(np.outer(k_left, k_left)) * shares_error
    relative = np.kron(common, np.ones_like(shares_error)) + np.block(
        [[separate[0], np.diag(cross)], [np.diag(cross), separate[1]]]
    )
    if np.linalg.eigvalsh(relative)[0] < -rounding * np.abs(relative).max():
        raise InputError(
            f"{table.label}: a lateral stiffness that conditions share (lateral_stiffness_shared_over) cannot have "
            "these correlations with their cornering stiffnesses; leave stiffness_correlation out"
        )
    values = np.append(c, k)
    return StiffnessCovariance(
        relative * np.outer(values, values), (separate[0] * np.outer(c, c), separate[1] * np.outer(k, k))
    )


def _left_over(table: MeasuredTable, name: str, relative_sd: Array, common: float, rounding: float) -> Array:
    """Relative variance of each condition alone."""
    variance = relative_sd**2 - common
    for row in np.flatnonzero(variance < -rounding * common):
        raise InputError(
            f"{table.condition(int(row))}: the standard deviation of the {name} is "
            f"{100 * relative_sd[row]:.3g} %, less than the {100 * np.sqrt(common):.3g} % of the calibration that is "
            "common to all conditions; standard deviations hold the calibration, so add it or lower [calibration]"
        )
    return np.maximum(variance, 0.0)


def joint_covariance(
    cornering: Prediction, lateral: Prediction, measured: StiffnessCovariance, dof: Sequence[Array]
) -> JointCovariance:
    """Covariance of both stiffnesses and their ratio at n conditions.

    The relaxation length enters to first order, d(C/K) = (C/K) (dC/C - dK/K). Repeatability is pooled over a campaign,
    so the scatters of its conditions are known equally badly: their degrees of freedom ``dof`` do not add up.
    """
    c, k, predictions = cornering.value, lateral.value, (cornering, lateral)
    unit = np.eye(c.size)
    zero = np.zeros((c.size, c.size))
    halves = [  # (3 n, n), from C or K of all to (C, K, length) of each
        np.stack(blocks, 1).reshape(3 * c.size, -1)
        for blocks in ((unit, zero, np.diag(1 / k)), (zero, unit, np.diag(-c / k**2)))
    ]
    carried = np.hstack([half @ prediction.carry for half, prediction in zip(halves, predictions, strict=True)])
    errors = [half @ prediction.error @ half.T for half, prediction in zip(halves, predictions, strict=True)]
    covariance = carried @ measured.whole @ carried.T + sum(errors)
    totals, spread = np.diag(measured.whole).reshape(2, -1), []
    for number, freedom in enumerate(dof):
        # a stated number of degrees of freedom is that of the whole standard deviation: own^4/dof_own = sd^4/dof
        separate, part = measured.own[number], carried[:, number * len(freedom) :][:, : len(freedom)]
        ratio = np.divide(totals[number], np.diag(separate), out=np.zeros(len(separate)), where=np.diag(separate) > 0)
        root = np.sqrt(ratio) / freedom**0.25
        spread += [part @ (separate * np.outer(root, root)) @ part.T]
        if predictions[number].error_dof > 0:
            spread += [errors[number] / np.sqrt(predictions[number].error_dof)]
    return JointCovariance(stiffness_names(range(c.size)), (covariance + covariance.T) / 2, tuple(spread))


@dataclass(frozen=True, eq=False)
class TyreMap(TyreSource):
    """A measured tyre on one surface, evaluated at any load and pressure.

    The measured conditions are returned as they stand. Between them the value is a smooth trend plus the bilinearly
    interpolated difference of the measured values from it; beyond them the difference fades out over one interval of
    the grid, and the result is marked extrapolated. The trend of C_alpha is the MF6.1 form. That of K_y is linear in
    load and in pressure: MF6.1's product, or a plane where its misfit is less than half as large. Inside the grid
    K_y is therefore bilinear in the measured values.

    The covariance has three parts: the measured standard deviations, carried by the same weights (errors of a lateral
    stiffness shared between conditions stay shared); the misfit of the trend, which measures how much a tyre departs
    from a smooth law between neighbouring conditions, times the interpolation error of `Trend.at`; and the
    uncertainty of the trend itself, which matters outside. The last two vanish at measured conditions.

    Attributes
    ----------
    measured : MeasuredTable
        The measured conditions.
    relative_cornering_stiffness_sd : float
        Assumed sd(C_alpha) / C_alpha for tables that state none (the paper's do not), mostly common to all conditions;
        as much of K_y if the table states none of it either. It adds to the uncertainty of the relaxation length.

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
        return f"<TyreMap of {self.measured.ranges}>"

    @classmethod
    def load(
        cls,
        tyre: str,
        *,
        surface: str = "flat",
        relative_cornering_stiffness_sd: float = 0.0,
        folder: Traversable | None = None,
    ) -> "TyreMap":
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
        """Return the tyre of one table (``.csv`` with its ``.toml`` beside it, see `tyre.maps.map_files`).

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
        """Write the measured table and its sidecar; the assumption on C_alpha is not part of it.

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
        """The MF6.1 form fitted to the measured C_alpha: parameters, residuals and misfit in N/rad."""
        return fit_law(mf61.CORNERING, self.measured.load, self.measured.pressure, self.measured.cornering_stiffness)

    @cached_property
    def lateral_stiffness_trend(self) -> Trend:
        """The linear law of the measured K_y (`fit_linear_law`): parameters, residuals and misfit in N/m."""
        return fit_linear_law(self.measured.load, self.measured.pressure, self.measured.lateral_stiffness)

    @cached_property
    def _covariance(self) -> StiffnessCovariance:
        return stiffness_covariance(self.measured, assumed=self.relative_cornering_stiffness_sd)

    @property
    def table(self) -> "pd.DataFrame":
        """The measured conditions in the units of the field, one row each; a standard deviation that is neither stated
        nor assumed is NaN."""
        import pandas as pd

        table = self.measured
        c, k, length = table.cornering_stiffness, table.lateral_stiffness, table.relaxation_length
        cornering, lateral = np.diag(self._covariance.whole).reshape(2, -1)
        cross = np.diag(self._covariance.whole, len(c))
        relative = np.sqrt(np.maximum(cornering / c**2 + lateral / k**2 - 2 * cross / (c * k), 0.0))
        if not self.relative_cornering_stiffness_sd:
            cornering = np.full_like(c, np.nan) if table.cornering_stiffness_sd is None else cornering
            lateral, relative = (
                np.full_like(k, np.nan) if table.lateral_stiffness_sd is None else column
                for column in (lateral, relative)
            )
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
        if table.camber_stiffness is not None:
            columns["camber_stiffness_N_per_deg"] = np.radians(table.camber_stiffness.value)
            columns["camber_stiffness_sd_N_per_deg"] = np.radians(table.camber_stiffness.sd)
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
            shared lateral stiffness tests) the asked ones have in common too.

        Raises
        ------
        InputError
            A load or pressure that is not finite and positive, one that the table does not cover (another
            pressure than the only one measured, say), or an extrapolation to C_alpha <= 0 or K_y <= 0.
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
        dof = () if c_dof is None or k_dof is None else (c_dof, k_dof)
        joint = joint_covariance(cornering, lateral, self._covariance, dof)
        trails: list[Estimate | None] = [None] * load.size
        if table.pneumatic_trail is not None:
            trails, camber_covariance = predicted_column(
                table, table.pneumatic_trail, load, pressure, "pneumatic_trail"
            )
            joint = joint.and_also(camber_covariance)
        cambers: list[Estimate | None] = [None] * load.size
        if table.camber_stiffness is not None:
            cambers, camber_covariance = predicted_column(
                table, table.camber_stiffness, load, pressure, "camber_stiffness"
            )
            joint = joint.and_also(camber_covariance)
        routes = {
            name: predicted_column(table, column, load, pressure)[0]
            for name, column in table.direct_relaxation_length.items()
        }
        properties = []
        for row in range(load.size):
            origin, trail = self.origin(load=load[row], pressure=pressure[row]), trails[row]
            leaning = cambers[row]
            names = stiffness_names([row])
            properties.append(
                TyreProperties(
                    tyre=table.tyre,
                    surface=table.surface,
                    load=float(load[row]),
                    pressure=float(pressure[row]),
                    cornering_stiffness=float(cornering.value[row]),
                    lateral_stiffness=float(lateral.value[row]),
                    relaxation_length=float(cornering.value[row] / lateral.value[row]),
                    covariance=joint.among(names),
                    origin=origin,
                    notes=self._notes(origin),
                    synthetic=table.synthetic,
                    degrees_of_freedom=np.array([joint.dof(name) for name in names]) if dof else None,
                    lateral_stiffness_origin=table.lateral_stiffness_origin,
                    cornering_stiffness_sd_stated=table.cornering_stiffness_sd is not None,
                    lateral_stiffness_sd_stated=table.lateral_stiffness_sd is not None,
                    unstated_sd_assumed=self.relative_cornering_stiffness_sd > 0.0,
                    surface_stated=table.surface_stated,
                    pneumatic_trail=trail.value if trail else None,
                    pneumatic_trail_sd=trail.sd if trail else None,
                    camber_stiffness=leaning.value if leaning else None,
                    direct_relaxation_lengths={
                        name: length for name, lengths in routes.items() if (length := lengths[row]) is not None
                    },
                )
            )
        return JointProperties(tuple(properties), joint)

    def origin(self, *, load: float, pressure: float) -> Origin:
        """State if a ``load`` (N) and ``pressure`` (Pa) were measured, lie between measured ones, or outside."""
        table = self.measured
        if np.any(np.isclose(table.load, load, rtol=1e-9) & np.isclose(table.pressure, pressure, rtol=1e-9)):
            return "measured"
        return super().origin(load=load, pressure=pressure)

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """C_alpha, K_y and relaxation length at many conditions, as ``at`` gives them for one; nothing is checked."""
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
        departure, sd = "", float(np.sqrt(np.mean(np.diag(self._covariance.whole)[table.load.size :])))
        if departs_from_linear_laws(table.load, table.pressure, table.lateral_stiffness, sd=sd):
            departure = f", more than its sd of {sd / 1e3:.1f} N/mm explains: it is not linear in load and pressure"
        notes.append(
            f"lateral stiffness {way}: {law}, misfit of a linear law {lateral.misfit / 1e3:.1f} N/mm{departure}"
        )
        for name, trend in (("cornering", cornering), ("lateral", lateral)):
            if trend.degrees_of_freedom < 1:
                notes.append(
                    f"too few conditions to estimate the misfit of the {name} stiffness; it is treated as zero"
                )
        return tuple(notes)

    def _refuse(self, load: float, pressure: float) -> None:
        table, law = self.measured, self.cornering_stiffness_trend.parameters
        for name, value, unit, size, lines in (
            ("load", load, "N", 1.0, table.loads),
            ("pressure", pressure, "bar", PASCAL_PER_BAR, table.pressures),
        ):
            if lines.size == 1 and not np.isclose(value, lines[0], rtol=1e-9):
                raise InputError(
                    f"{table.label}: {name} is {value / size:.6g} {unit}, but it was measured at {lines[0] / size:g} "
                    f"{unit} only, which says nothing about another {name}; ask for that one or measure more."
                )
        for name in ("PPY1", "PPY2"):
            if 1 + law.get(name, 0.0) * (pressure / law["NOMPRES"] - 1) <= 0:
                raise InputError(
                    f"{table.label}: at {pressure / PASCAL_PER_BAR:g} bar the fitted 1 + {name} dpi is not positive, "
                    f"so the cornering stiffness is not physical; stay nearer to the measured {stated_range(self)}."
                )
