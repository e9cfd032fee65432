"""The page on designs: its example runs, and every option and default stands on it."""

from pages import missing_options, run_page, section, write_files

from bicycle import critical_speeds, read_model
from studies.cli import build

PAGE = section("charts_and_design", "Design")
CHARTS = section("charts_and_design", "Stability charts")


def test_the_example_runs(no_pictures, tmp_path, monkeypatch):
    monkeypatch.chdir(write_files(CHARTS, tmp_path))  # soft.toml
    shown = "".join(run_page(PAGE))
    assert "requirement met from 3 to 25 m/s: wobble stable" in shown
    assert "samples meet it" in shown
    assert not [c for c in critical_speeds(read_model("better.toml"), 25.0) if c.mode == "wobble"]
    assert [c for c in critical_speeds(read_model("soft.toml"), 25.0) if c.mode == "wobble"]


def test_every_option_and_default_stands_on_the_page():
    assert missing_options("design", PAGE) in ([], ["--out"])
    defaults = {p.name: p.default for p in build().get_command(None, "design").params}
    assert f"{defaults['samples']} parameter samples" in PAGE
    assert f"`--from` ({defaults['low']:g} m/s)" in PAGE
