"""What the speed table compares; every function returns seconds of both sides, measured in turn in one process."""

import ctypes
import hashlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.effect import effect_class
from bicycle.eigenvalues.solvers import BATCH, Solver, compiled, eigenvalues, eigenvalues_along, lapack
from bicycle.files.bicycle_file import load_bicycle
from bicycle.linear_model import LinearModel
from bicycle.modal.matching import assign
from bicycle.model import Model
from bicycle.model_family import ModelFamily
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities
from studies.sweeps.chunk import compute
from studies.sweeps.engines import Engine, in_threads, on_cluster
from studies.sweeps.run import pieces
from studies.sweeps.spec import Sweep
from studies.sweeps.sweep_file import build_sweep
from tyre.base.arrays import Array
from tyre.base.blas import one_blas_thread

Pair = tuple[float, float]  # seconds of the reference and of velotyre
TYRE = {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}
SPREAD = {"mB": 1.0, "xB": 0.01, "zB": 0.01, "mH": 0.1, "w": 0.01, "c": 0.002}


def alternating(first: Callable[[], Any], second: Callable[[], Any], repeats: int) -> Pair:
    """Median seconds of two calls that take turns, after one call of each to warm up."""
    times: list[list[float]] = [[], []]
    for number in range(repeats + 1):
        for kind, call in enumerate((first, second)):
            start = time.perf_counter()
            call()
            if number:
                times[kind].append(time.perf_counter() - start)
    return float(np.median(times[0])), float(np.median(times[1]))


def tyre_model(order: int) -> Model:
    """The benchmark bicycle on tyres: 8 states; with a flexible front and a leaning rider 12."""
    effects = [effect_class("relaxation_length")(**TYRE)]
    if order == 12:
        hinge = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
        rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
        effects += [effect_class("front_compliance")(**hinge), effect_class("rider_lean")(**rider)]
    return Model(load_bicycle("benchmark"), tuple(effects))


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
    _check_same(eigenvalues_along(linear, speeds[-5:], solver=solver), peer.calc_eigen(v=speeds[-5:])[0])
    return alternating(
        lambda: peer.calc_eigen(v=speeds),
        lambda: eigenvalues_along(linear, speeds, threads=2, solver=solver),
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


def sweep_of(samples: int, **changes: Any) -> Sweep:
    """Distinct bicycles with 8 states at 8 m/s."""
    content = {
        "model": {"bicycle": "benchmark", "effects": {"relaxation_length": TYRE}}, "samples": samples, "seed": 1,
        "outputs": ["eigenvalues"], "grid": {"speed_m_s": [8.0]},
        "sampled": {key: {"sd": sd} for key, sd in SPREAD.items()},
    }  # fmt: skip
    return build_sweep(content | changes)


def drain(sweep: Sweep, engine: Engine) -> None:
    """Compute a sweep and drop the results."""
    for _ in engine(partial(compute, sweep), pieces(sweep)):
        pass


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


def growth(counts: list[int]) -> float:
    """Exponent of seconds against points, fitted in logarithms."""
    seconds = []
    drain(sweep_of(1000), in_threads(2))
    for count in counts:
        sweep = sweep_of(count, points_per_part=8192)
        taken = []
        for _ in range(3 if count < 10**6 else 1):
            start = time.perf_counter()
            drain(sweep, in_threads(2))
            taken.append(time.perf_counter() - start)
        seconds.append(np.median(taken))
    return float(np.polyfit(np.log(counts), np.log(seconds), 1)[0])


MEMORY = """
import resource, sys
from pathlib import Path
from studies.sweeps.run import run_sweep
from studies.sweeps.engines import in_threads
from studies.validations._speed_measures import reduced_sweep
run_sweep(reduced_sweep(int(sys.argv[1])), Path(sys.argv[2]) / "result.zarr", engine=in_threads(2))
status = Path("/proc/self/status")  # Linux hands the peak of the parent down in ru_maxrss
lines = status.read_text().splitlines() if status.exists() else []
peaks = [int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
print(*(peaks or [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]))
"""


def reduced_sweep(points: int) -> Sweep:
    """Random bicycles at ten speeds, reduced to quantiles."""
    return sweep_of(
        points // 10, outputs=["largest_growth_rate", "smallest_damping_ratio"],
        reduce={"quantiles": [0.05, 0.5, 0.95]}, grid={"speed_m_s": {"from": 2, "to": 20, "count": 10}},
    )  # fmt: skip


def peak_memory(points: int) -> tuple[float, float]:
    """Peak memory (MB) and seconds of a whole sweep with reductions, in a process of its own."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        found = subprocess.run(
            [sys.executable, "-c", MEMORY, str(points), folder], capture_output=True, text=True, check=True
        )
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return float(found.stdout.split()[-1]) / unit, time.perf_counter() - start


def critical(order: int, repeats: int) -> tuple[float, float, int, int]:
    """Seconds of grid and of pencil; crossings of each."""
    linear = tyre_model(order).linear_model()
    found = critical_speeds(linear)
    on_grid = grid_crossings(linear)
    grid, pencil = alternating(lambda: grid_crossings(linear), lambda: critical_speeds(linear), repeats)
    return grid, pencil, len(on_grid), len(found)


def grid_crossings(linear: LinearModel, count: int = 400, top: float = 60.0) -> list[float]:
    """Crossings by the usual way: roots on a grid, joined by nearness, sign changes polished by Brent's method."""
    from scipy.optimize import brentq, linear_sum_assignment

    speeds = np.linspace(0.05, top, count)
    values = linear.eigenvalues(speeds)
    for k in range(1, count):
        _, order = linear_sum_assignment(np.abs(values[k - 1][:, None] - values[k][None]))
        values[k] = values[k][order]
    found = []
    for k, i in zip(*np.nonzero(np.diff(np.sign(values.real), axis=0)), strict=True):
        if values[k, i].imag < 0:
            continue
        target = values[k : k + 2, i].mean()

        def real(v: float, target: complex = target) -> float:
            here = linear.eigenvalues(v)
            return float(here[np.abs(here - target).argmin()].real)

        if real(speeds[k]) * real(speeds[k + 1]) < 0:
            found.append(float(brentq(real, speeds[k], speeds[k + 1], xtol=1e-12)))
    return found


def gradients(count: int, order: int, repeats: int) -> Pair:
    """Eigenvalues alone, and with their derivatives in every parameter, at many speeds."""
    model, speeds = tyre_model(order), np.linspace(1, 30, count)
    linear = model.linear_model()
    return alternating(
        lambda: eigenvalues(linear.state_matrix(speeds), solver=lapack), lambda: sensitivities(model, speeds), repeats
    )


def cluster(count: int, repeats: int) -> Pair:
    """Two threads, and a dask.distributed LocalCluster of two worker processes that is up and warm."""
    from distributed import LocalCluster

    sweep = sweep_of(count)
    small = replace(sweep, points_per_part=2048, samples=2048 * 16)
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=40) as local:
        engine = on_cluster(local.scheduler_address)
        drain(small, engine)
        return alternating(lambda: drain(sweep, in_threads(2)), lambda: drain(sweep, engine), repeats)


def machine() -> dict[str, str]:
    """Processor, cores, system and versions."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    name = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line.split(":")[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")]
        name = lines[0] if lines else name
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    found = {"processor": name, "cores": str(cores), "system": platform.system(), "python": platform.python_version()}
    for package in ("numpy", "scipy", "numba", "distributed", "BicycleParameters"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    found["load"] = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return found


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


SOLVERS: dict[str, Solver] = {"numpy": lapack, "fast": compiled}
