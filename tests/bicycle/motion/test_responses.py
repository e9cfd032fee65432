"""Time histories and frequency responses of the linear model against other methods, closed forms and invariances."""

from itertools import pairwise

import control
import numpy as np
import pandas as pd
import pytest
from built import linear
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from bicycle import load_bicycle
from bicycle.model import InputHistory, doublet, pulse, step
from bicycle.motion import frequency_response, modal_response, respond
from tests.shared.published_bicycle import K0, K2, G
from tyre.ground import InputError

REAR, FRONT = 6302.5, 6016.1  # N/rad
START = {"lean": 0.03, "steer_rate": 0.4, "rear_lateral_force": 20.0}


LAW = {"cornering_stiffness": {"rear": REAR, "front": FRONT}, "relaxation_length": 0.12}


@pytest.fixture(scope="module")
def tyred():
    beside = {"camber_thrust": {"camber_stiffness": 400.0}, "pneumatic_trail": {"trail": 0.017}}
    return linear(relaxation_length=LAW, **beside)


def states_of(model, found):
    return np.array([found.outputs[name] for name in model.states])


def test_steps_pulses_and_doublets_agree_with_a_stiff_solver(tyred):
    time = np.linspace(0.0, 2.0, 81)
    inputs = {
        "steer_torque": pulse(3.0, start=0.313, duration=0.2), "lateral_push": step(40.0, start=1.017),
        "front_slip": doublet(0.02, start=0.55, duration=0.4),
    }  # fmt: skip
    found = respond(tyred, speed=6.0, time=time, initial=START, inputs=inputs)
    a, b, _ = tyred.matrices_at(6.0)
    b = b[:, [tyred.inputs.index(name) for name in inputs]]
    x = np.array([START.get(name, 0.0) for name in tyred.states])
    breaks = np.unique(np.concatenate([[0.0, 2.0], *(h.time for h in inputs.values())]))
    points, expected = [0.0], [x[:, None]]
    for left, right in pairwise(breaks):
        u = np.array([h.at(left) for h in inputs.values()])
        at = np.append(time[(time > left) & (time < right)], right)
        run = solve_ivp(lambda _, y, u=u: a @ y + b @ u, (left, right), x, "DOP853", at, rtol=1e-12, atol=1e-13)
        x, points, expected = run.y[:, -1], [*points, *at], [*expected, run.y]
    solved = np.hstack(expected)[:, np.isin(points, time)]
    assert (np.abs(states_of(tyred, found) - solved).max(1) <= 1e-9 * np.abs(solved).max(1)).all()


def test_samples_of_a_recording_are_joined_by_straight_lines(tyred):
    """As control does between its samples; our own times need not be those of the recording."""
    time = np.arange(0.0, 3.0, 0.02)
    torque = np.sin(2 * np.pi * 1.3 * time) + 0.4
    wanted = np.arange(0.0, 2.98, 0.05)
    found = respond(tyred, speed=7.0, time=wanted, inputs={"steer_torque": InputHistory(time, torque, linear=True)})
    theirs = control.forced_response(tyred.to_control(7.0, inputs=["steer_torque"]), time, torque)
    at = [round(t / 0.02) for t in wanted[::2]]
    for name, values in zip(tyred.outputs, theirs.outputs, strict=True):
        assert np.allclose(found.outputs[name][::2], values[at], rtol=1e-8, atol=1e-8 * np.abs(values).max())
    assert found.inputs["steer_torque"] == pytest.approx(np.interp(wanted, time, torque))


def test_slip_step_settles_at_cornering_stiffness_times_slip():
    # A bicycle too heavy to be pushed aside stays straight, so its tyre sees the imposed slip alone: F = C alpha
    # after the lag F(t) = C alpha (1 - exp(-v t / lambda)) (Dell'Orto et al., eq. 2, corrected).
    masses = {key: 1e9 * value for key, value in load_bicycle("benchmark").values.items() if key[0] in "Im"}
    heavy = linear(load_bicycle("benchmark").replace(allow_unusual=True, **masses), relaxation_length=LAW)
    time = np.linspace(0.0, 0.5, 26)
    found = respond(heavy, speed=4.0, time=time, inputs={"rear_slip": step(0.01)})
    expected = 0.01 * REAR * (1 - np.exp(-4.0 * time / 0.12))
    assert np.allclose(found.outputs["rear_lateral_force"], expected, rtol=1e-5, atol=1e-5)
    assert np.abs(found.outputs["front_lateral_force"]).max() < 1e-3


