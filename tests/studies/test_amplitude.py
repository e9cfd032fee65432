"""``velotyre amplitude`` and ``vt.limit_cycles`` on files as a user writes them."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies import velotyre as vt
from studies.cli import main
from tyre.errors import InputError

WOBBLY = """bicycle = "pista_charlie_drops"
[effects.relaxation_length]
tyre = "Tyre1"
pressure_bar = 5.5
[effects.front_compliance]
stiffness = 4000
damping = 12
joint_x = 0.86
joint_z = -0.65
"""


@pytest.fixture
def wobbly(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wobbly.toml").write_text(WOBBLY)
    return tmp_path


def test_table_record_and_picture(wobbly, capsys):
    words = "wobbly.toml --speeds 10,37,40 --csv a.csv --json a.json --plot a.png --kick steer_torque"
    main(["amplitude", *words.split()])
    shown = capsys.readouterr().out
    for line in (
        "wobble at 2.85 m/s: grows gently", "weave at 38.94 m/s: jumps", "weave at 5.41 m/s: not determined (slower",
        "weave: folds at 34.10 m/s with 12.1° at the bar", "1 of 4 motions leave linear geometry",
        "proportional to D, here 0.8",
    ):  # fmt: skip
        assert line in shown
    frame = pd.read_csv("a.csv")
    assert frame["stable"].tolist() == ["yes", "no", "falls slowly", "falls slowly"]
    assert frame["steer_amplitude_deg"][0] == pytest.approx(10.288, rel=1e-4)
    assert frame["within_geometry"].tolist() == [True, True, True, False]
    told = json.loads((wobbly / "a.json").read_text())
    assert [one["begins"] for one in told["critical"]] == ["grows gently", "not determined", "grows gently", "jumps"]
    assert told["branches"][1]["folds"][0]["speed_m_s"] == pytest.approx(34.10, abs=0.005)
    (kick,) = told["kicks"]
    assert (kick["unit"], kick["follows"]) == ("N m s", "lasting motion")
    assert (wobbly / "a.png").stat().st_size > 20_000


def test_options_of_the_curve(wobbly, capsys):
    tables = []
    for option in ("--friction 0.4", "--friction 0.8", "--curvature-factor -3", "--point 0.1,-0.3"):
        main(f"amplitude wobbly.toml --speeds 10 --csv - {option}".split())
        tables.append([line.split(",") for line in capsys.readouterr().out.splitlines()[1:]])
    half, whole, other, low = (np.array(rows[0][3:6], float) for rows in tables)
    assert half == pytest.approx(whole * [0.5, 1, 0.5], rel=1e-8)
    assert np.abs(other / whole - 1).max() > 1e-3
    assert low[:2] == pytest.approx(whole[:2], rel=1e-9)
    assert low[2] < whole[2]


@pytest.mark.parametrize("friction", ["0.8", "0.5"])
def test_the_band_of_dry_roads_is_that_of_runs_with_these_peak_factors(wobbly, capsys, friction):
    angles = []
    for peak in ("0.6", "0.8", "1.0"):
        main(f"amplitude wobbly.toml --speeds 10 --csv - --friction {peak}".split())
        angles.append(float(capsys.readouterr().out.splitlines()[1].split(",")[3]))
    main(f"amplitude wobbly.toml --speeds 10 --friction {friction}".split())
    low, usual, high = angles
    band = f"wobble at 10 m/s, over dry roads (assumed range of D): {low:.1f}° at D = 0.6, {usual:.1f}° at D = 0.8, "
    assert band + f"{high:.1f}° at D = 1\n" in capsys.readouterr().out


def test_the_page_says_how_far_off_shooting_it_is():
    root = Path(__file__).parents[2]
    counted = json.loads((root / "data" / "validation" / "limit_cycles.json").read_text())
    page = (root / "docs" / "amplitude.md").read_text(encoding="utf-8")
    wobble, weave = (counted["motions"][mode]["amplitude_error"]["largest"] for mode in ("wobble", "weave"))
    assert f"{counted['models']} random models" in page
    assert f"wobble is off by up to {wobble:.0e}" in page
    assert f"by up to {weave:.2%}".replace("%", " %") in page
    off = [one for one in counted["worst"] if one["amplitude"] > 1e-5]
    assert len(off) == counted["motions"]["all"]["amplitude_above_1e-5"]
    assert max(one["frequency_Hz"] for one in off) < 2.2
    assert counted["signs_right"] == counted["signs"] == 100


def test_from_python(wobbly):
    found = vt.limit_cycles("wobbly.toml", max_speed=20.0)
    assert found.frame([10.0])["frequency_Hz"][0] == pytest.approx(7.1157, rel=1e-4)
    assert found.frame([35.0]).empty


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("wobbly.toml --point 1", "--point 1: give X,Z in m"),
        ("wobbly.toml --friction 5", "friction = 5 is outside 0 .. 3"),
        ("wobbly.toml --plot a.txt", "--plot a.txt: the ending must be one of"),
        ("benchmark", "nonlinear tyres need the effect side_slip or relaxation_length"),
    ],
)
def test_what_is_refused(wobbly, words, message, capsys):
    with pytest.raises(SystemExit) as stop:
        main(["amplitude", *words.split()])
    assert stop.value.code == 2
    assert message in capsys.readouterr().err


def test_a_model_that_rolls_without_slip():
    with pytest.raises(InputError, match="no_slip"):
        vt.limit_cycles("benchmark")
