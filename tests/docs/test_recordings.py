"""The page on recordings runs as it stands, from a look to a fit and to a verdict, and tells of every format."""

import json
from pathlib import Path

import pytest
from pages import few_hypotheses, page, run_page

from studies.look import USES
from tyre.formats import FORMATS

PAGE = page("recordings")
TRIED = ("aerodynamic_drag", "pneumatic_trail", "side_slip", "steer_damper", "steer_spring")


@pytest.mark.usefixtures("no_pictures")
def test_the_page_runs_and_says_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    *_, shown = run_page(PAGE, few_hypotheses({"bicycle.toml": TRIED}))
    # 6400 N/rad is what the page wrote into the forces, the damper what it hid in the bicycle
    (condition,) = json.loads(Path("fit.json").read_text(encoding="utf-8"))["conditions"]
    assert condition["cornering_stiffness_N_per_rad"]["value"] == pytest.approx(6400, rel=0.02)
    assert "named. Missing effect: viscous damping of the steering (steer_damper: damping 0.5" in shown


def test_every_ending_and_use_stands_on_the_page():
    assert [ending for ending in FORMATS if f"`{ending}`" not in PAGE] == []
    assert [use for use in USES if f"| {use} |" not in PAGE] == []
