"""Sweeps: values against models built by hand; the same bits for every chunk, engine and interruption."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from sweep_results import load, tree

pytest.importorskip("zarr")
xr = pytest.importorskip("xarray")

from bicycle import Model, effect_class, load_bicycle  # noqa: E402
from bicycle.critical.critical_speeds import critical_speeds  # noqa: E402
from bicycle.modal.named_modes import modes  # noqa: E402
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities  # noqa: E402
from studies.cli import main  # noqa: E402
from studies.sweeps.chunk import Worker, compute  # noqa: E402
from studies.sweeps.engines import in_loop, in_processes, in_threads, on_cluster  # noqa: E402
from studies.sweeps.parts import open_parts  # noqa: E402
from studies.sweeps.run import pieces, run_sweep  # noqa: E402
from studies.sweeps.sweep_file import build_sweep, read_sweep  # noqa: E402
from tyre import TyreMap  # noqa: E402
from tyre.base.errors import InputError  # noqa: E402

MODEL = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}},
}
MEASURED = {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 4.0}}}
RANDOM = {
    "model": MODEL, "samples": 700, "seed": 5, "outputs": ["eigenvalues", "largest_growth_rate", "parameters"],
    "points_per_part": 2048, "grid": {"c": [0.06, 0.08], "speed_m_s": [3.0, 8.0, 15.0]},
    "sampled": {"mB": {"sd": 2.0}, "relaxation_length.relaxation_length": {"low": 0.05, "high": 0.15}},
}  # fmt: skip


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The random sweep in a plain loop."""
    return run_sweep(build_sweep(RANDOM), tmp_path_factory.mktemp("reference") / "result.zarr")


def test_grid_values_are_those_of_single_models(tmp_path):
    content = {
        "model": MODEL,
        "grid": {
            "mB": [80.0, 90.0],
            "relaxation_length": {"cornering_stiffness": {"front": [5000.0, 7000.0]}},
            "speed_m_s": {"from": 2, "to": 12, "count": 6},
        },
        "outputs": ["eigenvalues", "modes", "frequencies", "damping_ratios", "critical_speeds", "sensitivities",
                    "smallest_damping_ratio"],
    }  # fmt: skip
    found = load(run_sweep(build_sweep(content), tmp_path / "grid.zarr"))
    bicycle = load_bicycle("benchmark")
    for mass in (80.0, 90.0):
        for front in (5000.0, 7000.0):
            tyre = effect_class("relaxation_length")(
                cornering_stiffness={"rear": 6000.0, "front": front}, relaxation_length=0.1
            )
            model = Model(bicycle.replace(mB=mass), (tyre,))
            linear, speeds = model.linear_model(), found.speed_m_s.values
            here = found.sel({"mB": mass, "relaxation_length.cornering_stiffness.front": front})
            expected = linear.eigenvalues(speeds)
            assert_same_eigenvalues(here.eigenvalues, expected, rtol=1e-9, atol=1e-9)
            named = modes(linear, speeds)
            np.testing.assert_allclose(here.frequencies.sel(mode="weave"), named.frequency("weave"), rtol=1e-9)
            np.testing.assert_allclose(here.damping_ratios.sel(mode="wobble"), named.damping_ratio("wobble"), rtol=1e-9)
            np.testing.assert_allclose(here.modes.sel(mode="weave"), named.branch("weave")[:, 0], rtol=1e-9)
            oscillating = expected.imag > 0
            ratio = np.where(oscillating, -expected.real / np.abs(expected), np.inf).min(1)
            np.testing.assert_allclose(here.smallest_damping_ratio, ratio, rtol=1e-8)
            for one in critical_speeds(linear):
                place = {"crossing_mode": one.mode, "as_speed_grows": one.direction}
                assert np.isclose(here.critical_speeds.sel(place), one.speed, rtol=1e-9).any()
            assert np.isfinite(here.critical_speeds).sum() == len(critical_speeds(linear))
            slopes = sensitivities(model, speeds)
            np.testing.assert_allclose(
                here.sensitivities.sel(free_parameter="mB"), slopes.of("mB"), rtol=1e-6, atol=1e-9
            )
    assert found.eigenvalues.attrs["units"] == "1/s"
    assert found["relaxation_length.cornering_stiffness.front"].attrs["units"] == "N/rad"
    assert json.loads(found.attrs["sweep"])["model"]["bicycle"]["w"] == bicycle["w"]


def test_the_tyre_follows_wheel_load_and_pressure(tmp_path):
    content = {
        "model": MEASURED, "outputs": ["parameters"], "grid": {"mB": [60.0, 85.0], "pressure_bar": [3.0, 4.5]},
    }  # fmt: skip
    found = load(run_sweep(build_sweep(content), tmp_path / "tyre.zarr"))
    measured = TyreMap.load("Tyre1")
    for mass in (60.0, 85.0):
        loads = load_bicycle("benchmark").replace(mB=mass).static_loads
        for pressure in (3.0, 4.5):
            for wheel, force in zip(("rear", "front"), loads, strict=True):
                expected = measured.at(load=force, pressure=pressure * 1e5)
                here = found.sel(mB=mass, pressure_bar=pressure)
                for name in ("cornering_stiffness", "relaxation_length"):
                    value = here.parameters.sel(parameter=f"relaxation_length.{name}.{wheel}")
                    assert float(value) == pytest.approx(getattr(expected, name), rel=1e-12)
                if not expected.inside:
                    assert here.tyre_extrapolated == 1


