"""The door of the library: ``import velotyre as vt``.

>>> import velotyre as vt
>>> bicycle = vt.load_bicycle("benchmark")
>>> tyre = vt.RelaxationLength(cornering_stiffness=6000.0, relaxation_length=0.1)
>>> vt.critical_speeds(vt.Model(bicycle, tyre))[0]
<CriticalSpeed 4.36238 m/s: weave stabilising at 0.5836 Hz>

Nothing is computed here: every name stands in ``tyre``, ``bicycle`` or ``studies`` and is imported when it is asked
for. Effects are classes by their names (``vt.RelaxationLength``), all of them in ``vt.effects``; ``help()`` shows the
parameters of each with unit, typical and allowed values. (In a checkout that is not installed, this package is
``studies.velotyre``.)
"""

from importlib import import_module
from typing import Any

PLACES = {
    "bicycle": (
        "Bicycle", "Effect", "LinearModel", "Mode", "Model", "Parameter", "available_bicycles", "effect_class",
        "load_bicycle", "load_effects", "registry",
    ),
    "bicycle.critical": ("CriticalSpeed", "critical_speeds"),
    "bicycle.inputs": ("InputHistory", "doublet", "pulse", "step"),
    "bicycle.model_file": ("build_model", "read_model"),
    "bicycle.named_modes": ("Modes", "modes"),
    "bicycle.responses": ("FrequencyResponse", "Response", "frequency_response", "respond"),
    "studies.diagnosis": ("diagnose", "read_measurement"),
    "tyre": (
        "InputError", "MeasuredTable", "TyreMap", "TyreProperties", "TyreSource", "available_tyres", "read_tyre",
    ),
    "tyre.pull_test": ("fit_pull_test",),
    "tyre.slip_sweep": ("fit_slip_sweep",),
    "tyre.recording_files": ("read_recording",),
}  # fmt: skip
"""Module -> what of it stands in this door."""

HOME = {name: module for module, names in PLACES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "effects":
        return import_module(f"{__name__}.effects")
    if name in HOME:
        found = getattr(import_module(HOME[name]), name)
    elif name[:1].isupper():
        found = getattr(import_module(f"{__name__}.effects"), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*HOME, *dir(import_module(f"{__name__}.effects")), "effects"})
