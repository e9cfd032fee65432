"""Lateral dynamics of a bicycle on tyres: a model, its effects, its modes and its critical speeds.

>>> from bicycle import Model, load_bicycle, modes
>>> round(Model(load_bicycle("benchmark")).linear_model().eigenvalues(5.0)[-1].real, 5)
-0.32287
>>> modes(Model(load_bicycle("benchmark")), [5.0]).names
('weave', 'capsize', 'castering')

What is computed from a model is imported when it is asked for: a model alone needs none of it.
"""

from bicycle.bicycle_files import available_bicycles, load_bicycle
from bicycle.effect import Effect, Mode, Parameter
from bicycle.effect_registry import effect_class, load_effects, registry
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.parameters import Bicycle
from tyre.door import door

__all__ = [
    "Bicycle", "Effect", "LinearModel", "Mode", "Model", "ModelFamily", "Parameter", "available_bicycles",
    "critical_speeds", "effect_class", "load_bicycle", "load_effects", "modes", "read_model", "registry", "respond",
]  # fmt: skip

LATER = {
    "ModelFamily": "bicycle.model_family", "critical_speeds": "bicycle.critical", "modes": "bicycle.named_modes",
    "read_model": "bicycle.model_file", "respond": "bicycle.responses",
}  # fmt: skip
"""Name -> its home, for what is imported when it is first used; ``__init__.pyi`` tells the types."""

__getattr__, __dir__ = door(__name__, LATER)
