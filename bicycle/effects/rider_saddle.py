"""Seated rider who turns on the saddle."""

import math
from collections.abc import Mapping

from bicycle.effects.effect import ANY, Mode, Parameter
from bicycle.effects.sprung_joint import MovingBody
from bicycle.equations.lateral import ModelBuilder

ASSUMED = "assumed: five riders were shaken in yaw by Doria et al. (2012), but their values are not public"
# Bounds of a share: a body without mass and inertia would leave its hinge without inertia.
PACKAGED = "packaged bicycles with and without rider: "


class RiderSaddle(MovingBody):
    """The seated rider, taken out of the rear frame and put back on a sprung, damped hinge along z at the saddle.

    The whole body turns, trunk and legs. By default it is a share of the rear frame, with its mass centre. A model file
    may name the same bicycle without rider instead, ``without_rider = "pista"``. ``damping_ratio``, of the body on its
    hinge with the frame held, may be given in place of ``damping``. Arms (rider_arms, rider_hands) still hold to the
    rear frame. rider_saddle_roll lets the body roll.
    """

    mass = Parameter("kg", "of the body", typical=(50.0, 100.0), default="mB")
    mass_share = Parameter(
        "1",
        "of mass that is the rider's; 1 where mass is given",
        bounds=(0.1, 1.0),
        typical=(0.78, 0.98),
        evidence=f"{PACKAGED}0.78 to 0.95",
        default=0.93,
    )
    x = Parameter("m", "mass centre", bounds=ANY, typical=(0.3, 0.5), default="xB")
    z = Parameter("m", "mass centre, z down", bounds=ANY, typical=(-1.15, -0.95), default="zB")
    Ixx = Parameter("kg m^2", "of use with rider_saddle_roll", typical=(6.0, 12.0), default="IBxx")
    Izz = Parameter("kg m^2", "about the mass centre", typical=(2.0, 4.0), default="IBzz")
    Ixz = Parameter("kg m^2", "tensor entry", bounds=ANY, typical=(-2.0, 2.0), default="IBxz")
    inertia_share = Parameter(
        "1",
        "of Ixx, Izz and Ixz that is the rider's; 1 where one of them is given",
        bounds=(0.1, 1.0),
        typical=(0.5, 1.0),
        evidence=f"{PACKAGED}0.53 to 0.92",
        default=0.85,
    )
    joint_x = Parameter(
        "m",
        "saddle, ahead of the rear contact",
        bounds=ANY,
        typical=(0.1, 0.3),
        evidence="hips of two riders on three measured bicycles: 0.17 to 0.21",
        default=0.2,
    )
    stiffness = Parameter(
        "N m/rad", "of the hinge", typical=(2e3, 4e4), evidence=ASSUMED, default=12e3, neutral=math.inf, least=2e5
    )
    damping = Parameter(
        "N m s/rad", "of the hinge", typical=(30.0, 600.0), evidence="assumed: a ratio of 0.1 to 0.5", default=130.0
    )
    source = "Doria, Tognazzo & Cossalter (2012), ASME IDETC 2012, riders shaken in yaw; reports of riders"
    modes = (Mode("rider_yaw", place=7),)
    provides = ("seated rider",)
    needs_rider = True
    rank = 0
    family = "the rider's body"
    signature = "the frame yaws under the rider: wobble is slower and better damped; a rider mode at 2-15 Hz"

    def carried_inertia(self, values: Mapping[str, float]) -> float:
        """Moment of inertia (kg m^2) of the seated body about the hinge, the rear frame held."""
        mass = values["mass_share"] * values["mass"]
        return values["inertia_share"] * values["Izz"] + mass * (values["x"] - values["joint_x"]) ** 2

    def apply(self, model: ModelBuilder) -> None:
        self.move_body(model, "seated rider")
        point, body = (self.joint_x, 0), "seated rider"
        turn = model.add_joint(self.identifier, axis=(0, 1), point=point, carries={body}, role="rider_yaw")
        model.seat_rider(turn, body)
        self.spring(model, turn)
