"""``velotyre validate sweep-scale``: what it counts, and what it makes of two runs."""

import json
from pathlib import Path

import pytest

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from studies.sweeps.engines import in_loop
from studies.sweeps.run import run_sweep
from studies.validations import sweep_scale
from studies.validations._speed_timing import sweep_of


def test_the_clock_counts_parts_seconds_and_bytes(tmp_path):
    sweep = sweep_of(100, seed=3, points_per_part=40, outputs=["largest_growth_rate"])
    clock = sweep_scale.Clock(tmp_path / "result.zarr")
    plain = run_sweep(sweep, tmp_path / "plain.zarr")
    result = run_sweep(sweep, clock.out, engine=clock.around(in_loop()))
    assert result.exists()
    assert (result / "zarr.json").read_bytes() == (plain / "zarr.json").read_bytes()
    assert len(clock.work) == 1  # whole blocks of 2048
    assert 0 < sum(clock.work) <= clock.ended - clock.began
    assert clock.part_bytes > 100 * 8
    assert clock.worker_peak > 10e6


def test_extrapolation_by_hand():
    """0.01 s a second of heartbeats and 0.02 s a part; 0.01 s of work a bicycle, parts of at most ten seconds."""
    common = {
        "workers": 2, "work_cpu_per_bicycle_s": 0.01, "check_s": 1.0, "join_s": 2.0, "main_process_peak_MB": 300.0,
        "worker_peak_MB": 200.0,
    }  # fmt: skip
    small = {"bicycles": 1000, "parts": 50, "compute_s": 10.0, "main_process_cpu_per_part_s": (0.1 + 1.0) / 50}
    large = {"bicycles": 10_000, "parts": 100, "compute_s": 100.0, "main_process_cpu_per_part_s": (1.0 + 2.0) / 100,
             "parts_MB": 5.0, "result_MB": 1.0}  # fmt: skip
    found = sweep_scale.extrapolated(common | small, common | large, 1_000_000)
    assert found["parts"] == 1000
    assert found["work_per_part_cpu_s"] == pytest.approx(10)
    assert found["main_process_cpu_per_part_s"] == pytest.approx(0.02)
    assert found["most_workers_that_one_client_feeds"] == pytest.approx(500)
    assert found["work_cpu_hours"] == pytest.approx(10_000 / 3600)
    short = small | {"main_process_cpu_per_part_s": 0.0}
    assert sweep_scale.extrapolated(common | short, common | large, 10**6)["main_process_cpu_per_part_s"] is None
    assert found["check_and_join_hours"] == pytest.approx(300 / 3600)
    assert (found["parts_GB"], found["result_GB"]) == (pytest.approx(0.5), pytest.approx(0.1))


def test_critical_speeds_of_distinct_bicycles():
    sweep = sweep_scale.critical_sweep(1000, 7)
    assert (sweep.items, sweep.seed, sweep.outputs, sweep.speeds) == (1000, 7, ("critical_speeds",), ())


def test_committed_result_and_the_page_agree():
    root = Path(__file__).parents[3]
    result = json.loads((root / "data" / "validation" / "sweep_scale.json").read_text())
    page = (root / "docs" / "sweeps.md").read_text(encoding="utf-8")
    _, small, large, rates = result["rows"]
    assert (small["bicycles"], large["bicycles"], rates["bicycles"]) == (10**4, 10**5, 10**6)
    assert result["overhead_below_5_percent"]
    shares = " | ".join(f"{100 * row['overhead_share']:.1f} %" for row in (small, large, rates))
    assert f"| overhead: share of the workers' time in which they do not compute | {shares} |" in page
    assert f"| parts | {small['parts']} | {large['parts']} | {rates['parts']} |" in page
    found = result["extrapolated"]
    assert sweep_scale.extrapolated(result["rows"][0], large, 10**7) == pytest.approx(found)
    assert f"{found['work_cpu_hours']:.0f} hours of one processor" in page
    assert f"{found['hours_as_measured']:.0f} hours by the\nclock" in page
    assert f"{found['parts_GB']:.1f} GB of parts, {found['result_GB']:.2f} GB of\nresult" in page
