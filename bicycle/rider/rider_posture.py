"""Seat, bar and posture: joint angles of a rider that reaches both."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources.abc import Traversable
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from bicycle.rider.rider_body import TO_BICYCLE, RiderMeasurements
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.files import data_root, read_toml
from tyre.ground.number_with_sd import read_key_values
from tyre.ground.schema import Check, by_name, list_of, maybe, number, read, table, text

HUBS, SADDLE = ("rear_hub_to_hand_m", "front_hub_to_hand_m"), ("reach_m", "drop_m")  # either place the hands
RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "chain_stay_m": (0.2, 1.2), "bottom_bracket_height_m": (0.1, 0.8), "seat_tube_angle_deg": (20.0, 110.0),
        "saddle_distance_m": (0.3, 1.2), "hand_width_m": (0.1, 1.2), "rear_hub_to_hand_m": (0.3, 2.5),
        "front_hub_to_hand_m": (0.3, 2.5), "reach_m": (-0.5, 1.5), "drop_m": (-0.8, 0.8),
    }
)  # fmt: skip
"""Allowed values; outside, the unit is wrong."""

DEFAULT_SD = MappingProxyType({key: 0.5 if key.endswith("deg") else 0.005 for key in RANGES})
"""One sd of a measured value that has none stated: a tape and an angle gauge."""

LEG_SHARE, LEG_SHARE_SD = 0.837, 0.033
"""Bottom bracket to saddle over hip to heel: mean and sd of one rider on three measured bicycles (0.809, 0.830, 0.873);
0.883 of the inseam, the common rule, is 0.83 of hip to heel of that rider."""


@dataclass(frozen=True)
class SeatGeometry:
    """Seat and hands of a bicycle."""

    # by key of :data:`RANGES`: m, or degrees where the key ends in _deg
    values: Mapping[str, float] = field(default_factory=dict)
    sd: Mapping[str, float] = field(default_factory=dict)  # one sd of each value, in its unit
    assumed: tuple[str, ...] = ()  # keys that were not measured but filled in by a rule
    source: str = ""  # where the measurements come from, in words

    @property
    def has_hands(self) -> bool:
        """True if it holds the place of the hands, measured from the hubs or from the saddle."""
        return HUBS[0] in self.values or SADDLE[0] in self.values

    def shift(self, key: str, by: float) -> "SeatGeometry":
        """A geometry with the value of ``key`` shifted ``by`` an amount (m or degrees, as the key says)."""
        return replace(self, values={**self.values, key: self.values[key] + by})

    def fill_in(self, rule: Mapping[str, tuple[float, float]]) -> "SeatGeometry":
        """A geometry with values and their sd filled in by a rule, marked as assumed."""
        values, sd = ({key: pair[k] for key, pair in rule.items()} for k in (0, 1))
        return SeatGeometry({**self.values, **values}, {**self.sd, **sd}, (*self.assumed, *rule), self.source)


class Contacts(NamedTuple):
    """Contacts of the rider: (x, z) of hip on the saddle, pedals and hands; half the distance of the hands."""

    hip: Array  # (2,), (x, z) of the hip joint over the saddle, m; x forward of the rear contact, z down
    pedals: Array  # (2,), (x, z) of the bottom bracket, the mean place of the pedals, m
    hands: Array  # (2,), (x, z) of both hands, m
    half_width: float  # m, from the mid-plane to either hand


def contacts(geometry: SeatGeometry, bicycle: Mapping[str, float]) -> Contacts:
    """Contacts (m) of a complete geometry on a ``bicycle`` with wheelbase ``w`` and wheel radii ``rR``, ``rF`` (m)."""
    v, w, rear, front = geometry.values, bicycle["w"], bicycle["rR"], bicycle["rF"]
    stay, bracket = v["chain_stay_m"], v["bottom_bracket_height_m"]
    if stay < abs(rear - bracket):
        raise InputError(
            f"chain_stay_m = {stay:g} is shorter than the height of the rear hub over the bottom bracket, "
            f"{abs(rear - bracket):.3g} m"
        )
    pedals = np.array([math.sqrt(stay**2 - (rear - bracket) ** 2), -bracket])
    angle = math.radians(v["seat_tube_angle_deg"])
    hip = pedals - v["saddle_distance_m"] * np.array([math.cos(angle), math.sin(angle)])
    half = v["hand_width_m"] / 2
    if HUBS[0] not in v:
        return Contacts(hip, pedals, hip + np.array([v["reach_m"], v["drop_m"]]), half)
    hands = _hands_over_hubs(np.array([0.0, -rear]), np.array([w, -front]), v[HUBS[0]], v[HUBS[1]], half)
    return Contacts(hip, pedals, hands, half)


def _hands_over_hubs(rear: Array, front: Array, to_rear: float, to_front: float, half: float) -> Array:
    """Hands (x, z), m, above the line of the hubs, ``to_rear`` and ``to_front`` (m) from them, ``half`` m aside."""
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


def complete_geometry(
    geometry: SeatGeometry, rider: RiderMeasurements, bicycle: Mapping[str, float], *, hand_width: float
) -> SeatGeometry:
    """Fill in what a geometry leaves out, but for the place of the hands, by a fit rule; these are ``assumed``."""
    rule = {
        "chain_stay_m": (0.41, 0.02),
        "bottom_bracket_height_m": (bicycle["rR"] - 0.055, 0.015),
        "seat_tube_angle_deg": (73.0, 1.5),
        "saddle_distance_m": (LEG_SHARE * rider.leg, LEG_SHARE_SD * rider.leg),
        "hand_width_m": (hand_width, 0.04),
    }
    return geometry.fill_in({key: pair for key, pair in rule.items() if key not in geometry.values})


def with_hands(geometry: SeatGeometry, hands: Array, *, sd: float) -> SeatGeometry:
    """A geometry with assumed ``hands`` (2,), m forward of the hip and below it, and their ``sd`` (m)."""
    return geometry.fill_in({key: (float(x), sd) for key, x in zip(SADDLE, hands, strict=True)})


class Posture(NamedTuple):
    """A way to sit: lean of the torso from the vertical, and the place of a suitable handlebar (rad, m)."""

    torso_lean: float  # rad from the vertical, positive forward: line from hip to shoulder
    arm_to_torso: float  # rad, line from shoulder to hand against the torso; 0: arms hang along it
    elbow_flexion: float  # rad; 0: straight
    hand_width: float  # m, from hand to hand
    source: str  # who measured or advises it, in words


POSTURES: Mapping[str, Posture] = MappingProxyType(
    {
        name: Posture(math.radians(lean), math.radians(arm), math.radians(elbow), hand_width, source)
        for name, (lean, arm, elbow), hand_width, source in (
            (
                "upright",
                (15, 52, 20),
                0.56,
                "torso 8.5 to 16 deg from the vertical and hands 0.535 to 0.58 m apart on three measured city bicycles",
            ),
            (
                "hoods",
                (45, 80, 20),
                0.44,
                "torso 45 deg from the horizontal, elbows 20 deg (Burt 2014; 19 +- 8 deg measured on 50 cyclists)",
            ),
            (
                "drops",
                (55, 80, 30),
                0.42,
                "torso 35 deg from the horizontal, within 30 to 45 deg of racing cyclists (Pruitt & Matheny 2006)",
            ),
        )
    }
)
"""``arm_to_torso``: line from shoulder to hand against the torso; together with the elbow it places an assumed bar."""

LEAN_LIMITS = (-60.0, 90.0)  # degrees


class Lengths(NamedTuple):
    """Link lengths of a body, m: hip to lowest rib, on to the nipple, on to the shoulder, half the shoulders; limbs."""

    pelvis: float  # m, hip to lowest rib
    thorax: float  # m, lowest rib to nipple
    chest: float  # m, nipple to shoulder
    half_shoulders: float  # m, mid-plane to shoulder joint
    thigh: float  # m, hip to knee
    shank: float  # m, knee to heel
    upper_arm: float  # m, shoulder to elbow
    forearm: float  # m, elbow to base of the thumb

    @classmethod
    def of(cls, m: Mapping[str, float]) -> "Lengths":
        """From Yeadon's measurements ``m``, in m: the leg ends at the heel, the arm at the base of the thumb."""
        return cls(
            m["Ls2L"],
            m["Ls3L"] - m["Ls2L"],
            m["Ls4L"] - m["Ls3L"],
            m["Ls4w"] / 2,
            m["Lj3L"],
            m["Lj5L"] - m["Lj3L"] + m["Lj6L"],
            m["La2L"],
            m["La4L"] - m["La2L"] + m["La5L"],
        )