def test_load_and_tyre_can_be_varied_per_wheel(tmp_path):
    content = {
        "model": MEASURED, "outputs": ["parameters"],
        "grid": {"load_N": {"rear": [350.0, 450.0]}, "tyre.front": ["Tyre1", "Tyre2"]},
    }  # fmt: skip
    found = load(run_sweep(build_sweep(content), tmp_path / "load.zarr")).parameters
    rear = found.sel({"parameter": "relaxation_length.cornering_stiffness.rear", "tyre.front": "Tyre1"})
    assert rear.values == pytest.approx(
        [TyreMap.load("Tyre1").at(load=n, pressure=4e5).cornering_stiffness for n in (350, 450)], rel=1e-12
    )
    front = found.sel({"parameter": "relaxation_length.cornering_stiffness.front", "load_N.rear": 350.0})
    force = load_bicycle("benchmark").static_loads[1]
    assert front.values == pytest.approx(
        [TyreMap.load(t).at(load=force, pressure=4e5).cornering_stiffness for t in ("Tyre1", "Tyre2")], rel=1e-12
    )


def test_drawn_tyres_have_the_covariance_of_the_map(tmp_path):
    content = {
        "model": MEASURED, "outputs": ["parameters"], "samples": 20000, "seed": 1,
        "sampled": {"tyre_covariance": True, "relative_cornering_stiffness_sd": 0.03},
    }  # fmt: skip
    values = load(run_sweep(build_sweep(content), tmp_path / "drawn.zarr")).parameters
    conditions = [(n, 4e5) for n in load_bicycle("benchmark").static_loads]
    covariance = TyreMap.load("Tyre1", relative_cornering_stiffness_sd=0.03).joint(conditions)[1]
    names = [f"relaxation_length.cornering_stiffness.{wheel}" for wheel in ("rear", "front")]
    found = np.cov(values.sel(parameter=names).values.T)
    np.testing.assert_allclose(found, covariance[np.ix_([0, 3], [0, 3])], rtol=0.06, atol=0.03 * covariance[0, 0])
    lengths = values.sel(parameter="relaxation_length.relaxation_length.rear").std()
    assert float(lengths) == pytest.approx(np.sqrt(covariance[2, 2]), rel=0.06)


def test_joint_draws_of_very_different_size(tmp_path):
    covariance = np.array([[1e6, 0.05], [0.05, 1e-8]])
    joint = {"parameters": ["relaxation_length.cornering_stiffness", "IHxz"], "covariance": covariance.tolist()}
    content = {"model": MODEL, "outputs": ["parameters"], "samples": 20000, "sampled": {"joint": [joint]}}
    values = load(run_sweep(build_sweep(content), tmp_path / "joint.zarr")).parameters
    values = values.sel(parameter=["relaxation_length.cornering_stiffness.rear", "IHxz"]).values
    np.testing.assert_allclose(np.cov(values.T), covariance, rtol=0.05)


def test_a_sampled_pressure_is_around_that_of_the_model(tmp_path):
    content = {
        "model": MEASURED, "outputs": ["parameters"], "samples": 4000,
        "sampled": {"pressure_bar": {"sd": 0.05}, "tyre_covariance": True},
    }  # fmt: skip
    drawn = load(run_sweep(build_sweep(content), tmp_path / "a.zarr")).parameters
    loads = load_bicycle("benchmark").static_loads
    at = TyreMap.load("Tyre1").at(load=loads[0], pressure=4e5)
    name = "relaxation_length.cornering_stiffness.rear"
    assert float(drawn.sel(parameter=name).mean()) == pytest.approx(at.cornering_stiffness, rel=0.01)


def test_joint_draws_and_bicycle_sd_and_sampled_speed(tmp_path):
    covariance = [[4.0, 0.03], [0.03, 0.0004]]
    content = {
        "model": MODEL, "outputs": ["parameters", "largest_growth_rate"], "samples": 20000, "seed": 3,
        "sampled": {"joint": [{"parameters": ["mB", "c"], "covariance": covariance, "mean": [85.0, 0.08]}],
                    "speed_m_s": {"low": 4.0, "high": 6.0}},
    }  # fmt: skip
    found = load(run_sweep(build_sweep(content), tmp_path / "joint.zarr"))
    values = found.parameters.sel(parameter=["mB", "c"]).values
    np.testing.assert_allclose(np.cov(values.T), covariance, rtol=0.05)
    assert values.mean(0) == pytest.approx([85, 0.08], rel=1e-2)
    assert found.largest_growth_rate.dims == ("sample",)
    assert found.largest_growth_rate.std() > 0
    spread = load_bicycle("pista")
    own = {"model": {"bicycle": "pista"}, "samples": 5000, "outputs": ["parameters"], "sampled": {"bicycle_sd": True}}
    if spread.sd:
        values = load(run_sweep(build_sweep(own), tmp_path / "sd.zarr")).parameters
        for key, sd in spread.sd.items():
            if sd > 0 and key in values.parameter:
                assert float(values.sel(parameter=key).std()) == pytest.approx(sd, rel=0.06), key


@pytest.mark.parametrize("points", [300, 4096, 10**6])
@pytest.mark.parametrize("engine", [in_loop(), in_threads(2), in_threads(3)])
def test_same_bits_for_every_part_size_and_thread_count(reference, tmp_path, points, engine):
    sweep = build_sweep(RANDOM | {"points_per_part": points})
    assert tree(run_sweep(sweep, tmp_path / "result.zarr", engine=engine)) == tree(reference)


