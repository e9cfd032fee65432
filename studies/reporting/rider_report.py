"""A rider on a bicycle: a picture, and the numbers that a user sees."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.files.bicycle_files import to_toml
from bicycle.parameters.bicycle import Bicycle
from bicycle.rider.rider_body import Segment, yeadon_version
from bicycle.rider.rider_frame import FRAME_KEYS, PART, RiderOnBicycle
from bicycle.rider.rider_posture import LEG_SHARE, POSTURES
from studies.reporting.markdown_text import render_file
from studies.reporting.plotting import GREY, drawing
from tyre.ground.arrays import Array

SIDE, FRONT = (0, 2), (1, 2)
BODY, NEAR, LINES, CENTRE = "#c9d8ea", "#9db8d6", "#123a6b", "#c8462f"
WORDS = {
    "title": "{rider} on {frame}, {posture}\ntorso {lean:.0f} deg forward, knees {knees:.0f} deg, elbows {elbows:.0f} "
    "deg bent",
    "description": "DERIVED: {frame} with rider {rider} ({mass:.4g} kg), {posture}: torso {lean:.0f} deg forward of "
    "the vertical; rear frame and rider joined as one rigid body",
    "source": "derived: bicycle {frame} ({frame_source}); rider {rider}, {rider_source}; body model yeadon {yeadon} "
    "(Yeadon 1990), segments turned and joined by velotyre; {angles}; seat and handlebar: {seat_source}{assumed}",
}


def save_figure(cyclist: RiderOnBicycle, target: Path) -> None:
    """Draw a rider on a bicycle and save it as ``target`` .png and .svg."""
    with drawing(target, width=8.6, height=5.0) as figure:
        side, front = figure.subplots(1, 2, width_ratios=[2.4, 1], sharey=True)
        _bicycle(side, front, cyclist)
        for segment in sorted(cyclist.segments, key=_order):
            _outline(side, segment, SIDE)
            _outline(front, segment, FRONT)
        whole, at = cyclist.values, cyclist.contacts
        centres = [cyclist.body.centre[[0, 2]], (cyclist.frame["xB"], cyclist.frame["zB"]), (whole["xB"], whole["zB"])]
        for (x, z), marker, label in zip(np.array(centres), "o^*", ("rider", "rear frame", "both"), strict=True):
            side.plot(
                x,
                -z,
                marker,
                color=CENTRE,
                markeredgecolor="white",
                markersize=13 if marker == "*" else 8,
                label=label,
                linestyle="none",
                zorder=20,
            )
        points = np.array([at.hip, at.pedals, at.hands])
        side.plot(*_to_heights(points).T, "o", color="black", markersize=4, zorder=21)
        knees, elbows = math.degrees(cyclist.seated.knee_flexion), math.degrees(cyclist.seated.elbow_flexion)
        side.set_title(WORDS["title"].format(**_names(cyclist), knees=knees, elbows=elbows))
        side.set(xlabel="Forward of the rear contact, m", ylabel="Height, m")
        assumed = [key for key in cyclist.geometry.assumed if key.endswith(("_m", "_deg"))]
        if assumed:
            side.text(
                0.99,
                0.99,
                "seat and handlebar: assumed" if len(assumed) > 4 else "seat and handlebar: partly assumed",
                transform=side.transAxes,
                ha="right",
                va="top",
                color=GREY,
            )
        side.legend(loc="upper left", title="mass centre", alignment="left")
        front.set_title("from the front")
        front.set_xlabel("y to the rider's right, m")
        front.invert_xaxis()
        for axes in (side, front):
            axes.set_aspect("equal")
            axes.axhline(0, color="black", linewidth=0.8)


def _names(cyclist: RiderOnBicycle) -> dict[str, Any]:
    lean = math.degrees(cyclist.angles.torso_lean)
    return {"rider": cyclist.rider.name, "frame": cyclist.frame.name, "posture": cyclist.posture, "lean": lean}


def _order(segment: Segment) -> int:
    """Far limbs first, the near arm last."""
    return 2 * ("Right" in segment.name) + ("arm" in segment.name) - 2 * ("Left" in segment.name)


def _to_heights(points: Array) -> Array:
    """(x, z down) to (x, height)."""
    return np.asarray(points * np.array([1.0, -1.0]))


def _outline(axes: Any, segment: Segment, plane: tuple[int, int]) -> None:
    """The silhouette of a segment: the hull of its sections in a plane, one filled piece between two sections."""
    half = segment.deep if plane == SIDE else segment.wide
    centres, halves = segment.sections[:, plane], half[:, plane]
    colour = NEAR if "Right" in segment.name or plane == FRONT else BODY
    style: dict[str, Any] = {"facecolor": colour, "edgecolor": "none", "zorder": 5 + _order(segment)}
    if any(limb in segment.name for limb in ("arm", "thigh", "shank")):  # a disc closes the gap of a bent joint
        joint, radius = segment.sections[1][list(plane)], float(np.linalg.norm(segment.deep[1]))
        turn = np.linspace(0, 2 * np.pi, 41)
        disc = joint + radius * np.column_stack([np.cos(turn), np.sin(turn)])
        axes.fill(*_to_heights(disc).T, **style)
    for a, b, p, q in zip(centres[::2], centres[1::2], halves[::2], halves[1::2], strict=True):
        piece = np.array([a + p, b + q, b - q, a - p])
        axes.fill(*_to_heights(piece).T, **style)
        for edge in (piece[:2], piece[2:]):
            axes.plot(*_to_heights(edge).T, color=LINES, linewidth=0.9, zorder=style["zorder"])


def _bicycle(side: Any, front_view: Any, cyclist: RiderOnBicycle) -> None:
    """Wheels and the lines of frame and fork between measured points; the tubes are only for the eye."""
    p, at = cyclist.frame.values, cyclist.contacts
    rear, front = np.array([0.0, -p["rR"]]), np.array([p["w"], -p["rF"]])
    for hub, radius in ((rear, p["rR"]), (front, p["rF"])):
        turn = np.linspace(0, 2 * np.pi, 91)
        side.plot(hub[0] + radius * np.cos(turn), -hub[1] + radius * np.sin(turn), color=GREY, linewidth=2.2)
    crown, head = (
        np.array([p["w"] + p["c"] + z * np.tan(p["lam"]), z])
        for z in (-2 * p["rF"] - 0.05, min(at.hands[1], -2 * p["rF"] - 0.2))
    )
    seat = at.hip + 0.25 * (at.pedals - at.hip)
    saddle = at.hip + np.array([[-0.10, 0.0], [0.16, 0.0]])
    for line in (
        [rear, at.pedals, at.hip],
        [rear, seat, head],
        [at.pedals, crown],
        [front, crown, head, at.hands],
        saddle,
    ):
        side.plot(*_to_heights(np.array(line)).T, color=GREY, linewidth=2.2, solid_joinstyle="round")
    front_view.plot([0, 0], [0, 2 * p["rF"]], color=GREY, linewidth=5, zorder=1)
    front_view.plot([0, 0], [2 * p["rF"], -at.hands[1]], color=GREY, linewidth=2.2, zorder=1)
    front_view.plot([-at.half_width, at.half_width], [-at.hands[1]] * 2, color=GREY, linewidth=3, zorder=30)


HEADERS = ("", "unit", "frame", "rider", "both", "sd", "sd mainly from")
UNITS = ("m", "m", "kg", "kg m^2", "kg m^2", "kg m^2", "kg m^2")


def with_provenance(cyclist: RiderOnBicycle, name: str) -> Bicycle:
    """The bicycle with rider as a parameter set called ``name`` that says what it is and where it comes from."""
    assumed, angles = cyclist.geometry.assumed, cyclist.angles._asdict()
    source = WORDS["source"].format(
        **_names(cyclist),
        frame_source=cyclist.frame.source or "a file",
        rider_source=cyclist.rider.source,
        yeadon=yeadon_version(),
        seat_source=cyclist.geometry.source or "fit rule",
        angles=", ".join(f"{n.replace('_', ' ')} {math.degrees(v):g} deg" for n, v in angles.items() if v),
        assumed=f"; assumed: {', '.join(assumed)}" if assumed else "",
    )
    joined = cyclist.bicycle(name, WORDS["description"].format(**_names(cyclist), mass=cyclist.body.mass), source)
    values = {k: float(f"{v:.7g}") if k in FRAME_KEYS else v for k, v in joined.values.items()}
    sd = {
        k: float(f"{v:.3g}") if k in FRAME_KEYS and k not in joined.covariance.names else v
        for k, v in joined.sd.items()
    }
    return replace(joined, values=values, sd=sd)


def file_text(cyclist: RiderOnBicycle, bicycle: Bicycle, command: str) -> str:
    """Text of the bicycle's file, with joint angles and the largest causes of uncertainty as comments."""
    correlations = "the sds are stated one by one; their correlations are left out"
    comments = [f"made by: {command}", *notes(cyclist), *([] if bicycle.covariance.names else [correlations])]
    comments += [f"{key}: sd mainly from {cause}" for key, cause in main_causes(cyclist)]
    angles = {k: v for k, v in cyclist.seated.configuration.items() if v and k[:2] not in ("CB", "B1", "PK", "K1")}
    comments.append(
        "joint angles, deg (left side): " + ", ".join(f"{k} {math.degrees(v):.2f}" for k, v in angles.items())
    )
    comments.append("seat: " + ", ".join(f"{k} {v:.4g}" for k, v in cyclist.geometry.values.items()))
    return "".join(f"# {line}\n" for line in comments) + "\n" + to_toml(bicycle)


