"""The kernel in C and LAPACK, one beside the other, on matrices that are hard, against many digits."""

import os
import subprocess
import sys
from functools import cache

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bicycle.model import eigen

EPS = np.finfo(float).eps
SOLVERS = [pytest.param(eigen.kernel, id="C", marks=pytest.mark.skipif(eigen.kernel is None, reason="not built")),
           pytest.param(None, id="LAPACK")]  # fmt: skip
KINDS = ("random", "tiny", "huge", "graded", "defective", "nilpotent", "sparse", "reducible", "clustered", "symmetric",
         "orthogonal", "cyclic", "zero")  # fmt: skip


@pytest.fixture(params=SOLVERS)
def solver(request, monkeypatch):
    monkeypatch.setattr(eigen, "kernel", request.param)


def matrix_of(kind, n, seed):
    """A matrix of n rows whose trouble is its ``kind``."""
    rng = np.random.default_rng(seed)
    matrix, unit = rng.normal(size=(n, n)), 2.0 ** rng.integers(-20, 20, n)
    basis, (q, _), below = np.eye(n) + 0.3 * np.triu(matrix, 1), np.linalg.qr(matrix), np.arange(n) >= n // 2
    return {
        "random": matrix, "tiny": 1e-200 * matrix, "huge": 1e200 * matrix, "graded": matrix * unit[:, None] / unit,
        "defective": basis @ (2 * np.eye(n) + np.eye(n, k=1)) @ np.linalg.inv(basis), "nilpotent": np.eye(n, k=1),
        "sparse": matrix * (rng.random((n, n)) < 0.4), "reducible": matrix * ~(below[:, None] & ~below),
        "clustered": q @ np.diag(1 + 1e-9 * rng.normal(size=n)) @ q.T, "symmetric": matrix + matrix.T, "orthogonal": q,
        "cyclic": np.roll(np.eye(n), 1, axis=0), "zero": np.zeros((n, n)),  # unshifted QR would turn the first for ever
    }[kind]  # fmt: skip


def backward_error(matrix, values):
    """Size of the smallest change that makes each value an eigenvalue, in eps of the norm (Golub & Van Loan 7.9)."""
    largest = np.abs(matrix).max() or 1.0  # squares of what is near 1e-200 are zero
    scaled = matrix / largest
    distance = [np.linalg.svd(scaled - z / largest * np.eye(len(matrix)), compute_uv=False)[-1] for z in values]
    return max(distance) / (EPS * max(np.linalg.norm(scaled), 1.0))


@cache
def exact(kind, n, seed):
    with mpmath.workdps(60):
        values, left, right = mpmath.eig(mpmath.matrix(matrix_of(kind, n, seed).tolist()), left=True)
        share = [[abs(left[i, j] * right[j, i]) for j in range(n)] for i in range(n)]
        return np.array([complex(z) for z in values]), np.array([[float(x / sum(row)) for x in row] for row in share])


ANYTHING = arrays(
    np.float64, st.integers(1, 9).map(lambda n: (n, n)),
    elements=st.floats(-1e6, 1e6).map(lambda x: x if abs(x) > 1e-200 else 0.0),
)  # fmt: skip


@settings(max_examples=150)
@given(st.builds(matrix_of, st.sampled_from(KINDS), st.integers(1, 12), st.integers(0, 10**6)) | ANYTHING)
def test_every_root_is_one_of_a_matrix_that_differs_by_rounding(matrix):
    for kernel in {eigen.kernel, None}:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(eigen, "kernel", kernel)
            values = np.append(eigen.eigenvalues(matrix[None])[0], eigen.eigensystem(matrix[None]).values[0])
        assert backward_error(matrix, values) < 40 * len(matrix)


