"""A rider on a bicycle: rear frame and body as one rigid body, with its covariance."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.parameter_covariance import FILE, ParameterCovariance
from bicycle.rider import rider_body, rider_posture
from bicycle.rider.rider_body import RiderMeasurements, RigidBody, Segment
from bicycle.rider.rider_posture import Contacts, Lengths, Seated, SeatGeometry
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

FRAME_KEYS = ("xB", "zB", "mB", "IBxx", "IByy", "IBzz", "IBxz")
FRAME_TOGETHER, PART = "frame: what is known together", ", part "
"""Cause of the uncertainty of a frame with a covariance; its independent parts are numbered."""

ANGLE_SD = math.radians(5)
"""One sd of torso lean, rounding of the back and turn of the elbows."""


class Angles(NamedTuple):
    """Joint angles that a posture leaves free, rad."""

    torso_lean: float  # of the line from hip to shoulder from the vertical, positive forward
    back_rounding: float = 0.0  # by which the chest leans farther forward than the pelvis
    elbows_out: float = 0.0  # turn of the elbows about the line from shoulder to hand, positive outwards; 0: below it


@dataclass(frozen=True, eq=False)
class RiderOnBicycle:
    """A bicycle with a rider."""

    frame: Bicycle  # without rider
    rider: RiderMeasurements  # its ``mass`` is never None here
    posture: str  # name in :data:`rider_posture.POSTURES`
    angles: Angles  # as asked for, or of the posture
    geometry: SeatGeometry  # complete; its ``assumed`` keys were not measured
    contacts: Contacts  # hip, pedals and hands on this bicycle
    seated: Seated  # joint angles that reach them
    segments: tuple[Segment, ...]  # rigid parts of the body, on the bicycle
    body: RigidBody  # the rider alone

    @cached_property
    def causes(self) -> Mapping[str, Array]:
        """Change (7,) of :data:`FRAME_KEYS` by 1 sd of each independent cause, saddle and handlebar held."""
        return _causes(self.frame, self.rider, self.geometry, self.angles)

    @property
    def values(self) -> dict[str, float]:
        """Meijaard's keys (SI) of rear frame and rider as one rigid body."""
        return rider_body.as_rear_frame(rider_body.join([self.body, rider_body.rear_frame(self.frame.values)]))

    @property
    def covariance(self) -> Array:
        """Covariance of :data:`FRAME_KEYS`, shape (7, 7)."""
        steps = np.array(list(self.causes.values()))
        return np.asarray(steps.T @ steps)

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation (SI) of each of :attr:`values`."""
        spread = dict(zip(FRAME_KEYS, np.sqrt(np.diag(self.covariance)), strict=True))
        return {key: float(spread[key]) for key in self.values}

    @property
    def hands(self) -> dict[str, float]:
        """Parameters of the effect ``rider_hands`` that follow from body, posture and handlebar (SI)."""
        parts = {part.name: part for part in self.segments}
        upper, fore = parts["Right upper arm"], parts["Right forearm-hand"]
        (x, z), width, frame = self.contacts.hands, self.contacts.half_width, self.frame
        grip = np.array([x, width, z])
        foot = np.array([frame["w"] + frame["c"], 0.0, 0.0])
        way = np.cross([math.sin(frame["lam"]), 0.0, math.cos(frame["lam"])], grip - foot)
        mass = felt_mass((upper.body, fore.body), (upper.sections[0], fore.sections[0], grip), way)
        return {"mass": 2 * mass, "half_width": float(width), "x": float(x), "z": float(z)}

    @property
    def saddle(self) -> dict[str, float]:
        """Parameters of the effect ``rider_saddle`` that follow from body, posture and saddle (SI)."""
        (x, _, z), inertia = self.body.centre, self.body.inertia
        numbers = {"mass": self.body.mass, "x": x, "z": z, "joint_x": self.contacts.hip[0]}
        numbers |= {"Ixx": inertia[0, 0], "Izz": inertia[2, 2], "Ixz": inertia[0, 2]}
        return {key: float(number) for key, number in numbers.items()}

    def bicycle(self, name: str, description: str, source: str) -> Bicycle:
        """As a parameter set; the uncertainty of the other parameters is the frame's.

        Correlations are left out, which is on the safe side, unless the frame states some of its own.
        """
        covariance = self._joint_covariance
        sd = {key: spread for key, spread in {**self.frame.sd, **self.sd}.items() if key not in covariance.names}
        return Bicycle(
            name, {**self.frame.values, **self.values}, sd, description, source, self.frame.notes, covariance
        )

    @property
    def _joint_covariance(self) -> ParameterCovariance:
        """Covariance (SI) of the numbers that a frame states together, with the rider on it; empty without any."""
        if not self.frame.covariance.names:
            return ParameterCovariance()
        names = tuple(dict.fromkeys((*self.frame.covariance.names, *self.values)))
        together = _steps_together(self.frame)
        rows = []
        for cause, step in self.causes.items():
            ridden = {key: change for key, change in zip(FRAME_KEYS, step.tolist(), strict=True) if key in self.values}
            change = together.get(cause, {}) | ridden
            rows.append([change.get(key, 0.0) for key in names])
        steps = np.array(rows)
        return ParameterCovariance(names, steps.T @ steps, origin=FILE)


def felt_mass(arm: tuple[RigidBody, RigidBody], points: tuple[Array, Array, Array], way: Array) -> float:
    """Mass (kg) felt at a hand that is led along ``way``: way' (J M^-1 J')^-1 way, of unit length.

    The ``arm`` is upper arm and forearm, free at the shoulder (three angles) and the elbow (one), ``points`` are
    shoulder, elbow and hand (m). Source: Khatib (1987), IEEE Journal of Robotics and Automation 3, eq. 33.
    """
    shoulder, elbow, hand = points
    hinge = np.cross(elbow - shoulder, hand - elbow)
    axes, places = [*np.eye(3), hinge / np.linalg.norm(hinge)], [shoulder] * 3 + [elbow]

    def slopes(point: Array, joints: int) -> Array:
        return np.transpose([np.cross(axes[k], point - places[k]) * (k < joints) for k in range(4)])

    inertia = np.zeros((4, 4))
    for body, joints in zip(arm, (3, 4), strict=True):
        velocities, rotations = slopes(np.asarray(body.centre), joints), np.array(axes).T * (np.arange(4) < joints)
        inertia += body.mass * velocities.T @ velocities + rotations.T @ body.inertia @ rotations
    hand_velocities, unit = slopes(hand, 4), way / np.linalg.norm(way)
    return float(unit @ np.linalg.solve(hand_velocities @ np.linalg.solve(inertia, hand_velocities.T), unit))


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
    """Put a ``rider`` on a ``frame`` without one; angles in rad, by default those of the ``posture``."""
    if frame["mB"] > 60:
        raise InputError(
            f"bicycle {frame.name!r}: the rear frame weighs {frame['mB']:g} kg, so it carries a rider already "
            "(limit 60 kg); give a bicycle without rider"
        )
    way, lengths = rider_posture.POSTURES[posture], Lengths.of(rider.lengths)
    angles = Angles(way.torso_lean if torso_lean is None else torso_lean, back_rounding, elbows_out)
    limits = (rider_posture.LEAN_LIMITS, (-30.0, 90.0), (-45.0, 90.0))
    for (name, value), (low, high) in zip(angles._asdict().items(), limits, strict=True):
        if not low <= math.degrees(value) <= high:
            raise InputError(
                f"{name.replace('_', ' ')} = {math.degrees(value):g} deg must lie between {low:g} and {high:g} degrees"
            )
    geometry = rider_posture.complete_geometry(geometry, rider, frame.values, hand_width=way.hand_width)
    if not geometry.has_hands:
        narrow = way._replace(hand_width=geometry.values["hand_width_m"])
        hands = rider_posture.fitting_hands(lengths, narrow, torso_lean=angles.torso_lean)
        geometry = rider_posture.with_hands(geometry, hands, sd=0.03)  # m, of a bar that was not measured
    at = rider_posture.contacts(geometry, frame.values)
    seated = rider_posture.sit(lengths, at, **angles._asdict())
    parts = rider_body.segments(rider, seated.configuration, at.hip)
    body = rider_body.join([part.body for part in parts])
    if rider.mass is None:  # from here on it is given, so that mass and shape vary apart
        rider = replace(rider, mass=body.mass, mass_sd=rider_body.LIMITS.volume_mass_sd * body.mass)
    return RiderOnBicycle(frame, rider, posture, angles, geometry, at, seated, parts, body)


def _steps_together(frame: Bicycle) -> dict[str, dict[str, float]]:
    """Changes (SI) of a frame's numbers by 1 sd of each independent cause of its covariance: cause, key -> change."""
    keys, matrix = frame.covariance.names, frame.covariance.matrix
    sd = np.sqrt(np.diag(matrix))
    scale = np.where(sd > 0, sd, 1.0)
    variances, axes = np.linalg.eigh(matrix / np.outer(scale, scale))
    columns = (scale[:, None] * axes * np.sqrt(np.maximum(variances, 0.0))).T
    return {
        f"{FRAME_TOGETHER}{PART}{number}": dict(zip(keys, column.tolist(), strict=True))
        for number, column in enumerate(columns, 1)
    }


