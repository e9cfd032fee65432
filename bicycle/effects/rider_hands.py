"""Hands on the handlebar: arms that move with it through a compliant grip."""

import math
from collections.abc import Mapping

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.declarations import Mode
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.rigid_bodies import Body
from tyre.ground.errors import InputError


class RiderHands(Effect):
    """Arms as the mass that is felt at both hands, turning about the steer axis between torso and handlebar.

    The mass is taken out of the rear frame, which must contain the arms; stretched ones feel heavier. Shoulders and
    elbows hold it to the torso with ``stiffness`` and ``damping``, the grips to the handlebar with ``grip_stiffness``
    and ``grip_damping``, all about the steer axis. The torso is part of the rear frame, also with rider_lean; bending
    of frame and fork does not move the arms but through the grips.
    """

    mass = Parameter(  # without it the angle of the arms has no inertia
        "kg", "felt at both hands together", bounds=(1e-6, math.inf), typical=(1.0, 14.0), default=4.5
    )
    half_width = Parameter("m", "half the distance of the hands", typical=(0.15, 0.4), default=0.21)
    x = Parameter("m", "hands, ahead of the rear contact", bounds=ANY, typical=(0.5, 1.1), default=0.85)
    z = Parameter("m", "hands, z down", bounds=(-3.0, 0.0), typical=(-1.2, -0.7), default=-0.95)
    stiffness = Parameter("N m/rad", "of shoulders and elbows", typical=(0.0, 60.0), default=10.0)
    damping = Parameter("N m s/rad", "of shoulders and elbows", typical=(0.2, 4.0), default=1.0)
    grip_stiffness = Parameter("N m/rad", "of both grips", typical=(20.0, 600.0), default=200.0)
    grip_damping = Parameter("N m s/rad", "of both grips", typical=(0.1, 4.0), default=1.0)
    source = "Klinger, Nusime, Edelmann & Ploechl (2014), Vehicle System Dynamics 52 (hands on the bar); Sharp (1994)"
    modes = (Mode("arms"),)
    needs_rider = True
    acts_through = "steer_torque"
    on_request = "rider_arms is the usual model of hands; this one also has a compliant grip"
    signature = "a mode of arms against handlebar; the grip decides how much of their mass and damping acts on wobble"

    def check(self, bicycle: Mapping[str, float]) -> None:
        """Refuse arms that the rear frame cannot contain in addition to the body of rider_saddle or rider_lean."""
        mover = "rider_saddle" if "rider_saddle.mass" in bicycle else "rider_lean"
        moving = bicycle.get(f"{mover}.mass", 0.0) * bicycle.get(f"{mover}.mass_share", 1.0)
        remainder = bicycle["mB"] - moving - self.mass
        if remainder <= 0:
            of_body = f", of which {mover} takes {moving:g} kg" if moving else ""
            raise InputError(
                f"effect {self.identifier!r}: mass = {self.mass:g} kg must be below {self.mass + remainder:g} kg, "
                f"the mass "
                f"of the rear frame that contains the arms (mB = {bicycle['mB']:g} kg{of_body})"
            )

    def apply(self, model: ModelBuilder) -> None:
        inertia = self.mass * self.half_width**2  # about x and z, of masses at +-half_width
        model.add_body(Body("hands", self.mass, self.x, self.z, inertia, inertia))
        model.add_body(Body("hands in the rear frame", -self.mass, self.x, self.z, -inertia, -inertia))
        steer = model.steer_axis
        axis, foot = (steer.axis_x, steer.axis_z), (steer.x, steer.z)
        arms = model.add_joint("arms", axis=axis, point=foot, carries={"hands"})
        model.add_torque(arms, -self.stiffness * arms.angle - self.damping * arms.rate)
        grip = self.grip_stiffness * (model.steer.angle - arms.angle)
        grip += self.grip_damping * (model.steer.rate - arms.rate)
        model.add_torque(arms, grip)
        model.add_torque(model.steer, -grip)
