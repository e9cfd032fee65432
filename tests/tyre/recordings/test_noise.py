"""Noise of residuals: the constants against the likelihood of full covariance matrices."""

from itertools import product

import numpy as np
import pytest

from tyre.recordings import correlated_covariance, draw_ar1, noise_constants


def criterion(jacobian, residual, white, correlated, phi):
    """Minus twice the restricted log likelihood (Patterson & Thompson, 1971) of white plus AR(1) noise."""
    places = np.arange(len(residual))
    covariance = correlated * phi ** np.abs(places[:, None] - places) + white * np.eye(len(places))
    inverse = np.linalg.inv(covariance)
    information = jacobian.T @ inverse @ jacobian
    left = residual - jacobian @ np.linalg.solve(information, jacobian.T @ inverse @ residual)
    return sum(np.linalg.slogdet(m)[1] for m in (covariance, information)) + left @ inverse @ left


@pytest.mark.parametrize("seed", range(3))
def test_no_other_constants_are_more_likely(seed):
    """Beside white noise as large as slow noise; the recursive filter and a light prior on both may cost 0.2."""
    rng = np.random.default_rng(seed)
    jacobian = np.vander(np.linspace(-1.0, 1.0, 120), 3)
    residual = rng.standard_normal(120) + draw_ar1(120, memory=0.8, rng=rng)
    white, correlated, phi = noise_constants(jacobian, residual)
    least = criterion(jacobian, residual, white, correlated, phi)
    total = white + correlated
    for share, memory in product(np.linspace(0.15, 0.85, 8), np.linspace(0.3, 0.95, 9)):
        for size in (0.8, 1.0, 1.25):
            other = criterion(jacobian, residual, (1 - share) * size * total, share * size * total, memory)
            assert other > least - 0.2, (share, memory, size)


def test_a_column_that_stands_twice_shares_its_coefficient():
    """White noise by hand: var = s^2 / sum x^2, a quarter of it for each half of a coefficient."""
    rng, x = np.random.default_rng(5), np.linspace(-1.0, 1.0, 4000)
    once, _ = correlated_covariance(x[:, None], noise := rng.standard_normal(x.size))
    twice, _ = correlated_covariance(np.column_stack([x, x]), noise)
    assert once[0, 0] == pytest.approx(1 / (x @ x), rel=0.5)
    np.testing.assert_allclose(twice, once[0, 0] / 4, rtol=0.01)


@pytest.mark.parametrize(("slow", "least", "most"), [(1.0, 0.8, 1.0), (0.2, 0.0, 0.2)])
def test_the_share_of_slow_noise_is_searched_and_not_taken_as_a_half(slow, least, most):
    """A search with small first steps of the share stayed at 1/2 for any noise."""
    rng = np.random.default_rng(8)
    jacobian = np.vander(np.linspace(-1.0, 1.0, 480), 3)
    residual = slow * draw_ar1(480, memory=0.97, rng=rng) + 0.2 / slow * rng.standard_normal(480)
    white, correlated, _ = noise_constants(jacobian, residual)
    assert least < correlated / (white + correlated) < most