def test_steady_turn_of_the_whipple_bicycle_holds_its_balance():
    # K steady = T (Meijaard et al. 2007, eq. 5.3): (g K0 + v^2 K2) [lean, steer] = [0, steer torque], at a stable speed
    expected = np.linalg.solve(G * K0 + 5.0**2 * K2, [0.0, 0.2])
    found = respond(linear(), speed=5.0, time=[0.0, 60.0], inputs={"steer_torque": step(0.2)})
    assert [found.outputs["lean"][1], found.outputs["steer"][1]] == pytest.approx(expected.tolist(), rel=1e-7)
    static = frequency_response(linear(), speed=5.0, input="steer_torque", frequency_hz=[1e-9])
    assert static.outputs["steer"][0].real == pytest.approx(expected[1] / 0.2, rel=1e-7)


def test_path_integrates_yaw_rate_and_lateral_velocity(tyred):
    time = np.linspace(0.0, 2.0, 2001)
    found = respond(tyred, speed=6.0, time=time, initial=START)
    yaw, y = found.outputs["yaw"], found.outputs["rear_lateral_displacement"]
    assert np.allclose(np.gradient(yaw, time)[1:-1], found.outputs["yaw_rate"][1:-1], atol=2e-4)
    sideways = found.outputs["rear_lateral_velocity"] + 6.0 * yaw
    assert np.allclose(np.gradient(y, time)[1:-1], sideways[1:-1], atol=2e-4)


@settings(max_examples=15)
@given(speed=st.floats(0.0, 20.0), a=st.floats(-1.0, 1.0), b=st.floats(-1.0, 1.0), split=st.floats(0.05, 0.95))
def test_superposition_and_restart(tyred, speed, a, b, split):
    time = np.array([0.0, split, 1.0])
    torque, force = {"steer_torque": step(a)}, {"lateral_push": pulse(30 * b, start=0.2, duration=0.3)}
    both = respond(tyred, speed=speed, time=time, initial=START, inputs={**torque, **force})
    alone = {"initial": START}, {"inputs": torque}, {"inputs": force}
    parts = [respond(tyred, speed=speed, time=time, **given) for given in alone]
    middle = {name: both.outputs[name][1] for name in tyred.states}
    again = respond(tyred, speed=speed, time=time[1:], initial=middle, inputs={**torque, **force})
    for name in tyred.states:
        size = np.abs([p.outputs[name] for p in (*parts, both)]).max()
        assert np.allclose(sum(p.outputs[name] for p in parts), both.outputs[name], atol=1e-9 * size, rtol=0)
        assert again.outputs[name][1] == pytest.approx(both.outputs[name][2], abs=1e-8 * max(size, 1e-6))


def test_modal_response_is_the_free_response_in_one_mode(tyred):
    root = next(z for z in tyred.eigenvalues(6.0) if z.imag > 0 and abs(z) < 10)
    time = np.linspace(0.0, 1.0, 21)
    mode = modal_response(tyred, speed=6.0, eigenvalue=root, time=time)
    free = respond(tyred, speed=6.0, time=time, initial={name: mode.outputs[name][0] for name in tyred.states})
    for name in tyred.outputs:
        assert np.allclose(free.outputs[name], mode.outputs[name], atol=1e-9 * np.abs(mode.outputs[name]).max(), rtol=0)
    assert np.allclose(np.diff(free.outputs["yaw"]), np.diff(mode.outputs["yaw"]), atol=1e-9)


def test_frequency_response_agrees_with_control(tyred):
    frequency = np.geomspace(0.1, 100.0, 40)
    ours = frequency_response(tyred, speed=6.0, input="steer_torque", frequency_hz=frequency / (2 * np.pi))
    theirs = tyred.to_control(6.0, inputs=["steer_torque"])(1j * frequency)[:, 0]
    for gain, expected in zip(ours.outputs.values(), theirs, strict=True):
        assert np.allclose(gain, expected, rtol=1e-8, atol=1e-12 * np.abs(expected).max())
    table = ours.frame()
    assert table["lean_rad_per_steer_torque_N_m"].to_numpy() == pytest.approx(np.abs(ours.outputs["lean"]))
    assert table["frequency_Hz"][0] == pytest.approx(0.1 / 2 / np.pi)


