"""The public API of the library: ``import velotyre as vt``.

A model is a bicycle's name, a file, ``vt.Bicycle``, or ``vt.Model`` with effects; numbers are SI, ``trail``,
``wheelbase``, ``steer_axis_tilt`` and ``head_angle`` (degrees) may stand for ``c``, ``w`` and ``lam``.

>>> import velotyre as vt
>>> tyre = vt.RelaxationLength(cornering_stiffness=6000.0, relaxation_length=0.1)
>>> model = vt.Model("benchmark", tyre)

Bicycles, effects, files: ``Bicycle`` ``Model`` ``load_bicycle`` ``available_bicycles`` ``available_models``
``read_model`` ``build_model``
``effects`` ``load_effects``

>>> vt.load_bicycle("benchmark").replace(trail=0.07)["c"]
0.07

Modes and critical speeds, of one bicycle or over arrays of its numbers: ``modes`` ``critical_speeds`` ``sweep``

>>> vt.critical_speeds(model)[0]
<CriticalSpeed 4.36238 m/s: weave stabilising at 0.5836 Hz>
>>> vt.modes("benchmark", 5.0, trail=[0.06, 0.07, 0.08]).frequency.sel(mode="weave").values.round(3)
array([0.727, 0.718, 0.711])

What matters and its robustness: ``root_locus`` ``sensitivity`` ``uncertainty`` ``chart`` ``design``

>>> [one.mode for one in vt.root_locus(model, "speed", [1, 8]).crossings]
['weave', 'capsize']

Motion: ``simulate`` ``respond`` ``frequency_response`` ``step`` ``pulse`` ``doublet``
``limit_cycles``

>>> vt.simulate("benchmark", 5.0, inputs={"steer_torque": vt.step(0.5, start=1.0)}).outputs["lean"].shape
(1001,)

Tyres and their tests: ``read_tyre`` ``available_tyres`` ``TyreMap`` ``read_recording`` ``fit_slip_sweep``
``fit_lateral_stiffness``

>>> vt.read_tyre("Tyre1").at(load=400.0, pressure=5.5e5).cornering_stiffness.__round__()
6400

Stiffness of a front frame from published figures: ``front_frame``

Forces and slip angles of the tyres on a recorded ride: ``ride_forces``

What a model lacks: ``read_measurement`` ``diagnose`` (``velotyre new m.toml --kind measurement`` writes a first file)

Every name is imported from ``tyre``, ``bicycle`` or ``studies`` when it is asked for; ``help(vt.modes)`` describes one,
``help(vt.RelaxationLength)`` of the parameters of an effect. In a checkout that is not installed, this package is
``studies.velotyre``.
"""

from importlib import import_module
from typing import Any

PLACES = {
    "bicycle": (
        "Bicycle", "Effect", "LinearModel", "Mode", "Model", "Parameter", "available_bicycles", "effect_class",
        "load_bicycle", "load_effects", "registry",
    ),
    "bicycle.stability.critical": ("CriticalSpeed",),
    "bicycle.model.inputs": ("InputHistory", "doublet", "pulse", "step"),
    "bicycle.model.model_file": ("available_models", "build_model", "read_model"),
    "bicycle.stability.named_modes": ("Modes",),
    "bicycle.motion.responses": ("FrequencyResponse", "Response", "frequency_response", "respond"),
    "studies.diagnosis": ("diagnose", "read_measurement"),
    "studies.door.library": (
        "chart", "critical_speeds", "design", "limit_cycles", "modes", "root_locus", "sensitivity", "simulate", "sweep",
        "uncertainty",
    ),
    "studies.front_frame.published": ("front_frame",),
    "studies.rides": ("ride_forces",),
    "tyre": (
        "InputError", "MeasuredTable", "TyreMap", "TyreProperties", "TyreSource", "available_tyres", "read_tyre",
    ),
    "tyre.fits.lateral_stiffness": ("fit_lateral_stiffness",),
    "tyre.fits.slip_sweep": ("fit_slip_sweep",),
    "tyre.fits.recording_files": ("read_recording",),
}  # fmt: skip
"""Module -> its names in this library."""

HOME = {name: module for module, names in PLACES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "effects":
        return import_module(f"{__name__}.effects")
    if name in HOME:
        value = getattr(import_module(HOME[name]), name)
    elif name[:1].isupper():
        value = getattr(import_module(f"{__name__}.effects"), name)
    else:
        from tyre.ground.renamed import now_called

        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{now_called(name, HOME)}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*HOME, *dir(import_module(f"{__name__}.effects")), "effects"})
