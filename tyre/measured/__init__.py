"""Properties of a tyre at one load and pressure, their tables and their plausible ranges."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "plain_table": ("read_plain_table",),
        "plausible": (
            "ABSURD",
            "BANDS",
            "SLIPS",
            "doubt",
            "doubts",
            "suspicion",
            "table_doubts",
        ),
        "properties": (
            "Calibration",
            "Estimate",
            "REPEATABILITY_DOF",
            "combine_uncertainties",
            "out_of_reach",
            "wheel_properties",
        ),
        "tables": (
            "CommonCalibration",
            "MeasuredColumn",
            "common_lateral_stiffness",
        ),
    },
)
