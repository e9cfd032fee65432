"""Draws within bounds: mean, standard deviation and correlation are those that are stated, whatever they are."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studies.model_space import BoundedDraws, possible_moments
from tyre.ground import InputError

POSITIVE, FREE = (0.0, np.inf), (-np.inf, np.inf)
COUNT = 100_000


def drawn(mean, covariance, bounds, seed=1):
    factor = np.linalg.cholesky(np.asarray(covariance, float))
    z = np.random.default_rng(seed).standard_normal((len(mean), COUNT))
    z = np.linalg.solve(np.linalg.cholesky(np.cov(z)), z - z.mean(1)[:, None])  # chance is in higher moments only
    return BoundedDraws(mean, factor, bounds)(z)


@pytest.mark.parametrize("relative", [0.01, 0.1, 0.4, 1.0])
def test_positive_quantities_have_the_stated_moments_and_no_draw_is_negative(relative):
    """Two correlated positive quantities of very different size and one free in sign."""
    mean, sd = np.array([5000.0, 0.1, -0.02]), np.array([5000.0 * relative, 0.08 * relative, 0.3])
    correlation = np.array([[1.0, 0.6, -0.3], [0.6, 1.0, 0.2], [-0.3, 0.2, 1.0]])
    x = drawn(mean, correlation * np.outer(sd, sd), [POSITIVE, POSITIVE, FREE])
    assert x[:2].min() > 0
    assert x[2].min() < -1
    np.testing.assert_allclose((x.mean(1) - mean) / sd, 0, atol=0.01)
    np.testing.assert_allclose(x.std(1), sd, rtol=0.02)
    np.testing.assert_allclose(np.corrcoef(x), correlation, atol=0.02)


@settings(max_examples=25)
@given(relative=st.floats(1e-3, 1.0), other=st.floats(1e-3, 1.0), correlation=st.floats(-0.3, 0.95))
def test_the_moments_hold_by_the_formula_of_the_lognormal(relative, other, correlation):
    """Closed form: a lognormal pair with log-covariance L has the relative covariance exp(L) - 1."""
    sd = np.array([relative, other])
    covariance = np.outer(sd, sd) * np.array([[1, correlation], [correlation, 1]])
    draws = BoundedDraws([1.0, 1.0], np.linalg.cholesky(covariance), [POSITIVE, POSITIVE])
    if draws.notes(("a", "b")):
        return  # not reachable by positive quantities; see below
    log = np.outer(*[np.sqrt(np.log(1 + sd**2))] * 2) * (draws.root @ draws.root.T)
    np.testing.assert_allclose(np.expm1(log), covariance, rtol=1e-6, atol=0.012 * relative * other)
    np.testing.assert_allclose(np.diag(np.expm1(log)), sd**2, rtol=1e-9)


def test_what_lies_between_two_bounds_stays_there():
    x = drawn([0.9, 0.3, 0.02], np.diag([0.2, 0.3, 0.001]) ** 2, [(0.0, 1.0), (-np.pi / 2, np.pi / 2), (-1.5, 1.5)])
    assert 0 <= x[0].min() < x[0].max() <= 1
    np.testing.assert_allclose(x.mean(1), [0.9, 0.3, 0.02], atol=0.002)
    np.testing.assert_allclose(x.std(1), [0.2, 0.3, 0.001], rtol=0.01)
    z = np.random.default_rng(0).standard_normal((1, 9))
    far = BoundedDraws([0.3], [[0.01]], [(-np.pi / 2, np.pi / 2)])
    np.testing.assert_array_equal(far(z), far.linear(z))  # no draw reaches a bound: normal


def test_an_upper_bound_is_kept_like_a_lower_one():
    covariance = np.array([[0.25, 0.1], [0.1, 0.16]])
    x = drawn([-1.0, 1.0], covariance, [(-np.inf, 0.0), POSITIVE])
    assert x[0].max() < 0 < x[1].min()
    np.testing.assert_allclose(np.cov(x), covariance, rtol=0.03)


def test_a_mean_at_its_bound_is_left_inwards_and_said():
    draws = BoundedDraws([1.0, 0.0], np.diag([0.1, 2.0]), [(0.0, 1.0), POSITIVE])
    x = draws(np.random.default_rng(0).standard_normal((2, COUNT)))
    assert x[0].max() <= 1
    assert x[1].min() >= 0
    np.testing.assert_allclose(np.sqrt(((x - [[1.0], [0.0]]) ** 2).mean(1)), [0.1, 2.0], rtol=0.01)
    said = draws.notes(("share", "damping"))
    assert [note.split()[0] for note in said] == ["share", "damping"]
    assert "its samples lie on one side of it: their root-mean-square distance to it is the stated 2" in said[1]


def test_a_correlation_that_positive_quantities_cannot_have_is_said():
    """Relative sd 1 and correlation -0.95: the least that two such lognormal quantities can have is -1/2."""
    covariance = np.array([[1.0, -0.95], [-0.95, 1.0]])
    x = drawn([1.0, 1.0], covariance, [POSITIVE, POSITIVE])
    np.testing.assert_allclose(x.mean(1), 1, atol=0.01)
    np.testing.assert_allclose(x.std(1), 1, rtol=0.03)
    assert np.corrcoef(x)[0, 1] == pytest.approx(-0.5, abs=0.02)
    said = BoundedDraws([1.0, 1.0], np.linalg.cholesky(covariance), [POSITIVE, POSITIVE]).notes(("a", "b"))
    assert said[0].startswith("quantities that keep their sign cannot have the stated correlations of a, b; means and")


@pytest.mark.parametrize(("mean", "sd", "bounds", "words"), [
    (-1.0, 0.1, POSITIVE, "x: the mean -1 is outside 0 .. inf, so no sample is possible"),
    (0.5, 0.6, (0.0, 1.0), "x: nothing between 0 and 1 with a mean of 0.5 has a standard deviation of 0.6; .* 0.5"),
    (np.inf, 1.0, POSITIVE, "x: its value is infinite, which has no standard deviation"),
])  # fmt: skip
def test_moments_that_nothing_has_are_refused(mean, sd, bounds, words):
    with pytest.raises(InputError, match=words):
        possible_moments("x", mean, sd, bounds)
