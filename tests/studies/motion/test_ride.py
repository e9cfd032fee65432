"""A rider who steers: margins of a loop written by hand, the packaged riders, own control files, and every refusal.

Matrices of the Davis bicycle and its rider: moorepants/RiderID, functions/davisbike.m, CC BY 3.0.
"""

import control
import numpy as np
import pytest
from read_report import read_report

from bicycle import Model, effect_class, load_bicycle
from studies.cli import main
from studies.motion import available_controls, margins, read_rider_control, rides
from tests.shared.refusals import refuses
from tyre.ground import InputError

M = np.array([[133.31668525, 2.43885691], [2.43885691, 0.22419262]])
C1 = np.array([[0, 44.65783277], [-0.31500940, 1.46189246]])
K0 = np.array([[-116.73261635, -2.48042260], [-2.48042260, -0.77434358]])
K2 = np.array([[0, 104.85805076], [0, 2.29688720]])
OMEGA = 2 * np.pi * 2.17
SCHWAB = read_rider_control("schwab2013")
DAVIS = Model(load_bicycle("rigid_rider_joined"))
OWN = """description = "made up"
filter_frequency = 20.0
columns = ["speed", "roll", "roll_rate", "steer_integral"]
units = ["m/s", "N m/deg", "N m s/deg", "N m/rad s"]
rows = [[4.0, 0.7, 0.5, 170.0], [5.0, 0.8, 0.6, 190.0]]
"""


def loop_by_hand(k, factor=1.0, behind=None):
    """From applied steer torque to the rider's torque of run ``k``, as a transfer function."""
    speed, inverse = SCHWAB.speeds[k], np.linalg.inv(M)
    state = np.zeros((5, 5))
    state[:2, 2:4], state[4, 1] = np.eye(2), 1
    state[2:4, :2], state[2:4, 2:4] = -inverse @ (9.81 * K0 + speed**2 * K2), -inverse @ C1 * speed
    names = ("roll", None, "roll_rate", "steer_rate", "steer_integral")
    row = factor * np.array([[SCHWAB.gains[name][k] if name else 0.0 for name in names]])
    rider = control.ss(control.tf([OMEGA**2], [1, np.sqrt(2) * OMEGA, OMEGA**2]))
    loop = control.series(control.ss(state, np.r_[0, 0, inverse[:, 1], 0][:, None], row, 0), rider)
    return loop if behind is None else control.series(loop, control.ss(behind))


def growth_by_hand(*given, **more):
    return control.feedback(loop_by_hand(*given, **more), control.ss([], [], [], [[1]]), sign=1).poles().real.max()


def late(delay):
    """A delay as a Pade approximant of order 8, far better than needed here."""
    return control.tf(*control.pade(delay, 8))


@pytest.mark.parametrize("k", [0, 7, 14])
def test_margins_are_where_the_loop_written_by_hand_loses_its_stability(k):
    gains = {name: values[k] for name, values in SCHWAB.gains.items()}
    found = margins(SCHWAB, DAVIS, gains, SCHWAB.speeds[k])
    assert growth_by_hand(k) < 0
    assert np.isnan(found["gain_down"]) == (k == 14)  # at 7.36 m/s half of his gains hold, too
    assert k < 14 or growth_by_hand(k, 0.5) < 0
    for factor in [found[name] for name in ("gain_up", "gain_down") if np.isfinite(found[name])]:
        away = 1.01 if factor > 1 else 0.99
        assert growth_by_hand(k, factor / away) < 0 < growth_by_hand(k, factor * away)
    assert growth_by_hand(k, behind=late(0.98 * found["delay_s"])) < 0
    assert growth_by_hand(k, behind=late(1.02 * found["delay_s"])) > 0
    unit = loop_by_hand(k)(1j * np.geomspace(0.05, 100, 20001))
    turns = np.degrees(np.angle(unit[np.flatnonzero(np.diff(np.abs(unit) > 1))]))  # +L = 1 is the limit: no turn left
    assert found["phase_deg"] == pytest.approx(np.abs(turns).min(), abs=0.1)