@dataclass(frozen=True)
class Seated:
    """A solved posture: the 21 joint angles of ``yeadon`` (rad) and the angles a bicycle fitter would read."""

    configuration: Mapping[str, float]  # joint angle of ``yeadon`` -> rad
    torso_lean: float  # rad from the vertical, positive forward: line from hip to shoulder
    knee_flexion: float  # rad at mid-stroke; 0: straight
    elbow_flexion: float  # rad; 0: straight
    thigh_to_torso: float  # rad, enclosed by thigh and trunk; small: they touch

    @property
    def remarks(self) -> tuple[str, ...]:
        """Notes on angles that a body would not take."""
        knees, elbows, thigh = map(math.degrees, (self.knee_flexion, self.elbow_flexion, self.thigh_to_torso))
        conditions = {
            f"the knees are bent {knees:.0f} deg, more than a body allows (about 150)": knees > 150,
            f"the elbows are bent {elbows:.0f} deg, more than a body allows (about 150)": elbows > 150,
            "the knees are straight at mid-stroke; the saddle is too high for the legs": knees < 5,
            f"thigh and trunk enclose {thigh:.0f} deg: they would touch": thigh < 40,
        }
        return tuple(text for text, holds in conditions.items() if holds)


def shoulder(hip: Array, body: Lengths, *, torso_lean: float, back_rounding: float) -> tuple[Array, float]:
    """Shoulder (x, z), m, and lean of the pelvis (rad): the line from hip to shoulder leans by ``torso_lean``."""
    bends = np.array([0.0, back_rounding / 2, back_rounding])
    spine = np.array([body.pelvis, body.thorax, body.chest])
    forward, up = float(spine @ np.sin(bends)), float(spine @ np.cos(bends))
    pelvis = torso_lean - math.atan2(forward, up)
    length = math.hypot(forward, up)
    return hip + length * np.array([math.sin(torso_lean), -math.cos(torso_lean)]), pelvis