def test_same_bits_for_any_chunk():
    sweep = build_sweep(RANDOM)
    whole = compute(sweep, 0, sweep.items)
    for start, stop in ((0, 1), (1, 2), (681, 684), (17, 1399), (1399, 1400)):
        for name, values in compute(sweep, start, stop).items():
            np.testing.assert_array_equal(values, whole[name][start:stop])


def test_same_bits_for_any_chunk_of_measured_tyres():
    sampled = {"tyre_covariance": True, "relative_cornering_stiffness_sd": 0.03, "mB": {"sd": 3.0}}
    content = RANDOM | {"model": MEASURED, "sampled": sampled, "outputs": ["eigenvalues", "parameters"]}
    sweep = build_sweep(content | {"grid": {"pressure_bar": [4.0, 5.5], "speed_m_s": [3.0, 9.0, 14.0]}})
    whole = compute(sweep, 0, sweep.items)
    for start, stop in ((0, 1), (1, 2), (681, 684), (17, 1399)):
        for name, values in compute(sweep, start, stop).items():
            np.testing.assert_array_equal(values, whole[name][start:stop])


def test_eigenvalues_beside_tracked_bicycles_track_none_twice(monkeypatch):
    """Eigenvalues come in blocks; the critical speeds, a thousand times dearer, only for the items asked for."""
    content = RANDOM | {"outputs": ["critical_speeds", "largest_growth_rate"], "grid": {"speed_m_s": [5.0]}}
    sweep, seen = build_sweep(content), []
    one = Worker._one
    monkeypatch.setattr(Worker, "_one", lambda *given: seen.append(given) or one(*given))
    found = compute(sweep, 3, 6)
    assert len(seen) == 3
    assert next(pieces(sweep)) == (0, 32)
    for name, values in compute(sweep, 0, 8).items():
        np.testing.assert_array_equal(values[3:6], found[name])


def test_other_software_on_a_worker_is_refused():
    sweep = build_sweep(RANDOM)
    vars(sweep)["fingerprint"] = "as computed elsewhere"
    with pytest.raises(InputError, match=r"the worker on .* computes with .*velotyre.*install the same versions"):
        compute(sweep, 0, 1)


def test_same_bits_in_processes(reference, tmp_path):
    assert tree(run_sweep(build_sweep(RANDOM), tmp_path / "result.zarr", engine=in_processes(2))) == tree(reference)


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_same_bits_on_a_cluster(reference, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, silence_logs=50
    ) as cluster:
        engine = on_cluster(cluster.scheduler_address)
        assert tree(run_sweep(build_sweep(RANDOM), tmp_path / "result.zarr", engine=engine)) == tree(reference)


def test_a_new_parameter_does_not_change_the_draws_of_the_others(reference, tmp_path):
    more = RANDOM | {"sampled": {"zH": {"sd": 0.01}, **RANDOM["sampled"]}}
    found = load(run_sweep(build_sweep(more), tmp_path / "more.zarr")).parameters.sel(parameter="mB")
    np.testing.assert_array_equal(found, load(reference).parameters.sel(parameter="mB"))


def test_reductions_are_those_of_the_kept_samples(reference, tmp_path):
    reduced = RANDOM | {"outputs": ["largest_growth_rate"], "reduce": {"quantiles": [0.0, 0.1, 0.5, 0.99, 1.0]}}
    kept = load(reference).largest_growth_rate
    trees = []
    for points in (300, 3000, 10**6):
        out = run_sweep(build_sweep(reduced | {"points_per_part": points}), tmp_path / f"{points}.zarr")
        trees.append(tree(out))
    assert trees[0] == trees[1] == trees[2]
    found = load(out)
    for q in found["quantile"].values:
        exact = kept.quantile(q, "sample", method="inverted_cdf")
        near = found.largest_growth_rate_quantiles.sel(quantile=q)
        np.testing.assert_allclose(near, exact, rtol=2.0**-11)
    np.testing.assert_array_equal(found.largest_growth_rate_max, kept.max("sample"))
    np.testing.assert_array_equal(found.largest_growth_rate_min_sample, kept.argmin("sample"))
    np.testing.assert_array_equal(found.largest_growth_rate_above_zero, (kept > 0).sum("sample"))
    assert (found.largest_growth_rate_count == 700).all()


def test_netcdf_holds_the_same_numbers(reference, tmp_path):
    pytest.importorskip("netCDF4")
    pytest.importorskip("dask")
    out = run_sweep(build_sweep(RANDOM), tmp_path / "result.nc")
    with xr.open_dataset(out, engine="netcdf4") as found:
        same = load(reference)
        np.testing.assert_array_equal(found.eigenvalues_imag, same.eigenvalues.imag)
        np.testing.assert_array_equal(found.largest_growth_rate, same.largest_growth_rate)
        assert found.eigenvalues_real.attrs["units"] == "1/s"
        assert found.attrs["fingerprint"] == same.attrs["fingerprint"]
    assert run_sweep(build_sweep(RANDOM), out) == out  # finished: nothing to do
    other = run_sweep(build_sweep(RANDOM | {"points_per_part": 300}), tmp_path / "other.nc", engine=in_threads(2))
    assert other.read_bytes() == out.read_bytes()


