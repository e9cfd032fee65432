"""The same free decay in every format, in awkward units, signs and axes, gives the same eigenvalue; what is refused."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from lab_recordings import write_motion

from bicycle.identification import identify, read_events, read_run, read_runs
from studies.cli import main
from tests.validation.recording_writers import WRITERS, write_hdf5, write_mf4, write_parquet
from tyre.formats import ChannelMap, Resampling
from tyre.ground import InputError

ROOT = complex(-0.7, 4.4)
WRITTEN = {"roll_rate": "roll_rate_rad_s", "yaw_rate": "yaw_rate_rad_s", "steer": "steer_rad"}


@pytest.fixture(scope="module")
def motion():
    rng = np.random.default_rng(4)
    time = np.arange(400) / 100
    wave = np.exp(ROOT * time)
    shapes = {"roll_rate": 0.5, "pitch_rate": 0.01, "yaw_rate": 0.2 + 0.3j, "steer": 0.1 - 0.1j}
    return time, {name: (shape * wave).real + rng.normal(0, 2e-3, 400) for name, shape in shapes.items()}


def write_own(folder: Path, time, channels) -> Path:
    names = [name for name in channels if name in WRITTEN]
    rows = np.column_stack([time, *(channels[name] for name in names)])
    text = "time_s," + ",".join(WRITTEN[name] for name in names) + "\n"
    path = folder / "own.csv"
    path.write_text(text + "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))
    return path


@pytest.fixture(scope="module")
def own(motion, tmp_path_factory):
    """The recording in the columns and units of velotyre, which needs no map."""
    run = read_run(write_own(tmp_path_factory.mktemp("own"), *motion), 5.0)
    found = identify(run)
    assert abs(found.eigenvalue - ROOT) < 5 * max(found.sd)
    return run


@pytest.mark.filterwarnings("ignore:duration_to_mat")  # of the writer
@pytest.mark.parametrize("form", WRITERS)
def test_every_format_gives_the_same_decay(form, motion, own, tmp_path):
    path, content = write_motion(tmp_path, form, *motion)
    (run,) = read_events(path, 5.0, channel_map=ChannelMap.from_table(content, tmp_path, where="map"))
    assert sorted(run.channels) == sorted(WRITTEN.values())
    assert run.mountings[0].sd == pytest.approx(np.deg2rad(0.5))
    assert "turned from the axes of their sensor (known to 0.5 deg, 1 sd)" in run.notes[-1]
    np.testing.assert_allclose(run.time - run.time[0], own.time, rtol=1e-9, atol=1e-12)
    for name, x in own.channels.items():
        np.testing.assert_allclose(run.channels[name], x, rtol=1e-9, atol=1e-12)


def test_modal_with_a_map_of_the_command_line_writes_the_same_table(motion, tmp_path, capsys):
    time, channels = motion
    own = write_own(tmp_path, time, channels)
    path, content = write_motion(tmp_path, "mf4", time, channels)
    (tmp_path / "map.toml").write_text(tomli_w.dumps(content))
    main(["modal", f"{own}@5", "--out", str(tmp_path / "own_table.csv")])
    main(["modal", f"{path}@5", "--channels", str(tmp_path / "map.toml"), "--out", str(tmp_path / "lab_table.csv")])
    assert (tmp_path / "lab_table.csv").read_text() == (tmp_path / "own_table.csv").read_text()
    assert "note: run.mf4: roll_rate, pitch_rate, yaw_rate turned" in capsys.readouterr().err


def test_several_events_of_one_file_are_several_runs(motion, tmp_path, capsys):
    """Three kicks in one file, cut out by the moment the torque rises; each is identified as the decay that it is."""
    _, channels = motion
    still = np.zeros(50)
    roll = np.concatenate([np.concatenate([still, channels["roll_rate"]]) for _ in range(3)])
    torque = np.concatenate([np.concatenate([still, np.where(np.arange(400) < 5, 8.0, 0.0)]) for _ in range(3)])
    clock = np.arange(len(roll)) / 100
    write_hdf5(tmp_path / "kicks.h5", {"t": (clock, "s"), "p": (roll, "rad/s"), "T": (1e2 * torque, "Ncm")})
    trigger = {"channel": "kick", "above": 4.0, "unit": "N m", "before_s": 0.0, "after_s": 3.98}
    content = {
        "channels": {"time": "run/t", "roll_rate": "run/p", "kick": {"column": "run/T"}},
        "windows": [{"name": "kick", "trigger": trigger}],
    }
    runs = read_events(tmp_path / "kicks.h5", 5.0, channel_map=ChannelMap.from_table(content, tmp_path, where="map"))
    assert [run.name for run in runs] == ["kicks.h5#kick.1", "kicks.h5#kick.2", "kicks.h5#kick.3"]
    for run in runs:
        np.testing.assert_allclose(run.channels["roll_rate_rad_s"], channels["roll_rate"][:399], rtol=1e-12)
        assert abs(identify(run).eigenvalue - ROOT) < 0.1


def test_histories_of_a_measurement_file_take_maps(motion, tmp_path):
    """One map for all runs, a rate of its own for one; the lab.toml of the laboratory or tables on the spot."""
    time, channels = motion
    for name in ("a", "b"):
        shift = 0.0 if name == "a" else 0.001
        write_mf4(tmp_path / f"{name}.mf4", {"t": (time, "s"), "p": (channels["roll_rate"] + shift, "rad/s")})
    write_parquet(tmp_path / "c.parquet", {"p": (channels["roll_rate"] * 1.1, "rad/s")})
    (tmp_path / "lab.toml").write_text('[channels]\nroll_rate = "p"\n')
    runs = [{"file": f"{name}.mf4", "speed_m_s": 5.0} for name in "ab"]
    runs.append({"file": "c.parquet", "speed_m_s": 5.0, "channels": {"time": {"rate_hz": 100}, "roll_rate": "p"}})
    found, _, _ = read_runs({"channels": "lab.toml", "runs": runs}, tmp_path)
    assert [run.name for run in found] == ["a.mf4", "b.mf4", "c.parquet"]
    for run in found:
        np.testing.assert_allclose(run.time, time, atol=1e-12)
    np.testing.assert_allclose(found[2].channels["roll_rate_rad_s"], channels["roll_rate"] * 1.1)


def test_a_file_without_a_map_is_shown_with_a_draft(motion, tmp_path):
    time, channels = motion
    write_hdf5(tmp_path / "a.h5", {"t": (time, "s"), "IMU_gyro_x": (channels["roll_rate"], "deg/s")})
    with pytest.raises(InputError, match=r"a\.h5: no channel map .* the columns are run/IMU_gyro_x \[deg/s\]") as told:
        read_events(tmp_path / "a.h5", 5.0)
    draft = "[channels]" + str(told.value).partition("[channels]")[2]
    (tmp_path / "map.toml").write_text(draft)
    (run,) = read_events(tmp_path / "a.h5", 5.0, channel_map=ChannelMap.from_file(tmp_path / "map.toml"))
    np.testing.assert_allclose(run.channels["roll_rate_rad_s"], np.deg2rad(channels["roll_rate"]))
    (tmp_path / "b.csv").write_text("time_s,roll_rate_rad_s,battery_V\n0,0,12\n0.01,0,12\n")
    with pytest.raises(InputError, match="unknown column 'battery_V'.*or give a channel map: the columns are time_s"):
        read_run(tmp_path / "b.csv", 5.0)


def test_missing_samples_are_refused(motion, tmp_path):
    time, channels = motion
    roll = channels["roll_rate"].copy()
    roll[[7, 9]] = np.nan
    write_parquet(tmp_path / "a.parquet", {"t": (time, "s"), "p": (roll, "rad/s")})
    asked = ChannelMap().with_channels(["time=t", "roll_rate=p"])
    with pytest.raises(InputError, match="roll_rate_rad_s is missing in 2 samples, first in sample 8") as told:
        read_events(tmp_path / "a.parquet", 5.0, channel_map=asked)
    rate = float(re.search(r"; write \[resampling\] with rate_hz = (\S+) \(linear", str(told.value))[1])
    assert rate == pytest.approx(1 / (time[1] - time[0]), rel=1e-3)
    (run,) = read_events(
        tmp_path / "a.parquet", 5.0, channel_map=replace(asked, resampling=Resampling(rate=rate))
    )  # the advice works
    assert run.channels["roll_rate_rad_s"][7] == pytest.approx((roll[6] + roll[8]) / 2)
    for lost in (slice(20, 26), slice(0, 1), slice(-1, None)):  # a gap and the ends, which it leaves open
        roll[lost] = np.nan
        write_parquet(tmp_path / "b.parquet", {"t": (time, "s"), "p": (roll, "rad/s")})
        with pytest.raises(InputError, match=r"is missing in .*; cut the recording with \[\[windows\]\] or repair it"):
            read_events(tmp_path / "b.parquet", 5.0, channel_map=asked)
        roll[lost] = 0.0


def test_simulate_takes_an_input_from_any_file(tmp_path, capsys):
    clock = np.arange(301) / 100
    torque = 0.3 * np.sin(2 * np.pi * clock)
    write_mf4(tmp_path / "t.mf4", {"t": (clock, "s"), "T_steer": (-100 * torque, "Ncm"), "other": (clock, "V")})
    rows = "".join(f"{t!r},{x!r}\n" for t, x in zip(clock.tolist(), torque.tolist(), strict=True))
    (tmp_path / "own.csv").write_text("time_s,steer_torque_N_m\n" + rows)
    base = ["simulate", "benchmark", "--speed", "5", "--duration", "3", "--step", "0.01", "--input"]
    main([*base, f"steer_torque:file:{tmp_path / 'own.csv'}", "--out", str(tmp_path / "own")])
    main([*base, f"steer_torque:file:{tmp_path / 't.mf4'}", "--channel", "steer_torque=T_steer Ncm -1",
          "--channel", "roll_rate=other deg/s", "--out", str(tmp_path / "lab")])  # fmt: skip
    own, lab = (
        np.genfromtxt(tmp_path / name / "response_linear.csv", delimiter=",", names=True) for name in ("own", "lab")
    )
    for column in own.dtype.names:
        np.testing.assert_allclose(lab[column], own[column], rtol=1e-9, atol=1e-12)
    with pytest.raises(SystemExit):
        main([*base, f"steer_torque:file:{tmp_path / 't.mf4'}", "--out", str(tmp_path / "no")])
    assert "t.mf4: no channel map assigns" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(
            [*base, f"steer_torque:file:{tmp_path / 't.mf4'}", "--channel", "lean=other", "--out", str(tmp_path / "no")]
        )
    assert "the channel map names no steer_torque (it names lean)" in capsys.readouterr().err
