"""Many bicycles at once against one at a time, each built by itself and solved by LAPACK."""

import numpy as np
import pytest
from built import built, effect
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import Model, effect_class, load_bicycle
from bicycle.effects import effect_of
from bicycle.model import DescriptorStack, ModelFamily, eigenvalues
from tyre.ground import InputError

TYRE = effect("relaxation_length", cornering_stiffness=6000.0, relaxation_length=0.1)
RELAXED = Model("benchmark", TYRE)
MODELS = {
    "no slip": built(), "side slip": built(side_slip={"cornering_stiffness": 6000.0}), "relaxation": RELAXED,
    "drag": RELAXED.with_effect(effect("aerodynamic_drag", drag_area=0.6, centre_of_pressure_z=-1.1)),
}  # fmt: skip
SWITCHING = RELAXED.with_effect(effect("steer_assist", gain=8.0, fade_speed=6.0))
MASSES, TRAILS = np.linspace(60, 100, 5), np.linspace(0.03, 0.1, 5)


@pytest.mark.parametrize("name", MODELS)
def test_a_family_is_its_bicycles(name):
    model, speeds = MODELS[name], np.array([[1.0, 6.0, 14.0]])
    polynomial, refused = ModelFamily(model, ("mB", "c")).polynomials({"mB": MASSES, "c": TRAILS}, 5)
    assert not refused.any()
    roots = eigenvalues(polynomial(speeds))
    for k, (mass, trail) in enumerate(zip(MASSES, TRAILS, strict=True)):
        alone = Model(model.bicycle.replace(mB=float(mass), c=float(trail)), model.effects).linear_model()
        for mine in (roots[k], alone.eigenvalues(speeds[0])):
            assert_same_eigenvalues(mine, alone.eigenvalues(speeds[0]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("model", [*MODELS.values(), SWITCHING])
def test_state_matrices_are_those_of_each_model_on_both_sides_of_a_switch(model):
    """Parameters of effects for both wheels and for one; the switch moves with its parameter."""
    law = next(e.identifier for e in model.effects if e.slot == "contact law")
    numbers = {"c": TRAILS}
    if law != "no_slip":
        numbers |= {f"{law}.cornering_stiffness.front": np.linspace(3000.0, 9000.0, 5)}
    if model is SWITCHING:
        numbers |= {"steer_assist.fade_speed": np.linspace(4.0, 8.0, 5)}
    family, speeds = ModelFamily(model, tuple(numbers)), np.array([[2.0, 5.0, 6.0, 14.0]])
    stack = family.state_matrices(numbers, speeds)
    for k in range(5):
        alone = family.with_values({key: float(values[k]) for key, values in numbers.items()})
        np.testing.assert_allclose(stack[k], alone.linear_model().state_matrix(speeds[0]), rtol=1e-11, atol=1e-9)
    own = family.state_matrices(numbers, np.linspace(1.0, 9.0, 5)[:, None])
    np.testing.assert_allclose(own[2, 0], family.state_matrices(numbers, [[5.0]])[2, 0], rtol=1e-14)


def test_a_model_is_built_again_from_its_own_numbers():
    for model in (*MODELS.values(), SWITCHING):
        assert ModelFamily(model).with_values(model.parameters) == model
        assert ModelFamily(model).with_values(model.parameters).tied == model.tied


def test_numbers_go_where_they_belong():
    family = ModelFamily(RELAXED)
    both = family.with_values({"relaxation_length.cornering_stiffness": 5000.0, "rF": 0.33})
    assert both.parameters["relaxation_length.cornering_stiffness.rear"] == 5000.0
    assert both.parameters["relaxation_length.cornering_stiffness.front"] == 5000.0
    assert both.bicycle["rF"] == 0.33
    front = family.with_values({"relaxation_length.cornering_stiffness.front": 5000.0})
    assert front.effects[0].cornering_stiffness.rear == 6000.0
    assert front.effects[0].cornering_stiffness.front == 5000.0


def test_what_is_tied_follows_until_it_is_given():
    """The axis of front_compliance is perpendicular to the steer axis unless a tilt is given."""
    family = ModelFamily(RELAXED.with_effect(effect("front_compliance", joint_x=0.8, joint_z=-0.85)))
    follower = "front_compliance.axis_tilt"
    tilted = family.with_values({"lam": 0.4})
    assert tilted.parameters[follower] == 0.4
    assert tilted.tied == {follower: "lam"}
    np.testing.assert_array_equal(family.values({"lam": TRAILS})[follower], TRAILS)
    given = family.with_values({"lam": 0.4, follower: 0.2})
    assert given.parameters[follower] == 0.2
    assert given.tied == {}


def test_effects_without_numbers_take_them_from_the_call():
    """A model rolling without slip, with the tyre among what varies: its law takes the place of no_slip."""
    tyre = effect_class("relaxation_length")
    family = ModelFamily(MODELS["no slip"], further=(tyre,))
    values = family.values(TYRE.values({}))
    speeds = np.array([[3.0, 9.0]])
    system = family.descriptor(values, speeds)(speeds)
    expected = RELAXED.linear_model().state_matrix(speeds[0])
    np.testing.assert_allclose(np.linalg.solve(system.mass, system.dynamics)[0], expected, rtol=1e-11, atol=1e-9)
    assert effect_of(tyre, values) == TYRE


def test_an_impossible_mass_matrix_is_marked_and_leaves_the_others_alone():
    family, numbers = ModelFamily(RELAXED, ("IBxx",)), {"IBxx": np.array([9.2, -200.0, 9.2])}
    polynomial, refused = family.polynomials(numbers, 3)
    assert refused.tolist() == [False, True, False]
    assert family.without_mass(numbers, 3).tolist() == [False, True, False]
    roots = eigenvalues(polynomial(np.array([[5.0]])))
    np.testing.assert_array_equal(roots[0], roots[2])
    assert_same_eigenvalues(roots[0, 0], RELAXED.linear_model().eigenvalues(5.0), rtol=1e-9)
    with pytest.raises(InputError, match="IBxx = -200: the mass matrix is not positive definite; take another range"):
        family.state_matrices(numbers, [[5.0]])


def test_an_unknown_key_is_refused_with_the_nearest_match():
    with pytest.raises(InputError, match=r"unknown parameter 'relaxation_length\.cornering_stifness'.*cornering_stiff"):
        ModelFamily(RELAXED, ("c", "relaxation_length.cornering_stifness"))


def test_the_answer_to_a_harmonic_torque_is_that_of_one_model_at_a_time():
    family = ModelFamily(RELAXED)
    columns = {key: np.reshape(value, (-1, 1)) for key, value in (family.base | {"c": TRAILS}).items()}
    speeds = np.full((5, 2), [4.0, 8.0])
    system = family.descriptor(columns, speeds)(speeds)
    omega, symbolic = np.array([3.0, 20.0]), family.evaluate.symbolic
    torque, steer = symbolic.inputs.index("steer_torque"), symbolic.outputs.index("steer")
    gains = system.frequency_response(omega, inputs=[torque], outputs=[steer])
    for k, trail in enumerate(TRAILS):
        state, push, seen = family.with_values({"c": trail}).linear_model().matrices_at(8.0)
        for f, w in enumerate(omega):
            answer = np.linalg.solve(1j * w * np.eye(len(state)) - state, push[:, torque])
            assert gains[k, 1, f, 0, 0] == pytest.approx(seen[steer] @ answer, rel=1e-10)


def test_responses_about_the_first_are_the_responses_to_first_order():
    """Random systems, all four matrices changed by h: the error falls with h^2, and the first is exact."""
    rng, errors = np.random.default_rng(8), []
    first = [rng.normal(size=(1, 3, 5, 5)) for _ in range(2)] + [rng.normal(size=(1, 3, *s)) for s in ((5, 3), (4, 5))]
    change = [rng.normal(size=(6, *part.shape[1:])) for part in first]
    change = [part * (np.arange(6) > 0)[:, None, None, None] for part in change]
    for h in (1e-3, 1e-4):
        stack = DescriptorStack(*(part + h * more for part, more in zip(first, change, strict=True)))
        which = {"inputs": [2, 0], "outputs": [3, 1, 0]}
        near, exact = (f(np.array([0.5, 2.0, 9.0, 30.0]), **which) for f in (
            stack.responses_about_the_first, stack.frequency_response))  # fmt: skip
        assert near.shape == exact.shape == (6, 3, 4, 3, 2)
        np.testing.assert_allclose(near[0], exact[0], rtol=1e-9)
        errors.append(np.abs(near - exact).max())
        assert errors[-1] < 0.05 * np.abs(exact - exact[0]).max()
    assert errors[1] == pytest.approx(1e-2 * errors[0], rel=0.1)


def test_feedback_of_an_output_is_a_spring():
    """A steer torque proportional to steer is what the effect steer_spring adds."""
    family, speeds = ModelFamily(RELAXED), np.array([[7.0]])
    names = family.evaluate.symbolic
    place = {"input": names.inputs.index("steer_torque"), "output": names.outputs.index("steer")}
    system = family.descriptor(family.base, speeds).with_feedback(**place, gain=np.array(-12.0))(speeds)
    sprung = RELAXED.with_effect(effect("steer_spring", stiffness=12.0)).linear_model().state_matrix(7.0)
    np.testing.assert_allclose(np.linalg.solve(system.mass, system.dynamics)[0, 0], sprung, rtol=1e-11, atol=1e-9)


def test_a_family_in_which_every_number_varies_is_its_bicycles():
    bicycle = load_bicycle("benchmark")
    numbers = {key: value * np.array([1.0, 1.01]) for key, value in bicycle.values.items()}
    roots = eigenvalues(ModelFamily(MODELS["no slip"], tuple(numbers)).polynomials(numbers, 2)[0](np.array([[5.0]])))
    for k in range(2):
        alone = Model(bicycle.replace(**{key: float(x[k]) for key, x in numbers.items()}))
        assert_same_eigenvalues(roots[k, 0], alone.linear_model().eigenvalues(5.0), rtol=1e-9)
