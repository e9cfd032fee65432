"""A rider who steers: torque on the handlebar from roll and steer, through the muscles."""

import math

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.declarations import Mode
from bicycle.equations.lateral import ModelBuilder


class RiderControl(Effect):
    """Steer torque T'' + 2 zeta omega T' + omega^2 T = omega^2 u of a rider, u = gains on roll, steer and their rates.

    A positive gain on roll steers to the side the bicycle leans to. The gains hold at the speed at which they were
    identified. rider_steer_memory or rider_path adds what holds the heading, rider_delay a time delay.
    """

    provides = ("rider torque",)

    roll = Parameter(
        "N m/rad", "torque per roll angle", bounds=ANY, typical=(0.0, 80.0), default=0.0, neutral=0.0, least=0.5
    )
    roll_rate = Parameter(
        "N m s/rad", "torque per roll rate", bounds=ANY, typical=(0.0, 40.0), default=0.0, neutral=0.0, least=0.2
    )
    steer = Parameter(
        "N m/rad", "torque per steer angle", bounds=ANY, typical=(-120.0, 20.0), default=0.0, neutral=0.0, least=0.5
    )
    steer_rate = Parameter(
        "N m s/rad", "torque per steer rate", bounds=ANY, typical=(-8.0, 1.0), default=0.0, neutral=0.0, least=0.05
    )
    filter_frequency = Parameter(
        "rad/s",
        "natural frequency omega of the neuromuscular filter",
        bounds=(0.1, math.inf),
        typical=(5.0, 40.0),
        default=2 * math.pi * 2.17,
    )
    filter_damping = Parameter(
        "1", "damping ratio zeta of the neuromuscular filter", typical=(0.3, 1.2), default=math.sqrt(0.5)
    )
    source = (
        "Schwab, de Lange, Happee & Moore (2013), Multibody System Dynamics; Hess, Moore & Hubbard (2012), IEEE SMC A"
    )
    modes = (Mode("muscles"),)
    needs_rider = True
    powered = True
    acts_through = "steer_torque"
    on_request = "a rider who steers is known or measured, not guessed"
    signature = (
        "the bicycle is held below the weave speed and above the capsize speed; a mode of the muscles at 2 to 5 Hz"
    )

    def apply(self, model: ModelBuilder) -> None:
        torque = model.add_state("rider_torque", unit="N m", role="muscles")
        rate = model.add_state("rider_torque_rate", unit="N m/s", role="muscles")
        lean, steer = model.lean, model.steer
        model.rider.tell(self.roll * lean.angle + self.roll_rate * lean.rate)
        model.rider.tell(self.steer * steer.angle + self.steer_rate * steer.rate)
        model.set_rate(torque, rate)
        stiffness, damping = self.filter_frequency**2, 2 * self.filter_damping * self.filter_frequency
        model.set_rate(rate, stiffness * (model.rider.command - torque) - damping * rate)
        model.rider.give(torque)
