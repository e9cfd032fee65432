"""The open symbolic model of a bicycle: matrices, contacts that effects close, and the builder that effects use."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bicycle.equations.declarations import (
    Builder,
    ContactLaw,
    Coordinate,
    Declarations,
    Expression,
    Mode,
    Motor,
    State,
    Wheel,
)
from bicycle.equations.joint_tree import JointTree
from bicycle.equations.linear_rows import Rows
from bicycle.equations.symbolic_polynomial import SymbolicPolynomial
from bicycle.parameters import rigid_bodies
from bicycle.parameters.bicycle import UNITS, bodies, static_loads
from tyre.ground.door import library
from tyre.ground.errors import InputError, unknown

sp = library("sympy")


@dataclass(frozen=True)
class SymbolicModel:
    """E x' = F(v) x + B(v) u, y = C(v) x + D(v) u, symbolic; :mod:`bicycle.equations.evaluation` gives numbers."""

    states: tuple[str, ...]  # (n,) names of x
    inputs: tuple[str, ...]  # (k,) names of u
    outputs: tuple[str, ...]  # (o,) names of y; their units, and those of x and u, are in ``declared.units``
    parameters: tuple[str, ...]  # names: all of a bicycle, and those of effects that occur (``effect.key``)
    mass: Any  # E, sympy matrix (n, n)
    dynamics: SymbolicPolynomial  # F(v), (n, n)
    input_matrix: SymbolicPolynomial  # B(v), (n, k)
    output_matrix: SymbolicPolynomial  # C(v), (o, n)
    feedthrough: SymbolicPolynomial  # D(v), (o, k)
    static_loads: tuple[Expression, Expression]  # N, of rear and front contact, positive
    load_transfer: Expression  # N, that moves from the front contact to the rear
    switches: Mapping[Expression, Expression]  # symbol, 1 below a speed and 0 above -> that speed, m/s
    declared: Declarations  # states, modes and units


@dataclass(frozen=True)
class OpenModel:
    """Rows of the equations of a builder's model: a column for each of ``motion``, then for each of ``inputs``."""

    model: Builder  # the builder, with all effects applied
    # M, (j + 2, j + 2): j joints after lateral velocity and yaw rate; (j, j) once contacts are held
    mass: SymbolicPolynomial
    right: SymbolicPolynomial  # what M times the accelerations equals: forces N, moments N m
    angle_rates: SymbolicPolynomial  # (j, ...), rates of the joint angles, rad/s
    extra_rates: SymbolicPolynomial  # a row for each state of the effects: its rate of change
    output_rows: SymbolicPolynomial  # a row for each of ``outputs``
    motion: Sequence[Expression]  # symbols of the states: velocities, angles, states of the effects
    # symbols; with held contacts the two lateral forces, N, come last until they are eliminated
    inputs: Sequence[Expression]
    outputs: Sequence[str]  # names


def assemble(rows: OpenModel) -> SymbolicModel:
    """Matrices of rows as they stand."""
    model = rows.model
    states = tuple(model.states[str(state)] for state in rows.motion)
    rates = rows.right.stack_above(rows.angle_rates).stack_above(rows.extra_rates)
    n = len(states)
    _check_powers(rates, [f"the rate of the state {state.name!r}" for state in states])
    _check_powers(rows.output_rows, [f"the output {name!r}" for name in rows.outputs])
    mass = sp.eye(n)
    mass[: rows.mass.shape[0], : rows.mass.shape[0]] = rows.mass.constant
    occurring = [mass, *rates.coefficients.values(), *map(sp.sympify, model.switches.values())]
    symbols = set().union(*(expression.free_symbols for expression in occurring))
    of_motion, of_inputs = slice(0, n), slice(n, None)
    return SymbolicModel(
        states=tuple(state.name for state in states),
        inputs=tuple(map(str, rows.inputs)),
        outputs=tuple(rows.outputs),
        parameters=(*UNITS, *sorted(str(symbol) for symbol in symbols if "." in str(symbol))),
        mass=mass,
        dynamics=rates.columns(of_motion),
        input_matrix=rates.columns(of_inputs),
        output_matrix=rows.output_rows.columns(of_motion),
        feedthrough=rows.output_rows.columns(of_inputs),
        static_loads=model.static_loads(),
        load_transfer=model.load_transfer,
        switches=model.switches,
        declared=Declarations(states, tuple(model.modes.values()), model.units()),
    )


