"""Lateral bending of the fork."""

import math

from bicycle.effects.effect import Mode, Parameter
from bicycle.effects.sprung_joint import SprungJoint
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.door import library

sp = library("sympy")


class ForkBending(SprungJoint):
    """A sprung and damped hinge across the steer axis that carries the front wheel and turns with the handlebar.

    Axis (cos lam, 0, -sin lam) through the steer axis, ``length`` above the point of it next to the wheel centre. A
    lateral force F at the hub moves it by F length^2 / stiffness. With front_compliance, the twist of the frame, it
    is the second joint of the front frame.
    """

    stiffness = Parameter("N m/rad", "of the hinge", typical=(2e3, 2e4), default=6e3, neutral=math.inf, least=4e4)
    damping = Parameter("N m s/rad", "of the hinge", typical=(1.0, 30.0), default=5.0)
    length = Parameter(
        "m",
        "from the wheel centre up to the hinge, along the steer axis",
        bounds=(-2.0, 2.0),
        typical=(0.2, 0.5),
        default=0.38,
    )
    source = (
        "Spierings (1981), Vehicle System Dynamics 10, 21-35; "
        "Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle System Dynamics 50"
    )
    modes = (Mode("fork_bending"),)
    on_request = "not yet tried in blind cases"
    signature = "wobble becomes slower and loses damping, weave loses damping at high speed; as front_compliance"

    def apply(self, model: ModelBuilder) -> None:
        p = model.bicycle
        sine, cosine = sp.sin(p["lam"]), sp.cos(p["lam"])
        hinge_distance = -p["c"] * sine - p["rF"] * cosine - self.length  # of the hinge, down the axis from the ground
        bend = model.add_joint(
            self.identifier,
            axis=(cosine, -sine),
            point=(p["w"] + p["c"] + hinge_distance * sine, hinge_distance * cosine),
            carries={"front wheel"},
            role="fork_bending",
            hangs_on="steer",
        )
        self.spring(model, bend)
