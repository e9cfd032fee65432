"""Refused sweeps: mistakes in its file, points that are no bicycle, results of another sweep."""

import numpy as np
import pytest
from sweep_examples import GRID, MEASURED, MODEL, RANDOM

from studies.sweep import build_sweep, compute, open_parts, run_sweep
from tests.shared.refusals import refuses
from tyre.ground import InputError


@pytest.mark.parametrize(("change", "words"), [
    ({"max_speed_m_s": -1.0}, "max_speed_m_s = -1 must be above 0 m/s"),
    ({"seed": 2**63}, "seed = 9223372036854775808 must be a whole number from 0 to"),
    ({"grid": {"mB": [10**400]}}, "must be a finite number"),
    ({"grid": {"mB": {"from": 1, "to": 2, "count": 10**9}}}, "must be a whole number from 2 to 1000000"),
    ({"grid": {k: {"from": 1, "to": 2, "count": 10**4} for k in ("w", "c", "mB")}}, "1e[+]12 bicycles; at most"),
    ({"model": MEASURED, "grid": {"tyre": [1.0]}}, "grid.tyre = 1.0 must be a name in quotes"),
    ({"model": MEASURED, "sampled": {"tyre": {"mean": 1.0, "sd": 1.0}}, "samples": 2}, "a name cannot be sampled"),
    ({"model": MEASURED, "sampled": {"tyre_covariance": "no"}, "samples": 2}, "'no' must be true or false"),
    ({"model": MEASURED, "sampled": {"relative_cornering_stiffness_sd": -0.1}, "samples": 2}, "-0.1 must be >= 0"),
    ({"model": MEASURED, "sampled": {"relative_cornering_stiffness_sd": 0.1, "c": {"sd": 0.001}}, "samples": 2},
     "relative_cornering_stiffness_sd does nothing without tyre_covariance = true"),
    ({"sampled": {"speed_m_s": {"low": 1.0, "high": 2.0}}, "samples": 2}, "speed_m_s is varied twice"),
    ({"outputs": ["critical_speeds"]}, "speed_m_s is varied, but critical_speeds do not depend on it"),
    ({"sampled": {"joint": [1]}, "samples": 2}, "sampled.joint = .* must be a list of tables"),
    ({"sampled": {"joint": [{"parameters": "mB"}]}, "samples": 2}, "parameters = 'mB' must be a list of names"),
    ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": 8.0}]}, "samples": 2},
     "mean = 8.0; give a list of one number per parameter"),
    # a correlation of 1.5 between numbers of very different size
    ({"sampled": {"joint": [{"parameters": ["relaxation_length.cornering_stiffness", "IHxz"],
                             "covariance": [[1e6, 0.15], [0.15, 1e-8]]}]}, "samples": 2},
     "symmetric without negative eigenvalues"),
    ({"reduce": [0.5]}, r"reduce = \[0.5\] must be a table: write \[reduce\]"),
    ({"reduce": {"quantiles": 0.5}}, "reduce.quantiles = 0.5 must be a list"),
    ({"reduce": {"quantiles": [0.5, 0.5]}}, "reduce.quantiles holds a value twice"),
    ({"reduce": {}, "outputs": ["max_growth_rate"]}, "but nothing is sampled; leave it out"),
    ({"modle": 1}, "unknown key 'modle'; did you mean 'model'"),
    ({"model": None}, "model is missing: give a model file or a table"),
    ({"model": "none.toml"}, "model = 'none.toml': no such model file"),
    ({"outputs": []}, r"outputs = \[\] must hold at least one: give a list of eigenvalues"),
    ({"outputs": ["eigenvalue"]}, "unknown output 'eigenvalue'; did you mean 'eigenvalues'"),
    ({"grid": {"mb": [1]}}, "unknown parameter 'mb'; did you mean 'mB'"),
    ({"grid": {"pressure_bar": [4]}}, "unknown parameter 'pressure_bar'"),
    ({"grid": {"mB": []}}, r"grid.mB = \[\]: give a list of values or {from, to, count}"),
    ({"grid": {"mB": [1.0, 1.0]}}, "grid.mB holds a value twice"),
    ({"grid": {"mB": {"from": 1, "to": 2}}}, "grid.mB: count is missing"),
    ({"grid": {"mB": {"from": 1, "to": 2, "step": 2}}}, "unknown key of grid.mB: 'step'"),
    ({"grid": {"mB": {"from": 1, "to": 2, "count": 0}}}, "count = 0 must be a whole number from 2"),
    ({"grid": {"speed_m_s": [-1.0]}}, "grid.speed_m_s holds -1; give speeds >= 0"),
    ({"grid": {"mB": [80.0]}}, "eigenvalues need speeds: add grid.speed_m_s"),
    ({"grid": 3}, r"grid = 3 must be a table: write \[grid\]"),
    ({"samples": 10}, "samples = 10, but nothing is sampled"),
    ({"samples": 0}, "samples = 0 must be a whole number from 1"),
    ({"sampled": {"mB": {"sd": 1.0}}}, r"are sampled, but samples = 1 \(default 1\) is too few"),
    ({"sampled": {"mB": 1.0}, "samples": 2}, r"sampled.mB = 1.0: give {mean, sd}, {sd} or {low, high}"),
    ({"sampled": {"mB": {"sd": -1.0}}, "samples": 2}, "sampled.mB.sd = -1 must be >= 0"),
    ({"sampled": {"mB": {"low": 2.0, "high": 1.0}}, "samples": 2}, "low = 2 must be below high = 1"),
    ({"sampled": {"speed_m_s": {"low": -9.0, "high": 1.0}}, "samples": 2, "grid": {}},
     "sampled.speed_m_s: low = -9 is outside 0 .. inf"),
    ({"sampled": {"mB": {"mean": -5.0, "sd": 1.0}}, "samples": 2},
     "sampled.mB: the mean -5 is outside 0 .. inf, so no sample is possible"),
    ({"sampled": {"lam": {"sd": 2.0}}, "samples": 2},
     "sampled.lam: nothing between -1.57.* with a mean of 0.31.* has a standard deviation of 2"),
    ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1.0]], "mean": [-1.0]}]}, "samples": 2},
     "sampled.joint: mB: the mean -1 is outside"),
    ({"sampled": {"bicycle_sd": True}, "samples": 2},
     r"bicycle 'benchmark' states no standard deviations; give them in its file \(\[sd\]\), in \[covariance\]"),
    ({"sampled": {"tyre_covariance": True}, "samples": 2}, "sampled.tyre_covariance needs a measured tyre"),
    ({"sampled": {"speed_m_s": {"sd": 1.0}}, "samples": 2}, "sampled speed_m_s: mean is missing"),
    ({"model": {"bicycle": "benchmark",
                "effects": {"side_slip": {"cornering_stiffness": {"rear": 6e3, "front": 5e3}}}},
      "sampled": {"side_slip.cornering_stiffness": {"sd": 100.0}}, "samples": 2},
     "the model has 6000 at the rear and 5000 at the front wheel, so give side_slip.cornering_stiffness.rear and"),
    ({"sampled": {"joint": [{}]}, "samples": 2}, "sampled.joint: parameters is missing"),
    ({"sampled": {"joint": [{"parameters": ["mB"], "covariance": [[1, 2]]}]}, "samples": 2}, "be 1 x 1 numbers"),
    ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1],
                      "relaxation_length.relaxation_length.rear": [0.1]}},
     "are both varied; give both wheels together"),
    ({"reduce": {"quantiles": [2]}}, "reduce.quantiles holds 2; give numbers from 0 to 1"),
    ({"reduce": {"mean": True}}, "unknown key of reduce: 'mean'"),
    ({"reduce": {}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2},
     r"eigenvalues cannot be reduced over samples; with \[reduce\] ask for max_growth_rate"),
])  # fmt: skip
def test_refused_files(change, words):
    content = {"model": MODEL, "outputs": ["eigenvalues"], "grid": GRID} | change
    with pytest.raises(InputError, match=words):
        build_sweep({key: value for key, value in content.items() if value is not None})


