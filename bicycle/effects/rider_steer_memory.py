"""A rider with a memory of steering: torque from the integral of the steer angle."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.errors import InputError


class RiderSteerMemory(Effect):
    """Command gain * (integral of the steer angle) to the muscles of rider_control.

    Without slip the integral is the heading times w / (v cos lam). For a rider without such a gain leave it out.
    """

    requires = ("rider torque",)
    why = "it adds to the command to the rider's muscles; use rider_control"
    slot = "heading loop of the rider"
    gain = Parameter("N m/rad s", "torque per integral of the steer angle", bounds=ANY, typical=(10.0, 650.0))
    source = "Schwab, de Lange, Happee & Moore (2013), Multibody System Dynamics, eq. of the controller (k_delta_i)"
    needs_rider = True
    acts_through = "steer_torque"
    on_request = "a rider who steers is known or measured, not guessed"
    signature = "the bicycle returns to its old heading after a push"

    def check(self, bicycle: object) -> None:
        if self.gain == 0:
            raise InputError(f"effect {self.identifier!r}: gain = 0 N m/rad s adds a root at zero; leave it out")

    def apply(self, model: ModelBuilder) -> None:
        memory = model.add_state("steer_integral", unit="rad s", role="heading")
        model.set_rate(memory, model.steer.angle)
        model.rider.tell(self.gain * memory)
