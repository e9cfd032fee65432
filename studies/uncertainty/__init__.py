"""Uncertain inputs carried to modes and critical speeds."""

from studies.uncertainty.propagation import (
    Quantity,
    Uncertainty,
    assumed,
    by_group,
    counted_as_exact,
    differs,
    known_exactly,
    remarks,
    stands_alone,
    stated,
    total_effects,
)
from studies.uncertainty.uncertain_model import UncertainModel

__all__ = [
    "Quantity", "UncertainModel", "Uncertainty", "assumed", "by_group", "counted_as_exact", "differs",
    "known_exactly", "remarks", "stands_alone", "stated", "total_effects",
]  # fmt: skip
