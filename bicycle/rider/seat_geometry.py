"""Where saddle, bottom bracket and hands are: measured on the bicycle, or assumed from the rider's body."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from bicycle.rider.measurements import RiderMeasurements
from tyre.base.arrays import Array
from tyre.base.errors import InputError

FRAME_KEYS = ("chain_stay_m", "bottom_bracket_height_m", "seat_tube_angle_deg", "saddle_distance_m")
HUBS, SADDLE = ("rear_hub_to_hand_m", "front_hub_to_hand_m"), ("reach_m", "drop_m")
HAND_KEYS = ("hand_width_m", *HUBS, *SADDLE)
RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "chain_stay_m": (0.2, 1.2), "bottom_bracket_height_m": (0.1, 0.8), "seat_tube_angle_deg": (20.0, 110.0),
        "saddle_distance_m": (0.3, 1.2), "hand_width_m": (0.1, 1.2), "rear_hub_to_hand_m": (0.3, 2.5),
        "front_hub_to_hand_m": (0.3, 2.5), "reach_m": (-0.5, 1.5), "drop_m": (-0.8, 0.8),
    }
)  # fmt: skip
"""What is allowed; outside, the unit is wrong."""

DEFAULT_SD = MappingProxyType({key: 0.5 if key.endswith("deg") else 0.005 for key in RANGES})
"""One sd of a measured value that has none stated: a tape and an angle gauge."""

LEG_SHARE, LEG_SHARE_SD = 0.837, 0.033
"""Bottom bracket to saddle over hip to heel: mean and sd of one rider on three measured bicycles (0.809, 0.830, 0.873);
0.883 of the inseam, the common rule, is 0.83 of hip to heel of that rider."""


@dataclass(frozen=True)
class SeatGeometry:
    """Seat and hands of a bicycle.

    ``values`` and ``sd`` have the keys of :data:`RANGES` (m and degrees): chain stay, height of the bottom bracket over
    the ground, angle of the seat tube to the horizontal, bottom bracket to top of saddle along the seat tube, distance
    between the hands, and the hands either by their distances in space from the wheel hubs (half the width included)
    or by reach (forward) and drop (downward) from the top of the saddle. ``assumed`` are the keys not measured.
    """

    values: Mapping[str, float] = field(default_factory=dict)
    sd: Mapping[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()
    source: str = ""

    @property
    def has_hands(self) -> bool:
        """Whether it says where the hands are."""
        return HUBS[0] in self.values or SADDLE[0] in self.values

    def changed(self, key: str, by: float) -> "SeatGeometry":
        """The same with the value of ``key`` shifted ``by`` an amount (m or degrees, as the key says)."""
        return SeatGeometry({**self.values, key: self.values[key] + by}, self.sd, self.assumed, self.source)


class Contacts(NamedTuple):
    """Where the rider touches the bicycle: (x, z) of hip on the saddle, pedals, hands; half the distance of the hands.

    m, x forward, z down, origin at the rear contact. The hip joint centre is put on top of the saddle and both feet at
    the bottom bracket (the mean of a turn of the cranks), as in the source of the measured bicycles.
    """

    hip: Array
    pedals: Array
    hands: Array
    half_width: float


def contacts(geometry: SeatGeometry, bicycle: Mapping[str, float]) -> Contacts:
    """Points of contact of a complete geometry on a bicycle with ``w``, ``rR``, ``rF``.

    Parameters
    ----------
    geometry : SeatGeometry
    bicycle : mapping of str to float
        Meijaard's keys, m.

    Raises
    ------
    InputError
        Distances that make no triangle.
    """
    v, w, rear, front = geometry.values, bicycle["w"], bicycle["rR"], bicycle["rF"]
    level = v["chain_stay_m"] ** 2 - (rear - v["bottom_bracket_height_m"]) ** 2
    if level < 0:
        raise InputError(
            f"chain_stay_m = {v['chain_stay_m']:g} is shorter than the height of the rear hub over the bottom bracket, "
            f"{abs(rear - v['bottom_bracket_height_m']):.3g} m"
        )
    pedals = np.array([math.sqrt(level), -v["bottom_bracket_height_m"]])
    angle = math.radians(v["seat_tube_angle_deg"])
    hip = pedals - v["saddle_distance_m"] * np.array([math.cos(angle), math.sin(angle)])
    half = v["hand_width_m"] / 2
    if HUBS[0] not in v:
        return Contacts(hip, pedals, hip + np.array([v["reach_m"], v["drop_m"]]), half)
    hands = _above(np.array([0.0, -rear]), np.array([w, -front]), v[HUBS[0]], v[HUBS[1]], half)
    return Contacts(hip, pedals, hands, half)


def _above(rear: Array, front: Array, to_rear: float, to_front: float, half: float) -> Array:
    """The point above the line of the hubs at given distances in space, ``half`` beside the mid-plane."""
    apart = front - rear
    base = float(np.hypot(*apart))
    squares = to_rear**2 - half**2, to_front**2 - half**2
    along = (squares[0] - squares[1] + base**2) / (2 * base)
    if min(squares) < 0 or squares[0] < along**2:
        raise InputError(
            f"rear_hub_to_hand_m = {to_rear:g}, front_hub_to_hand_m = {to_front:g}, hand_width_m = {2 * half:g} make "
            f"no triangle over hubs that are {base:.3f} m apart; measure the distances in space, from hub to hand"
        )
    forward = apart / base
    return rear + along * forward + math.sqrt(squares[0] - along**2) * np.array([forward[1], -forward[0]])


def completed(
    geometry: SeatGeometry, rider: RiderMeasurements, bicycle: Mapping[str, float], *, hand_width: float
) -> SeatGeometry:
    """Fill in what a geometry leaves out, but for the place of the hands, by a fit rule; these are ``assumed``.

    Chain stay 0.41 m, bottom bracket 55 mm below the rear hub and a seat tube at 73 degrees are common values of frames
    with sds that span racing to city bicycles; the saddle follows from the leg (:data:`LEG_SHARE`).

    Parameters
    ----------
    geometry : SeatGeometry
    rider : RiderMeasurements
    bicycle : mapping of str to float
        Meijaard's keys; only ``rR`` (m) is used.
    hand_width : float
        Distance between the hands, m.
    """
    rule = {
        "chain_stay_m": (0.41, 0.02),
        "bottom_bracket_height_m": (bicycle["rR"] - 0.055, 0.015),
        "seat_tube_angle_deg": (73.0, 1.5),
        "saddle_distance_m": (LEG_SHARE * rider.leg, LEG_SHARE_SD * rider.leg),
        "hand_width_m": (hand_width, 0.04),
    }
    filled = {key: value for key, value in rule.items() if key not in geometry.values}
    return SeatGeometry(
        {**geometry.values, **{key: value for key, (value, _) in filled.items()}},
        {**geometry.sd, **{key: sd for key, (_, sd) in filled.items()}},
        (*geometry.assumed, *filled),
        geometry.source,
    )


def with_hands(geometry: SeatGeometry, hands: Array, *, sd: float) -> SeatGeometry:
    """A geometry with hands that are assumed.

    Parameters
    ----------
    geometry : SeatGeometry
    hands : ndarray, shape (2,)
        (x, z) relative to the top of the saddle, m.
    sd : float
        One standard deviation of both, m.
    """
    placed = dict(zip(SADDLE, (float(x) for x in hands), strict=True))
    return SeatGeometry(
        {**geometry.values, **placed}, {**geometry.sd, **dict.fromkeys(SADDLE, sd)}, (*geometry.assumed, *SADDLE),
        geometry.source,
    )  # fmt: skip
