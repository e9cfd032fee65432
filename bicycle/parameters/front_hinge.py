"""Hinge of the front frame: its place above the hub, and the inertia of what it carries.

The front frame is the handlebar, the fork and the front wheel; the hinge stands for its flexibility.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bicycle.parameters.bicycle import bodies
from bicycle.parameters.rigid_bodies import Joint

FRONT = frozenset({"front frame", "front wheel"})


def front_inertia(p: Mapping[str, Any], *, joint_x: Any, joint_z: Any, axis_tilt: Any) -> Any:
    """Compute the moment of inertia (kg m^2) of the front frame with its wheel about a hinge, the rear frame held.

    Parameters
    ----------
    p : mapping
        Parameters of the bicycle, SI, keys of Meijaard et al. (2007).
    joint_x, joint_z : float or array
        A point of the axis, m before the rear contact and m below the ground (negative).
    axis_tilt : float or array
        Angle of the axis above the horizontal, rad, forward end up. Arrays of parameters give an array.
    """
    hinge = Joint("hinge", np.cos(axis_tilt), -np.sin(axis_tilt), joint_x, joint_z, FRONT)
    x, z = hinge.axis_x, hinge.axis_z
    inertia = 0.0
    for body in bodies(p):
        if body.name in FRONT:
            about_its_centre = body.Ixx * x**2 + body.Izz * z**2 + 2 * body.Ixz * x * z
            inertia = inertia + about_its_centre + body.mass * hinge.lever(body.x, body.z) ** 2
    return inertia


def critical_damping(stiffness: Any, inertia: Any) -> Any:
    """Compute the damping (N m s/rad) at which a sprung hinge no longer oscillates: 2 sqrt(k I)."""
    return 2 * np.sqrt(stiffness * inertia)


def hinge_at(p: Mapping[str, float], height_above_hub: float) -> tuple[float, float]:
    """Find the point (joint_x, joint_z), m, on the steer axis ``height_above_hub`` (m) above the front hub.

    The height is measured along the steer axis, from the point of the axis nearest to the hub.
    """
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    joint_z = -(p["c"] * sine + p["rF"] * cosine + height_above_hub) * cosine
    return p["w"] + p["c"] + joint_z * math.tan(p["lam"]), joint_z


def height_above_hub(p: Mapping[str, float], joint_z: float) -> float:
    """Find the height (m) of a hinge at ``joint_z`` (m, down) above the front hub, along the steer axis."""
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    return -joint_z / cosine - p["c"] * sine - p["rF"] * cosine


def front_words(parameters: Mapping[str, float]) -> dict[str, str]:
    """Say what place and damping of a model's front hinges mean on its bicycle.

    Parameters
    ----------
    parameters : mapping
        Parameters of a model, SI: keys of the bicycle, and ``effect.name``.

    Returns
    -------
    dict
        ``front_compliance.joint_z``: its height above the front hub; ``front_compliance.damping`` and
        ``fork_bending.damping``: the damping ratio, every other part fixed. Only those that the model has.
    """
    words = {}
    if {f"front_compliance.{name}" for name in ("stiffness", "damping", "joint_x", "joint_z")} <= parameters.keys():
        place = {name: parameters[f"front_compliance.{name}"] for name in ("joint_x", "joint_z")}
        place["axis_tilt"] = parameters.get("front_compliance.axis_tilt", parameters["lam"])
        height = height_above_hub(parameters, place["joint_z"])
        words["front_compliance.joint_z"] = f"{height:.2f} m above the front hub"
        words |= _damping_words(parameters, "front_compliance", front_inertia(parameters, **place))
    if {f"fork_bending.{name}" for name in ("stiffness", "damping", "length")} <= parameters.keys():
        wheel = parameters["IFxx"] + parameters["mF"] * parameters["fork_bending.length"] ** 2
        words |= _damping_words(parameters, "fork_bending", wheel)
    return words


def _damping_words(parameters: Mapping[str, float], effect: str, inertia: float) -> dict[str, str]:
    """Damping ratio of an ``effect`` that carries ``inertia`` (kg m^2); nothing for a rigid or slack joint."""
    critical = critical_damping(parameters[f"{effect}.stiffness"], inertia)
    if not 0 < critical < math.inf:
        return {}
    return {f"{effect}.damping": f"damping ratio {parameters[f'{effect}.damping'] / critical:.2g}"}


def front_line(parameters: Mapping[str, float]) -> str:
    """Join :func:`front_words` of the ``parameters`` (SI) of a model in one line; empty without such a hinge."""
    words = front_words(parameters)
    return "; ".join(f"{key}: {text}" for key, text in words.items())
