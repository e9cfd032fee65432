"""Spin of what turns in the frame: engine, hub motor, crank, flywheel."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class RotatingMass(Effect):
    """A rotor in the main frame, its axle across: it adds spin momentum, its mass is part of the frame.

    It turns ``ratio`` times as fast as the rear wheel, and ``spin`` at any speed; both are positive if it turns as the
    wheels do. Momentum h = inertia (ratio v / rR + spin): yaw rate r and lean rate p give the torques -h r about the
    forward axis and h p about the vertical.
    """

    inertia = Parameter("kg m^2", "of the rotor about its axle", typical=(0.0, 0.1), default=0.01, neutral=0.0)
    ratio = Parameter("1", "turns for one turn of the rear wheel", bounds=ANY, typical=(-5.0, 20.0), default=1.0)
    spin = Parameter("rad/s", "further spin, at any speed", bounds=ANY, typical=(-500.0, 1000.0), default=0.0)
    source = "Cossalter, Motorcycle Dynamics, ch. 4 (gyroscopic effects of the engine); Sharp (1971)"
    on_request = "known to its owner"
    signature = "a rotor that turns as the wheels do raises the capsize speed, one that turns backwards lowers it"

    def apply(self, model: ModelBuilder) -> None:
        momentum = self.inertia * (self.ratio * model.speed / model.bicycle["rR"] + self.spin)
        model.add_spin("rear frame", momentum)
