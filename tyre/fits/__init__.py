"""From a run to cornering stiffness, lateral stiffness and relaxation length, each with its uncertainty."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "campaign": (
            "Campaign",
            "fit_campaign",
            "measured_tables",
            "points_of",
            "recordings_in",
            "write_tables",
        ),
        "condition": (
            "FitSettings",
            "Key",
            "RecordingSummary",
            "Repeatability",
            "check_plausible",
            "check_repeats",
            "combine",
            "combine_campaign",
            "near_conditions",
            "pooled_repeatability",
            "refuse_infinite",
            "repeat_warnings",
            "with_camber",
        ),
        "friction": ("dahl_friction",),
        "lateral_stiffness": ("fit_lateral_stiffness",),
        "recording_files": (
            "read_events",
            "read_recording",
            "write_csv",
        ),
        "relaxation": (
            "agreement",
            "first_order_lag",
            "fit_slip_step",
            "is_slip_step",
            "mean_length",
            "mean_of_steps",
            "relaxation_from_stiffness",
            "relaxation_from_two_rates",
        ),
        "segments": (
            "split",
            "stretches",
        ),
        "slip_sweep": ("fit_slip_sweep",),
        "sweep_curve": (
            "block_means",
            "interpolate_slip",
            "lagged_magic_formula",
            "samples_used",
            "slip_reversals",
            "solve_least_squares",
        ),
        "tydex_recording": ("write_tydex",),
    },
)
