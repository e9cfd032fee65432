"""Many bicycles at once against one at a time; contractions and crossings against plain arithmetic."""

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues, in_order_of

from bicycle import Model, effect_class, load_bicycle
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.batch import (
    coefficients,
    eigenvalue_derivative_terms,
    follow_crossing,
    state_matrices,
    with_slopes,
)
from bicycle.eigenvalues.solvers import compiled, eigenvalues, eigenvalues_along, lapack

TYRE = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
MODELS = {
    "no slip": Model(load_bicycle("benchmark")),
    "side slip": Model(load_bicycle("benchmark"), (effect_class("side_slip")(cornering_stiffness=6000.0),)),
    "relaxation": Model(load_bicycle("benchmark"), (TYRE,)),
}


@pytest.mark.parametrize("solver", [lapack, compiled])
@pytest.mark.parametrize("name", MODELS)
def test_a_batch_is_its_bicycles(name, solver):
    if solver is compiled:
        pytest.importorskip("numba")
    model, speeds = MODELS[name], np.array([[1.0, 6.0, 14.0]])
    masses, trails = np.linspace(60, 100, 5), np.linspace(0.03, 0.1, 5)
    values = model.parameters | {"mB": masses, "c": trails}
    found = coefficients(model.linear_model(), model.evaluator, values, 5, solver=solver)
    assert not found.refused.any()
    result = eigenvalues(state_matrices(found, speeds), solver=solver)
    for k, (mass, trail) in enumerate(zip(masses, trails, strict=True)):
        one = Model(model.bicycle.replace(mB=float(mass), c=float(trail)), model.effects).linear_model()
        for found_one in (result[k], eigenvalues_along(one, speeds[0])):
            assert_same_eigenvalues(found_one, one.eigenvalues(speeds[0]), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("solver", [lapack, compiled])
def test_an_impossible_mass_matrix_is_marked_and_leaves_the_others_alone(solver):
    if solver is compiled:
        pytest.importorskip("numba")
    model = MODELS["relaxation"]
    values = model.parameters | {"IBxx": np.array([9.2, -200.0, 9.2])}
    found = coefficients(model.linear_model(), model.evaluator, values, 3, solver=solver)
    assert found.refused.tolist() == [False, True, False]
    result = eigenvalues(state_matrices(found, np.array([[5.0]])), solver=solver)
    np.testing.assert_array_equal(result[0], result[2])
    assert_same_eigenvalues(result[0, 0], model.linear_model().eigenvalues(5.0), rtol=1e-9)


def test_first_order_is_the_sum_of_products():
    rng = np.random.default_rng(4)
    left, right = (rng.normal(size=(2500, 5)) + 1j * rng.normal(size=(2500, 5)) for _ in range(2))
    stacks = [rng.normal(size=(3, 5, 5)) * (rng.random((5, 5)) < 0.4) for _ in range(2)]
    weights = [rng.normal(size=2500), rng.normal(size=2500) + 1j]
    expected = sum(
        w[:, None] * np.einsum("ki,pij,kj->kp", left, stack, right) for w, stack in zip(weights, stacks, strict=True)
    )
    found = eigenvalue_derivative_terms(left, right, list(zip(weights, stacks, strict=True)))
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_slopes_with_speed_are_those_of_differences():
    model = MODELS["relaxation"]
    linear = model.linear_model()
    found = coefficients(linear, model.evaluator, model.parameters, 1)
    values, slopes = with_slopes(found, np.array([7.0]))
    ahead, behind = (in_order_of(values[0], linear.eigenvalues(7.0 + h)) for h in (1e-5, -1e-5))
    np.testing.assert_allclose(slopes[0], (ahead - behind) / 2e-5, rtol=1e-5, atol=1e-6)


def test_crossings_are_reached_in_their_direction_only():
    model = MODELS["relaxation"]
    linear = model.linear_model()
    found = coefficients(linear, model.evaluator, model.parameters, 1)
    for crossing in critical_speeds(linear):
        omega = 2 * np.pi * crossing.frequency_hz
        for direction in (True, False):
            speed, frequency, there = follow_crossing(
                found,
                np.array([1.05 * crossing.speed]),
                np.array([omega]),
                destabilising=direction,
            )
            assert there[0] == (direction == (crossing.direction == "destabilising"))
            if there[0]:
                assert speed[0] == pytest.approx(crossing.speed, rel=1e-9)
                assert frequency[0] == pytest.approx(omega, abs=1e-6)
