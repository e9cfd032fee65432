"""Tyres of a formula: Magic Formula 6.1, .tir files, Pacejka 89."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "magic_formula": (
            "cornering_stiffness",
            "normalised_lateral_force",
            "normalised_lateral_force_slope",
        ),
        "pacejka89": (
            "Pacejka89",
            "Pacejka89Tyre",
            "check_coefficients",
            "read_pacejka89",
        ),
        "tir": (
            "fit_mf52",
            "fit_mf61",
            "parse_tir",
            "read_tir",
            "write_tir",
        ),
        "tir_laws": ("Coefficients",),
    },
)
