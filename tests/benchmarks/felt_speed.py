"""Print the table of the speed that a user feels: ``python -m tests.benchmarks.felt_speed``, a few minutes.

Processor time of one thread; each figure is the least of several runs. Other solvers run beside ours in the same
process, so that their ratio holds on a loaded machine too. Name rows to print these alone: ``... felt_speed commands``.
"""

import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import critical_speeds, modes
from studies.diagnosis import diagnose, read_measurement
from studies.sweep import build_sweep, run_sweep
from tests.benchmarks.test_speed import COUNT, tyre_model
from tests.validation.blind import histories
from tests.validation.blind.generator import modal_case

Row = tuple[str, str, str]  # figure, measured with unit, compared with

SPEEDS = np.linspace(0.5, 30, 60)  # m/s
GRID = np.linspace(0.1, 30, 400)  # m/s, of a search for critical speeds by a grid
REFUSED = (
    ("critical", "nosuch"),
    ("diagnose", "nosuch"),
    ("run", "nosuch.toml"),
    ("run", "--out", "/proc/x"),
    ("simulate", "benchmark", "--speed", "5", "--duration", "3", "--input", "nosuch", "--out", "s"),
    ("chart", "benchmark", "--x", "nosuch=1:2", "--y", "speed=1:12", "--out", "c"),
    ("tyre", "fit", "nosuch", "--out", "f"),
    ("modes", "benchmark", "--speeds", "-3"),
    ("look", "nosuch.csv"),
)


def processor_time(work: Callable[[], Any], runs: int = 30) -> float:
    """Least processor time of ``work``, s, in ``runs`` calls after a first one."""
    work()
    durations = []
    for _ in range(runs):
        begin = time.process_time()
        work()
        durations.append(time.process_time() - begin)
    return min(durations)


def command_time(*arguments: str, folder: str) -> float:
    """Processor time, s, of ``velotyre`` with these ``arguments`` in a ``folder``, with all processes that it starts.

    The least of three, for the first has to read files from the disk.
    """
    durations = []
    for _ in range(3):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(["velotyre", *arguments], cwd=folder, capture_output=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        durations.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return min(durations)


def eigenvalues() -> Iterator[Row]:
    """Eigenvalues of one bicycle along speed."""
    speeds = np.linspace(0.1, 30, COUNT)
    for order in (8, 12):
        linear = tyre_model(order).linear_model()
        matrices = linear.state_matrix(speeds)
        ours = processor_time(lambda linear=linear: linear.eigenvalues(speeds)) / COUNT
        numpy = processor_time(lambda matrices=matrices: np.linalg.eigvals(matrices), runs=3) / COUNT
        yield f"eigenvalues of a point, {order} states", f"{1e6 * ours:.2f} us", f"numpy, stacked: {1e6 * numpy:.2f} us"


def names() -> Iterator[Row]:
    """Named modes of one bicycle."""
    linear = tyre_model(8).linear_model()
    ours = processor_time(lambda: modes(linear, SPEEDS))
    numpy = processor_time(lambda: [np.linalg.eig(linear.state_matrix([v])) for v in SPEEDS], runs=5)
    yield (
        "one bicycle, 60 speeds, named",
        f"{1e3 * ours:.2f} ms",
        f"numpy, unnamed, a speed a call: {1e3 * numpy:.2f} ms",
    )


def critical() -> Iterator[Row]:
    """Critical speeds of one model."""
    for order in (8, 12):
        model = tyre_model(order)
        matrices = model.linear_model().state_matrix(GRID)
        ours = processor_time(lambda model=model: critical_speeds(model))
        numpy = processor_time(lambda matrices=matrices: np.linalg.eigvals(matrices), runs=5)
        yield (
            f"critical speeds, {order} states",
            f"{1e3 * ours:.2f} ms",
            f"numpy on {len(GRID)} points: {1e3 * numpy:.2f} ms",
        )


def _diagnose(folder: Path) -> tuple[float, str]:
    """Processor time, s, of the diagnosis of the measurement in a ``folder``, and its verdict."""
    measurement = read_measurement(folder / "MEASUREMENT.toml")
    begin = time.process_time()
    found = diagnose(measurement)
    return time.process_time() - begin, found.verdict.verdict


def modal() -> Iterator[Row]:
    """A modal table of 36 rows: weave and wobble, ratios, a soft front frame hidden."""
    with tempfile.TemporaryDirectory() as name:
        rng = np.random.default_rng(5)
        modal_case(Path(name), hidden=("front_compliance",), rng=rng, points=18, bicycle="benchmark")
        seconds, verdict = _diagnose(Path(name))
    yield "modal table of 36 rows", f"{seconds:.1f} s", verdict


def history() -> Iterator[Row]:
    """Histories of 4 runs, 1600 samples and two channels, full search."""
    channels = dict(histories.CHANNELS)
    del histories.CHANNELS["yaw_rate_rad_s"]
    try:
        for hidden, seed in ((("steer_damper",), 3), (("steer_damper", "front_compliance"), 5)):
            with tempfile.TemporaryDirectory() as name:
                histories.history_case(
                    Path(name),
                    hidden=hidden,
                    rng=np.random.default_rng(seed),
                    runs=4,
                    duration=1599 * histories.SAMPLE,
                    bicycle="benchmark",
                )
                seconds, verdict = _diagnose(Path(name))
            yield f"histories, {len(hidden)} effect(s) hidden", f"{seconds:.1f} s", verdict
    finally:
        histories.CHANNELS.clear()
        histories.CHANNELS.update(channels)


def sweep() -> Iterator[Row]:
    """Growth rates of 100,000 bicycles at one speed, written to a file."""
    content = {
        "model": {
            "bicycle": "benchmark",
            "effects": {"relaxation_length": {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}},
        },
        "samples": 100_000,
        "sampled": {"mB": {"sd": 1.0}, "xB": {"sd": 0.01}, "c": {"sd": 0.002}},
        "outputs": ["max_growth_rate"],
        "grid": {"speed_m_s": [5.0]},
    }
    with tempfile.TemporaryDirectory() as name:
        begin = time.process_time()
        run_sweep(build_sweep(content), Path(name) / "sweep.zarr")
        seconds = time.process_time() - begin
    yield "sweep of 100,000 bicycles", f"{seconds:.2f} s", ""


def commands() -> Iterator[Row]:
    """Commands from the shell, imports included."""
    with tempfile.TemporaryDirectory() as folder:
        yield "diagnose kooijman2008", f"{command_time('diagnose', 'kooijman2008', folder=folder):.2f} s", ""
        yield "velotyre --help", f"{command_time('--help', folder=folder):.2f} s", ""
        slowest = max((command_time(*arguments, folder=folder), " ".join(arguments)) for arguments in REFUSED)
        yield f"slowest of {len(REFUSED)} refusals", f"{slowest[0]:.2f} s", slowest[1]
        yield "run", f"{command_time('run', '--workers', '1', '--out', 'out', folder=folder):.1f} s", ""


ROWS = {each.__name__: each for each in (eigenvalues, names, critical, modal, history, sweep, commands)}


def main(chosen: list[str]) -> None:
    """Print the rows whose functions are ``chosen``; all if there are none."""
    unknown = set(chosen) - set(ROWS)
    if unknown:
        sys.exit(f"unknown row {min(unknown)!r}; known: {', '.join(ROWS)}")
    print("| figure | measured | beside |\n|---|---|---|")
    for name in chosen or ROWS:
        for figure, measured, beside in ROWS[name]():
            print(f"| {figure} | {measured} | {beside} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
