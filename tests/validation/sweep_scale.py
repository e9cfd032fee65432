"""What a sweep costs beyond its arithmetic: time, memory, bytes and overhead of critical speeds on a dask cluster.

Random bicycles with 8 states, all their critical speeds, through the same path as `velotyre sweep --scheduler`: a tenth
of the bicycles in parts of the usual size and of the measured one, then all of them; and growth rates of ten times as
many at ten speeds, which take microseconds. The overhead is the share of the workers' time in which they do not
compute. What 10^7 bicycles take follows from the largest run in proportion; how far that holds, the two sizes show.
"""

import json
import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import Model, effect_class, load_bicycle
from studies.sweep import Engine, Piece, Sweep, build_sweep, chosen_items, compute, on_cluster, run_sweep, usual_items

Row = dict[str, Any]
MEGABYTE = 1e6
MOST_OVERHEAD = 0.05
TYRE = {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}
SPREAD = {"mB": 1.0, "xB": 0.01, "zB": 0.01, "mH": 0.1, "w": 0.01, "c": 0.002}


def effects_of(order: int) -> dict[str, dict[str, float]]:
    """Effects of a model with so many states on the benchmark bicycle: 8 on tyres; 12 with flexible front and rider."""
    if order == 8:
        return {"relaxation_length": TYRE}
    hinge = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
    rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
    return {"relaxation_length": TYRE, "front_compliance": hinge, "rider_lean": rider}


def tyre_model(order: int) -> Model:
    """The benchmark bicycle with the effects of :func:`effects_of`."""
    effects = [effect_class(name)(**values) for name, values in effects_of(order).items()]
    return Model(load_bicycle("benchmark"), tuple(effects))


