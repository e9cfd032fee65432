"""Equations of a standing bicycle: those of the model itself, and those of finite rotations of rigid bodies."""

import numpy as np
import pytest
from built import effect

from bicycle import Model, load_bicycle
from bicycle.effects import effect_class
from bicycle.equations import held_equations
from bicycle.parameters import hinge_at
from tests.validation.standing_bench import Stand


def test_it_is_the_linear_model_at_rest_without_the_load_of_the_wheel():
    """Rows and columns of lean and joints: M and C to the last digit, K but for the wheel that stands on its load."""
    bicycle = load_bicycle("pista")
    joint_x, joint_z = hinge_at(bicycle.values, 0.3)
    front = effect("front_compliance", stiffness=4200.0, damping=1.6, joint_x=joint_x, joint_z=joint_z)
    fork = effect("fork_bending", stiffness=4279.0, damping=2.7, length=0.1)
    law = effect("relaxation_length", cornering_stiffness=5000.0, relaxation_length=0.1)
    model = Model(bicycle, (front, fork, law))
    frame = held_equations((type(front), type(fork)))
    found = frame(model.parameters)
    linear = model.linear_model()
    matrices = linear.ranges[0].matrices
    names = frame.coordinates[2:]
    rates = [linear.states.index(f"{name}_rate") for name in names]
    angles = [linear.states.index(name) for name in names]
    force = matrices.dynamics[0]
    np.testing.assert_allclose(found.mass[0, 2:, 2:], matrices.mass[np.ix_(rates, rates)], rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(found.damping[0, 2:, 2:], -force[np.ix_(rates, rates)], rtol=1e-14)
    load = -force[np.ix_(rates, angles)] - found.stiffness[0, 2:, 2:] - found.weight[0, 2:, 2:]
    ground = found.displacement("wheel", np.array([bicycle["w"]]), np.zeros(1))[0, 2:]
    place = names.index("front_compliance")
    assert load[place, place] == pytest.approx(bicycle.static_loads[1] * ground[place] * np.cos(bicycle["lam"]))


@pytest.mark.parametrize("height", [0.2, 0.35, 0.55])
def test_it_agrees_with_finite_rotations(height):
    """Inertia, weight and displacement of the front on its hinge, and of the frame in its hold."""
    bicycle = load_bicycle("browser")
    stand = Stand(bicycle.values, 4000.0, 10.0, height, 2e4, 3e5)
    joint_x, joint_z = hinge_at(bicycle.values, height)
    hinge = {"stiffness": 4000.0, "damping": 10.0, "joint_x": joint_x, "joint_z": joint_z, "axis_tilt": bicycle["lam"]}
    values = {**bicycle.values, **{f"front_compliance.{name}": number for name, number in hinge.items()}}
    frame = held_equations((effect_class("front_compliance"),))
    found = frame(values)
    mass, _, stiffness = stand.matrices(upright=True)
    order = [frame.coordinates.index(name) for name in ("y", "lean", "yaw", "front_compliance")]
    # the coordinates of the frame: about its hold there, about the rear contact here
    x, up = stand.hold[0] * bicycle["w"], stand.hold[1]
    turn = np.eye(4)
    turn[0, 1], turn[0, 2] = -up, -x
    expected = turn.T @ found.mass[0][np.ix_(order, order)] @ turn
    np.testing.assert_allclose(mass, expected, rtol=1e-6, atol=1e-6)
    front = frame.coordinates.index("front_compliance")
    whole = found.stiffness[0, front, front] + found.weight[0, front, front]
    assert stiffness[3, 3] == pytest.approx(whole, rel=1e-6)
