"""The equations of an open model: mass matrix, gyroscopic coupling, stiffness and generalised forces, closed.

The symbols and the physics are those of :mod:`bicycle.derivation.builder`, which collects what stands here.
"""

from typing import Any

import sympy as sp

from bicycle.derivation.closing import OpenModel, SymbolicModel, assemble, hold_contacts
from bicycle.derivation.ports import Builder, Coordinate, Expression, Wheel
from bicycle.parameters import static_loads
from bicycle.rigid_bodies import Joint, displacement_row, height_hessian, lean_row, mass_matrix, yaw_row


def equations(model: Builder, side_forces: dict[Wheel, Expression]) -> SymbolicModel:
    """Assemble the matrices of an open model.

    Parameters
    ----------
    model : ModelBuilder
        With everything that the effects add.
    side_forces : dict of Wheel to expression
        What the contact law gives at each contact, N; of no meaning where it holds the contacts.

    Returns
    -------
    SymbolicModel
    """
    law, v = model.contact_law, model.speed
    joints, coordinates = model.joints(), model.coordinates()
    angles, rates = [c.angle for c in coordinates], [c.rate for c in coordinates]
    velocities = [model.lateral_velocity, model.yaw_rate, *rates]

    mass = sp.Matrix(mass_matrix(model.bodies, joints))
    names = ["", "", *(c.name for c in coordinates)]
    for (row, column), inertia in model.extra_inertia.items():
        mass[names.index(row), names.index(column)] += inertia

    generalised = _generalised_forces(model, joints, coordinates)
    meaning = _meaning(model, joints, coordinates)
    if not law.holds_contact:
        for wheel, force in side_forces.items():
            meaning[wheel.side_force] = force.xreplace(meaning)
    generalised = generalised.applyfunc(lambda entry: _resolve(entry, meaning))
    extra_rates = sp.Matrix([_resolve(rate, meaning) for rate in model.rates.values()])

    motion = [*velocities, *angles, *model.rates]
    inputs = [sp.Symbol(name) for name in model.input_names()]
    coriolis = v * mass[:, 0] * model.yaw_rate + _gyroscopic(model, joints, velocities)
    stiffness = _stiffness(model, joints, meaning)
    right = generalised - coriolis - stiffness * sp.Matrix(angles)
    outputs = _outputs(model, meaning)
    rows = OpenModel(
        mass, right, sp.Matrix(rates), extra_rates, motion, inputs, outputs, v, _loads(model), model.load_transfer,
        model.switches, model.states, tuple(model.modes.values()), model.units(),
    )  # fmt: skip
    if not law.holds_contact:
        return assemble(rows)
    slips = [meaning[wheel.slip_velocity] for wheel in model.wheels]
    return hold_contacts(rows, slips, [wheel.side_force for wheel in model.wheels])


def _meaning(model: Builder, joints: list[Joint], coordinates: list[Coordinate]) -> dict[Expression, Expression]:
    """Slip velocity, yaw rate, camber and load of each wheel, and the motor's command, in terms of the motion."""
    velocities = sp.Matrix([model.lateral_velocity, model.yaw_rate, *(c.rate for c in coordinates)])
    angles = sp.Matrix([c.angle for c in coordinates])
    meaning = {}
    for wheel in model.wheels:
        row = sp.Matrix([list(displacement_row(joints, wheel.body, wheel.x, 0))])
        heading = sp.Matrix([list(yaw_row(joints, wheel.body)[2:])])
        slip = (row * velocities)[0] - model.speed * (heading * angles)[0]
        if f"{wheel.name}_slip" in model.input_names():
            slip -= model.speed * sp.Symbol(f"{wheel.name}_slip")
        meaning[wheel.slip_velocity] = slip
        meaning[wheel.yaw_rate] = (sp.Matrix([list(yaw_row(joints, wheel.body))]) * velocities)[0]
        meaning[wheel.camber] = (sp.Matrix([list(lean_row(joints, wheel.body)[2:])]) * angles)[0]
    meaning |= zip((wheel.static_load for wheel in model.wheels), _loads(model), strict=True)
    meaning[model.motor.command] = model.motor.told
    return meaning


