"""SYNTHETIC bicycles that stand still: finite rotations of rigid bodies, differentiated numerically.

Four coordinates: the hold of the frame gives way to the side, in roll and in yaw; the front turns about its hinge.
Nothing of the package is used but the numbers of its bicycles. A recording is the exact response to an impulse at the
hub.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRAVITY = 9.81
STEP = 1e-4  # rad and m, of the differences
HELD = 1e12  # N/m and N m/rad


@dataclass(frozen=True)
class Stand:
    """A bicycle whose front turns about one hinge, and its hold."""

    p: Mapping[str, float]  # keys of Meijaard et al. (2007), SI
    stiffness: float  # N m/rad
    damping: float  # N m s/rad
    height: float  # m of the hinge above the hub, along the steer axis
    rotation: float = HELD  # N m/rad of the hold, in roll and in yaw
    lateral: float = HELD  # N/m of the hold
    hold: tuple[float, float] = (0.43, 0.27)  # its place: share of the wheelbase, m above the ground

    @property
    def free(self) -> list[int]:
        """Coordinates that move: side, roll, yaw of the frame, hinge."""
        return [3] if self.rotation >= HELD else [0, 1, 2, 3]

    @property
    def up(self) -> Array:
        """Unit vector up the steer axis."""
        return np.array([-math.sin(self.p["lam"]), 0.0, -math.cos(self.p["lam"])])

    def point(self, above: float) -> Array:
        """Point above the hub, on the line along the steer axis through the hub."""
        return np.array([self.p["w"], 0.0, -self.p["rF"]]) + above * self.up

    def place(self, q: Array, at: Array, *, front: bool) -> Array:
        """Where the point ``at`` of the front, or of the frame, is after the motions ``q``."""
        lam = self.p["lam"]
        if front:
            axis = np.array([math.cos(lam), 0.0, -math.sin(lam)])
            pivot = self.point(self.height)
            at = pivot + scipy.spatial.transform.Rotation.from_rotvec(q[3] * axis).apply(at - pivot)
        origin = np.array([self.hold[0] * self.p["w"], 0.0, -self.hold[1]])
        turn = scipy.spatial.transform.Rotation.from_euler("xz", [q[1], q[2]])
        return origin + turn.apply(at - origin) + np.array([0.0, q[0], 0.0])

    def row(self, at: Array, *, front: bool) -> Array:
        """Lateral motion of a point per coordinate."""
        steps = STEP * np.eye(4)
        return np.array(
            [(self.place(s, at, front=front)[1] - self.place(-s, at, front=front)[1]) / (2 * STEP) for s in steps]
        )

    def turns(self, *, front: bool) -> Array:
        """Rotation vector (3, 4) of a body per coordinate, to first order."""
        rows = np.zeros((3, 4))
        rows[0, 1] = rows[2, 2] = 1.0
        if front:
            rows[:, 3] = np.array([math.cos(self.p["lam"]), 0.0, -math.sin(self.p["lam"])])
        return rows

    def bodies(self) -> list[tuple[float, Array, Array, bool]]:
        """Mass, centre, inertia tensor, and whether it belongs to the front."""
        p = self.p

        def tensor(xx: float, zz: float, xz: float = 0.0) -> Array:
            return np.array([[xx, 0.0, xz], [0.0, 0.0, 0.0], [xz, 0.0, zz]])

        return [
            (p["mB"], np.array([p["xB"], 0.0, p["zB"]]), tensor(p["IBxx"], p["IBzz"], p["IBxz"]), False),
            (p["mR"], np.array([0.0, 0.0, -p["rR"]]), tensor(p["IRxx"], p["IRxx"]), False),
            (p["mH"], np.array([p["xH"], 0.0, p["zH"]]), tensor(p["IHxx"], p["IHzz"], p["IHxz"]), True),
            (p["mF"], np.array([p["w"], 0.0, -p["rF"]]), tensor(p["IFxx"], p["IFxx"]), True),
        ]

    def matrices(self, *, upright: bool, added: tuple[float, float] = (0.0, 0.0)) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness of the free coordinates; ``added``: kg, and m above the hub."""
        parts = [*self.bodies(), (added[0], self.point(added[1]), np.zeros((3, 3)), True)]
        mass, weight = np.zeros((4, 4)), np.zeros((4, 4))
        for kilograms, centre, tensor, front in parts:
            row, turns = self.row(centre, front=front), self.turns(front=front)
            mass += kilograms * np.outer(row, row) + turns.T @ tensor @ turns
            weight -= kilograms * GRAVITY * self._curvature(centre, front=front)
        stiffness = np.diag([self.lateral, self.rotation, self.rotation, self.stiffness]) + upright * weight
        damping = np.diag([0.0, 0.0, 0.0, self.damping])
        if len(self.free) > 1:  # 2 % of the hold's own
            damping[:3, :3] = np.diag(0.04 * np.sqrt(np.diag(stiffness)[:3] * np.diag(mass)[:3]))
        chosen = np.ix_(self.free, self.free)
        return mass[chosen], damping[chosen], stiffness[chosen]

    def _curvature(self, at: Array, *, front: bool) -> Array:
        """Second derivatives of the way down of a point."""
        h = 1e-3
        total = np.zeros((4, 4))
        units = h * np.eye(4)
        for i in range(4):
            for j in range(4):
                corners = [
                    (sign_i * sign_j, self.place(sign_i * units[i] + sign_j * units[j], at, front=front)[2])
                    for sign_i in (1, -1)
                    for sign_j in (1, -1)
                ]
                total[i, j] = sum(sign * z for sign, z in corners) / (4 * h * h)
        return total

    def deflection(self, force: float, loaded: float, read: float, *, on_frame: bool = False) -> float:
        """Deflection (m) at a place under a lateral force (N), both m above the hub; it lies on its side."""
        _, _, stiffness = self.matrices(upright=False)
        rows = [
            self.row(self.point(place), front=front)[self.free]
            for place, front in ((loaded, True), (read, not on_frame))
        ]
        return float(force * rows[1] @ np.linalg.solve(stiffness, rows[0]))

    def state_matrix(self, added: tuple[float, float] = (0.0, 0.0)) -> tuple[Array, Array]:
        """Matrix A of x' = A x for the angles, then their rates; and the mass matrix."""
        mass, damping, stiffness = self.matrices(upright=True, added=added)
        n = len(mass)
        a = np.zeros((2 * n, 2 * n))
        a[:n, n:] = np.eye(n)
        a[n:] = -np.linalg.solve(mass, np.hstack([stiffness, damping]))
        return a, mass

    def vibration(
        self, places: list[tuple[float, bool]], added: tuple[float, float] = (0.0, 0.0)
    ) -> tuple[float, float, list[float]]:
        """|eigenvalue| / 2 pi (Hz), damping ratio, and ratios to the first place, of the mode that moves the hub most.

        ``places``: m above the hub, and whether on the frame.
        """
        a, mass = self.state_matrix(added)
        n = len(mass)
        roots, vectors = np.linalg.eig(a)
        rows = [self.row(self.point(above), front=not frame)[self.free] for above, frame in places]
        impulse = np.concatenate([np.zeros(n), np.linalg.solve(mass, rows[0])])
        share = np.abs((rows[0] @ vectors[:n]) * np.linalg.solve(vectors, impulse.astype(complex)) * roots**2)
        k = int(np.where(roots.imag > 0, share, 0.0).argmax())
        moves = [row @ vectors[:n, k] for row in rows]
        size = abs(roots[k])
        return size / (2 * math.pi), -roots[k].real / size, [float((move / moves[0]).real) for move in moves[1:]]

    def recording(self, places: list[float], rng: Any, *, noise: float = 0.03, rate: float = 400.0) -> dict[str, Array]:
        """Time (s) and lateral accelerations (m/s^2) at places above the hub after an impulse of 0.1 N s at 0.15 s."""
        a, mass = self.state_matrix()
        n = len(mass)
        rows = np.array([self.row(self.point(above), front=True)[self.free] for above in places])
        state = np.concatenate([np.zeros(n), np.linalg.solve(mass, 0.1 * rows[0])])
        return vibrate(a, rows, state, noise * rng.standard_normal((len(places), int(1.6 * rate))), rate)


def vibrate(a: Array, rows: Array, state: Array, noise: Array, rate: float) -> dict[str, Array]:
    """Time (s) and accelerations, by ``rows`` (places, n), of x' = a x from ``state`` (2 n,) at 0.15 s, and noise."""
    step = scipy.linalg.expm(a / rate)
    signals = noise.copy()
    for k in range(int(0.15 * rate), signals.shape[1]):
        signals[:, k] += rows @ (a @ state)[rows.shape[1] :]
        state = step @ state
    time = np.arange(signals.shape[1]) / rate
    return {"time_s": time} | {f"place_{k}": signal for k, signal in enumerate(signals)}


def perturbed(p: Mapping[str, float], sd: Mapping[str, float], rng: Any) -> dict[str, float]:
    """A bicycle whose true numbers differ from those of its file by errors of their sd."""
    return {key: value + sd.get(key, 0.0) * float(rng.standard_normal()) for key, value in p.items()}
