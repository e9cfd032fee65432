"""A seated posture in closed form: joint angles for hips on the saddle, feet at the pedals, hands on the bar."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from bicycle.rider.seat_geometry import Contacts
from tyre.base.arrays import Array
from tyre.base.errors import InputError


class Posture(NamedTuple):
    """A way to sit: lean of the torso from the vertical, and where a bar would be that suits it (rad, m)."""

    torso_lean: float
    arm_to_torso: float
    elbow_flexion: float
    hand_width: float
    source: str

    def told(self, torso_lean: float) -> str:
        """What places an assumed bar: the source, or a ``torso_lean`` (rad) that is not the posture's own."""
        if torso_lean == self.torso_lean:
            return self.source
        lean, elbows = math.degrees(torso_lean), math.degrees(self.elbow_flexion)
        return (
            f"torso {lean:.0f} deg forward of the vertical as given, elbows {elbows:.0f} deg, arms as of this posture"
        )


POSTURES: Mapping[str, Posture] = MappingProxyType(
    {
        "upright": Posture(
            math.radians(15), math.radians(52), math.radians(20), 0.56,
            "torso 8.5 to 16 deg from the vertical and hands 0.535 to 0.58 m apart on three measured city bicycles",
        ),
        "hoods": Posture(
            math.radians(45), math.radians(80), math.radians(20), 0.44,
            "torso 45 deg from the horizontal, elbows 20 deg (Burt 2014; 19 +- 8 deg measured on 50 cyclists)",
        ),
        "drops": Posture(
            math.radians(55), math.radians(80), math.radians(30), 0.42,
            "torso 35 deg from the horizontal, within 30 to 45 deg of racing cyclists (Pruitt & Matheny 2006)",
        ),
    }
)  # fmt: skip
"""``arm_to_torso``: line from shoulder to hand against the torso; together with the elbow it places an assumed bar."""

LEAN_LIMITS = (-60.0, 90.0)  # degrees
STRAIGHTEST_KNEE, SHARPEST = math.radians(5), math.radians(150)
THIGH_MEETS_TRUNK = math.radians(40)


class Lengths(NamedTuple):
    """Link lengths of a body, m: hip to lowest rib, on to the nipple, on to the shoulder, half the shoulders; limbs."""

    pelvis: float
    thorax: float
    chest: float
    half_shoulders: float
    thigh: float
    shank: float
    upper_arm: float
    forearm: float

    @classmethod
    def of(cls, m: Mapping[str, float]) -> "Lengths":
        """From Yeadon's measurements ``m``, in m: the leg ends at the heel, the arm at the base of the thumb."""
        return cls(
            m["Ls2L"], m["Ls3L"] - m["Ls2L"], m["Ls4L"] - m["Ls3L"], m["Ls4w"] / 2,
            m["Lj3L"], m["Lj5L"] - m["Lj3L"] + m["Lj6L"], m["La2L"], m["La4L"] - m["La2L"] + m["La5L"],
        )  # fmt: skip


