"""A simulated rig, its effects on recordings, and the terms that these add to a fit."""

from tyre.ground.door import room

_NAMES = {
    "effect": "OUTSIDE PullTerms Recorded RigEffect RigParameter RigTyre SweepTerms Term declared needs_pull "
    "needs_sweep register rig_effects rig_terms simulated_effects",
    "effects.mechanics": "Remounting RigFriction RimCompliance SteeringPlay",
    "effects.sensors": "DialGauge Dropouts ForceGainBySign LoadCellDrift Noise SensorGain",
    "effects.tyre": "DrumCurvature PlySteer TemperatureDrift",
    "simulator": "CampaignPlan Protocol default_effects set_effect simulate_pull simulate_step simulate_sweep "
    "synthetic_tyre write_campaign_files",
}
__getattr__, __dir__ = room(__name__, {file: names.split() for file, names in _NAMES.items()})
