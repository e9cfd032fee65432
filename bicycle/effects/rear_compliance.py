"""Flexible swinging arm or rear triangle."""

import math

from bicycle.effects.effect import ANY, Mode, Parameter
from bicycle.effects.sprung_joint import SprungJoint
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.door import library

sp = library("sympy")


class RearCompliance(SprungJoint):
    """A sprung and damped hinge between main frame and rear wheel, which twists out of the plane of the frame.

    Axis (cos axis_tilt, 0, -sin axis_tilt) through (joint_x, 0, joint_z), by default level: the wheel leans.
    """

    stiffness = Parameter("N m/rad", "of the hinge", typical=(2e3, 4e4), default=1e4, neutral=math.inf, least=8e4)
    damping = Parameter("N m s/rad", "of the hinge", typical=(1.0, 50.0), default=10.0)
    joint_x = Parameter("m", "hinge", bounds=ANY, typical=(0.3, 0.6), default=0.42)
    joint_z = Parameter("m", "hinge, z down", bounds=ANY, typical=(-0.5, -0.2), default=-0.3)
    axis_tilt = Parameter(
        "rad",
        "angle of the hinge axis above the horizontal, forward end up",
        bounds=(-math.pi, math.pi),
        typical=(-0.5, 0.5),
        default=0.0,
    )
    source = "Sharp (1974), Vehicle System Dynamics 3, 123-141 (rear frame flexibility of motorcycles)"
    modes = (Mode("rear_compliance"),)
    on_request = "not yet tried in blind cases"
    signature = "weave loses damping at high speed"

    def apply(self, model: ModelBuilder) -> None:
        twist = model.add_joint(
            self.identifier,
            axis=(sp.cos(self.axis_tilt), -sp.sin(self.axis_tilt)),
            point=(self.joint_x, self.joint_z),
            carries={"rear wheel"},
            role="rear_compliance",
        )
        self.spring(model, twist)
