"""Ordinary rides: what moved the bicycle, and what its tyres did."""

from tyre.ground.door import room

HOME = {
    "forces": ("Record", "SegmentForces", "segment_forces"),
    "estimate": ("LINEAR_SHARE", "RideForces", "ride_forces"),
}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""

__getattr__, __dir__ = room(__name__, HOME)
