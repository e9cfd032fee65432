"""Engines: which is taken, and those that fail: lost workers, no scheduler, a worker with other software."""

import numpy as np
import pytest
from sweep_examples import RANDOM

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from studies.sweeps.chunk import compute
from studies.sweeps.engines import on_cluster
from studies.sweeps.part_size import here
from studies.sweeps.run import run_sweep
from studies.sweeps.sweep_file import build_sweep
from tyre.base.errors import InputError


def test_other_software_on_a_worker_is_refused():
    sweep = build_sweep(RANDOM)
    vars(sweep)["fingerprint"] = "as computed elsewhere"
    with pytest.raises(
        InputError, match=r"the worker on .* computes with .*velotyre.*other than what .*install the same versions"
    ):
        compute(sweep, 0, 1)


def test_no_scheduler(monkeypatch, tmp_path):
    pytest.importorskip("distributed")
    monkeypatch.setattr("studies.sweeps.engines.PATIENCE", 0.3)
    with pytest.raises(InputError, match=r"no dask scheduler answers at tcp://127.0.0.1:9 .*; 0 of 1400 bicycles"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://127.0.0.1:9"))


def test_workers_that_are_all_lost_are_not_waited_for_without_end(monkeypatch):
    from concurrent.futures import Future

    from studies.sweeps.engines import NoWorkers, _spread

    class Pool:
        def submit(self, *work):
            return Future()  # nobody takes it

    monkeypatch.setattr("studies.sweeps.engines.PATIENCE", 0.01)
    with pytest.raises(NoWorkers):
        next(_spread(Pool(), print, [(0, 1)], 1, alive=dict))


@pytest.mark.parametrize(
    ("workers", "error", "words"),
    [
        ({"a": 1}, "lost", r"all workers of tcp://x:1 are lost; start new ones with 'dask worker tcp://x:1'"),
        ({}, None, r"the scheduler at tcp://x:1 has no workers; start some with 'dask worker tcp://x:1'"),
        ({"a": 1}, "killed", "workers of tcp://x:1 died while they worked on the same points"),
        ({"a": 1}, "gone", "the scheduler at tcp://x:1 went away"),
    ],
)
def test_a_cluster_that_fails(monkeypatch, tmp_path, workers, error, words):
    distributed = pytest.importorskip("distributed")
    from concurrent.futures import ThreadPoolExecutor

    from studies.sweeps.engines import NoWorkers

    class Client:
        def __init__(self, *arguments, **settings):
            pass

        def __enter__(self):
            return self

        def __exit__(self, *details):
            return None

        def nthreads(self):
            return workers

        def run(self, function):
            pass

        def get_executor(self, **settings):
            return ThreadPoolExecutor(1)

    def failing(sweep, start, stop):
        if error == "lost":
            raise NoWorkers
        raise distributed.KilledWorker("compute", None, 3) if error == "killed" else OSError("closed")

    monkeypatch.setattr(distributed, "Client", Client)
    monkeypatch.setattr("studies.sweeps.run.compute", failing)
    with pytest.raises(InputError, match=f"{words}.*; 0 of 1400 bicycles are finished"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://x:1"))


def test_many_tracked_bicycles_go_to_processes_and_the_rest_to_threads(monkeypatch):
    """Threads cannot share what the interpreter does; processes take a second to start."""
    for name in ("in_threads", "in_processes"):
        monkeypatch.setattr(f"studies.sweeps.part_size.{name}", lambda workers, name=name: (name, workers))

    def chosen(outputs, masses, workers):
        grid = {"mB": np.linspace(80, 90, masses).tolist()}
        if outputs == ["eigenvalues"]:
            grid["speed_m_s"] = [5.0]
        return here(build_sweep({"model": {"bicycle": "benchmark"}, "grid": grid, "outputs": outputs}), workers)

    assert chosen(["critical_speeds"], 300, 2) == ("in_processes", 2)
    assert chosen(["critical_speeds"], 3, 2) == ("in_threads", 2)
    assert chosen(["eigenvalues"], 300, 2) == ("in_threads", 2)
    assert chosen(["critical_speeds"], 300, 1) == ("in_threads", 1)
