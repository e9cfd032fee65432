"""The bicycle as data: its 25 parameters, their covariance, and rigid bodies."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "bicycle": (
            "BOUNDS",
            "Bicycle",
            "TYPICAL",
            "UNITS",
            "doubts_about",
        ),
        "parameter_covariance": (
            "ParameterCovariance",
            "ParameterKey",
            "WHEELS",
            "checked_covariance",
            "entries_of",
        ),
        "possible_inertia": (
            "bounds_beside",
            "fitting_moments",
            "inertia_coordinates",
            "is_rod",
        ),
        "front_hinge": (
            "FRONT",
            "critical_damping",
            "front_inertia",
            "front_line",
            "front_words",
            "height_above_hub",
            "hinge_at",
        ),
        "rigid_bodies": ("Body",),
    },
)
