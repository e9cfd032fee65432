"""Wheels on the ground: rolling without slip, side slip, or a first-order lag; state space at one speed.

States: rates of the joints (and of V and yaw with tyres), angles of the joints, lateral forces of lagging tyres, and
the spring of a Maxwell element. Yaw and lateral position need no state. Inputs: steer torque, lean torque.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.validation.blind.chain import Real
from tests.validation.blind.machine import NO_EXTRAS, Coefficients, Effects, Extras, coefficients, wheel_pair


@dataclass(frozen=True)
class Ground:
    """Contact law of both wheels (rear, front): SI, without slip where ``cornering`` is absent."""

    cornering: Real | None
    length: Real | None
    camber: Real


@dataclass(frozen=True)
class Space:
    """dx/dt = A x + B (steer torque, lean torque); rows of ``outputs`` by name; slip, camber and force of the tyres."""

    matrix: Real
    inputs: Real
    outputs: Mapping[str, Real]
    slip: Real  # (2, states): lateral velocity at the ground; empty rows without slip
    camber: Real
    force: Real  # selects lagging forces; empty without lag


def ground(effects: Effects) -> Ground:
    """Contact law of the ``effects`` of the library."""
    law: Mapping[str, Any] = effects.get("relaxation_length") or effects.get("side_slip") or {}
    camber = wheel_pair(effects.get("camber_thrust", {}).get("camber_stiffness", 0.0))
    if not law:
        return Ground(None, None, camber)
    length = wheel_pair(law["relaxation_length"]) if "relaxation_length" in effects else None
    return Ground(wheel_pair(law["cornering_stiffness"]), length, camber)


def at_speed(
    c: Coefficients, law: Ground, v: float, maxwell: tuple[float, float] = (0.0, 1.0),
    aside: tuple[float, float] | None = None,
) -> Space:  # fmt: skip
    """Close the contacts; a lateral force at ``aside`` (m ahead of the rear contact, m up) is a third input."""
    pull = np.zeros((len(c.names), 2 if aside is None else 3))
    pull[c.names.index("steer"), 0] = pull[c.names.index("lean"), 1] = 1.0
    if aside is not None:
        pull[[0, 1, c.names.index("lean")], 2] = 1.0, *aside
    space = _rolling(c, v, pull) if law.cornering is None else _slipping(c, law, v, pull)
    return _with_maxwell(space, maxwell) if maxwell[0] else space


def canonical(c: Coefficients, v: float) -> tuple[Real, Real, Real]:
    """Mass, rate and angle matrices of the joints (lean, ..., steer) of a bicycle that rolls without slip."""
    mass, rates, angles, *_ = _without_slip(c, v)
    return mass, rates, angles


def _without_slip(c: Coefficients, v: float) -> tuple[Real, Real, Real, Real, Real]:
    """V and r follow from the joints; what is orthogonal to the contact forces remains."""
    k = len(c.names) - 2
    damping = c.damping + v * c.gyroscopic
    damping[:, 1] += v * c.mass[:, 0]  # d2y/dt2 = dV/dt + v r
    follow = np.linalg.inv(c.slip_rate[:, :2])
    rate = np.vstack([-follow @ c.slip_rate[:, 2:], np.eye(k)])  # u = rate * joint rates + angle * joints
    angle = np.vstack([-follow @ (v * c.slip_angle[:, 2:]), np.zeros((k, k))])
    left = np.hstack([-c.forces[2:] @ np.linalg.inv(c.forces[:2]), np.eye(k)])  # left @ forces = 0
    rates = left @ (c.mass @ angle + damping @ rate)
    return left @ c.mass @ rate, rates, left @ (damping @ angle + c.stiffness[:, 2:]), left, np.hstack([rate, angle])


def _rolling(c: Coefficients, v: float, pull: Real) -> Space:
    mass, rates, angles, left, follow = _without_slip(c, v)
    k, solve = len(mass), np.linalg.inv(mass)
    matrix = np.block([[-solve @ rates, -solve @ angles], [np.eye(k), np.zeros((k, k))]])
    inputs = np.vstack([solve @ left @ pull, np.zeros((k, pull.shape[1]))])
    return Space(matrix, inputs, _outputs(c, follow), *(np.zeros((0, 2 * k)),) * 3)


def _slipping(c: Coefficients, law: Ground, v: float, pull: Real) -> Space:
    assert law.cornering is not None
    n = len(c.names)
    k = n - 2
    damping = c.damping + v * c.gyroscopic
    damping[:, 1] += v * c.mass[:, 0]
    stiffness, turned, camber = c.stiffness[:, 2:], v * c.slip_angle[:, 2:], c.camber[:, 2:]
    slip = np.hstack([c.slip_rate, turned])  # over u and joints
    leaning = np.hstack([np.zeros((2, n)), camber])
    solve = np.linalg.inv(c.mass)
    angles = np.hstack([np.zeros((k, 2)), np.eye(k), np.zeros((k, k))])
    motion = np.hstack([-damping, -stiffness])
    if law.length is None:
        now = -(law.cornering / v)[:, None] * slip + law.camber[:, None] * leaning
        matrix = np.vstack([solve @ (motion + c.forces @ now), angles])
        force = np.zeros((0, n + k))
    else:
        lag = v / law.length
        build = -(law.cornering / law.length)[:, None] * slip + (lag * law.camber)[:, None] * leaning
        matrix = np.block([[solve @ motion, solve @ c.forces], [angles, np.zeros((k, 2))], [build, -np.diag(lag)]])
        slip, leaning = (np.hstack([of, np.zeros((2, 2))]) for of in (slip, leaning))
        force = np.hstack([np.zeros((2, n + k)), np.eye(2)])
    size = len(matrix)
    inputs = np.vstack([solve @ pull, np.zeros((size - n, pull.shape[1]))])
    return Space(matrix, inputs, _outputs(c, np.eye(n, size)), slip, leaning, force)


def _outputs(c: Coefficients, rates: Real) -> dict[str, Real]:
    """Rows that give lean, steer, rider, their rates and the yaw rate; ``rates`` gives u of the states."""
    n = len(c.names)
    found = {"yaw_rate": rates[1]}
    for name in c.names[2:]:
        at = c.names.index(name)
        row = np.zeros(rates.shape[1])
        behind = n if rates.shape[1] > 2 * (n - 2) else n - 2  # rates come first in the state
        row[behind + at - 2] = 1.0
        found |= {name: row, f"{name}_rate": rates[at]}
    return found


def _with_maxwell(space: Space, maxwell: tuple[float, float]) -> Space:
    """A spring in series with a damper at the steer: T' = -T / time + spring * steer rate, against the steer."""
    spring, time = maxwell
    size = len(space.matrix)
    matrix = np.zeros((size + 1, size + 1))
    matrix[:size, :size] = space.matrix
    matrix[:size, size] = -space.inputs[:, 0]
    matrix[size, :size], matrix[size, size] = spring * space.outputs["steer_rate"], -1 / time

    def longer(rows: Real) -> Real:
        return np.hstack([rows, np.zeros((*rows.shape[:-1], 1))])

    return Space(
        matrix, np.vstack([space.inputs, np.zeros((1, 2))]), {k: longer(r) for k, r in space.outputs.items()},
        longer(space.slip), longer(space.camber), longer(space.force),
    )  # fmt: skip


@dataclass(frozen=True)
class Machine:
    """A bicycle with effects, ready for any speed."""

    coefficients: Coefficients
    law: Ground
    maxwell: tuple[float, float] = (0.0, 1.0)

    def space(self, speed: float) -> Space:
        """State space at a ``speed``, m/s."""
        return at_speed(self.coefficients, self.law, speed, self.maxwell)

    def growth(self, speed: float) -> float:
        """Largest real part (1/s) at a ``speed``, m/s."""
        return float(np.linalg.eigvals(self.space(speed).matrix).real.max())


def build(p: Mapping[str, float], effects: Effects, extras: Extras = NO_EXTRAS) -> Machine:
    """The machine of Meijaard's keys ``p`` (SI) with ``effects`` of the library and ``extras`` outside it."""
    return Machine(coefficients(p, effects, extras), ground(effects), extras.maxwell)
