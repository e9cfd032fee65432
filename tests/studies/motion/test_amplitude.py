"""``velotyre amplitude`` and ``vt.limit_cycles`` on files as a user writes them."""

import json
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies import velotyre as vt
from studies.cli import main
from studies.door import content_of
from studies.motion import film_cycle
from tests.shared.refusals import refuses

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


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("wobbly")
    (place / "wobbly.toml").write_text(WOBBLY)
    return place


@pytest.fixture
def wobbly(folder, monkeypatch):
    monkeypatch.chdir(folder)


@pytest.fixture(scope="module")
def shown(folder):
    """Text of one run that writes a table, a record and a picture beside the file."""
    words = "wobbly.toml --speeds 10,34.5,37.5,40 --csv a.csv --json a.json --plot a.png --impulse steer_torque"
    with pytest.MonkeyPatch.context() as patched, redirect_stdout(StringIO()) as said:
        patched.chdir(folder)
        main(["amplitude", *words.split()])
    return said.getvalue()


@pytest.fixture(scope="module")
def told(folder, shown):
    return json.loads((folder / "a.json").read_text())


@pytest.fixture(scope="module")
def found(folder):
    return vt.limit_cycles(folder / "wobbly.toml")


def test_table_record_and_picture(folder, shown, told):
    for line in (
        "wobble at 2.85 m/s: supercritical", "weave at 38.94 m/s: subcritical",
        "weave at 5.41 m/s: not determined (below 1 Hz",
        "weave: fold at 34.10 m/s, steer amplitude 12.1°", "1 of 6 limit cycles exceed linear geometry",
        "proportional to the peak factor D, here 0.8",
    ):  # fmt: skip
        assert line in shown
    frame = pd.read_csv(folder / "a.csv")
    assert frame["stable"].tolist() == ["yes", "no", "falls slowly", "no", "falls slowly", "falls slowly"]
    assert frame["steer_amplitude_deg"][0] == pytest.approx(10.288, rel=1e-4)
    words = "speed_m_s mode stable steer_amplitude_deg frequency_Hz acceleration_m_s2"
    assert list(frame) == words.split()
    assert [one["within_geometry"] for one in told["cycles"]] == [True, True, True, True, True, False]
    assert [one["bifurcation"] for one in told["critical"]] == [
        "supercritical",
        "not determined",
        "supercritical",
        "subcritical",
    ]
    assert told["branches"][1]["folds"][0]["speed_m_s"] == pytest.approx(34.10, abs=0.005)
    assert [(kick["unit"], kick["follows"]) for kick in told["kicks"]] == [("N m s", "stable limit cycle")] * 2
    assert (folder / "a.png").stat().st_size > 20_000


def test_critical_speeds_say_how_the_motion_begins(wobbly, capsys):
    main(["critical", "wobbly.toml", "--csv", "begins.csv"])
    begins = ["supercritical", "not determined", None, "supercritical", "subcritical"]
    assert [one.bifurcation for one in vt.critical_speeds("wobbly.toml")] == begins
    assert [None if one != one else one for one in pd.read_csv("begins.csv")["bifurcation"]] == begins
    shown = [line.split("  ")[-1].strip() for line in capsys.readouterr().out.splitlines()]
    assert shown == ["bifurcation", "-" * 14, *(one or "-" for one in begins)]


