"""Friction and lag against the differential equations they solve, AR(1) noise by its statistics."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from tyre.fits.friction import dahl_friction
from tyre.fits.lag import first_order_lag
from tyre.fits.noise import draw_ar1


def test_dahl_friction_solves_its_equation():
    """dT/dx = (1 - T sgn(dx)) / presliding over a path with two reversals (Dahl 1968)."""
    presliding, state, expected = 3e-5, 0.0, [0.0]
    path = np.array([0.0, 2e-5, 9e-5, 4e-5, -6e-5, -5e-5, 8e-5])
    for begin, end in pairwise(path):
        way = np.sign(end - begin)
        rate = lambda x, t, way=way: (1 - t * way) / presliding  # noqa: E731
        state = solve_ivp(rate, (begin, end), [state], rtol=1e-10, atol=1e-12).y[0, -1]
        expected.append(state)
    np.testing.assert_allclose(dahl_friction(path, presliding=presliding), expected, atol=1e-8)
    several = dahl_friction(path, presliding=np.array([1e-5, presliding]))
    np.testing.assert_allclose(several[1], expected, atol=1e-8)
    assert dahl_friction(path[1:], presliding=presliding, start=0.0)[0] == pytest.approx(expected[1])


def test_a_lag_solves_its_equation():
    """y' + y = u for a piecewise linear u, by the convolution integral; a steady input stays as it is."""
    step, rng = 0.3, np.random.default_rng(1)
    u = rng.standard_normal(12)
    x = step * np.arange(12)
    found = first_order_lag(u, step=step)
    for k in (1, 5, 11):
        integral = sum(quad(lambda s, k=k: np.exp(s - x[k]) * np.interp(s, x, u), x[j], x[j + 1])[0] for j in range(k))
        assert found[k] == pytest.approx(u[0] * np.exp(-x[k]) + integral, abs=1e-9)
    np.testing.assert_allclose(first_order_lag(np.full(9, 2.5), step=0.7), 2.5)
    assert first_order_lag(u, step=step, start=4.0)[0] == pytest.approx(4.0)
    later = first_order_lag(u, step=step, start=4.0) - found
    np.testing.assert_allclose(later, (4.0 - u[0]) * np.exp(-x), atol=1e-12)


def test_ar1_noise_has_unit_variance_from_the_first_sample_and_its_memory():
    """Stationary: variance 1 at both ends, correlation memory^k at distance k; 4000 draws of 30 samples."""
    rng = np.random.default_rng(2)
    drawn = np.array([draw_ar1(30, memory=0.8, rng=rng) for _ in range(4000)])
    assert drawn[:, 0].var() == pytest.approx(1.0, abs=0.08)
    assert drawn[:, -1].var() == pytest.approx(1.0, abs=0.08)
    for k in (1, 4):
        assert np.mean(drawn[:, k:] * drawn[:, :-k]) == pytest.approx(0.8**k, abs=0.03)
