"""Eigenvalues, named modes and critical speeds of a model as one plain record (the JSON of the commands)."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bicycle.model.eigen import NOISE
from bicycle.model.state_space import LinearModel
from bicycle.stability.critical import CriticalSpeed, critical_speeds
from bicycle.stability.named_modes import Modes, modes


def analyse(model: LinearModel, speeds: ArrayLike, *, max_speed: float) -> tuple[Modes | None, Sequence[CriticalSpeed]]:
    """Compute modes at ``speeds`` (m,), m/s (None without speeds), and critical speeds up to ``max_speed`` (m/s)."""
    speeds = np.atleast_1d(np.asarray(speeds, float))
    return (modes(model, speeds) if speeds.size else None), critical_speeds(model, max_speed=max_speed)


def unstable_modes(model: LinearModel, speed: float) -> tuple[str, ...]:
    """Names of the modes that grow at a ``speed``, m/s."""
    values = model.eigenvalues([speed])[0]
    noise = NOISE * np.abs(values).max()
    if not (values.real > noise).any():
        return ()
    named = modes(model, [speed]).to_dict()
    return tuple(name for name, roots in named.items() if any(real > noise for real, _ in roots[0] or ()))


def record(
    model: LinearModel, modes_along_speed: Modes | None, critical: Sequence[CriticalSpeed], *, max_speed: float
) -> dict[str, Any]:
    """Make the result JSON-ready; ``max_speed`` (m/s) is that of the search; complex numbers as [real, imaginary]."""
    speeds = np.empty(0) if modes_along_speed is None else modes_along_speed.speeds
    rear, front = (None if math.isnan(load) else load for load in model.static_loads)  # matrices tell no loads
    return {
        "states": list(model.states),
        "static_loads_N": {"rear": rear, "front": front},
        "speeds_m_s": speeds.tolist(),
        "eigenvalues": [[[z.real, z.imag] for z in row] for row in model.eigenvalues(speeds)] if speeds.size else [],
        "modes": {} if modes_along_speed is None else modes_along_speed.to_dict(),
        "critical_speeds": [
            {
                "speed_m_s": c.speed,
                "mode": c.mode,
                "kind": c.kind,
                "frequency_Hz": c.frequency_hz,
                "frequency_rad_s": c.angular_frequency,
                "direction": c.direction,
            }
            | ({"bifurcation": c.bifurcation} if c.bifurcation else {})
            for c in critical
        ],
        "critical_speeds_searched_m_s": [0.0, max_speed],
        "warnings": list(model.warnings),
    }


def records(by_name: Mapping[str, dict[str, Any]]) -> dict[str, Any]:
    """Join the records of bicycles by name; the only one has an empty name and stays as it is."""
    if "" in by_name:
        return by_name[""]
    return {"bicycles": [{"name": name} | content for name, content in by_name.items()]}