def _causes(frame: Bicycle, rider: RiderMeasurements, geometry: SeatGeometry, angles: Angles) -> dict[str, Array]:

    def whole(
        rider: RiderMeasurements = rider,
        geometry: SeatGeometry = geometry,
        angles: Angles = angles,
        frame_values: Mapping[str, float] = frame.values,
        densities: str = rider_body.DENSITY_SETS[0],
    ) -> Array:
        at = rider_posture.contacts(geometry, frame.values)
        seated = rider_posture.sit(Lengths.of(rider.lengths), at, **angles._asdict(), strict=False)
        parts = rider_body.segments(rider, seated.configuration, at.hip, densities=densities)
        body = rider_body.join([part.body for part in parts])
        values = rider_body.as_rear_frame(rider_body.join([body, rider_body.rear_frame(frame_values)]))
        return np.array([values.get(key, np.nan) for key in FRAME_KEYS])

    mass = rider.mass
    assert mass is not None
    changes: dict[str, Callable[[float], dict[str, Any]]] = {  # cause -> what is other, some sd away
        "mass of the rider": lambda s: {"rider": replace(rider, mass=mass + s * rider.mass_sd)}
    }
    for group in rider_body.GROUPS:
        changes[group] = lambda s, g=group: {"rider": rider.scaled(g, 1 + s * rider.relative_sd)}  # type: ignore[misc]
    for name, value in angles._asdict().items():
        key = name.replace("_", " ")
        changes[key] = lambda s, n=name, v=value: {"angles": angles._replace(**{n: v + s * ANGLE_SD})}  # type: ignore[misc]
    for key, sd in geometry.sd.items():
        name = f"seat: {key.rpartition('_')[0].replace('_', ' ')}"
        changes[name] = lambda s, k=key, d=sd: {"geometry": geometry.shift(k, s * d)}  # type: ignore[misc]
    for cause, shifts in _steps_together(frame).items():
        changes[cause] = lambda s, shifts=shifts: {  # type: ignore[misc]
            "frame_values": {**frame.values, **{key: frame[key] + s * shift for key, shift in shifts.items()}}
        }
    for key in FRAME_KEYS:
        if frame.sd.get(key, 0.0) > 0 and key not in frame.covariance.names:
            changes[f"frame: {key}"] = lambda s, k=key: {  # type: ignore[misc]
                "frame_values": {**frame.values, k: frame[k] + s * frame.sd[k]}
            }
    sets = np.array([whole(densities=name) for name in rider_body.DENSITY_SETS])  # sample covariance of the three
    steps = (sets - sets.mean(axis=0)) / math.sqrt(len(sets) - 1)
    densities = {f"densities after {name}": step for name, step in zip(rider_body.DENSITY_SETS, steps, strict=True)}
    return {cause: (whole(**other(1.0)) - whole(**other(-1.0))) / 2 for cause, other in changes.items()} | densities
