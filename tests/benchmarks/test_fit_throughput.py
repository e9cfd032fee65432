"""Throughput of ``velotyre tyre fit``: 1000 recordings of 10 000 samples in under 3 minutes on 2 cores, on request.

Run with ``pytest tests/benchmarks/test_fit_throughput.py --benchmark-only``. A smaller sample is timed and scaled.
"""

import resource

import numpy as np
import pytest

from tyre.fits import fit_campaign
from tyre.rig import Protocol, default_effects, simulate_sweep, synthetic_tyre

pytest.importorskip("pytest_benchmark")
RECORDINGS, TARGET_S = 60, 180.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    from tyre.fits import write_csv
    from tyre.recordings import Condition

    place = tmp_path_factory.mktemp("throughput")
    rng = np.random.default_rng(0)
    effects = default_effects(rng)
    # 50 s at 200 Hz are 10 000 samples
    protocol = Protocol(cycles=3, slip_rate=12 * np.deg2rad(4.0) / 50.0)
    for number in range(RECORDINGS):
        load = 340.0 + 10.0 * (number % 10)
        condition = Condition(tyre="Synthetic", load=load, pressure=5.5e5, surface="flat", temperature=22.0)
        tyre = synthetic_tyre(load=load, pressure=5.5e5)
        run = simulate_sweep(tyre=tyre, condition=condition, protocol=protocol, effects=effects, rng=rng)
        assert run.time.size == 10_000
        write_csv(run, place / f"{number:03d}.csv")
    return place


def test_thousand_recordings_in_three_minutes(benchmark, folder, tmp_path):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def work():
        return fit_campaign(folder, cache_folder=tmp_path, jobs=2, progress=False)

    campaign = benchmark.pedantic(work, rounds=1)
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0
    assert sum(len(condition.sweeps) for condition in campaign.conditions) == RECORDINGS
    scaled = benchmark.stats.stats.mean / RECORDINGS * 1000
    benchmark.extra_info["scaled_to_1000_recordings_s"] = scaled
    benchmark.extra_info["memory_grown_MB"] = grown
    assert scaled < TARGET_S
    assert grown < 60.0  # 60 recordings of 10 000 samples in seven channels held at once would be 34 MB more
