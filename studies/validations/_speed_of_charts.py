"""Seconds of a stability chart and of a design, and whether a grid finds a cheaper design."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from bicycle.files.model_file import build_model
from bicycle.model_family import ModelFamily
from studies.design.demand import Demand
from studies.design.design import Design, Wanted, designed
from studies.stability_charts.chart import StabilityChart, stability_chart
from studies.stability_charts.plane import Plane

TYRED = {"relaxation_length": {"cornering_stiffness": 6500.0, "relaxation_length": 0.11}}
SOFT = TYRED | {
    "front_compliance": {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.85, "joint_z": -0.8},
    "steer_damper": {"damping": 0.0},
}
VARIED = ("steer_damper.damping", "front_compliance.damping", "c")
SPEEDS = (3.0, 25.0)
WOBBLE = (4.5, 14.0)  # Hz, between which only wobble lies on this bicycle
WAYS = 15  # directions along each side of the grid about the model
NEARER = 0.985  # of the cost of the design


def chart() -> StabilityChart:
    """Weave and capsize of the benchmark bicycle on tyres (8 states) over speed and trail, 200 points each."""
    content = {"bicycle": "benchmark", "effects": TYRED}
    return stability_chart(Plane.of(content, "speed=1:12", "c=0.02:0.12"), step=1 / 200)


def design() -> Design:
    """Three numbers of a bicycle with a soft front so that wobble is stable from 3 to 25 m/s."""
    wanted = Wanted({}, {}, {})
    return designed({"bicycle": "pista_charlie_drops", "effects": SOFT}, VARIED, (Demand("wobble"),), SPEEDS, wanted)


def seconds(call: Callable[[], Any], repeats: int) -> float:
    """Median seconds of a ``call``, after one to warm up; ``repeats`` is a number of calls."""
    call()
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        call()
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))


def cheaper(found: Design) -> tuple[int, int]:
    """How many points of a grid that cost a little less than a design keep its demand, of how many."""
    problem = found.problem
    ways = np.array(np.meshgrid(*[np.linspace(-1, 1, WAYS)] * len(VARIED))).reshape(len(VARIED), -1).T
    ways = ways[np.abs(ways).max(1) == 1]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    points = problem.start + problem.cost.scale * ways * NEARER * found.after.cost
    points = points[((points >= problem.limits.low) & (points <= problem.limits.high)).all(1)]
    family = ModelFamily(build_model(problem.space.content))
    numbers = dict(zip(VARIED, points.T, strict=True))
    roots = np.linalg.eigvals(family.state_matrices(numbers, np.linspace(*SPEEDS, 111)[None]))
    hertz = roots.imag / (2 * np.pi)
    growth = np.where((hertz > WOBBLE[0]) & (hertz < WOBBLE[1]), roots.real, -np.inf).max((1, 2))
    return int((growth <= 0).sum()), len(points)
