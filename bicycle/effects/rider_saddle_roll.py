"""Seated rider who rolls on the saddle."""

import math

from bicycle.effects.effect import ANY, Mode, Parameter
from bicycle.effects.sprung_joint import SprungJoint
from bicycle.equations.lateral import ModelBuilder


class RiderSaddleRoll(SprungJoint):
    """A sprung, damped hinge along x at height joint_z that carries the seated rider of rider_saddle.

    It moves with the hinge along z. For roll alone give the same body to rider_lean. With rider_lean the upper body
    also leans against the seated one.
    """

    requires = ("seated rider",)
    why = "it carries the body of another hinge; use rider_saddle, or rider_lean for roll alone"
    joint_z = Parameter("m", "height of the saddle, z down", bounds=ANY, typical=(-1.05, -0.85), default=-0.95)
    stiffness = Parameter(
        "N m/rad", "of the hinge", typical=(1e3, 5e3), evidence="assumed", default=3e3, neutral=math.inf, least=3e4
    )
    damping = Parameter(
        "N m s/rad", "of the hinge", typical=(15.0, 200.0), evidence="assumed: a ratio of 0.1 to 0.5", default=60.0
    )
    source = "Doria, Tognazzo & Cossalter (2013), Proc. IMechE D 227, 561-576 (riders shaken in roll)"
    modes = (Mode("rider_roll", place=8),)
    needs_rider = True
    rank = 1
    family = "the rider's body"
    signature = "as rider_lean, of the whole body: weave changes where a rider mode at 2-4 Hz comes close"

    def apply(self, model: ModelBuilder) -> None:
        roll = model.add_joint(
            self.identifier,
            axis=(1, 0),
            point=(0, self.joint_z),
            carries={"seated rider"},
            role="rider_roll",
            hangs_on=model.rider_joint,
        )
        model.seat_rider(roll, "seated rider")
        self.spring(model, roll)
