"""Rigid bodies joined into one: masses add, inertias add about the common mass centre (parallel axis theorem)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tyre.base.arrays import Array


@dataclass(frozen=True)
class RigidBody:
    """Mass (kg), mass centre (3,) in m and inertia tensor (3, 3) about it in kg m^2; x forward, y right, z down.

    Off-diagonal entries are tensor entries, Ixz = -sum m x z, as Meijaard et al. (2007) tabulate them.
    """

    mass: float
    centre: Array
    inertia: Array


def join(bodies: Sequence[RigidBody]) -> RigidBody:
    """One rigid body of several ``bodies``."""
    mass = sum(body.mass for body in bodies)
    centre = sum((body.mass * body.centre for body in bodies), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in bodies:
        arm = body.centre - centre
        inertia += body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return RigidBody(mass, centre, inertia)


def rear_frame(p: Mapping[str, float]) -> RigidBody:
    """The rear frame of a parameter set ``p`` (SI); IByy, of no use to lateral motion, is NaN where it has none."""
    inertia = np.array([[p["IBxx"], 0, p["IBxz"]], [0, p.get("IByy", np.nan), 0], [p["IBxz"], 0, p["IBzz"]]])
    return RigidBody(p["mB"], np.array([p["xB"], 0.0, p["zB"]]), inertia)


def as_rear_frame(body: RigidBody) -> dict[str, float]:
    """Meijaard's keys (SI) of a ``body`` symmetric to the plane y = 0, as a rear frame; without IByy where unknown."""
    inertia = body.inertia
    values = {
        "xB": body.centre[0], "zB": body.centre[2], "mB": body.mass,
        "IBxx": inertia[0, 0], "IByy": inertia[1, 1], "IBzz": inertia[2, 2], "IBxz": inertia[0, 2],
    }  # fmt: skip
    return {key: float(value) for key, value in values.items() if not np.isnan(value)}