def test_a_delay_of_the_rider_takes_its_time_from_the_margin():
    k = 4
    gains = {name: values[k] for name, values in SCHWAB.gains.items()}
    later = type(SCHWAB)(SCHWAB.name, {**SCHWAB.about, "delay": 0.01}, SCHWAB.runs, SCHWAB.speeds, SCHWAB.gains)
    prompt, slow = (margins(rider, DAVIS, gains, 3.18)["delay_s"] for rider in (SCHWAB, later))
    assert slow == pytest.approx(prompt - 0.01, abs=1e-5)
    root, _ = rides(later, {"": DAVIS}, np.array([3.18]))[0].root(gains, 3.18)
    assert root.real == pytest.approx(growth_by_hand(k, behind=late(0.01)), abs=1e-3)  # order 2 against order 8


def test_fifteen_riders_hold_without_slip_and_soft_tyres_lose_the_fast_ones():
    """Counts of the project's own first look, by other code: 14 of 15 on 0.25/deg of the load with camber thrust."""
    rear, front = DAVIS.bicycle.static_loads
    loads = {"rear": rear, "front": front}
    per_rad = {wheel: 0.25 * np.degrees(load) for wheel, load in loads.items()}
    tyre = effect_class("side_slip")(cornering_stiffness=per_rad)
    camber = effect_class("camber_thrust")(camber_stiffness=loads)
    models = {"rigid": DAVIS, "tyre": Model(DAVIS.bicycle, (tyre, camber))}
    rigid, tyred = rides(SCHWAB, models, np.linspace(2.15, 7.36, 9))
    runs = [({name: values[k] for name, values in SCHWAB.gains.items()}, SCHWAB.speeds[k]) for k in range(15)]
    assert rigid.held == ((2.15, 7.36),)
    assert [sum(ride.root(*run)[0].real < 0 for run in runs) for ride in (rigid, tyred)] == [15, 14]
    assert np.isnan(rigid.find_softest_tyre(*runs[0]))
    soft = effect_class("side_slip")(cornering_stiffness=7000.0)
    (soft,) = rides(SCHWAB, {"soft": Model(DAVIS.bicycle, soft)}, np.linspace(2.2, 7.3, 8))
    ((low, high),) = soft.held
    assert (low, soft.worst[0]) == (2.2, 7.3)
    assert low < high < 7.3
    assert soft.growth(high) == pytest.approx(0, abs=1e-3)

    needed = [tyred.find_softest_tyre(*runs[k]) for k in (2, 4, 14)]
    assert needed == sorted(needed)
    for k, limit in zip((2, 14), (needed[0], needed[2]), strict=True):
        for away, holds in ((0.97, False), (1.03, True)):
            share = away * limit / per_rad["front"]
            scaled = type(tyre)(cornering_stiffness={w: share * c for w, c in per_rad.items()})
            one = SCHWAB.add_rider(Model(DAVIS.bicycle, (scaled, camber)), runs[k][0]).linear_model()
            assert (one.eigenvalues(runs[k][1]).real.max() < 0) == holds


def test_packaged_riders_hold_their_own_bicycles():
    assert available_controls() == ("davis_j", "hess_benchmark", "schwab2013")
    for name in available_controls():
        rider = read_rider_control(name)
        model = Model(load_bicycle(rider.about["bicycle"]))
        (ride,) = rides(rider, {name: model}, np.linspace(rider.speeds.min(), rider.speeds.max(), 9))
        assert ride.held == ((rider.speeds.min(), rider.speeds.max()),)
        assert len(rider.about["source"]) > 30


def test_gains_between_runs_are_interpolated_and_repeats_are_averaged():
    """Runs 248 to 250 at 2.15, 2.19 and 2.19 m/s, 184 to 186 at 3.19, 3.18 and 3.11: means by hand."""
    slow, fast = (2.15 + 2.19 + 2.19) / 3, (3.19 + 3.18 + 3.11) / 3
    assert SCHWAB.at(slow)["roll"] == pytest.approx((5.17 + 28.97 + 24.25) / 3)
    between = (5.17 + 28.97 + 24.25 + 22.72 + 43.23 + 31.12) / 6
    assert SCHWAB.at((slow + fast) / 2)["roll"] == pytest.approx(between)
    assert read_rider_control("davis_j").at(2.75)["steer"] == pytest.approx(-(22.8772 + 28.0322) / 2)


