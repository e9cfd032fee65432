"""Rear frame and rider as one rigid body, with the uncertainty of body, posture, seat and frame carried through."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bicycle.parameters import Bicycle
from bicycle.rider.human import DENSITY_SETS, Segment, segments
from bicycle.rider.joining import RigidBody, as_rear_frame, join, rear_frame
from bicycle.rider.measurements import GROUPS, VOLUME_MASS_SD, RiderMeasurements
from bicycle.rider.posture import LEAN_LIMITS, POSTURES, Lengths, Seated, fitting_hands, sit
from bicycle.rider.seat_geometry import Contacts, SeatGeometry, completed, contacts, with_hands
from tyre.base.arrays import Array
from tyre.base.errors import InputError

KEYS = ("xB", "zB", "mB", "IBxx", "IByy", "IBzz", "IBxz")
ANGLE_SD = math.radians(5)
"""One sd of torso lean, rounding of the back and turn of the elbows."""

HAND_SD = 0.03
"""One sd (m) of reach and drop of a bar that was not measured."""

HEAVIEST_FRAME = 60.0
"""kg; a rear frame above it carries a rider already."""


class Angles(NamedTuple):
    """Joint angles that a posture leaves free, rad."""

    torso_lean: float
    back_rounding: float = 0.0
    elbows_out: float = 0.0


@dataclass(frozen=True, eq=False)
class RiderOnBicycle:
    """A bicycle with a rider.

    Attributes
    ----------
    frame : Bicycle
        Without rider.
    rider : RiderMeasurements
    posture : str
    angles : Angles
    geometry : SeatGeometry
        Complete; its ``assumed`` keys were not measured.
    contacts : Contacts
    seated : Seated
    segments : tuple of Segment
    body : RigidBody
        The rider alone.
    """

    frame: Bicycle
    rider: RiderMeasurements
    posture: str
    angles: Angles
    geometry: SeatGeometry
    contacts: Contacts
    seated: Seated
    segments: tuple[Segment, ...]
    body: RigidBody

    @cached_property
    def causes(self) -> Mapping[str, Array]:
        """Change (7,) of :data:`KEYS` by one standard deviation of each independent cause, saddle and bar held.

        Half the difference between plus and minus one sd. An arm that no longer reaches is straight: its hand falls
        short of the bar by some centimetres.
        """
        return _causes(self.frame, self.rider, self.geometry, self.angles)

    @property
    def values(self) -> dict[str, float]:
        """Meijaard's keys of rear frame and rider."""
        return as_rear_frame(join([self.body, rear_frame(self.frame.values)]))

    @property
    def covariance(self) -> Array:
        """Of :data:`KEYS`, shape (7, 7)."""
        steps = np.array(list(self.causes.values()))
        return np.asarray(steps.T @ steps)

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation of each of :attr:`values`."""
        spread = dict(zip(KEYS, np.sqrt(np.diag(self.covariance)), strict=True))
        return {key: float(spread[key]) for key in self.values}

    def bicycle(self, name: str, description: str, source: str) -> Bicycle:
        """As a parameter set; the sds of the other parameters are the frame's, correlations are left out.

        Parameters
        ----------
        name, description, source : str
        """
        return Bicycle(
            name, {**self.frame.values, **self.values}, {**self.frame.sd, **self.sd}, description, source,
            self.frame.notes,
        )  # fmt: skip


def rider_on_bicycle(
    frame: Bicycle,
    rider: RiderMeasurements,
    *,
    posture: str,
    geometry: SeatGeometry,
    torso_lean: float | None = None,
    back_rounding: float = 0.0,
    elbows_out: float = 0.0,
) -> RiderOnBicycle:
    """Put a rider on a bicycle.

    Parameters
    ----------
    frame : Bicycle
        Without rider.
    rider : RiderMeasurements
    posture : str
        A key of :data:`bicycle.rider.posture.POSTURES`.
    geometry : SeatGeometry
        What is known of seat and hands; the rest is assumed.
    torso_lean, back_rounding, elbows_out : float
        rad; without a lean it is the posture's.

    Raises
    ------
    InputError
        A frame with a rider, a lean that is none, limbs that are too short, or no package ``yeadon``.
    """
    if frame["mB"] > HEAVIEST_FRAME:
        raise InputError(
            f"bicycle {frame.name!r}: the rear frame weighs {frame['mB']:g} kg, so it carries a rider already "
            f"(limit {HEAVIEST_FRAME:g} kg); give a bicycle without rider"
        )
    way = POSTURES[posture]
    angles = Angles(way.torso_lean if torso_lean is None else torso_lean, back_rounding, elbows_out)
    _check_angles(angles)
    geometry = completed(geometry, rider, frame.values, hand_width=way.hand_width)
    if not geometry.has_hands:
        hands = fitting_hands(
            Lengths.of(rider.lengths),
            way._replace(hand_width=geometry.values["hand_width_m"]),
            torso_lean=angles.torso_lean,
        )
        geometry = with_hands(geometry, hands, sd=HAND_SD)
    at = contacts(geometry, frame.values)
    seated = sit(Lengths.of(rider.lengths), at, **angles._asdict())
    parts = segments(rider, seated.configuration, at.hip)
    body = join([part.body for part in parts])
    if rider.mass is None:  # from here on it is given, so that mass and shape vary apart
        rider = replace(rider, mass=body.mass, mass_sd=VOLUME_MASS_SD * body.mass)
    return RiderOnBicycle(frame, rider, posture, angles, geometry, at, seated, parts, body)


def _check_angles(angles: Angles) -> None:
    limits = {"torso_lean": LEAN_LIMITS, "back_rounding": (-30.0, 90.0), "elbows_out": (-45.0, 90.0)}
    for name, value in angles._asdict().items():
        low, high = limits[name]
        if not low <= math.degrees(value) <= high:
            raise InputError(
                f"{name.replace('_', ' ')} = {math.degrees(value):g} deg must lie between {low:g} and {high:g} degrees"
            )


def _causes(frame: Bicycle, rider: RiderMeasurements, geometry: SeatGeometry, angles: Angles) -> dict[str, Array]:

    def whole(
        rider: RiderMeasurements = rider, geometry: SeatGeometry = geometry, angles: Angles = angles,
        frame_values: Mapping[str, float] = frame.values, densities: str = DENSITY_SETS[0],
    ) -> Array:  # fmt: skip
        at = contacts(geometry, frame.values)
        seated = sit(Lengths.of(rider.lengths), at, **angles._asdict(), strict=False)
        body = join([part.body for part in segments(rider, seated.configuration, at.hip, densities=densities)])
        values = as_rear_frame(join([body, rear_frame(frame_values)]))
        return np.array([values.get(key, np.nan) for key in KEYS])

    def half(changed: Callable[[float], Array]) -> Array:
        return (changed(1.0) - changed(-1.0)) / 2

    mass = rider.mass
    assert mass is not None
    causes = {"mass of the rider": half(lambda s: whole(rider=replace(rider, mass=mass + s * rider.mass_sd)))}
    for group in GROUPS:
        causes[group] = half(lambda s, g=group: whole(rider=rider.scaled(g, 1 + s * rider.relative_sd)))  # type: ignore[misc]
    sets = np.array([whole(densities=name) for name in DENSITY_SETS])
    for number, step in enumerate(sets - sets.mean(axis=0)):  # sample covariance of the three
        causes[f"densities after {DENSITY_SETS[number]}"] = step / math.sqrt(len(sets) - 1)
    for name, value in angles._asdict().items():
        causes[name.replace("_", " ")] = half(
            lambda s, n=name, v=value: whole(angles=angles._replace(**{n: v + s * ANGLE_SD}))  # type: ignore[misc]
        )
    for key, sd in geometry.sd.items():
        causes[f"seat: {key.rpartition('_')[0].replace('_', ' ')}"] = half(
            lambda s, k=key, d=sd: whole(geometry=geometry.changed(k, s * d))  # type: ignore[misc]
        )
    for key in KEYS:
        if frame.sd.get(key, 0.0) > 0:
            causes[f"frame: {key}"] = half(
                lambda s, k=key: whole(frame_values={**frame.values, k: frame[k] + s * frame.sd[k]})  # type: ignore[misc]
            )
    return causes
