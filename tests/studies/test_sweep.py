"""Sweeps: values against models built by hand; the same bits for every chunk, engine and interruption."""

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("zarr")
xr = pytest.importorskip("xarray")

from bicycle import Model, effect_class, load_bicycle  # noqa: E402
from bicycle.critical import critical_speeds  # noqa: E402
from bicycle.modes import modes  # noqa: E402
from bicycle.sensitivity import sensitivities  # noqa: E402
from studies.cli import main  # noqa: E402
from studies.sweeps.chunk import compute  # noqa: E402
from studies.sweeps.engines import in_loop, in_processes, in_threads, on_cluster  # noqa: E402
from studies.sweeps.parts import open_parts  # noqa: E402
from studies.sweeps.run import pieces, run_sweep  # noqa: E402
from studies.sweeps.sweep_file import build_sweep, read_sweep  # noqa: E402
from tyre import TyreMap  # noqa: E402
from tyre.errors import InputError  # noqa: E402

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


def load(path):
    with xr.open_zarr(path, consolidated=False) as found:
        return found.load()


def tree(folder):
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


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
            np.testing.assert_allclose(here.eigenvalues, expected, rtol=1e-9, atol=1e-9)
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
    finished = {part: part.stat().st_mtime_ns for part in parts.glob("*.npz")}
    assert len(finished) == 1
    assert not out.exists()
    damaged = parts / f"{pieces_of(content)[1][0]:012d}-{pieces_of(content)[1][1]:012d}.npz"
    damaged.write_bytes(next(iter(finished)).read_bytes()[:500])  # what a crash of the machine may leave
    (parts / "000000000000-000000000001.tmp").write_bytes(b"half")
    seen = []
    engine = in_loop()
    run_sweep(read_sweep(file), out, engine=lambda work, todo: engine(work, [seen.append(p) or p for p in todo]))
    assert seen == pieces_of(content)[1:]
    assert tree(out) == tree(reference)
    assert not parts.exists()


def pieces_of(content):
    return list(pieces(build_sweep(content)))


