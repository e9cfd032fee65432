"""Which recordings, samples and channels the table [histories] takes."""

import numpy as np
import pytest

from bicycle.identification import read_runs
from tests.shared.refusals import refuses
from tyre.ground import InputError


@pytest.fixture
def folder(tmp_path):
    time = np.arange(100) * 0.02
    for k, name in enumerate(("kick_1", "kick_2", "other")):
        lines = ["time_s,roll_rate_rad_s,steer_rad,steer_torque_N_m"]
        lines += [f"{t!r},{np.sin(3 * t + k)!r},{0.1 * np.cos(2 * t + k)!r},{k + t!r}" for t in time.tolist()]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines).replace("np.float64(", "").replace(")", "") + "\n")
    return tmp_path


def runs(where, /, *entries, **table):
    return read_runs({"runs": [{"speed_m_s": 5.0, **entry} for entry in entries], **table}, where)


def test_a_pattern_is_all_its_files_in_their_order(folder):
    found, _, _ = runs(folder, {"files": "kick_*.csv", "group": "kicks"})
    assert [run.name for run in found] == ["kick_1.csv", "kick_2.csv"]
    assert {run.group for run in found} == {"kicks"}


def test_a_pattern_may_name_folders_and_stand_by_itself(folder, tmp_path):
    for number in (1, 2):
        (tmp_path / f"ride_{number}").mkdir()
        (tmp_path / f"ride_{number}" / "recording.csv").write_bytes((folder / f"kick_{number}.csv").read_bytes())
    names = ["ride_1/recording.csv", "ride_2/recording.csv"]
    found, _, _ = runs(tmp_path, {"files": "ride_*/recording.csv"})
    assert [run.name for run in found] == names
    found, _, _ = runs(folder, {"files": f"{tmp_path}/ride_*/recording.csv"})
    assert [run.name for run in found] == [f"{tmp_path}/{name}" for name in names]
    with pytest.raises(InputError, match=r"no file in /.* is called so; give a pattern such as \"kick_"):
        runs(folder, {"files": f"{tmp_path}/drive_*/recording.csv"})


@pytest.mark.parametrize("key", ["first_s", "drop_first_s"])
def test_the_window_counts_from_the_first_sample_and_a_run_s_own_goes_first(folder, key):
    found, _, notes = runs(folder, {"file": "kick_1.csv"}, {"file": "kick_2.csv", "first_s": 0.4, "last_s": 1.2},
                           **{key: 0.1, "last_s": 1.0})  # fmt: skip
    assert [(run.time[0], run.time[-1]) for run in found] == [pytest.approx((0.1, 1.0)), pytest.approx((0.4, 1.2))]
    assert not any("no start transient" in note for note in notes)
    for run in found:
        assert len(run.time) == len(run.inputs["steer_torque_N_m"]) == len(run.channels["steer_rad"])


def test_a_start_that_may_hold_a_kick_is_said_where_nobody_looked_at_it_and_no_torque_tells_of_it(folder):
    """A replay has the torque; a start that is written down was looked at."""
    for name in ("kick_1.csv", "kick_2.csv"):
        without = [line.split(",")[:3] for line in (folder / name).read_text().splitlines()]
        (folder / f"free_{name}").write_text("\n".join(map(",".join, without)) + "\n")
    free = [{"file": "free_kick_1.csv"}, {"file": "free_kick_2.csv"}]

    def said(*entries, **table):
        return any("no start transient is dropped" in note for note in runs(folder, *entries, **table)[2])

    assert said(*free)
    assert said(*free, drop_first_s=0)
    assert said({**free[0], "first_s": 0.1}, free[1])
    assert not said(*free, first_s=0)
    assert not said(*({**entry, "first_s": 0} for entry in free))
    assert not said({"file": "kick_1.csv"})


def test_a_speed_may_be_in_km_h(folder):
    def read_in(**speed):
        return read_runs({"runs": [{"file": "other.csv", **speed}]}, folder)[0][0].speed

    assert read_in(speed_km_h=18) == pytest.approx(5.0)
    for wrong in (0, 217, "18"):
        refuses(r"other.csv: speed_km_h = .* is outside 0 \.\. 216 km/h", read_in, speed_km_h=wrong)
    refuses("no speed_m_s; give the forward speed in m/s, or speed_km_h", read_in)


def test_a_recording_that_two_entries_name_is_told_with_both(folder):
    words = r"kick_2.csv: the same recording twice, by files = 'kick_\*.csv' and by file = 'kick_2.csv'; keep one"
    refuses(words, runs, folder, {"files": "kick_*.csv"}, {"file": "kick_2.csv"})


def test_channels_may_be_chosen_and_the_torque_stays(folder):
    (run,), _, _ = runs(folder, {"file": "other.csv"}, channels=["steer_rad"])
    assert set(run.channels) == {"steer_rad"}
    assert set(run.inputs) == {"steer_torque_N_m"}


