"""Named modes, critical speeds, their sensitivity and uncertainty."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "critical": (
            "CriticalSpeed",
            "CrossingIdentity",
            "OSCILLATORY",
            "REAL",
            "critical_speeds",
            "critical_speeds_of_many",
            "by_identity",
        ),
        "crossing_search": ("bialternate_sum",),
        "mode_figure": (
            "LOOKS",
            "UNSTABLE",
            "mode_look",
            "mode_marker",
        ),
        "named_modes": (
            "UNITS",
            "mode_events",
            "modes",
        ),
        "naming": (
            "Rules",
            "known_modes",
            "name_stack",
        ),
        "propagation": (
            "CriticalInterval",
            "critical_intervals",
            "critical_speed_estimates",
            "critical_speed_gradients",
            "mode_sd",
            "model_covariance",
            "standard_deviation",
            "zero_within",
        ),
        "sensitivity": (
            "critical_speed_sensitivities",
            "pair_sensitivities",
            "sensitivities",
        ),
        "tracking": (
            "branch_crossings",
            "follow_branches",
        ),
    },
)