def fitting_hands(body: Lengths, posture: Posture, *, torso_lean: float) -> Array:
    """Hands (x, z), m from the hip, where the arm of a ``posture`` ends, for a handlebar that was not measured."""
    top, _ = shoulder(np.zeros(2), body, torso_lean=torso_lean, back_rounding=0.0)
    u, f = body.upper_arm, body.forearm
    reach = math.sqrt(u * u + f * f + 2 * u * f * math.cos(posture.elbow_flexion))
    flat = math.sqrt(reach**2 - (posture.hand_width / 2 - body.half_shoulders) ** 2)
    line = posture.arm_to_torso - torso_lean  # forward of the vertical
    return top + flat * np.array([math.sin(line), math.cos(line)])


def sit(
    body: Lengths,
    at: Contacts,
    *,
    torso_lean: float,
    back_rounding: float = 0.0,
    elbows_out: float = 0.0,
    strict: bool = True,
) -> Seated:
    """Joint angles (rad) of a body seated at three contacts; ``strict`` refuses limbs that are too short.

    Angles are in rad: the torso leans forward, the back rounds forward, elbows turn outwards.
    """
    top, pelvis = shoulder(at.hip, body, torso_lean=torso_lean, back_rounding=back_rounding)
    down = at.pedals - at.hip
    to_pedals, leg = float(np.hypot(*down)), body.thigh + body.shank
    if strict and to_pedals > leg:
        raise InputError(
            f"the legs are too short by {1000 * (to_pedals - leg):.0f} mm: {leg:.3f} m from hip to heel, "
            f"{to_pedals:.3f} m from saddle to bottom bracket; lower the saddle (saddle_distance_m) "
            "or take a taller rider"
        )
    if strict:
        _check_arms(body, at, top)
    at_hip, knee = two_links(body.thigh, body.shank, to_pedals)
    thigh = math.atan2(down[0], down[1]) + at_hip
    s, h = np.array([top[0], -body.half_shoulders, top[1]]), np.array([at.hands[0], -at.half_width, at.hands[1]])
    distance = float(np.linalg.norm(h - s))
    line = (h - s) / distance
    at_shoulder, elbow = two_links(body.upper_arm, body.forearm, distance)
    below = _perpendicular(line, np.array([0.0, 0.0, 1.0]))
    out = _perpendicular(line, np.array([0.0, -1.0, 0.0]), below)
    side = math.cos(elbows_out) * below + math.sin(elbows_out) * out
    upper = math.cos(at_shoulder) * line + math.sin(at_shoulder) * side
    arm = _arm_angles(upper, np.cross(line, side), chest_lean=pelvis + back_rounding)
    configuration = {
        "somersault": pelvis,
        "tilt": 0.0,
        "twist": 0.0,
        "PTsagittalFlexion": back_rounding / 2,
        "PTbending": 0.0,
        "TCspinalTorsion": 0.0,
        "TCsagittalSpinalFlexion": back_rounding / 2,
        "CA1extension": arm[0],
        "CA1adduction": arm[1],
        "CA1rotation": arm[2],
        "CB1extension": arm[0],
        "CB1abduction": -arm[1],
        "CB1rotation": -arm[2],
        "A1A2extension": -elbow,
        "B1B2extension": -elbow,
        "PJ1extension": -thigh - pelvis,
        "PJ1adduction": 0.0,
        "PK1extension": -thigh - pelvis,
        "PK1abduction": 0.0,
        "J1J2flexion": knee,
        "K1K2flexion": knee,
    }
    return Seated(MappingProxyType(configuration), torso_lean, knee, elbow, math.pi - thigh - torso_lean)


