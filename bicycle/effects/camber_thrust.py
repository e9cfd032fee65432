"""Lateral force of a leaning tyre."""

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class CamberThrust(Effect):
    """Lateral force C_gamma gamma towards the lean; ``lag_share`` of it builds up with the slip force, the rest at
    once.

    A tyre whose camber stiffness equals its load carries a steady lean without slipping. Some tyres show a
    non-lagging part.
    """

    requires = ("tyre force",)
    why = "under no_slip the constraint already carries the lateral force; use side_slip or relaxation_length"
    camber_stiffness = Parameter(
        "N/rad",
        "lateral force per camber angle",
        typical=(150.0, 700.0),
        evidence="0.43 to 0.94 of loads of 350 to 745 N; from Dressel (2013) to a Schwalbe tyre",
        neutral=0.0,
        least=20.0,
        per_wheel=True,
        tyre="camber_stiffness",
    )
    lag_share = Parameter(
        "1",
        "share of the camber force that lags with the slip force",
        bounds=(0.0, 1.0),
        typical=(0.0, 1.0),
        default=1.0,
    )
    source = "Pacejka, Tire and Vehicle Dynamics, ch. 7 and 11"
    signature = "takes back what slip alone does to weave and capsize"

    def apply(self, model: ModelBuilder) -> None:
        for wheel in model.wheels:
            wheel.add_camber_force(self.camber_stiffness[wheel] * wheel.camber, lag_share=self.lag_share)
