"""Balance assist by a motor on the steering."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class SteerAssist(Effect):
    """Steer torque gain (fade_speed - v) d(lean)/dt below the fade speed, lean_gain (v - fade_speed) lean above it.

    The torque acts between rear frame and steering and steers into the fall for positive gains. It is the
    command to the motor, which acts at once unless ``steer_motor`` gives its lag. Beyond the greatest torque of a
    real motor the equations, which are linear, do not hold.
    """

    provides = ("motor command",)

    gain = Parameter(
        "N s^2/rad",
        "torque per lean rate and per m/s below the fade speed",
        bounds=ANY,
        typical=(0.0, 20.0),
        default=5.0,
        neutral=0.0,
        least=0.05,
    )
    fade_speed = Parameter(
        "m/s", "speed at which the assist vanishes and changes over", typical=(3.0, 8.0), default=5.0
    )
    lean_gain = Parameter(
        "N s/rad",
        "torque per lean angle and per m/s above the fade speed",
        bounds=ANY,
        typical=(0.0, 5.0),
        default=0.0,
        neutral=0.0,
        least=0.05,
    )
    source = "Schwab, Kooijman & Meijaard (2008), 4th European Conference on Structural Control, St. Petersburg"
    powered = True
    signature = "weave becomes stable at low speed, capsize above the fade speed; equations change at the fade speed"

    def apply(self, model: ModelBuilder) -> None:
        below, excess = model.below(self.fade_speed), model.speed - self.fade_speed
        model.motor.tell(-below * self.gain * excess * model.lean.rate)
        model.motor.tell((1 - below) * self.lean_gain * excess * model.lean.angle)
