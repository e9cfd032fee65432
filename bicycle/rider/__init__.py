"""A rider on the bicycle: body, posture, and the frame that carries them."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "rider_body": (
            "GROUPS",
            "KEYS",
            "RigidBody",
            "as_rear_frame",
            "available_riders",
            "join",
            "read_rider",
            "rear_frame",
            "scaled_rider",
        ),
        "rider_difference": ("seated_rider",),
        "rider_frame": (
            "ANGLE_SD",
            "FRAME_KEYS",
            "felt_mass",
            "rider_on_bicycle",
        ),
        "rider_posture": (
            "Contacts",
            "Lengths",
            "POSTURES",
            "SeatGeometry",
            "complete_geometry",
            "contacts",
            "fitting_hands",
            "packaged_geometry",
            "read_geometry",
            "shoulder",
            "sit",
            "two_links",
        ),
    },
)
