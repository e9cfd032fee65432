"""Eigenvalues of stacks: the compiled kernel and LAPACK judged by backward error and by exact values."""

import importlib.util

import mpmath
import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bicycle import Model, effect_class, load_bicycle
from bicycle.eigenvalues.solvers import BATCH, compiled, default_solver, eigenvalues, lapack
from tyre.base.errors import InputError

NUMBA = importlib.util.find_spec("numba") is not None
SOLVERS = [lapack, pytest.param(compiled, marks=pytest.mark.skipif(not NUMBA, reason="numba is not installed"))]
EPS = np.finfo(float).eps


def backward_error(matrix, values):
    """Size of the smallest change that makes each value an eigenvalue, in eps of the norm (Golub & Van Loan 7.9)."""
    n = len(matrix)
    distance = [np.linalg.svd(matrix - z * np.eye(n), compute_uv=False)[-1] for z in values]
    largest = max(np.abs(matrix).max(), np.finfo(float).tiny)  # squares of what is near 1e-200 are zero
    return max(distance) / (EPS * largest * max(np.linalg.norm(matrix / largest), 1.0))


def families():
    rng = np.random.default_rng(3)
    for n in (1, 2, 3, 4, 6, 8, 10, 12):
        q, _ = np.linalg.qr(rng.normal(size=(n, n)))
        jordan = 2.0 * np.eye(n) + np.eye(n, k=1)
        yield "random", rng.normal(size=(n, n))
        yield "defective", q @ jordan @ q.T
        yield "nilpotent", np.eye(n, k=1)
        yield "clustered", q @ np.diag(1 + 1e-9 * rng.normal(size=n)) @ q.T + 1e-12 * rng.normal(size=(n, n))
        yield "symmetric", (lambda a: a + a.T)(rng.normal(size=(n, n)))
        yield "orthogonal", q
        yield "cyclic", np.roll(np.eye(n), 1, axis=0)  # unshifted QR would turn for ever
        yield "zero", np.zeros((n, n))
        yield "large", 1e150 * rng.normal(size=(n, n))
        yield "small", 1e-150 * rng.normal(size=(n, n))


