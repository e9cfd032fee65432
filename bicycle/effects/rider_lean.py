"""Upper body that sways against the frame."""

import math
from collections.abc import Mapping

from bicycle.effects.effect import ANY, Mode, Parameter
from bicycle.effects.sprung_joint import MovingBody
from bicycle.equations.lateral import ModelBuilder


class RiderLean(MovingBody):
    """A body taken out of the rear frame and put back on a sprung, damped hinge along x at height joint_z.

    The rear frame of the bicycle must contain the body; inertias are about the body's mass centre. With rider_saddle
    the body is a part of the seated rider: it is taken out of that one, and its hinge moves with the saddle's.
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
    family = "the rider's body"
    signature = "adds a rider mode at 1-3 Hz; weave changes frequency and damping where the two come close"

    def holder(self, bicycle: Mapping[str, float]) -> tuple[str, tuple[str, ...], tuple[float, ...]]:
        if "rider_saddle.mass" not in bicycle:
            return super().holder(bicycle)
        keys = tuple(f"rider_saddle.{key}" for key in ("mass", "x", "z", "Ixx", "Izz", "Ixz"))
        mass, inertia = (bicycle[f"rider_saddle.{key}_share"] for key in ("mass", "inertia"))
        shares = (mass, 1.0, 1.0, inertia, inertia, inertia)
        return "seated rider", keys, tuple(share * bicycle[key] for share, key in zip(shares, keys, strict=True))

    def apply(self, model: ModelBuilder) -> None:
        self.move_body(model, "rider")
        sway = model.add_joint(
            self.identifier,
            axis=(1, 0),
            point=(0, self.joint_z),
            carries={"rider"},
            role="rider",
            hangs_on=model.rider_joint,
        )
        self.spring(model, sway)
