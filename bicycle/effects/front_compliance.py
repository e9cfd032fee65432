"""Flexible fork and head tube."""

import math
from collections.abc import Mapping
from typing import Any

import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.effect import Effect, Parameter
from tyre.base.errors import InputError


class FrontCompliance(Effect):
    """A sprung and damped hinge between rear frame and steer axis that carries the whole front assembly.

    Axis (cos axis_tilt, 0, -sin axis_tilt) through (joint_x, 0, joint_z), by default perpendicular to the steer axis.
    Source: Sharp & Alstead (1980), Vehicle System Dynamics 9; Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle System
    Dynamics 50.
    """

    parameters = (
        Parameter(
            "stiffness", "N m/rad", "of the hinge",
            bounds=(0.0, math.inf), typical=(1e3, 1e4), default=3e3, neutral=math.inf,
        ),
        Parameter("damping", "N m s/rad", "of the hinge", bounds=(0.0, math.inf), typical=(1.0, 30.0), default=15.0),
        Parameter("joint_x", "m", "hinge", bounds=(-math.inf, math.inf), typical=(0.7, 1.0)),
        Parameter("joint_z", "m", "hinge, z down", bounds=(-math.inf, math.inf), typical=(-1.0, -0.6)),
        Parameter(
            "axis_tilt", "rad", "angle of the hinge axis above the horizontal, forward end up",
            bounds=(-math.pi, math.pi), typical=(0.0, 0.5), default="lam",
        ),
    )  # fmt: skip
    source = (
        "Sharp & Alstead (1980), Vehicle System Dynamics 9; "
        "Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle System Dynamics 50"
    )
    signature = "wobble at 5-8 Hz becomes unstable at ordinary speeds and stable again above; weave loses damping"
    stiffness: Any
    damping: Any
    joint_x: Any
    joint_z: Any
    axis_tilt: Any

    def check(self, bicycle: Mapping[str, float]) -> None:
        if math.isinf(self.stiffness):
            raise InputError(f"effect {self.identifier!r}: an infinite stiffness is the rigid bicycle; leave it out")

    def apply(self, model: ModelBuilder) -> None:
        twist = model.add_joint(
            self.identifier, axis=(sp.cos(self.axis_tilt), -sp.sin(self.axis_tilt)),
            point=(self.joint_x, self.joint_z), carries={"front frame", "front wheel"},
        )  # fmt: skip
        model.add_torque(twist, -self.stiffness * twist.angle - self.damping * twist.rate)