@pytest.mark.parametrize("solver", SOLVERS)
def test_backward_error_of_stress_families(solver):
    for name, matrix in families():
        error = backward_error(matrix, solver(matrix[None])[0])
        assert error < 20 * len(matrix), f"{name} {len(matrix)}: {error}"


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("spread", [1e3, 1e6, 1e9])
def test_graded_and_stiff_matrices_keep_their_small_roots(solver, spread):
    """Roots from 1 to ``spread`` 1/s in badly scaled states; exact values by mpmath with 60 digits."""
    rng = np.random.default_rng(5)
    n = 8
    roots = np.geomspace(1, spread, n) * np.array([-1, 1] * 4)
    unit = np.diag(2.0 ** np.linspace(-20, 20, n).round())
    matrix = np.linalg.inv(unit) @ (np.diag(roots) + np.triu(rng.normal(size=(n, n)), 1)) @ unit
    with mpmath.workdps(60):
        exact = [complex(z) for z in mpmath.eig(mpmath.matrix(matrix.tolist()))[0]]
    mixed = matrix[::-1, ::-1]  # not triangular to the eye
    for one in (matrix, mixed):
        assert_same_eigenvalues(solver(one[None])[0], exact, rtol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_stiff_bicycle_against_many_digits(solver):
    """A stiff tyre next to a slow capsize: each root to 1e-10 of the largest, slow roots far better than that."""
    tyre = effect_class("relaxation_length")(cornering_stiffness=20000.0, relaxation_length=0.02)
    matrices = Model(load_bicycle("benchmark"), (tyre,)).linear_model().state_matrix([0.5, 5.0, 15.0])
    for matrix, found in zip(matrices, solver(matrices), strict=True):
        with mpmath.workdps(50):
            exact = [complex(z) for z in mpmath.eig(mpmath.matrix(matrix.tolist()))[0]]
        assert_same_eigenvalues(found, exact, rtol=1e-9)


@pytest.mark.skipif(not NUMBA, reason="numba is not installed")
@settings(max_examples=60)
@given(
    arrays(np.float64, st.integers(1, 9).map(lambda n: (n, n)),
           elements=st.floats(-1e6, 1e6).map(lambda x: x if abs(x) > 1e-200 else 0.0))
)  # fmt: skip
def test_compiled_backward_error_of_anything(matrix):
    assert backward_error(matrix, compiled(matrix[None])[0]) < 40 * len(matrix)


@pytest.mark.parametrize("solver", SOLVERS)
def test_entries_whose_squares_are_no_numbers_spoil_no_others(solver):
    """Balanced, the two odd entries are alike; where that is 1e-155, squares of it had lost their digits."""
    odd = 10.0 ** np.random.default_rng(0).uniform(-199, 0, (500, 2))
    odd[0] = 8.88695897415705e-174, 6.275990426520188e-144
    stack = np.zeros((len(odd), 3, 3))
    stack[:, 0, 2], stack[:, 1, 2], stack[:, 2, 0], stack[:, 2, 1] = odd[:, 0], 2048.0, odd[:, 1], 1.0
    assert max(map(backward_error, stack, solver(stack))) < 20 * 3


@pytest.mark.parametrize("solver", SOLVERS)
def test_sorted_conjugate_and_independent_of_batches_and_threads(solver):
    stack = np.random.default_rng(1).normal(size=(2 * BATCH + 37, 6, 6))
    whole = eigenvalues(stack, solver=solver)
    np.testing.assert_array_equal(eigenvalues(stack, solver=solver, threads=2), whole)
    parts = [eigenvalues(part, solver=solver) for part in (stack[:701], stack[701:])]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert (np.diff(whole.real, axis=1) >= 0).all()
    np.testing.assert_allclose(whole.sum(1), np.trace(stack, axis1=1, axis2=2), atol=1e-12)
    upper = whole.imag > 0
    np.testing.assert_array_equal(whole[upper].conj(), np.roll(whole, 1, axis=1)[upper])
    assert eigenvalues(stack.reshape(3, -1, 6, 6), solver=solver).shape == (3, 695, 6)


def test_the_compiled_kernel_is_chosen_where_numba_is():
    assert default_solver() is (compiled if NUMBA else lapack)


def test_messages():
    with pytest.raises(InputError, match=r"matrices have shape \(2, 3\); give square ones"):
        eigenvalues(np.zeros((2, 3)))
    with pytest.raises(InputError, match="threads = 0; give at least 1"):
        eigenvalues(np.eye(2), threads=0)
    with pytest.raises(InputError, match=r"entry \[1, 0, 1\] of the matrices is nan; eigenvalues need finite entries"):
        eigenvalues(np.array([np.eye(2), [[1, np.nan], [0, 1]]]))


@pytest.mark.skipif(not NUMBA, reason="numba is not installed")
def test_lapack_takes_over_where_the_kernel_gives_up(monkeypatch):
    from bicycle.eigenvalues import qr_kernel

    stack = np.random.default_rng(2).normal(size=(5, 4, 4))
    solve = qr_kernel.solve
    calls = []

    def failing(part, real, imag):
        """Give up at the third matrix, with those before it unfinished."""
        calls.append(len(part))
        return 2 if len(calls) == 1 else solve(part, real, imag)

    monkeypatch.setattr(qr_kernel, "solve", failing)
    assert_same_eigenvalues(compiled(stack), lapack(stack), rtol=1e-7, atol=1e-12)
    assert calls == [5, 2, 2]


@pytest.mark.skipif(not NUMBA, reason="numba is not installed")
def test_the_kernel_says_which_matrix_it_gave_up():
    from bicycle.eigenvalues.qr_kernel import solve

    stack = np.random.default_rng(1).normal(size=(6, 5, 5))
    stack[3] = np.nan
    parts = np.zeros((2, 6, 5))
    assert solve(stack, *parts) == 3