def test_netcdf_holds_names_as_text(tmp_path):
    pytest.importorskip("netCDF4")
    content = {"model": MEASURED, "outputs": ["critical_speeds"], "grid": {"tyre": ["Tyre1", "Tyre2"]}}
    stored = load(run_sweep(build_sweep(content), tmp_path / "result.zarr"))
    with xr.open_dataset(run_sweep(build_sweep(content), tmp_path / "result.nc"), engine="netcdf4") as found:
        assert found.tyre.values.tolist() == ["Tyre1", "Tyre2"]
        here = found.critical_speeds.sel(tyre="Tyre2", crossing_mode="weave", as_speed_grows="stabilising")
        there = stored.critical_speeds.sel(tyre="Tyre2", crossing_mode="weave", as_speed_grows="stabilising")
        np.testing.assert_array_equal(here, there)
        assert np.isfinite(here).any()


# ---- interruption ---------------------------------------------------------------------------------------------------

KILLED = """
import sys
from studies.sweeps import parts as sweep_parts
from studies.sweeps.run import run_sweep
from studies.sweeps.sweep_file import read_sweep
write, written = sweep_parts.Parts.write, []
def slowly(self, piece, arrays):
    write(self, piece, arrays)
    written.append(piece)
    print(len(written), flush=True)
    if len(written) == int(sys.argv[3]):
        sys.stdin.read()  # wait for the kill
sweep_parts.Parts.write = slowly
run_sweep(read_sweep(sys.argv[1]), sys.argv[2])
"""


def write_file(folder, content):
    import tomli_w

    file = folder / "sweep.toml"
    file.write_text(tomli_w.dumps(content), encoding="utf-8")
    return file


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs kill -9")
def test_killed_it_continues_and_ends_with_the_same_bits(reference, tmp_path):
    content = RANDOM | {"points_per_part": 300}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(file), str(out), "1"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with process:
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    parts = tmp_path / "result.zarr.parts"
    finished = {part: part.stat().st_mtime_ns for part in parts.glob("*.part")}
    assert len(finished) == 1
    assert not out.exists()
    damaged = parts / f"{pieces_of(content)[1][0]:012d}-{pieces_of(content)[1][1]:012d}.part"
    damaged.write_bytes(next(iter(finished)).read_bytes()[:500])  # what a crash of the machine may leave
    (parts / "000000000000-000000000001.tmp").write_bytes(b"half")
    seen = []
    engine = in_loop()
    run_sweep(read_sweep(file), out, engine=lambda work, todo: engine(work, [seen.append(p) or p for p in todo]))
    assert seen == pieces_of(content)[1:]
    assert tree(out) == tree(reference)
    assert not parts.exists()


def test_tyres_given_by_files_are_those_tables(tmp_path):
    """A file of the packaged table gives its numbers; parts of a table that was changed since are refused."""
    TyreMap.load("Tyre3").to_file(tmp_path / "own_6.5.csv")
    content = {
        "model": {"bicycle": "benchmark",
                  "effects": {"relaxation_length": {"tyre": "own_6.5.csv", "pressure_bar": 5.5}}},
        "outputs": ["parameters"], "grid": {"tyre": ["Tyre3", "own_6.5.csv"], "pressure_bar.rear": [4.0, 7.0]},
    }  # fmt: skip
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    run_sweep(read_sweep(file), out)
    found = load(out)
    assert list(found.tyre.values) == ["Tyre3", (tmp_path / "own_6.5.csv").as_posix()]
    packaged, own = found.parameters.values
    np.testing.assert_allclose(own, packaged, rtol=1e-7)  # a fit between the conditions, of values that were rounded

    one = read_sweep(file)
    open_parts(tmp_path / "other.zarr", one).write((0, 4), compute(one, 0, 4))
    table = (tmp_path / "own_6.5.csv").read_text().splitlines()
    (tmp_path / "own_6.5.csv").write_text("\n".join([*table[:-1], table[-1].replace("7.5,", "7.6,")]))
    with pytest.raises(InputError, match="holds parts of another sweep"):
        run_sweep(read_sweep(file), tmp_path / "other.zarr")
    (tmp_path / "own_6.5.csv").unlink()
    with pytest.raises(InputError, match=r"own_6\.5\.csv"):
        read_sweep(file)


def pieces_of(content):
    return list(pieces(build_sweep(content)))


@pytest.mark.parametrize("damage", [lambda b: b[:-1], lambda b: b[:50] + bytes([b[50] ^ 1]) + b[51:], lambda b: b""])
def test_a_damaged_part_is_not_taken(tmp_path, damage):
    parts = open_parts(tmp_path / "a.zarr", build_sweep(RANDOM))
    parts.write((0, 3), {"x": np.arange(3.0)})
    assert parts.has((0, 3))
    file = parts.file((0, 3))
    file.write_bytes(damage(file.read_bytes()))
    assert not parts.has((0, 3))
    with pytest.raises(InputError, match="part is missing or damaged"):
        parts.read((0, 3))


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs kill -9")
@pytest.mark.parametrize("ending", ["zarr", "nc"])
def test_killed_in_the_middle_of_putting_together(tmp_path, ending):
    """The kill comes after the second part is written into the store, and after the first array of a netCDF file."""
    if ending == "nc":
        pytest.importorskip("netCDF4")
    file, out = write_file(tmp_path, RANDOM | {"points_per_part": 300}), tmp_path / f"result.{ending}"
    place = {"zarr": ("result", "write_rows"), "nc": ("netcdf", "_copy")}[ending]
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED_LATER, str(file), str(out), *place], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with process:
        process.stdout.readline()
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not out.exists()
    assert (tmp_path / f"result.{ending}.partial").exists()
    run_sweep(read_sweep(file), out, engine=in_threads(2))
    other = run_sweep(read_sweep(file), tmp_path / f"other.{ending}")
    assert out.read_bytes() == other.read_bytes() if ending == "nc" else tree(out) == tree(other)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([file.name, out.name, other.name])


