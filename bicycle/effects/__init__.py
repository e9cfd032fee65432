"""The physical effects, one per file; the file's name is the effect's identifier. Classes are found by their names."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bicycle.effect import Effect


def __getattr__(name: str) -> "type[Effect]":
    if name.startswith("__") or name not in _classes():
        raise AttributeError(f"module {__name__!r} has no effect {name!r}; there are {', '.join(_classes())}")
    return _classes()[name]


def __dir__() -> list[str]:
    return list(_classes())


def _classes() -> "dict[str, type[Effect]]":
    from bicycle.effect_registry import registry

    return {effect.__name__: effect for effect in registry().values()}
