"""The page on rides runs as it stands, and its figure in the gallery says what it shows."""

import re
import runpy
from pathlib import Path

from matplotlib import pyplot as plt
from pages import page, run_page

DOCS = Path(__file__).parents[2] / "docs"

PAGE = page("from_a_ride")


def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, shown = run_page(PAGE)
    assert "The bicycle turns from" in shown


def test_the_gallery_names_the_interval_that_misses_and_takes_the_true_values_of_the_rides(monkeypatch):
    monkeypatch.setattr(plt, "show", lambda: plt.close("all"))
    monkeypatch.chdir(DOCS / "gallery")
    names = runpy.run_path("plot_tyres_from_a_ride.py")
    assert names["missed"] == ["Cornering stiffness, rear"]
    assert "The interval of the rear cornering stiffness misses the true value." in names["__doc__"]
    assert names["after"].fits_data
    text = (DOCS / "examples" / "measurements" / "ride_spectra" / "MEASUREMENT.toml").read_text(encoding="utf-8")
    stated = r"# true: (\d+) and (\d+) N/rad; ([\d.]+) and ([\d.]+) m"
    tyres = [float(number) for number in re.search(stated, text).groups()]
    stiffness = float(re.search(r"equations: (\d+) N m/rad", text)[1])
    assert [true for true, *_ in names["TRUE"].values()] == [*tyres, stiffness]
