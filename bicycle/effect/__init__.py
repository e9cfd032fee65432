"""What an effect is, how it is declared, and which there are: packaged, of installed packages, of a user's files."""

from bicycle.derivation.declarations import Mode
from bicycle.effect.base import Effect
from bicycle.effect.parameter import WHEELS, Parameter, PerWheel, PerWheelValue
from bicycle.effect.registry import (
    effect_class,
    load_effects,
    outside_effects,
    outside_origins,
    packaged_effects,
    register,
    registry,
    take_over,
)  # fmt: skip

__all__ = [
    "WHEELS", "Effect", "Mode", "Parameter", "PerWheel", "PerWheelValue", "effect_class", "load_effects",
    "outside_effects", "outside_origins", "packaged_effects", "register", "registry", "take_over",
]  # fmt: skip
