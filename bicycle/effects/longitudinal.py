"""Drive, brakes and gradient."""

from collections.abc import Mapping

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.effects.no_slip import NoSlip
from bicycle.equations.evaluation import evaluator
from bicycle.equations.lateral import ModelBuilder


class Longitudinal(Effect):
    """Forces along the wheels at both contacts, and what resists them: inertia of all masses, or weight on a slope.

    The force X = drive_force - brake_force changes the speed by dv/dt = X / m - g sin(slope). The equations are exact
    at the moment of the speed (under no_slip the yaw rate of a steer angle grows with dv/dt as well); roots describe
    motion only where it changes faster than the speed. Where X = m g sin(slope) the gradient keeps the speed.
    Each mass m_i feels X m_i / m backwards, which with the spin-up of the wheels moves
    (X |z_m| + sum(Iyy / r) dv/dt) / w of load to the rear wheel. Forces are those of the road on the tyres: a wheel
    that rolls freely takes -(Iyy / r^2) dv/dt, so with a rear brake alone the front wheel pushes forward, front_share =
    (Iyy / r^2) dv/dt / brake_force < 0. Tyres that a model file names are taken at these loads, those given by numbers
    are as given. Left out are slip along the wheel, which takes cornering stiffness, and the turning of the fall line
    against the heading.
    """

    drive_force = Parameter(
        "N",
        "at the rear contact, in addition to that against drag",
        typical=(0.0, 200.0),
        default=0.0,
        neutral=0.0,
        least=10.0,
    )
    brake_force = Parameter(
        "N", "backwards at both contacts", typical=(0.0, 300.0), default=0.0, neutral=0.0, least=10.0
    )
    front_share = Parameter(
        "1",
        "of the brake force; a wheel that rolls freely is a little outside 0 to 1",
        bounds=(-1.0, 2.0),
        typical=(-0.05, 1.05),
        default=0.7,
    )
    gradient = Parameter(
        "1",
        "rise of the road per length on the level, > 0 uphill",
        bounds=ANY,
        typical=(-0.2, 0.2),
        default=0.0,
        neutral=0.0,
        least=0.02,
    )
    source = "Limebeer, Sharp & Evangelou (2001), Proc. IMechE C 215, 1095-1109 (acceleration, braking, inclines)"
    on_request = "known to its owner"
    moves_load = True
    signature = (
        "braking and riding downhill reduce the damping of wobble, unless the front frame is well damped; "
        "drive and riding uphill increase it"
    )

    def check(self, bicycle: Mapping[str, float]) -> None:
        """Refuse forces that lift a wheel, as far as the bicycle alone shows; its linear model checks again."""
        evaluator((type(self), NoSlip)).check_loads({**bicycle, **self.values(bicycle)})

    def apply(self, model: ModelBuilder) -> None:
        front = -self.front_share * self.brake_force
        model.add_traction(self.drive_force - self.brake_force - front, front)
        model.incline_road(self.gradient)
