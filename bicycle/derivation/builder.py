"""The symbolic lateral model: effects add to a :class:`ModelBuilder`, which closes to E x' = F(v) x + B(v) u.

Base: four coordinates (lateral velocity of the rear contact, yaw rate, lean, steer) and two contact ports. The
equations of motion are

    M (du/dt + v r e_V) + v H u = -K q + Q,        u = [V, r, rates of the joints],  q = joint angles,

with M the kinetic-energy form, H the gyroscopic coupling of the spinning wheels, K the Hessian of
V2 = -g sum m_i z_i + sum N_k z_k, and Q what effects add. V = dy/dt - v psi replaces y and psi. Derived for a chain
of bodies (:mod:`bicycle.rigid_bodies`); with both contacts held it gives the equations of Meijaard et al. (2007).
"""

from typing import Any

import sympy as sp

from bicycle.derivation.closing import OpenModel, SymbolicModel, assemble, hold_contacts
from bicycle.derivation.ports import ContactLaw, Coordinate, Expression, Wheel
from bicycle.parameters import UNITS, bodies, static_loads
from bicycle.rigid_bodies import Body, Joint, displacement_row, height_hessian, lean_row, mass_matrix, yaw_row

SPEED = sp.Symbol("v", real=True)


class ModelBuilder:
    """The open model that effects extend in ``apply``. Everything added must be linear in the motion."""

    def __init__(self) -> None:
        self.speed = SPEED
        self.bicycle = {key: sp.Symbol(key, real=True) for key in UNITS}
        p = self.bicycle
        self.bodies: list[Body] = list(bodies(p))
        self.lean = Coordinate("lean", sp.Symbol("lean"), sp.Symbol("lean_rate"))
        self.steer = Coordinate("steer", sp.Symbol("steer"), sp.Symbol("steer_rate"))
        self.lateral_velocity, self.yaw_rate = sp.symbols("rear_lateral_velocity yaw_rate")
        self.torques = {"steer_torque": self.steer, "lean_torque": self.lean}
        self.contact_law: ContactLaw | None = None
        self.switches: dict[Expression, Expression] = {}
        self.extra_inertia: dict[tuple[str, str], Expression] = {}
        self._frame_joints: list[tuple[Joint, Coordinate]] = []
        self._coordinate_forces: list[tuple[Coordinate, Expression]] = []
        self._point_forces: list[tuple[str, Expression, Expression]] = []
        self._yaw_moments: list[tuple[str, Expression]] = []
        self.states: dict[Expression, Expression] = {}  # extra state -> its rate of change
        self.load_transfer: Expression = sp.S.Zero  # N, from the front contact to the rear
        self.drive_force: Expression = sp.S.Zero  # N, forward at the rear contact
        loads = static_loads(tuple(self.bodies), p["w"], p["g"])
        self.wheels = (self._wheel("rear", sp.S.Zero, p["rR"]), self._wheel("front", p["w"], p["rF"]))
        self._loads = dict(zip(self.wheels, loads, strict=True))

    # ------------------------------------------------------------------ what effects call

    def add_body(self, body: Body) -> None:
        """Add a rigid body to the rear frame (a joint may carry it)."""
        self.bodies.append(body)

    def add_joint(
        self, name: str, *, axis: tuple[Expression, Expression], point: tuple[Expression, Expression], carries: set[str]
    ) -> Coordinate:
        """Add a hinge with axis (x, z) through point (x, z), after the lean and before the steer axis."""
        coordinate = Coordinate(name, sp.Symbol(name), sp.Symbol(f"{name}_rate"))
        self._frame_joints.append((Joint(name, *axis, *point, frozenset(carries)), coordinate))
        return coordinate

    def add_torque(self, coordinate: Coordinate, torque: Expression) -> None:
        """Add a torque (N m) that acts on a joint angle, in terms of coordinates, rates, speed and states."""
        self._coordinate_forces.append((coordinate, torque))

    def add_inertia(self, coordinate: Coordinate, inertia: Expression) -> None:
        """Add a moment of inertia (kg m^2) that moves with one joint angle only."""
        key = (coordinate.name, coordinate.name)
        self.extra_inertia[key] = self.extra_inertia.get(key, sp.S.Zero) + inertia

    def add_yaw_moment(self, body: str, moment: Expression) -> None:
        """Add an external moment about the vertical (N m) on a body."""
        self._yaw_moments.append((body, moment))

    def lateral_offset(self, body: str, x: Expression, z: Expression) -> Expression:
        """Lateral displacement (m) of a point of a body out of the plane through the rear contact along the heading."""
        row = displacement_row(self._joints(), body, x, z)[2:]
        return sum((a * c.angle for a, c in zip(row, self._coordinates(), strict=True)), sp.S.Zero)

    def add_state(self, name: str) -> Expression:
        """Add a first-order state; set its rate with ``model.states[state] = ...``."""
        state = sp.Symbol(name)
        self.states[state] = sp.S.Zero
        return state

    def below(self, speed: Expression) -> Expression:
        """Return a symbol that is 1 at speeds below ``speed`` and 0 above."""
        indicator = sp.Symbol(f"below_{len(self.switches)}")
        self.switches[indicator] = speed
        return indicator

    # ------------------------------------------------------------------ closing

    def close(self) -> SymbolicModel:
        """Assemble the matrices once every effect has been applied."""
        if self.contact_law is None:
            raise ValueError("no contact law has been applied")
        law, v = self.contact_law, self.speed
        joints, coordinates = self._joints(), self._coordinates()
        angles, rates = [c.angle for c in coordinates], [c.rate for c in coordinates]
        velocities = [self.lateral_velocity, self.yaw_rate, *rates]

        mass = sp.Matrix(mass_matrix(self.bodies, joints))
        names = ["", "", *(c.name for c in coordinates)]
        for (row, column), inertia in self.extra_inertia.items():
            mass[names.index(row), names.index(column)] += inertia

        forces = {wheel: law.side_force(self, wheel) for wheel in self.wheels}
        generalised = self._generalised_forces(joints, coordinates)
        meaning = self._meaning(joints, coordinates)
        if not law.holds_contact:
            for wheel, force in forces.items():
                meaning[wheel.side_force] = force.xreplace(meaning)
        generalised = generalised.applyfunc(lambda entry: _resolve(entry, meaning))
        extra = list(self.states)
        extra_rates = sp.Matrix([_resolve(rate, meaning) for rate in self.states.values()])

        motion = [*velocities, *angles, *extra]
        inputs = [sp.Symbol(name) for name in self.input_names()]
        coriolis = v * mass[:, 0] * self.yaw_rate + self._gyroscopic(joints, velocities)
        stiffness = self._stiffness(joints, meaning)
        right = generalised - coriolis - stiffness * sp.Matrix(angles)
        outputs = self._outputs(meaning)
        rear_load, front_load = self._loads.values()
        rows = OpenModel(
            mass, right, sp.Matrix(rates), extra_rates, motion, inputs, outputs, v,
            (rear_load, front_load), self.load_transfer, self.switches,
        )  # fmt: skip
        if not law.holds_contact:
            return assemble(rows)
        slips = [meaning[wheel.slip_velocity] for wheel in self.wheels]
        return hold_contacts(rows, slips, [wheel.side_force for wheel in self.wheels])

    def input_names(self) -> tuple[str, ...]:
        """Inputs of the model: the two torques, a side force at the rear frame's mass centre, imposed slip angles."""
        slips = () if self.contact_law is not None and self.contact_law.holds_contact else ("rear_slip", "front_slip")
        return (*self.torques, "lateral_force", *slips)

    @staticmethod
    def _wheel(name: str, x: Expression, radius: Expression) -> Wheel:
        seen = ("slip_velocity", "camber", "yaw_rate", "side_force", "static_load")
        return Wheel(name, f"{name} wheel", x, radius, **{what: sp.Symbol(f"{name} {what}") for what in seen})

    def _joints(self) -> list[Joint]:
        p = self.bicycle
        everything = frozenset(body.name for body in self.bodies)
        lean = Joint("lean", 1, 0, 0, 0, everything)
        steer = Joint(
            "steer", sp.sin(p["lam"]), sp.cos(p["lam"]), p["w"] + p["c"], 0, frozenset(("front frame", "front wheel"))
        )
        return [lean, *(joint for joint, _ in self._frame_joints), steer]

    def _coordinates(self) -> list[Coordinate]:
        return [self.lean, *(coordinate for _, coordinate in self._frame_joints), self.steer]

    def _meaning(self, joints: list[Joint], coordinates: list[Coordinate]) -> dict[Expression, Expression]:
        """Slip velocity, yaw rate, camber and static load of each wheel in terms of the motion."""
        velocities = sp.Matrix([self.lateral_velocity, self.yaw_rate, *(c.rate for c in coordinates)])
        angles = sp.Matrix([c.angle for c in coordinates])
        meaning = {}
        for wheel in self.wheels:
            row = sp.Matrix([list(displacement_row(joints, wheel.body, wheel.x, 0))])
            heading = sp.Matrix([list(yaw_row(joints, wheel.body)[2:])])
            slip = (row * velocities)[0] - self.speed * (heading * angles)[0]
            if f"{wheel.name}_slip" in self.input_names():
                slip -= self.speed * sp.Symbol(f"{wheel.name}_slip")
            meaning[wheel.slip_velocity] = slip
            meaning[wheel.yaw_rate] = (sp.Matrix([list(yaw_row(joints, wheel.body))]) * velocities)[0]
            meaning[wheel.camber] = (sp.Matrix([list(lean_row(joints, wheel.body)[2:])]) * angles)[0]
            meaning[wheel.static_load] = self._loads[wheel]
        return meaning

    def _generalised_forces(self, joints: list[Joint], coordinates: list[Coordinate]) -> Any:
        total = sp.zeros(2 + len(joints), 1)
        for wheel in self.wheels:
            total += sp.Matrix(displacement_row(joints, wheel.body, wheel.x, 0)) * wheel.side_force
            total += sp.Matrix(yaw_row(joints, wheel.body)) * wheel.moment
        for body, moment in self._yaw_moments:
            total += sp.Matrix(yaw_row(joints, body)) * moment
        rear = self.wheels[0]  # a toroidal tyre leaning by gamma touches the ground rho gamma beside its mid-plane
        contact_shift = rear.crown_radius * rear.camber
        total -= sp.Matrix(yaw_row(joints, rear.body)) * self.drive_force * contact_shift
        for coordinate, torque in self._coordinate_forces:
            total[2 + coordinates.index(coordinate)] += torque
        for name, coordinate in self.torques.items():
            total[2 + coordinates.index(coordinate)] += sp.Symbol(name)
        frame = self.bodies[0]
        return total + sp.Matrix(displacement_row(joints, frame.name, frame.x, frame.z)) * sp.Symbol("lateral_force")

    def _gyroscopic(self, joints: list[Joint], velocities: list[Expression]) -> Any:
        """Rate of change of the wheels' spin momentum h = -Iyy v / r (about +y), on the left side."""
        total = sp.zeros(len(velocities), 1)
        for body in self.bodies:
            if body.spin_inertia == 0:
                continue
            momentum = -body.spin_inertia * self.speed / body.radius
            tx, tz = sp.Matrix(lean_row(joints, body.name)), sp.Matrix(yaw_row(joints, body.name))
            motion = sp.Matrix(velocities)
            total += momentum * (tz * (tx.T * motion)[0] - tx * (tz.T * motion)[0])
        return total

    def _stiffness(self, joints: list[Joint], meaning: dict[Expression, Expression]) -> Any:
        """Hessian of V2 = -g sum m z + sum N z_lowest (physics: weight against the static contact loads)."""
        n = len(joints)
        total = sp.zeros(n, n)
        for body in self.bodies:
            total -= self.bicycle["g"] * body.mass * sp.Matrix(height_hessian(joints, body.name, body.x, body.z))
        for wheel, sign in zip(self.wheels, (1, -1), strict=True):
            load = meaning[wheel.static_load] + sign * self.load_transfer
            camber = sp.Matrix(lean_row(joints, wheel.body)[2:])
            lowest = sp.Matrix(height_hessian(joints, wheel.body, wheel.x, -wheel.radius))
            lowest -= (wheel.radius - wheel.crown_radius) * camber * camber.T
            total += load * lowest
        return sp.Matrix.vstack(sp.zeros(2, n), total)  # lateral motion and yaw do not change V2

    def _outputs(self, meaning: dict[Expression, Expression]) -> dict[str, Expression]:
        """Named outputs; ``d_`` symbols stand for the rate of change of a state."""
        outputs = {c.name: c.angle for c in self._coordinates()}
        outputs |= {f"{c.name}_rate": c.rate for c in self._coordinates()}
        outputs["yaw_rate"] = self.yaw_rate
        outputs["rear_lateral_velocity"] = self.lateral_velocity
        if self.contact_law is not None and not self.contact_law.holds_contact:
            for wheel in self.wheels:
                outputs[f"{wheel.name}_side_force"] = _resolve(wheel.side_force, meaning)
        return outputs


def _resolve(expression: Expression, meaning: dict[Expression, Expression]) -> Expression:
    """Replace port symbols by the motion; twice, because a force may contain a slip velocity."""
    return sp.sympify(expression).xreplace(meaning).xreplace(meaning)