def sweep_of(samples: int, order: int = 8, **changes: Any) -> Sweep:
    """Distinct bicycles with so many states at 8 m/s."""
    content = {
        "model": {"bicycle": "benchmark", "effects": effects_of(order)}, "samples": samples, "seed": 1,
        "outputs": ["eigenvalues"], "grid": {"speed_m_s": [8.0]},
        "sampled": {key: {"sd": sd} for key, sd in SPREAD.items()},
    }  # fmt: skip
    return build_sweep(content | changes)


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
    for package in ("numpy", "scipy", "distributed"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    found["load"] = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    return found


def run(
    *, out: Path, seed: int, bicycles: int = 100_000, workers: int = 2, target: int = 10_000_000, scheduler: str = ""
) -> Row:
    """Measure, and say what ``target`` bicycles would take."""
    few = max(bicycles // 10, 1)
    rates: dict[str, Any] = {"grid": {"speed_m_s": {"from": 2, "to": 20, "count": 10}}}
    rates["outputs"] = ["largest_growth_rate"]
    limits = critical_sweep(few, seed)
    rows = list[Row]()
    with _cluster(scheduler, workers) as address:
        for name, sweep, items in (
            ("critical speeds, parts of the usual size", limits, usual_items(limits)),
            ("critical speeds", limits, None),
            ("critical speeds", critical_sweep(bicycles, seed), None),
            ("growth rates at 10 speeds", sweep_of(10 * bicycles, seed=seed, **rates), None),
        ):
            with tempfile.TemporaryDirectory(dir=out) as folder:
                rows.append({"case": name} | measured(sweep, Path(folder), address, items))
            with (out / "sweep_scale.jsonl").open("a", encoding="utf-8") as lines:  # what is there if it is stopped
                lines.write(json.dumps(rows[-1]) + "\n")
    return {
        "what": "seconds, bytes and overhead of sweeps on a dask.distributed cluster", "seed": seed,
        "made_by": f"python -m tests.validation sweep-scale --seed {seed} --bicycles {bicycles}", "machine": machine(),
        "rows": rows, "overhead_below_5_percent": all(row["overhead_share"] < MOST_OVERHEAD for row in rows[1:]),
        "extrapolated": extrapolated(rows[0], rows[2], target),
    }  # fmt: skip


def critical_sweep(count: int, seed: int) -> Sweep:
    """Critical speeds of a number ``count`` of random bicycles, from ``seed``."""
    return sweep_of(count, seed=seed, outputs=["critical_speeds"], grid={})


def extrapolated(small: Row, large: Row, target: int) -> Row:
    """What a number of ``target`` bicycles would take, in proportion to the large run."""
    factor, cpu = target / large["bicycles"], large["work_cpu_per_bicycle_s"]
    times = [[row["compute_s"], row["parts"]] for row in (small, large)]
    own = [row["main_process_cpu_per_part_s"] * row["parts"] for row in (small, large)]
    per_part = float(np.linalg.lstsq(np.array(times), np.array(own))[0][1])
    items = chosen_items(1 / cpu, target, target)
    return {
        "bicycles": target, "parts": -(-target // items), "work_per_part_cpu_s": items * cpu,
        "work_cpu_hours": target * cpu / 3600,
        "check_and_join_hours": factor * (large["check_s"] + large["join_s"]) / 3600,
        "hours_as_measured": factor * large["compute_s"] / 3600, "workers_as_measured": large["workers"],
        "main_process_cpu_per_part_s": per_part if per_part > 0 else None,
        "most_workers_that_one_client_feeds": items * cpu / per_part if per_part > 0 else None,
        "parts_GB": factor * large["parts_MB"] / 1e3, "result_GB": factor * large["result_MB"] / 1e3,
        "main_process_memory_MB": large["main_process_peak_MB"], "worker_memory_MB": large["worker_peak_MB"],
        "work_cpu_per_bicycle_large_over_small": cpu / small["work_cpu_per_bicycle_s"],
    }  # fmt: skip


def measured(sweep: Sweep, folder: Path, address: str, items: int | None = None) -> Row:
    """One sweep from beginning to end, on workers that know it already."""
    from distributed import Client

    if items:
        sweep = replace(sweep, points_per_part=items * sweep.points_per_item)
    with Client(address, set_as_default=False) as client:
        workers = sum(client.nthreads().values())
        client.run(_warm, sweep)
    clock = Clock(folder / "result.zarr")
    began = time.perf_counter()
    result = run_sweep(sweep, clock.out, engine=clock.around(on_cluster(address)))
    ended = time.perf_counter()
    parts, elapsed, work = len(clock.work), clock.ended - clock.began, sum(clock.work)
    return {
        "bicycles": sweep.items, "points": sweep.items * sweep.points_per_item, "workers": workers, "parts": parts,
        "items_per_part": -(-sweep.items // parts), "check_s": clock.began - began, "compute_s": elapsed,
        "join_s": ended - clock.ended, "work_per_bicycle_s": work / sweep.items,
        "work_cpu_per_bicycle_s": clock.work_cpu / sweep.items, "work_per_part_s": work / parts,
        "overhead_share": 1 - work / (workers * elapsed), "overhead_per_part_s": (workers * elapsed - work) / parts,
        "main_process_cpu_per_part_s": clock.own_cpu / parts, "parts_MB": clock.part_bytes / MEGABYTE,
        "result_MB": sum(file.stat().st_size for file in result.rglob("*") if file.is_file()) / MEGABYTE,
        "main_process_peak_MB": _peak() / MEGABYTE, "worker_peak_MB": clock.worker_peak / MEGABYTE,
    }  # fmt: skip


class Clock:
    """Times the work on each part and what is around it; ``out`` is the result."""

    def __init__(self, out: Path) -> None:
        self.out, self.work, self.worker_peak, self.part_bytes = out, list[float](), 0.0, 0
        self.began = self.ended = self.own_cpu = self.work_cpu = 0.0

    def around(self, engine: Engine) -> Engine:
        """The same engine, timed."""

        def timed(work: Callable[[int, int], Any], pieces: Iterable[Piece]) -> Iterator[tuple[Piece, Any]]:
            self.began, cpu = time.perf_counter(), time.process_time()
            for piece, (arrays, seconds, cpu_seconds, peak) in engine(partial(_timed, work), pieces):
                self.work.append(seconds)
                self.work_cpu += cpu_seconds
                self.worker_peak = max(self.worker_peak, peak)
                yield piece, arrays
            self.ended, self.own_cpu = time.perf_counter(), time.process_time() - cpu
            kept = self.out.with_name(f"{self.out.name}.parts").glob("*.part")
            self.part_bytes = sum(part.stat().st_size for part in kept)

        return timed


def _timed(work: Callable[[int, int], Any], start: int, stop: int) -> tuple[Any, float, float, float]:
    """The result on a worker, its seconds there, those of its processor, and the worker's peak memory in bytes."""
    began, cpu = time.perf_counter(), time.thread_time()
    result = work(start, stop)
    return result, time.perf_counter() - began, time.thread_time() - cpu, _peak()


def _warm(sweep: Sweep) -> None:
    compute(sweep, 0, 1)


def _peak() -> float:
    """Largest memory of this process so far, bytes."""
    import resource
    import sys

    status = Path("/proc/self/status")  # Linux hands the peak of the parent down in ru_maxrss
    lines = status.read_text().splitlines() if status.exists() else []
    peaks = [1024.0 * int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
    unit = 1 if sys.platform == "darwin" else 1024
    return peaks[0] if peaks else float(unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)


@contextmanager
def _cluster(scheduler: str, workers: int) -> Iterator[str]:
    if scheduler:
        yield scheduler
        return
    from distributed import LocalCluster

    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None, silence_logs=40) as local:
        yield local.scheduler_address
