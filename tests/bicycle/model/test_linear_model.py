"""The numeric model: names, limits of validity, inputs and outputs, conversion to control."""

from threading import get_ident

import numpy as np
import pytest
from built import built, effect, linear
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import LinearModel, Model
from bicycle.model import BATCH
from tests.shared.refusals import refuses
from tyre.ground import InputError

RELAXATION = {"cornering_stiffness": {"rear": 6302.5, "front": 6016.1}, "relaxation_length": 0.12}
SLIP = {"cornering_stiffness": 6000.0}


@pytest.fixture(scope="module")
def whipple():
    return linear()


@pytest.fixture(scope="module")
def tyred():
    return linear(relaxation_length=RELAXATION)


@pytest.fixture(scope="module")
def slipping():
    return linear(side_slip=SLIP)


def test_state_matrix_is_linear_in_speed_with_relaxation(tyred):
    low, middle, high = tyred.state_matrix([2.0, 5.0, 8.0])
    assert np.allclose(middle, (low + high) / 2, rtol=1e-12, atol=1e-12)
    assert set(tyred.coefficients[0]) == {0, 1}


def test_slip_without_relaxation_is_refused_at_rest(slipping):
    refuses("speed 0 m/s is not allowed with side_slip", slipping.eigenvalues, [0.0, 1.0])


@pytest.mark.parametrize("speed", [-1.0, np.nan, np.inf])
def test_speeds_that_make_no_sense_are_refused(whipple, speed):
    refuses("give finite speeds >= 0", whipple.state_matrix, [1.0, speed])


def test_scaling_of_forces_leaves_the_eigenvalues_alone(tyred):
    state, _, _ = tyred.matrices_at(5.0)
    assert_same_eigenvalues(np.linalg.eigvals(state), tyred.eigenvalues(5.0), rtol=1e-10, atol=1e-8)
    assert set(np.log2(tyred.scale) % 1) == {0.0}


def test_eigenvalues_keep_the_shape_of_the_speeds_and_are_sorted(tyred):
    speeds = np.array([[1.0, 9.0, 4.0], [3.0, 2.0, 30.0]])
    values = tyred.eigenvalues(speeds)
    assert values.shape == (2, 3, 8)
    assert (np.diff(values.real, axis=-1) >= 0).all()
    assert (values[1, 2] == tyred.eigenvalues(30.0)).all()


def test_control_selects_by_name_and_refuses_unknown_names(tyred):
    assert tyred.to_control(6.0).input_labels == ["steer_torque", "lean_torque"]
    system = tyred.to_control(6.0, inputs=["rear_slip"], outputs=["yaw_rate", "lean"])
    assert (system.ninputs, system.noutputs) == (1, 2)
    refuses("unknown input 'torque'; .*known: ", tyred.to_control, 6.0, inputs=["torque"])
    refuses("unknown output 'yawrate'; did you mean 'yaw_rate'", tyred.to_control, 6.0, outputs=["yawrate"])


def test_steady_turn_of_the_whipple_bicycle_obeys_its_rolling_constraint(whipple):
    # yaw rate = (v steer + trail rate) cos(lam) / w (Meijaard et al. 2007, eq. for yaw rate)
    _, _, outputs = whipple.matrices_at(7.0)
    row = outputs[whipple.outputs.index("yaw_rate")]
    cos = np.cos(np.pi / 10)
    expected = {"steer": 7.0 * cos / 1.02, "steer_rate": 0.08 * cos / 1.02, "lean": 0.0, "lean_rate": 0.0}
    assert dict(zip(whipple.states, row, strict=True)) == pytest.approx(expected)


def test_imposed_slip_pushes_towards_the_slip(tyred):
    # steady lateral force of a tyre held straight: F = C alpha, so dF/dt = (v/lambda) C alpha from rest
    _, inputs, _ = tyred.matrices_at(4.0)
    rate = inputs[tyred.states.index("rear_lateral_force"), tyred.inputs.index("rear_slip")]
    assert rate == pytest.approx(4.0 / 0.12 * 6302.5)


def test_a_right_lean_pushes_the_tyre_right(tyred):
    model = linear(relaxation_length=RELAXATION, camber_thrust={"camber_stiffness": 400.0})
    place = model.states.index("rear_lateral_force"), model.states.index("lean")
    assert model.matrices_at(5.0)[0][place] == pytest.approx(5.0 / 0.12 * 400.0)
    assert tyred.matrices_at(5.0)[0][place] == 0


def test_an_effect_is_refused_the_second_time():
    with pytest.raises(InputError, match="'side_slip' is given twice"):
        Model("benchmark", [effect("side_slip", **SLIP)] * 2)


def test_with_effect_replaces_a_contact_law_and_adds_others():
    damped = built(relaxation_length=RELAXATION).with_effect(effect("steer_damper", damping=1.0))
    assert [e.identifier for e in damped.effects] == ["relaxation_length", "steer_damper"]
    slipping = damped.with_effect(effect("side_slip", **SLIP))
    assert [e.identifier for e in slipping.effects] == ["side_slip", "steer_damper"]


def test_imposed_slip_acts_at_once_without_relaxation_and_not_at_all_with_it(slipping, tyred):
    # side slip: F = C alpha with C = 6000 N/rad, so the direct gain is C; a relaxing tyre has none
    direct = slipping.to_control(5.0, inputs=["rear_slip"], outputs=["rear_lateral_force", "lean"]).D
    assert direct[:, 0].tolist() == pytest.approx([6000.0, 0.0])
    assert not tyred.to_control(5.0, inputs=["rear_slip"], outputs=["rear_lateral_force"]).D.any()


@pytest.mark.parametrize(("asked", "own"), [({}, True), ({"threads": 1}, True), ({"threads": 2}, False)])
def test_other_threads_compute_eigenvalues_only_where_they_are_asked_for(whipple, monkeypatch, asked, own):
    seen = set()

    def spying(model, speeds):
        seen.add(get_ident())
        return build(model, speeds)

    build = LinearModel.state_matrix
    monkeypatch.setattr(LinearModel, "state_matrix", spying)
    whipple.eigenvalues(np.linspace(1.0, 9.0, 2 * BATCH), **asked)
    assert (seen == {get_ident()}) == own