def _loads(model: Builder) -> tuple[Expression, Expression]:
    """Static loads of rear and front contact (N) under all bodies."""
    return static_loads(tuple(model.bodies), model.bicycle["w"], model.bicycle["g"])


def _generalised_forces(model: Builder, joints: list[Joint], coordinates: list[Coordinate]) -> Any:
    """Forces and moments of contacts, effects and inputs per velocity [V, r, rates of the joints]."""
    total = sp.zeros(2 + len(joints), 1)
    for wheel in model.wheels:
        total += sp.Matrix(displacement_row(joints, wheel.body, wheel.x, 0)) * wheel.side_force
        total += sp.Matrix(yaw_row(joints, wheel.body)) * wheel.moment
    for body, moment in model.yaw_moments:
        total += sp.Matrix(yaw_row(joints, body)) * moment
    rear = model.wheels[0]  # a toroidal tyre leaning by gamma touches the ground rho gamma beside its mid-plane
    contact_shift = rear.crown_radius * rear.camber
    total -= sp.Matrix(yaw_row(joints, rear.body)) * model.drive_force * contact_shift
    for coordinate, torque in model.coordinate_forces:
        total[2 + coordinates.index(coordinate)] += torque
    total[2 + coordinates.index(model.steer)] += model.motor.torque
    for name, coordinate in model.torques.items():
        total[2 + coordinates.index(coordinate)] += sp.Symbol(name)
    frame = model.bodies[0]
    return total + sp.Matrix(displacement_row(joints, frame.name, frame.x, frame.z)) * sp.Symbol("lateral_force")


def _gyroscopic(model: Builder, joints: list[Joint], velocities: list[Expression]) -> Any:
    """Rate of change of the wheels' spin momentum h = -Iyy v / r (about +y), on the left side."""
    total = sp.zeros(len(velocities), 1)
    for body in model.bodies:
        if body.spin_inertia == 0:
            continue
        momentum = -body.spin_inertia * model.speed / body.radius
        tx, tz = sp.Matrix(lean_row(joints, body.name)), sp.Matrix(yaw_row(joints, body.name))
        motion = sp.Matrix(velocities)
        total += momentum * (tz * (tx.T * motion)[0] - tx * (tz.T * motion)[0])
    return total


def _stiffness(model: Builder, joints: list[Joint], meaning: dict[Expression, Expression]) -> Any:
    """Hessian of V2 = -g sum m z + sum N z_lowest (physics: weight against the static contact loads)."""
    n = len(joints)
    total = sp.zeros(n, n)
    for body in model.bodies:
        total -= model.bicycle["g"] * body.mass * sp.Matrix(height_hessian(joints, body.name, body.x, body.z))
    for wheel, sign in zip(model.wheels, (1, -1), strict=True):
        load = meaning[wheel.static_load] + sign * model.load_transfer
        camber = sp.Matrix(lean_row(joints, wheel.body)[2:])
        lowest = sp.Matrix(height_hessian(joints, wheel.body, wheel.x, -wheel.radius))
        lowest -= (wheel.radius - wheel.crown_radius) * camber * camber.T
        total += load * lowest
    return sp.Matrix.vstack(sp.zeros(2, n), total)  # lateral motion and yaw do not change V2


def _outputs(model: Builder, meaning: dict[Expression, Expression]) -> dict[str, Expression]:
    """Named outputs: angles and rates of the joints, yaw rate, lateral velocity, side forces of contacts that slip."""
    outputs = {c.name: c.angle for c in model.coordinates()}
    outputs |= {f"{c.name}_rate": c.rate for c in model.coordinates()}
    outputs["yaw_rate"] = model.yaw_rate
    outputs["rear_lateral_velocity"] = model.lateral_velocity
    if not model.contact_law.holds_contact:
        for wheel in model.wheels:
            outputs[f"{wheel.name}_side_force"] = _resolve(wheel.side_force, meaning)
    return outputs


def _resolve(expression: Expression, meaning: dict[Expression, Expression]) -> Expression:
    """Replace port symbols by the motion; twice, because a force may contain a slip velocity."""
    return sp.sympify(expression).xreplace(meaning).xreplace(meaning)
