"""Effects that may be missing behind a wobble that a bicycle with a fixed rider has and riders do not report.

Yaw and roll of a seated rider are effects of the package. The others are declared here: a body that is part of the rear
frame, or of the seated rider, is taken out of it and put back on a sprung, damped joint. None of the stiffnesses was
measured: their ranges are assumed.
"""

import math
from typing import ClassVar

import numpy as np

from bicycle.effects import Effect, Parameter, effect_class
from bicycle.equations import ModelBuilder
from bicycle.parameters import Body, front_inertia
from bicycle.rider import RigidBody, join
from tests.validation.rider_populations import Pair, Ranges, Rival

ANY = (-math.inf, math.inf)
FAR = 100.0  # m below the ground; a hinge along x so far away moves the rider sideways
HINGE_HEIGHT = 0.65  # m, of the axis about which a main frame twists


class MovingBody(Effect):
    """A part of the rider on a joint."""

    mass = Parameter("kg", "of the moving body", typical=(10.0, 100.0))
    x = Parameter("m", "mass centre", bounds=ANY, typical=(0.0, 1.0))
    z = Parameter("m", "mass centre, z down", bounds=ANY, typical=(-1.5, 0.0))
    Ixx = Parameter("kg m^2", "moment of inertia", typical=(0.5, 15.0))
    Izz = Parameter("kg m^2", "moment of inertia", typical=(0.5, 15.0))
    Ixz = Parameter("kg m^2", "tensor entry", bounds=ANY, typical=(-2.0, 2.0))
    body_name: ClassVar[str]

    def move(self, model: ModelBuilder) -> None:
        """Take the body out of what holds the rider, and add it on its own."""
        place, inertia = (self.x, self.z), (self.Ixx, self.Izz, self.Ixz)
        less = tuple(-value for value in inertia)
        model.add_body(Body(self.body_name, self.mass, *place, *inertia))
        model.add_body(Body(f"{self.body_name} taken out", -self.mass, *place, *less, fixed_to=model.rider_body))


class SaddleSway(MovingBody):
    """The whole rider moves sideways on the saddle, an angle of 1 / FAR per metre."""

    identifier = "saddle_sway"
    body_name = "swaying rider"
    sway_stiffness = Parameter("N/m", "sideways, of saddle and body", typical=(1e4, 1e5))
    sway_damping = Parameter("N s/m", "sideways, of saddle and body", typical=(100.0, 3000.0))

    def apply(self, model: ModelBuilder) -> None:
        self.move(model)
        far = model.add_joint("saddle sway", axis=(1, 0), point=(0, FAR), carries={self.body_name})
        model.add_torque(far, -(FAR**2) * (self.sway_stiffness * far.angle + self.sway_damping * far.rate))


class SwayOfASeatedRider(Effect):
    """The same of the rider of rider_saddle, who also turns."""

    identifier = "sway_of_a_seated_rider"
    requires = ("seated rider",)
    rank = 2  # after the hinges that seat the rider
    sway_stiffness = Parameter("N/m", "sideways, of saddle and body", typical=(1e4, 1e5))
    sway_damping = Parameter("N s/m", "sideways, of saddle and body", typical=(100.0, 3000.0))

    def apply(self, model: ModelBuilder) -> None:
        far = model.add_joint(
            "saddle sway", axis=(1, 0), point=(0, FAR), carries={model.rider_body}, hangs_on=model.rider_joint
        )
        model.add_torque(far, -(FAR**2) * (self.sway_stiffness * far.angle + self.sway_damping * far.rate))


class LegsSway(MovingBody):
    """Both legs turn together about the line from hip to pedals: the knees move sideways.

    The line stays in the plane of the frame, also under a rider who turns on the saddle.
    """

    identifier = "legs_sway"
    body_name = "legs"
    hip_x = Parameter("m", "hip, a point of the line", bounds=ANY, typical=(0.0, 1.0))
    hip_z = Parameter("m", "hip, z down", bounds=ANY, typical=(-1.5, 0.0))
    tilt = Parameter("rad", "of the line from hip to pedals below the horizontal", bounds=ANY, typical=(0.5, 1.6))
    legs_stiffness = Parameter("N m/rad", "of hips, and of knees on the top tube", typical=(50.0, 2000.0))
    legs_damping = Parameter("N m s/rad", "of hips, and of knees on the top tube", typical=(1.0, 50.0))

    def apply(self, model: ModelBuilder) -> None:
        import sympy

        self.move(model)
        axis, point = (sympy.cos(self.tilt), sympy.sin(self.tilt)), (self.hip_x, self.hip_z)
        swing = model.add_joint("legs", axis=axis, point=point, carries={"legs"})
        model.add_torque(swing, -self.legs_stiffness * swing.angle - self.legs_damping * swing.rate)


class FrameTorsion(Effect):
    """The main frame twists about a horizontal axis between seat tube and head tube, behind front_compliance."""

    identifier = "frame_torsion"
    stiffness = Parameter("N m/rad", "of the main frame", typical=(3e3, 2e4))
    damping = Parameter("N m s/rad", "of the main frame", typical=(0.5, 20.0))
    joint_z = Parameter("m", "height of the axis, z down", bounds=ANY, typical=(-0.8, -0.5))

    def apply(self, model: ModelBuilder) -> None:
        twist = model.add_joint(
            "frame torsion",
            axis=(1, 0),
            point=(0, self.joint_z),
            carries={"front frame", "front wheel"},
            hangs_on="front_compliance",
        )
        model.add_torque(twist, -self.stiffness * twist.angle - self.damping * twist.rate)


