"""Lateral compliance of rim and spokes."""

import math

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class WheelCompliance(Effect):
    """A spring K_w between hub and tyre: the relaxation length grows from C_alpha / K_y to C_alpha (1/K_y + 1/K_w).

    Rigs measure the tyre on a stiff rim; the wheel of a rider is softer. Its mass and its camber are not affected,
    and a relaxation length of aligning_moment is taken as given.
    """

    requires = ("lagged force",)
    why = "it acts in series with the lateral stiffness of the tyre; use relaxation_length"
    stiffness = Parameter(
        "N/m",
        "lateral stiffness of rim and spokes at the contact",
        bounds=(1e-6, math.inf),
        typical=(1e5, 6e5),
        default=3e5,
        neutral=math.inf,
        least=3e6,
        per_wheel=True,
    )
    source = "Dell'Orto, Ballo, Mastinu & Gobbi, eq. 3, springs in series; Pacejka, Tire and Vehicle Dynamics, ch. 7"
    signature = "acts as a longer relaxation length: wobble loses damping"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.add_series_compliance(1 / self.stiffness[wheel])
