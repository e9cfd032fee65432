"""Sweeps over the bicycles of a table."""

import numpy as np
import pandas as pd
import pytest
from sweep_examples import MEASURED, MODEL

from bicycle import Model, load_bicycle
from bicycle.model import build_model
from bicycle.parameters import UNITS
from bicycle.stability import critical_speeds
from studies.sweep import build_sweep, run_sweep
from tyre.ground import InputError

xarray = pytest.importorskip("xarray")
NAMES = ("kooijman2008", "benchmark", "pista_rider")


@pytest.fixture
def folder(tmp_path):
    rows = [{"name": name} | {key: load_bicycle(name)[key] for key in UNITS} for name in NAMES]
    pd.DataFrame(rows).assign(c_sd=[0.01, None, 0.02], mB_sd=[None, 1.0, None]).to_csv(
        tmp_path / "many.csv", index=False
    )
    return tmp_path


def run(content, folder, name="r.nc"):
    result = run_sweep(build_sweep(content, folder=folder), folder / name)
    with xarray.open_dataset(result) as data:
        return data.load()


def test_every_bicycle_has_its_own_critical_speeds(folder):
    found = run({"model": {}, "outputs": ["critical_speeds"], "grid": {"bicycle": "many.csv"}}, folder)
    assert found.bicycle.values.tolist() == list(NAMES)
    for name in NAMES:
        stabilising = found.critical_speeds.sel(bicycle=name, as_speed_grows="stabilising").values
        expected = critical_speeds(Model(load_bicycle(name)).linear_model(), max_speed=60.0)
        assert sorted(stabilising[np.isfinite(stabilising)]) == pytest.approx(
            sorted(one.speed for one in expected if one.direction == "stabilising"), rel=1e-9
        )


def test_bicycles_with_other_axes_on_their_own_loads(folder):
    model = {**MEASURED, "bicycle": "benchmark"}
    model["effects"] = {"relaxation_length": MEASURED["effects"]["relaxation_length"] | {"extrapolate": True}}
    small = pd.read_csv(folder / "many.csv")[1:]  # the wheels of the first carry less than the tyre's tests reach
    small.to_csv(folder / "two.csv", index=False)
    grid = {"bicycle": "two.csv", "pressure_bar": [4.0, 5.0], "speed_m_s": [5.0]}
    found = run({"model": model, "outputs": ["max_growth_rate", "parameters"], "grid": grid}, folder)
    for name in NAMES[1:]:
        for bar in (4.0, 5.0):
            table = model["effects"]["relaxation_length"] | {"pressure_bar": bar}
            linear = build_model({"bicycle": name, "effects": {"relaxation_length": table}}).linear_model()
            growth = found.max_growth_rate.sel(bicycle=name, pressure_bar=bar, speed_m_s=5.0).item()
            assert growth == pytest.approx(linear.eigenvalues(5.0).real.max(), rel=1e-9)


def test_every_bicycle_has_its_own_standard_deviations(folder):
    content = {"model": MODEL, "samples": 4000, "outputs": ["parameters"], "grid": {"bicycle": "many.csv"}}
    found = run(content | {"sampled": {"bicycle_sd": True}}, folder).parameters
    spread, mean = found.std("sample"), found.mean("sample")
    for name, sd in (("kooijman2008", {"c": 0.01}), ("benchmark", {"mB": 1.0}), ("pista_rider", {"c": 0.02})):
        for key in ("c", "mB", "w"):
            # of 4000 draws the standard deviation is known to 1.1 %, the mean to 1.6 % of it
            assert spread.sel(bicycle=name, parameter=key) == pytest.approx(sd.get(key, 0.0), rel=0.06, abs=1e-9)
            error = 0.08 * sd.get(key, 0.0) + 1e-9
            assert mean.sel(bicycle=name, parameter=key) == pytest.approx(load_bicycle(name)[key], abs=error)


@pytest.mark.parametrize(("changes", "words"), [
    ({"grid": {"bicycle": ["many.csv"]}}, r"grid\.bicycle = \['many\.csv'\]: give a table of bicycles"),
    ({"grid": {"bicycle": "benchmark"}}, r'give a table of bicycles, for example "bicycles\.csv"'),
    ({"grid": {"bicycle": "many.csv#benchmark"}}, "give a table of bicycles"),
    ({"grid": {"bicycle": "none.csv"}}, r"none\.csv: no such table of bicycles"),
    ({"grid": {"bicycle": "many.csv", "c": [0.05, 0.06]}}, r"c is varied, but each bicycle of grid\.bicycle"),
    ({"samples": 9, "sampled": {"mB": {"sd": 2.0}}}, r"mB is varied, but each bicycle of grid\.bicycle"),
    ({"grid": {"bicycle": "many.csv", "x": [1]}}, "unknown parameter 'x'"),
])  # fmt: skip
def test_refused(folder, changes, words):
    content = {"model": {}, "outputs": ["critical_speeds"], "grid": {"bicycle": "many.csv"}}
    with pytest.raises(InputError, match=words):
        build_sweep(content | changes, folder=folder)


def test_without_standard_deviations_or_with_impossible_ones(folder):
    content = {"model": {}, "samples": 9, "outputs": ["critical_speeds"], "sampled": {"bicycle_sd": True}}
    data = pd.read_csv(folder / "many.csv")
    data.drop(columns=["c_sd", "mB_sd"]).to_csv(folder / "bare.csv", index=False)
    with pytest.raises(InputError, match=r"no bicycle of grid\.bicycle states standard deviations"):
        build_sweep(content | {"grid": {"bicycle": "bare.csv"}}, folder=folder)
    data.assign(lam_sd=[None, 3.0, None], allow_unusual=True).to_csv(folder / "wide.csv", index=False)
    with pytest.raises(InputError, match="bicycle benchmark: lam: nothing between .* has a standard deviation of 3"):
        build_sweep(content | {"grid": {"bicycle": "wide.csv"}}, folder=folder)
