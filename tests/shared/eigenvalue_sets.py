"""Eigenvalues compared as sets: where real parts differ by rounding only, every processor sorts them differently."""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment


def in_order_of(reference: ArrayLike, found: ArrayLike) -> NDArray[np.complex128]:
    """The eigenvalues ``found`` (..., n), each row in the order of the nearest ones of ``reference`` (..., n)."""
    return np.take_along_axis(*_matched(reference, found, lambda distance, size: distance), -1)


def assert_same_eigenvalues(
    found: ArrayLike, expected: ArrayLike, *, rtol: float = 0.0, atol: float = 0.0, where: str = ""
) -> None:
    """Fail unless each row of ``found`` (..., n) is that of ``expected`` in some order, one to one.

    As in ``numpy.testing.assert_allclose`` partners may differ by ``atol + rtol * abs(expected)``; where any
    one-to-one assignment keeps to that, the one taken does.
    """

    def excess(distance: NDArray[np.float64], size: NDArray[np.float64]) -> NDArray[np.float64]:
        allowed = np.maximum(atol + rtol * size, 1e-200)[..., None, :]
        with np.errstate(divide="ignore"):
            return np.where(distance <= allowed, 0.0, 1e4 + np.log(distance / allowed))  # few misses, then near ones

    want = np.asarray(expected, complex)
    values, order = _matched(want, found, excess)
    have = np.take_along_axis(values, order, -1)
    distance, allowed = np.abs(have - want), atol + rtol * np.abs(want)
    missed = distance > allowed
    if missed.any():
        worst = np.unravel_index((distance - allowed).argmax(), distance.shape)
        raise AssertionError(
            f"{where or 'eigenvalues'}: {missed.sum()} of {missed.size} differ by more than "
            f"{atol:g} + {rtol:g} |expected|; the worst is {have[worst]:.15g}, expected {want[worst]:.15g} "
            f"(differs by {distance[worst]:.3g}, allowed {allowed[worst]:.3g}) "
            f"in row {[int(k) for k in worst[:-1]]} of\n"
            f"found\n{have}\nexpected\n{want}"
        )


def _matched(reference, found, cost):
    """``found`` and the index that puts each row in the order of ``reference``, by least total cost."""
    want, have = np.asarray(reference, complex), np.asarray(found, complex)
    if want.shape != have.shape:
        raise AssertionError(f"{have.shape} eigenvalues found, {want.shape} expected")
    if not (np.isfinite(want).all() and np.isfinite(have).all()):
        raise AssertionError(f"eigenvalues that are not finite: found {have}, expected {want}")
    order = np.empty(want.shape, int)
    for row in np.ndindex(want.shape[:-1]):
        costs = cost(np.abs(have[row][:, None] - want[row]), np.abs(want[row]))
        rows, columns = linear_sum_assignment(costs)
        order[row][columns] = rows
    return have, order
