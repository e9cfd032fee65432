"""The page on sweeps: its examples run, and it names every key, output, option and figure."""

import re

import numpy as np
import pytest
from pages import missing_options, page, run_page, without_files, write_files

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from studies.cli import build
from studies.model_space import OUTPUTS
from studies.sweep import build_sweep, draw_result, read_sweep, run_sweep

PAGE = page("sweeps")
PYTHON = re.compile(r"^```python\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The files of the page and the results of its sweeps."""
    place = write_files(PAGE, tmp_path_factory.mktemp("page"))
    names = sorted(path.stem for path in place.glob("*.toml") if path.stem != "model")
    assert names == ["covariance", "grid", "sample"]
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(place)
        for name in names:
            run_sweep(read_sweep(f"{name}.toml"), f"{name}.zarr")
    return place


def test_the_examples_run(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert read_sweep("grid.toml").items == 9
    namespace = {}
    blocks = PYTHON.findall(PAGE)
    assert len(blocks) == 2
    for block in blocks:
        exec(block, namespace)
    assert namespace["weave"].notnull().all()
    assert ((namespace["share"] >= 0) & (namespace["share"] <= 1)).all()
    assert namespace["made_by"]["model"]["effects"]["relaxation_length"]["tyre"] == "Tyre1"
    assert "weave stable above" in capsys.readouterr().out
    found, kept = namespace["xr"].open_zarr("covariance.zarr", consolidated=False), read_sweep("covariance.toml")
    drawn = np.cov(found.parameters.sel(parameter=["xB", "zB"]).values.T)
    np.testing.assert_allclose(np.sqrt(np.diag(drawn)), [0.02, 0.03], rtol=0.3)
    assert kept.shape == (60,)


def test_the_uncertainty_of_the_page_is_shown(folder, monkeypatch):
    monkeypatch.chdir(folder)
    (shown,) = run_page(without_files(PYTHON.sub("", PAGE)))
    assert "assumed standard uncertainties" in shown


def test_every_output_variable_and_option_stands_on_the_page(folder):
    import xarray as xr

    reduced = xr.open_zarr(folder / "sample.zarr", consolidated=False)
    reducible = "^(max_growth_rate|min_damping_ratio|tyre_extrapolated|impossible)"
    made = {re.sub(reducible, "NAME", str(name)) for name in reduced.data_vars}
    text = PYTHON.sub("", PAGE)
    assert missing_options("sweep", text) + missing_options("uncertainty", text) == []
    assert [name for name in sorted(made | set(OUTPUTS)) if not re.search(rf"\b{name}\b", text)] == []


@pytest.mark.usefixtures("no_pictures")
def test_every_figure_stands_on_the_page(folder, monkeypatch):
    monkeypatch.chdir(folder)
    found = {**draw_result("covariance.zarr").figures, **draw_result("grid.zarr").figures}
    assert set(found) == {"modes_along_speed", "pairs", "variance_shares", "critical_speeds_each"}
    for name in (*found, "critical_speeds", "stability_along_speed"):
        assert f"| `{name}` |" in PAGE


def test_defaults_are_those_of_the_page():
    plain = build_sweep({"model": {"bicycle": "benchmark"}, "outputs": ["critical_speeds"]})
    assert (plain.seed, plain.max_speed, plain.points_per_part, plain.samples) == (0, 60.0, 65536, 1)
    random = {"samples": 2, "sampled": {"c": {"sd": 0.001}}, "reduce": {}}
    found = build_sweep({"model": {"bicycle": "benchmark"}, "outputs": ["critical_speeds"], **random})
    assert found.quantiles == (0.05, 0.5, 0.95)
    defaults = {p.name: p.default for p in build().get_command(None, "uncertainty").params}
    assert (defaults["max_speed"], defaults["samples"], defaults["seed"]) == (60.0, 2000, 0)
