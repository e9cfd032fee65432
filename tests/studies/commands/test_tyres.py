"""``velotyre tyres``: files without pressure, and curves drawn."""

import json

import pandas as pd
import pytest

from bicycle import load_bicycle
from studies.cli import main
from tests.shared.formula_tyres import PACEJKA89

OLD = (
    "[UNITS]\nLENGTH='meter'\n[MODEL]\nFITTYP=6\nFNOMIN=500\nPKY1=-14\nPKY2=2\nUNLOADED_RADIUS=0.3\nPTY1=0.4\nPTY2=2\n"
)


def test_a_file_without_pressure_is_listed_at_its_loads(tmp_path, printed):
    """14 * 500 sin(2 atan 1/2) = 5600 N/rad; 0.4 sin(2 atan 1/2) 0.3 m."""
    (tmp_path / "old.tir").write_text(OLD)
    head, _, row = printed("tyres", str(tmp_path / "old.tir")).partition("\n\n")[2].splitlines()[:3]
    assert "pressure" not in head
    assert row.split()[:2] == ["500", "97.74"]
    found = json.loads(printed("tyres", str(tmp_path / "old.tir"), "--json", "-"))
    assert (found["loads_N"], found["pressures_bar"]) == ([500.0], [])
    assert found["relaxation_length_mm"] == pytest.approx([96.0])


def test_curves_are_drawn_where_there_are_any(tmp_path, capsys, refused):
    (tmp_path / "curved.tir").write_text(OLD + "PCY1=1.3\nPDY1=1\nQDZ1=0.05\n")
    (tmp_path / "t.toml").write_text(PACEJKA89)
    for tyre in ("curved.tir", "t.toml"):
        main(["tyres", str(tmp_path / tyre), "--plot", str(tmp_path / "a.png")])
        assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"
    (tmp_path / "old.tir").write_text(OLD)
    for words, message in (
        ([str(tmp_path / "old.tir"), "--plot", "a.png"], "it holds no curve of the lateral force (PCY1, PDY1)"),
        (["Tyre1", "--plot", "a.png"], "is a table of stiffnesses and has no curves"),
        (["--plot", "a.png"], "--plot draws one tyre"),
        (["Tyre1", "--plot", "a.doc"], "the ending must be one of"),
    ):
        capsys.readouterr()
        assert message in refused("tyres", *words)


def test_simulate_takes_the_curves_of_the_file_unless_others_are_given(no_pictures, tmp_path, capsys):
    """A peak of 0.05 of the load: the lateral forces of the file stay below it, those of a friction of 0.8 do not."""
    (tmp_path / "icy.tir").write_text(OLD + "PCY1=1.3\nPDY1=0.05\n")
    largest = []
    for words in ([], ["--peak-factor", "0.8"]):
        out = tmp_path / f"out{len(words)}"
        main(["simulate", "benchmark", "--tyre", str(tmp_path / "icy.tir"), "--speed", "5", "--duration", "0.2",
              "--step", "0.01", "--initial", "steer=0.1", "--nonlinear", "--out", str(out), *words])  # fmt: skip
        told = "follow its curves, without its shifts" in capsys.readouterr().err
        assert told == (not words)
        forces = pd.read_csv(out / "response_magic_formula.csv").filter(like="lateral_force").abs().max()
        largest.append(float(forces["rear_lateral_force_N"] if "rear_lateral_force_N" in forces else forces.max()))
    load = load_bicycle("benchmark").static_loads[0]
    assert largest[0] <= 0.05 * load * (1 + 1e-9) < largest[1]
