"""A bicycle with its effects from Kane's equations with exact rotations, linearised by complex steps.

Nothing is shared with the package but names of parameters. Newton's and Euler's equations of every body are projected
on the velocities of coordinates, in the world: place of the rear frame's point of contact, yaw, lean, pitch and the
hinges. Contact forces act where a tyre touches the ground, at the lowest point of a torus on a turned axle, along the
wheel's track and across it; the loads and the acceleration follow from the rows of x, z and pitch. Everything is one
function of places, rates, accelerations and forces, which is not expanded by hand: its derivatives are complex steps.
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[Any]
H = 1e-30
X, Y, Z = np.eye(3)


class KaneBicycle:
    """``p`` holds the parameters of a model, ``effects`` the identifiers of its effects."""

    def __init__(self, p: Mapping[str, float], effects: Collection[str], speed: float) -> None:
        self.p, self.effects, self.v = p, set(effects), speed
        sine, cosine = np.sin(p["lam"]), np.cos(p["lam"])
        steer = (np.array([sine, 0, cosine]), np.array([p["w"] + p["c"], 0, 0]))
        # hinges: name -> axis, a point of it, hinge that carries it
        self.hinges: dict[str, tuple[Vector, Vector, str]] = {
            "yaw": (Z, 0 * X, ""), "lean": (X, 0 * X, "yaw"), "pitch": (Y, 0 * X, "lean"),
        }  # fmt: skip
        front = rear = "pitch"
        if "front_compliance" in self.effects:
            front = self._hinge("front_compliance", "pitch")
        self.hinges["steer"] = (*steer, front)
        front = "steer"
        if "fork_bending" in self.effects:
            foot = steer[1] + steer[0] * np.dot(np.array([p["w"], 0, -p["rF"]]) - steer[1], steer[0])
            hinge = foot - self.of("fork_bending", "length") * steer[0]
            self.hinges["fork_bending"] = (np.array([cosine, 0, -sine]), hinge, "steer")
        if "rear_compliance" in self.effects:
            rear = self._hinge("rear_compliance", "pitch")
        if "rider_lean" in self.effects:
            self.hinges["rider_lean"] = (X, np.array([0, 0, self.of("rider_lean", "joint_z")]), "pitch")
        self.names = [name for name in self.hinges if name != "pitch"]
        wheel = front if "fork_bending" not in self.effects else "fork_bending"
        # bodies: mass, centre, inertia, hinge that carries it
        self.bodies = [
            (p["mB"], np.array([p["xB"], 0, p["zB"]]), self._inertia("IB", p), "pitch"),
            (p["mH"], np.array([p["xH"], 0, p["zH"]]), self._inertia("IH", p), front),
            (p["mR"], np.array([0, 0, -p["rR"]]), np.diag([p["IRxx"], p["IRyy"], p["IRxx"]]), rear),
            (p["mF"], np.array([p["w"], 0, -p["rF"]]), np.diag([p["IFxx"], p["IFyy"], p["IFxx"]]), wheel),
        ]
        if "rider_lean" in self.effects:
            r = {key: self.of("rider_lean", key) for key in ("mass", "x", "z", "Ixx", "Izz", "Ixz")}
            body, at = self._inertia("I", r), np.array([r["x"], 0, r["z"]])
            self.bodies += [(r["mass"], at, body, "rider_lean"), (-r["mass"], at, -body, "pitch")]
        self.wheels = ((rear, np.array([0, 0, -p["rR"]]), p["rR"]), (wheel, np.array([p["w"], 0, -p["rF"]]), p["rF"]))
        # spin momenta about +y at a speed, and what they gain per m/s
        self.spins = [(rear, -p["IRyy"] / p["rR"], 0.0), (wheel, -p["IFyy"] / p["rF"], 0.0)]
        if "rotating_mass" in self.effects:
            inertia, ratio, spin = (self.of("rotating_mass", key) for key in ("inertia", "ratio", "spin"))
            self.spins.append(("pitch", -inertia * ratio / p["rR"], -inertia * spin))
        self.loads, self.acceleration = np.zeros(2), 0.0
        self.loads, self.acceleration = self._steady()

    def of(self, effect: str, key: str) -> float:
        """Value of a parameter of an effect, 0 without the effect."""
        return self.p[f"{effect}.{key}"] if effect in self.effects else 0.0

    def per_wheel(self, effect: str, key: str) -> Vector:
        """Values of rear and front wheel."""
        return np.array([self.of(effect, f"{key}.{wheel}") for wheel in ("rear", "front")])

    def _hinge(self, effect: str, carried: str) -> str:
        tilt = self.of(effect, "axis_tilt")
        place = np.array([self.of(effect, "joint_x"), 0, self.of(effect, "joint_z")])
        self.hinges[effect] = (np.array([np.cos(tilt), 0, -np.sin(tilt)]), place, carried)
        return effect

    @staticmethod
    def _inertia(name: str, p: Mapping[str, float]) -> Vector:
        xx, zz, xz = (p[name + axes] for axes in ("xx", "zz", "xz"))
        return np.array([[xx, 0, xz], [0, p.get(name + "yy", 0.0), 0], [xz, 0, zz]])

    def _moved(self, q: Vector, u: Vector, a: Vector, along: tuple[float, float]) -> dict[str, Any]:
        """Motion of what each hinge carries: turn, origin, and their rates; coordinates are y and the hinges."""
        places = dict(zip(self.names, zip(q[1:], u[1:], a[1:], strict=True), strict=True)) | {"pitch": (0, 0, 0)}
        ground = (
            np.eye(3), np.array([0, q[0], 0]), 0 * X, 0 * X, np.array([along[0], u[0], 0]),
            np.array([along[1], a[0], 0]), {},
        )  # fmt: skip
        moved: dict[str, Any] = {"": ground}
        for name, (axis, pivot, carried) in self.hinges.items():
            turn, origin, omega, alpha, velocity, acceleration, chain = moved[carried]
            angle, rate, second = places[name]
            world, arm = turn @ axis, turn @ pivot
            at = origin + arm
            velocity = velocity + np.cross(omega, arm)
            acceleration = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            alpha = alpha + second * world + np.cross(omega, rate * world)
            omega, turn = omega + rate * world, turn @ _rotation(axis, angle)
            arm = -turn @ pivot
            velocity = velocity + np.cross(omega, arm)
            acceleration = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            moved[name] = (turn, at + arm, omega, alpha, velocity, acceleration, {**chain, name: (world, at)})
        return moved

    def _contacts(self, moved: dict[str, Any]) -> list[tuple[str, Vector, Vector, Vector, Any, Any]]:
        """Of each wheel: hinge, point on the ground, track, across it, camber and slip velocity."""
        found = []
        crowns = self.per_wheel("crown_radius", "crown_radius")
        for (name, centre, radius), crown in zip(self.wheels, crowns, strict=True):
            turn, origin, omega, _, velocity, _, _ = moved[name]
            axle = turn @ Y
            down = Z - axle[2] * axle
            arm = turn @ centre + (radius - crown) * down / np.sqrt(down @ down) + crown * Z
            track = np.cross(axle, Z)
            track = track / np.sqrt(track @ track)
            across = np.cross(Z, track)
            slip = (velocity + np.cross(omega, arm)) @ across
            found.append((name, origin + arm, track, across, np.arcsin(axle[2]), slip))
        return found

    def residual(self, q: Vector, u: Vector, a: Vector, f: Vector, wind: Any = 0.0) -> tuple[Vector, Vector, Vector]:
        """Rows of the coordinates, then x, z and pitch; rates of the side forces ``f``; slip velocities."""
        p, v = self.p, self.v
        moved = self._moved(q, u, a, (v, self.acceleration))
        heading = np.array([np.cos(q[1]), np.sin(q[1]), 0])
        sideways = np.cross(Z, heading)
        slope = np.arctan(self.of("longitudinal", "gradient"))
        gravity = p["g"] * (np.cos(slope) * Z - np.sin(slope) * heading)
        rows = dict.fromkeys(("x", "y", "z", *self.hinges), 0.0 * q[0])

        def act(name: str, force: Vector, point: Vector, moment: Vector = 0 * X) -> None:
            for key, unit in (("x", X), ("y", Y), ("z", Z)):
                rows[key] = rows[key] - force @ unit
            for key, (axis, at) in moved[name][-1].items():
                rows[key] = rows[key] - force @ np.cross(axis, point - at) - moment @ axis

        for mass, centre, inertia, name in self.bodies:
            turn, origin, omega, alpha, _, acceleration, _ = moved[name]
            arm = turn @ centre
            second = acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            spin = turn @ inertia @ turn.T
            act(name, mass * (gravity - second), origin + arm, -(spin @ alpha + np.cross(omega, spin @ omega)))
        for name, per_speed, fixed in self.spins:
            turn, origin, omega = moved[name][:3]
            axle = turn @ Y
            change = per_speed * self.acceleration * axle + np.cross(omega, (per_speed * v + fixed) * axle)
            act(name, 0 * X, origin, -change)

        brake, share = self.of("longitudinal", "brake_force"), self.of("longitudinal", "front_share")
        along = np.array([self.of("longitudinal", "drive_force") - (1 - share) * brake, -share * brake])
        if "aerodynamic_drag" in self.effects:
            air = {k: self.of("aerodynamic_drag", k) for k in (
                "drag_area", "air_density", "side_area", "yaw_moment_area", "centre_of_pressure_x",
                "centre_of_pressure_z",
            )}  # fmt: skip
            turn, origin, omega, _, velocity, _, _ = moved["pitch"]
            arm = turn @ np.array([air["centre_of_pressure_x"], 0, air["centre_of_pressure_z"]])
            blown = wind * sideways - velocity - np.cross(omega, arm)
            fast = np.sqrt(blown @ blown)
            pressure = air["air_density"] * fast**2 / 2
            beta = np.arctan((blown @ sideways) / -(blown @ heading))
            crosswise = np.cross(Z, -blown) / fast
            force = pressure * (air["drag_area"] * blown / fast + air["side_area"] * beta * crosswise)
            act("pitch", force, origin + arm, pressure * air["yaw_moment_area"] * beta * Z)
            along = along + np.array([air["air_density"] * air["drag_area"] * v**2 / 2, 0])

        contacts = self._contacts(moved)
        cambers, slips = np.array([c[4] for c in contacts]), np.array([c[5] for c in contacts])
        of_camber = self.per_wheel("camber_thrust", "camber_stiffness") * cambers
        lag = self.of("camber_thrust", "lag_share")
        side = f + (1 - lag) * of_camber
        moment = -self.per_wheel("pneumatic_trail", "trail") * side
        overturning = -self.per_wheel("overturning_moment", "overturning_stiffness") * cambers
        overturning = overturning - self.per_wheel("overturning_moment", "arm") * side
        for k, (name, point, track, across, _, _) in enumerate(contacts):
            force = side[k] * across + along[k] * track - self.loads[k] * Z
            act(name, force, point, moment[k] * Z + overturning[k] * track)
        rates = 0 * f
        if "relaxation_length" in self.effects:
            length = self.per_wheel("relaxation_length", "relaxation_length")
            stiffness = self.per_wheel("relaxation_length", "cornering_stiffness")
            rates = -stiffness / length * slips - v / length * (f - lag * of_camber)
        for name, angle, rate in zip(self.names, q[1:], u[1:], strict=True):
            if name in self.effects:
                rows[name] = rows[name] + self.of(name, "stiffness") * angle + self.of(name, "damping") * rate
        order = ("y", *self.names, "x", "z", "pitch")
        return np.array([rows[key] for key in order]), rates, slips

    def _steady(self) -> tuple[Vector, float]:
        """Loads (N) and acceleration of straight running: the rows of x, z and pitch are linear in them."""
        n = 1 + len(self.names)
        zero, no_force = np.zeros(n), np.zeros(2)

        def rows(loads: Vector, acceleration: float) -> Vector:
            self.loads, self.acceleration = loads, acceleration
            return np.asarray(self.residual(zero, zero, zero, no_force)[0][n:])

        start = rows(no_force, 0.0)
        columns = [rows(X[:2], 0.0), rows(Y[:2], 0.0), rows(no_force, 1.0)]
        found = np.linalg.solve(np.column_stack(columns) - start[:, None], -start)
        return found[:2], float(found[2])

    def state_matrix(self) -> tuple[list[str], Vector, Vector]:
        """State names, state matrix, and input column of the side wind.

        With tyres the states are [V, r, rates, angles, side forces]; V is the velocity across the heading. Without,
        the side forces hold the slip velocities, which leaves two roots of zero to the matrix of [V, r, rates, angles].
        """
        n = 1 + len(self.names)
        sizes = (n, n, n, 2, 1)
        flat = np.zeros(sum(sizes))
        parts = np.cumsum(sizes)[:-1]
        slopes = []
        for k in range(len(flat)):
            moved = flat.astype(complex)
            moved[k] += 1j * H
            q, u, a, f, w = np.split(moved, parts)
            rows, rates, slips = self.residual(q, u, a, f, w[0])
            slopes.append(np.concatenate([rows[:n], rates, slips]).imag / H)
        of_q, of_u, of_a, of_f, of_w = np.split(np.array(slopes).T, parts, axis=1)
        # y' = V + v psi, y'' = V' + v r + (dv/dt) psi: nothing may depend on the heading then
        of_heading = of_q[:, 1] + self.v * of_u[:, 0] + self.acceleration * of_a[:, 0]
        assert np.abs(of_heading).max() < 1e-9 * np.abs(of_q).max(), "the heading must not matter"
        assert np.abs(of_q[:, 0]).max() < 1e-9 * np.abs(of_q).max(), "the place must not matter"
        of_u[:, 1] += self.v * of_a[:, 0]
        mass, held = of_a[:n], "relaxation_length" not in self.effects
        right = -np.hstack([of_u[:n], of_q[:n, 2:], of_f[:n], of_w[:n]])
        names = ["rear_lateral_velocity", "yaw_rate", *(f"{name}_rate" for name in self.names[1:]), *self.names[1:]]
        turning = np.eye(n - 2, right.shape[1], 2)  # rates of the hinges' angles
        slip = np.hstack([of_u[n + 2 :], of_q[n + 2 :, 2:]])
        if held:  # S_u u' = -S_q q' keeps the slip where it is
            ports, turning = right[:, -3:-1], np.delete(turning, [-3, -2], 1)
            saddle = np.block([[mass, -ports], [slip[:, :n], np.zeros((2, 2))]])
            known = np.vstack([np.delete(right, [-3, -2], 1), -slip[:, n:] @ turning])
            whole = np.vstack([np.linalg.solve(saddle, known)[:n], turning])
        else:
            tyres = np.hstack([of_u[n : n + 2], of_q[n : n + 2, 2:], of_f[n : n + 2], of_w[n : n + 2]])
            whole = np.vstack([np.linalg.solve(mass, right), turning, tyres])
            names += ["rear_side_force", "front_side_force"]
        return names, whole[:, :-1], whole[:, -1]


def _rotation(axis: Vector, angle: Any) -> Vector:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