def two_links(first: float, second: float, distance: float) -> tuple[float, float]:
    """Angle at the root between the first link and the line to the end, and how far the middle joint is bent (rad)."""
    root = (first**2 + distance**2 - second**2) / (2 * first * distance)
    bend = (distance**2 - first**2 - second**2) / (2 * first * second)
    return math.acos(min(1.0, max(-1.0, root))), math.acos(min(1.0, max(-1.0, bend)))


def _arm_angles(upper: Array, hinge: Array, *, chest_lean: float) -> tuple[float, float, float]:
    """Extension, adduction and rotation (rad) of the left upper arm against the chest."""
    z, x = -TO_BICYCLE @ upper, TO_BICYCLE @ hinge
    c, s = math.cos(chest_lean), math.sin(chest_lean)
    arm = np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ np.column_stack([x, np.cross(z, x), z])
    return math.atan2(-arm[1, 2], arm[2, 2]), math.asin(arm[0, 2]), math.atan2(-arm[0, 1], arm[0, 0])


def _perpendicular(line: Array, direction: Array, other: Array | None = None) -> Array:
    """Unit vector (3,) of the part of ``direction`` at right angles to the unit vector ``line``, and to ``other``."""
    rest = direction - line * (line @ direction)
    if other is not None:
        rest = rest - other * (other @ rest)
    return np.asarray(rest / np.linalg.norm(rest))


def _check_arms(body: Lengths, at: Contacts, top: Array) -> None:
    arm, aside = body.upper_arm + body.forearm, at.half_width - body.half_shoulders
    distance = math.hypot(*(at.hands - top), aside)
    if distance <= arm:
        return
    said = (
        f"the arms are too short by {1000 * (distance - arm):.0f} mm: {arm:.3f} m from shoulder to hand, "
        f"{distance:.3f} m from shoulder to handlebar"
    )
    torso, away = float(np.hypot(*(top - at.hip))), float(np.hypot(*(at.hands - at.hip)))
    towards = math.atan2(at.hands[0] - at.hip[0], at.hip[1] - at.hands[1])  # from the vertical to the bar
    cosine = (away**2 + torso**2 - (arm**2 - aside**2)) / (2 * away * torso)
    if cosine <= 1:
        low, high = (math.degrees(towards + sign * math.acos(cosine)) for sign in (-1, 1))
        low, high = max(low, LEAN_LIMITS[0]), min(high, LEAN_LIMITS[1])
        if low < high:
            raise InputError(f"{said}; they reach it with a torso lean of {low:.1f} to {high:.1f} deg (--torso-lean)")
    raise InputError(f"{said}, at any torso lean; move the handlebar closer or take a taller rider")