def hold_contacts(rows: OpenModel, slip_velocities: SymbolicPolynomial) -> OpenModel:
    """Eliminate V, r and the lateral forces f: slip velocities zero, test space orthogonal to the force ports.

    The rows are M u' = R x + P f with u = [V, r, rates w of the joints], the slip velocities S x = 0. These give [V, r]
    = -S_Vr^-1 S_y y in terms of all other motion and inputs y, hence x = X y and u' = T w' + D w + (dv/dt) X_v y:
    angles change at the rates w, and X with the speed. With W^t P = 0 the forces are gone:
    W^t M T w' = W^t (R X y - M D w - M (dv/dt) X_v y).
    """
    joints, width = rows.mass.shape[0] - 2, rows.right.shape[1] - 2
    rates, angles, remaining, forces = slice(0, joints), slice(joints, 2 * joints), slice(0, width), slice(width, None)
    if set(rows.right.columns(forces).coefficients) != {0}:
        raise InputError("an effect takes a lateral force times a power of the speed; with held contacts it must not")
    for states in rows.extra_rates.columns(forces).coefficients.values():
        state = rows.motion[-rows.extra_rates.shape[0] :][next(states.iter_items())[0][0]]
        raise InputError(
            f"the rate of the state {str(state)!r} depends on a lateral force, of which held contacts know nothing; "
            "give its effect requires = ('tyre force',)"
        )
    slips = slip_velocities.columns(remaining)
    lead = slips.columns(slice(0, 2)).constant
    followed = -lead.inv() @ slips.columns(slice(2, None))  # V and r in terms of all that remains
    full_motion = followed.stack_above(SymbolicPolynomial.of_matrix(sp.eye(width - 2)))

    ports = rows.right.columns(forces).constant
    test = sp.Matrix.vstack(-(ports[2:, :] * ports[:2, :].inv()).T, sp.eye(joints))
    trial = sp.Matrix.vstack(followed.columns(rates).constant, sp.eye(joints))
    drift = followed.columns(angles).place_columns(rates.start, width - 2)
    faster = sp.eye(2) * rows.model.acceleration
    drift += SymbolicPolynomial.of_entries(faster, rows.model.speed) @ followed.slope()
    free = rows.right.columns(remaining) @ full_motion - rows.mass.columns(slice(0, 2)) @ drift
    return replace(
        rows,
        mass=test.T @ rows.mass @ trial,
        right=test.T @ free,
        angle_rates=rows.angle_rates.columns(remaining) @ full_motion,
        extra_rates=rows.extra_rates.columns(remaining) @ full_motion,
        output_rows=rows.output_rows.columns(remaining) @ full_motion,
        motion=rows.motion[2:],
        inputs=rows.inputs[:-2],
    )


def _check_powers(rows: SymbolicPolynomial, names: Sequence[str]) -> None:
    for power in sorted(rows.coefficients.keys() - {-1, 0, 1, 2}):
        row = next(rows.coefficients[power].iter_items())[0][0]
        raise InputError(f"an effect makes {names[row]} depend on speed^{power}; equations hold v^-1 to v^2 only")


