"""Lateral compliance of rim and spokes."""

import math
from typing import Any

from bicycle.derivation.builder import ModelBuilder
from bicycle.effect import Effect, Parameter


class WheelCompliance(Effect):
    """A spring K_w between hub and tyre: the relaxation length grows from C / K_y to C (1/K_y + 1/K_w).

    Rigs measure the tyre on a stiff rim; the wheel of a rider is softer. Its mass and its camber are not affected,
    and a relaxation length of aligning_moment is taken as given.
    Source: Dell'Orto, Ballo, Mastinu & Gobbi, eq. 3, with two springs in series; Pacejka, ch. 7.
    """

    requires = ("lagged force",)
    why = "it acts in series with the lateral stiffness of the tyre; use relaxation_length"
    parameters = (
        Parameter(
            "stiffness", "N/m", "lateral stiffness of rim and spokes at the contact",
            bounds=(1e-6, math.inf), typical=(1e5, 6e5), default=3e5, neutral=math.inf, per_wheel=True,
        ),
    )  # fmt: skip
    source = "Dell'Orto, Ballo, Mastinu & Gobbi, eq. 3; Pacejka, Tire and Vehicle Dynamics, ch. 7"
    signature = "acts as a longer relaxation length: wobble loses damping"
    stiffness: Any

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.series_compliance += 1 / self.stiffness[wheel]
