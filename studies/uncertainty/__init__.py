"""Uncertain inputs carried to modes and critical speeds."""

from studies.uncertainty.propagation import (
    Quantity,
    Uncertainty,
    assumed,
    by_group,
    by_origin,
    counted_as_exact,
    differs,
    group_of,
    known_exactly,
    remarks,
    stands_alone,
    total_effects,
)
from studies.uncertainty.uncertain_model import UncertainModel

__all__ = [
    "Quantity", "UncertainModel", "Uncertainty", "assumed", "by_group", "by_origin", "counted_as_exact", "differs",
    "group_of", "known_exactly", "remarks", "stands_alone", "total_effects",
]  # fmt: skip
