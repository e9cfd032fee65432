"""Models of the main study put together effect by effect, and what their eigenvalues say, without the study's code."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from bicycle.effects import effect_class
from bicycle.model import LinearModel, Model
from bicycle.parameters import Bicycle

FRONT = {"stiffness": 5000.0, "ratio": 0.25, "height": 0.65}
ARMS = {"inertia": 0.1, "stiffness": 5.0, "damping": 1.0}
TENSE = {"inertia": 0.05, "stiffness": 30.0, "damping": 0.3}
FRICTION = {"damping": 0.15}


def by_hand(
    bicycle: Bicycle, contact: Sequence[float], *, front: dict[str, float] | None = None,
    arms: dict[str, float] | None = None, camber: float = 0.65, trail: float = 0.017, twisting: float = 5.0,
    **others: dict[str, Any],
) -> LinearModel:  # fmt: skip
    """A bicycle on tyres (C and relaxation length, rear then front), hinged on its steer axis at a height (m)."""
    v, (rear, front_load) = bicycle.values, bicycle.static_loads
    tables: dict[str, dict[str, Any]] = {
        "relaxation_length": {
            "cornering_stiffness": {"rear": contact[0], "front": contact[2]},
            "relaxation_length": {"rear": contact[1], "front": contact[3]},
        },
        "camber_thrust": {"camber_stiffness": {"rear": camber * rear, "front": camber * front_load}},
    }  # fmt: skip
    if trail:
        tables["pneumatic_trail"] = {"trail": trail}
    if twisting:
        tables["twisting_torque"] = {"twisting_stiffness": twisting}
    if front:
        height = front["height"]
        critical = 2 * np.sqrt(front["stiffness"] * front_inertia(bicycle, height))
        tables["front_compliance"] = {
            "stiffness": front["stiffness"], "damping": front["ratio"] * critical, "axis_tilt": v["lam"],
            "joint_x": v["w"] + v["c"] - height * np.tan(v["lam"]), "joint_z": -height,
        }  # fmt: skip
    if arms:
        tables["rider_arms"] = arms
    tables |= {"steer_damper": FRICTION} | others
    return Model(bicycle, tuple(effect_class(name)(**table) for name, table in tables.items())).linear_model()


def front_inertia(bicycle: Bicycle, height: float) -> float:
    """Inertia (kg m^2) of handlebar, fork and wheel about a hinge across the steer axis at a height (m)."""
    p = bicycle.values
    hinge = np.array([p["w"] + p["c"] - height * np.tan(p["lam"]), -height])
    along = np.array([np.cos(p["lam"]), -np.sin(p["lam"])])  # the axis: an arm counts with its part down the steer axis
    down = np.array([np.sin(p["lam"]), np.cos(p["lam"])])
    handlebar = np.array([[p["IHxx"], p["IHxz"]], [p["IHxz"], p["IHzz"]]])
    arms = [down @ (np.array(place) - hinge) for place in ((p["xH"], p["zH"]), (p["w"], -p["rF"]))]
    return float(along @ handlebar @ along + p["IFxx"] + p["mH"] * arms[0] ** 2 + p["mF"] * arms[1] ** 2)


def growing(model: LinearModel, speed: float, above: float = 3.0, rate: float = 0.0) -> int:
    """Pairs faster than ``above`` Hz that grow faster than ``rate`` (1/s)."""
    values = model.eigenvalues(speed)
    return int(((values.real > rate) & (values.imag > above * 2 * np.pi)).sum())


def least_damping(model: LinearModel, speeds: Sequence[float]) -> float:
    """Least damping ratio of the oscillations of 4 to 15 Hz over speeds (m/s)."""
    ratios = []
    for speed in speeds:
        values = model.eigenvalues(float(speed))
        fast = values[(values.imag >= 8 * np.pi) & (values.imag < 30 * np.pi)]
        ratios += (-fast.real / np.abs(fast)).tolist()
    return min(ratios)
