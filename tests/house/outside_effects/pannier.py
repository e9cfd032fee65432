"""TOY effect for tests of effects from outside the package: luggage swaying on the rack. Numbers are synthetic."""

import math
from collections.abc import Mapping

from bicycle.effects import Effect, Mode, Parameter
from bicycle.equations import ModelBuilder
from bicycle.parameters import Body
from tyre.ground import InputError


class Pannier(Effect):
    """TOY: a box taken out of the rear frame and hung back on a sprung, damped hinge along x at height joint_z."""

    mass = Parameter("kg", "of the box", bounds=(0.0, math.inf), typical=(3.0, 12.0))
    x = Parameter("m", "mass centre", bounds=(-1.0, 2.0), typical=(-0.2, 0.2), default=0.0)
    z = Parameter("m", "mass centre, z down", bounds=(-2.0, 0.0), typical=(-0.7, -0.4), default=-0.55)
    gyration = Parameter("m", "radius of gyration about x and z", bounds=(0.0, 1.0), typical=(0.05, 0.2), default=0.12)
    joint_z = Parameter("m", "height of the hinge, z down", bounds=(-2.0, 0.0), typical=(-0.9, -0.6), default=-0.75)
    stiffness = Parameter(
        "N m/rad", "of the hinge", bounds=(0.0, math.inf), typical=(20.0, 200.0), default=60.0, neutral=math.inf
    )
    damping = Parameter("N m s/rad", "of the hinge", bounds=(0.0, math.inf), typical=(0.05, 1.0), default=0.3)
    modes = (Mode("pannier", main=True),)
    source = "made up for tests: no measured luggage stands behind it"
    signature = "a mode of its own at 1 to 3 Hz; weave loses damping where the two come close"

    def check(self, bicycle: Mapping[str, float]) -> None:
        if math.isinf(self.stiffness):
            raise InputError(f"effect {self.identifier!r}: an infinite stiffness is the rigid bicycle; leave it out")
        if self.mass >= bicycle["mB"]:
            raise InputError(f"effect {self.identifier!r}: mass = {self.mass:g} kg is more than the rear frame has")

    def apply(self, model: ModelBuilder) -> None:
        inertia = self.mass * self.gyration**2
        model.add_body(Body("pannier", self.mass, self.x, self.z, inertia, inertia))
        model.add_body(Body("pannier in the rear frame", -self.mass, self.x, self.z, -inertia, -inertia))
        sway = model.add_joint("pannier", axis=(1, 0), point=(0, self.joint_z), carries={"pannier"})
        model.add_torque(sway, -self.stiffness * sway.angle - self.damping * sway.rate)
