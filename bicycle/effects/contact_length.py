"""Finite contact length: the tyre as a stretched string that meets the ground along a line."""

import math
from collections.abc import Mapping
from typing import Any

from bicycle.effects.effect import WHEELS, Effect, Parameter
from bicycle.effects.effect_registry import registry
from bicycle.equations.declarations import Wheel
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.errors import InputError
from tyre.maps.contact_patch import string_trail


class ContactLength(Effect):
    """Lateral force and moment of a string in contact from +a to -a, within the measured relaxation length L.

    Its free ends decay over sigma, c_c is the lateral stiffness per length. Measured are C = 2 c_c (sigma + a)^2 and,
    without rolling, K = 2 c_c (sigma + a), so L = C/K is sigma + a. A deflection straight along the contact,
    q0 + q1 x/a, gives F = K q0 and Mz = t C q1/a with the trail t = (L^3 - sigma^3) / (3 L^2). Over the travelled
    distance x, with the slip alpha = -s/v and the turn slip phi = -(yaw rate of the wheel)/v,

        dF/dx = K alpha + Mz / (t L),        dMz/dx = t C phi - (F - camber force) - Mz / t.

    Of two states only these have the string's stiffness at rest (K; in yaw t C) and its C, t and force t C of turn slip
    when rolling steadily; F/phi = -Mz/alpha and the lag L - t of the force on long waves are then the string's too, and
    a = 0 is the single lag. With a = 0.045 m, L = 0.11 m and a wavelength of 0.5 m F/alpha misses the exact string by
    1.6 % and 0.0 deg (the single lag by 20.5 %, 3.9 deg), Mz/alpha by 7 % and 1.3 deg: docs/physics.md. Waves shorter
    than the contact have no meaning. Camber force builds up like that of turn slip, at the contact centre.
    """

    slot = "aligning moment"
    requires = ("relaxing contact",)
    why = "it gives a length to the contact of a tyre with a relaxation length; use relaxation_length"
    half_length = Parameter(
        "m",
        "half the length of the contact, a",
        bounds=(1e-6, math.inf),
        typical=(0.02, 0.06),
        default=0.03,
        per_wheel=True,
    )
    turn_slip_share = Parameter(
        "1", "share of the turn slip that deforms the contact", bounds=(0.0, 1.0), typical=(0.0, 1.0), default=1.0
    )
    source = "von Schlippe & Dietrich (1941); Pacejka, Tire and Vehicle Dynamics, ch. 5"
    signature = (
        "a trail of the lateral force, less lag of the force on long waves; turn slip damps the yaw of the wheels"
    )
    family = "an aligning moment of the tyre"

    def check(self, parameters: Mapping[str, float]) -> None:
        """Refuse a half length that is not below the relaxation length, which contains it."""
        for wheel in WHEELS:
            laws = [law.identifier for law in registry().values() if self.requires[0] in law.provides]
            keys = [f"{law}.relaxation_length.{wheel}" for law in laws]
            half, length = self.half_length[wheel], next(parameters[key] for key in keys if key in parameters)
            if half >= length:
                raise InputError(
                    f"effect {self.identifier!r}: half_length.{wheel} = {half:g} m must be less than the relaxation "
                    f"length, "
                    f"{length:g} m, which contains it (L = sigma + a)"
                )

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.lengthen_contact(self)

    def renewed_force(
        self, model: ModelBuilder, wheel: Wheel, *, force: Any, cornering_stiffness: Any, relaxation_length: Any
    ) -> Any:
        """Force (N) that rolling straight on takes away of ``force`` per relaxation length."""
        trail = string_trail(half_length=self.half_length[wheel], relaxation_length=relaxation_length)
        moment = model.add_state(f"{wheel.name}_aligning_moment", unit="N m")
        stiffness = self.turn_slip_share * trail * cornering_stiffness
        model.set_rate(moment, -stiffness * wheel.yaw_rate - model.speed * (force + moment / trail))
        wheel.add_moment(moment)
        return -moment / trail