def equations(model: Builder, lateral_forces: Mapping[Wheel, Expression]) -> SymbolicModel:
    """Assemble the matrices of an open model."""
    joints, coordinates = model.joints(), model.coordinates()
    holds = model.contact_law.holds_contact
    rates, angles = [c.rate for c in coordinates], [c.angle for c in coordinates]
    velocities = [model.lateral_velocity, model.yaw_rate, *rates]
    motion = [*velocities, *angles, *model.rates]
    inputs = [*map(sp.Symbol, model.input_names()), *(wheel.lateral_force for wheel in model.wheels if holds)]

    loads = dict(zip((wheel.static_load for wheel in model.wheels), model.static_loads(), strict=True))
    meaning = _meaning(model, joints, velocities, angles) | (
        {} if holds else {w.lateral_force: f for w, f in lateral_forces.items()}
    )
    rows = Rows([*motion, *inputs], meaning, loads, model.speed)

    # M (du/dt + v r e_V) + H u = -K q + Q: what stands beside M du/dt goes to the right
    mass, n, width = _mass(model, joints), len(velocities), len(motion) + len(inputs)
    turning = mass.columns(slice(0, 1)).place_columns(1, n)  # M e_V r
    gyroscopic = SymbolicPolynomial.of_entries(_gyroscopic(model, joints), model.speed)
    turned = _stiffness(model, joints) + _forward_stiffness(model, joints)
    stiffness = SymbolicPolynomial.of_entries(turned.xreplace(loads), model.speed)
    right = (
        _generalised_forces(model, joints, rows)
        - (turning.times_speed() + gyroscopic).place_columns(0, width)
        - stiffness.place_columns(n, width)
    )
    outputs = {c.name: c.angle for c in coordinates} | {f"{c.name}_rate": c.rate for c in coordinates}
    outputs |= {"yaw_rate": model.yaw_rate, "rear_lateral_velocity": model.lateral_velocity}
    outputs |= {} if holds else {f"{wheel.name}_lateral_force": wheel.lateral_force for wheel in model.wheels}
    open_model = OpenModel(
        model,
        mass,
        right,
        rows.coefficients(rates),
        rows.coefficients(list(model.rates.values())),
        rows.coefficients(list(outputs.values())),
        motion,
        inputs,
        tuple(outputs),
    )
    if holds:
        open_model = hold_contacts(open_model, rows.coefficients([wheel.slip_velocity for wheel in model.wheels]))
    return assemble(open_model)


def _meaning(
    model: Builder, joints: list[rigid_bodies.Joint], velocities: list[Expression], angles: list[Expression]
) -> dict[Expression, Expression]:
    """What effects see, in terms of the motion: wheels, points of bodies, and the commands of motor and rider."""
    meaning = {}
    for wheel in model.wheels:
        yaw = rigid_bodies.yaw_row(joints, wheel.body)
        heading = _dot(yaw[2:], angles)
        if f"{wheel.name}_slip" in model.input_names():
            heading += sp.Symbol(f"{wheel.name}_slip")
        under = rigid_bodies.displacement_row(joints, wheel.body, wheel.x, 0)
        meaning[wheel.slip_velocity] = _dot(under, velocities) - model.speed * heading
        meaning[wheel.yaw_rate] = _dot(yaw, velocities)
        meaning[wheel.camber] = _dot(rigid_bodies.lean_row(joints, wheel.body)[2:], angles)
        meaning[wheel.offset] = _dot(under[2:], angles) + wheel.crown_radius * wheel.camber
    for symbol, point in model.points.items():
        row = rigid_bodies.displacement_row(joints, point.body, point.x, point.z)
        meaning[symbol] = _dot(row[2:], angles) if point.what == "offset" else _dot(row, velocities)
    meaning |= {source.command: source.commanded for source in (model.motor, model.rider)}
    return meaning


def _dot(row: Any, of: list[Expression]) -> Expression:
    return sp.Add(*(number * symbol for number, symbol in zip(row, of, strict=True)))


def _mass(model: Builder, joints: list[rigid_bodies.Joint]) -> SymbolicPolynomial:
    """The kinetic-energy form M in the rates of [V, r, joints], with inertias that move with one joint only."""
    terms = [
        (inertia * left_row, right_row)
        for inertia, left_row, right_row in rigid_bodies.inertia_terms(model.bodies, joints)
    ]
    for coordinate, inertia in model.extra_inertia:
        unit_row = _unit_row(model, coordinate)
        terms.append((inertia * unit_row, unit_row))
    left_rows, right_rows = zip(*terms, strict=True)
    return _matrix(left_rows).T @ SymbolicPolynomial.of_matrix(_matrix(right_rows))


