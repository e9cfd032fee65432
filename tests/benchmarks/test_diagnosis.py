"""Time of a diagnosis on one core. The processor's time is judged, for machines are shared."""

import dataclasses
import time

import numpy as np

from bicycle.parameters import UNITS
from studies.diagnosis import diagnose, read_measurement
from tests.validation.blind.generator import modal_case
from tests.validation.blind.histories import history_case


def test_thirty_modal_points(tmp_path, benchmark):
    """12 candidates and 10 nuisances: less than 10 s."""
    modal_case(tmp_path, hidden=("steer_damper",), rng=np.random.default_rng(2), points=30, bicycle="benchmark")
    measurement = read_measurement(tmp_path / "MEASUREMENT.toml")
    assert len(measurement.points) == 30
    floating = dict.fromkeys(UNITS, 0.0) | dict(list(measurement.uncertainty.items())[:10])
    measurement = dataclasses.replace(measurement, uncertainty=floating)
    every = [c.identifier for c in measurement.prepare().candidates if c.identifier != "steer_damper"]
    start = time.process_time()
    found = benchmark.pedantic(diagnose, [measurement], {"without": tuple(every[11:])}, rounds=1)
    assert time.process_time() - start < 10
    assert (len(found.kind.candidates), len(found.kind.nuisances)) == (12, 10)
    assert "steer_damper" in found.verdict.equivalent


def test_ten_histories_of_five_seconds(tmp_path, benchmark):
    """100 Hz and three channels: less than 60 s."""
    rng = np.random.default_rng(2)
    history_case(tmp_path, hidden=("steer_damper",), rng=rng, runs=10, duration=5.0, bicycle="browser")
    measurement = read_measurement(tmp_path / "MEASUREMENT.toml")
    assert [len(run.time) for run in measurement.runs] == [501] * 10
    assert len(measurement.runs[0].channels) == 3
    start = time.process_time()
    found = benchmark.pedantic(diagnose, [measurement], rounds=1)
    assert time.process_time() - start < 60
    assert "steer_damper" in found.verdict.equivalent