def test_runs_may_be_held_out_and_that_is_said(folder):
    found, _, notes = runs(folder, {"file": "kick_1.csv"}, {"file": "kick_2.csv", "held_out": True})
    assert [run.held_out for run in found] == [False, True]
    assert "never fitted, only predicted: kick_2.csv" in notes


def test_a_folder_may_be_named_by_a_variable(folder, monkeypatch):
    monkeypatch.setenv("KICKS", str(folder.parent))
    (run,), _, _ = read_runs(
        {"folder": f"$KICKS/{folder.name}", "runs": [{"file": "other.csv", "speed_m_s": 5.0}]}, folder / "nowhere"
    )
    assert run.name == "other.csv"


def test_under_a_prescribed_steer_angle_the_torque_is_measured(folder):
    (run,), noise, notes = runs(folder, {"file": "other.csv"}, input="steer_rad", noise_sd={"steer_rad": 0.002})
    assert set(run.channels) == {"roll_rate_rad_s", "steer_torque_N_m"}
    assert set(run.inputs) == {"steer_rad"}
    assert noise == {"steer_rad": 0.002}
    assert any("steer_rad is prescribed" in note and "as the file says" in note for note in notes)
    (alone,), _, _ = runs(folder, {"file": "other.csv"}, input="steer_rad", channels=["roll_rate_rad_s"])
    assert set(alone.channels) == {"roll_rate_rad_s"}


@pytest.mark.parametrize(("entry", "table", "words"), [
    ({"file": "other.csv", "held_out": True}, {}, "held_out = true in every run; leave it out where a run"),
    ({"file": "other.csv", "held_out": 1}, {}, "held_out = 1 must be true or false"),
    ({"file": "other.csv"}, {"folder": "$KICKS_NOWHERE/runs"}, "KICKS_NOWHERE is not set; set it to the folder"),
    ({"file": "other.csv"}, {"folder": "runs"}, "folder = 'runs': there is no folder .*runs; give the one"),
    ({"file": "other.csv"}, {"folder": 3}, 'folder = 3 must be a folder in quotes, such as "runs"'),
    ({"file": "other.csv"}, {"input": "steer"}, "input = 'steer' is not allowed; write one of 'steer_torque_N_m',"),
    ({"file": "other.csv"}, {"input": "lean_torque_N_m"}, "input = 'lean_torque_N_m' was not recorded; the run"),
    ({"file": "other.csv"}, {"input": "steer_rad", "channels": ["steer_rad"]}, "steer_rad was not recorded; it"),
    (
        {"files": "push_*.csv"}, {},
        r"push_\*.csv: no file in .* is called so; give a pattern.*; it holds kick_1.csv, kick_2.csv, other.csv",
    ),
    ({"file": "other.csv", "speed_km_h": 18}, {}, "other.csv: speed_m_s and speed_km_h give the same; keep one"),
    ({"files": "kick_*.csv", "file": "other.csv"}, {}, "give one of file = .RUN.csv. and files"),
    ({}, {}, "give one of file = .RUN.csv. and files"),
    ({"file": 3}, {}, "file = 3 must be a path in quotes"),
    ({"file": "other.csv"}, {"first_s": 0.1, "drop_first_s": 0.1}, "drop_first_s and first_s give the same"),
    ({"file": "other.csv"}, {"first_s": 1.9}, r"other.csv: 5 samples after first_s = 1.9 s of 1.98 s; at least 20"),
    ({"file": "other.csv"}, {"drop_first_s": 1.9}, "5 samples after drop_first_s = 1.9 s"),
    ({"file": "other.csv"}, {"first_s": 0.5, "last_s": 0.6}, "6 samples from first_s = 0.5 s to last_s = 0.6 s"),
    ({"file": "other.csv"}, {"drop_first_s": 0.1, "last_s": 0.05}, "0.05 s is not after drop_first_s = 0.1 s"),
    ({"file": "other.csv", "first_s": 0.9}, {"last_s": 0.6}, "last_s = 0.6 s is not after first_s = 0.9 s"),
    ({"file": "other.csv", "last_s": -1}, {}, "last_s = -1 must be a time >= 0 in s, from the first sample"),
    ({"file": "other.csv"}, {"channels": ["lean_rad"]}, "lean_rad was not recorded; it holds roll_rate_rad_s,"),
    ({"file": "other.csv"}, {"channels": []}, r"channels = \[\]: name one or more of roll_rate_rad_s, steer_rad"),
    ({"file": "other.csv"}, {"channels": ["stear_rad"]}, "unknown channel 'stear_rad'; did you mean 'steer_rad'"),
])  # fmt: skip
def test_what_is_refused(folder, entry, table, words):
    refuses(words, runs, folder, entry, **table)
