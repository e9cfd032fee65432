"""A bicycle with effects as a chain of bodies, and its small lateral motion at any speed.

Parameters and signs are those of docs/physics.md; the equations are those of :mod:`.chain`. Coordinates y, yaw, joints
from the ground outward, steer; the lateral velocity of the rear contact V = dy/dt - v yaw and the yaw rate replace y
and yaw. What is added besides the effects of the library is listed in :class:`Extras`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tests.validation.blind.chain import Body, Chain, Joint, Real, Wheel, slopes

Values = Mapping[str, float]
Effects = Mapping[str, Mapping[str, Any]]
WHEELS = ("rear", "front")


@dataclass(frozen=True)
class Extras:
    """What a bicycle may have that no library of effects knows, and loads that its file does not tell."""

    lean_spring: float = 0.0
    force_per_steer_rate: float = 0.0
    maxwell: tuple[float, float] = (0.0, 1.0)
    rotor: tuple[float, float] = (0.0, 0.0)
    rear_twist: tuple[float, float] = (0.0, 0.0)
    bar_mass: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rack: float = 0.0
    bar: float = 0.0


NO_EXTRAS = Extras()


@dataclass
class Plan:
    """Joints and bodies as they are put together; springs and dampers of joints beyond lean and steer."""

    joints: list[Joint] = field(default_factory=list)
    bodies: list[Body] = field(default_factory=list)
    names: dict[str, int] = field(default_factory=dict)
    sprung: dict[str, tuple[float, float]] = field(default_factory=dict)

    def join(self, name: str, joint: Joint) -> int:
        """Add a ``joint`` under a ``name``; its number."""
        self.joints.append(joint)
        self.names[name] = len(self.joints) - 1
        return self.names[name]


@dataclass(frozen=True)
class Coefficients:
    """M a + (D0 + v D1) u + K q = G' F + torque; slip S u + v N q; camber W q; q = y, yaw, lean, ..., steer."""

    names: tuple[str, ...]
    mass: Real
    damping: Real
    gyroscopic: Real
    stiffness: Real
    forces: Real  # (n, 2)
    slip_rate: Real  # (2, n)
    slip_angle: Real
    camber: Real
    loads: tuple[float, float]


def wheel_pair(value: Any) -> Real:
    """One number for both wheels or a table of two: (2,) rear, front, of a ``value`` as in a model file."""
    return np.array([value[w] for w in WHEELS] if isinstance(value, Mapping) else [value, value], float)


def tensor(xx: float, zz: float, xz: float, yy: float | None = None) -> Real:
    """Inertia tensor (3, 3) from entries ``xx``, ``zz``, ``xz``, ``yy`` (kg m^2); yy is without effect on frames."""
    return np.array([[xx, 0, xz], [0, xx + zz if yy is None else yy, 0], [xz, 0, zz]])


def without(whole: Body, part: Body) -> Body:
    """What is left of a body, ``whole``, when a ``part`` is taken out."""
    mass = whole.mass - part.mass
    c, p = np.array(whole.centre), np.array(part.centre)
    centre = (whole.mass * c - part.mass * p) / mass

    def about_origin(body: Body) -> Real:
        r = np.array(body.centre)
        return body.inertia + body.mass * (r @ r * np.eye(3) - np.outer(r, r))

    left = about_origin(whole) - about_origin(part) - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    x, y, z = centre
    return Body(whole.joint, mass, (float(x), float(y), float(z)), left)


