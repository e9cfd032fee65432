"""Rides: which segments are chosen, what is left out, and what is refused."""

import os
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle.identification import read_ride, segment_rows
from tyre.formats import ChannelMap
from tyre.ground import InputError

RATE = 20  # Hz


def write(path, time, **columns):
    """Write a CSV; a roll rate of noise is in it, unless another is given."""
    rng = np.random.default_rng(3)
    columns = {"time_s": time, "roll_rate_rad_s": rng.normal(0, 0.1, len(time)), **columns}
    lines = [",".join(columns)]
    lines += [",".join(f"{x:.6f}" for x in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def times(seconds):
    return np.arange(round(seconds * RATE)) / RATE


def held(*levels):
    """Speed of so many seconds each, and no ramp between."""
    return np.concatenate([np.full(round(seconds * RATE), float(speed)) for seconds, speed in levels])


def smoothed(time, speed):
    """Mean over the second about each sample, by the definition."""
    return np.array([speed[np.abs(time - t) <= 0.5 + 1e-6].mean() for t in time])


levels = st.tuples(st.floats(3, 45), st.floats(0, 12))


@settings(max_examples=30)
@given(st.lists(levels, min_size=1, max_size=5), st.floats(0, 0.3), st.integers(0, 99))
def test_every_sample_is_in_one_segment_or_left_out_and_segments_are_steady(tmp_path_factory, levels, noise, seed):
    speed = held(*levels)
    time = times(len(speed) / RATE)
    rng = np.random.default_rng(seed)
    speed = np.abs(speed + noise * np.sin(0.3 * time + seed) + rng.normal(0, 0.01, len(time)))
    yaw = np.where(rng.random() < 0.5, 0.4, 0.02) * np.exp(-(((time - time[-1] / 2) / 4) ** 2))
    path = write(tmp_path_factory.mktemp("ride") / "r.csv", time, speed_m_s=speed, yaw_rate_rad_s=yaw)
    speed = np.round(speed, 6)
    try:
        ride = read_ride(path)
    except InputError as error:
        if "no part of the ride is steady for 20 s" not in str(error):
            raise
        return
    spans = [(run.time[0], run.time[-1], run.time.size) for run in ride.segments]
    spans += [(part.first_s, part.last_s, part.samples) for part in ride.parts_left_out]
    spans.sort()
    assert sum(samples for *_, samples in spans) == len(time)
    for (_, last, _), (first, _, _) in pairwise(spans):
        assert first == pytest.approx(last + 1 / RATE)
    course = smoothed(time, speed)
    for part in ride.parts_left_out:  # nothing that would do was overlooked
        inside = (time >= part.first_s - 1e-9) & (time <= part.last_s + 1e-9)
        if part.why in ("short", "unsteady") and part.samples >= 20 * RATE:
            windows = np.lib.stride_tricks.sliding_window_view(course[inside], 20 * RATE)
            low, high = windows.min(axis=1), windows.max(axis=1)
            assert (high - low > 2 * np.maximum(0.03 * (low + high) / 2, 0.15) - 1e-6).all()
    for run in ride.segments:
        inside = (time >= run.time[0] - 1e-9) & (time <= run.time[-1] + 1e-9)
        low, high = course[inside].min(), course[inside].max()
        middle = (low + high) / 2
        assert high - middle <= max(0.03 * middle, 0.15) + 1e-6
        assert run.time.size >= 20 * RATE
        assert run.speed == pytest.approx(speed[inside].mean())
        assert low > 1 - 1e-6


def test_two_levels_are_two_groups_and_the_way_between_is_left_out(tmp_path):
    speed = np.concatenate([held((30, 4)), np.linspace(4, 7, 10 * RATE), held((40, 7)), held((25, 4.1))])
    ride = read_ride(write(tmp_path / "r.csv", times(105), speed_m_s=speed), group="A")
    assert [run.name for run in ride.segments] == ["r.csv#1", "r.csv#2", "r.csv#3"]
    first, second, third = (run.group for run in ride.segments)
    assert first == third == "A 4.05 m/s" != second
    assert ride.segments[1].speed == pytest.approx(7, abs=0.05)
    first = ride.parts_left_out[0]
    assert 30 <= first.first_s <= 31.1  # 0.3 m/s above 4 m/s are reached after 1 s of the ramp
    assert first.sentence.startswith(f"The speed is not steady from {first.first_s:.6g} to ")
    assert ride.left_out[0] == first.sentence
    assert "no yaw rate was recorded, so turns are not left out" in ride.notes


def test_km_h_is_converted_and_a_row_says_what_a_segment_holds(tmp_path):
    path = write(tmp_path / "r.csv", times(25), speed_km_h=held((25, 18)), steer_torque_N_m=np.sin(times(25)))
    (row,) = segment_rows(read_ride(path))
    assert row == {
        "segment": "r.csv", "from, s": 0, "to, s": 24.95, "speed, m/s": pytest.approx(5),
        "lowest speed, m/s": pytest.approx(5), "highest speed, m/s": pytest.approx(5),
        "channels": "roll_rate_rad_s, steer_torque_N_m",
    }  # fmt: skip


def test_turns_and_standing_are_left_out(tmp_path):
    time = times(100)
    yaw = np.where((time >= 40) & (time < 45), 0.3, 0.0) + 0.01 * np.sin(time)
    ride = read_ride(write(tmp_path / "r.csv", time, speed_m_s=held((80, 5), (20, 0.2)), yaw_rate_rad_s=yaw))
    assert len(ride.segments) == 2
    turn = next(part for part in ride.parts_left_out if part.why == "turn")
    # a mean over 2 s exceeds half of 0.3 rad/s where a half of it is inside the turn
    assert (turn.first_s, turn.last_s) == pytest.approx((40, 45), abs=0.2)
    standing = ride.parts_left_out[-1]
    assert (standing.why, standing.last_s) == ("standing", 99.95)
    assert standing.first_s == pytest.approx(80.3, abs=0.3)


def test_a_gap_and_a_new_piece_end_a_segment(tmp_path):
    time = times(60)
    time[25 * RATE :] += 0.05  # one sample lost
    ride = read_ride(write(tmp_path / "r.csv", time, speed_m_s=held((60, 5))))
    assert [(run.time[0], run.time[-1]) for run in ride.segments] == [(0, 24.95), (pytest.approx(25.05), 60)]
    assert any("time has 1 gap, the longest of 0.1 s after 24.95 s" in note for note in ride.notes)

    pieces = np.repeat([1, 2, 1], [6 * RATE, 3 * RATE, 5 * RATE])
    time = np.concatenate([times(6), times(3), times(5)])
    ride = read_ride(write(tmp_path / "p.csv", time, piece=pieces), 5.0)
    assert ride.pieces == ("1", "1")
    assert [run.time.size for run in ride.segments] == [6 * RATE, 5 * RATE]
    assert ride.left_out == (
        "The steady part from 0 to 2.95 s in piece 2 is too short: 3 s, where at least 4 s are needed.",
    )


def test_a_recorded_speed_goes_before_a_stated_one(tmp_path):
    path = write(tmp_path / "r.csv", times(25), speed_m_s=held((25, 5)))
    ride = read_ride(path, 5.5)
    assert ride.segments[0].speed == pytest.approx(5)
    assert any("the recorded speed is used: its mean 5 m/s is -9 % from the stated 5.5 m/s" in x for x in ride.notes)
    assert not any("recorded speed" in note for note in read_ride(path, 5.2).notes)


def test_missing_samples_and_a_dead_sensor_are_left_out(tmp_path):
    time = times(90)
    roll = np.random.default_rng(1).normal(0, 0.1, len(time))
    roll[60 * RATE :] = 0.25
    lines = ["t,gyro,v"] + [f"{t:.2f},{'' if 30 <= t < 31 else f'{x:.4f}'},18" for t, x in zip(time, roll, strict=True)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    texts = ["time=t s", "roll_rate=gyro rad/s", "speed=v km/h"]
    ride = read_ride(path, channel_map=ChannelMap().with_channels(texts))
    assert ride.left_out[0] == "A channel is missing from 30 to 30.95 s."
    assert [round(run.time[-1], 2) for run in ride.segments] == [29.95, 89.95]
    assert ride.segments[0].speed == pytest.approx(5)


@pytest.mark.parametrize("cell", ["", "nan"])
def test_an_empty_cell_is_a_missing_sample(tmp_path, cell):
    path = write(tmp_path / "r.csv", times(60), roll_rate_rad_s=np.sin(times(60)))
    lines = path.read_text().splitlines()
    place = lines[0].split(",").index("roll_rate_rad_s")
    for k in range(1 + 25 * RATE, 1 + 26 * RATE):
        cells = lines[k].split(",")
        cells[place] = cell
        lines[k] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    ride = read_ride(path, 5.0)
    assert ride.left_out == ("A channel is missing from 25 to 25.95 s.",)
    assert len(ride.segments) == 2


@pytest.mark.parametrize("column", ["yaw_rate_rad_s", "speed_m_s"])
def test_a_column_without_a_number_is_refused(tmp_path, column):
    time = times(30)
    path = write(tmp_path / "r.csv", time, **{"speed_m_s": held((30, 5)), column: np.full(len(time), np.nan)})
    with pytest.raises(InputError, match="holds no number; leave the column out"):
        read_ride(path, 5.0)


def test_a_motion_too_small_for_any_sensor_is_refused(tmp_path):
    path = tmp_path / "r.csv"
    table = np.column_stack([times(25), 1e-300 * np.sin(times(25))])
    np.savetxt(path, table, delimiter=",", header="time_s,roll_rate_rad_s", comments="")
    with pytest.raises(InputError, match="roll_rate_rad_s changes by 2e-300 in all, less than 1e-08; correct its unit"):
        read_ride(path, 5.0)


@pytest.mark.parametrize(
    ("columns", "speed", "words"),
    [
        ({}, None, "no speed was recorded; add a column speed_m_s, or give the speed of the ride"),
        ({}, 70.0, "speed = 70 m/s is outside 1 to 60 m/s; is it in km/h"),
        ({"speed_m_s": held((25, 70))}, None, "line 2: the speed is 70 m/s, above 60 m/s; is it in km/h?"),
        ({"speed_m_s": held((25, -5))}, None, "the speed is -5 m/s; it must be positive"),
        ({"speed_m_s": held((25, 5)), "speed_km_h": held((25, 18))}, None, "give the same; keep one"),
        ({"piece": held((25, 1.5))}, 5.0, "line 2: piece = 1.5 must be a whole number"),
        ({"speed_m_s": held((25, 0.5))}, None, "20 s; the bicycle stands or turns all the time; ride straight ahead"),
        (
            {"speed_m_s": held((12.5, 5), (12.5, 7))},
            None,
            "no part of the ride is steady for 20 s; the longest steady interval from 0 to 24.95 s is 12.",
        ),
        ({"time_s": np.delete(times(26), range(200, 220))}, 5.0, "or close the gap in time with"),
        ({"roll_rate_rad_s": held((25, 1))}, 5.0, "roll_rate_rad_s is constant (1): a dead channel"),
        ({"roll_rate_rad_s": 40 * np.sin(times(25))}, 5.0, "too large (up to 20); is it in degrees?"),
        ({"time_s": times(25) ** 1.1}, 5.0, "resample to even steps"),
        ({"time_s": times(25)[::-1]}, 5.0, "does not rise"),
    ],
)
def test_what_cannot_be_used_is_refused(tmp_path, columns, speed, words):
    with pytest.raises(InputError) as refusal:
        read_ride(write(tmp_path / "r.csv", times(25), **columns), speed)
    assert words in str(refusal.value)


def test_an_empty_ride_needs_a_motion(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time_s,steer_torque_N_m\n" + "".join(f"{t},1\n" for t in times(2)))
    with pytest.raises(InputError, match="no motion was recorded"):
        read_ride(path, 5.0)


REAL = Path(os.environ.get("VELOTYRE_EXTRA_DATA", "nowhere")) / "steer_by_wire_rest/rest_3.05.csv"


@pytest.mark.skipif(not REAL.is_file(), reason="the recordings are not in the project")
def test_pieces_between_the_impulses_of_a_real_bicycle_are_segments_of_one_group():
    """Nine pieces on a treadmill, the time of each from 0."""
    ride = read_ride(REAL)
    assert ride.pieces == tuple("123456789")
    assert len({run.group for run in ride.segments}) == 1
    assert all(run.time[0] == 0 and run.step == pytest.approx(0.01) for run in ride.segments)
    assert all(run.speed == pytest.approx(3.05, abs=0.05) for run in ride.segments)
    assert ride.left_out == ()
