"""The page on the front frame: its code runs, its numbers are those of the packaged map and protocols."""

import json
from pathlib import Path

import pytest
from pages import page, run_page

from studies.front_frame import front_frame
from tyre.ground import data_root, read_toml

PAGE = page("front_frame")
ROOT = Path(__file__).parents[2]


def test_the_page_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    commands, shown = run_page(PAGE)
    assert commands.count("95 % interval") == 3 + 1  # of each command, and in the tables that one prints
    hinge = front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45)
    assert shown.strip() == f"{hinge.stiffness:.0f} N m/rad, {hinge.height:.2f} m above the hub"


def test_the_output_of_the_page_is_what_is_printed(printed):
    said = printed("front-frame", "--head-tube", "95", "--fork", "45")
    shown = PAGE.partition("## Output")[2].partition("## ")[0]
    lines = [line.strip() for line in shown.splitlines() if line.startswith("    ")]
    assert len(lines) == 5
    assert all(line in said for line in lines)


def test_every_protocol_of_the_data_is_on_the_page():
    protocols = read_toml(data_root().joinpath("front_frame", "protocols.toml"), "protocols")["protocol"]
    rows = [line for line in PAGE.splitlines() if line.startswith("| ") and "](http" in line]
    assert len(rows) == len(protocols) == 6
    for row, protocol in zip(rows, protocols, strict=True):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        assert cells[:2] == [protocol["publisher"], protocol["figure"]]
        assert protocol["source"] in row
        assert cells[4].replace("`", "") == (protocol["takes"] or "none")


def test_the_counts_of_the_page_are_those_of_the_validation():
    summary = json.loads((ROOT / "data" / "validation" / "published_front_figures.json").read_text(encoding="utf-8"))
    fresh = [summary["fresh"][method] for method in ("pair", "ground", "head_tube")]
    held, widths = [one["stiffness_held"] for one in fresh], [100 * one["half_width"] for one in fresh]
    text = " ".join(PAGE.split())
    assert f"{held[0]} (both figures), {held[1]} (ground) and {held[2]} (head tube alone)" in text
    assert f"at most {widths[0]:.0f}, {widths[1]:.0f} and {widths[2]:.0f} %" in text
    low, _, high = summary["sway"]
    assert f"is {low:.2f} to {high:.2f}" in text
    assert summary["map"]["frames"] == 45
    low, middle, high = (100 * (ratio - 1) for ratio in summary["fork_clamped_over_in_bearings"])
    assert f"{low:.0f} to {high:.0f} % stiffer, {middle:.0f} % in the median" in text
    softer = front_frame(head_tube_N_m_per_deg=95, fork_N_per_mm=45 / (1 + middle / 100))
    assert f"{softer.stiffness:.0f} N m/rad in place of 3190" in text
    assert pytest.approx(summary["map"]["figure_sd"]) == 0.03
