"""Aligning moment with a stiffness and a relaxation length of its own."""

import math

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class AligningMoment(Effect):
    """Lagged moment of the slip angle on each wheel, dMz/dt = (C_M/length) s - (v/length) Mz, steady Mz = -C_M alpha.

    The lateral force and its moment need not build up over the same distance. With C_M = t C, equal lengths and no
    camber thrust it is the pneumatic trail t.
    """

    slot = "aligning moment"
    requires = ("tyre force",)
    why = "under no_slip no wheel slips; use side_slip or relaxation_length, or pneumatic_trail"
    aligning_stiffness = Parameter(
        "N m/rad",
        "moment against the slip, per slip angle",
        typical=(50.0, 220.0),
        neutral=0.0,
        least=5.0,
        per_wheel=True,
        tyre="aligning_stiffness",
    )
    relaxation_length = Parameter(
        "m",
        "travelled distance in which 63 % of the moment builds up",
        bounds=(1e-6, math.inf),
        typical=(0.05, 0.25),
        per_wheel=True,
        tyre="relaxation_length",
    )
    source = "Pacejka, Tire and Vehicle Dynamics, ch. 5 and 7"
    signature = "like pneumatic_trail; a moment that lags more than the force takes damping from wobble"
    family = "an aligning moment of the tyre"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            moment = model.add_state(f"{wheel.name}_aligning_moment", unit="N m")
            gain, length = self.aligning_stiffness[wheel], self.relaxation_length[wheel]
            model.set_rate(moment, gain / length * wheel.slip_velocity - model.speed / length * moment)
            wheel.add_moment(moment)
