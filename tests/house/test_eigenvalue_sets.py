"""The comparison of eigenvalues as sets that other tests use."""

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues, in_order_of
from hypothesis import given
from hypothesis import strategies as st

UNDAMPED = np.array([1e-17 - 5j, 1e-17 + 5j, -1e-17 - 3j, -1e-17 + 3j])
OTHER_ROUNDING = np.array([-1e-17 - 5j, -1e-17 + 5j, 1e-17 - 3j, 1e-17 + 3j])


def test_rounding_of_the_real_part_does_not_matter():
    here, there = np.sort_complex(UNDAMPED), np.sort_complex(OTHER_ROUNDING)
    assert not np.allclose(here, there)  # what a comparison row by row would do
    assert_same_eigenvalues(here, there, atol=1e-15)


@given(st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_any_order_is_accepted_and_any_change_beyond_the_tolerance_is_not(size, seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(2, size)) + 1j * rng.normal(size=(2, size))
    shuffled = rng.permuted(values, axis=1)
    assert_same_eigenvalues(shuffled, values)
    np.testing.assert_array_equal(in_order_of(values, shuffled), values)
    shuffled[1, rng.integers(size)] += 30
    with pytest.raises(AssertionError):
        assert_same_eigenvalues(shuffled, values, atol=1e-6)


@pytest.mark.parametrize(("found", "expected", "words"), [
    ([1e9, 1.1e-3], [1e-3, 1e9], "row 0 of one"), ([1, 1, 2], [1, 2, 2], "Mismatched elements: 1 / 3"),
    ([1, 2], [1, 2, 3], r"\(2,\) eigenvalues found, \(3,\) expected"), ([1, np.nan], [1, 2], "not finite"),
])  # fmt: skip
def test_what_differs_fails(found, expected, words):
    with pytest.raises(AssertionError, match=words):
        assert_same_eigenvalues(found, expected, rtol=1e-9, where="row 0 of one")


def test_partners_are_within_tolerance_where_any_assignment_can_have_that():
    assert_same_eigenvalues([1e9 + 0.5, 1e-3], [1e-3, 1e9], rtol=1e-9)
    found, expected = [0.568 + 0.823j, -0.318 + 1.466j], [0.0, 5.5]  # distances 1.0 and 6.0; crosswise 5.0 and 1.5
    assert_same_eigenvalues(found, expected, atol=1.01, rtol=0.91)
