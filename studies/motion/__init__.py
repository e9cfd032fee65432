"""Motion of one model: simulation, animation, closed loop, amplitude, root loci."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "amplitude": ("film_cycle",),
        "animation": (
            "bicycle_drawing",
            "describe",
            "film",
            "modal_motion",
        ),
        "free_decays": (
            "drift_words",
            "judge_decays",
            "notes_of",
            "second_words",
        ),
        "locus": (
            "line_look",
            "parameter_path",
            "parse_range",
            "root_locus",
        ),
        "ride": (
            "available_controls",
            "margins",
            "read_rider_control",
            "rides",
        ),
        "simulation": (
            "parse_initial",
            "parse_inputs",
        ),
        "synthetic_sensors": (
            "LIMITS",
            "RECORDED",
            "Sensor",
            "Sensors",
            "fine_step",
            "apply_lag",
            "read_sensors",
            "record_motion",
        ),
    },
)
