"""Round cross-section of the tyre."""

from collections.abc import Mapping

from bicycle.effects.effect import WHEELS, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.errors import InputError


class CrownRadius(Effect):
    """A toroidal tyre of crown radius rho: the contact moves sideways by rho gamma, so the wheel centre sinks less.

    Height of the lowest point z = z_centre + (r - rho) cos(gamma) + rho, to second order in the potential; the side
    force still acts at the ground. Without a number the tyre is 25 mm wide and its cross-section a circle.
    """

    crown_radius = Parameter(
        "m",
        "radius of the tyre's cross-section",
        typical=(0.01, 0.03),
        default=0.0125,
        neutral=0.0,
        least=1e-3,
        smallest=0.009,  # no tyre is narrower than 18 mm
        per_wheel=True,
        tyre="crown_radius",
    )
    source = "Sharp (1971), J. Mech. Eng. Sci. 13(5), 316-329; Cossalter, Motorcycle Dynamics, ch. 1"
    signature = "the bicycle falls more slowly and the capsize speed falls"

    def check(self, bicycle: Mapping[str, float]) -> None:
        for wheel, key in zip(WHEELS, ("rR", "rF"), strict=True):
            if self.crown_radius[wheel] > bicycle[key]:
                raise InputError(
                    f"effect {self.identifier!r}: crown_radius.{wheel} = {self.crown_radius[wheel]:g} m is larger than "
                    f"the wheel ({key} = {bicycle[key]:g} m); give half the width of the tyre"
                )

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.add_crown_radius(self.crown_radius[wheel])
