"""Knife-edge rolling: both contacts are held."""

from typing import Any

from bicycle.effects.effect import Effect
from bicycle.equations.declarations import Wheel
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.door import library

sp = library("sympy")


class NoSlip(Effect):
    """Wheels that roll without side slip; the lateral force is whatever holds the contact (the Whipple bicycle)."""

    slot = "contact law"
    provides = ("contact force",)
    source = "Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, doi 10.1098/rspa.2007.1857"
    signature = "weave, capsize and castering only: no wobble"
    holds_contact = True

    def apply(self, model: ModelBuilder) -> None:
        model.set_contact_law(self)

    def lateral_force(self, model: ModelBuilder, wheel: Wheel) -> Any:
        """None: the constraint force holds the contact."""
        return sp.S.Zero