def _generalised_forces(model: Builder, joints: list[rigid_bodies.Joint], rows: Rows) -> SymbolicPolynomial:
    """Forces and moments of contacts, effects and inputs per velocity [V, r, rates of the joints]: virtual work."""
    frame, work = model.body("rear frame"), []
    for wheel in model.wheels:
        work.append((rigid_bodies.displacement_row(joints, wheel.body, wheel.x, 0), wheel.lateral_force))
        work.append((rigid_bodies.yaw_row(joints, wheel.body), wheel.moment))
    work += [(rigid_bodies.yaw_row(joints, body), moment) for body, moment in model.yaw_moments]
    work += [(rigid_bodies.lean_row(joints, body), moment) for body, moment in model.roll_moments]
    torques = [*model.coordinate_forces, (model.steer, model.motor.torque), (model.steer, model.rider.torque)]
    torques += [(coordinate, sp.Symbol(name)) for name, coordinate in model.torques.items()]
    work += [(_unit_row(model, coordinate), torque) for coordinate, torque in torques]
    pushed = [*model.lateral_forces, (frame.name, frame.x, frame.z, sp.Symbol("lateral_push"))]
    work += [(rigid_bodies.displacement_row(joints, body, x, z), force) for body, x, z, force in pushed]
    displaced, forces = zip(*work, strict=True)
    return _matrix(displaced).T @ rows.coefficients(forces)


def _gyroscopic(model: Builder, joints: list[rigid_bodies.Joint]) -> Any:
    """H of H [V, r, rates of the joints]: rate of change of spin momenta -h about +y."""
    total = sp.zeros(2 + len(joints))
    for body, momentum in model.spins:
        tx, tz = (_matrix([row(joints, body)]).T for row in (rigid_bodies.lean_row, rigid_bodies.yaw_row))
        total -= momentum * (tz * tx.T - tx * tz.T)
    return total


def _stiffness(model: Builder, joints: list[rigid_bodies.Joint]) -> Any:
    """Hessian of V2 = -g sum m z + sum N z_lowest (physics: weight against the static contact loads)."""
    n = len(joints)
    total = sp.zeros(n, n)
    for body in model.bodies:
        total -= model.gravity * body.mass * _matrix(rigid_bodies.height_hessian(joints, body.name, body.x, body.z))
    for wheel in model.wheels:
        transfer = model.load_transfer if wheel.name == "rear" else -model.load_transfer
        load = wheel.static_load + transfer
        camber = _matrix([rigid_bodies.lean_row(joints, wheel.body)[2:]])
        lowest = _matrix(rigid_bodies.height_hessian(joints, wheel.body, wheel.x, -wheel.radius))
        lowest -= (wheel.radius - wheel.crown_radius) * camber.T * camber
        total += load * lowest
    return sp.Matrix.vstack(sp.zeros(2, n), total)  # lateral motion and yaw do not change V2


