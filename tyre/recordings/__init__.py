"""Recordings of a rig: channels, clock, noise, quality, and the run in SI that a fit takes."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "channels": (
            "read_records",
            "records",
        ),
        "clock": (
            "check_clock",
            "fills",
            "how_to",
        ),
        "draft": ("draft_map",),
        "noise": (
            "correlated_covariance",
            "draw_ar1",
            "noise_constants",
        ),
        "recording": (
            "Condition",
            "LateralStiffnessTest",
            "RigRun",
            "check_channels",
            "check_condition",
        ),
        "run_checks": ("preflight",),
        "signal_quality": (
            "quality",
            "resolution",
        ),
    },
)
