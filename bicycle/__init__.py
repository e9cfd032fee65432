"""Lateral dynamics of a bicycle on tyres: a model, its effects, its modes and its critical speeds.

>>> from bicycle import Model, load_bicycle, modes
>>> round(Model(load_bicycle("benchmark")).linear_model().eigenvalues(5.0)[-1].real, 5)
-0.32287
>>> modes(Model(load_bicycle("benchmark")), [5.0]).names
('weave', 'capsize', 'castering')

What is computed from a model is imported when it is asked for: a model alone needs none of it.
"""

from importlib import import_module
from typing import Any

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
    "ModelFamily",
    "Parameter",
    "available_bicycles",
    "critical_speeds",
    "effect_class",
    "load_bicycle",
    "load_effects",
    "modes",
    "read_model",
    "registry",
    "respond",
]

LATER = {
    "ModelFamily": "bicycle.model_family",
    "critical_speeds": "bicycle.critical.critical_speeds",
    "modes": "bicycle.modal.named_modes",
    "read_model": "bicycle.files.model_file",
    "respond": "bicycle.responses.linear",
}
"""Name -> its home, for what is imported when it is first used; ``__init__.pyi`` tells the types."""


def __getattr__(name: str) -> Any:
    if name not in LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(LATER[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted({*globals(), *LATER})
