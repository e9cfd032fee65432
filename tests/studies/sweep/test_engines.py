"""Engines: which is taken, and those that fail: lost workers, no scheduler, a worker with other software."""

import time
from concurrent.futures import ThreadPoolExecutor
from unittest.mock import MagicMock

import pytest
from sweep_examples import RANDOM

from studies.sweep import build_sweep, compute, on_cluster, run_sweep
from tyre.ground import InputError


def test_other_software_on_a_worker_is_refused():
    sweep = build_sweep(RANDOM)
    vars(sweep)["fingerprint"] = "as computed elsewhere"
    with pytest.raises(
        InputError, match=r"the worker on .* has .*velotyre.*differences from the start.*install the same versions"
    ):
        compute(sweep, 0, 1)


def test_no_scheduler(monkeypatch, tmp_path):
    pytest.importorskip("distributed")
    monkeypatch.setattr("studies.sweep.engines.PATIENCE", 0.3)
    with pytest.raises(InputError, match=r"no dask scheduler answers at tcp://127.0.0.1:9 .*; 0 of 1400 bicycles"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://127.0.0.1:9"))


@pytest.mark.parametrize(("workers", "error", "words"), [
    ({"a": 1}, "lost", r"all workers of tcp://x:1 are lost; start new ones with 'dask worker tcp://x:1'"),
    ({}, None, r"the scheduler at tcp://x:1 has no workers; start some with 'dask worker tcp://x:1'"),
    ({"a": 1}, "killed", "workers of tcp://x:1 died on the same points"),
    ({"a": 1}, "gone", "the connection to the scheduler at tcp://x:1 was lost"),
])  # fmt: skip
def test_a_cluster_that_fails(monkeypatch, tmp_path, workers, error, words):
    distributed = pytest.importorskip("distributed")
    client = MagicMock(nthreads=lambda: workers, get_executor=lambda **settings: ThreadPoolExecutor(1))

    def failing(sweep, start, stop):
        if error == "lost":
            workers.clear()
            time.sleep(0.3)
        raise distributed.KilledWorker("compute", None, 3) if error == "killed" else OSError("closed")

    monkeypatch.setattr("studies.sweep.engines.PATIENCE", 0.1)
    monkeypatch.setattr(distributed, "Client", lambda *arguments, **settings: client)
    monkeypatch.setattr("studies.sweep.run.compute", failing)
    with pytest.raises(InputError, match=f"{words}.*; 0 of 1400 bicycles are finished"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://x:1"))
