"""The page on sweeps: its examples run, what it prints is there, and it names every key, output and column."""

import re

import numpy as np
import pytest
from page_files import page, write_files

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from studies.commands import draw, sweep, uncertainty
from studies.sweeps import chunk, made_of, part_size, sketch, spec, sweep_file, variation
from studies.sweeps.run import run_sweep
from studies.sweeps.sweep_file import build_sweep, read_sweep

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


def test_every_name_stands_on_the_page():
    names = {
        *sweep_file.TOP_KEYS, *variation.SAMPLED_EXTRA, *variation.LEAF_KEYS, *spec.OUTPUTS, *spec.TYRE_UNITS,
        *chunk.CHANGES, *sweep_file.REDUCIBLE, *(f"NAME_{field}" for field in sketch.EXTREMES), spec.SPEED,
        "NAME_quantiles", "parameters", "covariance", "tyre_extrapolated", "quantiles",
    }  # fmt: skip
    commands = (sweep.command, draw.command, uncertainty.command)
    names |= {option for command in commands for p in command.params for option in p.opts}
    names -= {"sweep_file", "model", "result"}
    text = PYTHON.sub("", PAGE)
    missing = [name for name in sorted(names) if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", text)]
    assert missing == []


def test_every_figure_stands_on_the_page(folder, monkeypatch, capsys):
    from studies.sweep_pictures import figure_critical, figure_speed, shares, stored
    from studies.sweep_pictures.draw import draw_result

    monkeypatch.chdir(folder)
    monkeypatch.setattr("studies.reporting.plotting.FORMATS", ())  # what there is to be seen, not how it looks
    found = {**draw_result("covariance.zarr").figures, **draw_result("grid.zarr").figures}
    assert set(found) == {"modes_along_speed", "pairs", "variance_shares", "critical_speeds_each"}
    for name in (*found, "critical_speeds", "stability_along_speed"):
        assert f"| `{name}` |" in PAGE
    assert (figure_critical.LEAST_FOR_BARS, figure_critical.MOST_ROWS, figure_speed.MOST_MODES) == (30, 40, 4)
    assert (figure_speed.LEAST_FOR_BANDS, stored.MOST_BICYCLES) == (20, 200_000)
    assert (shares.LEAST, shares.RESAMPLES) == (40, 200)


def test_parts_and_fingerprint_are_those_of_the_page():
    assert (part_size.SHARES, part_size.LEAST_SECONDS, part_size.MOST_SECONDS) == (1000, 0.2, 10.0)
    for package in made_of.SOURCES:
        assert f"`{package}`" in PAGE


def test_limits_and_defaults_are_those_of_the_page():
    plain = build_sweep({"model": {"bicycle": "benchmark"}, "outputs": ["critical_speeds"]})
    assert (plain.seed, plain.max_speed, plain.points_per_part, plain.samples) == (0, 60.0, 65536, 1)
    assert (chunk.OCCURRENCES, variation.MOST_VALUES, sweep_file.MOST_BICYCLES) == (4, 10**6, 10**9)
    random = {"samples": 2, "sampled": {"c": {"sd": 0.001}}, "reduce": {}}
    assert build_sweep({"model": {"bicycle": "benchmark"}, "outputs": ["critical_speeds"], **random}).quantiles == (
        0.05, 0.5, 0.95,
    )  # fmt: skip
    assert int(sketch.SHIFT) == 52 - 10
    defaults = {p.name: p.default for p in uncertainty.command.params}
    assert (defaults["max_speed"], defaults["samples"], defaults["seed"]) == (60.0, 2000, 0)
    for header in ("value", "sd linear", "sd Monte Carlo", "2.5 %", "97.5 %", "lost", "main cause"):
        assert header in uncertainty.HEADERS
        assert f"`{header}`" in PAGE
