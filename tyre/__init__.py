"""Bicycle-tyre rig data: cornering stiffness, lateral stiffness and relaxation length, each with its uncertainty."""

from tyre.base.errors import InputError
from tyre.maps.find_table import available_tyres
from tyre.maps.tables import MeasuredTable
from tyre.maps.tyre_map import TyreMap
from tyre.properties import TyreProperties
from tyre.read_tyre import read_tyre
from tyre.tyre_source import TyreSource

__all__ = [
    "InputError",
    "MeasuredTable",
    "TyreMap",
    "TyreProperties",
    "TyreSource",
    "available_tyres",
    "read_tyre",
]
