"""Measured tyres over load and pressure, from tables and tyre files."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "contact_patch": (
            "half_length_under_load",
            "string_trail",
        ),
        "find_tyre": (
            "packaged_formulas",
            "read_tyre",
        ),
        "map_files": (
            "read_folder",
            "read_table",
            "write_table",
        ),
        "tyre_map": (
            "TyreMap",
            "predicted_column",
        ),
    },
)
