"""Content of a sweep: values against models built by hand, tyres of the map, draws with the covariance stated."""

import json

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from sweep_examples import MEASURED, MODEL, write_file
from sweep_results import load

from bicycle import Model, effect_class, load_bicycle
from bicycle.files import to_toml
from bicycle.model import build_model
from bicycle.stability import critical_speeds, modes, sensitivities
from studies.sweep import build_sweep, read_sweep, run_sweep
from tyre import TyreMap
from tyre.ground import InputError


def test_a_packaged_model_or_bicycle_and_a_bicycle_file_may_be_the_model(tmp_path):
    (tmp_path / "mine.toml").write_text(to_toml(load_bicycle("benchmark").replace(c=0.07)))
    content = {"grid": {"mH": [4.0, 5.0]}, "outputs": ["critical_speeds"]}
    trails = {}
    for name in ("sharp1971", "benchmark", "mine.toml"):
        trails[name] = build_sweep(content | {"model": name}, folder=tmp_path).nominal.bicycle["c"]
    assert trails["sharp1971"] == pytest.approx(0.38 * 0.3048 / np.cos(0.4715), rel=1e-3)  # Sharp (1971): 0.38 ft
    assert trails["benchmark"] == 0.08  # Meijaard et al. (2007), table 1
    assert trails["mine.toml"] == 0.07
    with pytest.raises(InputError, match=r"model = 'sharp1972': unknown bicycle or model .* did you mean 'sharp1971'"):
        build_sweep(content | {"model": "sharp1972"}, folder=tmp_path)


