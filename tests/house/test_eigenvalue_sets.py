"""The comparison of eigenvalues as sets that other tests use."""

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues, in_order_of
from hypothesis import given
from hypothesis import strategies as st

UNDAMPED = np.array([1e-17 - 5j, 1e-17 + 5j, -1e-17 - 3j, -1e-17 + 3j])
OTHER_ROUNDING = np.array([-1e-17 - 5j, -1e-17 + 5j, 1e-17 - 3j, 1e-17 + 3j])


def test_rounding_of_the_real_part_does_not_matter():
    sorted_here, sorted_there = np.sort_complex(UNDAMPED), np.sort_complex(OTHER_ROUNDING)
    assert not np.allclose(sorted_here, sorted_there)  # what a comparison row by row would do
    assert_same_eigenvalues(sorted_here, sorted_there, atol=1e-15)
    assert np.abs(in_order_of(UNDAMPED, sorted_there) - UNDAMPED).max() < 1e-15


@given(st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_any_order_is_accepted_and_any_change_beyond_the_tolerance_is_not(size, seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(2, size)) + 1j * rng.normal(size=(2, size))
    shuffled = rng.permuted(values, axis=1)
    assert_same_eigenvalues(shuffled, values)
    np.testing.assert_array_equal(in_order_of(values, shuffled), values)
    shuffled[1, rng.integers(size)] += 30
    with pytest.raises(AssertionError, match=r"1 of \d+ differ by more than 1e-06 \+ 0"):
        assert_same_eigenvalues(shuffled, values, atol=1e-6)


def test_tolerance_is_relative_to_each_root_and_double_roots_are_counted():
    assert_same_eigenvalues([1e9 + 0.5, 1e-3], [1e-3, 1e9], rtol=1e-9)
    with pytest.raises(AssertionError, match="row 0 of one: 1 of 2 differ .* the worst is 0.0011.*, expected 0.001"):
        assert_same_eigenvalues([1e9, 1.1e-3], [1e-3, 1e9], rtol=1e-9, where="row 0 of one")
    with pytest.raises(AssertionError, match="1 of 3 differ"):
        assert_same_eigenvalues([1, 1, 2], [1, 2, 2], atol=1e-9)


def test_partners_are_those_within_tolerance_not_those_of_the_least_total_distance():
    found, expected = [0.568 + 0.823j, -0.318 + 1.466j], [0.0, 5.5]  # distances 1.0 and 6.0; crosswise 5.0 and 1.5
    assert_same_eigenvalues(found, expected, atol=1.01, rtol=0.91)
    np.testing.assert_array_equal(in_order_of(expected, found), found[::-1])


def test_other_shapes_and_values_that_are_no_numbers_fail():
    with pytest.raises(AssertionError, match=r"\(2,\) eigenvalues found, \(3,\) expected"):
        assert_same_eigenvalues([1, 2], [1, 2, 3], atol=9)
    with pytest.raises(AssertionError, match="not finite"):
        assert_same_eigenvalues([1, np.nan], [1, 2], atol=9)
