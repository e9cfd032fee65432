"""From the files of a ride to the forces of its tyres and the share of the grip that they use."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.identification.ride_recording import read_ride
from bicycle.model.model import Model
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.ride_disturbances import CONTROLLER, NOBODY, RIDER
from studies.diagnosis.ride_reading import lowest_of_all, spectra_of_rides
from studies.diagnosis.ride_spectra import RideSpectra
from studies.inference.fit import Fit, fit
from studies.rides.forces import SegmentForces, segment_forces
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from bicycle.identification.ride_recording import Ride
    from studies.door.library import AnyModel
    from tyre.formats.channel_map import ChannelMap

WHEELS = ("rear", "front")
GRIP = 0.8  # largest lateral force over load where nobody states it: dry asphalt
HIGHEST_GRIP = 2.0
LINEAR_SHARE = 0.28
"""Share of the grip at which a brush tyre, F = C a (1 - x/3 + x^2/27) with x = C a / (grip load) = 0.31, gives 10 %
less force than the linear one."""
NARROWED = 0.8  # sd after the ride over the sd before, below which a parameter is worth a row
PERIODS = 9.0
"""Periods of the lowest frequency of the spectra. Slow forces are the largest; which slow input made them is read from
the spectra, and guessed below their lowest frequency."""
TRUSTED = 1e-4  # P(chi^2 larger) below which the bands of a ride are not to be trusted
RideFile = str | Path | tuple[str | Path, float]


@dataclass(frozen=True)
class Narrowed:
    """A parameter of tyre or bicycle whose uncertainty the ride has narrowed; values in the parameter's unit."""

    name: str
    unit: str
    stated: float
    stated_sd: float
    value: float
    sd: float


@dataclass(frozen=True, eq=False)
class RideForces:
    """Lateral forces and slip angles of both tyres along the segments of rides."""

    segments: tuple[SegmentForces, ...]
    static_loads: tuple[float, float]  # N, rear and front
    grip: float  # largest lateral force over load
    grip_assumed: bool
    misfit: float  # chi^2 of spectra and shifted parameters, for each number of the spectra; 1 where all is as modelled
    goodness: float  # probability of a larger chi^2
    widened: float  # factor on all uncertainties, root of the misfit; 1 where the model fits the spectra
    converged: bool  # the fit of the spectra came to an end
    narrowed: tuple[Narrowed, ...]
    left_out: tuple[str, ...]  # sentences: parts of the rides that are not used, and why
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        largest = [max((np.abs(s.force[wheel]).max() for s in self.segments), default=0.0) for wheel in range(2)]
        return (
            f"<RideForces of {', '.join(segment.name for segment in self.segments)}\n"
            f" largest lateral force {largest[0]:.3g} N rear, {largest[1]:.3g} N front; misfit {self.misfit:.3g}; "
            f"notes: {len(self.notes)}>"
        )

    def share(self, segment: SegmentForces) -> Array:
        """Share (2, n) of the grip, rear and front: size of the lateral force over grip x static load."""
        return np.abs(segment.force) / self._strength

    def share_sd(self, segment: SegmentForces) -> Array:
        """Standard uncertainty (2, n) of :meth:`share`; that of the grip is not in it."""
        return segment.force_sd / self._strength

    @property
    def _strength(self) -> Array:
        """Largest lateral force (2, 1) that each tyre gives, N."""
        return self.grip * np.array(self.static_loads)[:, None]

    @property
    def nonlinear_shares(self) -> tuple[float, float]:
        """Share of the time, rear and front, in which the share of the grip is above that of a linear tyre."""
        shares = np.concatenate([self.share(segment) for segment in self.segments], 1)
        rear, front = np.mean(shares > LINEAR_SHARE, 1).tolist()
        return rear, front

    def table(self) -> pd.DataFrame:
        """A row for each sample: segment, time_s, speed_m_s, and of each wheel force, N, slip angle, deg, and share."""
        import pandas as pd

        tables = []
        for segment in self.segments:
            columns: dict[str, Any] = {"segment": segment.name, "time_s": segment.time, "speed_m_s": segment.speed}
            share, share_sd = self.share(segment), self.share_sd(segment)
            for k, wheel in enumerate(WHEELS):
                columns |= {
                    f"{wheel}_lateral_force_N": segment.force[k],
                    f"{wheel}_lateral_force_N_sd": segment.force_sd[k],
                    f"{wheel}_slip_angle_deg": np.degrees(segment.slip[k]),
                    f"{wheel}_slip_angle_deg_sd": np.degrees(segment.slip_sd[k]),
                    f"{wheel}_grip_share": share[k],
                    f"{wheel}_grip_share_sd": share_sd[k],
                }
            columns |= {"lateral_push_N": segment.push, "lateral_push_N_sd": segment.push_sd}
            tables.append(pd.DataFrame(columns))
        return pd.concat(tables, ignore_index=True)


