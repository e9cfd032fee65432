"""The measured transient tyre: lateral force that builds up over a relaxation length."""

import math
from typing import Any

from bicycle.effects.effect import Effect, Parameter
from bicycle.effects.side_slip import REAR_TYRE
from bicycle.equations.declarations import Wheel
from bicycle.equations.lateral import ModelBuilder


class RelaxationLength(Effect):
    """First-order lateral force, (sigma/v) dF/dt + F = C_alpha alpha + camber force, regular at v = 0.

    Written as dF/dt = -(C_alpha/sigma) s - (v/sigma) (F - camber force): C_alpha/sigma is the lateral stiffness K_y of
    the standing tyre. A compliance 1/K_w in series (rim, spokes) lengthens sigma to C_alpha (1/K_y + 1/K_w).
    """

    slot = "contact law"
    provides = ("contact force", "tyre force", "lagged force", "relaxing contact")
    cornering_stiffness = Parameter(
        "N/rad",
        "slope of the lateral force at zero slip",
        typical=(2000.0, 12000.0),
        least=4e4,
        per_wheel=True,
        tyre="cornering_stiffness",
    )
    relaxation_length = Parameter(
        "m",
        "travelled distance in which 63 % of the lateral force builds up",
        bounds=(1e-6, math.inf),
        typical=(0.05, 0.25),
        least=0.01,
        per_wheel=True,
        tyre="relaxation_length",
    )
    source = "Dell'Orto, Ballo, Mastinu & Gobbi, eq. 1 and 3; Pacejka, Tire and Vehicle Dynamics, ch. 7"
    modes = (REAR_TYRE,)
    signature = "wobble appears and loses damping as the relaxation length grows"
    holds_contact = False

    def apply(self, model: ModelBuilder) -> None:
        model.set_contact_law(self)

    def lateral_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """The lagged force (a state) and what camber gives at once, N; see :meth:`.ContactLaw.lateral_force`."""
        stiffness, tyre_length = self.cornering_stiffness[wheel], self.relaxation_length[wheel]
        length = tyre_length + stiffness * wheel.series_compliance
        force = model.add_state(f"{wheel.name}_lateral_force", unit="N", role=wheel.name)
        renewed = force - wheel.lagged_camber_force
        if wheel.contact_line is not None:
            renewed = wheel.contact_line.renewed_force(
                model, wheel, force=renewed, cornering_stiffness=stiffness, relaxation_length=tyre_length
            )
        model.set_rate(force, -stiffness / length * wheel.slip_velocity - model.speed / length * renewed)
        return force + wheel.direct_camber_force
