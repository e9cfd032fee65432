"""Bicycle-tyre rig data: cornering stiffness, lateral stiffness and relaxation length, each with its uncertainty.

Every name is imported when it is first used: the command line needs none of them to start.
"""

from importlib import import_module
from typing import Any

__all__ = [
    "InputError",
    "MeasuredTable",
    "TyreMap",
    "TyreProperties",
    "TyreSource",
    "available_tyres",
    "read_tyre",
]

HOME = {
    "InputError": "tyre.base.errors",
    "MeasuredTable": "tyre.maps.tables",
    "TyreMap": "tyre.maps.tyre_map",
    "TyreProperties": "tyre.properties",
    "TyreSource": "tyre.tyre_source",
    "available_tyres": "tyre.maps.find_table",
    "read_tyre": "tyre.find_tyre",
}
"""Name -> its home; ``__init__.pyi`` tells the types."""


def __getattr__(name: str) -> Any:
    if name not in HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(HOME[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *HOME})
