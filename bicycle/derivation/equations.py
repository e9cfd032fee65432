"""The equations of an open model: mass matrix, gyroscopic coupling, stiffness and generalised forces, closed.

The symbols and the physics are those of :mod:`bicycle.derivation.builder`, which collects what stands here.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy as sp

from bicycle.derivation.closing import OpenModel, SymbolicModel, assemble, hold_contacts
from bicycle.derivation.ports import Builder, Coordinate, Expression, Wheel
from bicycle.derivation.rows import Rows
from bicycle.derivation.symbolic_polynomial import SymbolicPolynomial
from bicycle.parameters import static_loads
from bicycle.rigid_bodies import Joint, Row, displacement_row, height_hessian, inertia_terms, lean_row, yaw_row


def equations(model: Builder, side_forces: Mapping[Wheel, Expression]) -> SymbolicModel:
    """Assemble the matrices of an open model.

    Parameters
    ----------
    model : ModelBuilder
        With everything that the effects add.
    side_forces : mapping of Wheel to expression
        What the contact law gives at each contact, N; of no meaning where it holds the contacts.

    Returns
    -------
    SymbolicModel
    """
    joints, coordinates = model.joints(), model.coordinates()
    holds = model.contact_law.holds_contact
    held = [wheel.side_force for wheel in model.wheels] if holds else []
    velocities = [model.lateral_velocity, model.yaw_rate, *(c.rate for c in coordinates)]
    angles = [c.angle for c in coordinates]
    motion = [*velocities, *angles, *model.rates]
    inputs = [*map(sp.Symbol, model.input_names()), *held]

    loads = dict(zip((wheel.static_load for wheel in model.wheels), _loads(model), strict=True))
    meaning = _meaning(model, joints) | ({} if holds else {w.side_force: force for w, force in side_forces.items()})
    rows = Rows([*motion, *inputs], meaning, loads, model.speed)

    # M (du/dt + v r e_V) + v H u = -K q + Q: what stands beside M du/dt goes to the right
    mass, n, width = _mass(model, joints), len(velocities), len(motion) + len(inputs)
    turning = mass.columns(slice(0, 1)).placed(1, n)  # M e_V r
    gyroscopic = SymbolicPolynomial.of_matrix(_gyroscopic(model, joints))
    stiffness = SymbolicPolynomial.of_entries(_stiffness(model, joints).xreplace(loads), model.speed)
    right = (
        _generalised_forces(model, joints, rows)
        - (turning + gyroscopic).times_speed().placed(0, width)
        - stiffness.placed(n, width)
    )
    outputs = _outputs(model)
    open_model = OpenModel(
        mass, right, rows.of([c.rate for c in coordinates]), rows.of(list(model.rates.values())),
        rows.of(list(outputs.values())), motion, inputs, tuple(outputs), _loads(model), model.load_transfer,
        model.switches, model.states, tuple(model.modes.values()), model.units(),
    )  # fmt: skip
    if holds:
        open_model = hold_contacts(open_model, rows.of([wheel.slip_velocity for wheel in model.wheels]))
    return assemble(open_model)


def _meaning(model: Builder, joints: list[Joint]) -> dict[Expression, Expression]:
    """Slip velocity, yaw rate and camber of each wheel, and the motor's command, in terms of the motion."""
    rates = [model.lateral_velocity, model.yaw_rate, *(c.rate for c in model.coordinates())]
    angles = [c.angle for c in model.coordinates()]
    v, meaning = model.speed, {}
    for wheel in model.wheels:
        yaw = yaw_row(joints, wheel.body)
        heading = _dot(yaw[2:], angles)
        if f"{wheel.name}_slip" in model.input_names():
            heading += sp.Symbol(f"{wheel.name}_slip")
        meaning[wheel.slip_velocity] = _dot(displacement_row(joints, wheel.body, wheel.x, 0), rates) - v * heading
        meaning[wheel.yaw_rate] = _dot(yaw, rates)
        meaning[wheel.camber] = _dot(lean_row(joints, wheel.body)[2:], angles)
    meaning[model.motor.command] = model.motor.told
    return meaning


def _dot(row: Any, of: list[Expression]) -> Expression:
    return sp.Add(*(number * symbol for number, symbol in zip(row, of, strict=True)))


def _loads(model: Builder) -> tuple[Expression, Expression]:
    """Static loads of rear and front contact (N) under all bodies."""
    return static_loads(tuple(model.bodies), model.bicycle["w"], model.bicycle["g"])


