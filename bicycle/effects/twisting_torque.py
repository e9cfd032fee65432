"""Twisting torque of a leaning tyre."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class TwistingTorque(Effect):
    """Moment Mz = +k gamma about the vertical that turns a leaning wheel into the lean.

    The inner side of the contact patch rolls on a smaller radius than the outer side. Under no_slip it acts as well.
    With a pneumatic_trail, whose moment -t F includes the camber force, it is the remaining moment due to camber.
    Source: Cossalter, Motorcycle Dynamics, ch. 2; Pacejka, Tire and Vehicle Dynamics, ch. 11.
    """

    twisting_stiffness = Parameter(
        "N m/rad",
        "moment into the lean, per camber angle",
        typical=(2.4, 12.0),
        evidence="measured on a Schwalbe 28 x 1.75 at 300 to 600 N, 3 to 5 bar",
        default=5.0,
        neutral=0.0,
        least=0.1,
        per_wheel=True,
        tyre="twisting_stiffness",
        tyre_beside="pneumatic_trail",
    )
    source = "Cossalter, Motorcycle Dynamics, ch. 2; Pacejka, Tire and Vehicle Dynamics, ch. 11"
    signature = "capsize becomes more stable: the bicycle steers into the lean"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.add_moment(self.twisting_stiffness[wheel] * wheel.camber)
