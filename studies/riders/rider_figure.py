"""Picture of a rider on a bicycle, from the side and from the front, with outlines of the body's segments."""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle.rider.human import Segment
from bicycle.rider.rider_frame import RiderOnBicycle
from studies.reporting.plotting import GREY, drawing
from tyre.base.arrays import Array

SIDE, FRONT = (0, 2), (1, 2)
SADDLE = np.array([[0.10, 0.0], [0.16, 0.0]])  # m behind and before the hip, for the eye
BODY, NEAR, LINES, CENTRE = "#c9d8ea", "#9db8d6", "#123a6b", "#c8462f"
LIMBS = ("arm", "thigh", "shank")


def save_figure(found: RiderOnBicycle, target: Path) -> None:
    """Draw a rider on a bicycle and save it as ``target`` .png and .svg."""
    with drawing(target, width=8.6, height=5.0) as figure:
        side, front = figure.subplots(1, 2, width_ratios=[2.4, 1], sharey=True)
        _bicycle(side, found)
        for segment in sorted(found.segments, key=_order):
            _outline(side, segment, SIDE)
            _outline(front, segment, FRONT)
        _front_wheel(front, found)
        whole = found.values
        centres = np.array(
            [found.body.centre[[0, 2]], [found.frame["xB"], found.frame["zB"]], [whole["xB"], whole["zB"]]]
        )
        for (x, z), marker, label in zip(centres, "o^*", ("rider", "rear frame", "both"), strict=True):
            side.plot(x, -z, marker, color=CENTRE, markeredgecolor="white", markersize=13 if marker == "*" else 8,
                      label=label, linestyle="none", zorder=20)  # fmt: skip
        hand = found.contacts.hands
        side.plot(*_up(np.array([found.contacts.hip, found.contacts.pedals, hand])).T, "o", color="black",
                  markersize=4, zorder=21)  # fmt: skip
        _words(side, found)
        front.set_title("from the front")
        front.set_xlabel("y to the rider's right, m")
        front.invert_xaxis()
        for axes in (side, front):
            axes.set_aspect("equal")
            axes.axhline(0, color="black", linewidth=0.8)


def _order(segment: Segment) -> int:
    """Far limbs first, the near arm last."""
    return 2 * ("Right" in segment.name) + ("arm" in segment.name) - 2 * ("Left" in segment.name)


def _up(points: Array) -> Array:
    """(x, z down) to (x, height)."""
    return np.asarray(points * np.array([1.0, -1.0]))


def _outline(axes: Any, segment: Segment, plane: tuple[int, int]) -> None:
    """The silhouette of a segment: the hull of its sections in a plane, one filled piece between two sections."""
    half = segment.deep if plane == SIDE else segment.wide
    centres, halves = segment.sections[:, plane], half[:, plane]
    colour = NEAR if "Right" in segment.name or plane == FRONT else BODY
    pieces = [
        np.array([a + p, b + q, b - q, a - p])
        for a, b, p, q in zip(centres[::2], centres[1::2], halves[::2], halves[1::2], strict=True)
    ]
    if any(limb in segment.name for limb in LIMBS):  # a disc at the root closes the gap of a bent joint
        joint, radius = segment.sections[1][list(plane)], float(np.linalg.norm(segment.deep[1]))
        turn = np.linspace(0, 2 * np.pi, 41)
        disc = joint + radius * np.column_stack([np.cos(turn), np.sin(turn)])
        axes.fill(*_up(disc).T, facecolor=colour, edgecolor="none", zorder=5 + _order(segment))
    for piece in pieces:
        axes.fill(*_up(piece).T, facecolor=colour, edgecolor="none", zorder=5 + _order(segment))
        for edge in (piece[:2], piece[2:]):
            axes.plot(*_up(edge).T, color=LINES, linewidth=0.9, zorder=5 + _order(segment))


def _bicycle(axes: Any, found: RiderOnBicycle) -> None:
    """Wheels and the lines of frame and fork between measured points; the tubes are only for the eye."""
    p, at = found.frame.values, found.contacts
    rear, front = np.array([0.0, -p["rR"]]), np.array([p["w"], -p["rF"]])
    for hub, radius in ((rear, p["rR"]), (front, p["rF"])):
        turn = np.linspace(0, 2 * np.pi, 91)
        axes.plot(hub[0] + radius * np.cos(turn), -hub[1] + radius * np.sin(turn), color=GREY, linewidth=2.2)

    def on_axis(z: float) -> Array:
        return np.array([p["w"] + p["c"] + z * np.tan(p["lam"]), z])

    crown, head = on_axis(-2 * p["rF"] - 0.05), on_axis(min(at.hands[1], -2 * p["rF"] - 0.2))
    seat = at.hip + 0.25 * (at.pedals - at.hip)
    for line in (
        [rear, at.pedals, at.hip], [rear, seat, head], [at.pedals, crown], [front, crown, head, at.hands],
        [at.hip - SADDLE[0], at.hip + SADDLE[1]],
    ):  # fmt: skip
        axes.plot(*_up(np.array(line)).T, color=GREY, linewidth=2.2, solid_joinstyle="round")


def _front_wheel(axes: Any, found: RiderOnBicycle) -> None:
    p, at = found.frame.values, found.contacts
    axes.plot([0, 0], [0, 2 * p["rF"]], color=GREY, linewidth=5, zorder=1)
    axes.plot([0, 0], [2 * p["rF"], -at.hands[1]], color=GREY, linewidth=2.2, zorder=1)
    axes.plot([-at.half_width, at.half_width], [-at.hands[1]] * 2, color=GREY, linewidth=3, zorder=30)


def _words(axes: Any, found: RiderOnBicycle) -> None:
    lean = np.degrees(found.angles.torso_lean)
    axes.set_title(
        f"{found.rider.name} on {found.frame.name}, {found.posture}\n"
        f"torso {lean:.0f} deg forward, knees {np.degrees(found.seated.knee_flexion):.0f} deg, "
        f"elbows {np.degrees(found.seated.elbow_flexion):.0f} deg bent"
    )
    axes.set_xlabel("x forward of the rear contact, m")
    axes.set_ylabel("height, m")
    assumed = [key for key in found.geometry.assumed if key.endswith(("_m", "_deg"))]
    if assumed:
        axes.text(0.99, 0.99, "seat and bar: assumed" if len(assumed) > 4 else "seat and bar: partly assumed",
                  transform=axes.transAxes, ha="right", va="top", color=GREY)  # fmt: skip
    axes.legend(loc="upper left", title="mass centre", alignment="left")
