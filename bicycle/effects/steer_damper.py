"""Viscous damping of the steering."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class SteerDamper(Effect):
    """Torque -c d(steer)/dt between rear frame and front assembly (Sharp 1971)."""

    damping = Parameter("N m s/rad", "steering damper", typical=(0.0, 5.0), default=0.5, neutral=0.0, least=0.02)
    source = "Sharp (1971), J. Mech. Eng. Sci. 13(5), 316-329"
    signature = "wobble gains damping, weave at high speed loses some"
    family = "damping at the steering"

    def apply(self, model: ModelBuilder) -> None:
        model.add_torque(model.steer, -self.damping * model.steer.rate)
