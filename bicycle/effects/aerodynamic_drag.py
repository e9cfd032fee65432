"""Air drag and the drive force that balances it."""

import math

from bicycle.effect import Effect, Parameter
from bicycle.equations import ModelBuilder


class AerodynamicDrag(Effect):
    """Drag D = density area v^2 / 2 backwards along the rear frame, and the equal drive force at the rear contact.

    The virtual work of the pair in the heading frame is D (offset d(psi) - dx): a point of the rear frame that leans
    does not move forward (dx = 0), so nothing acts on lean directly. The lateral offset of the centre of pressure
    gives the yaw moment D offset, the pitching moment shifts D |z| / w of vertical load from the front wheel to the
    rear. The front wheel lifts where that exceeds its load; the linear model does not know. Usual areas are those of
    riders without a fairing, from a racer's crouch to an upright commuter.
    """

    drag_area = Parameter(
        "m^2", "drag coefficient times frontal area", typical=(0.3, 0.6), default=0.4, neutral=0.0, least=0.02
    )
    centre_of_pressure_z = Parameter(
        "m", "height of the drag on the rear frame, z down", bounds=(-math.inf, 0.0), typical=(-1.3, -0.9)
    )
    air_density = Parameter(
        "kg/m^3", "1.225 at 15 °C and sea level", typical=(1.0, 1.3), default=1.225, neutral=0.0, least=0.06
    )
    source = "Sharp (2001), Vehicle System Dynamics 35; Debraux et al. (2011), Sports Biomechanics 10 (areas)"
    signature = "grows with v^2: capsize above all; the front wheel loses load at high speed"

    def apply(self, model: ModelBuilder) -> None:
        drag = self.air_density * self.drag_area * model.speed**2 / 2
        z = self.centre_of_pressure_z
        model.add_drive_force(drag)
        model.add_yaw_moment("rear frame", drag * model.lateral_offset("rear frame", 0, z))
        model.add_load_transfer(-drag * z / model.bicycle["w"])
