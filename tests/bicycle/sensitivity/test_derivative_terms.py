"""The contraction of eigenvectors with many matrices against its definition."""

import numpy as np

from bicycle.sensitivity.derivative_terms import eigenvalue_derivative_terms


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
