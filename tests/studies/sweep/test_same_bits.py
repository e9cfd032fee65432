"""Equal numbers, to the last bit, for every chunk, part size, engine and file format."""

import numpy as np
import pytest
from sweep_examples import MEASURED, RANDOM
from sweep_results import identical, load

from studies.sweep import build_sweep, compute, in_loop, in_processes, in_threads, on_cluster, run_sweep


@pytest.mark.parametrize(("points", "engine"), [(300, in_threads(3)), (4096, in_threads(2)), (10**6, in_loop())])
def test_same_bits_for_every_part_size_and_thread_count(reference, tmp_path, points, engine):
    sweep = build_sweep(RANDOM | {"points_per_part": points})
    assert identical(run_sweep(sweep, tmp_path / "result.zarr", engine=engine), reference)


def test_same_bits_of_critical_speeds_that_are_found_together():
    sweep = build_sweep(RANDOM | {"outputs": ["critical_speeds"], "grid": {"c": [0.06, 0.08]}, "samples": 50})
    whole = compute(sweep, 0, 100)["critical_speeds"]
    parts = [compute(sweep, start, min(start + 32, 100))["critical_speeds"] for start in range(0, 100, 32)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert np.isfinite(whole).sum() >= 100


def test_same_bits_for_any_chunk_of_measured_tyres():
    sampled = {"tyre_covariance": True, "relative_cornering_stiffness_sd": 0.03, "mB": {"sd": 3.0}}
    content = RANDOM | {"model": MEASURED, "sampled": sampled, "outputs": ["eigenvalues", "parameters"]}
    sweep = build_sweep(content | {"grid": {"pressure_bar": [4.0, 5.5], "speed_m_s": [3.0, 9.0, 14.0]}})
    whole = compute(sweep, 0, sweep.items)
    for start, stop in ((0, 1), (1, 2), (681, 684), (17, 1399)):
        for name, values in compute(sweep, start, stop).items():
            np.testing.assert_array_equal(values, whole[name][start:stop])


def test_same_bits_in_processes(reference, tmp_path):
    assert identical(run_sweep(build_sweep(RANDOM), tmp_path / "result.zarr", engine=in_processes(2)), reference)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_same_bits_on_a_cluster(reference, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        engine = on_cluster(cluster.scheduler_address)
        assert identical(run_sweep(build_sweep(RANDOM), tmp_path / "result.zarr", engine=engine), reference)


def test_a_new_parameter_does_not_change_the_draws_of_the_others(reference, tmp_path):
    more = RANDOM | {"sampled": {"zH": {"sd": 0.01}, **RANDOM["sampled"]}}
    found = load(run_sweep(build_sweep(more), tmp_path / "more.zarr")).parameters.sel(parameter="mB")
    np.testing.assert_array_equal(found, load(reference).parameters.sel(parameter="mB"))


def test_reductions_are_those_of_the_kept_samples(reference, tmp_path):
    reduced = RANDOM | {"outputs": ["max_growth_rate"], "reduce": {"quantiles": [0.0, 0.1, 0.5, 0.99, 1.0]}}
    kept = load(reference).max_growth_rate
    out, *others = (
        run_sweep(build_sweep(reduced | {"points_per_part": points}), tmp_path / f"{points}.zarr")
        for points in (300, 3000, 10**6)
    )
    assert all(identical(other, out) for other in others)
    found = load(out)
    for q in found["quantile"].values:
        exact = kept.quantile(q, "sample", method="inverted_cdf")
        np.testing.assert_array_equal(found.max_growth_rate_quantiles.sel(quantile=q), exact)
    np.testing.assert_array_equal(found.max_growth_rate_max, kept.max("sample"))
    np.testing.assert_array_equal(found.max_growth_rate_min_sample, kept.argmin("sample"))
    np.testing.assert_array_equal(found.max_growth_rate_above_zero, (kept > 0).sum("sample"))
    assert (found.max_growth_rate_count == 700).all()


def test_netcdf_holds_the_same_numbers(reference, tmp_path):
    import xarray as xr

    pytest.importorskip("netCDF4")
    pytest.importorskip("dask")
    out = run_sweep(build_sweep(RANDOM), tmp_path / "result.nc")
    with xr.open_dataset(out, engine="netcdf4") as found:
        same = load(reference)
        np.testing.assert_array_equal(found.eigenvalues_imag, same.eigenvalues.imag)
        np.testing.assert_array_equal(found.max_growth_rate, same.max_growth_rate)
        assert found.eigenvalues_real.attrs["units"] == "1/s"
        assert found.attrs["fingerprint"] == same.attrs["fingerprint"]
    assert run_sweep(build_sweep(RANDOM), out) == out  # finished: nothing to do
    other = run_sweep(build_sweep(RANDOM | {"points_per_part": 300}), tmp_path / "other.nc", engine=in_threads(2))
    assert identical(other, out)


def test_netcdf_holds_names_as_text(tmp_path):
    import xarray as xr

    pytest.importorskip("netCDF4")
    content = {"model": MEASURED, "outputs": ["critical_speeds"], "grid": {"tyre": ["Tyre1", "Tyre2"]}}
    stored = load(run_sweep(build_sweep(content), tmp_path / "result.zarr"))
    with xr.open_dataset(run_sweep(build_sweep(content), tmp_path / "result.nc"), engine="netcdf4") as found:
        assert found.tyre.values.tolist() == ["Tyre1", "Tyre2"]
        here = found.critical_speeds.sel(tyre="Tyre2", crossing_mode="weave", as_speed_grows="stabilising")
        there = stored.critical_speeds.sel(tyre="Tyre2", crossing_mode="weave", as_speed_grows="stabilising")
        np.testing.assert_array_equal(here, there)
        assert np.isfinite(here).any()
