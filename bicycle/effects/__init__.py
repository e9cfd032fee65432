"""The physical effects, one per file, and the registry that finds them; a file's name is the effect's identifier.

Classes of effects are found by their names: ``bicycle.effects.SteerDamper``.
"""

from typing import TYPE_CHECKING, Any

from tyre.ground.door import room
from tyre.ground.renamed import now_called

if TYPE_CHECKING:
    from bicycle.effects.effect import Effect

_get_machinery, _list_machinery = room(
    __name__,
    {
        "effect": ("Effect", "Mode", "Parameter", "WHEELS", "effect_of"),
        "effect_docs": ("describe",),
        "effect_registry": (
            "effect_class",
            "model_workers",
            "outside_effects",
            "packaged_effects",
            "register",
            "registry",
        ),
    },
)


def __getattr__(name: str) -> Any:
    if name in _list_machinery():
        return _get_machinery(name)
    if name.startswith("__") or name not in _effect_classes():
        names = _effect_classes()
        remedy = now_called(name, names) or f"; there are {', '.join(names)}"
        raise AttributeError(f"module {__name__!r} has no effect {name!r}{remedy}")
    return _effect_classes()[name]


def __dir__() -> list[str]:
    return list(_effect_classes())


def _effect_classes() -> "dict[str, type[Effect]]":
    from bicycle.effects.effect_registry import registry

    return {effect.__name__: effect for effect in registry().values()}
