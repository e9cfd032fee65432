"""Air drag along the relative wind, side force and yaw moment of the air, and the drive force that balances drag."""

from bicycle.effects.effect import ANY, Effect, Parameter
from bicycle.equations.lateral import ModelBuilder


class AerodynamicDrag(Effect):
    """Drag D = density drag_area v^2 / 2 at a point of the rear frame, and the equal drive force at the rear contact.

    Drag follows the relative wind: if the point moves to the right by s and the air by ``side_wind``, an input (m/s),
    the wind comes at the yaw angle beta = (side_wind - s) / v. With p = density v^2 / 2 the air pushes to the right by
    p (drag_area + side_area) beta and turns to the right by p yaw_moment_area beta. A side offset of the point gives
    the yaw moment D offset, the pitching moment shifts D |z| / w of vertical load from the front wheel to the rear. The
    front wheel lifts where that exceeds its load; the linear model does not know. Usual areas are those of riders
    without a fairing, from a racer's crouch to an upright commuter.
    """

    drag_area = Parameter(
        "m^2", "drag coefficient times frontal area", typical=(0.3, 0.6), default=0.4, neutral=0.0, least=0.02
    )
    centre_of_pressure_z = Parameter(
        "m", "height of the drag on the rear frame, z down", bounds=(-ANY[1], 0.0), typical=(-1.3, -0.9)
    )
    centre_of_pressure_x = Parameter(
        "m", "place of the side force on the rear frame", bounds=ANY, typical=(0.2, 0.7), default="xB"
    )
    air_density = Parameter(
        "kg/m^3", "1.225 at 15 °C and sea level", typical=(1.0, 1.3), default=1.225, neutral=0.0, least=0.06
    )
    side_area = Parameter(
        "m^2/rad",
        "slope over the yaw angle of the force across the wind, over the dynamic pressure",
        bounds=ANY,
        typical=(0.0, 1.5),
        default=0.0,
        neutral=0.0,
    )
    yaw_moment_area = Parameter(
        "m^3/rad",
        "slope over the yaw angle of the moment about the centre of pressure, over the dynamic pressure",
        bounds=ANY,
        typical=(-0.5, 0.5),
        default=0.0,
        neutral=0.0,
    )
    source = (
        "Sharp (2001), Vehicle System Dynamics 35; Debraux et al. (2011), Sports Biomechanics 10 (areas); "
        "Schwab, Dialynas & Happee (2018), Proceedings 2(6), 218 (side wind)"
    )
    signature = "grows with v^2: capsize above all; the front wheel loses load at high speed"

    def apply(self, model: ModelBuilder) -> None:
        x, z, per_speed = self.centre_of_pressure_x, self.centre_of_pressure_z, self.air_density * model.speed / 2
        drag = per_speed * self.drag_area * model.speed
        wind = per_speed * (model.add_input("side_wind", unit="m/s") - model.lateral_speed("rear frame", x, z))
        model.add_drive_force(drag)
        model.add_lateral_force("rear frame", x, z, (self.drag_area + self.side_area) * wind)
        offset = model.lateral_offset("rear frame", x, z)
        model.add_yaw_moment("rear frame", drag * offset + self.yaw_moment_area * wind)
        model.add_load_transfer(-drag * z / model.bicycle["w"])
