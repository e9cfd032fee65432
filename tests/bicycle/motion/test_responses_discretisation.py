"""Many samples of many linear systems against scipy, one system and one sample at a time."""

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import StateSpace, lsim

from bicycle.motion import discretise, from_rest, march, powers_of

N, M = 4, 2


def systems(count):
    rng = np.random.default_rng(11)
    return rng.normal(size=(2, count, N, N)), rng.normal(size=(2, count, N, M)), rng.normal(size=(2, count, N))


@pytest.mark.parametrize("samples", [2, 17])
def test_the_march_is_lsim_with_inputs_that_are_linear_between_samples(samples):
    state, inputs, start = systems(3)
    steps = np.array([0.01, 0.02, 0.05])
    u = np.random.default_rng(12).normal(size=(2, 3, M, samples))
    step, g0, g1 = discretise(state, inputs, steps)
    found = march(step, g0 @ u[..., :-1] + g1 @ u[..., 1:], start)
    for k in range(2):
        for r in range(3):
            system = StateSpace(state[k, r], inputs[k, r], np.eye(N), np.zeros((N, M)))
            expected = lsim(system, u[k, r].T, steps[r] * np.arange(samples), start[k, r])[2]
            np.testing.assert_allclose(found[k, r].T, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("samples", [2, 17])
def test_many_pushes_of_systems_at_rest_are_those_of_each_sample_by_sample(samples):
    rng = np.random.default_rng(13)
    state, seen = 3 * rng.normal(size=(2, N, N)), rng.normal(size=(2, 3, N))
    known, across = rng.normal(size=(2, samples - 1, M)), rng.normal(size=(2, M, 5, N))
    found = from_rest(np.array([expm(0.02 * a) for a in state]), known, across, seen)
    assert found.shape == (2, 3, samples, 5)
    for r in range(2):
        for k in range(5):
            x = np.zeros(N)
            for t in range(samples):
                np.testing.assert_allclose(found[r, :, t, k], seen[r] @ x, rtol=1e-9, atol=1e-11)
                if t < samples - 1:
                    x = expm(0.02 * state[r]) @ x + across[r, :, k].T @ known[r, t]


@pytest.mark.parametrize("samples", [1, 2, 9])
def test_free_responses_are_the_matrix_exponentials(samples):
    state = systems(3)[0]
    step = discretise(state, np.zeros((2, 3, N, 1)), np.full(3, 0.03))[0]
    found = powers_of(step, samples)
    assert found.shape == (2, 3, N, samples, N)
    for t in range(samples):
        for k in range(2):
            for r in range(3):
                np.testing.assert_allclose(found[k, r, :, t], expm(0.03 * t * state[k, r]), rtol=1e-9, atol=1e-11)


def test_what_grows_beyond_all_numbers_is_not_finite_and_no_other_system_is_touched():
    step = np.array([[[1e200]], [[0.5]]])
    with np.errstate(over="ignore", invalid="ignore"):
        found = march(step, np.ones((2, 1, 8)), np.ones((2, 1)))
    assert not np.isfinite(found[0, 0, -1])
    assert found[1, 0, -1] == pytest.approx(2.0 - 0.5**8)
