"""``velotyre sweep --plot``: which figures there are, and that their numbers are the result's."""

import json
import re
import shutil

import numpy as np
import pandas as pd
import pytest
from sweep_examples import MODEL, write_file
from sweep_results import load

from studies.cli import main
from studies.reporting import plotting
from studies.sweep import build_sweep, draw_result, figures_folder, read_result, run_sweep, sampled_parameters

TYRE = {"tyre": "Tyre1", "pressure_bar": {"rear": 6.5, "front": 5.5}}
MEASURED = {"bicycle": "pista_charlie_drops", "effects": {"relaxation_length": TYRE}}
SPEEDS = {"speed_m_s": [3.0, 5.4, 6.0]}
SAMPLE = {
    "model": MEASURED, "samples": 40, "seed": 2, "max_speed_m_s": 9.5,
    "outputs": ["critical_speeds", "max_growth_rate", "damping_ratios", "parameters"],
    "grid": SPEEDS | {"pressure_bar.front": [5.0, 6.0]},
    "sampled": {"c": {"sd": 0.01}, "mB": {"low": 70, "high": 95}, "tyre_covariance": True,
                "relative_cornering_stiffness_sd": 0.05},
}  # fmt: skip
GRID = {"model": MODEL, "outputs": ["critical_speeds"], "grid": {"c": [0.05, 0.06, 0.07, 0.08], "mB": [80.0, 90.0]}}


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    return run_sweep(build_sweep(SAMPLE), tmp_path_factory.mktemp("sample") / "sample.zarr")


