"""Eigenvalues of stacks: judged by exact values, as slopes and as oscillations."""

import mpmath
import numpy as np
import pytest
from built import built
from eigenvalue_sets import assert_same_eigenvalues, in_order_of
from hypothesis import given
from hypothesis import strategies as st

from bicycle.equations import SpeedPolynomial
from bicycle.model import (
    BATCH,
    ModelFamily,
    angular_frequency,
    damping_ratio,
    decompose,
    eigensystem,
    eigenvalues,
    frequency_hz,
    min_damping_ratio,
    oscillating,
    pair_damping_ratio,
    project,
)
from tests.shared.refusals import refuses
from tyre.ground import InputError


@pytest.mark.parametrize("spread", [1e3, 1e6, 1e9])
def test_graded_and_stiff_matrices_keep_their_small_roots(spread):
    """Roots from 1 to ``spread`` 1/s in badly scaled states; exact values by mpmath with 60 digits."""
    rng = np.random.default_rng(5)
    n = 8
    roots = np.geomspace(1, spread, n) * np.array([-1, 1] * 4)
    unit = np.diag(2.0 ** np.linspace(-20, 20, n).round())
    matrix = np.linalg.inv(unit) @ (np.diag(roots) + np.triu(rng.normal(size=(n, n)), 1)) @ unit
    with mpmath.workdps(60):
        exact = [complex(z) for z in mpmath.eig(mpmath.matrix(matrix.tolist()))[0]]
    mixed = matrix[::-1, ::-1]  # not triangular to the eye
    for one in (matrix, mixed):
        assert_same_eigenvalues(eigenvalues(one[None])[0], exact, rtol=1e-9)


def test_stiff_bicycle_against_many_digits():
    """A stiff tyre next to a slow capsize: each root to 1e-10 of the largest, slow roots far better than that."""
    stiff = built(relaxation_length={"cornering_stiffness": 20000.0, "relaxation_length": 0.02})
    matrices = stiff.linear_model().state_matrix([0.5, 5.0, 15.0])
    for matrix, found in zip(matrices, eigenvalues(matrices), strict=True):
        with mpmath.workdps(50):
            exact = [complex(z) for z in mpmath.eig(mpmath.matrix(matrix.tolist()))[0]]
        assert_same_eigenvalues(found, exact, rtol=1e-9)


