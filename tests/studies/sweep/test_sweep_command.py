"""``velotyre sweep``."""

import json

import pytest
from sweep_examples import GRID, MEASURED, MODEL, write_file
from sweep_results import load

from studies.cli import main


def test_command(tmp_path, capsys, refused):
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
        assert words in refused("sweep", file, "--out", tmp_path / "other.zarr", *arguments)
    for text, words in (
        (None, "no such sweep file"),
        ("x = ", "not a TOML file"),
        ("model = 3", "bad.toml: model = 3 must be a model file"),
    ):
        bad = tmp_path / "bad.toml"
        if text:
            bad.write_text(text)
        assert words in refused("sweep", bad, "--out", out)


def test_command_says_what_is_assumed_and_extrapolated(tmp_path, capsys):
    content = {"model": MEASURED, "outputs": ["parameters"], "samples": 2, "grid": {"mB": [85, 300]}}
    content["sampled"] = {"tyre_covariance": True, "relative_cornering_stiffness_sd": 0.03}
    main(["sweep", str(write_file(tmp_path, content)), "--out", str(tmp_path / "result.zarr"), "--verbose"])
    said = capsys.readouterr().err
    assert "assumed: 3 % (one standard uncertainty)" in said
    assert "none is assumed" not in said
    outside = int(load(tmp_path / "result.zarr").tyre_extrapolated.sum())
    assert outside > 0
    assert f"{outside} of 4 samples have a tyre outside its measured loads and pressures" in said


@pytest.mark.parametrize(("arguments", "words"), [
    (["x.toml"], "--out is missing: give a .zarr folder or .nc file"),
    (["r.zarr"], "r.zarr is a result; give --plot, and no --out, to draw it"),
    (["r.nc", "--plot", "--out", "a.zarr"], "r.nc is a result; give --plot, and no --out"),
    (["x.toml", "--out", "a.zarr", "--at", "3"], "--at 3 is for figures; give --plot, too"),
])  # fmt: skip
def test_options_that_do_not_go_together(arguments, words, refused):
    assert words in refused("sweep", *arguments)


def test_missing_extra(monkeypatch, refused):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    said = refused("sweep", "x.toml", "--out", "x.zarr")
    assert "zarr is not installed; install it with: pip install " in said
    assert "[sweeps]" in said