def whole_rider(pair: Pair) -> dict[str, float]:
    """The rider's body."""
    return _numbers(pair.seated.body)


def on_the_saddle(pair: Pair) -> dict[str, float]:
    """The rider's body, with the hip over the saddle on the hinge of rider_saddle."""
    return whole_rider(pair) | {"mass_share": 1.0, "inertia_share": 1.0, "joint_x": float(pair.seated.contacts.hip[0])}


def hip_height(pair: Pair) -> dict[str, float]:
    """Height of the hinge of a rolling rider."""
    return {"joint_z": float(pair.seated.contacts.hip[1])}


def rolling_alone(pair: Pair) -> dict[str, float]:
    """The rider's body on the hinge of rider_lean."""
    return whole_rider(pair) | hip_height(pair)


def both_legs(pair: Pair) -> dict[str, float]:
    """Thighs, shanks and feet, and the line from hip to pedals."""
    hip, pedals = pair.seated.contacts.hip, pair.seated.contacts.pedals
    line = pedals - hip
    place = {"hip_x": float(hip[0]), "hip_z": float(hip[1]), "tilt": math.atan2(line[1], line[0])}
    return _numbers(legs_body(pair)) | place


def legs_body(pair: Pair) -> RigidBody:
    """Both legs as one body."""
    return join([part.body for part in pair.seated.segments if "thigh" in part.name or "shank" in part.name])


def _numbers(body: RigidBody) -> dict[str, float]:
    x, _, z = body.centre.tolist()
    inertia = {name: float(body.inertia[place]) for name, place in (("Ixx", (0, 0)), ("Izz", (2, 2)), ("Ixz", (0, 2)))}
    return {"mass": body.mass, "x": x, "z": z} | inertia


def yaw_inertia(pair: Pair) -> dict[str, float]:
    """Inertia of the rider about the vertical through the hip, kg m^2."""
    body, hip = pair.seated.body, pair.seated.contacts.hip
    return {"": float(body.inertia[2, 2] + body.mass * (body.centre[0] - hip[0]) ** 2)}


def roll_inertia(pair: Pair) -> dict[str, float]:
    """Inertia of the rider about the axis along x through the hip, kg m^2."""
    body, hip = pair.seated.body, pair.seated.contacts.hip
    return {"": float(body.inertia[0, 0] + body.mass * (body.centre[2] - hip[1]) ** 2)}


def swaying_mass(pair: Pair) -> dict[str, float]:
    """Mass of the rider, kg."""
    return {"sway_": pair.seated.body.mass}


def legs_inertia(pair: Pair) -> dict[str, float]:
    """Inertia of the legs about the line from hip to pedals, kg m^2."""
    body, hip, pedals = legs_body(pair), pair.seated.contacts.hip, pair.seated.contacts.pedals
    axis = np.array([pedals[0] - hip[0], 0.0, pedals[1] - hip[1]])
    axis /= np.linalg.norm(axis)
    arm = body.centre - np.array([hip[0], 0.0, hip[1]])
    return {"legs_": float(axis @ body.inertia @ axis + body.mass * np.sum(np.cross(arm, axis) ** 2))}


def torsion_inertia(pair: Pair) -> dict[str, float]:
    """Inertia of the front frame with its wheel about the axis of torsion, kg m^2."""
    return {"": float(front_inertia(pair.bicycle.values, joint_x=0.0, joint_z=-HINGE_HEIGHT, axis_tilt=0.0))}


ROLL: Ranges = {"stiffness": (1e3, 5e3), "ratio": (0.1, 0.5)}
SWAY: Ranges = {"sway_stiffness": (1e4, 1e5), "sway_ratio": (0.1, 0.5)}

yaw = Rival(effect_class("rider_saddle"), {"stiffness": (2e3, 4e4), "ratio": (0.1, 0.5)}, on_the_saddle, yaw_inertia)
roll = Rival(effect_class("rider_saddle_roll"), ROLL, hip_height, roll_inertia)  # together with yaw
roll_alone = Rival(effect_class("rider_lean"), ROLL, rolling_alone, roll_inertia)
sway = Rival(SwayOfASeatedRider, SWAY, inertia=swaying_mass)  # together with yaw
sway_alone = Rival(SaddleSway, SWAY, whole_rider, swaying_mass)
legs = Rival(LegsSway, {"legs_stiffness": (50.0, 2000.0), "legs_ratio": (0.1, 0.5)}, both_legs, legs_inertia)
torsion = Rival(
    FrameTorsion,
    {"stiffness": (3e3, 2e4), "ratio": (0.01, 0.10)},
    lambda pair: {"joint_z": -HINGE_HEIGHT},
    torsion_inertia,
)
wheels = Rival(effect_class("wheel_compliance"), {"stiffness": (1e5, 6e5)})
contact_length = Rival(effect_class("contact_length"), {"half_length": (0.02, 0.035), "turn_slip_share": (1.0, 1.0)})
