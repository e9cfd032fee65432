"""Elastic torque on the steering."""

import math

from bicycle.derivation.builder import ModelBuilder
from bicycle.effect import Effect, Parameter


class SteerSpring(Effect):
    """Torque -k steer between rear frame and front assembly, as bent cables and hoses give."""

    stiffness = Parameter(
        "N m/rad", "torque that centres the steering",
        bounds=(0.0, math.inf), typical=(0.0, 20.0), default=2.0, neutral=0.0, least=0.1,
    )  # fmt: skip
    source = "Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50 (stiffness on the steering)"
    signature = "weave becomes stable at a lower speed and capsize unstable at a lower speed"

    def apply(self, model: ModelBuilder) -> None:
        model.add_torque(model.steer, -self.stiffness * model.steer.angle)