def test_a_file_of_ones_own_in_its_units(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text(OWN)
    rider = read_rider_control(file)
    assert rider.at(4.5)["roll"] == pytest.approx(0.75 * 180 / np.pi)
    assert rider.at(4.5)["steer_integral"] == pytest.approx(180)
    main(
        [
            "closed-loop",
            "rigid_rider_joined",
            "pista_rider",
            "--rider-control",
            str(file),
            "--out",
            str(tmp_path / "out"),
        ]
    )
    told = capsys.readouterr().out
    assert "Rider mine, assumed, 4 to 5 m/s" in told
    assert len(told.splitlines()) <= 12
    page = read_report(tmp_path / "out")
    assert "made up (assumed). Source: not stated." in page
    assert {"ride.png", "runs.csv", "report.html"} <= {one.name for one in (tmp_path / "out").iterdir()}


def test_the_terminal_tells_what_limits_and_what_is_not_known(tmp_path, refused, printed):
    file = tmp_path / "mine.toml"
    file.write_text('bicycle = "browser"\nassumes = "stiff tyres"\n' + OWN)
    arguments = ["closed-loop", "benchmark", "--rider-control", str(file), "--tyre", "Tyre1", "--extrapolate"]
    told = printed(*arguments, "--pressure", "3.5", "--pressure", "5.5", "--speeds", "4.2,4.8")
    assert len(told.splitlines()) <= 12
    assert "The gains are of browser, not of the bicycle of Tyre1 3.5 bar, Tyre1 5.5 bar." in told
    assert "found with stiff tyres; on another tyre" in told
    assert "Without camber thrust: Tyre1 3.5 bar, Tyre1 5.5 bar." in told
    words = refused("closed-loop", "benchmark", "--rider-control", file, "--speeds", "4.5,8")
    assert "8 m/s is outside its speeds, 4 to 5 m/s" in words


@pytest.mark.parametrize(("old", "new", "words"), [
    ('"roll", "roll_rate"', '"role", "roll_rate"', "unknown column 'role'; did you mean 'roll'"),
    ("N m/deg", "N m/degr", "roll: 'N m/degr' is not a unit"),
    ("N m s/deg", "N m/deg", "roll_rate: 'N m/deg' is no unit of what is given in N m s/rad"),
    ('"N m/rad s"]', "]", "columns must hold speed and each gain once, and units one for each"),
    ("[4.0, 0.7,", "[4.0,", r"rows, number 1 = .* must hold 4 finite numbers"),
    ("[4.0, 0.7,", "[4.0, nan,", r"rows, number 1 = .* must hold 4 finite numbers"),
    ("[4.0, 0.7,", "[-4.0, 0.7,", "speed = -4 m/s must be above 0"),
    ('"roll", "roll_rate", "steer', '"roll", "k_delta", "steer', "k_delta, .* belong together, without other"),
    ('"roll", "roll_rate", "steer', '"steer", "steer_rate", "steer', "give a gain on roll or roll_rate"),
    ("filter_frequency = 20.0", "filter_frequency = 0", "filter_frequency = 0 must be a finite number above 0"),
    ("filter_frequency = 20.0", 'kind = "guessed"', "unknown kind 'guessed'"),
    ('description = "made up"', "", "description"),
])  # fmt: skip
def test_a_file_that_makes_no_rider_is_refused(old, new, words, tmp_path):
    assert old in OWN
    (tmp_path / "mine.toml").write_text(OWN.replace(old, new, 1))
    refuses(words, read_rider_control, tmp_path / "mine.toml")


def test_unknown_riders_and_two_riders_are_refused(tmp_path):
    refuses("unknown rider control 'davis_i'; did you mean 'davis_j'.* or give a file", read_rider_control, "davis_i")
    refuses("no such rider control", read_rider_control, tmp_path / "none.toml")
    riding = Model(DAVIS.bicycle, effect_class("rider_control")(roll=30.0))
    with pytest.raises(InputError, match=r"the model has a rider already, \[effects.rider_control\]; remove it"):
        rides(SCHWAB, {"": riding})[0].growth(3.0)
