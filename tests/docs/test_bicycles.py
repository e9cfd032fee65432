"""The page on bicycles: its files are read, and its notations are those that are understood."""

import math
import re

import pytest
from pages import page, run_page, without_files, write_files

from bicycle import load_bicycle
from bicycle.files import read_bicycles
from tyre.ground import measured_number

PAGE = page("bicycles")


def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    pytest.importorskip("yeadon")
    monkeypatch.chdir(tmp_path)
    (shown,) = run_page(without_files(PAGE))
    assert "kitchen scale" in shown


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_files(PAGE, tmp_path_factory.mktemp("page"))


def test_the_bicycle_of_the_page(folder):
    found = load_bicycle(folder / "mine.toml")
    assert (found["w"], found["c"], found["lam"]) == (1.121, 0.0686, pytest.approx(math.radians(22.9), rel=1e-15))
    assert dict(found.sd) == pytest.approx({"c": 0.0017, "lam": math.radians(0.2), "IBxx": 0.00265, "w": 0.002})


def test_the_table_of_the_page(folder):
    city, track = read_bicycles(folder / "many.csv")
    assert (city.name, track.name) == ("City", "Track")
    assert (city["c"], city.sd["c"]) == (0.0686, 0.0017)
    assert load_bicycle(f"{folder / 'many.csv'}#Track") == track


def test_the_notations_of_the_page():
    (line,) = (line for line in PAGE.splitlines() if line.endswith("| 0.375, 0.026 |"))
    written = re.findall(r"`([^`]+)`", line)
    assert len(written) == 6
    for text in written:
        number = measured_number(text, where="page", key="c")
        assert (number.value, number.sd) == (0.375, 0.026)
