"""Bicycle-tyre rig data: cornering stiffness, lateral stiffness and relaxation length, each with its uncertainty.

Every name is imported when it is first used: the command line needs none of them to start.
"""

from tyre.ground.door import door

__all__ = [
    "InputError", "MeasuredTable", "TyreMap", "TyreProperties", "TyreSource", "available_tyres", "read_tyre",
]  # fmt: skip

HOME = {
    "InputError": "tyre.ground.errors", "MeasuredTable": "tyre.measured.tables", "TyreMap": "tyre.maps.tyre_map",
    "TyreProperties": "tyre.measured.properties", "TyreSource": "tyre.measured.properties",
    "available_tyres": "tyre.maps.map_files", "read_tyre": "tyre.maps.find_tyre",
}  # fmt: skip
"""Name -> its module; ``__init__.pyi`` holds the types."""

__getattr__, __dir__ = door(__name__, HOME)