def test_killed_while_the_result_is_put_together(reference, tmp_path):
    out, sweep = tmp_path / "result.zarr", build_sweep(RANDOM)
    (tmp_path / "result.zarr.partial").mkdir()
    (tmp_path / "result.zarr.partial" / "zarr.json").write_text("{}")
    assert tree(run_sweep(sweep, out)) == tree(reference)
    open_parts(out, sweep)  # killed after the rename, before the parts were removed
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
        ({"modle": 1}, "unknown key 'modle'; did you mean 'model'"),
        ({"model": None}, "model is missing: give a model file or a table"),
        ({"model": "none.toml"}, "model = 'none.toml': no such model file"),
        ({"outputs": []}, "outputs is missing: give a list of eigenvalues"),
        ({"outputs": ["eigenvalue"]}, "unknown output 'eigenvalue'; did you mean 'eigenvalues'"),
        ({"grid": {"mb": [1]}}, "unknown parameter 'mb'; did you mean 'mB'"),
        ({"grid": {"pressure_bar": [4]}}, "unknown parameter 'pressure_bar'"),
        ({"grid": {"mB": []}}, r"grid.mB = \[\]: give a list of values or {from, to, count}"),
        ({"grid": {"mB": [1.0, 1.0]}}, "grid.mB holds a value twice"),
        ({"grid": {"mB": ["x"]}}, "grid.mB = 'x' must be a finite number"),
        ({"grid": {"mB": {"from": 1, "to": 2}}}, "grid.mB: count is missing"),
        ({"grid": {"mB": {"from": 1, "to": 2, "step": 2}}}, "unknown key of grid.mB: 'step'"),
        ({"grid": {"mB": {"from": 1, "to": 2, "count": 0}}}, "count = 0 must be a whole number from 1"),
        ({"grid": {"speed_m_s": [-1.0]}}, "grid.speed_m_s holds -1; give speeds >= 0"),
        ({"grid": {"mB": [80.0]}}, "eigenvalues need speeds: add grid.speed_m_s"),
        ({"grid": 3}, r"grid is a table: write \[grid\]"),
        ({"samples": 10}, "samples = 10, but nothing is sampled"),
        ({"samples": 0}, "samples = 0 must be a whole number from 1"),
        ({"sampled": {"mB": {"sd": 1.0}}}, "parameters are sampled but samples is missing"),
        ({"sampled": 3}, r"sampled is a table: write \[sampled\]"),
        ({"sampled": {"mB": 1.0}, "samples": 2}, r"sampled.mB = 1.0: give {mean, sd}, {sd} or {low, high}"),
        ({"sampled": {"mB": {"sd": -1.0}}, "samples": 2}, "sampled.mB.sd = -1 must be >= 0"),
        ({"sampled": {"mB": {"low": 2.0, "high": 1.0}}, "samples": 2}, "low = 2 must be below high = 1"),
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
         "mean has 0 numbers; give one per parameter"),
        ({"grid": GRID | {"mB": [80.0]}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2}, "mB is varied twice"),
        ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1],
                          "relaxation_length.relaxation_length.rear": [0.1]}},
         "are both varied; give both wheels together"),
        ({"reduce": {"quantiles": [2]}}, "reduce.quantiles holds 2; give numbers from 0 to 1"),
        ({"reduce": {"mean": True}}, "unknown key of reduce: 'mean'"),
        ({"reduce": {}}, r"eigenvalues cannot be reduced over samples; with \[reduce\] ask for largest_growth_rate"),
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
         r"sweep at mB = -1.0: bicycle .* mB = -1 kg must not be negative; narrow"),
        ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1, 0.0]}},
         "sweep at .* = 0.0: effect 'relaxation_length'"),
        ({"sampled": {"w": {"sd": 2.0}}, "samples": 50},
         r"sweep at sample \d+: .*narrow the grid or the distributions"),
        ({"grid": {}, "sampled": {"speed_m_s": {"low": -9.0, "high": 1.0}}, "samples": 9}, "speed .* m/s is below 0"),
    ],
)  # fmt: skip
def test_impossible_points_are_named(tmp_path, change, words):
    content = {"model": MODEL, "outputs": ["largest_growth_rate"], "grid": GRID} | change
    with pytest.raises(InputError, match=words):
        run_sweep(build_sweep(content), tmp_path / "result.zarr")


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
    open_parts(tmp_path / "a.zarr", build_sweep(RANDOM))
    with pytest.raises(InputError, match="holds parts of another sweep"):
        run_sweep(other, tmp_path / "a.zarr")
    (tmp_path / "a.zarr.parts" / "sweep.json").write_text("")
    with pytest.raises(InputError, match="holds parts of another sweep"):
        run_sweep(other, tmp_path / "a.zarr")
    (tmp_path / "a.zarr.parts" / "sweep.json").unlink()
    (tmp_path / "a.zarr.parts" / "1.npz").write_bytes(b"")
    with pytest.raises(InputError, match=r"is in the way and has no sweep.json"):
        run_sweep(other, tmp_path / "a.zarr")


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
    assert "2.00/2.00" in shown.err
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
        ("model = 3", "bad.toml: model is miss"),
    ):
        bad = tmp_path / "bad.toml"
        if text:
            bad.write_text(text)
        with pytest.raises(SystemExit, match="2"):
            main(["sweep", str(bad), "--out", str(out)])
        assert words in capsys.readouterr().err


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
        np.testing.assert_allclose(found.eigenvalues.sel(mB=mass), linear.eigenvalues([2.0, 5.0, 9.0]), rtol=1e-9)


@pytest.mark.parametrize(
    ("workers", "error", "words"),
    [
        ({}, None, r"the scheduler at tcp://x:1 has no workers; start some with 'dask worker tcp://x:1'"),
        ({"a": 1}, "killed", "workers of tcp://x:1 died while they worked on the same points"),
        ({"a": 1}, "gone", "the scheduler at tcp://x:1 went away"),
    ],
)
def test_a_cluster_that_fails(monkeypatch, tmp_path, workers, error, words):
    distributed = pytest.importorskip("distributed")
    from concurrent.futures import ThreadPoolExecutor

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
        raise distributed.KilledWorker("compute", None, 3) if error == "killed" else OSError("closed")

    monkeypatch.setattr(distributed, "Client", Client)
    monkeypatch.setattr("studies.sweeps.run.compute", failing)
    with pytest.raises(InputError, match=f"{words}.*; 0 of 1400 bicycles are finished"):
        run_sweep(build_sweep(RANDOM), tmp_path / "a.zarr", engine=on_cluster("tcp://x:1"))
