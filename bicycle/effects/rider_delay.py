"""Time delay of a rider who steers."""

import math

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class RiderDelay(Effect):
    """Delay of the command to the rider's muscles, as a Pade approximant of order 2.

    D(s) = (1 - s delay/2 + (s delay)^2/12) / (1 + s delay/2 + (s delay)^2/12): the phase is right to 1 degree up to
    s = 2.2j / delay. Margins of velotyre closed-loop take the delay exactly.
    """

    requires = ("rider torque",)
    why = "it delays the command to the rider's muscles; use rider_control"
    delay = Parameter("s", "from motion to command", bounds=(1e-3, math.inf), typical=(0.03, 0.3))
    source = "Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, ch. 5 (Pade approximant)"
    needs_rider = True
    acts_through = "steer_torque"
    on_request = "a rider who steers is known or measured, not guessed"
    signature = "weave and the mode of the muscles lose damping"

    def apply(self, model: ModelBuilder) -> None:
        # D = 1 - s delay / (1 + s delay/2 + (s delay)^2/12); `lag` is the command through that denominator
        lag = model.add_state("rider_lag", unit="N m")
        rate = model.add_state("rider_lag_rate", unit="N m/s")
        undelayed = model.rider.command + self.delay * rate
        model.rider.tell(-self.delay * rate)
        model.set_rate(lag, rate)
        model.set_rate(rate, 12 / self.delay**2 * (undelayed - lag) - 6 / self.delay * rate)
