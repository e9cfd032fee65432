"""Uncertain inputs carried to modes and critical speeds."""

from tyre.ground.door import room

FILES = {
    "propagation": ("Quantity", "Uncertainty", "assumed_sd", "by_group", "counted_as_exact", "differs", "known_exactly",
                    "remarks", "dropped_correlations", "describe_assumptions", "total_effects"),
    "uncertain_model": ("UncertainModel",),
}  # fmt: skip
__getattr__, __dir__ = room(__name__, FILES)
