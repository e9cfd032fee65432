"""A bicycle on relaxing tyres from Lagrange's equations with exact rotations, sharing nothing with the package.

Coordinates are yaw, lean, an optional hinge of the front assembly and steer about moving axes, and the place (x, y) of
the rear contact on the ground; x moves at v, the wheels spin at -v/r. With kinetic energy T(q, q') of rigid bodies and
U(q) = sum -m g z + sum N z_c (lowest point z_c of a wheel times its static load N: what weight does where both wheels
must touch), both exact, the equations linear in lateral motion are

    T_q'q' q'' + (T_q'q - T_qq') q' + (U_qq - T_qq) q = sum F dy_c/dq,

y_c the lateral place of the body's point in contact. The second derivatives are differences. A tyre builds up its side
force as (length / v) F' + F = -C (y_c' / v - heading of the wheel).
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Vector = NDArray[np.float64]
H = 3e-3  # rad and m, of the differences, which are extrapolated to step zero


class LagrangeBicycle:
    """Meijaard's parameters ``p`` and per wheel (rear, front) ``stiffness`` (N/rad) and relaxation ``length`` (m).

    ``hinge`` holds place (x, z), stiffness (N m/rad) and damping (N m s/rad) of a hinge that carries the front assembly
    and whose axis is perpendicular to the steer axis.
    """

    def __init__(
        self, p: Mapping[str, float], *, stiffness: tuple[float, float], length: tuple[float, float],
        hinge: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        self.p, self.stiffness, self.length = p, np.array(stiffness), np.array(length)
        sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
        chain: list[tuple[Vector, Vector]] = [
            (np.array([0, 0, 1.0]), np.zeros(3)),
            (np.array([1.0, 0, 0]), np.zeros(3)),
        ]
        if hinge:
            chain.append((np.array([cosine, 0, -sine]), np.array([hinge["x"], 0, hinge["z"]])))
        chain.append((np.array([sine, 0, cosine]), np.array([p["w"] + p["c"], 0, 0])))
        front = tuple(range(len(chain)))
        self.chain, n = chain, 1 + len(chain)  # y, yaw, lean, (hinge,) steer
        wheels = [np.array([0, 0, -p["rR"]]), np.array([p["w"], 0, -p["rF"]])]
        total = p["mB"] + p["mR"] + p["mH"] + p["mF"]
        front_load = p["g"] * (p["mB"] * p["xB"] + p["mH"] * p["xH"] + p["mF"] * p["w"]) / p["w"]
        self.loads = np.array([p["g"] * total - front_load, front_load])
        # mass, centre, inertia, hinges, radius of a wheel, whether it rolls
        self.bodies: list[tuple[float, Vector, Vector, tuple[int, ...], float, bool]] = [
            (p["mB"], np.array([p["xB"], 0, p["zB"]]), _frame(p, "B"), (0, 1), 0.0, False),
            (p["mR"], wheels[0], np.diag([p["IRxx"], p["IRyy"], p["IRxx"]]), (0, 1), p["rR"], True),
            (p["mH"], np.array([p["xH"], 0, p["zH"]]), _frame(p, "H"), front, 0.0, False),
            (p["mF"], wheels[1], np.diag([p["IFxx"], p["IFyy"], p["IFxx"]]), front, p["rF"], True),
        ]
        zero, rates = np.zeros(n), np.eye(n)
        single = np.array([self.kinetic(zero, a, 0.0) for a in rates])
        both = np.array([[self.kinetic(zero, a + b, 0.0) for a in rates] for b in rates])
        self.mass = both - single[:, None] - single[None, :]
        # at v = 1: T_q'q is linear in v, T_qq quadratic
        mixed = _derivatives(lambda q, rate: self.kinetic(q, rate, 1.0), n)
        self.gyroscopic = mixed - mixed.T
        self.centrifugal = -_derivatives(lambda a, b: self.kinetic(a + b, zero, 1.0), n)
        self.potential = _derivatives(lambda a, b: self.weight(a + b), n)
        self.damping = np.zeros((n, n))
        if hinge:
            self.potential[3, 3] += hinge["stiffness"]
            self.damping[3, 3] += hinge["damping"]
        contacts = [(np.zeros(3), (0, 1)), (np.array([p["w"], 0, 0]), front)]
        self.ports, self.headings = np.zeros((2, 2, n))
        for wheel, (contact, hinges) in enumerate(contacts):
            _, axes, places = self.turned(hinges, zero)
            self.ports[wheel, 0] = 1
            for k, axis, at in zip(hinges, axes, places, strict=False):
                self.ports[wheel, 1 + k] = _cross(axis, contact - at)[1]
                self.headings[wheel, 1 + k] = axis[2]

    def turned(self, hinges: tuple[int, ...], q: Vector) -> tuple[Vector, list[Vector], list[Vector]]:
        """Rotation of a body on some hinges, and their axes and places, at coordinates ``q``."""
        turn, axes, places = np.eye(3), [], []
        origin = np.array([0, q[0], 0])
        for k in hinges:
            (axis, pivot), angle = self.chain[k], q[1 + k]
            origin = origin + turn @ pivot
            axes.append(turn @ axis)
            places.append(origin)
            turn = turn @ _rotation(axis, angle)
            origin = origin - turn @ pivot
        return turn, axes, [*places, origin]

    def place(self, point: Vector, hinges: tuple[int, ...], q: Vector) -> Vector:
        """Where a point of a body is."""
        turn, _, places = self.turned(hinges, q)
        return np.asarray(places[-1] + turn @ point)

    def kinetic(self, q: Vector, rate: Vector, speed: float) -> float:
        """T (J) at coordinates and rates, with the rear contact moving at ``speed`` along x."""
        total = 0.0
        carried = {hinges: self.turned(hinges, q) for hinges in {body[3] for body in self.bodies}}
        for mass, centre, inertia, hinges, radius, _ in self.bodies:
            turn, axes, places = carried[hinges]
            at = places[-1] + turn @ centre
            spin = np.zeros(3) if not radius else turn[:, 1] * (-speed / radius)
            velocity = np.array([speed, rate[0], 0.0])
            angular = spin
            for axis, place, k in zip(axes, places, hinges, strict=False):
                if turning := rate[1 + k]:
                    velocity = velocity + turning * _cross(axis, at - place)
                    angular = angular + turning * axis
            local = turn.T @ angular
            total += (mass * velocity @ velocity + local @ inertia @ local) / 2
        return total

    def weight(self, q: Vector) -> float:
        """U (J) without springs."""
        total, lowest = 0.0, []
        for mass, centre, _, hinges, radius, rolls in self.bodies:
            height = self.place(centre, hinges, q)[2]
            total -= mass * self.p["g"] * height
            if rolls:
                axle = self.turned(hinges, q)[0][2, 1]
                lowest.append(height + radius * math.sqrt(1 - axle**2))
        return float(total + self.loads @ lowest)

    def state_matrix(self, speed: float) -> Vector:
        """State matrix of coordinates, rates and the two lateral forces."""
        n = len(self.mass)
        rest, unit, solved = np.zeros((n, n)), np.eye(n), np.linalg.inv(self.mass)
        stiffness, damping = self.potential + speed**2 * self.centrifugal, self.damping + speed * self.gyroscopic
        rate = np.diag(self.stiffness / self.length)
        return np.block(
            [
                [rest, unit, np.zeros((n, 2))],
                [-solved @ stiffness, -solved @ damping, solved @ self.ports.T],
                [speed * rate @ self.headings, -rate @ self.ports, -np.diag(speed / self.length)],
            ]
        )

    def growth(self, speed: float, slowest: float, fastest: float) -> float:
        """Largest real part (1/s) of the pairs with an angular frequency (rad/s) in a band."""
        values = np.linalg.eigvals(self.state_matrix(speed))
        return float(values.real[(values.imag > slowest) & (values.imag < fastest)].max())

    def crossing(self, low: float, high: float, band: tuple[float, float]) -> float:
        """Speed (m/s) between two others at which the pair of a band begins or ends to grow."""
        return float(brentq(lambda v: self.growth(v, *band), low, high, xtol=1e-9))


def _frame(p: Mapping[str, float], name: str) -> Vector:
    xx, zz, xz = (p[f"I{name}{k}"] for k in ("xx", "zz", "xz"))
    return np.array([[xx, 0, xz], [0, p.get(f"I{name}yy", 1.0), 0], [xz, 0, zz]])


def _cross(a: Vector, b: Vector) -> Vector:
    (x, y, z), (u, v, w) = a.tolist(), b.tolist()
    return np.array([y * w - z * v, z * u - x * w, x * v - y * u])


def _rotation(axis: Vector, angle: float) -> Vector:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross)


def _derivatives(function: Any, n: int) -> Vector:
    """d2 f(a, b) / db_i da_j at 0 by central differences, extrapolated to step zero."""

    def at(h: float) -> Vector:
        signs = [(s, t) for s in (1, -1) for t in (1, -1)]
        steps = h * np.eye(n)
        return np.array([[sum(s * t * function(s * a, t * b) for s, t in signs) for a in steps] for b in steps]) / (
            4 * h * h
        )

    return (4 * at(H) - at(2 * H)) / 3
