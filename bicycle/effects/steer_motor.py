"""A motor on the steering that gives a part of its command, late."""

import math

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class SteerMotor(Effect):
    """A share of the commanded torque, after a first-order lag: lag dT/dt = share T_command - T.

    A share below 1: friction in motor and gear, a motor constant that is smaller than the controller assumes. The lag
    stands for filters of the measured motion, sampling and the motor's own current loop. The greatest torque of the
    motor is not part of it (the equations are linear).
    """

    requires = ("motor command",)
    why = "it is what arrives of a commanded torque; use steer_assist"
    share = Parameter("1", "share of the commanded torque that arrives", typical=(0.4, 1.0), default=1.0)
    lag = Parameter(
        "s",
        "time in which 63 % of a step of the command arrive",
        bounds=(1e-4, math.inf),
        typical=(0.005, 0.1),
        default=0.03,
    )
    source = "Franklin, Powell & Emami-Naeini, Feedback Control of Dynamic Systems, ch. 2 (models of motors)"
    signature = "the assist is weaker than its gain; the faster the weave, the less of its damping is left"

    def apply(self, model: ModelBuilder) -> None:
        torque = model.add_state("steer_motor_torque", unit="N m")
        model.set_rate(torque, (self.share * model.motor.command - torque) / self.lag)
        model.motor.give(torque)