def _forward_stiffness(model: Builder, joints: list[rigid_bodies.Joint]) -> Any:
    """Turning of what acts along the road: forces of the contacts, what resists them, and spins that change."""
    total = sp.zeros(2 + len(joints), len(joints))
    for body in model.bodies if model.traction != 0 else ():
        total += (
            model.specific_force * body.mass * _matrix(rigid_bodies.forward_hessian(joints, body.name, body.x, body.z))
        )
    for wheel in model.wheels:
        if wheel.forward_force != 0:
            place, turn = (
                rigid_bodies.displacement_row(joints, wheel.body, wheel.x, 0),
                rigid_bodies.yaw_row(joints, wheel.body),
            )
            work = _matrix(rigid_bodies.forward_hessian(joints, wheel.body, wheel.x, 0))
            work += _matrix([place]).T * _matrix([turn[2:]])  # the force turns with its wheel
            # A toroidal tyre leaning by gamma touches the ground rho gamma beside its mid-plane.
            work -= wheel.crown_radius * _matrix([turn]).T * _matrix([rigid_bodies.lean_row(joints, wheel.body)[2:]])
            total -= wheel.forward_force * work
    for body, momentum in model.spins if model.acceleration != 0 else ():
        # torque dh/dt along the axle, on each axis by what the joints outside it turn of the axle
        tx, tz = rigid_bodies.lean_row(joints, body), rigid_bodies.yaw_row(joints, body)
        slope = sp.diff(momentum, model.speed) * model.acceleration
        total -= slope * _matrix(np.triu(np.outer(tz, tx[2:]) - np.outer(tx, tz[2:]), -1))
    return total


def _unit_row(model: Builder, coordinate: Coordinate) -> rigid_bodies.Row:
    """Unit row of one coordinate among [V, r, joints]."""
    return np.array([0, 0, *(int(candidate == coordinate) for candidate in model.coordinates())])


def _matrix(rows: Any) -> Any:
    return sp.Matrix([list(row) for row in rows])


def speed_symbol() -> Expression:
    """The forward speed, m/s: the same symbol whoever makes it."""
    return sp.Symbol("v", real=True)


class Point(NamedTuple):
    """What an effect asks for of a point of a body: its lateral ``offset`` (m) or ``speed`` (m/s)."""

    what: str  # ``offset`` (m) or ``speed`` (m/s), positive to the right
    body: str  # its name
    x: Expression  # m, forward of the rear contact
    z: Expression  # m, downward from the road


