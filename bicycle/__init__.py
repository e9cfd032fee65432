"""Lateral dynamics of a bicycle on tyres: a model, its effects, its modes and its critical speeds.

>>> from bicycle import Model, load_bicycle
>>> round(Model(load_bicycle("benchmark")).linear_model().eigenvalues(5.0)[-1].real, 5)
-0.32287
"""

from bicycle.effect import Effect, Mode, Parameter, effect_class, load_effects, registry
from bicycle.files.bicycle_file import available_bicycles, load_bicycle
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.parameters import Bicycle

__all__ = [
    "Bicycle",
    "Effect",
    "LinearModel",
    "Mode",
    "Model",
    "Parameter",
    "available_bicycles",
    "effect_class",
    "load_bicycle",
    "load_effects",
    "registry",
]
