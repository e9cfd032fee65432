"""Which recordings, samples and channels the table [histories] takes."""

import numpy as np
import pytest

from bicycle.identification.histories_table import read_runs
from tyre.base.errors import InputError


@pytest.fixture
def folder(tmp_path):
    time = np.arange(100) * 0.02
    for k, name in enumerate(("kick_1", "kick_2", "other")):
        lines = ["time_s,roll_rate_rad_s,steer_rad,steer_torque_N_m"]
        lines += [f"{t!r},{np.sin(3 * t + k)!r},{0.1 * np.cos(2 * t + k)!r},{k + t!r}" for t in time.tolist()]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines).replace("np.float64(", "").replace(")", "") + "\n")
    return tmp_path


def runs(folder, *entries, **table):
    return read_runs({"runs": [{"speed_m_s": 5.0, **entry} for entry in entries], **table}, folder)


def test_a_pattern_is_all_its_files_in_their_order(folder):
    found, _, _ = runs(folder, {"files": "kick_*.csv", "group": "kicks"})
    assert [run.name for run in found] == ["kick_1.csv", "kick_2.csv"]
    assert {run.group for run in found} == {"kicks"}


@pytest.mark.parametrize("key", ["first_s", "drop_first_s"])
def test_the_window_counts_from_the_first_sample_and_a_run_s_own_goes_first(folder, key):
    found, _, notes = runs(folder, {"file": "kick_1.csv"}, {"file": "kick_2.csv", "first_s": 0.4, "last_s": 1.2},
                           **{key: 0.1, "last_s": 1.0})  # fmt: skip
    assert [(run.time[0], run.time[-1]) for run in found] == [pytest.approx((0.1, 1.0)), pytest.approx((0.4, 1.2))]
    assert not any("no start transient" in note for note in notes)
    for run in found:
        assert len(run.time) == len(run.inputs["steer_torque_N_m"]) == len(run.channels["steer_rad"])


def test_channels_may_be_chosen_and_the_torque_stays(folder):
    (run,), _, _ = runs(folder, {"file": "other.csv"}, channels=["steer_rad"])
    assert set(run.channels) == {"steer_rad"}
    assert set(run.inputs) == {"steer_torque_N_m"}


@pytest.mark.parametrize(
    ("entry", "table", "words"),
    [
        ({"files": "push_*.csv"}, {}, r"push_\*.csv: no file in .* is called so; give a pattern"),
        ({"files": "kick_*.csv", "file": "other.csv"}, {}, "give one of file = .RUN.csv. and files"),
        ({}, {}, "give one of file = .RUN.csv. and files"),
        ({"file": 3}, {}, "file = 3 must be a path in quotes"),
        ({"file": "other.csv"}, {"first_s": 0.1, "drop_first_s": 0.1}, "drop_first_s and first_s say the same"),
        ({"file": "other.csv"}, {"first_s": 1.9}, r"other.csv: 5 samples after first_s = 1.9 s of 1.98 s; at least 20"),
        ({"file": "other.csv"}, {"drop_first_s": 1.9}, "5 samples after drop_first_s = 1.9 s"),
        ({"file": "other.csv"}, {"first_s": 0.5, "last_s": 0.6}, "6 samples from 0.5 to 0.6 s"),
        ({"file": "other.csv", "last_s": -1}, {}, "last_s = -1 must be a time >= 0 in s, from the first sample"),
        ({"file": "other.csv"}, {"channels": ["lean_rad"]}, "lean_rad was not recorded; it holds roll_rate_rad_s,"),
        ({"file": "other.csv"}, {"channels": []}, r"channels = \[\]: name one or more of roll_rate_rad_s, steer_rad"),
        ({"file": "other.csv"}, {"channels": ["stear_rad"]}, "unknown channel 'stear_rad'; did you mean 'steer_rad'"),
    ],
)  # fmt: skip
def test_what_is_refused(folder, entry, table, words):
    with pytest.raises(InputError, match=words):
        runs(folder, entry, **table)
