"""Torques that a measurement asks for and no effect explains."""

import math

from bicycle.derivation.builder import ModelBuilder
from bicycle.effect import Effect, Parameter

STATES = ("lean", "steer", "lean_rate", "steer_rate")
DEGREES = ("", "_slope", "_curve")


def _gain(what: str, size: float) -> Parameter:
    """A coefficient of ``what``, and its usual ``size`` in N m/rad or N m s/rad."""
    unit = "N m s/rad" if "rate" in what else "N m/rad"
    return Parameter(
        unit, what, bounds=(-math.inf, math.inf), typical=(-size, size), default=0.0, neutral=0.0, without_cause=True
    )


class ResidualTorque(Effect):
    """Steer and lean torque, each linear in lean, steer and their rates, with coefficients that change with speed.

    Torque = sum of (k + k_slope x + k_curve x^2) state with x = (v - middle_speed) / speed_span, so that all three have
    the unit of k, which holds at the middle speed. Positive torques act like the inputs steer_torque and lean_torque:
    a steering damper is a negative steer_from_steer_rate. It has no cause: the diagnosis fits it to what it cannot
    name. Outside the speeds of its measurement, middle_speed - speed_span to middle_speed + speed_span, it is a guess.
    Usual sizes scale sliders and the prior of that fit: of the steer torque 20 N m/rad of lean, 10 of steer, 4 and
    2 N m s/rad of their rates; of the lean torque 100, 40, 20 and 10; slopes and curvatures have the size of their k.
    """

    middle_speed = Parameter(
        "m/s", "of the measurement behind it", bounds=(0.0, math.inf), typical=(2.0, 20.0), default=5.0
    )
    speed_span = Parameter(
        "m/s", "half the range of measured speeds", bounds=(1e-3, math.inf), typical=(0.5, 10.0), default=1.0
    )
    steer_from_lean = _gain("steer torque over lean, at the middle speed", 20.0)
    steer_from_lean_slope = _gain("steer torque over lean, its change over a span of speed", 20.0)
    steer_from_lean_curve = _gain("steer torque over lean, its curvature", 20.0)
    steer_from_steer = _gain("steer torque over steer, at the middle speed", 10.0)
    steer_from_steer_slope = _gain("steer torque over steer, its change over a span of speed", 10.0)
    steer_from_steer_curve = _gain("steer torque over steer, its curvature", 10.0)
    steer_from_lean_rate = _gain("steer torque over lean rate, at the middle speed", 4.0)
    steer_from_lean_rate_slope = _gain("steer torque over lean rate, its change over a span of speed", 4.0)
    steer_from_lean_rate_curve = _gain("steer torque over lean rate, its curvature", 4.0)
    steer_from_steer_rate = _gain("steer torque over steer rate, at the middle speed", 2.0)
    steer_from_steer_rate_slope = _gain("steer torque over steer rate, its change over a span of speed", 2.0)
    steer_from_steer_rate_curve = _gain("steer torque over steer rate, its curvature", 2.0)
    lean_from_lean = _gain("lean torque over lean, at the middle speed", 100.0)
    lean_from_lean_slope = _gain("lean torque over lean, its change over a span of speed", 100.0)
    lean_from_lean_curve = _gain("lean torque over lean, its curvature", 100.0)
    lean_from_steer = _gain("lean torque over steer, at the middle speed", 40.0)
    lean_from_steer_slope = _gain("lean torque over steer, its change over a span of speed", 40.0)
    lean_from_steer_curve = _gain("lean torque over steer, its curvature", 40.0)
    lean_from_lean_rate = _gain("lean torque over lean rate, at the middle speed", 20.0)
    lean_from_lean_rate_slope = _gain("lean torque over lean rate, its change over a span of speed", 20.0)
    lean_from_lean_rate_curve = _gain("lean torque over lean rate, its curvature", 20.0)
    lean_from_steer_rate = _gain("lean torque over steer rate, at the middle speed", 10.0)
    lean_from_steer_rate_slope = _gain("lean torque over steer rate, its change over a span of speed", 10.0)
    lean_from_steer_rate_curve = _gain("lean torque over steer rate, its curvature", 10.0)
    source = "none: linear in the state as a controller identified by Moore (2012), Human Control of a Bicycle, ch. 8"
    signature = "what is left when the rest of the model is right; it stands for a cause that is not known"
    nameable = False

    def apply(self, model: ModelBuilder) -> None:
        x = (model.speed - self.middle_speed) / self.speed_span
        for coordinate in (model.steer, model.lean):
            for state in STATES:
                k, slope, curve = (
                    getattr(self, f"{coordinate.name}_from_{state}{degree}") for degree in DEGREES
                )  # fmt: skip
                of = model.steer if state.startswith("steer") else model.lean
                motion = of.rate if state.endswith("_rate") else of.angle
                model.add_torque(coordinate, (k + slope * x + curve * x**2) * motion)