def ride_forces(
    model: AnyModel,
    rides: RideFile | Sequence[RideFile],
    *,
    grip: float | None = None,
    steering: str = "",
    turns: bool = False,
    uncertainty: Mapping[str, float] | None = None,
    channel_map: ChannelMap | None = None,
) -> RideForces:
    """Estimate lateral forces and slip angles of the tyres on recorded rides, with uncertainties.

    The recorded motion y and the forces x of the tyres answer the same unknown torques and forces. Away
    from the ends of a segment the estimate is x = G y with G = S_xy S_yy^-1 (N. Wiener, *Extrapolation, interpolation
    and smoothing of stationary time series*, 1949), S the spectra of the linear model with noise; its error has the
    spectrum S_xx - G S_yx. Near the ends it is the best linear estimate too, with a wider band. Sizes and colours of
    the unknown inputs (torques on steering and frame, a lateral push, a yaw moment) and a steering rider follow from
    the spectra of the ride, and the parameters of tyres and bicycle move within their standard uncertainties.

    Parameters
    ----------
    model
        Name, file, ``vt.Bicycle``, ``vt.Model`` or content of a model file; its tyres must slip.
    rides
        A file or several: ``"ride.csv"`` where the speed is a column, ``("ride.csv", 4.8)`` with the speed in m/s.
        Columns are those of a ride: ``time_s`` and two or more of ``roll_rate_rad_s``, ``yaw_rate_rad_s``,
        ``steer_rate_rad_s``, ``steer_rad``, ``lean_rad``; perhaps ``steer_torque_N_m``. All have the same channels.
    grip
        Largest lateral force over load of a tyre, no unit, above 0, at most 2; None assumes 0.8.
    steering
        Who steers: "rider", "controller" or "nobody"; empty: as the recorded steer torque and the model show.
    turns
        Keep turns, which are left out otherwise: the model is linear about straight running.
    uncertainty
        Standard uncertainties in SI by parameter, ``"zB"`` or ``"relaxation_length.cornering_stiffness.rear"``, in
        place of those of the model; 0: exactly known. What neither states has the default of ``velotyre diagnose``.
    channel_map
        Columns, units and signs of the channels, for files in other columns (:class:`tyre.formats.ChannelMap`).

    Returns
    -------
    RideForces
        ``segments``, each with ``time`` (n,) in s, ``force`` and ``force_sd`` (2, n) in N, ``slip`` and ``slip_sd``
        (2, n) in rad, rear wheel first, and ``push`` and ``push_sd`` (n,) in N, the unknown lateral push on the frame;
        ``sd`` is one standard uncertainty. x is forward, y to the right, z down: a force to the right is positive, a
        slip angle has the sign of the force that it makes. Offsets of the sensors are estimated along, so a steady
        force is known to the mean of the ride alone. Also ``share(segment)`` of the grip, ``table()``, ``misfit``,
        ``goodness``, ``widened``, ``converged``, ``narrowed``, ``left_out`` and ``notes``.

    Raises
    ------
    InputError
        Tyres that cannot slip; a file that cannot be read; no steady part; fewer than two channels; a grip or a
        steering that is not allowed.
    """
    from studies.door.library import model_of

    chosen = model_of(model)
    _refuse_rolling(chosen)
    _check(grip, steering)
    files = [rides] if isinstance(rides, str | Path) or _is_file_and_speed(rides) else list(rides)
    if not files:
        raise InputError("no ride; give one file or more")
    pairs = [file if isinstance(file, tuple) else (file, None) for file in files]
    read = [read_ride(Path(file), speed, channel_map=channel_map, keep_turns=turns) for file, speed in pairs]
    return forces_of_rides(chosen, read, grip=grip, steering=steering, uncertainty=uncertainty)


def _is_file_and_speed(rides: Any) -> bool:
    return isinstance(rides, tuple) and len(rides) == 2 and isinstance(rides[1], int | float)


def forces_of_rides(
    model: Model,
    rides: Sequence[Ride],
    *,
    grip: float | None,
    steering: str,
    uncertainty: Mapping[str, float] | None = None,
) -> RideForces:
    """Forces along ``rides`` that were read; see :func:`ride_forces`."""
    _refuse_rolling(model)
    _check(grip, steering)
    rides_read = spectra_of_rides(
        rides, steering=steering, ridden=not nobody_rides(model), lowest_hz=lowest_of_all(rides, PERIODS)
    )
    common = {"name": "ride", "model": model, "uncertainty": dict(uncertainty or {})}
    kind = RideSpectra.of_rides(rides_read, {}, common).prepare()
    final = fit(kind, (), patient=True)
    return RideForces(
        segment_forces(kind, final),
        model.bicycle.static_loads,
        GRIP if grip is None else grip,
        grip is None,
        final.objective / len(final.residual),
        final.goodness,
        final.noise_factor,
        final.converged,
        _narrowed(final),
        kind.left_out,
        tuple(note for note in kind.notes if note not in kind.left_out),
    )


def _refuse_rolling(model: Model) -> None:
    """Refuse wheels that cannot slip."""
    if not any("tyre force" in effect.provides for effect in model.effects):
        raise InputError(
            "the wheels of this model roll without slip, and the force of a rolling constraint has no slip angle; give "
            "a model with tyres ([effects.relaxation_length] or [effects.side_slip]; --tyre adds a measured one)"
        )


def _check(grip: float | None, steering: str) -> None:
    if grip is not None and not (math.isfinite(grip) and 0 < grip <= HIGHEST_GRIP):
        raise InputError(f"grip = {grip:g} must be above 0, at most {HIGHEST_GRIP:g}: the largest force over load")
    if steering not in ("", RIDER, CONTROLLER, NOBODY):
        raise InputError(f"steering = {steering!r} is not allowed; write {RIDER!r}, {CONTROLLER!r} or {NOBODY!r}")


def _narrowed(final: Fit) -> tuple[Narrowed, ...]:
    """Parameters whose sd the ride has made smaller, the most narrowed first."""
    rows = []
    for k, unknown in enumerate(final.unknowns):
        share = math.sqrt(max(final.covariance[k, k], 0.0)) / unknown.scale
        if share < NARROWED:
            stated_sd = unknown.scale * unknown.slope(unknown.centre)
            sd = share * unknown.scale * unknown.slope(final.theta[k])
            stated, value = float(unknown.value(unknown.centre)), float(unknown.value(final.theta[k]))
            rows.append((share, Narrowed(unknown.name, unknown.unit, stated, stated_sd, value, sd)))
    return tuple(row for _, row in sorted(rows, key=lambda pair: pair[0]))
