"""Frequency and damping ratio against the free oscillator x'' + 2 zeta omega x' + omega^2 x = 0."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bicycle.eigenvalues.oscillation import (
    angular_frequency,
    damping_ratio,
    frequency_hz,
    least_damping_ratio,
    oscillating,
    pair_damping_ratio,
)


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
    np.testing.assert_allclose(least_damping_ratio(roots), [0.1 / abs(-0.1 + 9j), np.nan])
    np.testing.assert_array_equal(np.isnan(oscillating(roots)), [[False, True, False, True, True], [True] * 5])
    assert np.isnan(pair_damping_ratio(np.array(1.0 + 0j), np.array(-1.0 + 0j)))
    assert np.isnan(damping_ratio(0.0))
