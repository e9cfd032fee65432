"""Two calls timed in turn, the models and sweeps that the speed table times, and the machine it ran on."""

import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effect import effect_class
from bicycle.eigenvalues.solvers import Solver, compiled, lapack
from bicycle.files.bicycle_file import load_bicycle
from bicycle.model import Model
from studies.sweeps.chunk import compute
from studies.sweeps.engines import Engine
from studies.sweeps.run import pieces
from studies.sweeps.spec import Sweep
from studies.sweeps.sweep_file import build_sweep

Pair = tuple[float, float]  # seconds of the reference and of velotyre
TYRE = {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}
SPREAD = {"mB": 1.0, "xB": 0.01, "zB": 0.01, "mH": 0.1, "w": 0.01, "c": 0.002}
SOLVERS: dict[str, Solver] = {"numpy": lapack, "fast": compiled}


def alternating(first: Callable[[], Any], second: Callable[[], Any], repeats: int) -> Pair:
    """Median seconds of two calls that take turns, after one call of each to warm up."""
    times: list[list[float]] = [[], []]
    for number in range(repeats + 1):
        for kind, call in enumerate((first, second)):
            start = time.perf_counter()
            call()
            if number:
                times[kind].append(time.perf_counter() - start)
    return float(np.median(times[0])), float(np.median(times[1]))


def effects_of(order: int) -> dict[str, dict[str, float]]:
    """Effects of a model with so many states on the benchmark bicycle: 8 on tyres; 12 with flexible front and rider."""
    if order == 8:
        return {"relaxation_length": TYRE}
    hinge = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
    rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
    return {"relaxation_length": TYRE, "front_compliance": hinge, "rider_lean": rider}


def tyre_model(order: int) -> Model:
    """The benchmark bicycle with the effects of :func:`effects_of`."""
    effects = [effect_class(name)(**values) for name, values in effects_of(order).items()]
    return Model(load_bicycle("benchmark"), tuple(effects))


def sweep_of(samples: int, order: int = 8, **changes: Any) -> Sweep:
    """Distinct bicycles with so many states at 8 m/s."""
    content = {
        "model": {"bicycle": "benchmark", "effects": effects_of(order)}, "samples": samples, "seed": 1,
        "outputs": ["eigenvalues"], "grid": {"speed_m_s": [8.0]},
        "sampled": {key: {"sd": sd} for key, sd in SPREAD.items()},
    }  # fmt: skip
    return build_sweep(content | changes)


def drain(sweep: Sweep, engine: Engine) -> None:
    """Compute a sweep and drop the results."""
    for _ in engine(partial(compute, sweep), pieces(sweep)):
        pass


def machine() -> dict[str, str]:
    """Processor, cores, system and versions."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        name = lines[0] if lines else name
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    found = {"processor": name, "cores": str(cores), "system": platform.system(), "python": platform.python_version()}
    for package in ("numpy", "scipy", "numba", "distributed", "BicycleParameters"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    found["load"] = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return found
