"""Random (synthetic) models for validations: packaged bicycles with every parameter off, effects drawn at random."""

from typing import Any

import numpy as np

from bicycle.effects import WHEELS, Effect, effect_class, registry
from bicycle.files import available_bicycles, load_bicycle
from bicycle.model import Model
from tyre.ground import InputError


def random_model(
    generator: np.random.Generator, *, contact_laws: tuple[str, ...], share: float, bicycles: tuple[str, ...] = (),
    decades: float = 0.0,
) -> Model:  # fmt: skip
    """Draw a model that builds."""
    others = [effect for effect in registry().values() if effect.slot != "contact law"]
    while True:
        base = load_bicycle(str(generator.choice(bicycles or available_bicycles())))
        changes = {key: value * generator.uniform(0.85, 1.15) for key, value in base.values.items() if key != "g"}
        law = effect_class(str(generator.choice(contact_laws)))
        chosen = [law, *(effect for effect in others if generator.random() < share)]
        try:
            effects = tuple(random_effect(effect, generator, decades) for effect in chosen)
            model = Model(base.replace(**changes), effects)
            model.linear_model()
        except InputError:
            continue  # no physical bicycle, or effects that do not go together
        return model


def random_effect(effect: type[Effect], generator: np.random.Generator, decades: float = 0.0) -> Effect:
    """Draw every parameter within its typical range, times 10^(-decades .. decades)."""
    values: dict[str, Any] = {}
    for parameter in effect.parameters:
        low, high = parameter.typical
        draw = [low + (high - low) * generator.uniform(0.05, 0.95) for _ in WHEELS]
        if decades:
            draw = [value * 10 ** generator.uniform(-decades, decades) for value in draw]
        if parameter.per_wheel:
            values[parameter.name] = dict(zip(WHEELS, draw, strict=True))
        elif not isinstance(parameter.default, str) or generator.random() < 0.5:
            values[parameter.name] = draw[0]
    return effect(**values)
