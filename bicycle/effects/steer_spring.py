"""Elastic torque on the steering."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class SteerSpring(Effect):
    """Torque -k steer between rear frame and front assembly, as bent cables and hoses give."""

    stiffness = Parameter(
        "N m/rad", "torque that centres the steering", typical=(0.0, 20.0), default=2.0, neutral=0.0, least=0.1
    )
    source = "Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50 (stiffness on the steering)"
    signature = "weave becomes stable at a lower speed and capsize unstable at a lower speed"
    family = "a spring at the steering"

    def apply(self, model: ModelBuilder) -> None:
        model.add_torque(model.steer, -self.stiffness * model.steer.angle)