@pytest.fixture(scope="module")
def drawn(sample):
    """Drawn with coarse dots."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(plotting, "STYLE", {**plotting.STYLE, "savefig.dpi": 20})
        return draw_result(sample)


def table(drawn, name):
    return pd.read_csv(drawn.folder / f"{name}.csv")


def test_a_sample_with_everything(sample, drawn):
    names = [
        "critical_speeds", "critical_speeds_each", "stability_along_speed", "modes_along_speed", "pairs",
        "variance_shares",
    ]  # fmt: skip
    assert list(drawn.figures) == names
    assert drawn.folder == figures_folder(sample) == sample.with_name("sample_figures")
    for name in names:
        assert (drawn.folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (drawn.folder / f"{name}.svg").read_text()
        assert len(table(drawn, name))
    assert "a band is drawn where at least half of the bicycles have the mode" in drawn.figures["modes_along_speed"]


def test_the_distribution_counts_those_that_have_none(sample, drawn):
    """Up to 9.5 m/s capsize is lost in a part of the bicycles, and wobble in all."""
    found, rows = load(sample), table(drawn, "critical_speeds")
    assert (rows["bicycles"] == 80).all()
    for _, row in rows.iterrows():
        place = {"crossing_mode": row["mode"], "as_speed_grows": row["as_speed_grows"], "occurrence": row["occurrence"]}
        held = found.critical_speeds.sel(place).values.ravel()
        held = held[np.isfinite(held)]
        assert row["have_it"] == len(held)
        assert row["have_none"] == 80 - len(held)
        assert row["q50_m_s"] == pytest.approx(np.median(held))
    assert set(rows["mode"]) == {"weave", "capsize"}
    capsize = rows[rows["mode"] == "capsize"].iloc[0]
    assert 0 < capsize["have_none"] < 80
    bars = table(drawn, "critical_speeds_bins")
    assert bars.groupby("mode")["bicycles"].sum().to_dict() == rows.groupby("mode")["have_it"].sum().to_dict()
    assert drawn.figures["critical_speeds"].endswith("0 of 80 possible ones have none")
    each = table(drawn, "critical_speeds_each")
    assert set(each["combination"]) == {"pressure_bar.front = 5", "pressure_bar.front = 6"}
    assert (each["possible"] == 40).all()


def test_bands_and_shares_of_the_unstable_are_those_of_the_result(sample, drawn):
    found, rows = load(sample), table(drawn, "stability_along_speed")
    growth = found.max_growth_rate.values.transpose(0, 1, 2).reshape(80, 3)
    unstable = rows[rows["quantity"] == "unstable"]
    np.testing.assert_allclose(unstable["share"], (growth > 0).mean(0))
    bands = rows[rows["quantity"] == "max_growth_rate"]
    for level in (5, 25, 50, 75, 95):
        np.testing.assert_allclose(bands[f"q{level}"], np.quantile(growth, level / 100, axis=0))
    modes = table(drawn, "modes_along_speed")
    weave = modes[modes["mode"] == "weave"]
    values = found.damping_ratios.sel(mode="weave").values.reshape(80, 3)
    np.testing.assert_array_equal(weave["bicycles"], np.isfinite(values).sum(0))
    np.testing.assert_allclose(weave["q50"], np.nanmedian(values, 0))


def test_draws_made_again_are_those_of_the_result(sample):
    found = load(sample).parameters
    varied, remark = sampled_parameters(read_result(sample))
    assert not remark
    by_name = {one.name: one for one in varied}
    for name in ("c", "mB"):
        np.testing.assert_array_equal(by_name[name].values[0], found.sel(parameter=name).values[0])
    front = found.sel(parameter="relaxation_length.cornering_stiffness.front").values[1]
    ratio = by_name["cornering stiffness front / table"].values[0]
    logs = np.log(np.column_stack([ratio, by_name["mB"].values[0], by_name["c"].values[0]]))
    fitted = np.column_stack([logs, np.ones(len(ratio))])
    slopes, left, *_ = np.linalg.lstsq(fitted, np.log(front))
    assert slopes[0] == pytest.approx(1, abs=0.06)  # the rest follows the wheel load
    assert left[0] < 0.01 * np.var(np.log(front)) * len(front)
    assert 0.03 < ratio.std() < 0.08  # sd of 5 %


def test_pairs_hold_the_bicycles_as_they_are(sample, drawn):
    rows, found = table(drawn, "pairs"), load(sample)
    growth = found.max_growth_rate.values.reshape(80, 3)
    share = (growth > 0).mean(0)
    assert "; the first 5 of 6 outputs" in drawn.figures["pairs"]
    k = int(np.abs(share - 0.5).argmin())
    assert 0 < share[k] < 1
    np.testing.assert_array_equal(rows["unstable"], growth[:, k] > 0)
    np.testing.assert_allclose(rows["c, m"], np.tile(found.parameters.sel(parameter="c").values[0], 2))
    assert rows[f"maximum growth rate at {SPEEDS['speed_m_s'][k]:g} m/s, 1/s"].to_numpy() == pytest.approx(growth[:, k])


def test_shares_say_what_they_rest_on(no_pictures, drawn, tmp_path):
    rows = table(drawn, "variance_shares")
    weave = rows[rows["output"] == "weave: stable above, m/s"].set_index("parameter")["first_order"]
    assert weave.idxmax() == "c"
    assert "capsize: unstable above, m/s" not in set(rows["output"])  # too few bicycles have it
    joint = {"parameters": ["c", "w"], "covariance": [[1e-4, -5e-5], [-5e-5, 1e-4]]}
    content = {"model": MODEL, "samples": 60, "outputs": ["critical_speeds", "max_growth_rate"], "grid": SPEEDS,
               "max_speed_m_s": 5.75, "sampled": {"joint": [joint]}}  # fmt: skip
    found = draw_result(run_sweep(build_sweep(content), tmp_path / "joint.zarr"))
    (said,) = [remark for remark in found.remarks if "correlated" in remark]
    assert "correlated: c and w (-0.50); their shares overlap and have no unique split" in said


def test_a_speed_that_is_not_in_the_result_is_computed_anew(no_pictures, sample, tmp_path, monkeypatch):
    found = draw_result(sample, tmp_path / "at", at=5.2)
    rows = pd.read_csv(tmp_path / "at" / "pairs.csv")
    content = SAMPLE | {"outputs": ["max_growth_rate"], "grid": SAMPLE["grid"] | {"speed_m_s": [5.2]}}
    other = load(run_sweep(build_sweep(content), tmp_path / "other.zarr")).max_growth_rate.values.ravel()
    assert 0 < (other > 0).sum() < 80
    np.testing.assert_array_equal(rows["unstable"], other > 0)
    assert "pairs" in found.figures
    monkeypatch.setattr("studies.sweep.specification.software", lambda: {"numpy": "0.1"})
    _, remark = sampled_parameters(read_result(sample))
    assert "cannot be drawn again as in sample.zarr, since this has changed: numpy (" in remark


def test_at_a_speed_that_cannot_be_told(no_pictures, sample, tmp_path, monkeypatch, refused):
    monkeypatch.setattr("studies.sweep.specification.software", lambda: {"numpy": "0.1"})
    for asked, words in (
        ("4", "--at 4: sample.zarr has no result at this speed, .* give one that it holds, the nearest are 3, 5.4 m/s"),
        ("nan", "'--at': nan: give a number from 0 up to 1000"),
        ("-1", "'--at': -1: give a number from 0"),
    ):
        assert re.search(words, refused("sweep", sample, "--figures", tmp_path / "no", "--at", asked))
        assert not [*(tmp_path / "no").glob("*.svg")]  # it is refused before anything is drawn


def test_a_grid(no_pictures, tmp_path, capsys):
    main(["sweep", str(write_file(tmp_path, GRID)), "--out", str(tmp_path / "g.nc"), "--plot"])
    shown = capsys.readouterr()
    assert "g_figures/critical_speeds_each.png, .svg, .csv: Critical speeds up to 60 m/s of 8 bicycles" in shown.out
    shares = pd.read_csv(tmp_path / "g_figures" / "variance_shares.csv")
    assert (shares["half_width_95"] == 0).all()
    assert shares["total"].between(0, 1.0001).all()
    main(["sweep", str(tmp_path / "sweep.toml"), "--out", str(tmp_path / "z.zarr"), "--plot", "--json", "-"])
    record = json.loads(capsys.readouterr().out)  # nothing but the record
    assert set(record["figures"]) == {"critical_speeds_each", "pairs", "variance_shares"}
    for name in ("critical_speeds_each", "pairs", "variance_shares"):
        one, other = (tmp_path / f"{kind}_figures" / f"{name}.csv" for kind in "gz")
        assert one.read_text() == other.read_text()


def test_a_reduced_result(no_pictures, tmp_path):
    content = SAMPLE | {"outputs": ["critical_speeds", "max_growth_rate"], "reduce": {"quantiles": [0.1, 0.5, 0.9]}}
    out = run_sweep(build_sweep(content), tmp_path / "r.zarr")
    found, data = draw_result(out), load(out)
    assert list(found.figures) == ["critical_speeds_each", "stability_along_speed"]
    assert "line: 80 % of those that have it" in found.figures["critical_speeds_each"]
    assert "[reduce] kept no samples" in " ".join(found.remarks)
    rows = pd.read_csv(found.folder / "stability_along_speed.csv")
    above = data.max_growth_rate_above_zero.sum("pressure_bar.front") / 80
    np.testing.assert_allclose(rows[rows["quantity"] == "unstable"]["share"], above)


def test_bicycles_by_name_and_eigenvalues_in_netcdf(no_pictures, tmp_path):
    from bicycle.files import load_bicycle
    from bicycle.parameters import UNITS

    names = ["benchmark", "browser", "fisher"]
    rows = [{"name": name} | {key: load_bicycle(name)[key] for key in UNITS} for name in names]
    pd.DataFrame(rows).to_csv(tmp_path / "many.csv", index=False)
    content = {"model": {"effects": MODEL["effects"]}, "outputs": ["critical_speeds", "eigenvalues", "modes"],
               "grid": {"bicycle": "many.csv", "speed_m_s": [3.0, 5.0, 8.0]}}  # fmt: skip
    found = draw_result(run_sweep(build_sweep(content, folder=tmp_path), tmp_path / "b.nc"))
    each = pd.read_csv(found.folder / "critical_speeds_each.csv")
    assert set(each["combination"]) <= set(names)
    assert "Critical speeds up to 60 m/s of 3 bicycles" in found.figures["critical_speeds_each"]
    assert {"stability_along_speed", "modes_along_speed", "pairs"} <= set(found.figures)
    assert "band" not in found.figures["modes_along_speed"]  # each of the three has its line
    assert "only bicycle is varied, so there are no variance shares" in found.remarks


def test_refused(sample, tmp_path, refused):
    (tmp_path / "half.zarr.parts").mkdir()
    (tmp_path / "text.nc").write_text("x")
    (tmp_path / "empty.zarr").mkdir()
    shutil.copytree(sample, tmp_path / "foreign.zarr")
    file = tmp_path / "foreign.zarr" / "zarr.json"
    content = json.loads(file.read_text())
    file.write_text(json.dumps(content | {"attributes": {}}))
    shutil.copytree(sample, tmp_path / "chunk.zarr")
    for chunk in (tmp_path / "chunk.zarr").glob("*/c/**/*"):
        if chunk.is_file():
            chunk.write_bytes(b"not compressed")
    shutil.copytree(sample, tmp_path / "labels.zarr")
    shutil.rmtree(tmp_path / "labels.zarr" / "crossing_mode" / "c")  # a missing chunk is read as empty labels
    plain = build_sweep({"model": MODEL, "outputs": ["parameters"], "grid": {"c": [0.05, 0.06]}})
    run_sweep(plain, tmp_path / "plain.zarr")
    for name, words in (
        ("none.zarr", "there is no such result; give the folder (.zarr) or file (.nc)"),
        ("half.zarr", "it is not finished: "),
        ("text.nc", "cannot be read as the result of a sweep"),
        ("empty.zarr", "cannot be read as the result of a sweep"),
        ("chunk.zarr", "cannot be read as the result of a sweep"),
        ("labels.zarr", "labels of crossing_mode are alike"),
        ("foreign.zarr", "is not a result of 'velotyre sweep'"),
        ("plain.zarr", "holds nothing to draw (parameters; samples are not classed as stable or unstable"),
    ):
        assert words in refused("sweep", tmp_path / name, "--plot")
    assert not list(tmp_path.glob("*_figures"))


def test_the_result_of_an_effect_that_is_not_known_leaves_nothing(sample, tmp_path, refused):
    """As of a sweep with an effect of one's own, drawn without --effects."""
    result, figures = tmp_path / "own.zarr", tmp_path / "figures"
    shutil.copytree(sample, result)
    file = result / "zarr.json"
    content = json.loads(file.read_text())
    sweep = json.loads(content["attributes"]["sweep"])
    sweep["model"]["effects"] = {"swaying_box": {"mass": 5.0}}
    content["attributes"]["sweep"] = json.dumps(sweep)
    file.write_text(json.dumps(content))
    assert "unknown effect 'swaying_box'" in refused("sweep", result, "--figures", figures)
    assert not figures.exists()


def test_a_sweep_without_critical_speeds_is_finished_and_says_so(no_pictures, tmp_path, capsys, refused):
    content = {"model": {"bicycle": "benchmark"}, "outputs": ["critical_speeds"], "max_speed_m_s": 2.0,
               "grid": {"c": [0.06, 0.08]}}  # fmt: skip
    out = tmp_path / "none.zarr"
    main(["sweep", str(write_file(tmp_path, content)), "--out", str(out), "--plot"])
    said = capsys.readouterr().err
    assert "remark: " in said
    assert "no sample has a critical speed up to 2 m/s, so none are drawn" in said
    assert "no sample has a critical speed up to 2 m/s" in refused("sweep", out, "--plot")
    call = ["sweep", str(out), "--plot", "--at", "5", "--json", str(tmp_path / "record.json")]
    main(call)  # growth rates at 5 m/s are computed anew
    assert "pairs" in json.loads((tmp_path / "record.json").read_text())["figures"]
    rows = pd.read_csv(tmp_path / "none_figures" / "pairs.csv")
    assert rows["unstable"][1] == 0  # c = 0.08 m: between 4.3 and 6.0 m/s (Meijaard et al. 2007)