def test_csv_has_units_and_all_digits(tyred, tmp_path):
    torque = {"steer_torque": step(1 / 3, start=0.5)}
    found = respond(tyred, speed=6.0, time=np.arange(5) / 3, initial=START, inputs=torque)
    found.to_csv(tmp_path / "r.csv")
    table = pd.read_csv(tmp_path / "r.csv")
    assert list(table)[:2] == ["time_s", "lean_rad"]
    assert list(table)[-3:] == ["yaw_rad", "rear_lateral_displacement_m", "steer_torque_N_m"]
    assert {"steer_rate_rad_s", "rear_lateral_velocity_m_s", "rear_lateral_force_N"} < set(table)
    assert (np.abs(table["rear_lateral_force_N"].to_numpy() / found.outputs["rear_lateral_force"] - 1) < 1e-15).all()
    assert table["steer_torque_N_m"].tolist() == [0, 0, 1 / 3, 1 / 3, 1 / 3]


def test_large_motion_and_fall_are_reported(tyred):
    fallen = respond(tyred, speed=1.0, time=np.linspace(0, 5, 501), initial={"lean": 0.1})
    assert abs(fallen.outputs["lean"][fallen.fall]) > np.pi / 2 >= abs(fallen.outputs["lean"][fallen.fall - 1])
    assert "the bicycle has fallen at" in fallen.warnings[0]
    assert "lean reaches" in fallen.warnings[1]
    ended = fallen.until_fall()
    assert len(ended.time) == len(ended.outputs["lean"]) == fallen.fall + 1
    assert ended.fall == fallen.fall
    calm = respond(tyred, speed=6.0, time=[0.0, 0.1], initial={"lean": 0.1})
    assert calm.warnings == ()
    leant = respond(tyred, speed=6.0, time=[0.0, 0.1], initial={"lean": 0.4})  # tan(0.4) = 1.06 * 0.4
    assert [text.rpartition(" up to ")[2] for text in leant.warnings] == ["about 0.35 rad"]
    assert calm.fall is None
    assert len(calm.until_fall().time) == 2


@pytest.mark.parametrize(("changes", "words"), [
    ({"initial": {"leam": 1.0}}, "unknown state 'leam'; did you mean 'lean'"),
    ({"initial": {"lean": np.nan}}, "initial lean = nan rad must be finite"),
    ({"inputs": {"steer_torqe": step(1.0)}}, "unknown input 'steer_torqe'; did you mean 'steer_torque'"),
    ({"time": [0.0, 0.0]}, "finite, increasing instants"),
    ({"time": []}, "finite, increasing instants"),
    ({"time": [0.0, 1e5], "speed": 1.0}, "grows beyond all numbers within 100000 s; take less time"),
    ({"speed": -1.0}, "speed -1 m/s is not allowed"),
])  # fmt: skip
def test_refused_responses(tyred, changes, words):
    with pytest.raises(InputError, match=words):
        respond(tyred, **{"speed": 6.0, "time": [0.0, 1.0], "initial": START, **changes})


def test_refused_frequencies_and_inputs(tyred):
    with pytest.raises(InputError, match="frequency 0 Hz is not allowed; give finite values > 0"):
        frequency_response(tyred, speed=6.0, input="steer_torque", frequency_hz=[1.0, 0.0])
    with pytest.raises(InputError, match="unknown input 'torque'"):
        frequency_response(tyred, speed=6.0, input="torque", frequency_hz=[1.0])


@pytest.mark.parametrize(("make", "words"), [
    (lambda: InputHistory([0.0, 1.0], [1.0]), "an input has 2 times and 1 values; give one value for each time"),
    (lambda: InputHistory([0.0, np.inf], [1.0, 1.0]), "a time or value that is not finite"),
    (lambda: InputHistory([1.0, 1.0], [1.0, 2.0]), "the times of an input must increase"),
    (lambda: pulse(1.0, duration=0.0), "the duration of a pulse is 0 s; it must be positive"),
    (lambda: doublet(1.0, duration=-1.0), "the duration of a doublet is -1 s; it must be positive"),
])  # fmt: skip
def test_refused_inputs(make, words):
    with pytest.raises(InputError, match=words):
        make()


@given(st.integers(0, 400), st.integers(1, 400), st.sampled_from([50, 90, 100, 250]))
def test_a_sample_at_the_end_of_a_pulse_is_after_it(start, count, rate):
    """0.2 + 0.4 is 0.6000000000000001 in binary numbers, and the sample at 0.6 s not in the pulse."""
    first, last = start / rate, (start + 2 * count) / rate
    time = np.arange(2000) / rate
    shape = pulse(3.0, start=first, duration=2 * count / rate)
    np.testing.assert_array_equal(np.flatnonzero(shape.at(time)), np.arange(start, start + 2 * count))
    assert shape.before(last) == 3.0
    both = doublet(3.0, start=first, duration=2 * count / rate).at(time)
    assert [(both == size).sum() for size in (3.0, -3.0)] == [count, count]
