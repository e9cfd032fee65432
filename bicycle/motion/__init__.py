"""Motion in time: responses, tyres that saturate, limit cycles."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "kicks": ("kick_thresholds",),
        "limit_cycles": (
            "LimitCycles",
            "Onset",
            "find_limit_cycles",
        ),
        "nonlinear": (
            "CurveTyre",
            "MagicTyre",
            "magic_formula_model",
        ),
        "responses": (
            "Response",
            "discretise",
            "frequency_response",
            "from_rest",
            "march",
            "modal_response",
            "powers_of",
            "respond",
        ),
    },
)
