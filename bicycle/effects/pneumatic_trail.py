"""Aligning moment of the lateral force."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class PneumaticTrail(Effect):
    """The lateral force acts behind the contact centre: Mz = -t F on both wheels, camber part included.

    Under no_slip F is the constraint force.
    """

    slot = "aligning moment"
    requires = ("contact force",)
    falls_with_slip = True  # its moment in the nonlinear model
    why = "the aligning moment needs a lateral force"
    # smallest: a third of half the contact length (brush model, Pacejka ch. 3), which is 20 mm at least
    trail = Parameter(
        "m",
        "distance of the lateral force behind the contact centre",
        bounds=(0.0, 0.2),
        typical=(0.0, 0.03),
        default=0.017,
        neutral=0.0,
        least=1e-3,
        smallest=0.0067,
        per_wheel=True,
        tyre="pneumatic_trail",
    )
    source = "Pacejka, Tire and Vehicle Dynamics, ch. 3"
    signature = "lengthens the trail of a bicycle: weave changes its damping and the capsize speed falls"
    family = "an aligning moment of the tyre"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.add_moment(-self.trail[wheel] * wheel.lateral_force)