def _range_check(key: str) -> Check:
    low, high = RANGES[key]
    return number(least=low, most=high, outside=f"is outside {low:g} to {high:g}; is the unit right?")


GEOMETRY = table(
    {
        maybe("description", ""): text(),
        maybe("source", ""): text(),
        maybe("values", {}): table({maybe(key): _range_check(key) for key in RANGES}, kind="values"),
        maybe("sd", {}): by_name(
            number(least=0, outside="where a standard deviation must not be negative"), RANGES, kind="sd"
        ),
        maybe("assumed", []): list_of(text(), "must be a list of keys"),
        maybe("posture", {}): by_name(
            table({maybe(key): _range_check(key) for key in ("hand_width_m", *HUBS, *SADDLE)}), POSTURES, kind="posture"
        ),
    }
)
RAW = {
    "chain_stay_m": "lcs", "bottom_bracket_height_m": "hbb", "seat_tube_angle_deg": "lamst", "saddle_distance_m": "lst",
    "hand_width_m": "whb", "rear_hub_to_hand_m": "LhbR", "front_hub_to_hand_m": "LhbF",
}  # fmt: skip
"""Keys of the raw ``*Measured.txt`` of BicycleParameters (m, rad); the saddle is lst + lsp above the bracket."""


def packaged_geometry(bicycle_name: str) -> Traversable | None:
    """The packaged geometry of the packaged bicycle ``bicycle_name``; None where there is none."""
    file = data_root().joinpath("riders", "seat_geometry", f"{bicycle_name}.toml")
    return file if file.is_file() else None


def read_geometry(path: Path | Traversable, posture: str) -> SeatGeometry:
    """Read a geometry for a posture; what the file leaves out stays out."""
    if path.name.lower().endswith(".txt"):
        return _raw(path)
    content = read(GEOMETRY, read_toml(path, "geometry file"), where=str(path))
    values, own = content["values"], content["posture"].get(posture, {})
    if any(key in own for key in (*HUBS, *SADDLE)):
        values = {key: value for key, value in values.items() if key not in (*HUBS, *SADDLE)}
    values = values | own
    given = [tuple(key in values for key in pair) for pair in (HUBS, SADDLE)]
    if any(any(pair) and not all(pair) for pair in given) or all(all(pair) for pair in given):
        raise InputError(
            f"{path}: give the hands either by {HUBS[0]} and {HUBS[1]} or by {SADDLE[0]} and {SADDLE[1]}, or leave "
            "all four out"
        )
    refuse_unknown("assumed key", content["assumed"], values, where=str(path))
    kept = {key: content["sd"].get(key, DEFAULT_SD[key]) for key in values}
    return SeatGeometry(values, kept, tuple(content["assumed"]), content["source"] or path.name)


def _raw(path: Path | Traversable) -> SeatGeometry:
    """Seat and handlebar of a file of ``key = value+/-sd`` lines; its many other keys are other measurements."""
    if not path.is_file():
        raise InputError(f"{path}: no such geometry file")
    keys = (*RAW.values(), "lsp")
    found, spread = read_key_values(path, keys, kind="measurement", others=True)
    missing = [key for key in keys if key not in found]
    if missing:
        raise InputError(f"{path}: seat and handlebar need {', '.join(keys)}; missing: {', '.join(missing)}")
    values, sd = {key: found[raw] for key, raw in RAW.items()}, {key: spread.get(raw) for key, raw in RAW.items()}
    angle, saddle = "seat_tube_angle_deg", "saddle_distance_m"
    values |= {angle: math.degrees(found["lamst"]), saddle: found["lsp"] + found["lst"]}
    sd[angle] = math.degrees(spread["lamst"]) if "lamst" in spread else None
    sd[saddle] = math.hypot(spread["lsp"], spread["lst"]) if {"lsp", "lst"} <= set(spread) else None
    return SeatGeometry(values, {key: DEFAULT_SD[key] if s is None else s for key, s in sd.items()}, (), path.name)
