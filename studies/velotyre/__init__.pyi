# Written by python -m studies.door_stubs from the door's table and the declarations of the effects.

from bicycle import (
    Bicycle,
    Effect,
    LinearModel,
    Mode,
    Model,
    Parameter,
    available_bicycles,
    effect_class,
    load_bicycle,
    load_effects,
    registry,
)
from bicycle.critical import CriticalSpeed, critical_speeds
from bicycle.inputs import InputHistory, doublet, pulse, step
from bicycle.model_file import build_model, read_model
from bicycle.named_modes import Modes, modes
from bicycle.responses import FrequencyResponse, Response, frequency_response, respond
from studies.diagnosis import diagnose, read_measurement
from tyre import InputError, MeasuredTable, TyreMap, TyreProperties, TyreSource, available_tyres, read_tyre
from tyre.pull_test import fit_pull_test
from tyre.recording_files import read_recording
from tyre.slip_sweep import fit_slip_sweep

from . import effects
from .effects import (
    AerodynamicDrag,
    AligningMoment,
    BarBag,
    CamberThrust,
    ContactLength,
    CrownRadius,
    FrontCompliance,
    Luggage,
    NoSlip,
    PneumaticTrail,
    RelaxationLength,
    ResidualTorque,
    RiderArms,
    RiderLean,
    SideSlip,
    SteerAssist,
    SteerDamper,
    SteerMotor,
    SteerSpring,
    TwistingTorque,
    WheelCompliance,
)

PLACES: dict[str, tuple[str, ...]]

__all__ = [
    "AerodynamicDrag",
    "AligningMoment",
    "BarBag",
    "Bicycle",
    "CamberThrust",
    "ContactLength",
    "CriticalSpeed",
    "CrownRadius",
    "Effect",
    "FrequencyResponse",
    "FrontCompliance",
    "InputError",
    "InputHistory",
    "LinearModel",
    "Luggage",
    "MeasuredTable",
    "Mode",
    "Model",
    "Modes",
    "NoSlip",
    "Parameter",
    "PneumaticTrail",
    "RelaxationLength",
    "ResidualTorque",
    "Response",
    "RiderArms",
    "RiderLean",
    "SideSlip",
    "SteerAssist",
    "SteerDamper",
    "SteerMotor",
    "SteerSpring",
    "TwistingTorque",
    "TyreMap",
    "TyreProperties",
    "TyreSource",
    "WheelCompliance",
    "available_bicycles",
    "available_tyres",
    "build_model",
    "critical_speeds",
    "diagnose",
    "doublet",
    "effect_class",
    "effects",
    "fit_pull_test",
    "fit_slip_sweep",
    "frequency_response",
    "load_bicycle",
    "load_effects",
    "modes",
    "pulse",
    "read_measurement",
    "read_model",
    "read_recording",
    "read_tyre",
    "registry",
    "respond",
    "step",
]