def _mass(model: Builder, joints: list[Joint]) -> SymbolicPolynomial:
    """The kinetic-energy form M in the rates of [V, r, joints], with inertias that move with one joint only."""
    terms = [(inertia * one, other) for inertia, one, other in inertia_terms(model.bodies, joints)]
    names = [c.name for c in model.coordinates()]
    for (row, column), inertia in model.extra_inertia.items():
        one, other = (_unit(2 + names.index(name), 2 + len(names)) for name in (row, column))
        terms.append((inertia * one, other))
    moved, moving = zip(*terms, strict=True)
    return _matrix(moved).T @ SymbolicPolynomial.of_matrix(_matrix(moving))


def _generalised_forces(model: Builder, joints: list[Joint], rows: Rows) -> SymbolicPolynomial:
    """Forces and moments of contacts, effects and inputs per velocity [V, r, rates of the joints]: virtual work."""
    coordinates, rear, frame = model.coordinates(), model.wheels[0], model.bodies[0]

    def about(coordinate: Coordinate) -> Row:
        return _unit(2 + coordinates.index(coordinate), 2 + len(coordinates))

    work = []
    for wheel in model.wheels:
        work.append((displacement_row(joints, wheel.body, wheel.x, 0), wheel.side_force))
        work.append((yaw_row(joints, wheel.body), wheel.moment))
    work += [(yaw_row(joints, body), moment) for body, moment in model.yaw_moments]
    # A toroidal tyre leaning by gamma touches the ground rho gamma beside its mid-plane.
    contact_shift = rear.crown_radius * rear.camber
    work.append((yaw_row(joints, rear.body), -model.drive_force * contact_shift))
    work += [(about(coordinate), torque) for coordinate, torque in model.coordinate_forces]
    work.append((about(model.steer), model.motor.torque))
    work += [(about(coordinate), sp.Symbol(name)) for name, coordinate in model.torques.items()]
    work.append((displacement_row(joints, frame.name, frame.x, frame.z), sp.Symbol("lateral_force")))
    displaced, forces = zip(*work, strict=True)
    return _matrix(displaced).T @ rows.of(forces)


def _gyroscopic(model: Builder, joints: list[Joint]) -> Any:
    """H of v H [V, r, rates of the joints]: rate of change of the wheels' spin momentum h = -Iyy v / r (about +y)."""
    total = sp.zeros(2 + len(joints))
    for body in model.bodies:
        if body.spin_inertia != 0:
            tx, tz = (_matrix([row(joints, body.name)]).T for row in (lean_row, yaw_row))
            total -= body.spin_inertia / body.radius * (tz * tx.T - tx * tz.T)
    return total


def _stiffness(model: Builder, joints: list[Joint]) -> Any:
    """Hessian of V2 = -g sum m z + sum N z_lowest (physics: weight against the static contact loads)."""
    n = len(joints)
    total = sp.zeros(n, n)
    for body in model.bodies:
        total -= model.bicycle["g"] * body.mass * _matrix(height_hessian(joints, body.name, body.x, body.z))
    for wheel, sign in zip(model.wheels, (1, -1), strict=True):
        load = wheel.static_load + sign * model.load_transfer
        camber = _matrix([lean_row(joints, wheel.body)[2:]])
        lowest = _matrix(height_hessian(joints, wheel.body, wheel.x, -wheel.radius))
        lowest -= (wheel.radius - wheel.crown_radius) * camber.T * camber
        total += load * lowest
    return sp.Matrix.vstack(sp.zeros(2, n), total)  # lateral motion and yaw do not change V2


def _outputs(model: Builder) -> dict[str, Expression]:
    """Named outputs: angles and rates of the joints, yaw rate, lateral velocity, side forces of contacts that slip."""
    outputs = {c.name: c.angle for c in model.coordinates()}
    outputs |= {f"{c.name}_rate": c.rate for c in model.coordinates()}
    outputs["yaw_rate"] = model.yaw_rate
    outputs["rear_lateral_velocity"] = model.lateral_velocity
    if not model.contact_law.holds_contact:
        outputs |= {f"{wheel.name}_side_force": wheel.side_force for wheel in model.wheels}
    return outputs


def _unit(place: int, length: int) -> Row:
    return np.array([int(k == place) for k in range(length)])


def _matrix(rows: Any) -> Any:
    return sp.Matrix([list(row) for row in rows])
