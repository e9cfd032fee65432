"""Upper body that sways against the frame."""

import math
from collections.abc import Mapping

import numpy as np

from bicycle.effects.effect import ANY, Mode, Parameter, SprungJoint
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.rigid_bodies import Body
from tyre.ground.errors import InputError


class RiderLean(SprungJoint):
    """A body taken out of the rear frame and put back on a sprung, damped hinge along x at height joint_z.

    The rear frame of the bicycle must contain the body; inertias are about the body's mass centre.
    """

    mass = Parameter("kg", "of the moving body", typical=(20.0, 60.0))
    x = Parameter("m", "mass centre", bounds=ANY, typical=(0.2, 0.6))
    z = Parameter("m", "mass centre, z down", bounds=ANY, typical=(-1.5, -1.0))
    Ixx = Parameter("kg m^2", "moment of inertia", typical=(0.5, 5.0))
    Izz = Parameter("kg m^2", "checked; a hinge along x hides it", typical=(0.3, 3.0))
    Ixz = Parameter("kg m^2", "tensor entry", bounds=ANY, typical=(-0.3, 0.3), default=0.0)
    joint_z = Parameter("m", "height of the hinge, z down", bounds=ANY, typical=(-1.1, -0.7))
    stiffness = Parameter(
        "N m/rad", "of the hinge", typical=(500.0, 3000.0), default=1500.0, neutral=math.inf, least=2e4
    )
    damping = Parameter("N m s/rad", "of the hinge", typical=(10.0, 150.0), default=60.0)
    source = "Schwab, Meijaard & Kooijman (2012), Vehicle System Dynamics 50; Doria & Tognazzo (2014), IMechE C 228"
    modes = (Mode("rider", place=6, look=6, main=True),)
    needs_rider = True
    signature = "adds a rider mode at 1-3 Hz; weave changes frequency and damping where the two come close"

    def check(self, bicycle: Mapping[str, float]) -> None:
        where, remainder = f"effect {self.identifier!r}", bicycle["mB"] - self.mass
        super().check(bicycle)
        if remainder <= 0:
            raise InputError(
                f"{where}: mass = {self.mass:g} kg must be below {self.mass + remainder:g} kg, the mass "
                f"of the rear frame that contains the moving body (mB = {bicycle['mB']:g} kg)"
            )
        x, z, reduced = bicycle["xB"] - self.x, bicycle["zB"] - self.z, bicycle["mB"] * self.mass / remainder
        frame = np.array([[bicycle["IBxx"], bicycle["IBxz"]], [bicycle["IBxz"], bicycle["IBzz"]]])
        body = np.array([[self.Ixx, self.Ixz], [self.Ixz, self.Izz]])
        rest_of_frame = frame - body - reduced * np.array([[z * z, -x * z], [-x * z, x * x]])
        for part, inertia in (("the moving body", body), ("what remains of the rear frame", rest_of_frame)):
            smallest = np.linalg.eigvalsh(inertia)[0]
            if smallest < -1e-12 * np.trace(frame):
                raise InputError(
                    f"{where}: {part} has a negative principal inertia {smallest:.4g} kg m^2 in the x-z plane; "
                    "check mass, x, z, Ixx, Izz, Ixz against the rear frame (IBxx, IBzz, IBxz)"
                )

    def apply(self, model: ModelBuilder) -> None:
        shape = (self.x, self.z, self.Ixx, self.Izz, self.Ixz)
        model.add_body(Body("rider", self.mass, *shape))
        model.add_body(Body("rider in the rear frame", -self.mass, *shape[:2], *(-inertia for inertia in shape[2:])))
        sway = model.add_joint(self.identifier, axis=(1, 0), point=(0, self.joint_z), carries={"rider"}, role="rider")
        self.spring(model, sway)
