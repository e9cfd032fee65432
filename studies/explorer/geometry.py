"""Geometry and masses of a bicycle that the page changes: sliders, impossible values, a side view drawn to scale."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from bicycle.effects.sprung_joint import HEIGHT_ABOVE_HUB
from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.front_hinge import hinge_at
from tyre.ground.errors import InputError

GEOMETRY = "geometry"  # key of an address: geometry.trail=0.06 moves a number of the bicycle that the address names


class Slider(NamedTuple):
    """A parameter of the bicycle that a slider changes."""

    parameter: str  # Meijaard's key
    words: str  # what the page calls it
    unit: str  # of the slider: m, deg or kg
    low: float  # in ``unit``
    high: float  # in ``unit``


SLIDERS = {
    "trail": Slider("c", "trail", "m", -0.02, 0.15),
    "head_angle": Slider("lam", "head angle", "deg", 60.0, 80.0),
    "wheelbase": Slider("w", "wheelbase", "m", 0.85, 1.3),
    "rear_wheel_radius": Slider("rR", "radius of the rear wheel", "m", 0.2, 0.4),
    "front_wheel_radius": Slider("rF", "radius of the front wheel", "m", 0.2, 0.4),
    "rear_mass": Slider("mB", "mass of frame and rider", "kg", 3.0, 150.0),
    "front_mass": Slider("mH", "mass of fork and handlebar", "kg", 0.5, 12.0),
    "rear_wheel_mass": Slider("mR", "mass of the rear wheel", "kg", 0.5, 6.0),
    "front_wheel_mass": Slider("mF", "mass of the front wheel", "kg", 0.5, 6.0),
    "rear_x": Slider("xB", "centre of frame and rider, forward", "m", 0.1, 0.8),
    "rear_height": Slider("zB", "its height", "m", 0.3, 1.4),
    "front_x": Slider("xH", "centre of fork and handlebar, forward", "m", 0.6, 1.2),
    "front_height": Slider("zH", "its height", "m", 0.4, 1.2),
}


class Misfit(InputError):
    """Impossible geometry, by the ``key`` of the slider that was moved too far."""

    def __init__(self, key: str, words: str) -> None:
        super().__init__(words)
        self.key = f"{GEOMETRY}.{key}"


def slider_value(key: str, values: Mapping[str, float]) -> float:
    """Compute the value of a slider from parameters (SI): head angle in degrees from the horizontal, heights up."""
    value = values[SLIDERS[key].parameter]
    if key == "head_angle":
        return 90.0 - math.degrees(value)
    return -value if key.endswith("height") else value


def move_bicycle(bicycle: Bicycle, geometry: Mapping[str, Any]) -> Bicycle:
    """Move the numbers of a ``bicycle`` that ``geometry`` names; fork and handlebar follow the wheelbase."""
    values = dict(bicycle.values)
    for key, value in geometry.items():
        if key not in SLIDERS:
            raise InputError(f"{GEOMETRY}: unknown key {key!r}; known: {', '.join(SLIDERS)}")
        if key == "wheelbase" and "front_x" not in geometry:
            values["xH"] += value - values["w"]
        if key == "head_angle":
            value = math.radians(90.0 - value)
        elif key.endswith("height"):
            value = -value
        values[SLIDERS[key].parameter] = value
    for key in geometry:  # the slider that was moved is named if it is in doubt
        _refuse(key, values)
    return replace(bicycle, values=values)


def _refuse(key: str, p: Mapping[str, float]) -> None:
    """Refuse parameters ``p`` (SI) of an impossible bicycle, if the slider ``key`` may be the cause."""
    mass = sum(p[name] for name in ("mR", "mB", "mH", "mF"))
    front = (p["mB"] * p["xB"] + p["mH"] * p["xH"] + p["mF"] * p["w"]) / p["w"] / mass  # share of the weight
    offset = p["rF"] * math.sin(p["lam"]) - p["c"] * math.cos(p["lam"])
    gap = math.hypot(p["w"], p["rR"] - p["rF"]) - p["rR"] - p["rF"]
    value = slider_value(key, p)
    rules = {
        "must be above 0": value <= 0 and key != "trail",
        "must be between 45 and 90 deg": key == "head_angle" and not 45 < value < 90,
        f"the wheels overlap by {-1e3 * gap:.0f} mm": gap < 0
        and key in ("wheelbase", "rear_wheel_radius", "front_wheel_radius"),
        f"the fork needs an offset of {1e3 * offset:.0f} mm; -50 to 150 mm can be built": not -0.05 <= offset <= 0.15
        and key in ("trail", "head_angle", "front_wheel_radius"),
        f"the front wheel carries {front:.0%} of the weight; the bicycle tips over": not 0 < front < 1,
    }
    for words, broken in rules.items():
        if broken:
            raise Misfit(key, words)


def slider_fields(bicycle: Bicycle) -> list[dict[str, Any]]:
    """Describe slider and number of each key, at the values of a ``bicycle``."""
    rows = []
    for key, slider in SLIDERS.items():
        value = slider_value(key, bicycle.values)
        low = min(slider.low, value)
        high = max(slider.high, value)
        rows.append(
            {
                "key": f"{GEOMETRY}.{key}",
                "words": slider.words,
                "unit": slider.unit,
                "low": low,
                "high": high,
                "step": float(f"{(high - low) / 200:.1g}"),
                "value": f"{value:.4g}",
            }
        )
    return rows


def keep_hinge_on_axis(effects: Mapping[str, Any], before: Bicycle, after: Bicycle) -> dict[str, Any]:
    """Move the hinge of a flexible front frame, keeping its distance from the steer axis; return all tables."""
    table = effects.get("front_compliance")
    if not isinstance(table, Mapping) or not {"joint_x", "joint_z"} <= set(table):
        return dict(effects)
    move = axis_x(after.values, table["joint_z"]) - axis_x(before.values, table["joint_z"])
    return dict(effects) | {"front_compliance": dict(table) | {"joint_x": table["joint_x"] + move}}


def axis_x(p: Mapping[str, float], z: float) -> float:
    """Place of the steer axis at ``z`` (m, down), m before the rear contact."""
    return p["w"] + p["c"] + z * math.tan(p["lam"])


def side_view(bicycle: Bicycle, effects: Mapping[str, Any]) -> dict[str, Any]:
    """Draw a bicycle from the right in mm, z down: lines, circles with their kind, and numbers of the captions."""
    p, r = bicycle.values, max(bicycle["rR"], bicycle["rF"])
    hubs = {"rear": (0.0, -p["rR"]), "front": (p["w"], -p["rF"])}
    head, crown = (axis_x(p, z) for z in (-2.75 * r, -2 * p["rF"] - 0.03))
    bottom, seat, saddle = (0.42 * p["w"], -0.85 * r), (0.25 * p["w"], -2.2 * r), (0.22 * p["w"], -2.85 * r)
    crown_at, head_at = (crown, -2 * p["rF"] - 0.03), (head, -2.75 * r)
    grip = (head + 0.09, -2.8 * r)
    lines = {
        "ground": [[(-0.5, 0.0), (p["w"] + 0.6, 0.0)]],
        "rear": [[hubs["rear"], bottom, seat, hubs["rear"]], [seat, crown_at, bottom], [seat, saddle]],
        "front": [[hubs["front"], crown_at, head_at, grip]],
        "axis": [[(axis_x(p, 0.0), 0.0), (axis_x(p, -3.4 * r), -3.4 * r)]],
        "trail": [[(p["w"], 0.03), (axis_x(p, 0.0), 0.03)]],
    }
    circles = [(*hubs[wheel], radius, "wheel") for wheel, radius in (("rear", p["rR"]), ("front", p["rF"]))]
    if p["mB"] > 45.0:  # kg: no frame weighs that without a rider
        hip, shoulder = (saddle[0] + 0.02, saddle[1] - 0.08), (0.60 * p["w"], -3.9 * r)
        lines["rider"] = [[(bottom[0] + 0.1, bottom[1] - 0.1), (0.52 * p["w"], -2.1 * r), hip, shoulder, grip]]
        circles.append((shoulder[0] + 0.12, shoulder[1] - 0.16, 0.11, "rider"))
    for name, x, z in (("R", 0.0, -p["rR"]), ("B", p["xB"], p["zB"]), ("H", p["xH"], p["zH"]), ("F", p["w"], -p["rF"])):
        circles.append((x, z, 0.017 * p[f"m{name}"] ** (1 / 3), "mass"))
    hinge = _hinge(bicycle, effects)
    if hinge is not None:
        x, z = hinge
        lines["hinge"] = [[(x - 0.05, z - 0.05), (x + 0.05, z + 0.05)], [(x - 0.05, z + 0.05), (x + 0.05, z - 0.05)]]
    return {
        "lines": [(kind, [_path(line) for line in lines_of_kind]) for kind, lines_of_kind in lines.items()],
        "circles": [
            (kind, round(1e3 * x, 1), round(1e3 * z, 1), round(1e3 * radius, 1)) for x, z, radius, kind in circles
        ],
        "trail": 1e3 * p["c"],
        "at": 1e3 * (p["w"] + p["c"] / 2),
        "head_angle": slider_value("head_angle", p),
        "wheelbase": p["w"],
        "mass": sum(p[key] for key in ("mR", "mB", "mH", "mF")),
        "box": (-0.55e3, -4.9e3 * r, 1e3 * (p["w"] + 1.2), 4.9e3 * r + 130),
    }


def _hinge(bicycle: Bicycle, effects: Mapping[str, Any]) -> tuple[float, float] | None:
    """Place (x, z), m, of the hinge of a flexible front frame; None without one."""
    table = effects.get("front_compliance")
    if not isinstance(table, Mapping):
        return None
    if HEIGHT_ABOVE_HUB in table:
        return hinge_at(bicycle.values, float(table[HEIGHT_ABOVE_HUB]))
    return (float(table["joint_x"]), float(table["joint_z"])) if {"joint_x", "joint_z"} <= set(table) else None


def _path(points: Iterable[tuple[float, float]]) -> str:
    """Write points (m) as the path of an SVG, mm."""
    return "L".join(f"{1e3 * x:.1f} {1e3 * z:.1f}" for x, z in points)