def test_sorted_conjugate_and_independent_of_batches_and_threads():
    stack = np.random.default_rng(1).normal(size=(2 * BATCH + 38, 6, 6))
    whole = eigenvalues(stack)
    np.testing.assert_array_equal(eigenvalues(stack, threads=2), whole)
    parts = [eigenvalues(part) for part in (stack[:701], stack[701:])]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert (np.diff(whole.real, axis=1) >= 0).all()
    np.testing.assert_allclose(whole.sum(1), np.trace(stack, axis1=1, axis2=2), atol=1e-12)
    upper = whole.imag > 0
    np.testing.assert_array_equal(whole[upper].conj(), np.roll(whole, 1, axis=1)[upper])
    assert eigenvalues(stack.reshape(3, -1, 6, 6)).shape == (3, len(stack) // 3, 6)


def test_messages():
    refuses(r"matrices have shape \(2, 3\); give square ones", eigenvalues, np.zeros((2, 3)))
    refuses("threads = 0; give at least 1", eigenvalues, np.eye(2), threads=0)
    with pytest.raises(InputError, match=r"entry \[1, 0, 1\] of the matrices is nan; eigenvalues need finite entries"):
        eigenvalues(np.array([np.eye(2), [[1, np.nan], [0, 1]]]))


MODEL = built(relaxation_length={"cornering_stiffness": 6000.0, "relaxation_length": 0.1})


def test_slopes_along_speed_are_those_of_differences():
    linear = MODEL.linear_model()
    values, slopes, _, _ = decompose(linear.coefficients[0], np.array([7.0]))
    ahead, behind = (in_order_of(values[0], linear.eigenvalues(7.0 + h)) for h in (1e-5, -1e-5))
    np.testing.assert_allclose(slopes[0], (ahead - behind) / 2e-5, rtol=1e-5, atol=1e-6)


def test_vectors_of_a_pencil_are_those_of_its_definition():
    rng = np.random.default_rng(5)
    dynamics, mass = rng.normal(size=(2, 4, 6, 6))
    mass += 6 * np.eye(6)
    values, right, left = eigensystem(dynamics, mass=mass)
    np.testing.assert_allclose(dynamics @ right, mass @ right * values[:, None, :], atol=1e-11)
    np.testing.assert_allclose(left @ mass @ right, np.broadcast_to(np.eye(6), mass.shape), atol=1e-11)
    np.testing.assert_allclose(project(left, dynamics, right), values, atol=1e-11)


def test_many_matrices_are_many_calls_of_one():
    rng = np.random.default_rng(6)
    speeds = rng.uniform(1.0, 9.0, 2 * BATCH + 3)
    one = SpeedPolynomial({0: rng.normal(size=(3, 3)), 1: rng.normal(size=(3, 3))})
    trails = {"c": np.linspace(0.03, 0.1, len(speeds))}
    stack, _ = ModelFamily(MODEL, ("c",)).polynomials(trails, len(speeds))
    for polynomial in (one, stack):
        together = decompose(polynomial, speeds)
        for k in (0, BATCH - 1, BATCH + 5, len(speeds) - 1):
            own = polynomial if polynomial is one else stack.take(slice(k, k + 1))
            alone = decompose(own, speeds[k : k + 1])
            for part, expected in zip(together, alone, strict=True):
                np.testing.assert_allclose(part[k], expected[0], rtol=1e-9, atol=1e-9)


def test_a_double_real_root_that_rounding_splits_is_real():
    """Roots -1 +- sqrt(v - 2), turned by a random basis: at v = 2 rounding leaves a tiny pair."""
    rng = np.random.default_rng(7)
    basis = rng.normal(size=(3, 3))
    plain = {0: [[-1.0, -2, 0], [1, -1, 0], [0, 0, -9]], 1: [[0.0, 1, 0], [0, 0, 0], [0, 0, 0]]}
    turned = {power: basis @ np.array(matrix) @ np.linalg.inv(basis) for power, matrix in plain.items()}
    values = decompose(SpeedPolynomial(turned), np.array([2.0, 1.5])).values
    assert (values[0].imag == 0).all()
    assert (values[1].imag != 0).sum() == 2


@given(st.floats(-0.99, 0.99), st.floats(0.1, 100.0))
def test_an_oscillator_has_its_damping_ratio_and_frequency(ratio, natural):
    """Roots of s^2 + 2 zeta omega s + omega^2; the logarithmic decrement gives zeta back."""
    upper, lower = sorted(np.roots([1.0, 2 * ratio * natural, natural**2]), key=lambda z: -z.imag)
    assert damping_ratio(upper) == pytest.approx(ratio, abs=1e-9)
    assert damping_ratio(lower) == pytest.approx(ratio, abs=1e-9)
    assert pair_damping_ratio(upper, np.array(np.nan + 0j)) == pytest.approx(ratio, abs=1e-9)
    period = 1 / frequency_hz(upper)
    decrement = -upper.real * period
    assert decrement / np.hypot(2 * np.pi, decrement) == pytest.approx(ratio, abs=1e-9)
    assert frequency_hz(lower) == -frequency_hz(upper)
    assert oscillating(upper) == upper
    assert np.isnan(oscillating(lower))
    assert angular_frequency(frequency_hz(upper)) == pytest.approx(upper.imag)


@pytest.mark.parametrize("ratio", [1.5, -3.0])
def test_two_real_roots_of_one_sign_are_overdamped(ratio):
    first, second = np.roots([1.0, 2 * ratio * 4.0, 16.0]).astype(complex)
    assert pair_damping_ratio(first, second) == pytest.approx(ratio)


def test_what_does_not_oscillate_has_no_ratio():
    roots = np.array([[-1.0 + 2j, -1.0 - 2j, -0.1 + 9j, -0.1 - 9j, 3.0], [-1.0, -2, -3, -4, -5]])
    np.testing.assert_allclose(min_damping_ratio(roots), [0.1 / abs(-0.1 + 9j), np.nan])
    np.testing.assert_array_equal(np.isnan(oscillating(roots)), [[False, True, False, True, True], [True] * 5])
    assert np.isnan(pair_damping_ratio(np.array(1.0 + 0j), np.array(-1.0 + 0j)))
    assert np.isnan(damping_ratio(0.0))
