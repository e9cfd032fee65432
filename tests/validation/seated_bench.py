"""SYNTHETIC bicycles under a seated rider, front wheel in the air: finite rotations, differentiated numerically.

Coordinates: the frame leans and yaws about the point under its rear wheel, the front turns about its hinge, the rider
turns on the saddle, and the rear tyre gives way to the side, if at all. Nothing of the package is used but the numbers
of its bicycles. A recording is the exact response to a tap at the hub.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from tests.validation.standing_bench import vibrate

Array = NDArray[np.float64]
GRAVITY = 9.81
WHEEL = 0.34  # m above the hub, up to where a place is on the wheel
STEP = 1e-4  # rad and m, of the differences
LEAN, YAW, HINGE, RIDER, SIDE = range(5)


@dataclass(frozen=True)
class Rider:
    """A body on the saddle, its axes those of the bicycle."""

    mass: float  # kg
    centre: tuple[float, float]  # x, z, m
    inertia: tuple[float, float, float]  # xx, zz, xz, kg m^2, about the centre
    saddle: float  # x of the vertical hinge, m
    stiffness: float  # N m/rad
    damping: float  # N m s/rad


@dataclass(frozen=True)
class Seated:
    """A bicycle whose rear frame holds a rider; the keys of the bicycle are those of frame and rider together."""

    p: Mapping[str, float]  # keys of Meijaard et al. (2007), SI
    rider: Rider
    stiffness: float  # N m/rad, of the front's hinge
    damping: float  # N m s/rad
    height: float  # m of the hinge above the hub, along the steer axis
    tyre: float = math.inf  # N/m, of the rear tyre to the side
    loss: float = 0.0  # s, damping of the tyre over its stiffness

    @property
    def free(self) -> list[int]:
        """Coordinates that move."""
        return [LEAN, YAW, HINGE, RIDER] + [SIDE] * math.isfinite(self.tyre)

    def point(self, above: float, part: str = "front") -> Array:
        """Point above the hub along the steer axis: near the wheel on a line through the hub, else on the axis."""
        lam = self.p["lam"]
        at_hub = np.array([self.p["w"], 0.0, -self.p["rF"]]) - above * np.array([math.sin(lam), 0.0, math.cos(lam)])
        if part == "front" and above <= WHEEL:
            return at_hub
        offset = self.p["rF"] * math.sin(lam) - self.p["c"] * math.cos(lam)  # of the fork
        return at_hub - offset * np.array([math.cos(lam), 0.0, -math.sin(lam)])

    def place(self, q: Array, at: Array, part: str) -> Array:
        """Where the point ``at`` of a part (frame, front, rider) is after the motions ``q``."""
        rotation = scipy.spatial.transform.Rotation
        if part == "front":
            lam = self.p["lam"]
            axis, pivot = np.array([math.cos(lam), 0.0, -math.sin(lam)]), self.point(self.height)
            at = pivot + rotation.from_rotvec(q[HINGE] * axis).apply(at - pivot)
        if part == "rider":
            pivot = np.array([self.rider.saddle, 0.0, 0.0])
            at = pivot + rotation.from_rotvec([0.0, 0.0, q[RIDER]]).apply(at - pivot)
        turn = rotation.from_rotvec([0.0, 0.0, q[YAW]]) * rotation.from_rotvec([q[LEAN], 0.0, 0.0])
        return np.asarray(turn.apply(at) + np.array([0.0, q[SIDE], 0.0]))

    def row(self, at: Array, part: str) -> Array:
        """Lateral motion of a point per coordinate."""
        steps = STEP * np.eye(5)
        return np.array([(self.place(s, at, part)[1] - self.place(-s, at, part)[1]) / (2 * STEP) for s in steps])

    def turns(self, part: str) -> Array:
        """Rotation vector (3, 5) of a part per coordinate, to first order."""
        rows = np.zeros((3, 5))
        rows[0, LEAN] = rows[2, YAW] = 1.0
        if part == "front":
            rows[:, HINGE] = np.array([math.cos(self.p["lam"]), 0.0, -math.sin(self.p["lam"])])
        if part == "rider":
            rows[2, RIDER] = 1.0
        return rows

    def bodies(self) -> list[tuple[float, Array, Array, str]]:
        """Mass, centre, inertia tensor, and the part that it belongs to; the rider is taken out of the frame."""
        p, rider = self.p, self.rider
        whole, centre = tensor(p["IBxx"], p["IBzz"], p["IBxz"]), np.array([p["xB"], 0.0, p["zB"]])
        at_rider = np.array([rider.centre[0], 0.0, rider.centre[1]])
        body = tensor(*rider.inertia)
        return [
            (p["mB"], centre, whole, "frame"),
            (-rider.mass, at_rider, -body, "frame"),
            (rider.mass, at_rider, body, "rider"),
            (p["mR"], np.array([0.0, 0.0, -p["rR"]]), tensor(p["IRxx"], p["IRxx"]), "frame"),
            (p["mH"], np.array([p["xH"], 0.0, p["zH"]]), tensor(p["IHxx"], p["IHzz"], p["IHxz"]), "front"),
            (p["mF"], np.array([p["w"], 0.0, -p["rF"]]), tensor(p["IFxx"], p["IFxx"]), "front"),
        ]

    def matrices(self) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness of the free coordinates."""
        mass, weight = np.zeros((5, 5)), np.zeros((5, 5))
        for kilograms, centre, inertia, part in self.bodies():
            row, turns = self.row(centre, part), self.turns(part)
            mass += kilograms * np.outer(row, row) + turns.T @ inertia @ turns
            weight -= kilograms * GRAVITY * self._curvature(centre, part)
        springs = np.zeros(5)
        springs[[HINGE, RIDER]] = self.stiffness, self.rider.stiffness
        springs[SIDE] = self.tyre if math.isfinite(self.tyre) else 0.0
        dampers = np.zeros(5)
        dampers[[HINGE, RIDER]] = self.damping, self.rider.damping
        dampers[SIDE] = self.loss * springs[SIDE]
        chosen = np.ix_(self.free, self.free)
        return mass[chosen], np.diag(dampers)[chosen], (np.diag(springs) + weight)[chosen]

    def _curvature(self, at: Array, part: str) -> Array:
        """Second derivatives of the way down of a point."""
        h = 1e-3
        total, units = np.zeros((5, 5)), h * np.eye(5)
        for i in range(5):
            for j in range(5):
                for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                    total[i, j] += a * b * self.place(a * units[i] + b * units[j], at, part)[2] / (4 * h * h)
        return total

    def state_matrix(self) -> tuple[Array, Array]:
        """Matrix A of x' = A x for the coordinates, then their rates; and the mass matrix."""
        mass, damping, stiffness = self.matrices()
        n = len(mass)
        a = np.zeros((2 * n, 2 * n))
        a[:n, n:] = np.eye(n)
        a[n:] = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
        return a, mass

    def vibrations(self, places: list[tuple[float, str]]) -> list[tuple[float, float, list[complex]]]:
        """|eigenvalue| / 2 pi (Hz), damping ratio, and complex ratios to the first place, by frequency.

        ``places``: m above the hub, and the part.
        """
        a, mass = self.state_matrix()
        roots, vectors = np.linalg.eig(a)
        rows = [self.row(self.point(above, part), part)[self.free] for above, part in places]
        found = []
        for k in np.argsort(np.abs(roots)):
            if roots[k].imag < 1.0:  # rad/s: the frame as a whole turns and falls
                continue
            moves = [row @ vectors[: len(mass), k] for row in rows]
            ratios = [complex(move / moves[0]) for move in moves[1:]]
            found.append((abs(roots[k]) / (2 * math.pi), -roots[k].real / abs(roots[k]), ratios))
        return found

    def recording(
        self, places: list[tuple[float, str]], rng: Any, *, noise: float = 0.03, rate: float = 400.0
    ) -> dict[str, Array]:
        """Time (s) and lateral accelerations (m/s^2) at places after a tap of 0.3 N s at the hub, at 0.15 s.

        The rider keeps the balance: what falls slowly is left out.
        """
        a, mass = self.state_matrix()
        n = len(mass)
        rows = np.array([self.row(self.point(above, part), part)[self.free] for above, part in places])
        state = np.concatenate([np.zeros(n), np.linalg.solve(mass, 0.3 * rows[0])])
        roots, vectors = np.linalg.eig(a)
        shares = np.linalg.solve(vectors, state.astype(complex))
        state = (vectors @ np.where(np.abs(roots.imag) < 1.0, 0.0, shares)).real
        return vibrate(a, rows, state, noise * rng.standard_normal((len(places), int(1.6 * rate))), rate)


def tensor(xx: float, zz: float, xz: float = 0.0) -> Array:
    """Inertia tensor without rotation about y, which has no part."""
    return np.array([[xx, 0.0, xz], [0.0, 0.0, 0.0], [xz, 0.0, zz]])
