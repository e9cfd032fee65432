"""Numbers of a model that commands read, vary and sample."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "axes": (
            "axis_of",
            "numbers_by_name",
            "ranges_by_name",
            "typical_range",
        ),
        "changed_model": (
            "ModelSpace",
            "changed_content",
            "near_to",
        ),
        "command_options": (
            "Number",
            "check_memory",
        ),
        "model_argument": ("choose",),
        "model_example": (
            "example_model",
            "typical_values",
        ),
        "outputs": (
            "MODE",
            "MODEL",
            "OUTPUTS",
            "ROOTS",
            "output",
        ),
        "run_argument": ("file_and_speed", "ride_file_and_speed"),
        "sampling": (
            "BoundedDraws",
            "Refused",
            "left_out",
            "possible_moments",
        ),
    },
)
