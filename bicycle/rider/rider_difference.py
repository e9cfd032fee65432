"""Body of a rider from two bicycles: one with the rider, minus the same one without."""

import numpy as np

from bicycle.parameters.bicycle import Bicycle
from bicycle.rider.rider_body import RigidBody, join, rear_frame
from tyre.ground.errors import InputError

SAME = 0.01  # relative difference of the numbers of one bicycle that was measured twice
FRAME = ("xB", "zB", "mB", "IBxx", "IByy", "IBzz", "IBxz", "g")  # what a rider changes, and what no bicycle has


def seated_rider(ridden: Bicycle, bare: Bicycle) -> dict[str, float]:
    """Compute the body of the rider of a bicycle: its rear frame with rider minus that without.

    Parameters
    ----------
    ridden, bare : Bicycle
        The same bicycle with and without rider.

    Returns
    -------
    dict
        ``mass`` (kg), mass centre ``x``, ``z`` (m, z down), and ``Ixx``, ``Izz``, ``Ixz`` (kg m^2) about it: parameters
        of the effects rider_saddle and rider_lean.

    Raises
    ------
    InputError
        The bicycles differ in more than the rear frame, or their difference is not a body.
    """
    for key, value in ridden.values.items():
        if key not in FRAME and abs(value - bare[key]) > SAME * max(abs(value), abs(bare[key])):
            raise InputError(
                f"bicycles {ridden.name!r} and {bare.name!r} differ in {key}, {value:g} and {bare[key]:g}; give the "
                "same bicycle with and without rider, whose rear frames alone differ"
            )
    frame = rear_frame(bare.values)
    if ridden["mB"] <= frame.mass:
        raise InputError(
            f"bicycle {ridden.name!r} is not heavier than {bare.name!r} (mB = {ridden['mB']:g} and {frame.mass:g} kg), "
            "so it carries no rider"
        )
    body = join([rear_frame(ridden.values), RigidBody(-frame.mass, frame.centre, -frame.inertia)])
    (xx, xz), (_, zz) = body.inertia[np.ix_((0, 2), (0, 2))]
    if min(xx, zz) <= 0 or xx * zz <= xz * xz:
        raise InputError(
            f"bicycle {ridden.name!r} minus {bare.name!r} is no body: Ixx = {xx:.3g}, Izz = {zz:.3g}, Ixz = {xz:.3g} "
            "kg m^2; one of them does not hold what its name says"
        )
    numbers = (body.mass, body.centre[0], body.centre[2], xx, zz, xz)
    return {key: float(value) for key, value in zip(("mass", "x", "z", "Ixx", "Izz", "Ixz"), numbers, strict=True)}