@dataclass(frozen=True)
class Seated:
    """A solved posture: the 21 joint angles of ``yeadon`` (rad) and the angles a bicycle fitter would read."""

    configuration: Mapping[str, float]
    torso_lean: float
    knee_flexion: float
    elbow_flexion: float
    thigh_to_torso: float

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a body would not do, in words."""
        found = []
        for name, angle in (("knees", self.knee_flexion), ("elbows", self.elbow_flexion)):
            if angle > SHARPEST:
                found.append(f"the {name} are bent {math.degrees(angle):.0f} deg, more than a body allows (about 150)")
        if self.knee_flexion < STRAIGHTEST_KNEE:
            found.append("the knees are straight at mid-stroke; the saddle is too high for the legs")
        if self.thigh_to_torso < THIGH_MEETS_TRUNK:
            found.append(f"thigh and trunk enclose {math.degrees(self.thigh_to_torso):.0f} deg: they would touch")
        return tuple(found)


def shoulder(hip: Array, body: Lengths, *, torso_lean: float, back_rounding: float) -> tuple[Array, float]:
    """Shoulder (x, z), m, and lean of the pelvis (rad), so that the line from hip to shoulder leans by ``torso_lean``.

    Parameters
    ----------
    hip : ndarray, shape (2,)
        (x, z), m.
    body : Lengths
    torso_lean : float
        From the vertical, rad.
    back_rounding : float
        Lean of the chest beyond that of the pelvis, rad; half of it comes at the lowest rib.
    """
    bends = np.array([0.0, back_rounding / 2, back_rounding])
    spine = np.array([body.pelvis, body.thorax, body.chest])
    forward, up = float(spine @ np.sin(bends)), float(spine @ np.cos(bends))
    pelvis = torso_lean - math.atan2(forward, up)
    length = math.hypot(forward, up)
    return hip + length * np.array([math.sin(torso_lean), -math.cos(torso_lean)]), pelvis


def fitting_hands(body: Lengths, posture: Posture, *, torso_lean: float) -> Array:
    """Hands (x, z) relative to the hip where a posture's arm ends, for a bar that was not measured.

    Parameters
    ----------
    body : Lengths
    posture : Posture
    torso_lean : float
        From the vertical, rad.
    """
    top, _ = shoulder(np.zeros(2), body, torso_lean=torso_lean, back_rounding=0.0)
    u, f = body.upper_arm, body.forearm
    reach = math.sqrt(u * u + f * f + 2 * u * f * math.cos(posture.elbow_flexion))
    flat = math.sqrt(reach**2 - (posture.hand_width / 2 - body.half_shoulders) ** 2)
    line = posture.arm_to_torso - torso_lean  # forward of the vertical
    return top + flat * np.array([math.sin(line), math.cos(line)])


def sit(
    body: Lengths, at: Contacts, *, torso_lean: float, back_rounding: float = 0.0, elbows_out: float = 0.0,
    strict: bool = True,
) -> Seated:  # fmt: skip
    """Joint angles of a body seated at three contacts.

    Each limb is two links between given ends. The legs move in planes along the bicycle; the elbows lie below the
    line from shoulder to hand, turned outward about it by ``elbows_out`` from the vertical plane (hinge horizontal).

    Parameters
    ----------
    body : Lengths
    at : Contacts
    torso_lean, back_rounding, elbows_out : float
        rad; see :func:`shoulder`.
    strict : bool
        False: a limb that is too short is stretched towards its end instead of an error (for small changes of a
        posture that just reaches).

    Raises
    ------
    InputError
        Legs or arms too short, with what is missing and what would help.
    """
    top, pelvis = shoulder(at.hip, body, torso_lean=torso_lean, back_rounding=back_rounding)
    down = at.pedals - at.hip
    if strict:
        _check_legs(body, float(np.hypot(*down)))
        _check_arms(body, at, top)
    at_hip, knee = two_links(body.thigh, body.shank, float(np.hypot(*down)))
    thigh = math.atan2(down[0], down[1]) + at_hip
    s, h = np.array([top[0], -body.half_shoulders, top[1]]), np.array([at.hands[0], -at.half_width, at.hands[1]])
    distance = float(np.linalg.norm(h - s))
    line = (h - s) / distance
    at_shoulder, elbow = two_links(body.upper_arm, body.forearm, distance)
    below = _across(line, np.array([0.0, 0.0, 1.0]))
    out = _across(line, np.array([0.0, -1.0, 0.0]), below)
    side = math.cos(elbows_out) * below + math.sin(elbows_out) * out
    upper = math.cos(at_shoulder) * line + math.sin(at_shoulder) * side
    arm = arm_angles(upper, np.cross(line, side), chest_lean=pelvis + back_rounding)
    configuration = {
        "somersault": pelvis, "tilt": 0.0, "twist": 0.0, "PTsagittalFlexion": back_rounding / 2, "PTbending": 0.0,
        "TCspinalTorsion": 0.0, "TCsagittalSpinalFlexion": back_rounding / 2,
        "CA1extension": arm[0], "CA1adduction": arm[1], "CA1rotation": arm[2],
        "CB1extension": arm[0], "CB1abduction": -arm[1], "CB1rotation": -arm[2],
        "A1A2extension": -elbow, "B1B2extension": -elbow,
        "PJ1extension": -thigh - pelvis, "PJ1adduction": 0.0, "PK1extension": -thigh - pelvis, "PK1abduction": 0.0,
        "J1J2flexion": knee, "K1K2flexion": knee,
    }  # fmt: skip
    return Seated(MappingProxyType(configuration), torso_lean, knee, elbow, math.pi - thigh - torso_lean)


def two_links(first: float, second: float, distance: float) -> tuple[float, float]:
    """Angle at the root between the first link and the line to the end, and how far the middle joint is bent (rad).

    Law of cosines; a distance out of reach gives the straight or folded limb.

    Parameters
    ----------
    first, second : float
        Lengths of the links, m.
    distance : float
        From root to end, m.
    """
    root = (first**2 + distance**2 - second**2) / (2 * first * distance)
    bend = (distance**2 - first**2 - second**2) / (2 * first * second)
    return math.acos(min(1.0, max(-1.0, root))), math.acos(min(1.0, max(-1.0, bend)))


def arm_angles(upper: Array, hinge: Array, *, chest_lean: float) -> tuple[float, float, float]:
    """Extension, adduction and rotation (rad) of the left upper arm against the chest.

    The three are successive turns about x, y, z of the moving arm (``yeadon``: x left, y back, z up, the arm hangs
    along -z and the elbow turns about x).

    Parameters
    ----------
    upper, hinge : ndarray, shape (3,)
        Unit vectors on the bicycle: shoulder to elbow, and the elbow's axis (to the left).
    chest_lean : float
        Forward lean of the chest from the vertical, rad.
    """
    z, x = -to_yeadon(upper), to_yeadon(hinge)
    c, s = math.cos(chest_lean), math.sin(chest_lean)
    arm = np.array([[1, 0, 0], [0, c, s], [0, -s, c]]) @ np.column_stack([x, np.cross(z, x), z])
    return math.atan2(-arm[1, 2], arm[2, 2]), math.asin(arm[0, 2]), math.atan2(-arm[0, 1], arm[0, 0])


def to_yeadon(vector: Array) -> Array:
    """``vector`` (3,) on the bicycle (x forward, y right, z down) in the axes of ``yeadon`` (x left, y back, z up)."""
    return np.array([-vector[1], -vector[0], -vector[2]])


def _across(line: Array, direction: Array, other: Array | None = None) -> Array:
    """Unit vector of what a direction has across a line (and across another unit vector)."""
    rest = direction - line * (line @ direction)
    if other is not None:
        rest = rest - other * (other @ rest)
    return np.asarray(rest / np.linalg.norm(rest))


def _check_legs(body: Lengths, distance: float) -> None:
    leg = body.thigh + body.shank
    if distance > leg:
        raise InputError(
            f"the legs are too short by {1000 * (distance - leg):.0f} mm: {leg:.3f} m from hip to heel, "
            f"{distance:.3f} m from saddle to bottom bracket; lower the saddle (saddle_distance_m) "
            "or take a taller rider"
        )


def _check_arms(body: Lengths, at: Contacts, top: Array) -> None:
    arm, aside = body.upper_arm + body.forearm, at.half_width - body.half_shoulders
    distance = math.hypot(*(at.hands - top), aside)
    if distance <= arm:
        return
    said = (
        f"the arms are too short by {1000 * (distance - arm):.0f} mm: {arm:.3f} m from shoulder to hand, "
        f"{distance:.3f} m from shoulder to bar"
    )
    torso, away = float(np.hypot(*(top - at.hip))), float(np.hypot(*(at.hands - at.hip)))
    towards = math.atan2(at.hands[0] - at.hip[0], at.hip[1] - at.hands[1])  # from the vertical to the bar
    cosine = (away**2 + torso**2 - (arm**2 - aside**2)) / (2 * away * torso)
    if cosine <= 1:
        low, high = (math.degrees(towards + sign * math.acos(cosine)) for sign in (-1, 1))
        low, high = max(low, LEAN_LIMITS[0]), min(high, LEAN_LIMITS[1])
        if low < high:
            raise InputError(f"{said}; they reach it with a torso lean of {low:.1f} to {high:.1f} deg (--torso-lean)")
    raise InputError(f"{said}, and with no torso lean at all; bring the bar nearer or take a taller rider")
