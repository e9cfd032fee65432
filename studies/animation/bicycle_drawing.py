"""A bicycle as line drawing in space, posed by its coordinates: lean, steer, yaw, lateral offset and further joints.

Bodies and hinges are those of the model itself, so that an effect that adds a joint is drawn without further ado; the
lines of frame and fork are only drawn for the eye.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from bicycle.derivation.builder import ModelBuilder
from bicycle.model import Model
from bicycle.rigid_bodies import Body, Joint
from tyre.base.arrays import Array

SPOKES = 6
BAR_HALF_WIDTH, STEM = 0.22, 0.08  # m
SADDLE_ABOVE_WHEEL = 0.30  # m
HEAD_ABOVE_WHEEL = 0.22  # m


@dataclass(frozen=True)
class Part:
    """A polyline (k, 3) in m, axes x forward, y right, z down, fixed to a body; ``wheel_radius`` of parts that roll."""

    body: str
    points: Array
    wheel_radius: float = 0.0


@dataclass(frozen=True)
class BicycleDrawing:
    """Parts in the upright position and the hinges (in the order lean, frame joints, steer) that move them."""

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]

    def pose(self, coordinates: Mapping[str, float], *, rolled: float = 0.0) -> list[Array]:
        """Points (k, 3) of every part in a posture, m.

        Parameters
        ----------
        coordinates : mapping of str to float
            Angles by name, rad, and ``rear_lateral_displacement``, m.
        rolled : float
            Distance the wheels have rolled, m.
        """
        yaw = coordinates["yaw"]
        posed = []
        for part in self.parts:
            points = part.points
            if part.wheel_radius:
                hub = points.mean(axis=0)
                points = hub + (points - hub) @ rotation((0.0, 1.0, 0.0), -rolled / part.wheel_radius).T
            for joint in reversed(self.joints):
                if part.body in joint.carries:
                    foot = np.array([joint.x, 0.0, joint.z])
                    turn = rotation((joint.axis_x, 0.0, joint.axis_z), coordinates[joint.name])
                    points = foot + (points - foot) @ turn.T
            points = points @ rotation((0.0, 0.0, 1.0), yaw).T
            posed.append(points + np.array([0.0, coordinates["rear_lateral_displacement"], 0.0]))
        return posed


def rotation(axis: tuple[float, float, float], angle: float) -> Array:
    """Rotation matrix (3, 3) by an ``angle`` (rad) about a unit ``axis`` (3 numbers) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def bicycle_drawing(model: Model) -> BicycleDrawing:
    """Draw the bodies of a model: wheels, rear frame, front frame, and a stick for every further body on a joint."""
    bodies, joints = _numbers(model)
    p = model.bicycle.values
    tangent = (np.sin(p["lam"]), np.cos(p["lam"]))  # of the steer axis, downwards

    def on_axis(z: float) -> tuple[float, float]:
        return p["w"] + p["c"] + tangent[0] / tangent[1] * z, z

    top = -2 * max(p["rF"], p["rR"])
    crown, head = on_axis(-2 * p["rF"] - 0.03), on_axis(min(top - HEAD_ABOVE_WHEEL, -2 * p["rF"] - 0.12))
    rear_hub, front_hub = (0.0, -p["rR"]), (p["w"], -p["rF"])
    bottom = (0.42 * p["w"], -0.85 * p["rR"])
    saddle = (0.22 * p["w"], top - SADDLE_ABOVE_WHEEL)
    seat = (0.25 * p["w"], saddle[1] + 0.22)
    frame = [
        [rear_hub, bottom, seat, rear_hub], [seat, crown, bottom], [seat, saddle],
        [(saddle[0] - 0.12, saddle[1]), (saddle[0] + 0.14, saddle[1])],
    ]  # fmt: skip
    parts = [Part("rear frame", _flat(line)) for line in frame]
    parts += [Part("front frame", _flat(line)) for line in ([front_hub, crown, head],)]
    stem = (head[0] + STEM, head[1])
    bar = np.array([[stem[0], y, stem[1]] for y in (-BAR_HALF_WIDTH, 0.0, BAR_HALF_WIDTH)])
    parts += [Part("front frame", _flat([head, stem, head])), Part("front frame", bar)]
    for name, hub, radius in (("rear wheel", rear_hub, p["rR"]), ("front wheel", front_hub, p["rF"])):
        parts.append(Part(name, _circle(hub, radius), radius))
        parts += [Part(name, _spoke(hub, radius, k), radius) for k in range(SPOKES // 2)]
    for joint in joints[1:-1]:
        for body in bodies:
            if body.name in joint.carries and not body.name.startswith("front "):
                parts.append(Part(body.name, _flat([(body.x, joint.z), (body.x, body.z)])))
                parts.append(Part(body.name, _circle((body.x, body.z - 0.12), 0.12)))
    return BicycleDrawing(tuple(parts), joints)


def _numbers(model: Model) -> tuple[tuple[Body, ...], tuple[Joint, ...]]:
    """Bodies and joints of the model with its parameter values."""
    builder = ModelBuilder()
    for effect in model.effects:
        type(effect).symbolic().apply(builder)
    values = {sp.Symbol(key, real=True): number for key, number in model.parameters.items()}

    def number(expression: object) -> float:
        return float(sp.sympify(expression).subs(values))

    joints = tuple(
        Joint(j.name, number(j.axis_x), number(j.axis_z), number(j.x), number(j.z), j.carries) for j in builder.joints()
    )
    bodies = tuple(Body(b.name, *(number(e) for e in (b.mass, b.x, b.z, b.Ixx, b.Izz))) for b in builder.bodies)
    return bodies, joints


def _flat(points: list[tuple[float, float]]) -> Array:
    return np.array([[x, 0.0, z] for x, z in points])


def _circle(centre: tuple[float, float], radius: float) -> Array:
    angle = np.linspace(0, 2 * np.pi, 61)
    return _flat([(centre[0] + radius * np.cos(a), centre[1] + radius * np.sin(a)) for a in angle])


def _spoke(hub: tuple[float, float], radius: float, number: int) -> Array:
    angle = 2 * np.pi * number / SPOKES
    reach = 0.94 * radius * np.array([np.cos(angle), np.sin(angle)])
    return _flat([(hub[0] + s * reach[0], hub[1] + s * reach[1]) for s in (-1.0, 1.0)])
