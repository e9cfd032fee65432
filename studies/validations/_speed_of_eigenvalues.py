"""Eigenvalues against a peer, a Python loop, LAPACK and one thread: seconds of both sides."""

import ctypes
import hashlib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from bicycle.eigenvalues.solvers import BATCH, Solver, eigenvalues, lapack
from bicycle.files.bicycle_file import load_bicycle
from bicycle.modal.matching import assign
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from studies.validations._speed_timing import SPREAD, Pair, alternating, tyre_model
from tyre.base.arrays import Array
from tyre.base.parallel import one_blas_thread


def peer_model() -> Any:
    """The Whipple model of bicycleparameters with the same bicycle; ImportError where it is not installed."""
    from bicycleparameters.models import Meijaard2007Model
    from bicycleparameters.parameter_sets import Meijaard2007ParameterSet

    values = dict(load_bicycle("benchmark").values) | {
        "v": 1.0,
        "IByy": 11.0,
        "IHyy": 0.06,
    }  # the last two have no effect
    return Meijaard2007Model(Meijaard2007ParameterSet(values, True))


def _check_same(ours: Any, theirs: Any) -> None:
    """Both found the same roots (m, n), in whatever order."""
    match = assign(np.abs(theirs[:, :, None] - ours[:, None, :]))
    np.testing.assert_allclose(np.take_along_axis(ours, match, 1), theirs, rtol=1e-8)


def peer_speeds(count: int, solver: Solver, repeats: int) -> Pair:
    """Eigenvalues of the Whipple bicycle over speeds."""
    peer, speeds = peer_model(), np.linspace(0, 10, count)
    linear = Model(load_bicycle("benchmark")).linear_model()
    _check_same(linear.eigenvalues(speeds[-5:], solver=solver), peer.calc_eigen(v=speeds[-5:])[0])
    return alternating(
        lambda: peer.calc_eigen(v=speeds),
        lambda: linear.eigenvalues(speeds, threads=2, solver=solver),
        repeats,
    )


def peer_bicycles(count: int, solver: Solver, repeats: int) -> Pair:
    """Eigenvalues of Whipple bicycles of different trail at one speed, assembly included."""
    peer, trails = peer_model(), np.linspace(0.05, 0.1, count)
    model = Model(load_bicycle("benchmark"))
    family = ModelFamily(model, ("c",))

    def batch(values: Array) -> Any:
        polynomial, _ = family.polynomials({"c": values}, len(values), solver=solver)
        return eigenvalues(polynomial(np.array([[5.0]])), solver=solver)

    def ours(values: Array = trails) -> Any:
        with one_blas_thread(), ThreadPoolExecutor(2) as pool:
            return np.concatenate(list(pool.map(batch, np.array_split(values, -(-len(values) // BATCH)))))

    _check_same(ours(trails[:3])[:, 0], peer.calc_eigen(c=trails[:3], v=5.0)[0])
    return alternating(lambda: peer.calc_eigen(c=trails, v=5.0), ours, repeats)


def python_loop(count: int, points: int, repeats: int, solver: Solver) -> Pair:
    """Seconds a bicycle: one model after the other in Python, and ``count`` at once on two threads."""
    model = tyre_model(8)
    draws = np.random.default_rng(1).normal(size=(points, len(SPREAD))) * list(SPREAD.values())

    def loop() -> None:
        for row in draws:
            changes = {key: model.bicycle[key] + float(d) for key, d in zip(SPREAD, row, strict=True)}
            Model(model.bicycle.replace(**changes), model.effects).linear_model().eigenvalues(8.0)

    family, speed = ModelFamily(model, tuple(SPREAD)), np.array([[8.0]])
    spread = np.random.default_rng(2).normal(size=(count, len(SPREAD))) * list(SPREAD.values())

    def batch(start: int) -> Any:
        rows = spread[start : start + BATCH].T
        numbers = {key: model.bicycle[key] + d for key, d in zip(SPREAD, rows, strict=True)}
        polynomial, _ = family.polynomials(numbers, rows.shape[1], solver=solver)
        return eigenvalues(polynomial(speed), solver=solver)

    def together() -> None:
        with one_blas_thread(), ThreadPoolExecutor(2) as pool:
            list(pool.map(batch, range(0, count, BATCH)))

    one, many = alternating(loop, together, repeats)
    return one / points, many / count


def lapack_itself(count: int, repeats: int) -> Pair:
    """LAPACK's dgeev called from compiled code on the same matrices, and the stacked numpy path on one thread."""
    stack = tyre_model(8).linear_model().state_matrix(np.linspace(0.1, 30, count))
    call = _dgeev_loop()
    return alternating(lambda: call(stack), lambda: eigenvalues(stack, solver=lapack), repeats)


def threads(count: int, solver: Solver, repeats: int) -> Pair:
    """One thread, two threads."""
    stack = tyre_model(8).linear_model().state_matrix(np.linspace(0.1, 30, count))
    return alternating(
        lambda: eigenvalues(stack, solver=solver), lambda: eigenvalues(stack, threads=2, solver=solver), repeats
    )


def threads_of_the_machine(count: int, repeats: int) -> Pair:
    """The same with work that is sure to run side by side, hashing: what this machine gives at this time."""
    pieces = [bytes(1000 * count)] * 2

    def hashed() -> None:
        for piece in pieces:
            hashlib.sha256(piece)

    with ThreadPoolExecutor(2) as pool:
        return alternating(
            hashed, lambda: list(pool.map(lambda piece: hashlib.sha256(piece).digest(), pieces)), repeats
        )


def _dgeev_loop() -> Callable[[Array], Any]:
    """A compiled loop over LAPACK's dgeev without vectors, workspace made once."""
    import numba
    from numba.extending import get_cython_function_address

    integer, double = ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_double)
    letter = ctypes.POINTER(ctypes.c_uint8)
    signature: Any = ctypes.CFUNCTYPE(
        None, letter, letter, integer, double, integer, double, double, double, integer, double, integer, double,
        integer, integer,
    )  # fmt: skip
    dgeev = signature(get_cython_function_address("scipy.linalg.cython_lapack", "dgeev"))

    @numba.njit(nogil=True)
    def loop(stack: Any) -> Any:
        m, n = stack.shape[0], stack.shape[1]
        no = np.array([78], np.uint8)  # 'N'
        order, one = np.array([n], np.int32), np.array([1], np.int32)
        size, info = np.array([34 * n], np.int32), np.array([0], np.int32)
        work, nothing, a = np.empty(34 * n), np.empty(1), np.empty((n, n))
        real, imag = np.empty((m, n)), np.empty((m, n))
        for k in range(m):
            a[:] = stack[k].T
            dgeev(
                no.ctypes, no.ctypes, order.ctypes, a.ctypes, order.ctypes, real[k].ctypes, imag[k].ctypes,
                nothing.ctypes, one.ctypes, nothing.ctypes, one.ctypes, work.ctypes, size.ctypes, info.ctypes,
            )  # fmt: skip
        return real, imag

    result: Callable[[Array], Any] = loop
    return result
