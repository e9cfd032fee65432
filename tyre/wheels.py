"""The tyres of two wheels together."""

from collections.abc import Sequence

from tyre.joint_properties import JointProperties, side_by_side
from tyre.tyre_source import TyreSource


def wheel_properties(tyres: Sequence[TyreSource], conditions: Sequence[tuple[float, float]]) -> JointProperties:
    """Properties of the tyre of each wheel; what wheels with one tyre have in common is in their covariance.

    Parameters
    ----------
    tyres : sequence of TyreSource
        One for each wheel. Tyres of one name on one surface are one tyre; different ones share nothing, though one
        rig may have measured both.
    conditions : sequence of (load, pressure)
        N and Pa of each wheel.

    Raises
    ------
    InputError
        A condition of which a tyre says nothing.
    """
    if len({(tyre.tyre, tyre.surface) for tyre in tyres}) == 1:
        return tyres[0].jointly(conditions)
    return side_by_side([tyre.jointly([at]) for tyre, at in zip(tyres, conditions, strict=True)])
