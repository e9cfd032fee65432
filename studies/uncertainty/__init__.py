"""Uncertain inputs carried to modes and critical speeds."""

from tyre.ground.door import room

FILES = {
    "propagation": ("Quantity", "Uncertainty", "assumed", "by_group", "counted_as_exact", "differs", "known_exactly",
                    "remarks", "stands_alone", "stated", "total_effects"),
    "uncertain_model": ("UncertainModel",),
}  # fmt: skip
__getattr__, __dir__ = room(__name__, FILES)