def test_grid_values_are_those_of_single_models(tmp_path):
    content = {
        "model": MODEL,
        "grid": {
            "mB": [80.0, 90.0],
            "relaxation_length": {"cornering_stiffness": {"front": [5000.0, 7000.0]}},
            "speed_m_s": {"from": 2, "to": 12, "count": 6},
        },
        "outputs": ["eigenvalues", "modes", "frequencies", "damping_ratios", "critical_speeds", "sensitivities",
                    "min_damping_ratio"],
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
            np.testing.assert_allclose(here.min_damping_ratio, ratio, rtol=1e-8)
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
            here = found.sel(mB=mass, pressure_bar=pressure)
            expected = [measured.at(load=force, pressure=pressure * 1e5) for force in loads]
            for wheel, tyre in zip(("rear", "front"), expected, strict=True):
                for name in ("cornering_stiffness", "relaxation_length"):
                    value = here.parameters.sel(parameter=f"relaxation_length.{name}.{wheel}")
                    assert float(value) == pytest.approx(getattr(tyre, name), rel=1e-12)
            assert here.tyre_extrapolated == (not all(tyre.inside for tyre in expected))


def test_the_tyre_follows_the_load_that_braking_moves(tmp_path):
    braked = MEASURED | {"effects": MEASURED["effects"] | {"longitudinal": {"front_share": 0.8}}}
    content = {"model": braked, "outputs": ["parameters"], "grid": {"longitudinal.brake_force": [0.0, 50.0]}}
    found = load(run_sweep(build_sweep(content), tmp_path / "braked.zarr")).parameters
    key = "relaxation_length.cornering_stiffness.front"
    for brake in (0.0, 50.0):
        effects = braked["effects"] | {"longitudinal": {"front_share": 0.8, "brake_force": brake}}
        expected = build_model(braked | {"effects": effects}).parameters[key]
        value = float(found.sel({"parameter": key, "longitudinal.brake_force": brake}))
        assert value == pytest.approx(expected, rel=1e-12)
    assert expected > 1.03 * build_model(MEASURED).parameters[key]


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


def test_joint_draws_and_a_sampled_speed(tmp_path):
    covariance = [[4.0, 0.03], [0.03, 0.0004]]
    content = {
        "model": MODEL, "outputs": ["parameters", "max_growth_rate"], "samples": 20000, "seed": 3,
        "sampled": {"joint": [{"parameters": ["mB", "c"], "covariance": covariance, "mean": [85.0, 0.08]}],
                    "speed_m_s": {"low": 4.0, "high": 6.0}},
    }  # fmt: skip
    found = load(run_sweep(build_sweep(content), tmp_path / "joint.zarr"))
    values = found.parameters.sel(parameter=["mB", "c"]).values
    np.testing.assert_allclose(np.cov(values.T), covariance, rtol=0.05)
    assert values.mean(0) == pytest.approx([85, 0.08], rel=1e-2)
    assert found.max_growth_rate.dims == ("sample",)
    assert found.max_growth_rate.std() > 0


def test_draws_have_the_standard_deviations_of_the_bicycle_file(tmp_path):
    own = {"model": {"bicycle": "pista"}, "samples": 5000, "outputs": ["parameters"], "sampled": {"bicycle_sd": True}}
    values = load(run_sweep(build_sweep(own), tmp_path / "sd.zarr")).parameters
    stated = load_bicycle("pista").sd
    assert set(stated) - set(values.parameter.values) == {"IByy", "IHyy"}  # of no use to lateral motion
    for key in sorted(set(stated) - {"IByy", "IHyy"}):
        assert float(values.sel(parameter=key).std()) == pytest.approx(stated[key], rel=0.06), key


def test_tyres_given_by_files_are_those_tables(tmp_path):
    """A file of the packaged table gives its numbers."""
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
    (tmp_path / "own_6.5.csv").unlink()
    with pytest.raises(InputError, match=r"own_6\.5\.csv"):
        read_sweep(file)


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


@pytest.mark.parametrize("reduce", [True, False])
def test_a_result_without_axes_goes_into_netcdf(tmp_path, reduce):
    """One number over all samples, or the only bicycle of a sweep: a variable without dimensions."""
    pytest.importorskip("netCDF4")
    xr = pytest.importorskip("xarray")
    content = {"model": MEASURED, "outputs": ["max_growth_rate"], "grid": {"speed_m_s": [4.0, 8.0]}}
    more = {"samples": 20, "sampled": {"mB": {"sd": 1.0}}, "reduce": {}} if reduce else {}
    sweep = build_sweep(content | more)
    store = load(run_sweep(sweep, tmp_path / "result.zarr"))
    name = "tyre_extrapolated_count" if reduce else "tyre_extrapolated"
    with xr.open_dataset(run_sweep(sweep, tmp_path / "result.nc")) as found:
        assert found[name].dims == store[name].dims == ()
        assert float(found[name]) == (20.0 if reduce else float(store[name]))
        assert set(found.variables) == set(store.variables)


def test_draws_have_the_covariance_that_a_model_file_states(tmp_path):
    """Deviations of bicycle and effect together, as ``model.toml`` of a diagnosis; but of what is varied otherwise."""
    sd, between = {"w": 0.02, "c": 0.004, "steer_damper.damping": 0.3}, 0.9
    matrix = np.diag([value**2 for value in sd.values()])
    matrix[1, 2] = matrix[2, 1] = between * sd["c"] * sd["steer_damper.damping"]
    content = {
        "model": {"bicycle": "benchmark", "effects": {"steer_damper": {"damping": 2.0}},
                  "covariance": {"parameters": list(sd), "matrix": matrix.tolist()}},
        "samples": 4000, "outputs": ["parameters"], "sampled": {"bicycle_sd": True},
    }  # fmt: skip
    values = load(run_sweep(build_sweep(content), tmp_path / "all.zarr")).parameters
    drawn = np.stack([values.sel(parameter=key).values for key in sd])
    np.testing.assert_allclose(drawn.std(1), list(sd.values()), rtol=0.06)
    np.testing.assert_allclose(np.corrcoef(drawn), [[1, 0, 0], [0, 1, between], [0, between, 1]], atol=0.05)
    content["grid"] = {"c": [0.07, 0.08]}
    found = load(run_sweep(build_sweep(content), tmp_path / "fixed.zarr")).parameters.sel(c=0.07)
    assert float(found.sel(parameter="c").std()) == pytest.approx(0.0, abs=1e-12)
    assert float(found.sel(parameter="w").std()) == pytest.approx(sd["w"], rel=0.06)
