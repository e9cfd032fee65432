"""A bag on the handlebar."""

from bicycle.effects.effect import ANY, Parameter, PointMass
from bicycle.equations.lateral import ModelBuilder
from bicycle.parameters.rigid_bodies import Body


class HandlebarBag(PointMass):
    """A point mass fixed to the steered front frame that the bicycle's parameters do not contain: bag, basket, lamp.

    It turns with the steering and with whatever carries the front frame; its own extent is neglected.
    """

    mass = Parameter("kg", "of the bag", typical=(0.5, 5.0), neutral=0.0, least=0.2)
    x = Parameter("m", "mass centre, ahead of the rear contact", bounds=ANY, typical=(0.6, 1.0), default=0.85)
    z = Parameter("m", "mass centre, z down", bounds=ANY, typical=(-1.1, -0.7), default=-0.9)
    source = "Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463, appendix B (a further rigid body)"
    signature = "slower steering: weave becomes stable at a higher speed; its weight turns the handlebar"

    def apply(self, model: ModelBuilder) -> None:
        model.add_body(Body("handlebar bag", self.mass, self.x, self.z, 0, 0, fixed_to="front frame"))
