"""Bicycle-tyre rig data: cornering stiffness, lateral stiffness and relaxation length, each with its uncertainty."""

from tyre.errors import InputError
from tyre.properties import TyreProperties
from tyre.tables import MeasuredTable
from tyre.tyre_map import TyreMap, available_tyres

__all__ = ["InputError", "MeasuredTable", "TyreMap", "TyreProperties", "available_tyres"]
