"""Ordinary rides: what moved the bicycle, what its tyres did, and its wobble."""

from tyre.ground.door import room

HOME = {
    "forces": ("Record", "SegmentForces", "segment_forces", "thinned"),
    "estimate": ("LINEAR_SHARE", "RideForces", "ride_forces"),
    "loop": ("LoopMode", "loop_modes"),
    "wobble": ("HEADERS", "notes_of_wobble", "wobble_cells"),
}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""

__getattr__, __dir__ = room(__name__, HOME)
