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


@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_the_kernel_gives_roots_slopes_and_shares_by_their_definitions(n):
    """numpy's roots; d(lambda) = u dA x / (u x), shares |u_i x_i| of their sum, in matrices of different scales."""
    pytest.importorskip("numba")
    from bicycle.eigenvalues.vectors_kernel import decompose_stack

    rng = np.random.default_rng(n)
    scale = 10.0 ** np.arange(-1.0, 2.0)[:, None, None]
    stack, change = scale * rng.normal(size=(3, n, n)), rng.normal(size=(3, n, n))
    real, imag, doubt, slopes, shares = *np.empty((3, 3, n)), np.empty((2, 3, n)), np.empty((3, n, n))
    with np.errstate(divide="ignore", invalid="ignore"):  # of lanes that are done; compiled code says nothing
        assert plain(decompose_stack)(stack, change, real, imag, slopes, shares, doubt) == -1
    for k in range(3):
        values, right = np.linalg.eig(stack[k])
        order = np.lexsort((values.imag, values.real))
        values, right = values[order], right[:, order]
        left = np.linalg.inv(right)
        np.testing.assert_allclose(real[k] + 1j * imag[k], values, rtol=1e-9, atol=1e-11)
        expected = np.einsum("ri,ij,jr->r", left, change[k], right)
        np.testing.assert_allclose(slopes[0, k] + 1j * slopes[1, k], expected, rtol=1e-8, atol=1e-8)
        own = np.abs(left.T * right)
        np.testing.assert_allclose(shares[k], own / own.sum(0), rtol=1e-8, atol=1e-9)
        assert (doubt[k] < 1e-11 * np.abs(values).max() * np.linalg.cond(right)).all()


def test_the_kernel_reads_roots_off_diagonal_blocks():
    """A block with 1 +- 2i between 3 and -7, which stands last, and blocks of two real roots: in units of 2 1/s."""
    pytest.importorskip("numba")
    from bicycle.eigenvalues.qr_kernel import _collect

    h = np.zeros((7, 7, 1))
    h[:6, :6, 0] = np.triu(np.full((6, 6), 0.5), 1) + np.diag([3.0, 1.0, 1.0, 5.0, 5.0, -7.0])
    h[1:3, 1:3, 0] = [[1.0, -4.0], [1.0, 1.0]]
    h[3:5, 3:5, 0] = [[5.0, 8.0], [0.5, 5.0]]  # 3 and 7
    real, imag = np.empty((2, 6))
    plain(_collect)(h, 6, 0, 2.0, real, imag)
    assert sorted(zip(real.tolist(), imag.tolist(), strict=True)) == list(
        zip(real.tolist(), imag.tolist(), strict=True)
    )
    np.testing.assert_allclose(real + 1j * imag, [-14, 2 - 4j, 2 + 4j, 6, 6, 14], atol=1e-13)


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_roots_of_two_by_two_have_its_trace_and_determinant_and_do_not_overflow(scale):
    pytest.importorskip("numba")
    from bicycle.eigenvalues.qr_kernel import _pair

    rng, pair = np.random.default_rng(2), plain(_pair)
    for a, b, c, d in rng.normal(size=(200, 4)):
        re1, im1, re2, im2 = np.array(pair(*(scale * x for x in (a, b, c, d)))) / scale
        assert re1 + re2 == pytest.approx(a + d, abs=1e-13)
        assert re1 * re2 - im1 * im2 == pytest.approx(a * d - b * c, abs=1e-12)
        assert (re1 * im2 + re2 * im1, im1 + im2) == pytest.approx((0, 0), abs=1e-13)
