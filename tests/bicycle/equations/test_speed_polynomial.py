"""Laurent polynomials of matrices against direct sums, for one bicycle and for stacks of them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes

from bicycle.equations import SpeedPolynomial

powers = st.lists(st.integers(-2, 3), min_size=1, max_size=4, unique=True)
seeds = st.integers(0, 2**32 - 1)


def random_coefficients(rng, powers, shape):
    return {power: rng.normal(size=shape) for power in powers}


def direct(coefficients, speed):
    return sum(float(speed) ** power * matrix for power, matrix in coefficients.items())


@given(powers, array_shapes(min_dims=0, max_dims=3, max_side=3), st.tuples(st.integers(1, 4), st.integers(1, 4)), seeds)
@settings(max_examples=60)
def test_one_polynomial_at_speeds_of_any_shape(powers, speed_shape, matrix_shape, seed):
    rng = np.random.default_rng(seed)
    coefficients = random_coefficients(rng, powers, matrix_shape)
    speeds = rng.uniform(0.1, 30.0, size=speed_shape)
    found = SpeedPolynomial(coefficients)(speeds)
    assert found.shape == (*speed_shape, *matrix_shape)
    for at in np.ndindex(*speed_shape):
        np.testing.assert_allclose(found[at], direct(coefficients, speeds[at]), rtol=1e-12, atol=1e-12)


@given(powers, st.integers(1, 4), st.integers(1, 3), seeds)
@settings(max_examples=40)
def test_a_stack_has_the_bicycles_first(powers, bicycles, speeds_each, seed):
    rng = np.random.default_rng(seed)
    coefficients = random_coefficients(rng, powers, (bicycles, 3, 3))
    stack = SpeedPolynomial(coefficients)
    speeds = rng.uniform(0.1, 30.0, size=(bicycles, speeds_each))
    every, shared, one_each, alone = stack(speeds), stack(speeds[:1]), stack(speeds[:, 0]), stack(speeds[0, 0])
    assert every.shape == shared.shape == (bicycles, speeds_each, 3, 3)
    for m in range(bicycles):
        own = {power: matrix[m] for power, matrix in coefficients.items()}
        for k in range(speeds_each):
            np.testing.assert_allclose(every[m, k], direct(own, speeds[m, k]), rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(shared[m, k], direct(own, speeds[0, k]), rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(one_each[m], every[m, 0])
        np.testing.assert_array_equal(alone[m], shared[m, 0])
    kept = rng.random(bicycles) < 0.5
    np.testing.assert_array_equal(stack.take(kept)(speeds[kept]), every[kept])


@given(powers, seeds)
@settings(max_examples=40)
def test_the_derivative_is_that_of_each_power(powers, seed):
    rng = np.random.default_rng(seed)
    coefficients = random_coefficients(rng, powers, (2, 3))
    speed = rng.uniform(0.5, 10.0)
    expected = sum(power * speed ** (power - 1) * matrix for power, matrix in coefficients.items())
    np.testing.assert_allclose(SpeedPolynomial(coefficients).derivative(speed), expected, rtol=1e-12, atol=1e-12)


def test_powers_that_do_not_occur_are_zero():
    polynomial = SpeedPolynomial({1: np.eye(2)})
    np.testing.assert_array_equal(polynomial.coefficient(1), np.eye(2))
    np.testing.assert_array_equal(polynomial.coefficient(-1), np.zeros((2, 2)))
    assert list(polynomial) == [1]
    assert 0 not in polynomial
    nothing = SpeedPolynomial({}, shape=(2, 3))
    assert nothing([1.0, 2.0]).tolist() == np.zeros((2, 2, 3)).tolist()
    np.testing.assert_array_equal(SpeedPolynomial({0: np.ones((2, 2))}).derivative([1.0, 2.0]), np.zeros((2, 2, 2)))


def test_the_coefficients_are_not_touched_by_what_is_done_to_the_result():
    matrix = np.eye(2)
    polynomial = SpeedPolynomial({0: matrix})
    polynomial(3.0)[:] = 7.0
    polynomial([3.0])[:] = 7.0
    np.testing.assert_array_equal(matrix, np.eye(2))


def test_speeds_with_fewer_axes_than_the_stack_are_refused():
    with pytest.raises(ValueError, match=r"speeds of shape \(2,\) do not match a stack of shape \(2, 3\)"):
        SpeedPolynomial({0: np.zeros((2, 3, 1, 1))})([1.0, 2.0])