class ModelBuilder:
    """The open model that effects extend in ``apply``."""

    def __init__(self) -> None:
        self.speed = speed_symbol()
        self.bicycle = p = {key: sp.Symbol(key, real=True) for key in UNITS}
        self.bodies: list[rigid_bodies.Body] = list(bodies(p))
        self.lean = Coordinate("lean", sp.Symbol("lean"), sp.Symbol("lean_rate"))
        self.steer = Coordinate("steer", sp.Symbol("steer"), sp.Symbol("steer_rate"))
        self.lateral_velocity, self.yaw_rate = sp.symbols("rear_lateral_velocity yaw_rate")
        self.torques = {"steer_torque": self.steer, "lean_torque": self.lean}
        self.motor, self.rider = Motor(), Motor(sp.Symbol("rider command"))
        self.rider_joint, self.rider_body = "lean", ""  # that hold parts of a rider; "": the rear frame
        self.contact_law: ContactLaw | None = None
        self.switches: dict[Expression, Expression] = {}
        self.extra_inertia: list[tuple[Coordinate, Expression]] = []
        self._joints: list[rigid_bodies.Joint] = []  # of the effects
        self._coordinates = {"lean": self.lean, "steer": self.steer}
        self.points: dict[Expression, Point] = {}  # what effects ask for of points of bodies
        self.coordinate_forces: list[tuple[Coordinate, Expression]] = []
        self.yaw_moments: list[tuple[str, Expression]] = []
        self.roll_moments: list[tuple[str, Expression]] = []
        self.lateral_forces: list[tuple[str, Expression, Expression, Expression]] = []
        self.spins = [(b.name, b.spin_inertia * self.speed / b.radius) for b in self.bodies if b.spin_inertia != 0]
        self.inputs: dict[str, str] = {}  # of the effects, with their units
        self.gravity, self.slope = p["g"], sp.S.Zero  # m/s^2: weight per mass on the road, and along it downhill
        self.traction: Expression = sp.S.Zero  # N, forces of the contacts that all masses resist
        self.rates: dict[Expression, Expression | None] = {}  # extra state -> its rate of change
        self.states: dict[str, State] = {}
        self.modes: dict[str, Mode] = {}
        self._load_transfer: Expression = sp.S.Zero
        self.wheels = (self._wheel("rear", sp.S.Zero, p["rR"]), self._wheel("front", p["w"], p["rF"]))
        self._declare("rear_lateral_velocity", "m/s", "rear")
        self._declare("yaw_rate", "rad/s", "yaw")
        for coordinate in (self.lean, self.steer):
            self._declare_angle(coordinate.name, coordinate.name, joint=False)

    def add_body(self, body: rigid_bodies.Body) -> None:
        """Add a rigid body to the rear frame, or to what it is ``fixed_to`` (a joint may carry it); it has weight."""
        if body.name in [present.name for present in self.bodies]:
            raise InputError(f"two bodies are called {body.name!r}; give the effect's body a name of its own")
        self.bodies.append(body)
        if body.spin_inertia != 0:
            self.add_spin(body.name, body.spin_inertia * self.speed / body.radius)

    def add_joint(
        self,
        name: str,
        *,
        axis: tuple[Expression, Expression],
        point: tuple[Expression, Expression],
        carries: set[str],
        role: str = "",
        hangs_on: str = "lean",
    ) -> Coordinate:
        """Add a hinge whose parent is the frame (``lean``) or another joint by its name: on ``steer`` its axis steers.

        One that carries the front frame carries the steer axis.
        """
        self._declare_angle(name, role or name, joint=True)
        coordinate = Coordinate(name, sp.Symbol(name), sp.Symbol(f"{name}_rate"))
        self._joints.append(rigid_bodies.Joint(name, *axis, *point, frozenset(carries), hangs_on=hangs_on))
        self._coordinates[name] = coordinate
        return coordinate

    def seat_rider(self, joint: Coordinate, body: str) -> None:
        """Attach parts of a rider to a ``joint``; their mass is taken out of the ``body`` that it carries."""
        self.rider_joint, self.rider_body = joint.name, body

    def add_torque(self, coordinate: Coordinate, torque: Expression) -> None:
        """Add a torque (N m) that acts on a joint angle, in terms of coordinates, rates, speed and states."""
        self.coordinate_forces.append((coordinate, torque))

    def add_inertia(self, coordinate: Coordinate, inertia: Expression) -> None:
        """Add a moment of inertia (kg m^2) that moves with one joint angle only."""
        self.extra_inertia.append((coordinate, inertia))

    def add_yaw_moment(self, body: str, moment: Expression) -> None:
        """Add an external moment about the vertical (N m) on a body."""
        self.yaw_moments.append((body, moment))

    def add_roll_moment(self, body: str, moment: Expression) -> None:
        """Add an external moment about the forward axis (N m, > 0 leans to the right) on a body."""
        self.roll_moments.append((body, moment))

    def add_lateral_force(self, body: str, x: Expression, z: Expression, force: Expression) -> None:
        """Add a force to the right (N) at the point (``x``, ``z``) of a body."""
        self.lateral_forces.append((body, x, z, force))

    def add_spin(self, body: str, momentum: Expression) -> None:
        """Add a rotor across a body: its spin momentum (kg m^2/s), positive if it turns as the wheels do."""
        self.spins.append((body, momentum))

    def add_drive_force(self, force: Expression) -> None:
        """Add a force forward at the rear contact (N) that balances another, for example a drag."""
        self.wheel("rear").forward_force += force

    def add_traction(self, rear: Expression, front: Expression) -> None:
        """Add forces forward at the contacts (N) that accelerate all masses or keep them from rolling downhill."""
        for name, force in (("rear", rear), ("front", front)):
            self.wheel(name).forward_force += force
            self.traction += force

    def incline_road(self, gradient: Expression) -> None:
        """Let the road rise by ``gradient`` per length on the level; the fall line follows the heading."""
        if self.slope != 0:
            raise InputError("two effects set the slope of the road; leave one out")
        self.gravity = self.bicycle["g"] / sp.sqrt(1 + gradient**2)
        self.slope = self.gravity * gradient

    @property
    def specific_force(self) -> Expression:
        """Force along the road per mass (m/s^2) that the contacts give in addition to the drive against drag."""
        return self.traction / sum(body.mass for body in self.bodies)

    @property
    def acceleration(self) -> Expression:
        """Rate of change of the speed (m/s^2)."""
        return self.specific_force - self.slope

    @property
    def load_transfer(self) -> Expression:
        """Vertical load (N) that moves from the front contact to the rear: pitch moments over the wheelbase."""
        heights = sum(body.mass * -body.z for body in self.bodies)
        spins = sum(sp.diff(momentum, self.speed) for _, momentum in self.spins)
        pitch = self.specific_force * heights + self.acceleration * spins
        return self._load_transfer + pitch / self.bicycle["w"]

    def add_load_transfer(self, force: Expression) -> None:
        """Move vertical load (N) from the front contact to the rear."""
        self._load_transfer += force

    def add_input(self, name: str, *, unit: str) -> Expression:
        """Add an input of the model."""
        if name in self.units():
            raise InputError(f"the name {name!r} of an input is taken; give the effect's input a name of its own")
        self.inputs[name] = unit
        return sp.Symbol(name)

    def set_contact_law(self, law: ContactLaw) -> None:
        """Let ``law`` close both contacts; its effect declares ``slot = "contact law"``."""
        self.contact_law = law

    def lateral_offset(self, body: str, x: Expression, z: Expression) -> Expression:
        """Lateral displacement (m) of a point of a body out of the plane through the rear contact along the heading."""
        return self._ask(Point("offset", body, x, z))

    def lateral_speed(self, body: str, x: Expression, z: Expression) -> Expression:
        """Velocity (m/s) to the right of a point of a body, across the heading of the rear frame."""
        return self._ask(Point("speed", body, x, z))

    def _ask(self, point: "Point") -> Expression:
        """A symbol whose meaning is resolved once every joint is there, whichever effect brings it."""
        symbol = sp.Symbol(f"lateral {point.what} {len(self.points)}")
        self.points[symbol] = point
        return symbol

    def add_state(self, name: str, *, unit: str, role: str = "") -> Expression:
        """Add a first-order state; :meth:`set_rate` says how it changes."""
        self._declare(name, unit, role)
        state = sp.Symbol(name)
        self.rates[state] = None
        return state

    def set_rate(self, state: Expression, rate: Expression) -> None:
        """Say how a state of :meth:`add_state` changes, in its unit per second and linear in the motion."""
        self.rates[state] = rate

    def add_mode(self, mode: Mode) -> None:
        """Declare a mode (what an effect lists in ``modes``); two effects may bring the same."""
        if self.modes.setdefault(mode.name, mode) != mode:
            raise InputError(f"two effects declare the mode {mode.name!r} differently; give one of them another name")

    def below(self, speed: Expression) -> Expression:
        """Return a symbol that is 1 at speeds below ``speed`` and 0 above."""
        indicator = sp.Symbol(f"below_{len(self.switches)}")
        self.switches[indicator] = speed
        return indicator

    def close(self) -> SymbolicModel:
        """Assemble the matrices once every effect has been applied."""
        if self.contact_law is None:
            raise ValueError("no contact law has been applied")
        self._check_bodies()
        forces = {wheel: self.contact_law.lateral_force(self, wheel) for wheel in self.wheels}
        roles = sorted({state.role for state in self.states.values() if state.role})
        for mode in self.modes.values():
            if mode.marks[0] not in roles:
                raise InputError(
                    f"the mode {mode.name!r} is marked by states of the role {mode.marks[0]!r}, and there are none: "
                    f"the roles are {', '.join(roles)}; give a joint or a state of the effect that role"
                )
        for state, rate in self.rates.items():
            if rate is None:
                raise InputError(f"the state {str(state)!r} has no rate of change; give it one with model.set_rate")
        return equations(self, forces)

    def _check_bodies(self) -> None:
        """Refuse names of bodies that there are not, now that every effect has brought its own."""
        names = [body.name for body in self.bodies]
        uses = [(f"the body {body.name!r} is fixed to an", body.fixed_to) for body in self.bodies if body.fixed_to]
        for joint in self._joints:
            uses += [(f"the joint {joint.name!r} carries", body) for body in sorted(joint.carries)]
        uses += [("a moment about the vertical acts on an", body) for body, _ in self.yaw_moments]
        uses += [("a moment about the forward axis acts on an", body) for body, _ in self.roll_moments]
        uses += [("a lateral force acts on an", body) for body, *_ in self.lateral_forces]
        uses += [("a rotor is in an", body) for body, _ in self.spins]
        uses += [(f"the lateral {point.what} is asked of an", point.body) for point in self.points.values()]
        for use, body in uses:
            if body not in names:
                raise InputError(f"{use} {unknown('body', body, names)}")

    def input_names(self) -> tuple[str, ...]:
        """Torques, a lateral force at the rear frame's mass centre, imposed slip angles, and inputs of the effects."""
        slips = () if self.contact_law is not None and self.contact_law.holds_contact else ("rear_slip", "front_slip")
        return (*self.torques, "lateral_push", *slips, *self.inputs)

    @property
    def steer_axis(self) -> rigid_bodies.Joint:
        """The joint of the steering, which carries what the bicycle itself has there."""
        p, carried = self.bicycle, frozenset(("front frame", "front wheel"))
        axis = (sp.sin(p["lam"]), sp.cos(p["lam"]))
        return rigid_bodies.Joint("steer", *axis, p["w"] + p["c"], 0, carried, hangs_on="lean")

    def joints(self) -> list[rigid_bodies.Joint]:
        """Lean, the joints of the effects and steer, from the ground outward."""
        lean = rigid_bodies.Joint("lean", 1, 0, 0, 0, frozenset(body.name for body in self.bodies))
        return JointTree([lean, self.steer_axis, *self._joints], self.bodies).outward()

    def coordinates(self) -> list[Coordinate]:
        """Angle and rate of each of :meth:`joints`."""
        return [self._coordinates[joint.name] for joint in self.joints()]

    def body(self, name: str) -> rigid_bodies.Body:
        """A body by name."""
        return next(body for body in self.bodies if body.name == name)

    def wheel(self, name: str) -> Wheel:
        """The ``rear`` or ``front`` wheel."""
        return next(wheel for wheel in self.wheels if wheel.name == name)

    def units(self) -> dict[str, str]:
        """SI unit of every state, input and output by name."""
        units = {**dict.fromkeys(self.torques, "N m"), "lateral_push": "N", **self.inputs}
        units |= {f"{wheel.name}_slip": "rad" for wheel in self.wheels}
        units |= {f"{wheel.name}_lateral_force": "N" for wheel in self.wheels}
        return units | {state.name: state.unit for state in self.states.values()}

    def static_loads(self) -> tuple[Expression, Expression]:
        """Static loads of rear and front contact (N) under all bodies."""
        return static_loads(tuple(self.bodies), self.bicycle["w"], self.gravity)

    def _declare(self, name: str, unit: str, role: str, *, joint: bool = False) -> None:
        if name in self.states:
            raise InputError(f"two states are called {name!r}; give the effect's state a name of its own")
        if name in self.inputs:
            raise InputError(f"a state and an input are called {name!r}; give the effect's state a name of its own")
        self.states[name] = State(name, unit, role, joint)

    def _declare_angle(self, name: str, role: str, *, joint: bool) -> None:
        self._declare(name, "rad", role, joint=joint)
        self._declare(f"{name}_rate", "rad/s", role, joint=joint)

    @staticmethod
    def _wheel(name: str, x: Expression, radius: Expression) -> Wheel:
        quantities = ("slip_velocity", "camber", "yaw_rate", "offset", "lateral_force", "static_load")
        symbols = {quantity: sp.Symbol(f"{name} {quantity}") for quantity in quantities}
        return Wheel(name, f"{name} wheel", x, radius, **symbols)
