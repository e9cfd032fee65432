"""A simulated rig, its effects on recordings, and the terms that these add to a fit."""

from tyre.rig.effect import (
    OUTSIDE,
    PullTerms,
    Recorded,
    RigEffect,
    RigParameter,
    RigTyre,
    SweepTerms,
    Term,
    declared,
    needs_pull,
    needs_sweep,
    register,
    rig_effects,
    rig_terms,
    simulated_effects,
)
from tyre.rig.effects.mechanics import Remounting, RigFriction, RimCompliance, SteeringPlay
from tyre.rig.effects.sensors import DialGauge, Dropouts, ForceGainBySign, LoadCellDrift, Noise, SensorGain
from tyre.rig.effects.tyre import DrumCurvature, PlySteer, TemperatureDrift
from tyre.rig.simulator import (
    CampaignPlan,
    Protocol,
    default_effects,
    set_effect,
    simulate_pull,
    simulate_step,
    simulate_sweep,
    synthetic_tyre,
    write_campaign_files,
)

__all__ = [
    "OUTSIDE", "CampaignPlan", "DialGauge", "Dropouts", "DrumCurvature", "ForceGainBySign", "LoadCellDrift", "Noise",
    "PlySteer", "Protocol", "PullTerms", "Recorded", "Remounting", "RigEffect", "RigFriction", "RigParameter",
    "RigTyre", "RimCompliance", "SensorGain", "SteeringPlay", "SweepTerms", "TemperatureDrift", "Term", "declared",
    "default_effects", "needs_pull", "needs_sweep", "register", "rig_effects", "rig_terms", "set_effect",
    "simulate_pull", "simulate_step", "simulate_sweep", "simulated_effects", "synthetic_tyre", "write_campaign_files",
]  # fmt: skip