def test_both_sides_of_a_damper(wobbly, capsys):
    main(["amplitude", "wobbly.toml", "--speeds", "10", "--damper", "1.5", "--json", "b.json"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "added steering damping of 1.5 N m s/rad removes wobble up to 60 m/s side effect: weave" in shown
    assert "weave unstable from 35.2 m/s (was 38.9 m/s), subcritical; no stable limit cycle within linear" in shown
    without, damped = json.loads(Path("b.json").read_text())["damper"]
    begins = without["weave_unstable_from_m_s"], damped["weave_unstable_from_m_s"]
    assert begins == pytest.approx((38.9, 35.2), abs=0.05)
    assert without["largest_wobble_deg"] > 10
    assert damped["largest_wobble_deg"] is None
    assert (damped["weave_bifurcation"], damped["weave_caught_deg"]) == ("subcritical", None)


def test_a_weak_damper_and_one_that_nothing_needs(wobbly, capsys):
    main(["amplitude", "wobbly.toml", "--speeds", "10", "--damper", "0.3"])
    words = "0.3 N m s/rad does not remove wobble up to 60 m/s; maximum steer amplitude"
    assert words in capsys.readouterr().out
    main("amplitude benchmark --tyre Tyre1 --pressure 5.5 --speeds 10 --max-speed 30 --damper 1".split())  # noqa: SIM905
    words = ": no wobble to remove up to 30 m/s\nside effect: weave stable up to 30 m/s (as without it)"
    assert words in capsys.readouterr().out


def test_the_least_damper_that_ends_the_wobble(wobbly, shown, told):
    least = told["damper"][1]["added_N_m_s_rad"]
    assert f"added steering damping of {least:g} N m s/rad removes wobble" in shown
    for damping, ends in ((least, True), (least - 0.01, False)):
        content = content_of("wobbly.toml")
        content["effects"] = content["effects"] | {"steer_damper": {"damping": damping}}
        assert ends == all(one.mode != "wobble" for one in vt.critical_speeds(content))
    main(["amplitude", "wobbly.toml", "--speeds", "10", "--max-speed", "4", "--json", "slow.json"])
    assert json.loads(Path("slow.json").read_text())["damper"][0]["weave_unstable_from_m_s"] is None


def test_the_largest_wobble_is_that_of_the_table(found, shown, told):
    frame = found.frame(np.arange(2.86, 31.67, 0.4))
    most = frame[frame["mode"] == "wobble"]["steer_amplitude_deg"]
    without = told["damper"][0]
    assert without["largest_wobble_deg"] == pytest.approx(most.max(), rel=1e-3)
    at = without["largest_wobble_at_m_s"]
    assert at == pytest.approx(frame["speed_m_s"][most.idxmax()], abs=0.3)
    assert f"° at {at:.1f} m/s; limit cycle from 2.85 to 31.67 m/s" in shown


def test_amplitudes_as_outputs_of_a_sweep(wobbly):
    names = ["wobble_amplitude", "largest_wobble_amplitude"]
    damped = content_of("wobbly.toml")
    damped["effects"] = damped["effects"] | {"steer_damper": {"damping": 0.0}}
    found = vt.sweep(damped, names, {"steer_damper.damping": [0.0, 1.5]}, speeds=[2.0, 10.0, 31.0, 35.0])
    at = found.wobble_amplitude.values
    assert at[0, 1] == pytest.approx(10.288, rel=1e-4)
    assert 0 < at[0, 2] < 3
    assert (at[0, [0, 3]] == 0).all()
    assert (at[1] == 0).all()
    assert found.largest_wobble_amplitude.values == pytest.approx([10.70, 0.0], abs=0.01)
    assert found.wobble_amplitude.units == "deg"


def test_a_wobble_that_is_too_large_to_tell_has_no_amplitude(wobbly):
    names = ["wobble_amplitude", "largest_wobble_amplitude"]
    model = {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5}}}
    found = vt.sweep(model, names, speeds=[10.0, 40.0])  # wobble jumps at 36 m/s and nothing catches it
    assert found.wobble_amplitude.values[0] == 0
    assert np.isnan([found.wobble_amplitude.values[1], found.largest_wobble_amplitude.values]).all()
    refuses("nonlinear tyres need the effect", vt.sweep, "benchmark", names, speeds=10.0)


def test_wheels_that_roll_without_slip_have_no_such_column(printed):
    assert "bifurcation" not in printed("critical", "benchmark")
    assert [one.bifurcation for one in vt.critical_speeds("benchmark")] == [None, None]


def test_options_of_the_curve(wobbly, capsys):
    tables = []
    for option in ("--peak-factor 0.4", "--peak-factor 0.8", "--curvature-factor -3", "--point 0.1,-0.3"):
        main(f"amplitude wobbly.toml --speeds 10 --csv - {option}".split())
        tables.append([line.split(",") for line in capsys.readouterr().out.splitlines()[1:]])
    half, whole, other, low = (np.array(rows[0][3:6], float) for rows in tables)
    assert half == pytest.approx(whole * [0.5, 1, 0.5], rel=1e-8)
    assert np.abs(other / whole - 1).max() > 1e-3
    assert low[:2] == pytest.approx(whole[:2], rel=1e-9)
    assert low[2] < whole[2]


