"""Eigenvalues compared as sets: where real parts differ by rounding only, every processor sorts them differently."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment


def in_order_of(
    reference: ArrayLike, found: ArrayLike, *, rtol: float = 0.0, atol: float = 0.0
) -> NDArray[np.complex128]:
    """The eigenvalues ``found`` (..., n), each row one to one in the order of those of ``reference`` (..., n).

    Partners are within ``atol + rtol * abs(reference)`` of each other where any assignment can have that, else nearest.
    """
    want, have = np.asarray(reference, complex), np.array(found, complex)
    assert want.shape == have.shape, f"{have.shape} eigenvalues found, {want.shape} expected"
    assert np.isfinite(want).all(), f"eigenvalues that are not finite are expected: {want}"
    assert np.isfinite(have).all(), f"eigenvalues that are not finite: {have}"
    for row in np.ndindex(want.shape[:-1]):
        distance = np.abs(have[row][:, None] - want[row])
        allowed = np.maximum(atol + rtol * np.abs(want[row]), 1e-200)
        beyond = np.where(distance <= allowed, 0.0, 1e6) if atol or rtol else 0.0
        rows, columns = linear_sum_assignment(distance / (1 + distance.max()) + beyond)
        have[row][columns] = have[row][rows]
    return have


def assert_same_eigenvalues(
    found: ArrayLike, expected: ArrayLike, *, rtol: float = 0.0, atol: float = 0.0, where: str = ""
) -> None:
    """Fail unless each row of ``found`` (..., n) is that of ``expected`` in some order, one to one.

    As in ``numpy.testing.assert_allclose`` partners may differ by ``atol + rtol * abs(expected)``.
    """
    ordered = in_order_of(expected, found, rtol=rtol, atol=atol)
    np.testing.assert_allclose(ordered, np.asarray(expected, complex), rtol=rtol, atol=atol, err_msg=where)
