"""Contacts left open, for tyres that are not linear: forces are free inputs, what a tyre would see is read off."""

from typing import Any, ClassVar

import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.derivation.ports import Wheel
from bicycle.effect import Effect

PROBES = {
    "slip velocity": "m", "lagged camber force": "N s", "direct camber force": "N s", "series compliance": "m s",
    "load transfer": "N^2 s",
}  # fmt: skip
"""What a tyre would see, as the rate of a state; and the unit of that state."""
LAGS = "relaxing contact"  # what a contact law with a relaxation length provides


class OpenContact(Effect):
    """Contacts whose side force is free: a state without a law, beside probes whose rates are what a tyre would see."""

    identifier: ClassVar[str] = "open_contact"
    slot = "contact law"
    provides = ("contact force", "tyre force", "lagged force")
    holds_contact = False

    def apply(self, model: ModelBuilder) -> None:
        """Become the contact law.

        Parameters
        ----------
        model : ModelBuilder
        """
        model.set_contact_law(self)

    def side_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """Return the free side force.

        Parameters
        ----------
        model : ModelBuilder
        wheel : Wheel
        """
        force = model.add_state(f"{wheel.name}_side_force", unit="N", role=wheel.name)
        model.set_rate(force, sp.S.Zero)
        seen = (
            wheel.slip_velocity, wheel.lagged_camber_force, wheel.direct_camber_force,
            wheel.series_compliance * force, sp.sympify(model.load_transfer) * force,
        )  # fmt: skip
        for (name, unit), quantity in zip(PROBES.items(), seen, strict=True):
            model.set_rate(model.add_state(f"{wheel.name} {name}", unit=unit), quantity)
        return force


def takes_magic_tyres(law: type[Effect]) -> bool:
    """Whether a contact law is a slope at zero slip, at once or after one relaxation length.

    Parameters
    ----------
    law : type
        Class of an effect.
    """
    needed = {"cornering_stiffness", *(["relaxation_length"] if LAGS in law.provides else [])}
    one_lag = LAGS in law.provides or "lagged force" not in law.provides
    return "tyre force" in law.provides and one_lag and needed <= {parameter.name for parameter in law.parameters}