def notes(cyclist: RiderOnBicycle) -> list[str]:
    """Notes on what is assumed or odd, one sentence each."""
    assumed = [key.rpartition("_")[0].replace("_", " ") for key in cyclist.geometry.assumed]
    content = {"found": cyclist, "assumed": assumed, "leg_share": LEG_SHARE, "usual": POSTURES[cyclist.posture]}
    content["lean"], content["elbows"] = np.degrees(
        [cyclist.angles.torso_lean, POSTURES[cyclist.posture].elbow_flexion]
    )
    return render_file("studies.reporting", "rider_notes.txt.j2", content, escaped=False).splitlines()


def main_causes(cyclist: RiderOnBicycle) -> list[tuple[str, str]]:
    """Key, and its two largest independent causes with their share of its variance, if that is 5 % or more."""
    rows = []
    for column, key in enumerate(FRAME_KEYS):
        if key not in cyclist.values:
            continue
        variance: dict[str, float] = {}
        for cause, step in cyclist.causes.items():
            name = cause.partition(PART)[0]
            variance[name] = variance.get(name, 0.0) + float(step[column] ** 2)
        total = sum(variance.values())
        largest = sorted(variance, key=lambda cause: -variance[cause])[:2]
        named = [cause for cause in largest if variance[cause] >= 0.05 * total]
        rows.append((key, ", ".join(f"{cause} {100 * variance[cause] / total:.0f} %" for cause in named)))
    return rows


