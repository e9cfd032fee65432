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
    """Frames of the chosen mode at the chosen speed: views as paths, and a table of sizes and phases."""
    now, name = compute_modes(state), at.first(state.mode)
    root = complex(at.named.branch(name)[0, 0])
    motion = modal_motion(now.linear, speed=state.at, eigenvalue=root, amplitude=0.25, frames=FRAMES)
    drawn = bicycle_drawing(now.model)
    poses = [
        drawn.pose({key: float(values[k]) for key, values in motion.outputs.items()}, rolled=state.at * time)
        for k, time in enumerate(motion.time.tolist())
    ]
    shape = at.named.shape(name)
    rows = [
        [part, float(shape.magnitude[part][0]), float(np.degrees(shape.phase[part][0]))] for part in shape.components
    ]
    return {
        "mode": name,
        "oscillates": bool(root.imag),
        "period": float(motion.time[1] * FRAMES),
        "views": [_view(drawn, poses, *view) for view in VIEWS],
        "table": {"columns": ["coordinate", "size (largest angle 1)", "phase before lean, deg"], "rows": rows},
    }


def _view(drawn: BicycleDrawing, poses: list[list[Array]], words: str, across: int, up: int) -> dict[str, Any]:
    thin = [slice(None, None, EVERY if len(points) > 3 * EVERY else 1) for points in poses[0]]
    flat = [[1000 * points[kept][:, (across, up)] for points, kept in zip(pose, thin, strict=True)] for pose in poses]
    lines = [["M" + "L".join(f"{x:.0f} {y:.0f}" for x, y in points.tolist()) for points in pose] for pose in flat]
    every = np.concatenate([points for pose in flat for points in pose])
    low, high = every.min(axis=0), every.max(axis=0)
    size = high - low + 80
    bodies = [BODIES.get(part.body, "other") for part in drawn.parts]
    paths = {
        body: ["".join(line for line, own in zip(pose, bodies, strict=True) if own == body) for pose in lines]
        for body in sorted(set(bodies))
    }
    return {
        "name": words,
        "box": " ".join(f"{value:.0f}" for value in (*(low - 40), *size)),
        "paths": paths,
        "frames": len(poses),
    }
