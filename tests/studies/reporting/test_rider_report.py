"""``velotyre rider``: file, picture and words; the packaged bicycles with rider are what it makes."""

import re
import tomllib
from pathlib import Path

import pytest

from bicycle import load_bicycle
from studies.cli import main

pytest.importorskip("yeadon")
DATA = Path(__file__).parents[3] / "data"
LOADS = (340, 490)  # N, of the tyre tests


def run(*words):
    main(["rider", *(str(word) for word in words)])


@pytest.mark.parametrize("posture", ["upright", "hoods", "drops"])
def test_the_packaged_bicycle_is_made_again(no_pictures, tmp_path, capsys, posture):
    name = f"pista_charlie_{posture}"
    run("pista", "--rider", "charlie", "--posture", posture, "--out", tmp_path / f"{name}.toml")
    made, packaged = load_bicycle(tmp_path / f"{name}.toml"), load_bicycle(name)
    assert made.values == pytest.approx(dict(packaged.values), rel=1e-6)
    assert made.sd == pytest.approx(dict(packaged.sd), rel=0.01)
    assert packaged.description.startswith("DERIVED: pista with rider charlie")
    assert "BSD-2-Clause" in packaged.source
    assert packaged.warnings == ()
    shown = capsys.readouterr().out
    for load, wheel in zip(packaged.static_loads, ("rear", "front"), strict=True):
        assert f"{wheel} wheel {load:.0f} +- " in shown


def test_the_file_says_where_it_comes_from(tmp_path, capsys):
    out = tmp_path / "me.toml"
    run("browser", "--height", 1.75, "--mass", 70, "--posture", "upright", "--back-rounding", 10, "--out", out)
    text, shown = out.read_text(), capsys.readouterr().out
    assert "made by: velotyre rider browser --height 1.75 --mass 70 --posture upright --back-rounding 10" in text
    content = tomllib.loads(text)
    for words in ("scaled from the measured rider jason", "yeadon", "torso lean 15 deg, back rounding 10 deg"):
        assert words in content["source"]
    assert "; assumed: " not in content["source"]  # seat and bar of the browser are measured
    assert "joint angles, deg" in text
    assert "IBxz: sd mainly from" in text
    assert "note: rider scaled_1.75m_70kg is scaled from another person's measurements" in shown
    assert set(content["sd"]) >= {"xB", "zB", "mB", "IBxx", "IBzz", "IBxz"}
    for ending in (".png", ".svg"):
        assert out.with_suffix(ending).stat().st_size > 10_000
    assert {p.name for p in tmp_path.iterdir()} == {"me.toml", "me.png", "me.svg"}


def test_a_bicycle_file_with_an_own_geometry(no_pictures, tmp_path, capsys):
    frame, seat = tmp_path / "mine.toml", tmp_path / "seat.toml"
    frame.write_text((DATA / "bicycles" / "fisher.toml").read_text())
    seat.write_text("[values]\nsaddle_distance_m = 0.70\nreach_m = 0.6\ndrop_m = -0.05\n")
    run(frame, "--rider", "jason", "--mass", 80, "--posture", "hoods", "--torso-lean", 30, "--geometry", seat,
        "--out", tmp_path / "o.toml")  # fmt: skip
    assert load_bicycle(tmp_path / "o.toml")["mB"] == pytest.approx(load_bicycle("fisher")["mB"] + 80)
    shown = capsys.readouterr().out
    assumed = re.search("note: assumed, not measured on this bicycle: (.*)", shown).group(1)
    assert assumed == "chain stay, bottom bracket height, seat tube angle, hand width"
    assert "torso 30 deg forward" in shown


def test_what_is_refused(tmp_path, refused):
    out = tmp_path / "x.toml"
    ask = ("rider", "pista", "--posture", "drops", "--out", out)
    assert "give --rider (packaged: charlie, jason; or a file), or --height and --mass" in refused(*ask)
    assert "give --rider" in refused(*ask, "--height", 1.8)
    assert "not both" in refused(*ask, "--height", 1.8, "--rider", "jason")
    ask = ("rider", "pista", "--rider", "jason", "--posture", "drops", "--out")
    assert "the ending '.txt' is not known; write a .toml file" in refused(*ask, tmp_path / "x.txt")
    assert "there is no folder" in refused(*ask, tmp_path / "no" / "x.toml")
    out.write_text("mine")
    assert "x.toml exists; give --force to overwrite it" in refused(*ask, out)
    assert out.read_text() == "mine"
    ask = ("rider", "browser", "--rider", "jason", "--posture", "upright", "--torso-lean", 5, "--out")
    assert "arms are too short by 23 mm" in refused(*ask, tmp_path / "y.toml")
    assert not (tmp_path / "y.toml").exists()
