"""Outputs that are declared here show up in sweeps, their figures, charts and uncertainty, and nowhere else."""

import json

import numpy as np
import pandas as pd
import pytest
from sweep_examples import MODEL, write_file

pytest.importorskip("zarr")
pytest.importorskip("xarray")

from bicycle import load_bicycle
from bicycle.model import build_model
from studies.chart import Plane, contour_values
from studies.cli import main
from studies.model_space import MODE, OUTPUTS, ROOTS, output
from studies.model_space import MODEL as OF_MODEL
from studies.sweep import build_sweep, read_result, run_sweep
from tyre.ground import InputError

SPEEDS = {"speed_m_s": [4.0, 6.0, 8.0]}


@pytest.fixture
def toys():
    """An output of the roots, one of a named mode, one of the model at speeds and one of the model alone."""
    known = dict(OUTPUTS)

    @output("slowest_decay", unit="1/s", label="Slowest decay", source=ROOTS)
    def slowest_decay(roots):
        return -roots.real.max(-1)

    @output("turns", unit="1", label="turns in a second", source=MODE)
    def turns(first, second):
        return first.imag / (2 * np.pi)

    @output("trail_speed", unit="m^2/s", label="Trail times speed", source=OF_MODEL)
    def trail_speed(model, speeds, max_speed):
        return model.bicycle["c"] * np.asarray(speeds)

    @output("front_load", unit="N", label="Front wheel load", source=OF_MODEL, by_speed=False)
    def front_load(model, speeds, max_speed):
        return model.bicycle.static_loads[1]

    yield
    OUTPUTS.clear()
    OUTPUTS.update(known)


def test_in_a_sweep_computed_and_drawn(toys, no_pictures, tmp_path, capsys):
    import xarray as xr

    content = {
        "model": MODEL, "grid": SPEEDS | {"c": [0.06, 0.07, 0.08, 0.09], "mB": [80.0, 90.0]},
        "outputs": ["slowest_decay", "turns", "trail_speed", "front_load", "max_growth_rate", "frequencies"],
    }  # fmt: skip
    out = tmp_path / "toy.zarr"
    main(["sweep", str(write_file(tmp_path, content)), "--out", str(out), "--plot"])
    with xr.open_zarr(out, consolidated=False) as data:
        np.testing.assert_array_equal(data.slowest_decay, -data.max_growth_rate)
        np.testing.assert_array_equal(data.turns, data.frequencies)
        np.testing.assert_allclose(data.trail_speed.sel(c=0.06, mB=80.0), 0.06 * data.speed_m_s, rtol=1e-12)
        loads = [load_bicycle("benchmark").replace(mB=mass).static_loads[1] for mass in (80.0, 90.0)]
        np.testing.assert_allclose(data.front_load.sel(c=0.08), loads, rtol=1e-12)
        assert data.front_load.attrs["units"] == "N"
        assert data.trail_speed.dims == ("c", "mB", "speed_m_s")
    figures = tmp_path / "toy_figures"
    along = pd.read_csv(figures / "stability_along_speed.csv")
    assert {"slowest_decay", "trail_speed"} < set(along["quantity"])
    assert "turns" in set(pd.read_csv(figures / "modes_along_speed.csv")["quantity"])
    assert "front wheel load, N" in pd.read_csv(figures / "pairs.csv").columns
    shares = pd.read_csv(figures / "variance_shares.csv").set_index(["output", "parameter"])["first_order"]
    assert shares["front wheel load, N", "mB"] == pytest.approx(1.0)
    assert "sweep" not in capsys.readouterr().err


def test_a_result_with_an_output_that_is_not_known_any_more_is_refused(toys, tmp_path):
    sweep = build_sweep({"model": MODEL, "grid": {"c": [0.06, 0.08]}, "outputs": ["front_load"]})
    run_sweep(sweep, tmp_path / "toy.zarr")
    del OUTPUTS["front_load"]
    with pytest.raises(InputError, match="toy.zarr: unknown output 'front_load'"):
        read_result(tmp_path / "toy.zarr")


def test_a_changed_output_does_not_continue_an_old_result(toys, tmp_path):
    sweep = build_sweep({"model": MODEL, "grid": {"c": [0.06, 0.08]}, "outputs": ["front_load"]})
    assert len(sweep.made_of["the output front_load"]) == 64


def test_in_a_chart(toys, no_pictures, tmp_path):
    main(["chart", "benchmark", "--x", "speed=4:8", "--y", "c=0.06:0.1", "--out", str(tmp_path),
          "--contours", "slowest_decay"])  # fmt: skip
    table = pd.read_csv(tmp_path / "stability_chart_slowest_decay.csv")
    assert list(table.columns) == ["speed_m_s", "c_m", "slowest_decay"]
    row = table.iloc[100]
    model = build_model({"bicycle": dict(load_bicycle("benchmark").replace(c=row.c_m).values)})
    expected = -model.linear_model().eigenvalues(row.speed_m_s).real.max()
    assert row.slowest_decay == pytest.approx(expected, rel=1e-9)
    plane = Plane.of({"bicycle": "benchmark"}, "speed=4:8", "c=0.06:0.1")
    for name, top in (("front_load", model.bicycle.static_loads[1]), ("trail_speed", 0.1 * 8)):
        share, values = contour_values(plane, OUTPUTS[name], 3)
        assert share.tolist() == [0, 0.5, 1]
        assert values[2, 2] == pytest.approx(top, rel=1e-9)


def test_in_uncertainty(toys, capsys):
    given = ["uncertainty", "benchmark", "--stated-only", "--sd", "mB=2", "--samples", "60", "--speeds", "5"]
    main([*given, "--output", "front_load", "--output", "slowest_decay", "--json", "-"])
    found = {q["quantity"]: q for q in json.loads(capsys.readouterr().out)["quantities"]}
    load, bicycle = found["Front wheel load"], load_bicycle("benchmark")
    more, less = (bicycle.replace(mB=bicycle["mB"] + change).static_loads[1] for change in (1.0, -1.0))
    assert load["value"] == pytest.approx(bicycle.static_loads[1], rel=1e-9)
    assert load["linear_sd"] == pytest.approx(2 * (more - less) / 2, rel=1e-6)
    assert load["monte_carlo_sd"] == pytest.approx(load["linear_sd"], rel=0.3)
    decay = found["Slowest decay at 5 m/s"]
    assert decay["value"] == pytest.approx(-build_model({"bicycle": "benchmark"}).linear_model()
                                           .eigenvalues(5.0).real.max(), rel=1e-9)  # fmt: skip
    assert decay["linear_variance_shares"] == {"mB": pytest.approx(1.0)}
    turns, frequency = (found[f"weave {what} at 5 m/s"] for what in ("turns in a second", "frequency"))
    assert turns["value"] == frequency["value"]
    assert turns["linear_sd"] == pytest.approx(frequency["linear_sd"], rel=1e-6)


@pytest.mark.parametrize("command", [
    ["uncertainty", "benchmark", "--sd", "mB=2", "--output", "max_growth"],
    ["chart", "benchmark", "--x", "speed", "--y", "c", "--contours", "max_growth"],
])  # fmt: skip
def test_an_unknown_output_is_refused(command, tmp_path, refused):
    words = refused(*command, *(["--out", tmp_path] if command[0] == "chart" else []))
    assert "unknown output 'max_growth'; did you mean 'max_growth_rate'" in words
