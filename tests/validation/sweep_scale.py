"""What a sweep costs beyond its arithmetic: time, memory, bytes and overhead of critical speeds on a dask cluster.

Random bicycles with 8 states, all their critical speeds, through the same path as `velotyre sweep --scheduler`: a tenth
of the bicycles in parts of the usual size and of the measured one, then all of them; and growth rates of ten times as
many at ten speeds, which take microseconds. The overhead is the share of the workers' time in which they do not
compute. How far the cost follows the number of bicycles, the two sizes show.
"""

import os
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from studies.sweep import Piece, Sweep, build_sweep, compute, on_cluster, run_sweep, usual_items

Row = dict[str, Any]
MEGABYTE = 1e6
MOST_OVERHEAD = 0.05
MODEL = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}},
}
SPREAD = {"mB": 1.0, "xB": 0.01, "zB": 0.01, "mH": 0.1, "w": 0.01, "c": 0.002}


def sweep_of(samples: int, seed: int, outputs: list[str], grid: Row) -> Sweep:
    """Distinct bicycles on tyres."""
    sampled = {key: {"sd": sd} for key, sd in SPREAD.items()}
    content = {"model": MODEL, "samples": samples, "seed": seed, "sampled": sampled, "outputs": outputs, "grid": grid}
    return build_sweep(content)


def run(*, out: Path, seed: int, bicycles: int = 100_000, workers: int = 2, scheduler: str = "") -> Row:
    """Measure on a cluster of so many local ``workers``, or on that of a ``scheduler``."""
    from distributed import LocalCluster

    few = sweep_of(max(bicycles // 10, 1), seed, ["critical_speeds"], {})
    rates = {"speed_m_s": {"from": 2, "to": 20, "count": 10}}
    cases = (
        ("critical speeds, parts of the usual size", few, usual_items(few)),
        ("critical speeds", few, None),
        ("critical speeds", sweep_of(bicycles, seed, ["critical_speeds"], {}), None),
        ("growth rates at 10 speeds", sweep_of(10 * bicycles, seed, ["max_growth_rate"], rates), None),
    )
    local = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": 40}
    rows = []
    with nullcontext() if scheduler else LocalCluster(**local) as cluster:
        address = scheduler or cluster.scheduler_address
        for name, sweep, items in cases:
            with tempfile.TemporaryDirectory(dir=out) as folder:
                rows.append({"case": name} | measured(sweep, Path(folder), address, items))
    load = f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores" if hasattr(os, "getloadavg") else "unknown"
    return {"load": load, "rows": rows, "overhead_below_5_percent": _all_below(rows[1:])}


def _all_below(rows: list[Row]) -> bool:
    return all(row["overhead_share"] < MOST_OVERHEAD for row in rows)


def measured(sweep: Sweep, folder: Path, address: str, items: int | None = None) -> Row:
    """One sweep from beginning to end, on workers that know it already."""
    from distributed import Client

    if items:
        sweep = replace(sweep, points_per_part=items * sweep.points_per_item)
    with Client(address, set_as_default=False) as client:
        workers = sum(client.nthreads().values())
        client.run(_warm, sweep)
    engine, out, works = on_cluster(address), folder / "result.zarr", list[tuple[float, ...]]()
    spans: Row = {}

    def timed(work: Callable[[int, int], Any], pieces: Iterable[Piece]) -> Iterator[tuple[Piece, Any]]:
        spans["began"] = time.perf_counter()
        for piece, (arrays, *cost) in engine(partial(_timed, work), pieces):
            works.append(tuple(cost))
            yield piece, arrays
        spans["ended"] = time.perf_counter()
        kept = out.with_name(f"{out.name}.parts").glob("*.part")
        spans["parts_MB"] = sum(part.stat().st_size for part in kept) / MEGABYTE

    began = time.perf_counter()
    result = run_sweep(sweep, out, engine=timed)
    ended, elapsed, work = time.perf_counter(), spans["ended"] - spans["began"], sum(row[0] for row in works)
    return {
        "bicycles": sweep.items, "points": sweep.items * sweep.points_per_item, "workers": workers,
        "parts": len(works), "check_s": spans["began"] - began, "compute_s": elapsed, "join_s": ended - spans["ended"],
        "work_cpu_per_bicycle_s": sum(row[1] for row in works) / sweep.items,
        "overhead_share": 1 - work / (workers * elapsed),
        "overhead_per_part_s": (workers * elapsed - work) / len(works), "parts_MB": spans["parts_MB"],
        "result_MB": sum(file.stat().st_size for file in result.rglob("*") if file.is_file()) / MEGABYTE,
        "main_process_peak_MB": _peak() / MEGABYTE, "worker_peak_MB": max(row[2] for row in works) / MEGABYTE,
    }  # fmt: skip


def _timed(work: Callable[[int, int], Any], start: int, stop: int) -> tuple[Any, float, float, float]:
    """Result on a worker, its seconds there, those of its processor, and the worker's peak memory in bytes."""
    began, cpu = time.perf_counter(), time.thread_time()
    result = work(start, stop)
    return result, time.perf_counter() - began, time.thread_time() - cpu, _peak()


def _warm(sweep: Sweep) -> None:
    compute(sweep, 0, 1)


def _peak() -> float:
    """Largest memory of this process so far, bytes; Linux hands the peak of the parent down in ru_maxrss."""
    import resource

    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    peaks = [1024.0 * int(line.split()[1]) for line in lines if line.startswith("VmHWM")]
    return peaks[0] if peaks else 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
