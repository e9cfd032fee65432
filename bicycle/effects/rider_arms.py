"""Hands on the handlebar."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class RiderArms(Effect):
    """Arms as a moment of inertia, a spring and a damper between the rear frame and the steering.

    The inertia moves with the steer angle only.
    """

    inertia = Parameter(
        "kg m^2", "of the arms about the steer axis", typical=(0.05, 0.2), default=0.1, neutral=0.0, least=0.005
    )
    stiffness = Parameter(
        "N m/rad", "of the arms against steering", typical=(0.0, 30.0), default=5.0, neutral=0.0, least=0.1
    )
    damping = Parameter(
        "N m s/rad", "of the arms against steering", typical=(0.2, 3.0), default=1.0, neutral=0.0, least=0.02
    )
    source = "Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50; Klinger et al. (2014), ibid. 52 (hands)"
    needs_rider = True
    acts_through = "steer_torque"
    signature = "inertia and damping raise the weave speed, the spring lowers it and makes capsize unstable earlier"

    def apply(self, model: ModelBuilder) -> None:
        steer = model.steer
        model.add_inertia(steer, self.inertia)
        model.add_torque(steer, -self.stiffness * steer.angle - self.damping * steer.rate)