def plan_bodies(p: Values, effects: Effects, extras: Extras) -> tuple[Plan, int, int]:
    """Joints and bodies; the joints of both wheels."""
    plan = Plan()
    last = -1
    for name, axis in (("x", (1, 0, 0)), ("y", (0, 1, 0)), ("z", (0, 0, 1))):
        last = plan.join(name, Joint(last, axis, slides=True))
    for name, axis in (("yaw", (0, 0, 1)), ("lean", (1, 0, 0)), ("pitch", (0, 1, 0))):
        last = plan.join(name, Joint(last, axis))
    frame = stem = hub = last
    rear = Body(frame, p["mB"], (p["xB"], 0, p["zB"]), tensor(p["IBxx"], p["IBzz"], p["IBxz"]))
    if extras.rear_twist[0]:
        hub = plan.join("rear_twist", Joint(frame, (np.cos(0.9), 0, -np.sin(0.9)), (p["xB"], 0, p["zB"])))
        plan.sprung["rear_twist"] = extras.rear_twist
    if "rider_saddle" in effects:
        e = effects["rider_saddle"]
        seat = plan.join("rider_saddle", Joint(frame, (0, 0, 1), (e["joint_x"], 0, 0)))
        seated = Body(seat, e["mass"], (e["x"], 0, e["z"]), tensor(e["Ixx"], e["Izz"], e["Ixz"]))
        rear = without(rear, seated)
        plan.bodies.append(seated)
        plan.sprung["rider_saddle"] = (e["stiffness"], e["damping"])
    if "rider_lean" in effects:
        e = effects["rider_lean"]
        waist = plan.join("rider", Joint(frame, (1, 0, 0), (0, 0, e["joint_z"])))
        rider = Body(waist, e["mass"], (e["x"], 0, e["z"]), tensor(e["Ixx"], e["Izz"], e.get("Ixz", 0.0)))
        rear = without(rear, rider)
        plan.bodies.append(rider)
        plan.sprung["rider"] = (e["stiffness"], e["damping"])
    if "front_compliance" in effects:
        e = effects["front_compliance"]
        tilt = e.get("axis_tilt", p["lam"])
        axis = (np.cos(tilt), 0, -np.sin(tilt))
        stem = plan.join("front", Joint(frame, axis, (e["joint_x"], 0, e["joint_z"])))
        plan.sprung["front"] = (e["stiffness"], e["damping"])
    along, foot = (np.sin(p["lam"]), 0, np.cos(p["lam"])), (p["w"] + p["c"], 0, 0)
    rear_wheel = plan.join("rear_spin", Joint(hub, (0, 1, 0), (0, 0, -p["rR"])))
    steer = plan.join("steer", Joint(stem, along, foot))
    if extras.bar_mass[0]:
        loose = plan.join("bar_mass", Joint(steer, along, foot))
        top = (p["w"] + p["c"] + p["zH"] * np.tan(p["lam"]), 0.0, p["zH"])
        plan.bodies.append(Body(loose, 0.0, top, extras.bar_mass[0] * np.eye(3)))
        plan.sprung["bar_mass"] = extras.bar_mass[1:]
    front_wheel = plan.join("front_spin", Joint(steer, (0, 1, 0), (p["w"], 0, -p["rF"])))
    plan.bodies += [
        rear,
        Body(rear_wheel, p["mR"], (0, 0, -p["rR"]), tensor(p["IRxx"], p["IRxx"], 0, p["IRyy"])),
        Body(steer, p["mH"], (p["xH"], 0, p["zH"]), tensor(p["IHxx"], p["IHzz"], p["IHxz"])),
        Body(front_wheel, p["mF"], (p["w"], 0, -p["rF"]), tensor(p["IFxx"], p["IFxx"], 0, p["IFyy"])),
    ]
    point = np.zeros((3, 3))
    if extras.rack:
        plan.bodies.append(Body(frame, extras.rack, RACK, point))
    if extras.bar:
        plan.bodies.append(Body(steer, extras.bar, (p["xH"], 0, p["zH"] + BAR_ABOVE), point))
    return plan, rear_wheel, front_wheel


RACK = (-0.05, 0.0, -0.75)
"""Where luggage lies on the rear rack, m."""

BAR_ABOVE = -0.15
"""Luggage on the bar against the mass centre of the front frame, m (z down)."""


