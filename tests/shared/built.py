"""Models of a bicycle (packaged by its name, or any) from keyword tables of effects."""

from collections.abc import Mapping
from typing import Any

from bicycle import Bicycle, Effect, LinearModel, Model, effect_class


def effect(identifier: str, /, **parameters: Any) -> Effect:
    """An effect with these parameters."""
    return effect_class(identifier)(**parameters)


def built(bicycle: Bicycle | str = "benchmark", /, **tables: Mapping[str, Any]) -> Model:
    """The model with an effect for each table."""
    return Model(bicycle, [effect(name, **table) for name, table in tables.items()])


def linear(bicycle: Bicycle | str = "benchmark", /, **tables: Mapping[str, Any]) -> LinearModel:
    """The same with numbers."""
    return built(bicycle, **tables).linear_model()
