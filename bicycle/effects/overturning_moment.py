"""Overturning moment of a tyre."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class OverturningMoment(Effect):
    """Moment Mx = -overturning_stiffness gamma - arm F about the forward axis of a leaning tyre with lateral force F.

    The load of a leaning tyre acts outside its plane, and a lateral force shifts the contact sideways under the load.
    Of a tyre of radius rho crown_radius does the first exactly; give here what is measured beyond it.
    """

    requires = ("contact force",)
    why = "it is of a tyre that a lateral force bends; use side_slip or relaxation_length"
    overturning_stiffness = Parameter(
        "N m/rad",
        "moment against the lean, per camber angle",
        bounds=ANY,
        typical=(-5.0, 10.0),
        default=2.0,
        neutral=0.0,
        least=0.2,
        per_wheel=True,
    )
    arm = Parameter(
        "m",
        "moment per lateral force: load over lateral stiffness",
        bounds=ANY,
        typical=(0.0, 0.01),
        default=0.0,
        neutral=0.0,
        per_wheel=True,
    )
    source = "Pacejka, Tire and Vehicle Dynamics, ch. 4 (Mx) and 11; Sharp, Evangelou & Limebeer (2004)"
    on_request = "not yet tried in blind cases"
    signature = "against the lean (positive): weave becomes stable and capsize unstable at a lower speed"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            moment = -self.overturning_stiffness[wheel] * wheel.camber - self.arm[wheel] * wheel.lateral_force
            model.add_roll_moment(wheel.body, moment)
