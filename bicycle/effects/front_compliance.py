"""Flexible fork and head tube."""

import math
from collections.abc import Mapping

from bicycle.effects.effect import ANY, Mode, Parameter
from bicycle.effects.sprung_joint import SteerAxisHinge
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.front_hinge import front_inertia
from tyre.ground.door import library

sp = library("sympy")


class FrontCompliance(SteerAxisHinge):
    """A sprung and damped hinge between rear frame and steer axis that carries the whole front assembly.

    Axis (cos axis_tilt, 0, -sin axis_tilt) through (joint_x, 0, joint_z), by default perpendicular to the steer axis.
    ``damping_ratio``, of the front frame on its hinge with the rear frame held, may replace ``damping``.
    ``height_above_hub``, m along the steer axis from its point nearest to the front hub, may replace ``joint_x`` and
    ``joint_z``.
    """

    stiffness = Parameter("N m/rad", "of the hinge", typical=(1e3, 1e4), default=5e3, neutral=math.inf, least=2e4)
    damping = Parameter(
        "N m s/rad",
        "of the hinge",
        typical=(5.0, 40.0),
        evidence="assumed for frame and seated rider together, where the rider is fixed; agrees with riders' reports; "
        "20 at 5000 N m/rad is a damping ratio of 0.12 to 0.24",
        default=20.0,
    )
    joint_x = Parameter("m", "hinge; or height_above_hub for both", bounds=ANY, typical=(0.7, 1.0))
    # A fork that bends alone, clamped at its crown, turns about a point two thirds of its length above the axle.
    joint_z = Parameter(
        "m",
        "hinge, z down",
        bounds=ANY,
        typical=(-1.0, -0.55),
        evidence="by beam models racing frames tilt about a point 0.25 to 0.38 m above the front hub",
    )
    axis_tilt = Parameter(
        "rad",
        "angle of the hinge axis above the horizontal, forward end up",
        bounds=(-math.pi, math.pi),
        typical=(0.0, 0.5),
        default="lam",
    )
    source = (
        "Sharp & Alstead (1980), Vehicle System Dynamics 9; "
        "Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle System Dynamics 50"
    )
    modes = (Mode("front_compliance", marks=("front_compliance", "front"), place=5, look=1),)
    signature = "wobble at 5-8 Hz becomes unstable at ordinary speeds and stable again above; weave loses damping"

    def carried_inertia(self, values: Mapping[str, float]) -> float:
        """Moment of inertia (kg m^2) of the front frame and its wheel about the hinge, the rear frame held."""
        place = {key: values[key] for key in ("joint_x", "joint_z", "axis_tilt")}
        return float(front_inertia(values, **place))

    def apply(self, model: ModelBuilder) -> None:
        twist = model.add_joint(
            self.identifier,
            axis=(sp.cos(self.axis_tilt), -sp.sin(self.axis_tilt)),
            point=(self.joint_x, self.joint_z),
            carries={"front frame", "front wheel"},
            role="front_compliance",
        )
        self.spring(model, twist)