def coefficients(p: Values, effects: Effects, extras: Extras = NO_EXTRAS) -> Coefficients:
    """Linear lateral motion of a bicycle."""
    plan, rear, front = plan_bodies(p, effects, extras)
    weight = p["g"] * sum(body.mass for body in plan.bodies)
    ahead = p["g"] * sum(body.mass * body.centre[0] for body in plan.bodies) / p["w"]
    loads = (weight - ahead, ahead)
    crown = wheel_pair(effects.get("crown_radius", {}).get("crown_radius", 0.0))
    twist = wheel_pair(effects.get("twisting_torque", {}).get("twisting_stiffness", 0.0))
    trail = wheel_pair(effects.get("pneumatic_trail", {}).get("trail", 0.0))
    wheels = (
        Wheel(rear, (0, 0, -p["rR"]), p["rR"], crown[0], loads[0], twist[0]),
        Wheel(front, (p["w"], 0, -p["rF"]), p["rF"], crown[1], loads[1], twist[1]),
    )
    chain = Chain(tuple(plan.joints), tuple(plan.bodies), wheels, p["g"])
    lateral = ["y", "yaw", "lean", *(n for n in plan.sprung if n != "bar_mass"), "steer"]
    lateral += ["bar_mass"] if "bar_mass" in plan.sprung else []
    own = [plan.names[name] for name in lateral]
    n, k = len(plan.joints), len(own)
    still = np.zeros(3 * n + 2)  # coordinates, rates and accelerations of the joints, lateral forces
    rolling = still.copy()
    rolling[[n + plan.names["x"], n + rear, n + front]] = 1.0, -1 / p["rR"], -1 / p["rF"]
    rates = [n + joint for joint in own]

    def bear(x: Any) -> Any:
        return chain.unbalanced(*np.split(x, [n, 2 * n, 3 * n]), trail)[own]

    columns = [*own, *rates, *(n + rate for rate in rates), 3 * n, 3 * n + 1]
    stiffness, damping, mass, forces = np.split(slopes(bear, still, columns), [k, 2 * k, 3 * k], axis=1)
    slips = slopes(lambda x: chain.slips(x[:n], x[n:]), rolling[: 2 * n], [*own, *rates])
    found = Coefficients(
        names=tuple(lateral), mass=mass, damping=damping, gyroscopic=slopes(bear, rolling, rates) - damping,
        stiffness=stiffness, forces=-forces, slip_rate=slips[:, k:], slip_angle=slips[:, :k],
        camber=slopes(chain.cambers, np.zeros(n), own), loads=loads,
    )  # fmt: skip
    return with_springs(found, p, effects, extras, plan.sprung)


def with_springs(
    found: Coefficients, p: Values, effects: Effects, extras: Extras, sprung: Mapping[str, tuple[float, ...]]
) -> Coefficients:
    """Springs, dampers, rotors and a force of the steer rate put into coefficients ``found``."""
    damping, stiffness, at = found.damping.copy(), found.stiffness.copy(), found.names.index
    steer, lean, yaw = at("steer"), at("lean"), at("yaw")
    for name, (spring, damper) in sprung.items():
        stiffness[at(name), at(name)] += spring
        damping[at(name), at(name)] += damper
    damping[steer, steer] += effects.get("steer_damper", {}).get("damping", 0.0)
    stiffness[steer, steer] += effects.get("steer_spring", {}).get("stiffness", 0.0)
    stiffness[lean, lean] += extras.lean_spring
    for row, arm in ((at("y"), 1.0), (yaw, p["xH"]), (lean, -p["zH"])):
        damping[row, steer] -= extras.force_per_steer_rate * arm
    frame, fork = np.zeros((2, len(found.names))), np.zeros((2, len(found.names)))  # rows: turn about x, about z
    for rows in (frame, fork):
        rows[0, lean] = rows[1, yaw] = 1.0
    fork[0, steer], fork[1, steer] = np.sin(p["lam"]), np.cos(p["lam"])
    for momentum, (about_x, about_z) in zip(extras.rotor, (frame, fork), strict=True):
        damping += momentum * (np.outer(about_z, about_x) - np.outer(about_x, about_z))
    return replace(found, damping=damping, stiffness=stiffness)
