"""Lateral dynamics of a bicycle on tyres: a model, its effects, its modes and its critical speeds.

>>> from bicycle import Model, load_bicycle, modes
>>> round(Model(load_bicycle("benchmark")).linear_model().eigenvalues(5.0)[-1].real, 5)
-0.32287
>>> modes(Model(load_bicycle("benchmark")), [5.0]).names
('weave', 'capsize', 'castering')

What is computed from a model is imported when it is asked for: a model alone needs none of it.
"""

from bicycle.effects.effect import Effect, Mode, Parameter
from bicycle.effects.effect_registry import effect_class, load_effects, registry
from bicycle.files.bicycle_files import available_bicycles, load_bicycle
from bicycle.model.model import Model
from bicycle.model.state_space import LinearModel
from bicycle.parameters.bicycle import Bicycle
from tyre.ground.door import door

__all__ = [
    "Bicycle", "Effect", "LinearModel", "Mode", "Model", "ModelFamily", "Parameter", "available_bicycles",
    "critical_speeds", "effect_class", "load_bicycle", "load_effects", "modes", "read_model", "registry", "respond",
]  # fmt: skip

LATER = {
    "ModelFamily": "bicycle.model.model_family",
    "critical_speeds": "bicycle.stability.critical",
    "modes": "bicycle.stability.named_modes",
    "read_model": "bicycle.model.model_file",
    "respond": "bicycle.motion.responses",
}
"""Name -> its module, for what is imported when it is first used; ``__init__.pyi`` holds the types."""

__getattr__, __dir__ = door(__name__, LATER)
