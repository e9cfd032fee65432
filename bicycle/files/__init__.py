"""Bicycle files in all forms, and bicycles scaled from a few numbers."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "bicycle_files": (
            "WRITERS",
            "available_bicycles",
            "load_bicycle",
            "read_bicycles",
            "to_text",
            "to_toml",
            "to_yaml",
        ),
        "matrix_file": ("holds_matrices",),
        "scaled_bicycle": (
            "FEATURES",
            "Geometry",
            "MAKES",
            "feature",
            "features_of",
            "guess_bicycle",
            "measured_bicycles",
            "values_of",
            "with_rider",
        ),
        "wheel_size": (
            "SIZES",
            "read_wheel_size",
        ),
    },
)