KILLED_LATER = """
import sys
from importlib import import_module
from studies.sweeps.run import run_sweep
from studies.sweeps.sweep_file import read_sweep
module, name = import_module("studies.sweeps." + sys.argv[3]), sys.argv[4]
work, calls = getattr(module, name), []
def slowly(*arguments):
    work(*arguments)
    calls.append(name)
    if len(calls) == 2:
        print("now", flush=True)
        sys.stdin.read()  # wait for the kill
setattr(module, name, slowly)
run_sweep(read_sweep(sys.argv[1]), sys.argv[2])
"""


def test_interrupted_it_says_what_is_kept(reference, tmp_path, capsys):
    def interrupted(work, todo):
        yield todo[0], work(*todo[0])
        raise KeyboardInterrupt

    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(sweep, out, engine=interrupted)
    assert "682 of 1400 bicycles are finished and kept in" in capsys.readouterr().err
    assert tree(run_sweep(sweep, out)) == tree(reference)


def test_killed_while_the_result_is_put_together(reference, tmp_path):
    out, sweep = tmp_path / "result.zarr", build_sweep(RANDOM)
    (tmp_path / "result.zarr.partial").mkdir()
    (tmp_path / "result.zarr.partial" / "zarr.json").write_text("{}")
    assert tree(run_sweep(sweep, out)) == tree(reference)
    open_parts(out, sweep)  # killed after the rename, before the rest was removed
    (tmp_path / "result.zarr.partial").mkdir()
    run_sweep(sweep, out)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.zarr"]


FULL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[3]),) * 2)  # the operating system refuses to write more
from studies.cli import main
main(["sweep", sys.argv[1], "--out", sys.argv[2]])
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs limits of the operating system")
def test_a_full_disk_is_reported_and_loses_nothing(reference, tmp_path):
    content = RANDOM | {"points_per_part": 4000}
    file, out = write_file(tmp_path, content), tmp_path / "result.zarr"
    last = pieces_of(content)[-1]
    assert last[1] - last[0] < pieces_of(content)[0][1]  # the last part is small and fits
    process = subprocess.run(
        [sys.executable, "-c", FULL, str(file), str(out), "300000"], capture_output=True, text=True, check=False
    )
    assert process.returncode == 2
    line = process.stderr.strip().splitlines()[-1]
    assert "File too large: cannot write to" in line
    assert f"0 of {build_sweep(content).items} bicycles are finished and kept in" in line
    assert "run the same command again to continue" in line
    assert not list(tmp_path.glob("*/*.tmp"))
    assert tree(run_sweep(read_sweep(file), out)) == tree(reference)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs limits of the operating system")
def test_a_disk_too_full_for_netcdf_is_reported_and_loses_nothing(tmp_path):
    pytest.importorskip("netCDF4")
    content = RANDOM | {"points_per_part": 300, "outputs": ["eigenvalues"]}
    file, out = write_file(tmp_path, content), tmp_path / "result.nc"
    process = subprocess.run(
        [sys.executable, "-c", FULL, str(file), str(out), "450000"], capture_output=True, text=True, check=False
    )
    assert process.returncode == 2
    line = process.stderr.strip().splitlines()[-1]
    assert "as it does when the disk is full: cannot write to" in line
    assert "1400 of 1400 bicycles are finished and kept in" in line
    assert sorted(path.name for path in tmp_path.iterdir()) == ["result.nc.parts", "sweep.toml"]
    run_sweep(read_sweep(file), out, engine=lambda work, todo: iter(()))  # nothing is left to compute
    assert out.read_bytes() == run_sweep(read_sweep(file), tmp_path / "other.nc").read_bytes()


def test_a_lost_worker_is_reported_and_loses_nothing(reference, tmp_path):
    sweep, out = build_sweep(RANDOM), tmp_path / "result.zarr"

    def dying(work, todo):
        for number, result in enumerate(in_loop()(work, todo)):
            yield result
            if number == 0:
                yield from in_processes(1)(die, todo[1:])

    with pytest.raises(InputError, match=r"a worker process died .*; 682 of 1400 bicycles are finished and kept in"):
        run_sweep(sweep, out, engine=dying)
    assert tree(run_sweep(sweep, out)) == tree(reference)


def die(start, stop):
    os._exit(1)


# ---- refusals -------------------------------------------------------------------------------------------------------