@pytest.mark.parametrize(("change", "words"), [
    ({"grid": GRID | {"mB": [80.0, -1.0]}},
     r"sweep at mB = -1.0: bicycle .* mB = -1 kg must not be negative; 1 of the 2 bicycles .*; leave it out"),
    ({"grid": GRID | {"relaxation_length.relaxation_length": [0.1, 0.0]}},
     "sweep at .* = 0.0: effect 'relaxation_length'"),
    # a cell, at the mean of what is sampled, that the draws of this seed would miss
    ({"grid": GRID | {"IBxz": [0.0, 6.0]}, "sampled": {"mB": {"sd": 1.0}}, "samples": 2},
     r"sweep at IBxz = 6.0, the mean of what is sampled: .* the rear frame has a negative principal inertia"),
    ({"model": MEASURED, "grid": GRID | {"load_N": [400.0, 1e6]}, "sampled": {"c": {"sd": 0.001}}, "samples": 2},
     r"sweep at load_N = 1000000.0, the mean of what is sampled: the tyre's table does not cover .*extrapolation"),
    ({"model": MEASURED, "grid": GRID | {"pressure_bar": [400.0]}},
     "pressure_bar = 400 must be a number above 0 and up to 20 bar"),
    ({"model": {"bicycle": "benchmark", "effects": {"side_slip": {"cornering_stiffness": 6000.0}}},
      "grid": {"speed_m_s": [0.0, 1.0]}}, "speed 0 m/s is not allowed with side_slip"),
])  # fmt: skip
def test_impossible_points_are_named(tmp_path, change, words):
    content = {"model": MODEL, "outputs": ["max_growth_rate"], "grid": GRID} | change
    with pytest.raises(InputError, match=words):
        run_sweep(build_sweep(content), tmp_path / "result.zarr")
    assert not list(tmp_path.iterdir())  # nothing is computed, and nothing in the way of the mended sweep


