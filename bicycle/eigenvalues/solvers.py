"""Eigenvalues of a stack of small matrices: in sub-batches that fit the cache, on threads, compiled where numba is.

>>> import numpy as np
>>> eigenvalues(np.array([[[0.0, 1.0], [-4.0, 0.0]]]))
array([[0.-2.j, 0.+2.j]])
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.util import find_spec

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tyre.base.arrays import Complex
from tyre.base.errors import InputError
from tyre.base.parallel import one_blas_thread

BATCH = 1024  # matrices a call: they fit the cache, and there is enough for every thread
FEW = 20_000  # matrices for which LAPACK takes tenths of a second; to load the kernels takes a whole one

Solver = Callable[[NDArray[np.float64]], Complex]


def eigenvalues(stack: ArrayLike, *, threads: int = 1, solver: Solver | None = None) -> Complex:
    """Eigenvalues (..., n) in 1/s of matrices, sorted by real then imaginary part.

    Each matrix is treated by itself: the result depends neither on its neighbours nor on the number of threads; by
    default its last digits depend on whether there are few or many of them.

    Parameters
    ----------
    stack : array_like, shape (..., n, n)
        Real matrices, 1/s.
    threads : int
        Number of threads that sub-batches are spread over; numpy and the compiled kernel leave the interpreter free.
    solver : callable, optional
        :func:`lapack` or :func:`compiled`; by default that of :func:`solver_for` so many matrices.

    Raises
    ------
    InputError
        Not a stack of square matrices, an entry that is not finite, or fewer threads than one.
    """
    matrices = np.asarray(stack, float)
    if matrices.ndim < 2 or matrices.shape[-1] != matrices.shape[-2]:
        raise InputError(f"matrices have shape {matrices.shape}; give square ones, shape (..., n, n)")
    flat = matrices.reshape(-1, *matrices.shape[-2:])

    def finite(part: slice) -> NDArray[np.float64]:
        batch = flat[part]
        if not np.isfinite(batch).all():
            at = np.argwhere(~np.isfinite(batch))[0]
            first = [*map(int, np.unravel_index(part.start + at[0], matrices.shape[:-2])), *at[1:].tolist()]
            value = matrices[tuple(first)]
            raise InputError(f"entry {first} of the matrices is {value}; eigenvalues need finite entries")
        return batch

    result = in_batches(finite, flat.shape[:2], threads, solver)
    return result.reshape(matrices.shape[:-1])


def in_batches(
    matrices: Callable[[slice], NDArray[np.float64]], shape: tuple[int, int], threads: int = 1,
    solver: Solver | None = None,
) -> Complex:  # fmt: skip
    """Eigenvalues (m, n) in 1/s of matrices that are made where they are used.

    Parameters
    ----------
    matrices : callable
        From a part of the m matrices, a slice, to these, shape (k, n, n), 1/s.
    shape : tuple of int, shape (2,)
        m and n.
    threads : int
        Number of threads, as in :func:`eigenvalues`.
    solver : callable, optional
        As in :func:`eigenvalues`.

    Raises
    ------
    InputError
        Fewer threads than one.
    """
    if threads < 1:
        raise InputError(f"threads = {threads}; give at least 1")
    solve = solver or solver_for(shape[0])
    result = np.empty(shape, complex)

    def fill(start: int) -> None:
        part = slice(start, start + BATCH)
        result[part] = solve(matrices(part))

    starts = range(0, len(result), BATCH)
    if threads == 1 or len(starts) < 2:
        for start in starts:
            fill(start)
    else:
        with one_blas_thread(), ThreadPoolExecutor(threads) as pool:
            list(pool.map(fill, starts))
    return result


def lapack(stack: NDArray[np.float64]) -> Complex:
    """Eigenvalues (m, n) of a ``stack``, shape (m, n, n), by LAPACK's ``dgeev`` through numpy, sorted."""
    return np.sort(np.linalg.eigvals(stack).astype(complex, copy=False), axis=-1)


def compiled(stack: NDArray[np.float64]) -> Complex:
    """Eigenvalues (m, n) of a ``stack``, shape (m, n, n), by the QR kernel of this room; LAPACK where it gives up."""
    from bicycle.eigenvalues.qr_kernel import solve

    stack = np.ascontiguousarray(stack)  # for one layout it is compiled
    parts = np.empty((2, *stack.shape[:2]))
    result = np.empty(stack.shape[:2], complex)
    start = 0
    while start < len(stack):
        failed = solve(stack[start:], parts[0, start:], parts[1, start:])
        if failed < 0:
            result.real[start:], result.imag[start:] = parts[:, start:]
            break
        result[start : start + failed] = compiled(stack[start : start + failed])  # its neighbours were not finished
        start += failed
        result[start] = lapack(stack[start : start + 1])[0]
        start += 1
    return result


def solver_for(count: int) -> Solver:
    """:func:`default_solver` for a ``count`` of matrices (without unit) that it is worth loading for; else LAPACK."""
    return lapack if count <= FEW else default_solver()


@cache
def default_solver() -> Solver:
    """:func:`compiled` where numba is installed and can keep what it compiled, else :func:`lapack`."""
    if not find_spec("numba"):
        return lapack
    try:
        import bicycle.eigenvalues.qr_kernel  # noqa: F401
    except RuntimeError:  # there is no place beside the source, as in a zipped wheel
        return lapack
    return compiled