GRID = {"speed_m_s": [1.0, 2.0]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"outputs": [["eigenvalues"]]}, "unknown output"),
        ({"max_speed_m_s": -1.0}, "max_speed_m_s = -1 must be above 0 m/s"),
        ({"seed": 2**63}, "seed = 9223372036854775808 must be a whole number from 0 to"),
        ({"grid": {"mB": [10**400]}}, "must be a finite number"),
        ({"grid": {"mB": {"from": 1, "to": 2, "count": 1}}}, "count = 1 must be a whole number from 2"),
        ({"grid": {"mB": {"from": 1, "to": 2, "count": 10**9}}}, "must be a whole number from 2 to 1000000"),
        ({"grid": {k: {"from": 1, "to": 2, "count": 10**4} for k in ("w", "c", "mB")}}, "1e[+]12 bicycles; at most"),
        ({"model": MEASURED, "grid": {"tyre": [1.0]}}, "grid.tyre = 1.0 must be a name in quotes"),
        ({"model": MEASURED, "sampled": {"tyre": {"mean": 1.0, "sd": 1.0}}, "samples": 2}, "a name cannot be sampled"),
        ({"model": MEASURED, "sampled": {"tyre_covariance": "no"}, "samples": 2}, "'no' must be true or false"),
        ({"sampled": {"bicycle_sd": 1}, "samples": 2}, "sampled.bicycle_sd = 1 must be true or false"),
        ({"model": MEASURED, "sampled": {"relative_cornering_stiffness_sd": -0.1}, "samples": 2}, "-0.1 must be >= 0"),
        ({"model": MEASURED, "sampled": {"relative_cornering_stiffness_sd": 0.1, "c": {"sd": 0.001}}, "samples": 2},
         "relative_cornering_stiffness_sd does nothing without tyre_covariance = true"),
        ({"sampled": {"speed_m_s": {"low": 1.0, "high": 2.0}}, "samples": 2}, "speed_m_s is varied twice"),
        ({"outputs": ["critical_speeds"]}, "speed_m_s is varied, but critical_speeds do not depend on it"),
        ({"sampled": {"mB": {"sdd": 1.0}}, "samples": 2}, "sampled.mB = .*: give {mean, sd}, {sd} or {low, high}"),
        ({"sampled": {"joint": [1]}, "samples": 2}, "sampled.joint = .* must be a list of tables"),
        ({"sampled": {"joint": {"parameters": ["mB"]}}, "samples": 2}, "sampled.joint = .* must be a list of tables"),
        ({"sampled": {"joint": [{"parameters": "mB"}]}, "samples": 2}, "parameters = 'mB' must be a list of names"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[True]]}]}, "samples": 2}, "must be 1 x 1"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": 8.0}]}, "samples": 2},
         "mean = 8.0; give a list of one number per parameter"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": [float("nan")]}]}, "samples": 2},
         "mean = nan must be a finite number"),
        # a correlation of 1.5 between numbers of very different size
        ({"sampled": {"joint": [{"parameters": ["relaxation_length.cornering_stiffness", "IHxz"],
                                 "covariance": [[1e6, 0.15], [0.15, 1e-8]]}]}, "samples": 2},
         "symmetric without negative eigenvalues"),
        ({"reduce": [0.5]}, r"reduce = \[0.5\] must be a table: write \[reduce\]"),
        ({"reduce": {"quantiles": 0.5}}, "reduce.quantiles = 0.5 must be a list"),
        ({"reduce": {"quantiles": []}}, r"reduce.quantiles = \[\] must be a list"),
        ({"reduce": {"quantiles": [0.5, 0.5]}}, "reduce.quantiles holds a value twice"),
        ({"reduce": {}, "outputs": ["largest_growth_rate"]}, "but nothing is sampled; leave it out"),
        ({"modle": 1}, "unknown key 'modle'; did you mean 'model'"),
        ({"model": None}, "model is missing: give a model file or a table"),
        ({"model": "none.toml"}, "model = 'none.toml': no such model file"),
        ({"outputs": []}, r"outputs = \[\] must hold at least one: give a list of eigenvalues"),
        ({"outputs": ["eigenvalue"]}, "unknown output 'eigenvalue'; did you mean 'eigenvalues'"),
        ({"grid": {"mb": [1]}}, "unknown parameter 'mb'; did you mean 'mB'"),
        ({"grid": {"pressure_bar": [4]}}, "unknown parameter 'pressure_bar'"),
        ({"grid": {"mB": []}}, r"grid.mB = \[\]: give a list of values or {from, to, count}"),
        ({"grid": {"mB": [1.0, 1.0]}}, "grid.mB holds a value twice"),
        ({"grid": {"mB": ["x"]}}, "grid.mB = 'x' must be a finite number"),
        ({"grid": {"mB": {"from": 1, "to": 2}}}, "grid.mB: count is missing"),
        ({"grid": {"mB": {"from": 1, "to": 2, "step": 2}}}, "unknown key of grid.mB: 'step'"),
        ({"grid": {"mB": {"from": 1, "to": 2, "count": 0}}}, "count = 0 must be a whole number from 2"),
        ({"grid": {"speed_m_s": [-1.0]}}, "grid.speed_m_s holds -1; give speeds >= 0"),
        ({"grid": {"mB": [80.0]}}, "eigenvalues need speeds: add grid.speed_m_s"),
        ({"grid": 3}, r"grid = 3 must be a table: write \[grid\]"),
        ({"samples": 10}, "samples = 10, but nothing is sampled"),
        ({"samples": 0}, "samples = 0 must be a whole number from 1"),
        ({"sampled": {"mB": {"sd": 1.0}}}, "parameters are sampled but samples is missing"),
        ({"sampled": 3}, r"sampled = 3 must be a table: write \[sampled\]"),
        ({"sampled": {"mB": 1.0}, "samples": 2}, r"sampled.mB = 1.0: give {mean, sd}, {sd} or {low, high}"),
        ({"sampled": {"mB": {"sd": -1.0}}, "samples": 2}, "sampled.mB.sd = -1 must be >= 0"),
        ({"sampled": {"mB": {"low": 2.0, "high": 1.0}}, "samples": 2}, "low = 2 must be below high = 1"),
        ({"sampled": {"speed_m_s": {"low": -9.0, "high": 1.0}}, "samples": 2, "grid": {}},
         "sampled.speed_m_s: low = -9 is outside 0 .. inf"),
        ({"sampled": {"mB": {"mean": -5.0, "sd": 1.0}}, "samples": 2},
         "sampled.mB: the mean -5 is outside 0 .. inf, so no draw could be possible"),
        ({"sampled": {"lam": {"sd": 2.0}}, "samples": 2},
         "sampled.lam: nothing between -1.57.* with a mean of 0.31.* has a standard deviation of 2"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": [-1.0]}]}, "samples": 2},
         "sampled.joint: mB: the mean -1 is outside"),
        ({"sampled": {"bicycle_sd": True}, "samples": 2}, "bicycle 'benchmark' states no standard deviations"),
        ({"sampled": {"tyre_covariance": True}, "samples": 2}, "sampled.tyre_covariance needs a measured tyre"),
        ({"sampled": {"speed_m_s": {"sd": 1.0}}, "samples": 2}, "sampled speed_m_s: mean is missing"),
        ({"sampled": {"joint": [{}]}, "samples": 2}, "sampled.joint: parameters is missing"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1, 2]]}]}, "samples": 2},
         "must be 1 x 1 numbers"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [["x"]]}]}, "samples": 2},
         "must be 1 x 1 numbers"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[-1.0]]}]}, "samples": 2},
         "symmetric without negative eigenvalues"),
        ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": []}]}, "samples": 2},
         r"mean = \[\]; give a list of one number per parameter"),
        ({"grid": GRID | {"mB": [80.0]}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2}, "mB is varied twice"),
        ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1],
                          "relaxation_length.relaxation_length.rear": [0.1]}},
         "are both varied; give both wheels together"),
        ({"reduce": {"quantiles": [2]}}, "reduce.quantiles holds 2; give numbers from 0 to 1"),
        ({"reduce": {"mean": True}}, "unknown key of reduce: 'mean'"),
        ({"reduce": {}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2},
         r"eigenvalues cannot be reduced over samples; with \[reduce\] ask for largest_growth_rate"),
    ],
)  # fmt: skip
def test_refused_files(change, words):
    content = {"model": MODEL, "outputs": ["eigenvalues"], "grid": GRID} | change
    with pytest.raises(InputError, match=words):
        build_sweep({key: value for key, value in content.items() if value is not None})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"grid": GRID | {"mB": [80.0, -1.0]}},
         r"sweep at mB = -1.0: bicycle .* mB = -1 kg must not be negative; 1 of the 2 bicycles .*; leave it out"),
        ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1, 0.0]}},
         "sweep at .* = 0.0: effect 'relaxation_length'"),
        # a cell, at the mean of what is sampled, that the draws of this seed would miss
        ({"grid": GRID | {"IBxz": [0.0, 6.0]}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2},
         r"sweep at IBxz = 6.0, the mean of what is sampled: .* the rear frame has a negative principal inertia"),
        ({"model": MEASURED, "grid": GRID | {"load_N": [400.0, 1e6]}, "sampled": {"c": {"sd": 0.001}}, "samples": 2},
         r"sweep at load_N = 1000000.0, the mean of what is sampled: the tyre's table says nothing .*extrapolation"),
        ({"model": MEASURED, "grid": GRID | {"pressure_bar": [400.0]}},
         "pressure_bar = 400 must be a number above 0 and up to 20 bar"),
        ({"model": {"bicycle": "benchmark", "effects": {"side_slip": {"cornering_stiffness": 6000.0}}},
          "grid": {"speed_m_s": [0.0, 1.0]}}, "speed 0 m/s is not allowed with side_slip"),
    ],
)  # fmt: skip
def test_impossible_points_are_named(tmp_path, change, words):
    content = {"model": MODEL, "outputs": ["largest_growth_rate"], "grid": GRID} | change
    with pytest.raises(InputError, match=words):
        run_sweep(build_sweep(content), tmp_path / "result.zarr")
    assert not list(tmp_path.iterdir())  # nothing is computed, and nothing in the way of the mended sweep


