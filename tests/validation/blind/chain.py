"""A chain of rigid bodies in full nonlinear kinematics, and its linearisation by complex steps.

Newton and Euler for every body, projected on the joints (Kane 1985, Dynamics: Theory and Applications). Nothing is
expanded by hand: rotations, contact points and partial velocities are those of the finite motion, and a step of 1e-30
along the imaginary axis gives their first derivatives to rounding (Squire & Trapp 1998, SIAM Review 40). Pitch and
heave stay free coordinates, held at zero by symmetry, so the stiffness of gravity comes from the contact loads.
Steps along several coordinates are taken at once: vectors have shape (steps, 3), coordinates (joints, steps).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]

STEP = 1e-30
DOWN = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Joint:
    """One degree of freedom: a turn about ``axis`` through ``point``, or a slide along it; parents come first."""

    parent: int
    axis: tuple[float, float, float]
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    slides: bool = False


@dataclass(frozen=True)
class Body:
    """A rigid body on a joint: mass (kg), mass centre (m) and inertia tensor about it (3 x 3, kg m^2) when straight."""

    joint: int
    mass: float
    centre: tuple[float, float, float]
    inertia: Real


@dataclass(frozen=True)
class Wheel:
    """A toroidal wheel: its spin joint, centre (m), radius and crown radius (m), static load (N)."""

    joint: int
    centre: tuple[float, float, float]
    radius: float
    crown: float
    load: float
    twist: float = 0.0  # moment about the vertical over camber, N m/rad


@dataclass(frozen=True)
class Motion:
    """Where every joint has taken its body: rotation and shift, and twist and its rate about the origin."""

    turn: list[Complex]  # (steps, 3, 3)
    shift: list[Complex]
    axis: list[Complex]  # (steps, 6) unit twist of each joint: angular, linear at the origin
    twist: list[Complex]
    rate: list[Complex]


@dataclass(frozen=True)
class Chain:
    """Joints from the ground outward, bodies, two wheels (rear, front) and gravity (m/s^2)."""

    joints: tuple[Joint, ...]
    bodies: tuple[Body, ...]
    wheels: tuple[Wheel, Wheel]
    gravity: float

    def supported(self, joint: int) -> list[int]:
        """Numbers of the joint of index ``joint`` and of all below it."""
        found = []
        while joint >= 0:
            found.append(joint)
            joint = self.joints[joint].parent
        return found

    def move(self, q: Complex, u: Complex, a: Complex) -> Motion:
        """Kinematics at coordinates ``q``, rates ``u`` and accelerations ``a``, each of shape (joints, steps)."""
        motion, steps = Motion([], [], [], [], []), q.shape[1]
        for k, joint in enumerate(self.joints):
            held = joint.parent >= 0
            turn = motion.turn[joint.parent] if held else np.tile(np.eye(3, dtype=complex), (steps, 1, 1))
            shift = motion.shift[joint.parent] if held else np.zeros((steps, 3), complex)
            twist = motion.twist[joint.parent] if held else np.zeros((steps, 6), complex)
            rate = motion.rate[joint.parent] if held else np.zeros((steps, 6), complex)
            axis = turn @ np.array(joint.axis)
            point = turn @ np.array(joint.point) + shift
            if joint.slides:
                unit = np.hstack([np.zeros_like(axis), axis])
                shift = shift + axis * q[k, :, None]
            else:
                unit = np.hstack([axis, _cross(point, axis)])
                own = rotation(axis, q[k])
                turn, shift = own @ turn, point + _turned(own, shift - point)
            spin, way = twist[:, :3], unit[:, :3]
            bent = np.hstack([_cross(spin, way), _cross(spin, unit[:, 3:]) + _cross(twist[:, 3:], way)])
            motion.turn.append(turn)
            motion.shift.append(shift)
            motion.axis.append(unit)
            motion.twist.append(twist + unit * u[k, :, None])
            motion.rate.append(rate + unit * a[k, :, None] + bent * u[k, :, None])
        return motion

    def unbalanced(self, q: Complex, u: Complex, a: Complex, force: Complex, trail: Real) -> Complex:
        """Loads of the joints (joints, steps): inertia minus gravity, contact loads and lateral forces."""
        motion, found = self.move(q, u, a), np.zeros(q.shape, complex)
        for body in self.bodies:
            turn, twist, rate = (of[body.joint] for of in (motion.turn, motion.twist, motion.rate))
            centre = turn @ np.array(body.centre) + motion.shift[body.joint]
            spin, spun = twist[:, :3], rate[:, :3]
            speeding = rate[:, 3:] + _cross(spun, centre) + _cross(spin, twist[:, 3:] + _cross(spin, centre))
            push = body.mass * (speeding - self.gravity * DOWN)
            inertia = turn @ body.inertia @ turn.swapaxes(1, 2)
            couple = _turned(inertia, spun) + _cross(spin, _turned(inertia, spin)) + _cross(centre, push)
            load = np.hstack([couple, push])
            for k in self.supported(body.joint):
                found[k] += _dot(motion.axis[k], load)
        for k, wheel in enumerate(self.wheels):
            contact, heading, lean = touch(wheel, motion)
            push = force[k, :, None] * _cross(DOWN, heading) - wheel.load * DOWN
            moment = wheel.twist * lean - trail[k] * force[k]
            load = np.hstack([_cross(contact, push) + moment[:, None] * DOWN, push])
            for j in self.supported(wheel.joint):
                found[j] -= _dot(motion.axis[j], load)
        return found

    def slips(self, q: Complex, u: Complex) -> Complex:
        """Lateral velocity (2, steps) of the wheels at the ground, m/s, at ``q`` and rates ``u`` (joints, steps)."""
        motion, found = self.move(q, u, np.zeros_like(u)), np.zeros((2, q.shape[1]), complex)
        for k, wheel in enumerate(self.wheels):
            contact, heading, _ = touch(wheel, motion)
            twist = motion.twist[wheel.joint]
            found[k] = _dot(_cross(DOWN, heading), twist[:, 3:] + _cross(twist[:, :3], contact))
        return found

    def cambers(self, q: Complex) -> Complex:
        """Sine of the lean (2, steps) of the wheels to the right at coordinates ``q`` (joints, steps)."""
        motion = self.move(q, np.zeros_like(q), np.zeros_like(q))
        return np.array([touch(wheel, motion)[2] for wheel in self.wheels])


def _cross(a: Complex | Real, b: Complex | Real) -> Complex:
    """a x b of vectors (..., 3); numpy's own takes several times as long."""
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.array([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0]).T