def test_the_band_of_dry_roads_is_that_of_runs_with_these_peak_factors(wobbly, shown, capsys):
    angles = []
    for peak in ("0.6", "0.8", "1.0"):
        main(f"amplitude wobbly.toml --speeds 10 --csv - --peak-factor {peak}".split())
        angles.append(float(capsys.readouterr().out.splitlines()[1].split(",")[3]))
    main("amplitude wobbly.toml --speeds 10 --peak-factor 0.5".split())  # noqa: SIM905
    low, usual, high = angles
    band = f"on dry roads (D assumed), wobble at 10 m/s: {low:.1f}° at D = 0.6, {usual:.1f}° at D = 0.8, "
    for text in (shown, capsys.readouterr().out):
        assert band + f"{high:.1f}° at D = 1\n" in text


def test_the_page_says_how_far_off_shooting_it_is():
    root = Path(__file__).parents[3]
    counted = json.loads((root / "data" / "validation" / "limit_cycles.json").read_text())
    page = (root / "docs" / "amplitude.md").read_text(encoding="utf-8")
    amplitude, period = (counted["motions"]["all"][f"{name}_error"]["largest"] for name in ("amplitude", "period"))
    assert f"{counted['models']} random models" in page
    assert f"amplitudes are off by up to {amplitude:.0e} and periods by up to {period:.0e}" in page
    assert amplitude < 1e-5
    assert period < 1e-6
    assert (counted["points_not_resolved"], counted["shooting_lost"]) == (0, [])
    assert counted["signs_right"] == counted["signs"] == 100


def test_the_page_says_which_kicks_start_weave_and_which_a_fall(told):
    kicks = told["kicks"]
    page = (Path(__file__).parents[3] / "docs" / "amplitude.md").read_text(encoding="utf-8")
    slow, fast = (one["least"] for one in kicks)
    assert f"takes {fast:.1f} to {slow:.1f} N m s between 37.5 and 34.5 m/s" in page
    more = [one["falls_from"] / one["least"] for one in kicks]
    assert f"{more[0]:.1f} to {more[1]:.1f} times as much a fall" in page


def test_a_film_goes_once_round_the_cycle(found, monkeypatch):
    filmed = {}
    monkeypatch.setattr(
        "studies.motion.amplitude.animate", lambda model, motion, target, title: filmed.update(locals())
    )
    film_cycle(found, [10.0, 38.0], Path("wobble.gif"))
    motion = filmed["motion"]
    assert "Weave of pista_charlie_drops at 38 m/s: 19.6° steer amplitude, 2.07 Hz" in filmed["title"]
    steer, time = np.degrees(motion.outputs["steer"]), motion.time
    assert np.abs(steer).max() == pytest.approx(19.60, abs=0.1)
    assert time[1] * len(time) == pytest.approx(1 / 2.073, rel=1e-3)
    assert steer[: len(time) // 2] == pytest.approx(-steer[len(time) // 2 :], abs=1e-9)  # mirrored after half of it
    slope = np.gradient(motion.outputs["rear_lateral_displacement"], time)
    sideways = motion.outputs["rear_lateral_velocity"] + 38.0 * motion.outputs["yaw"]
    assert slope[1:-1] == pytest.approx(sideways[1:-1], abs=0.02 * np.abs(sideways).max())


def test_from_python(wobbly):
    slower = vt.limit_cycles("wobbly.toml", max_speed=20.0)
    assert slower.frame([10.0])["frequency_Hz"][0] == pytest.approx(7.1157, rel=1e-4)
    assert slower.frame([35.0]).empty


@pytest.mark.parametrize(("words", "message"), [
    ("wobbly.toml --point 1", "--point 1: give X,Z in m"),
    ("wobbly.toml --peak-factor 5", "peak_factor = 5 is outside 0 .. 3"),
    ("wobbly.toml --film a.avi", "a.avi: the ending '.avi' is not known; a film is a .gif"),
    ("wobbly.toml --speeds 33 --film a.gif", "--film: no stable limit cycle at these --speeds; give others"),
    ("wobbly.toml --damper 0", "0: give a number above 0 up to 100"),
    ("wobbly.toml --plot a.txt", "--plot a.txt: the ending must be one of"),
    ("benchmark", "nonlinear tyres need the effect side_slip or relaxation_length"),
])  # fmt: skip
def test_what_is_refused(wobbly, words, message, refused):
    assert message in refused("amplitude", *words.split())


def test_a_model_that_rolls_without_slip():
    refuses("no_slip", vt.limit_cycles, "benchmark")
