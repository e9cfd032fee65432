"""Logs as phones, serial loggers and spreadsheets write them: what `look` makes of them, and the decay in them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bicycle.identification import identify, read_events
from studies.look import drafts, look
from tyre.formats import ChannelMap

ROOT = complex(-0.775, 4.465)  # 1/s, from 3 s on
TIME = np.arange(400) / 50  # s
RNG = np.random.default_rng(11)
WAVE = np.where(TIME < 3, 0, 0.5 * np.exp(ROOT * (TIME - 3)).real)
ROLL, PITCH, YAW = (x + RNG.normal(0, 0.004, 400) for x in (WAVE, 0 * WAVE, 0.6 * np.roll(WAVE, 3)))


def lines(time=None, mark=",", decimal="."):
    """A line a sample: the time as it is given, roll, pitch and yaw rate."""
    time = time or [f"{t:.6f}" for t in TIME]
    rows = zip(time, ROLL, PITCH, YAW, strict=True)
    return [mark.join([t, *(f"{x:.6f}".replace(".", decimal) for x in row)]) for t, *row in rows]


NAMES = "time (s),roll rate (rad/s),pitch rate (rad/s),yaw rate (rad/s)"
BLANKS = "time[s] roll_rate[rad/s] pitch_rate[rad/s] yaw_rate[rad/s]"
ROS = "%time,field.header.stamp" + "".join(f",field.angular_velocity.{axis}" for axis in "xyz")
PHONE = "Gyroscope x (rad/s),Gyroscope y (rad/s),Gyroscope z (rad/s)"


def torn(at, text):
    """Lines of which one is damaged."""
    found = lines()
    found[at] = text
    return found


LOGS = {
    "garbled": ([NAMES, *torn(220, "4.40000087319E-01,-1.34")], 399),
    "short line": ([NAMES, *torn(220, "4.400000,0.154251,0.020511")], 399),
    "header again": ([NAMES, *lines()[:299], NAMES, *lines()[299:]], 400),
    "clock time": ([NAMES.replace(" (s)", ""), *lines([f"23:59:{55 + int(t):02d}:{1e3 * (t % 1):03.0f}" if t < 5 else
                    f"00:00:{int(t) - 5:02d}:{1e3 * (t % 1):03.0f}" for t in TIME.round(3)])], 400),
    "millis": ([NAMES.replace("time (s)", "millis"), *lines([f"{1e3 * t:.0f}" for t in TIME])], 400),
    "epoch": ([NAMES.replace("time (s)", "time"), *lines([f"{17 * 10**17 + 2 * 10**7 * k}" for k in range(400)])], 400),
    "seconds beside an epoch": ([NAMES.replace("time (s)", "time,seconds_elapsed"), *lines(
        [f"{17 * 10**17 + 2 * 10**7 * k},{0.02 * k:.3f}" for k in range(400)])], 400),
    "phone": ([f"Time (s),{PHONE}", *lines([f"{t:.6f}" for t in TIME + RNG.uniform(0, 0.002, 400)])], 400),
    "phone in German": ([f"Time since start in ms ,{PHONE}".upper().replace(",", ";"),
                         *lines([f"{1e3 * t:.0f}" for t in TIME], ";", ",")], 400),
    "quoted commas": ([NAMES, *('"' + line + '"' for line in lines([f"{t:.6f}".replace(".", ",") for t in TIME],
                                                                    '","', ","))], 400),
    "ticks": (["// Sample rate: 50 Hz", NAMES.replace("time (s)", "TimeTicks"),
               *lines([f"{10**6 + 2500 * k}" for k in range(400)])], 400),
    "ticks without whole numbers": (["# sample interval (ms): 20", NAMES.replace("time (s)", "Timer"),
                                     *lines([f"{2500.5 * k:.1f}" for k in range(400)])], 400),
    "no time but a rate": (["Abtastrate;50 Hz", NAMES.partition(",")[2].replace(",", ";"),
                            *(line.partition(";")[2] for line in lines(None, ";"))], 400),
    "days of a spreadsheet": ([NAMES.replace(" (s)", ""), *lines([f"{45413.5 + t / 86400:.10f}" for t in TIME])], 400),
    "time of arrival": ([ROS, *lines([f"{stamp + 2 * jitter},{stamp}" for stamp, jitter in zip(
        17 * 10**17 + 2 * 10**7 * np.arange(400), RNG.integers(0, 10**6, 400), strict=True)])], 400),
    "a title of as many words": (["# made by bench seven", BLANKS, *lines(None, " ")], 400),
    "a remark below the names": ([BLANKS, "# sensor in deg/s m", *lines(None, " ")], 400),
    "a remark of other words below the names": ([NAMES, "# a, b", *lines()], 400),
    "another sign halfway": ([NAMES.replace(",", ";"), *lines([f"{t:.6f}".replace(".", ",") for t in TIME], ";",
                                                              ",")[:180], *lines(None, ";")[180:]], 400),
}  # fmt: skip


@pytest.mark.parametrize("name", LOGS)
def test_the_decay_is_found_by_the_draft(tmp_path, name):
    text, samples = LOGS[name]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*text, ""]), encoding="utf-8")
    found = look(path)
    assert {s.values.size for s in found.opened.signals.signals.values()} == {samples}
    assert (samples < 400 or name == "header again") == any(
        "treated as missing" in n for n in found.opened.signals.notes
    )
    made = {draft.name.partition(".")[2]: draft for draft in drafts(found, tmp_path)}
    assert ("the axes of a phone are its own" in made["channels.toml"].text) == name.startswith("phone")
    (tmp_path / "map.toml").write_text(made["decays.toml"].text, encoding="utf-8")
    channel_map = replace(ChannelMap.from_file(tmp_path / "map.toml"), windows=())
    (run,) = read_events(path, 5.0, channel_map=channel_map)
    assert run.step == pytest.approx(0.02, rel=1e-3)
    decay = identify(run, first_s=3.2, last_s=6.0, thorough=False)
    assert abs(decay.eigenvalue - ROOT) < 0.05


def test_a_header_of_bare_numbers_names_the_columns(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["1;2;3;4", *lines(None, ";"), ""]))
    found = look(path)
    assert list(found.opened.signals.signals) == ["1", "2", "3", "4"]
    (draft,) = drafts(found, tmp_path)  # nothing is recognised: all columns are listed
    assert draft.name == "log.channels.toml"
    assert draft.text.count("# NAME = {column = ") == 4


def test_candidates_are_listed_by_what_they_measure(tmp_path):
    path = Path(tmp_path / "log.csv")
    path.write_text("\n".join(["A [rad/s];B [mV];Clk [s]", *(f"{k % 5};{k % 3};{k / 50}" for k in range(100)), ""]))
    (draft,) = drafts(look(path), tmp_path)
    assert 'time = {column = "Clk"}' in draft.text
    assert '# roll_rate or steer_rate or yaw_rate = {column = "A"}' in draft.text
    assert '# NAME = {column = "B [mV]", unit = "?"}' in draft.text


@pytest.mark.parametrize(("rate", "line"), [
    ("50", 'time = {column = "micros", unit = "us"}'),  # the name states the unit
    ("40", 'time = {column = "micros", unit = "us"}'),
])  # fmt: skip
def test_a_unit_that_is_stated_goes_before_the_rate_of_the_header_which_is_told(tmp_path, rate, line):
    path = tmp_path / "log.csv"
    text = [
        f"# sampling rate: {rate} Hz",
        NAMES.replace("time (s)", "micros"),
        *lines([f"{2e4 * k:.0f}" for k in range(400)]),
    ]
    path.write_text("\n".join([*text, ""]))
    found = look(path)
    assert any(line in draft.text for draft in drafts(found, tmp_path))
    assert any("the header states 40 Hz, the times make it 50 Hz" in note for note in found.opened.clock_notes) == (
        rate == "40"
    )


def test_two_rates_of_a_header_leave_the_unit_of_ticks_open(tmp_path):
    path = tmp_path / "log.csv"
    head = ["# sample rate: 100 Hz", "# output rate: 25 Hz", NAMES.replace("time (s)", "Ticks of time")]
    path.write_text("\n".join([*head, *lines([f"{2500 * k}" for k in range(400)]), ""]))
    assert any("its unit cannot be guessed" in note for note in look(path).opened.clock_notes)


def test_a_velocity_of_rotation_is_no_speed(tmp_path):
    path = tmp_path / "log.csv"
    head = "time (s),angularVelocityY,wheel rotation speed,Drehgeschwindigkeit"
    path.write_text("\n".join([head, *lines(), ""]))
    assert "speed" not in look(path).roles.guessed
    path.write_text("\n".join([head.replace("wheel rotation speed", "rotor speed [km/h]"), *lines(), ""]))
    assert look(path).roles.guessed["speed"].column.name == "rotor speed"
