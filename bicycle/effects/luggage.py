"""Luggage on the rear rack."""

from bicycle.effects.effect import ANY, Parameter, PointMass
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.rigid_bodies import Body


class Luggage(PointMass):
    """A point mass fixed to the rear frame that the bicycle's parameters do not contain: bag, rack, battery, lock.

    It brings weight, inertia and wheel loads; its own extent is small against its distance from the wheels' contacts.
    Usual are 0.5 kg (a rack or a lock by itself) to 10 kg.
    """

    mass = Parameter("kg", "of the luggage", typical=(0.5, 10.0), neutral=0.0, least=0.2)
    x = Parameter("m", "mass centre, ahead of the rear contact", bounds=ANY, typical=(-0.1, 0.25), default=0.05)
    z = Parameter("m", "mass centre, z down", bounds=ANY, typical=(-1.0, -0.6), default=-0.8)
    source = "Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, appendix B (a further rigid body)"
    signature = "like another mass, height and inertia of the rear frame: weave becomes slower and starts earlier"

    def apply(self, model: ModelBuilder) -> None:
        model.add_body(Body("luggage", self.mass, self.x, self.z, 0, 0))
