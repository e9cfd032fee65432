"""Every physical effect of ``bicycle.effects`` by the name of its class."""

from bicycle.effect import Effect, registry


def __getattr__(name: str) -> type[Effect]:
    classes = _classes()
    if name not in classes:
        raise AttributeError(f"module {__name__!r} has no effect {name!r}; there are {', '.join(classes)}")
    return classes[name]


def __dir__() -> list[str]:
    return list(_classes())


def _classes() -> dict[str, type[Effect]]:
    return {effect.__name__: effect for effect in registry().values()}
