"""Symbolic equations of lateral motion and their fast evaluation."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "evaluation": (
            "Evaluator",
            "Matrices",
            "compile_expressions",
            "derive",
        ),
        "held_frame": ("held_equations",),
        "lateral": ("ModelBuilder",),
        "speed_polynomial": ("SpeedPolynomial",),
        "symbolic_polynomial": (
            "SymbolicPolynomial",
            "powers",
        ),
    },
)