def test_what_is_found_impossible_on_the_way(monkeypatch, tmp_path):
    content = {"model": MODEL, "outputs": ["critical_speeds"], "grid": {"mB": {"from": 80, "to": 90, "count": 33}}}
    sweep, out = build_sweep(content), tmp_path / "result.zarr"
    finished = {name: rows[..., :0] for name, rows in compute(sweep, 0, 32).items()}  # the last axis is of occurrences
    monkeypatch.setattr("studies.model_space.outputs.OCCURRENCES", 0)
    words = r"sweep at mB = 80.0: \w+ has more than 0 \w+ critical speeds up to 60 m/s; lower max_speed_m_s; leave"
    refuses(words, run_sweep, sweep, out)
    assert not list(tmp_path.iterdir())  # nothing is in the way of a changed sweep
    open_parts(out, sweep).write((0, 32), finished)
    refuses(r"at mB = 90.0: .*; 32 of 33 bicycles are .* kept in .*, but a changed sweep", run_sweep, sweep, out)
    assert list(tmp_path.glob("*/*.part"))


def test_conditions_of_an_effect_hold_for_every_point(tmp_path):
    rider = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}
    model = {"bicycle": "benchmark", "effects": MODEL["effects"] | {"rider_lean": rider}}
    content = {"model": model, "outputs": ["max_growth_rate"], "grid": GRID | {"rider_lean.z": [-1.0, -1.4]}}
    words = r"sweep at rider_lean.z = -1.4: effect 'rider_lean': what remains of the rear"
    with pytest.raises(InputError, match=words):
        run_sweep(build_sweep(content), tmp_path / "result.zarr")


def test_refused_results(reference, tmp_path):
    other = build_sweep(RANDOM | {"seed": 6})
    with pytest.raises(
        InputError, match=r"is not the result of this sweep \(changed since: the sweep\); remove it or choose another"
    ):
        run_sweep(other, reference)
    (tmp_path / "text.nc").write_text("x")
    refuses(r"text.nc exists and is not the result of this sweep", run_sweep, other, tmp_path / "text.nc")
    refuses(r"the name must end in .zarr or .nc \(netCDF\)", run_sweep, other, tmp_path / "result.csv")
    mark = tmp_path / "a.zarr.parts" / "sweep.json"
    open_parts(tmp_path / "a.zarr", build_sweep(RANDOM)).write((0, 1), {"x": np.zeros(1)})
    for text in (mark.read_text(), "", "[]", None):
        mark.unlink() if text is None else mark.write_text(text)
        refuses("holds parts of another sweep", run_sweep, other, tmp_path / "a.zarr")
    next(mark.parent.glob("*.part")).unlink()
    assert open_parts(tmp_path / "a.zarr", other).folder == mark.parent  # nothing finished is in it
