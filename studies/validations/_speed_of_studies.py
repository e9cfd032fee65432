"""Sweeps, critical speeds and sensitivities: growth with size, memory, and seconds against the usual way."""

import subprocess
import sys
import tempfile
import time
from dataclasses import replace

import numpy as np

from bicycle.eigenvalues.solvers import eigenvalues, lapack
from bicycle.linear_model import LinearModel
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities
from studies.sweeps.engines import in_threads, on_cluster
from studies.sweeps.spec import Sweep
from studies.validations._speed_timing import Pair, alternating, drain, sweep_of, tyre_model

MEMORY = """
import resource, sys
from pathlib import Path
from studies.sweeps.run import run_sweep
from studies.sweeps.engines import in_threads
from studies.validations._speed_of_studies import reduced_sweep
run_sweep(reduced_sweep(int(sys.argv[1])), Path(sys.argv[2]) / "result.zarr", engine=in_threads(2))
status = Path("/proc/self/status")  # Linux hands the peak of the parent down in ru_maxrss
lines = status.read_text().splitlines() if status.exists() else []
peaks = [int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
print(*(peaks or [resource.getrusage(resource.RUSAGE_SELF).ru_maxrss]))
"""


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