def test_what_is_found_impossible_on_the_way(monkeypatch, tmp_path):
    content = {"model": MODEL, "outputs": ["critical_speeds"], "grid": {"mB": {"from": 80, "to": 90, "count": 33}}}
    sweep, out = build_sweep(content), tmp_path / "result.zarr"
    monkeypatch.setattr("studies.sweeps.chunk.OCCURRENCES", 0)
    words = r"sweep at mB = 80.0: \w+ has more than 0 \w+ critical speeds up to 60 m/s; lower max_speed_m_s; leave"
    with pytest.raises(InputError, match=words):
        run_sweep(sweep, out)
    assert not list(tmp_path.iterdir())  # nothing is in the way of a changed sweep
    open_parts(out, sweep).write((0, 32), {"critical_speeds": np.zeros((32, 1))})
    with pytest.raises(InputError, match=r"at mB = 90.0: .*; 32 of 33 bicycles are .* kept in .*, but a changed sweep"):
        run_sweep(sweep, out)
    assert list(tmp_path.glob("*/*.part"))


def test_conditions_of_an_effect_hold_for_every_point(tmp_path):
    rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
    model = {"bicycle": "benchmark", "effects": MODEL["effects"] | {"rider_lean": rider}}
    content = {"model": model, "outputs": ["largest_growth_rate"], "grid": GRID | {"rider_lean.z": [-1.0, -1.4]}}
    with pytest.raises(
        InputError, match=r"sweep at rider_lean.z = -1.4: effect 'rider_lean': what remains of the rear"
    ):
        run_sweep(build_sweep(content), tmp_path / "result.zarr")


