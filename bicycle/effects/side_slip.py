"""The static tyre: lateral force proportional to the slip angle."""

from typing import Any

from bicycle.effects.effect import Effect, Mode, Parameter
from bicycle.equations.declarations import Wheel
from bicycle.equations.lateral import ModelBuilder

REAR_TYRE = Mode("rear_tyre", marks=("rear",), place=4, look=5)  # of every contact that slips


class SideSlip(Effect):
    """Lateral force without lag, F = C alpha + camber force, alpha = -s / v (s: slip velocity of the contact).

    Singular at v = 0.
    """

    slot = "contact law"
    provides = ("contact force", "tyre force")
    cornering_stiffness = Parameter(
        "N/rad",
        "slope of the lateral force at zero slip",
        typical=(2000.0, 12000.0),
        least=4e4,
        per_wheel=True,
        tyre="cornering_stiffness",
    )
    source = "Pacejka, Tire and Vehicle Dynamics, ch. 1"
    modes = (REAR_TYRE,)
    signature = "weave loses damping at low cornering stiffness; the contacts slip sideways at a rate C / (m v)"
    holds_contact = False

    def apply(self, model: ModelBuilder) -> None:
        model.set_contact_law(self)

    def lateral_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """Lateral force of slip angle and camber, N; arguments as :meth:`.ContactLaw.lateral_force`."""
        slip_angle = -wheel.slip_velocity / model.speed
        camber_force = wheel.lagged_camber_force + wheel.direct_camber_force
        return self.cornering_stiffness[wheel] * slip_angle + camber_force
