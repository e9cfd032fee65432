"""A bicycle with any effects from Kane's equations with exact rotations, linearised by complex steps.

Nothing is shared with the package but names of parameters. A bicycle is a tree of hinges, each of which hangs on a
hinge that it names, and of bodies, each of which is carried by a hinge that it names. Newton's and Euler's equations of
every body are projected on the velocities of coordinates, in the world: place of the rear frame's point of contact,
yaw, lean, pitch and the hinges. Contact forces act where a tyre touches the ground, at the lowest point of a torus on a
turned axle, along the wheel's track and across it; the loads and the acceleration follow from the rows of x, z and
pitch. Everything is one function of places, rates, accelerations and forces, which is not expanded by hand: its
derivatives are complex steps. All steps are taken at once: the last axis of an array counts them.
"""

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
STEP = 1e-30
X, Y, Z = np.eye(3)[..., None]
NOWHERE = np.zeros((3, 1))
WHEELS = ("rear", "front")


class KaneBicycle:
    """``p`` holds the parameters of a model, ``effects`` the identifiers of its effects, ``speed`` is in m/s."""

    def __init__(self, p: Mapping[str, float], effects: Collection[str], speed: float) -> None:
        self.p, self.effects, self.v = p, set(effects), speed
        # hinge -> its axis, a point of it, and the hinge that carries it
        self.hinges: dict[str, tuple[Array, Array, str]] = {
            "yaw": (Z, NOWHERE, ""), "lean": (X, NOWHERE, "yaw"), "pitch": (Y, NOWHERE, "lean"),
        }  # fmt: skip
        self._hang_hinges()
        self.names = [name for name in self.hinges if name != "pitch"]
        self.of_wheel = {
            "rear": "rear_compliance" if "rear_compliance" in self.hinges else "pitch",
            "front": "fork_bending" if "fork_bending" in self.hinges else "steer",
        }
        self.centres = {"rear": _point(0, -p["rR"]), "front": _point(p["w"], -p["rF"])}
        self.radii = {"rear": p["rR"], "front": p["rF"]}
        self.bodies = [*self._bodies()]  # mass, centre, inertia about it, hinge that carries it
        # spin momenta about +y: hinge that carries the rotor, what it has per m/s, and what it has at any speed
        self.spins = [(self.of_wheel[wheel], -p[f"I{wheel[0].upper()}yy"] / self.radii[wheel], 0.0) for wheel in WHEELS]
        if "rotating_mass" in self.effects:
            inertia, ratio, spin = (self.of("rotating_mass", key) for key in ("inertia", "ratio", "spin"))
            self.spins.append(("pitch", -inertia * ratio / p["rR"], -inertia * spin))
        self.extra = [*self._extra_states()]
        self.loads, self.acceleration = np.zeros(2), 0.0
        self.loads, self.acceleration = self._steady()

    def of(self, effect: str, key: str) -> float:
        """Value of a parameter of an effect, 0 without the effect."""
        return self.p[f"{effect}.{key}"] if effect in self.effects else 0.0

    def _hang_hinges(self) -> None:
        p = self.p
        sine, cosine = np.sin(p["lam"]), np.cos(p["lam"])
        steer_axis, foot = _point(sine, cosine), _point(p["w"] + p["c"], 0)
        for effect in ("front_compliance", "rear_compliance"):
            if effect in self.effects:
                tilt = self.of(effect, "axis_tilt")
                place = _point(self.of(effect, "joint_x"), self.of(effect, "joint_z"))
                self.hinges[effect] = (_point(np.cos(tilt), -np.sin(tilt)), place, "pitch")
        seat = "pitch"
        if "rider_saddle" in self.effects:
            self.hinges["rider_saddle"] = (Z, _point(self.of("rider_saddle", "joint_x"), 0), seat)
            seat = "rider_saddle"
        if "rider_saddle_roll" in self.effects:
            self.hinges["rider_saddle_roll"] = (X, _point(0, self.of("rider_saddle_roll", "joint_z")), seat)
            seat = "rider_saddle_roll"
        if "rider_lean" in self.effects:
            self.hinges["rider_lean"] = (X, _point(0, self.of("rider_lean", "joint_z")), seat)
        self.seat = seat  # hinge that carries the rider of whom others are parts
        if "rider_hands" in self.effects:
            self.hinges["arms"] = (steer_axis, foot, "pitch")
        self.hinges["steer"] = (steer_axis, foot, "front_compliance" if "front_compliance" in self.hinges else "pitch")
        if "fork_bending" in self.effects:
            beside_hub = foot + steer_axis * _dot(_point(p["w"], -p["rF"]) - foot, steer_axis)
            hinge = beside_hub - self.of("fork_bending", "length") * steer_axis
            self.hinges["fork_bending"] = (_point(cosine, -sine), hinge, "steer")

    def _bodies(self) -> Any:
        p = self.p
        yield p["mB"], _point(p["xB"], p["zB"]), self._inertia("IB", p), "pitch"
        yield p["mH"], _point(p["xH"], p["zH"]), self._inertia("IH", p), "steer"
        for wheel, letter in (("rear", "R"), ("front", "F")):
            xx, yy = p[f"I{letter}xx"], p[f"I{letter}yy"]
            yield p[f"m{letter}"], self.centres[wheel], np.diag([xx, yy, xx]), self.of_wheel[wheel]
        for effect, carrier in (("luggage", "pitch"), ("handlebar_bag", "steer")):
            if effect in self.effects:
                mass, x, z = (self.of(effect, key) for key in ("mass", "x", "z"))
                yield mass, _point(x, z), np.zeros((3, 3)), carrier
        moved = []  # mass, centre, inertia, the hinge that carries it, and the one that held it
        for effect, carrier, held_by in (("rider_saddle", self.seat, "pitch"), ("rider_lean", "rider_lean", self.seat)):
            if effect in self.effects:
                rider = {key: self.of(effect, key) for key in ("mass", "x", "z", "Ixx", "Izz", "Ixz")}
                mass, of_inertia = (self.p.get(f"{effect}.{key}_share", 1.0) for key in ("mass", "inertia"))
                mass = mass * rider["mass"]
                centre, inertia = _point(rider["x"], rider["z"]), of_inertia * self._inertia("I", rider)
                moved.append((mass, centre, inertia, carrier, held_by))
        if "rider_hands" in self.effects:
            for side in (-1, 1):
                hand = _point(self.of("rider_hands", "x"), self.of("rider_hands", "z"))
                hand = hand + side * self.of("rider_hands", "half_width") * Y
                moved.append((self.of("rider_hands", "mass") / 2, hand, np.zeros((3, 3)), "arms", "pitch"))
        for mass, centre, inertia, carrier, held_by in moved:
            yield mass, centre, inertia, carrier
            yield -mass, centre, -inertia, held_by

    def _extra_states(self) -> Any:
        for effect in ("aligning_moment", "contact_length"):
            if effect in self.effects:
                yield from (f"{wheel}_aligning_moment" for wheel in WHEELS)
        for effect, states in (
            ("steer_motor", ("steer_motor_torque",)), ("rider_control", ("rider_torque", "rider_torque_rate")),
            ("rider_delay", ("rider_lag", "rider_lag_rate")), ("rider_steer_memory", ("steer_integral",)),
        ):  # fmt: skip
            if effect in self.effects:
                yield from states

    @staticmethod
    def _inertia(name: str, p: Mapping[str, float]) -> Array:
        xx, zz, xz = (p[name + axes] for axes in ("xx", "zz", "xz"))
        return np.array([[xx, 0, xz], [0, p.get(name + "yy", 0.0), 0], [xz, 0, zz]])

    def _moved(self, q: Array, u: Array, a: Array, along: tuple[float, float]) -> dict[str, Any]:
        """Motion of what each hinge carries: turn, origin, and their rates; coordinates are y and the hinges."""
        still = (0 * q[0], 0 * q[0], 0 * q[0])
        places = dict(zip(self.names, zip(q[1:], u[1:], a[1:], strict=True), strict=True)) | {"pitch": still}
        ground = (
            np.eye(3)[..., None], q[0] * Y, NOWHERE, NOWHERE, along[0] * X + u[0] * Y, along[1] * X + a[0] * Y, {},
        )  # fmt: skip
        moved: dict[str, Any] = {"": ground}
        for name, (axis, pivot, carrier) in self.hinges.items():
            turn, origin, omega, alpha, velocity, acceleration, chain = moved[carrier]
            angle, rate, second = places[name]
            world, arm = _turned(turn, axis), _turned(turn, pivot)
            at = origin + arm
            velocity = velocity + _cross(omega, arm)
            acceleration = acceleration + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
            alpha = alpha + second * world + _cross(omega, rate * world)
            omega, turn = omega + rate * world, np.einsum("ij...,jk...->ik...", turn, _rotation(axis, angle))
            arm = -_turned(turn, pivot)
            velocity = velocity + _cross(omega, arm)
            acceleration = acceleration + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
            moved[name] = (turn, at + arm, omega, alpha, velocity, acceleration, {**chain, name: (world, at)})
        return moved

    def _contact(self, moved: dict[str, Any], wheel: str) -> tuple[Array, Array, Array, Any, Any, Any]:
        """Point of a wheel on the ground, its track, across it, camber, slip velocity and rate of yaw."""
        crown, radius = self.of("crown_radius", f"crown_radius.{wheel}"), self.radii[wheel]
        turn, origin, omega, _, velocity, _, _ = moved[self.of_wheel[wheel]]
        axle = _turned(turn, Y)
        down = Z - axle[2] * axle
        arm = _turned(turn, self.centres[wheel]) + (radius - crown) * down / np.sqrt(_dot(down, down)) + crown * Z
        track = _cross(axle, Z)
        track = track / np.sqrt(_dot(track, track))
        across = _cross(Z, track)
        slip = _dot(velocity + _cross(omega, arm), across)
        return origin + arm, track, across, np.arcsin(axle[2]), slip, omega[2]

    def slips(self, q: Array, u: Array, speed: float) -> Array:
        """Slip velocities (2, ...) of both wheels at a speed (m/s)."""
        moved = self._moved(q, u, 0 * q, (speed, 0.0))
        return np.array([self._contact(moved, wheel)[4] for wheel in WHEELS])

    def residual(self, q: Array, u: Array, a: Array, f: Array, e: Array, wind: Any) -> tuple[Array, Array, Array]:
        """Rows of the coordinates, then x, z and pitch; of the tyres, with the lateral forces ``f``; rates of ``e``."""
        p, v = self.p, self.v
        moved = self._moved(q, u, a, (v, self.acceleration))
        heading = np.cos(q[1]) * X + np.sin(q[1]) * Y
        sideways = _cross(Z, heading)
        slope = np.arctan(self.of("longitudinal", "gradient"))
        gravity = p["g"] * (np.cos(slope) * Z - np.sin(slope) * heading)
        rows = dict.fromkeys(("x", "y", "z", *self.hinges), 0 * q[0])

        def act(name: str, force: Array, point: Array, moment: Array = NOWHERE) -> None:
            for key, unit in (("x", X), ("y", Y), ("z", Z)):
                rows[key] = rows[key] - _dot(force, unit)
            for key, (axis, at) in moved[name][-1].items():
                rows[key] = rows[key] - _dot(force, _cross(axis, point - at)) - _dot(moment, axis)

        for mass, centre, inertia, name in self.bodies:
            turn, origin, omega, alpha, _, acceleration, _ = moved[name]
            arm = _turned(turn, centre)
            second = acceleration + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
            spin, change = (_turned(turn, np.tensordot(inertia, _back(turn, of), 1)) for of in (omega, alpha))
            act(name, mass * (gravity - second), origin + arm, -(change + _cross(omega, spin)))
        for name, per_speed, fixed in self.spins:
            turn, origin, omega = moved[name][:3]
            axle = _turned(turn, Y)
            change = per_speed * self.acceleration * axle + _cross(omega, (per_speed * v + fixed) * axle)
            act(name, NOWHERE, origin, -change)

        brake, share = self.of("longitudinal", "brake_force"), self.of("longitudinal", "front_share")
        along = [self.of("longitudinal", "drive_force") - (1 - share) * brake, -share * brake]
        if "aerodynamic_drag" in self.effects:
            along[0] += self.of("aerodynamic_drag", "air_density") * self.of("aerodynamic_drag", "drag_area") * v**2 / 2
            act("pitch", *self._air(moved["pitch"], wind * sideways, heading, sideways))

        state = dict(zip(self.extra, e, strict=True))
        law, rates = [], dict.fromkeys(self.extra, 0 * q[0])
        front_place = 0 * q[0]
        for k, wheel in enumerate(WHEELS):
            point, track, across, camber, slip, yaw_rate = self._contact(moved, wheel)
            front_place = point[1]
            of_camber = self.of("camber_thrust", f"camber_stiffness.{wheel}") * camber
            lagged = self.of("camber_thrust", "lag_share") * of_camber
            side = f[k] + of_camber - lagged
            own = state.get(f"{wheel}_aligning_moment", 0.0)
            moment = own - self.of("pneumatic_trail", f"trail.{wheel}") * side
            moment = moment + self.of("twisting_torque", f"twisting_stiffness.{wheel}") * camber
            overturning = -self.of("overturning_moment", f"overturning_stiffness.{wheel}") * camber
            overturning = overturning - self.of("overturning_moment", f"arm.{wheel}") * side
            force = side * across + along[k] * track - self.loads[k] * Z
            act(self.of_wheel[wheel], force, point, moment * Z + overturning * track)
            law.append(self._tyre(wheel, slip, f[k] - lagged, own))
            if f"{wheel}_aligning_moment" in state:
                rates[f"{wheel}_aligning_moment"] = self._moment_rate(wheel, slip, yaw_rate, f[k] - lagged, own)
        torques = self._torques(dict(zip(self.names, q[1:], strict=True)), dict(zip(self.names, u[1:], strict=True)),
                                dict(zip(self.names, a[1:], strict=True)), state, front_place, rates)  # fmt: skip
        for name, torque in torques.items():
            rows[name] = rows[name] - torque
        order = ("y", *self.names, "x", "z", "pitch")
        of_states = np.array([rates[key] for key in self.extra]).reshape(len(self.extra), q.shape[1])
        return np.array([rows[key] for key in order]), np.array(law), of_states

    def _air(self, frame: Any, wind: Array, heading: Array, sideways: Array) -> tuple[Array, Array, Array]:
        """Force of the air, where it acts, and its moment."""
        area, density, side_area, moment_area, x, z = (
            self.of("aerodynamic_drag", key)
            for key in ("drag_area", "air_density", "side_area", "yaw_moment_area", "centre_of_pressure_x",
                        "centre_of_pressure_z")
        )  # fmt: skip
        turn, origin, omega, _, velocity, _, _ = frame
        arm = _turned(turn, _point(x, z))
        blown = wind - velocity - _cross(omega, arm)
        fast = np.sqrt(_dot(blown, blown))
        pressure = density * fast**2 / 2
        beta = np.arctan(_dot(blown, sideways) / -_dot(blown, heading))
        force = pressure * (area * blown / fast + side_area * beta * _cross(Z, -blown) / fast)
        return force, origin + arm, pressure * moment_area * beta * Z

    def _lengths(self, wheel: str) -> tuple[float, float, float]:
        """Cornering stiffness of a wheel, its relaxation length, and that with rim and spokes in series."""
        stiffness, length = (
            self.of("relaxation_length", f"{key}.{wheel}") for key in ("cornering_stiffness", "relaxation_length")
        )
        rim = 1 / self.of("wheel_compliance", f"stiffness.{wheel}") if "wheel_compliance" in self.effects else 0.0
        return stiffness, length, length + stiffness * rim

    def _trail(self, wheel: str) -> float:
        """Trail of a string in contact from +a to -a whose free ends decay over sigma = L - a."""
        length = self._lengths(wheel)[1]
        free = length - self.of("contact_length", f"half_length.{wheel}")
        return (length**3 - free**3) / (3 * length**2)

    def _tyre(self, wheel: str, slip: Any, force: Any, moment: Any) -> Any:
        """Rate of the lateral force that lags, or what is zero of one without lag; ``force`` is that of the slip."""
        if "relaxation_length" in self.effects:
            stiffness, _, whole = self._lengths(wheel)
            if "contact_length" in self.effects:
                return (self.v * moment / self._trail(wheel) - stiffness * slip) / whole
            return -(stiffness * slip + self.v * force) / whole
        return force + self.of("side_slip", f"cornering_stiffness.{wheel}") * slip / self.v

    def _moment_rate(self, wheel: str, slip: Any, yaw_rate: Any, force: Any, moment: Any) -> Any:
        if "aligning_moment" in self.effects:
            stiffness, length = (
                self.of("aligning_moment", f"{key}.{wheel}") for key in ("aligning_stiffness", "relaxation_length")
            )
            return (stiffness * slip - self.v * moment) / length
        turn_slip = -yaw_rate / self.v * self.of("contact_length", "turn_slip_share")
        stiffness, trail = self._lengths(wheel)[0], self._trail(wheel)
        return self.v * (trail * stiffness * turn_slip - force - moment / trail)

    def _torques(
        self, angle: dict[str, Any], rate: dict[str, Any], second: dict[str, Any], state: dict[str, Any],
        front_place: Any, rates: dict[str, Any],
    ) -> dict[str, Any]:  # fmt: skip
        """Torques on the hinges; what a motor or a rider does goes into the ``rates`` of their states as well."""
        lean, steer, v = angle["lean"], angle["steer"], self.v
        torques = dict.fromkeys(self.names, 0 * lean)
        sprung = (
            "front_compliance",
            "rear_compliance",
            "fork_bending",
            "rider_saddle",
            "rider_saddle_roll",
            "rider_lean",
        )
        for name in sprung:
            if name in torques:
                torques[name] = -self.of(name, "stiffness") * angle[name] - self.of(name, "damping") * rate[name]
        stiffness = self.of("steer_spring", "stiffness") + self.of("rider_arms", "stiffness")
        damping = self.of("steer_damper", "damping") + self.of("rider_arms", "damping")
        on_bar = -stiffness * steer - damping * rate["steer"] - self.of("rider_arms", "inertia") * second["steer"]
        if "rider_hands" in self.effects:
            k, c, grip_k, grip_c = (
                self.of("rider_hands", key) for key in ("stiffness", "damping", "grip_stiffness", "grip_damping")
            )
            grip = grip_k * (steer - angle["arms"]) + grip_c * (rate["steer"] - rate["arms"])
            torques["arms"] = grip - k * angle["arms"] - c * rate["arms"]
            on_bar = on_bar - grip
        if "unmodelled_torque" in self.effects:
            x = (v - self.of("unmodelled_torque", "middle_speed")) / self.of("unmodelled_torque", "speed_span")
            moving = {"lean": lean, "steer": steer, "lean_rate": rate["lean"], "steer_rate": rate["steer"]}
            sums = {
                hinge: sum(
                    np.polyval([self.of("unmodelled_torque", f"{hinge}_from_{name}{s}") for s in SERIES], x) * motion
                    for name, motion in moving.items()
                )
                for hinge in ("lean", "steer")
            }
            torques["lean"] = torques["lean"] + sums["lean"]
            on_bar = on_bar + sums["steer"]
        if "steer_assist" in self.effects:
            gain, fade, lean_gain = (self.of("steer_assist", key) for key in ("gain", "fade_speed", "lean_gain"))
            told = gain * (fade - v) * rate["lean"] if v < fade else lean_gain * (v - fade) * lean
            if "steer_motor" in self.effects:
                share, lag = self.of("steer_motor", "share"), self.of("steer_motor", "lag")
                rates["steer_motor_torque"] = (share * told - state["steer_motor_torque"]) / lag
                told = state["steer_motor_torque"]
            on_bar = on_bar + told
        if "rider_control" in self.effects:
            on_bar = on_bar + state["rider_torque"]
            self._steer_by_rider(angle, rate, state, front_place, rates)
        torques["steer"] = torques["steer"] + on_bar
        return torques

    def _steer_by_rider(
        self, angle: dict[str, Any], rate: dict[str, Any], state: dict[str, Any], front_place: Any,
        rates: dict[str, Any],
    ) -> None:  # fmt: skip
        told = self.of("rider_control", "roll") * angle["lean"] + self.of("rider_control", "steer") * angle["steer"]
        told = told + self.of("rider_control", "roll_rate") * rate["lean"]
        told = told + self.of("rider_control", "steer_rate") * rate["steer"]
        told = told + self.of("rider_path", "heading") * angle["yaw"]
        told = told + self.of("rider_path", "position") * front_place
        if "rider_steer_memory" in self.effects:
            rates["steer_integral"] = angle["steer"]
            told = told + self.of("rider_steer_memory", "gain") * state["steer_integral"]
        if "rider_delay" in self.effects:  # (1 - s T/2 + (s T)^2/12) z of (1 + s T/2 + (s T)^2/12) z = told
            delay, z, z_rate = self.of("rider_delay", "delay"), state["rider_lag"], state["rider_lag_rate"]
            z_second = (told - z - delay / 2 * z_rate) * 12 / delay**2
            rates["rider_lag"], rates["rider_lag_rate"] = z_rate, z_second
            told = z - delay / 2 * z_rate + delay**2 / 12 * z_second
        omega, zeta = self.of("rider_control", "filter_frequency"), self.of("rider_control", "filter_damping")
        rates["rider_torque"] = state["rider_torque_rate"]
        rates["rider_torque_rate"] = (
            omega**2 * (told - state["rider_torque"]) - 2 * zeta * omega * state["rider_torque_rate"]
        )

    def _steady(self) -> tuple[Array, float]:
        """Loads (N) and acceleration of straight running: the rows of x, z and pitch are linear in them."""
        n = 1 + len(self.names)
        zero = np.zeros((n, 1))

        def rows(rear: float, front: float, acceleration: float) -> Array:
            self.loads, self.acceleration = np.array([rear, front]), acceleration
            still = (zero, zero, zero, np.zeros((2, 1)), np.zeros((len(self.extra), 1)), np.zeros(1))
            return np.asarray(self.residual(*still)[0][n:, 0])

        start = rows(0.0, 0.0, 0.0)
        columns = [rows(1.0, 0.0, 0.0), rows(0.0, 1.0, 0.0), rows(0.0, 0.0, 1.0)]
        found = np.linalg.solve(np.column_stack(columns) - start[:, None], -start)
        return found[:2], float(found[2])

    def state_matrix(self) -> tuple[list[str], Array, Array]:
        """State names, state matrix, and input column of the side wind.

        States are [V, r, rates, angles, heading and place where a rider follows a path, states of effects, lateral
        forces that lag]; V is the velocity across the heading. Lateral forces that hold the slip velocities take V and
        r away.
        """
        n, m = 1 + len(self.names), len(self.extra)
        sizes = (n, n, n, 2, m, 1)
        steps = 1j * STEP * np.eye(sum(sizes))
        q, u, a, f, e, w = np.split(steps, np.cumsum(sizes)[:-1])
        rows, law, rates = self.residual(q, u, a, f, e, w[0])
        slopes = np.concatenate([rows[:n], law, rates]).imag / STEP
        of_q, of_u, of_a, of_f, of_e, of_w = np.split(slopes, np.cumsum(sizes)[:-1], axis=1)
        # y' = V + v psi, y'' = V' + v r + (dv/dt) psi
        of_heading = of_q[:, 1] + self.v * of_u[:, 0] + self.acceleration * of_a[:, 0]
        on_path = np.column_stack([of_heading, of_q[:, 0]])
        if "rider_path" not in self.effects:
            assert np.abs(on_path).max() < 1e-9 * np.abs(of_q).max(), "heading and place must not matter"
            on_path = on_path[:, :0]
        of_u[:, 1] += self.v * of_a[:, 0]
        on_motion = np.hstack([of_u, of_q[:, 2:], on_path, of_e])
        names = ["rear_lateral_velocity", "yaw_rate", *(f"{name}_rate" for name in self.names[1:]), *self.names[1:]]
        names += ["heading", "rear_position"][: on_path.shape[1]] + self.extra
        turning = np.eye(n - 2, len(names), 2)  # rates of the hinges' angles
        going = np.zeros((on_path.shape[1], len(names)))
        if len(going):  # heading' = r, place' = V + v psi
            going[0, names.index("yaw_rate")] = 1.0
            going[1, names.index("rear_lateral_velocity")], going[1, names.index("heading")] = 1.0, self.v

        forces, of_law, mass = of_f[:n], slice(n, n + 2), of_a[:n]
        right, known = -np.hstack([on_motion[:n], of_w[:n]]), np.vstack([turning, going])
        known = np.hstack([known, np.zeros((len(known), 1))])
        own, by_force = np.hstack([on_motion[n + 2 :], of_w[n + 2 :]]), of_f[n + 2 :]
        tyre = np.hstack([on_motion[of_law], of_w[of_law]])
        if "relaxation_length" in self.effects:  # columns of the two forces stand before that of the wind
            rows = np.vstack([np.linalg.solve(mass, right), known, own, tyre])
            force_columns = np.vstack([
                np.linalg.solve(mass, -forces), np.zeros((len(known), 2)), by_force, of_f[of_law],
            ])  # fmt: skip
            names += ["rear_lateral_force", "front_lateral_force"]
            return names, np.hstack([rows[:, :-1], force_columns]), rows[:, -1]
        if "side_slip" in self.effects:
            side = -np.linalg.solve(of_f[of_law], tyre)
            whole = np.vstack([np.linalg.solve(mass, right - forces @ side), known, own + by_force @ side])
            return names, whole[:, :-1], whole[:, -1]
        # held: S x = 0, S_u u' + S_q q' + (dv/dt) dS/dv x = 0, and V and r follow from all else
        slip, faster = (self._slip_slopes(speed, len(names)) for speed in (self.v, self.v + 1))
        moving = np.zeros((2, right.shape[1]))
        moving[:, :-1] = -slip[:, n : 2 * n - 2] @ turning - self.acceleration * (faster - slip)
        saddle = np.block([[mass, forces], [slip[:, :n], np.zeros((2, 2))]])
        whole = np.vstack([np.linalg.solve(saddle, np.vstack([right, moving]))[:n], known, own])[2:]
        follow = np.vstack([-np.linalg.solve(slip[:, :2], slip[:, 2:]), np.eye(len(names) - 2)])
        return names[2:], whole[:, :-1] @ follow, whole[:, -1]

    def _slip_slopes(self, speed: float, states: int) -> Array:
        """Slopes (2, states) of the slip velocities at a speed over [V, r, rates, angles], and zeros."""
        n = 1 + len(self.names)
        q, u = np.split(1j * STEP * np.eye(2 * n), 2)
        slopes = self.slips(q, u, speed).imag / STEP
        found = np.zeros((2, states))
        found[:, : 2 * n - 2] = np.hstack([slopes[:, n:], slopes[:, 2:n]])
        return found


SERIES = ("_curve", "_slope", "")


def _point(x: float, z: float) -> Array:
    return np.array([[x], [0.0], [z]])


def _dot(one: Array, other: Array) -> Array:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _cross(one: Array, other: Array) -> Array:
    (a, b, c), (d, e, f) = one, other
    return np.array([b * f - c * e, c * d - a * f, a * e - b * d])


def _turned(turn: Array, vector: Array) -> Array:
    return np.einsum("ij...,j...->i...", turn, vector)


def _back(turn: Array, vector: Array) -> Array:
    return np.einsum("ji...,j...->i...", turn, vector)


def _rotation(axis: Array, angle: Any) -> Array:
    x, y, z = axis[:, 0]
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    outer = np.multiply.outer
    return outer(np.eye(3), 1 + 0 * angle) + outer(cross, np.sin(angle)) + outer(cross @ cross, 1 - np.cos(angle))