def table(cyclist: RiderOnBicycle) -> list[list[Any]]:
    """Rows of key, unit, frame alone, rider alone, both, sd, main causes."""
    whole, sd, causes = cyclist.values, cyclist.sd, dict(main_causes(cyclist))
    inertia, centre = cyclist.body.inertia, cyclist.body.centre
    rider = dict(
        zip(
            FRAME_KEYS,
            (centre[0], centre[2], cyclist.body.mass, *inertia[(0, 1, 2), (0, 1, 2)], inertia[0, 2]),
            strict=True,
        )
    )
    return [
        [key, unit, cyclist.frame.values.get(key), float(rider[key]), whole[key], sd[key], causes[key]]
        for key, unit in zip(FRAME_KEYS, UNITS, strict=True)
        if key in whole
    ]


def loads(cyclist: RiderOnBicycle, bicycle: Bicycle) -> list[tuple[str, float, float]]:
    """Wheel, static load and its sd (N) from the causes of mass and mass centre."""
    mass, x = cyclist.values["mB"], cyclist.values["xB"]
    steps = np.array(list(cyclist.causes.values()))
    moment = mass * steps[:, 0] + x * steps[:, 2]
    front = bicycle["g"] * moment / bicycle["w"]
    rear = bicycle["g"] * steps[:, 2] - front
    values = bicycle.static_loads
    return [("rear", values[0], float(np.hypot.reduce(rear))), ("front", values[1], float(np.hypot.reduce(front)))]
