"""A mode as moving lines: the drawing of the film, seen from behind and from above, a path per frame."""

from typing import Any

import numpy as np

from studies.explorer.models import AtSpeed, compute_modes
from studies.explorer.state import State
from studies.motion.animation import BicycleDrawing, bicycle_drawing, modal_motion
from tyre.ground.arrays import Array

FRAMES = 24
EVERY = 4  # of the points of a wheel, to keep the page light
VIEWS = (("from behind", 1, 2), ("from above", 0, 1))  # axes across and up the picture
BODIES = {"rear frame": "rear", "rear wheel": "wheel", "front frame": "front", "front wheel": "wheel"}


def mode_motion(state: State, at: AtSpeed) -> dict[str, Any]:
    """Draw the frames of the chosen mode at the chosen speed as paths; with a table of sizes and phases (deg)."""
    model = compute_modes(state)
    name = at.first(state.mode)
    root = complex(at.named.branch(name)[0, 0])
    motion = modal_motion(model.linear, speed=state.at, eigenvalue=root, amplitude=0.25, frames=FRAMES)
    drawing = bicycle_drawing(model.model)
    poses = []
    for k, time in enumerate(motion.time.tolist()):
        outputs = {key: float(values[k]) for key, values in motion.outputs.items()}
        poses.append(drawing.pose(outputs, rolled=state.at * time))
    shape = at.named.shape(name)
    rows = [  # the phase of lean, from which the others count, is 0 but for rounding
        [part, float(shape.magnitude[part][0]), round(float(np.degrees(shape.phase[part][0])), 6) + 0.0]
        for part in shape.components
    ]
    return {
        "mode": name,
        "oscillates": bool(root.imag),
        "period": float(motion.time[1] * FRAMES),
        "views": [_view(drawing, poses, *view) for view in VIEWS],
        "table": {"columns": ["coordinate", "size (largest angle 1)", "phase before lean, deg"], "rows": rows},
    }


def _view(drawing: BicycleDrawing, poses: list[list[Array]], words: str, across: int, up: int) -> dict[str, Any]:
    """Draw the poses along two of the axes, mm: the box around all, and for each body a path a frame."""
    frames = [[_flatten(points, across, up) for points in pose] for pose in poses]
    all_points = np.concatenate([points for frame in frames for points in frame])
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    size = high - low + 80
    bodies = [BODIES.get(part.body, "other") for part in drawing.parts]
    paths: dict[str, list[str]] = {body: [] for body in sorted(set(bodies))}
    for frame in frames:
        lines = [_path(points) for points in frame]
        for body, body_paths in paths.items():
            of_body = [line for line, body_of_line in zip(lines, bodies, strict=True) if body_of_line == body]
            body_paths.append("".join(of_body))
    return {
        "name": words,
        "box": " ".join(f"{value:.0f}" for value in (*(low - 40), *size)),
        "paths": paths,
        "frames": len(poses),
    }


def _flatten(points: Array, across: int, up: int) -> Array:
    """Project points (n, 3), m, to (k, 2), mm; of a wheel every fourth."""
    step = EVERY if len(points) > 3 * EVERY else 1
    return np.asarray(1000 * points[::step][:, (across, up)])


def _path(points: Array) -> str:
    """Write points (k, 2), mm, as the path of an SVG."""
    return "M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in points.tolist())
