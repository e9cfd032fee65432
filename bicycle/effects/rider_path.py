"""A rider who keeps to a lane: torque from heading and lateral position."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder
from tyre.ground.errors import InputError


class RiderPath(Effect):
    """Command heading * psi + position * y_front to the muscles of rider_control, both from a straight lane.

    psi is the heading of the rear frame (> 0 to the right), y_front the lateral place of the front contact.
    """

    requires = ("rider torque",)
    why = "it adds to the command to the rider's muscles; use rider_control"
    slot = "heading loop of the rider"
    heading = Parameter("N m/rad", "torque per heading angle", bounds=ANY, typical=(0.5, 40.0))
    position = Parameter("N m/m", "torque per lateral place of the front contact", bounds=ANY, typical=(0.1, 3.0))
    source = "Hess, Moore & Hubbard (2012), Modeling the manually controlled bicycle, IEEE Transactions SMC A 42"
    needs_rider = True
    acts_through = "steer_torque"
    on_request = "a rider who steers is known or measured, not guessed"
    signature = "the bicycle returns to its lane after a push; a slow mode of heading and place"

    def check(self, bicycle: object) -> None:
        if self.position == 0:
            raise InputError(
                f"effect {self.identifier!r}: position = 0 N m/m leaves the lane free, a root at zero; "
                "give a gain, or rider_steer_memory instead"
            )

    def apply(self, model: ModelBuilder) -> None:
        heading = model.add_state("heading", unit="rad", role="heading")
        rear = model.add_state("rear_position", unit="m", role="heading")
        model.set_rate(heading, model.yaw_rate)
        model.set_rate(rear, model.lateral_velocity + model.speed * heading)
        front = rear + model.bicycle["w"] * heading + model.wheel("front").offset
        model.rider.tell(self.heading * heading + self.position * front)
