"""Left and right eigenvectors and slopes against their definitions and against differences."""

import numpy as np
import pytest
from eigenvalue_sets import in_order_of
from plain_kernels import plain

from bicycle import Model, effect_class, load_bicycle
from bicycle.eigenvalues.decomposition import BATCH, decompose, eigensystem, projected
from bicycle.model_family import ModelFamily
from bicycle.speed_polynomial import SpeedPolynomial

TYRE = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)


def test_slopes_along_speed_are_those_of_differences():
    model = Model(load_bicycle("benchmark"), (TYRE,))
    linear = model.linear_model()
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
    np.testing.assert_allclose(projected(left, dynamics, right), values, atol=1e-11)


def test_many_matrices_are_many_calls_of_one():
    rng = np.random.default_rng(6)
    speeds = rng.uniform(1.0, 9.0, 2 * BATCH + 3)
    one = SpeedPolynomial({0: rng.normal(size=(3, 3)), 1: rng.normal(size=(3, 3))})
    stack = ModelFamily(Model(load_bicycle("benchmark"), (TYRE,)), ("c",)).polynomials(
        {"c": np.linspace(0.03, 0.1, len(speeds))}, len(speeds)
    )[0]
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
    turned = {
        power: basis @ matrix @ np.linalg.inv(basis)
        for power, matrix in {
            0: np.array([[-1.0, -2, 0], [1, -1, 0], [0, 0, -9]]),
            1: np.array([[0.0, 1, 0], [0, 0, 0], [0, 0, 0]]),
        }.items()
    }
    values = decompose(SpeedPolynomial(turned), np.array([2.0, 1.5])).values
    assert (values[0].imag == 0).all()
    assert (values[1].imag != 0).sum() == 2


def test_the_kernel_refuses_exactly_the_masses_that_are_not_positive():
    """L L' of whole numbers, which no rounding touches, singular where the last one is 0, and any skew part."""
    pytest.importorskip("numba")
    from bicycle.eigenvalues.pencil_kernel import reduce_pencil

    rng = np.random.default_rng(0)
    factor = np.tril(rng.integers(1, 6, (60, 3, 3))).astype(float)
    factor[:, 2, 2] = np.arange(60) % 2
    skew = np.triu(rng.integers(-9, 9, (60, 3, 3)), 1)
    mass, force = factor @ factor.swapaxes(1, 2) + skew - skew.swapaxes(1, 2), rng.normal(size=(60, 3, 3))
    scale, solved, refused = np.array([1.0, 2.0, 4.0]), np.empty((1, 60, 3, 3)), np.empty(60, bool)
    plain(reduce_pencil)(mass, (force,), scale, solved, refused)
    assert refused.tolist() == [True, False] * 30
    expected = np.linalg.solve(mass[~refused], force[~refused]) * scale / scale[:, None]
    np.testing.assert_allclose(solved[0, ~refused], expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_the_kernel_factors_with_the_larger_pivot_and_solves_for_left_vectors(size):
    """(H - z)' u = ones of numpy, with z away from all roots; no factor of L is above one."""
    pytest.importorskip("numba")
    from bicycle.eigenvalues.vectors_kernel import _factor, _left

    rng, n, lanes = np.random.default_rng(8), 5, 40
    h, triangle, work = np.zeros((n + 1, n + 1, lanes)), np.empty((2, n, n, lanes)), np.empty((12, n, lanes))
    h[:n, :n] = size * rng.normal(size=(n, n, lanes)) * np.tri(n, n, 1).T[..., None]
    z, swap = size * rng.normal(size=(2, lanes)), np.empty((n, lanes))
    plain(_factor)(h, n, z, np.abs(h).max((0, 1)), triangle, work, swap)
    plain(_left)(n, triangle, work, swap)
    assert np.hypot(work[8, : n - 1], work[9, : n - 1]).max() < 1 + 1e-12
    shifted = np.moveaxis(h[:n, :n], 2, 0) - (z[0] + 1j * z[1])[:, None, None] * np.eye(n)
    expected = np.linalg.solve(shifted.swapaxes(1, 2), np.ones((lanes, n, 1)))[..., 0].T
    np.testing.assert_allclose(work[2] + 1j * work[3], expected, rtol=1e-9, atol=1e-12 / size)
