"""Draws that make no bicycle: kept as NaN, marked, counted and said; the same bits whatever computes them."""

import numpy as np
import pytest
from sweep_results import load

from studies.cli import main
from studies.model_space import Refused, left_out
from studies.sweep import build_sweep, run_sweep

TYRE = {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 4.0}}
ODD = {  # IBxz is free in sign and IBzz positive, so that some draws have IBxx IBzz < IBxz^2
    "model": {"bicycle": "benchmark", "effects": TYRE}, "samples": 96, "seed": 2, "points_per_part": 64,
    "outputs": ["max_growth_rate", "critical_speeds", "frequencies", "parameters"], "max_speed_m_s": 12.0,
    "grid": {"speed_m_s": [7.0]},
    "sampled": {"IBxz": {"sd": 1.5}, "IBzz": {"sd": 1.0}, "mB": {"sd": 30.0}, "tyre_covariance": True,
                "relative_cornering_stiffness_sd": 0.4},
}  # fmt: skip


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return run_sweep(build_sweep(ODD), tmp_path_factory.mktemp("odd") / "result.zarr")


def test_they_are_rows_of_nan_with_a_mark(kept):
    found = load(kept)
    p = {name: found.parameters.sel(parameter=name).values for name in ("IBxx", "IBzz", "IBxz", "mB")}
    beyond = p["IBxx"] * p["IBzz"] < p["IBxz"] ** 2
    assert 0 < beyond.sum() < 20
    np.testing.assert_array_equal(found.impossible, beyond)
    for name in ("max_growth_rate", "critical_speeds", "frequencies", "tyre_extrapolated"):
        values = found[name].values.reshape(96, -1)
        assert np.isnan(values[beyond]).all()
        assert not np.isnan(values[~beyond]).all(1).any()
    assert p["mB"].min() > 0
    stiffness = found.parameters.sel(parameter="relaxation_length.cornering_stiffness.rear")
    assert stiffness.min() > 0
    assert float(stiffness.std() / stiffness.mean()) > 0.3


def test_reductions_leave_them_out(kept, tmp_path):
    reduced = ODD | {"outputs": ["max_growth_rate"], "reduce": {"quantiles": [0.5]}}
    found, every = load(run_sweep(build_sweep(reduced), tmp_path / "reduced.zarr")), load(kept)
    assert (found.max_growth_rate_count == (every.impossible == 0).sum()).all()
    assert found.impossible_above_zero == every.impossible.sum()
    np.testing.assert_array_equal(found.max_growth_rate_max, every.max_growth_rate.max("sample"))


def test_the_command_says_how_many_and_why(kept, tmp_path, capsys):
    import tomli_w

    (tmp_path / "sweep.toml").write_text(tomli_w.dumps(ODD | {"outputs": ["parameters"], "grid": {}}))
    main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "result.zarr"), "--json", "-"])
    shown = capsys.readouterr()
    number = int(load(kept).impossible.sum())
    words = f"{number} of 96 samples rejected as impossible (IBxx IBzz < IBxz^2); the result holds NaN for them"
    assert words in shown.err
    assert f'"impossible_draws": {number}' in shown.out


@pytest.mark.parametrize("change", [
    {"sampled": {"w": {"sd": 2.0}}},  # wheels that bear no load
    {"sampled": {"c": {"sd": 1e308}}},  # numbers that overflow: no draw is left
    {"sampled": {"load_N": {"mean": 400.0, "sd": 4000.0}}},  # loads of which the table says nothing
    {"sampled": {"rider_lean.mass": {"sd": 25.0}}, "rider": True},  # more than the rear frame holds
])  # fmt: skip
def test_a_wide_distribution_is_no_reason_to_lose_the_sweep(tmp_path, change):
    rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
    effects = TYRE | ({"rider_lean": rider} if change.pop("rider", False) else {})
    content = ODD | {"model": {"bicycle": "benchmark", "effects": effects}, "samples": 60}
    found = load(run_sweep(build_sweep(content | {"outputs": ["eigenvalues"]} | change), tmp_path / "result.zarr"))
    assert (np.isnan(found.eigenvalues).all(("root", "speed_m_s")) == (found.impossible == 1)).all()
    assert (found.impossible == 0).any() or "c" in change["sampled"]


def test_reasons_are_counted_once_and_said():
    refused = Refused(4)
    refused.add("no load", np.array([True, False, True, False]))
    refused.add("odd", np.array([True, True, False, False]), "x is 3")
    refused.add("never", np.zeros(4, bool))
    assert refused.counts == {"no load": 2, "odd, for example: x is 3": 1}
    assert left_out(refused.counts, 4) == (
        "3 of 4 samples rejected as impossible (2: no load; 1: odd, for example: x is 3)"
    )
    assert left_out({"odd": 1}, 9) == "1 of 9 samples rejected as impossible (odd)"
    assert left_out({}, 9) == ""