def test_refused_results(reference, tmp_path):
    other = build_sweep(RANDOM | {"seed": 6})
    with pytest.raises(InputError, match="is not the result of this sweep; remove it or choose another --out"):
        run_sweep(other, reference)
    (tmp_path / "text.nc").write_text("x")
    with pytest.raises(InputError, match=r"text.nc exists and is not the result of this sweep"):
        run_sweep(other, tmp_path / "text.nc")
    with pytest.raises(InputError, match=r"the name must end in .zarr or .nc \(netCDF\)"):
        run_sweep(other, tmp_path / "result.csv")
    mark = tmp_path / "a.zarr.parts" / "sweep.json"
    open_parts(tmp_path / "a.zarr", build_sweep(RANDOM)).write((0, 1), {"x": np.zeros(1)})
    for text in (mark.read_text(), "", "[]", None):
        mark.unlink() if text is None else mark.write_text(text)
        with pytest.raises(InputError, match="holds parts of another sweep"):
            run_sweep(other, tmp_path / "a.zarr")
    next(mark.parent.glob("*.part")).unlink()
    assert open_parts(tmp_path / "a.zarr", other).folder == mark.parent  # nothing finished is in it


def test_no_scheduler(monkeypatch, tmp_path):
    pytest.importorskip("distributed")
    monkeypatch.setattr("studies.sweeps.engines.PATIENCE", 0.3)
    with pytest.raises(InputError, match=r"no dask scheduler answers at tcp://127.0.0.1:9 .*; 0 of 1400 bicycles"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://127.0.0.1:9"))


def test_command(tmp_path, capsys):
    file = write_file(tmp_path, {"model": MODEL, "outputs": ["eigenvalues"], "grid": GRID})
    out = tmp_path / "result.zarr"
    main(["sweep", str(file), "--out", str(out), "--workers", "2", "--json", "-"])
    shown = capsys.readouterr()
    assert json.loads(shown.out)["points"] == 2
    assert "points" not in shown.err  # no progress bar: this is no terminal
    assert load(out).eigenvalues.shape == (2, 8)
    for arguments, words in (
        (["--workers", "1", "--processes", "1"], "give one of --workers, --processes and --scheduler"),
        ([], "is not the result of this sweep"),
    ):
        (tmp_path / "other.zarr").mkdir(exist_ok=True)
        with pytest.raises(SystemExit, match="2"):
            main(["sweep", str(file), "--out", str(tmp_path / "other.zarr"), *arguments])
        assert words in capsys.readouterr().err
    for text, words in (
        (None, "no such sweep file"),
        ("x = ", "not a TOML file"),
        ("model = 3", "bad.toml: model = 3 must be a model file"),
    ):
        bad = tmp_path / "bad.toml"
        if text:
            bad.write_text(text)
        with pytest.raises(SystemExit, match="2"):
            main(["sweep", str(bad), "--out", str(out)])
        assert words in capsys.readouterr().err


def test_command_says_what_is_assumed_and_extrapolated(tmp_path, capsys):
    sampled = {"tyre_covariance": True, "relative_cornering_stiffness_sd": 0.03}
    content = {
        "model": MEASURED,
        "outputs": ["parameters"],
        "samples": 2,
        "sampled": sampled,
        "grid": {"mB": [85, 300]},
    }
    main(["sweep", str(write_file(tmp_path, content)), "--out", str(tmp_path / "result.zarr"), "--verbose"])
    said = capsys.readouterr().err
    assert "assumed is 3 % (one standard deviation)" in said
    assert "none is assumed" not in said
    outside = int(load(tmp_path / "result.zarr").tyre_extrapolated.sum())
    assert outside > 0
    assert f"{outside} of 4 bicycles have a tyre outside its measured loads and pressures" in said


def test_missing_extra(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(SystemExit, match="2"):
        main(["sweep", "x.toml", "--out", "x.zarr"])
    assert "zarr is not installed; install it with pip install 'velotyre[sweeps]'" in capsys.readouterr().err


def test_a_model_whose_equations_switch_at_a_speed(tmp_path):
    """Each bicycle has its own switch speed: rows on both sides of it come from different equations."""
    parameters = effect_class("steer_assist").parameters
    assist = {p.name: sum(p.typical) / 2 for p in parameters if p.default is None}
    model = {"bicycle": "benchmark", "effects": MODEL["effects"] | {"steer_assist": assist}}
    content = {"model": model, "outputs": ["eigenvalues"], "grid": {"mB": [80.0, 85.0], "speed_m_s": [2.0, 5.0, 9.0]}}
    found = load(run_sweep(build_sweep(content), tmp_path / "switch.zarr"))
    for mass in (80.0, 85.0):
        effects = (effect_class("relaxation_length")(**MODEL["effects"]["relaxation_length"]),
                   effect_class("steer_assist")(**assist))  # fmt: skip
        linear = Model(load_bicycle("benchmark").replace(mB=mass), effects).linear_model()
        assert_same_eigenvalues(found.eigenvalues.sel(mB=mass), linear.eigenvalues([2.0, 5.0, 9.0]), rtol=1e-9)


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
