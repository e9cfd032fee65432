"""A file of canonical matrices as MODEL: modes and critical speeds, and one line wherever a bicycle is needed."""

import json

import pytest

from studies.cli import main

SYNTHETIC = """% M q'' + v C1 q' + (g K0 + v^2 K2) q = f, q = (lean, steer)
M0 = [84.2452, 2.148196245; 2.148196245, 0.1806343419];
C1 = [0, 34.29309543; -0.414545201, 1.379001166];
K0 = [-79.986, -2.290064277; -2.290064277, -0.6986038858];
K2 = [0, 73.26630268; 0, 2.182843181];
g = 9.81;
"""


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text('bicycle = "mck.m"\n[effects.steer_damper]\n')
    (tmp_path / "mck.m").write_text(SYNTHETIC)


def test_critical_speeds_and_modes_of_matrices(file, capsys):
    main(["critical", "mck.m"])
    shown = capsys.readouterr()
    assert "5.046825" in shown.out
    assert "8.539013" in shown.out
    assert "wheels that roll without slip; no tyre or effect can be put on them" in shown.err
    main(["modes", "mck.m", "--speeds", "6", "--json", "-"])
    found = json.loads(capsys.readouterr().out)
    assert found["static_loads_N"] == {"rear": None, "front": None}
    assert found["modes"]["capsize"][0][0] == pytest.approx([-0.5833, 0.0], abs=5e-5)
    main(["modes", "mck.m", "--speeds", "1:9:1", "--plot", "modes.png"])


@pytest.mark.parametrize(("words", "why"), [
    ("critical mck.m --tyre Tyre1 --pressure 5.5", "--tyre Tyre1: mck.m holds matrices M, C1, K0, K2, on which no"),
    ("modes model.toml", "holds matrices M, C1, K0, K2, on which no tyre or effect can be put; give it by itself to"),
    ("bicycles mck.m", "mck.m holds matrices M, C1, K0, K2, on which no tyre or effect can be put; give it by itself"),
    ("uncertainty mck.m", "mck.m holds matrices M, C1, K0, K2, which only velotyre modes and critical accept"),
    ("root-locus mck.m --parameter w --range 1:1.1 --speed 5 --out out", "which only velotyre modes and critical"),
])  # fmt: skip
def test_what_needs_a_bicycle_refuses_matrices_in_one_line(file, refused, words, why):
    said = refused(*words.split())
    assert why in said
    assert len(said.strip().splitlines()) == 1