def test_entries_whose_squares_are_no_numbers_spoil_no_others():
    """Balanced, the two odd entries are alike; where that is 1e-155, squares of it had lost their digits."""
    odd = 10.0 ** np.random.default_rng(0).uniform(-199, 0, (500, 2))
    odd[0] = 8.88695897415705e-174, 6.275990426520188e-144
    stack = np.zeros((len(odd), 3, 3))
    stack[:, 0, 2], stack[:, 1, 2], stack[:, 2, 0], stack[:, 2, 1] = odd[:, 0], 2048.0, odd[:, 1], 1.0
    assert max(map(backward_error, stack, eigen.eigenvalues(stack))) < 20 * 3


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("kind", ["random", "graded", "tiny", "huge", "reducible"])
def test_roots_vectors_slopes_and_shares_against_sixty_digits(kind):
    for n in (2, 5, 8):
        matrices = np.array([matrix_of(kind, n, seed) for seed in range(2)])
        changes = np.random.default_rng(n).normal(size=matrices.shape)
        values, slopes, right, left = eigen.eigensystem_with_slopes(matrices, changes)
        ratio = np.vstack([np.arange(n) == 0, np.ones(n), np.zeros(n)])
        shares = eigen.participation(matrices, np.eye(n), ratio)
        for k, matrix in enumerate(matrices):
            expected, share = exact(kind, n, k)
            size = np.abs(expected).max()
            order = np.abs(values[k][:, None] - expected).argmin(1)
            assert sorted(order) == list(range(n))
            np.testing.assert_allclose(values[k], expected[order], atol=1e-11 * size)
            scale = np.abs(left[k]) @ np.abs(right[k])
            np.testing.assert_allclose(left[k] @ right[k], np.eye(n), atol=1e-9 * np.abs(scale).max())
            largest = (np.abs(matrix) @ np.abs(right[k])).max()
            np.testing.assert_allclose(matrix @ right[k], right[k] * values[k], atol=1e-9 * largest)
            products = np.einsum("ij,jk,ki->i", left[k], changes[k], right[k])
            bound = np.einsum("ij,jk,ki->i", *map(np.abs, (left[k], changes[k], right[k])))
            assert (np.abs(slopes[k] - products) <= 1e-12 * bound).all()
            by_shares = np.abs(shares.values[k][:, None] - expected).argmin(1)
            np.testing.assert_allclose(shares.share[k].T, share[by_shares], atol=1e-7)
            own = np.abs(right[k][:, [np.abs(values[k] - z).argmin() for z in shares.values[k]]])
            np.testing.assert_allclose(shares.steering[k], own[0] / own.sum(0), rtol=1e-7, atol=1e-12)


@pytest.mark.usefixtures("solver")
def test_a_hard_matrix_changes_no_digit_of_the_others():
    """Defective, zero and ordinary matrices side by side, in any order and number."""
    rng = np.random.default_rng(2)
    stack = rng.normal(size=(23, 8, 8))
    stack[5], stack[9], stack[10] = np.eye(8, k=1), 0.0, 1e250 * stack[10]
    whole = eigen.eigenvalues(stack), *eigen.eigensystem(stack)
    order = rng.permutation(23)
    for part in np.split(order, [1, 4, 11]):
        alone = eigen.eigenvalues(stack[part]), *eigen.eigensystem(stack[part])
        for one, every in zip(alone, whole, strict=True):
            np.testing.assert_array_equal(one, every[part])


@pytest.mark.usefixtures("solver")
@pytest.mark.parametrize("entry", [np.nan, np.inf, -np.inf])
def test_entries_that_are_not_finite_are_refused(entry):
    stack = np.random.default_rng(3).normal(size=(9, 6, 6))
    stack[4, 1, 2] = entry
    for solve in (eigen.spectra, eigen.eigensystem):
        with pytest.raises(np.linalg.LinAlgError, match="infs or NaNs"):
            solve(stack)


@pytest.mark.skipif(eigen.kernel is None, reason="not built")
def test_the_kernel_refuses_arrays_of_the_wrong_size():
    matrices, values = np.zeros((3, 4, 4)), np.empty((3, 4), complex)
    for wrong in ((matrices, values[:2]), (matrices, None), (matrices, values, matrices), (None, values)):
        with pytest.raises(ValueError, match="bytes, not|missing"):
            eigen.kernel.solve(4, *wrong)
    with pytest.raises(ValueError, match="order 0; give 1 to"):
        eigen.kernel.solve(0, matrices, values)
    with pytest.raises(ValueError, match="score has shape"):
        eigen.kernel.assign(2, 3, 0.1, np.zeros((3, 5, 2)), np.zeros((5, 2), np.int64), np.zeros((4, 2), np.int64))


@pytest.mark.parametrize(("asked", "said"), [("off", "LAPACK, by numpy"), ("plain", "C, plain")])
def test_the_environment_switches_the_kernel(asked, said):
    if asked == "plain" and eigen.kernel is None:
        pytest.skip("not built")
    code = (
        "from bicycle.model.eigen import KERNEL, eigenvalues; print(KERNEL, eigenvalues([[[0, 1], [-4, 0]]])[0].imag)"
    )
    environment = os.environ | {"VELOTYRE_KERNEL": asked}
    shown = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert shown.stdout.split(" [")[0] == said
    assert "-2." in shown.stdout
