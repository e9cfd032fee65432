"""The page on stability charts: its examples run, and every column and option stands on it."""

import re

import pandas as pd
import pytest
from pages import missing_options, run_page, section

PAGE = section("charts_and_design", "Stability charts")


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        run_page(PAGE)
    pictures = list(folder.glob("*/stability_chart.png"))
    assert all(picture.stat().st_size > 10_000 for picture in pictures)
    return {picture.parent.name: pd.read_csv(picture.with_suffix(".csv")) for picture in pictures}


def test_the_examples_run_and_their_points_lie_on_the_axis(tables):
    assert set(tables["chart"]["mode"]) == {"weave", "wobble", "capsize"}
    for table in tables.values():
        assert (table.residual_real_1_s.abs() < 1e-9 * table.largest_root_1_s).all()


def test_every_column_and_option_stands_on_the_page(tables):
    columns = tables["chart"].columns[2:].tolist()
    plain = [re.sub(r"^(sd|towards_instability)_(?!normal).*", r"\1_NAME", name) for name in columns]
    assert [name for name in plain if f"`{name}`" not in PAGE] == []
    assert tables["chart"].columns[:2].tolist() == ["speed_m_s", "front_compliance_stiffness_N_m_rad"]
    assert missing_options("chart", PAGE) == []
