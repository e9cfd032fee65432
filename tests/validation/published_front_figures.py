"""Published stiffness of head tube and fork, and the hinge that they stand for: the map, and how well it does.

Random racing frames and forks as beam models (``beam_front``) tune the map; fresh ones judge it. Each fresh frame is
"published" as TOUR and RoadBIKE would, with the error that the map assumes of a figure. Truth is the hinge of a couple
at the hub, the rider holding saddle and bottom bracket. The file of the map is written beside the result.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from studies.front_frame import PublishedFigures, map_figures, map_of
from tests.validation.beam_front import (
    FORK_RANGE,
    HEAD_TUBE_RANGE,
    WHEEL_RANGE,
    Front,
    clamped_fork_figure,
    draw_front,
    fork_compliance,
    fork_figure,
    frame_compliance,
    ground_figure,
    head_tube_figure,
    hub_compliance,
)
from tests.validation.cases import wilson
from tyre.ground import write_text

FIGURE_SD = 0.03  # relative, assumed: two laboratories, two specimens
MODEL_SD, MODEL_HEIGHT_SD = 0.05, 0.02  # of ln stiffness and m, assumed: no beam model was checked on a real front
FORK_AT, GROUND_AT = 45.0, 6.0  # N/mm, in the middle of what is drawn
METHODS = ("pair", "head_tube", "ground")
GRAVITY = 9.80665  # m/s^2, of the weight that is hung


def measure(front: Front) -> dict[str, float]:
    """What the tests read on a front, and the hinges of it, its frame and its fork."""
    whole, frame, fork = hub_compliance(front), frame_compliance(front), fork_compliance(front)
    return {
        "head_tube": head_tube_figure(front), "fork": fork_figure(front), "ground": ground_figure(front),
        "stiffness": whole.stiffness, "height": whole.pivot, "sway": whole.sway,
        "clamped_fork": clamped_fork_figure(front),
        "frame_stiffness": frame.stiffness, "frame_height": frame.pivot,
        "fork_stiffness": fork.stiffness, "fork_height": fork.pivot,
    }  # fmt: skip


def draw(seed: int, count: int) -> dict[str, Any]:
    """Measure ``count`` random fronts; each entry (count,)."""
    rng = np.random.default_rng(seed)
    rows = [measure(draw_front(rng)) for _ in range(count)]
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def tune(fronts: dict[str, Any], source: str) -> dict[str, Any]:
    """Fit the map to ``fronts``: the content of its file."""
    factor = np.exp(np.mean(np.log(fronts["frame_stiffness"] / np.degrees(fronts["head_tube"]))))
    fork = np.log(fronts["fork"] / FORK_AT)
    power, at = np.polyfit(fork, np.log(fronts["fork_stiffness"]), 1)
    slope, height = np.polyfit(fork, fronts["fork_height"], 1)
    ground = np.log(fronts["ground"] / GROUND_AT)
    ground_power, ground_at = np.polyfit(ground, np.log(fronts["stiffness"]), 1)
    content: dict[str, Any] = {
        "source": source,
        "frames": len(fork),
        "figure_sd": FIGURE_SD,
        "model_sd": MODEL_SD,
        "model_height_sd_m": MODEL_HEIGHT_SD,
        "ranges": {"head_tube": HEAD_TUBE_RANGE, "fork": FORK_RANGE, "ground": ends_of(fronts["ground"])},
        "wheel_radius_m": WHEEL_RANGE,
        "frame": {"factor": factor, "height_m": fronts["frame_height"].mean()},
        "fork": {
            "at": FORK_AT, "stiffness_N_m_per_rad": np.exp(at), "power": power,
            "height_m": height, "height_slope_m": slope,
        },
        "ground": {
            "at": GROUND_AT, "stiffness_N_m_per_rad": np.exp(ground_at), "power": ground_power,
            "height_m": fronts["height"].mean(),
        },
        "scatter": dict.fromkeys(METHODS, (0.0, 0.0, 0.0)),
    }  # fmt: skip
    content = rounded(content)
    content["scatter"] = {method: scatter(fronts, content, method) for method in METHODS}
    return rounded(content)


def scatter(fronts: dict[str, Any], content: dict[str, Any], method: str) -> list[float]:
    """Mean squares of what the map misses: of ln stiffness, of both, of the height (m)."""
    figure_map = map_of(content)
    misses = []
    for k in range(len(fronts["stiffness"])):
        stiffness, height = figure_map.hinge(method, figures_of(fronts, k, method).sizes)
        misses.append([math.log(fronts["stiffness"][k] / stiffness), fronts["height"][k] - height])
    squares = np.array(misses).T @ np.array(misses) / (len(misses) - 2)
    return [float(squares[0, 0]), float(squares[0, 1]), float(squares[1, 1])]


def figures_of(fronts: dict[str, Any], k: int, method: str, errors: Any = (0.0, 0.0)) -> PublishedFigures:
    """What would be published of front ``k``, with relative ``errors`` (2,)."""
    if method == "ground":
        deflection = 20 * GRAVITY / fronts["ground"][k] * math.exp(errors[0])
        return PublishedFigures(ground_deflection_mm=deflection, weight_kg=20.0)
    fork = fronts["fork"][k] * math.exp(errors[1]) if method == "pair" else None
    return PublishedFigures(fronts["head_tube"][k] * math.exp(errors[0]), fork)


def rounded(content: Any) -> Any:
    """Numbers of a file: five digits."""
    if isinstance(content, dict):
        return {key: rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [rounded(value) for value in content]
    return float(f"{content:.5g}") if isinstance(content, float) else content


def judge(fronts: dict[str, Any], content: dict[str, Any], method: str, rng: np.random.Generator) -> dict[str, Any]:
    """How often the intervals hold the hinge of each of the ``fronts``, and how wide they are."""
    figure_map, count = map_of(content), len(fronts["stiffness"])
    holds = {"stiffness": 0, "height": 0}
    half_widths, misses = [], []
    for k in range(count):
        hinge = map_figures(figures_of(fronts, k, method, FIGURE_SD * rng.standard_normal(2)), figure_map)
        intervals = {"stiffness": hinge.stiffness_interval, "height": hinge.height_interval}
        for name, (low, high) in intervals.items():
            holds[name] += int(low <= fronts[name][k] <= high)
        low, high = hinge.stiffness_interval
        half_widths.append((high - low) / 2 / hinge.stiffness)
        misses.append([math.log(hinge.stiffness / fronts["stiffness"][k]), hinge.height - fronts["height"][k]])
    return {
        "fronts": count,
        "stiffness_held": holds["stiffness"],
        "stiffness_interval": [round(end, 3) for end in wilson(holds["stiffness"], count)],
        "height_held": holds["height"],
        "half_width": round(float(np.max(half_widths)), 4),
        "stiffness_rms": round(float(np.sqrt(np.mean(np.array(misses)[:, 0] ** 2))), 4),
        "height_rms_m": round(float(np.sqrt(np.mean(np.array(misses)[:, 1] ** 2))), 4),
    }


HEADER = """\
# COMPUTED, not measured: from published stiffness of head tube and fork to the hinge of the front frame.
# Beam models of racing frames and forks, random within plausible tubes; figure_sd, model_sd
# and model_height_sd_m are ASSUMED: nothing was checked on a real front.
# scatter: variance of ln stiffness, covariance with the height, variance of the height (m^2), of each method.
"""


def run(*, out: Path, seed: int, frames: int = 45, fresh: int = 100) -> dict[str, Any]:
    """Tune the map on ``frames`` fronts, judge it on ``fresh`` ones."""
    command = f"python -m tests.validation published-front-figures --seed {seed} --frames {frames} --fresh {fresh}"
    content = tune(draw(seed, frames), f"own beam model, {command}")
    write_text(out / "figure_map.toml", HEADER + tomli_w.dumps(content))
    fronts = draw(seed + 1, fresh)
    rng = np.random.default_rng(seed + 2)
    return {
        "map": content,
        "fresh": {method: judge(fronts, content, method, rng) for method in METHODS},
        "sway": middle_and_ends(fronts["sway"]),
        "fork_clamped_over_in_bearings": middle_and_ends(fronts["clamped_fork"] / fronts["fork"]),
    }


def ends_of(values: Any) -> tuple[float, float]:
    """The smallest and the largest."""
    return values.min(), values.max()


def middle_and_ends(values: Any) -> list[float]:
    """The 5, 50 and 95 % quantiles."""
    return [round(float(value), 3) for value in np.quantile(values, [0.05, 0.5, 0.95])]
