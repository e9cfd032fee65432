"""Torques that a measurement asks for and no effect explains."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


def _gains(state: str, size: float) -> tuple[Parameter, ...]:
    """Coefficient of ``what``, its slope and curvature over speed; usual ``size`` in N m/rad or N m s/rad."""
    unit = "N m s/rad" if "rate" in state else "N m/rad"
    return tuple(
        Parameter(unit, f"{state}, {of}", bounds=ANY, typical=(-size, size), default=0, neutral=0, without_cause=True)
        for of in ("at the middle speed", "its change over a span of speed", "its curvature")
    )


class UnmodelledTorque(Effect):
    """Steer and lean torque, each linear in lean, steer and their rates, with coefficients that change with speed.

    Torque = sum of (k + k_slope x + k_curve x^2) state with x = (v - middle_speed) / speed_span, so that all three have
    the unit of k, which holds at the middle speed. Positive torques act like the inputs steer_torque and lean_torque:
    a steering damper is a negative steer_from_steer_rate. It is empirical: the diagnosis fits it to what it cannot
    name. Outside the speeds of its measurement, middle_speed - speed_span to middle_speed + speed_span, it is a guess.
    Usual sizes scale sliders and the prior of that fit: of the steer torque 20 N m/rad of lean, 10 of steer, 4 and
    2 N m s/rad of their rates; of the lean torque 100, 40, 20 and 10; slopes and curvatures have the size of their k.
    """

    middle_speed = Parameter("m/s", "of the measurement behind it", typical=(2.0, 20.0), default=5.0, chosen=True)
    speed_span = Parameter(
        "m/s",
        "half the range of measured speeds",
        bounds=(1e-3, float("inf")),
        typical=(0.5, 10.0),
        default=1.0,
        chosen=True,
    )
    steer_from_lean, steer_from_lean_slope, steer_from_lean_curve = _gains("steer torque over lean", 20.0)
    steer_from_steer, steer_from_steer_slope, steer_from_steer_curve = _gains("steer torque over steer", 10.0)
    steer_from_lean_rate, steer_from_lean_rate_slope, steer_from_lean_rate_curve = _gains(
        "steer torque over lean rate", 4.0
    )
    steer_from_steer_rate, steer_from_steer_rate_slope, steer_from_steer_rate_curve = _gains(
        "steer torque over steer rate", 2.0
    )
    lean_from_lean, lean_from_lean_slope, lean_from_lean_curve = _gains("lean torque over lean", 100.0)
    lean_from_steer, lean_from_steer_slope, lean_from_steer_curve = _gains("lean torque over steer", 40.0)
    lean_from_lean_rate, lean_from_lean_rate_slope, lean_from_lean_rate_curve = _gains(
        "lean torque over lean rate", 20.0
    )
    lean_from_steer_rate, lean_from_steer_rate_slope, lean_from_steer_rate_curve = _gains(
        "lean torque over steer rate", 10.0
    )
    source = "none: linear in the state as a controller identified by Moore (2012), Human Control of a Bicycle, ch. 8"
    signature = "what is left when the rest of the model is right; it stands for a cause that is not known"
    nameable = False

    def apply(self, model: ModelBuilder) -> None:
        x = (model.speed - self.middle_speed) / self.speed_span
        for coordinate in (model.steer, model.lean):
            for of in (model.lean, model.steer):
                for state, motion in ((of.name, of.angle), (f"{of.name}_rate", of.rate)):
                    gain = f"{coordinate.name}_from_{state}"
                    k, slope, curve = (getattr(self, gain + degree) for degree in ("", "_slope", "_curve"))
                    model.add_torque(coordinate, (k + slope * x + curve * x**2) * motion)