def _dot(a: Complex, b: Complex) -> Complex:
    return np.asarray((a * b).sum(-1))


def _turned(matrix: Complex, vector: Complex) -> Complex:
    return np.asarray((matrix @ vector[..., None])[..., 0])


def rotation(axis: Complex, angle: Complex) -> Complex:
    """Rotation matrices (steps, 3, 3) about unit vectors ``axis`` (steps, 3) by ``angle`` (steps,) rad, Rodrigues."""
    x, y, z = axis.T
    none = np.zeros_like(x)
    cross = np.moveaxis(np.array([[none, -z, y], [z, none, -x], [-y, x, none]]), 2, 0)
    sine, cosine = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    found: Complex = np.eye(3) + sine * cross + (1 - cosine) * (cross @ cross)
    return found


def touch(wheel: Wheel, motion: Motion) -> tuple[Complex, Complex, Complex]:
    """Lowest point of a ``wheel`` in a ``motion``, unit vector of its heading on the ground, sine of its lean."""
    turn = motion.turn[wheel.joint]
    axle = turn @ np.array([0.0, 1.0, 0.0])
    lean = axle @ DOWN
    down = DOWN - lean[:, None] * axle
    down = down / np.sqrt(_dot(down, down))[:, None]
    heading = _cross(axle, DOWN)
    heading = heading / np.sqrt(_dot(heading, heading))[:, None]
    centre = turn @ np.array(wheel.centre) + motion.shift[wheel.joint]
    return centre + (wheel.radius - wheel.crown) * down + wheel.crown * DOWN, heading, lean


def slopes(function: Callable[[Complex], Complex], at: Real, columns: list[int]) -> Real:
    """Derivatives (values, columns) of a ``function`` of a vector ``at`` a point (n,), by complex ``columns``."""
    points = np.tile(at.astype(complex)[:, None], len(columns))
    points[columns, range(len(columns))] += 1j * STEP
    return np.asarray(function(points).imag / STEP)
