"""A simulated sensor against what such a sensor does by its textbook."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle.motion import Response
from studies.motion import Sensor, Sensors, apply_lag, fine_step, record_motion
from tyre.ground import InputError

DENSE = np.arange(4001) / 1000
TIME = np.arange(401) / 100
RAMP = 0.2 * DENSE


def test_a_perfect_sensor_reads_the_motion():
    assert Sensor().read(DENSE, np.sin(DENSE), TIME) == pytest.approx(np.sin(TIME), rel=1e-12, abs=1e-12)


def test_a_low_pass_follows_a_ramp_late_by_its_time_constant():
    """T y' + y = a t from rest: y = a (t - T (1 - exp(-t/T)))."""
    constant = 1 / (2 * math.pi * 3.0)
    exact = 0.2 * (TIME - constant * (1 - np.exp(-TIME / constant)))
    assert Sensor(low_pass_hz=3.0).read(DENSE, RAMP, TIME) == pytest.approx(exact, abs=1e-12)
    assert apply_lag(np.full(9, 2.5), 0.1, 0.05) == pytest.approx(2.5)  # begins settled


def test_a_low_pass_turns_a_sine_at_its_corner_by_45_degrees():
    wave = np.sin(2 * math.pi * 5.0 * DENSE)
    seen = Sensor(low_pass_hz=5.0).read(DENSE, wave, TIME)[200:]
    late = np.sin(2 * math.pi * 5.0 * TIME[200:] - math.pi / 4) / math.sqrt(2)
    assert seen == pytest.approx(late, abs=2e-3)


def test_scale_offset_drift_delay_and_resolution():
    sensor = Sensor(scale_error=0.1, offset=-0.02, drift_per_s=0.003, delay_s=0.25)
    exact = np.where(TIME > 0.25, 1.1 * 0.2 * (TIME - 0.25), 0.0) - 0.02 + 0.003 * TIME
    assert sensor.read(DENSE, RAMP, TIME) == pytest.approx(exact, abs=1e-12)
    steps = Sensor(resolution=0.05).read(DENSE, RAMP, TIME) / 0.05
    assert np.abs(steps - np.round(steps)).max() < 1e-9
    assert np.abs(steps * 0.05 - 0.2 * TIME).max() <= 0.025 + 1e-12


@settings(max_examples=25)
@given(correlation=st.floats(0.0, 0.95), sd=st.floats(1e-3, 10.0))
def test_noise_has_the_sd_and_colour_that_were_asked(correlation, sd):
    time = np.arange(100_000) / 100
    noise = Sensor(noise_sd=sd, correlation=correlation).read(time, np.zeros(len(time)), time, np.random.default_rng(5))
    assert noise.std() == pytest.approx(sd, rel=0.05)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(correlation, abs=0.02)


def test_a_bandwidth_is_a_correlation():
    assert Sensor(bandwidth_hz=10.0).memory(0.01) == pytest.approx(math.exp(-2 * math.pi * 0.1))
    assert Sensor(correlation=0.4).memory(0.01) == 0.4


def response(speed=5.0, seconds=4.0):
    time = np.arange(0, seconds, 0.001)
    outputs = {"lean_rate": np.sin(time), "steer": np.cos(time), "lean": 0 * time}
    return Response(time, speed, outputs, {"steer_torque": np.ones(len(time))})


SENSORS = Sensors(50.0, {
    "roll_rate_rad_s": Sensor(noise_sd=0.1), "steer_rad": Sensor(noise_sd=0.1), "lean_torque_N_m": Sensor(),
    "steer_torque_N_m": Sensor(),
})  # fmt: skip


def test_noise_is_that_of_the_seed_the_speed_and_the_channel():
    one = record_motion(response(), SENSORS, 7)
    assert list(one) == ["time_s", "roll_rate_rad_s", "steer_rad", "lean_torque_N_m", "steer_torque_N_m"]
    assert one["time_s"] == pytest.approx(np.arange(200) / 50)
    quiet = record_motion(response(), SENSORS)
    assert quiet["roll_rate_rad_s"] == pytest.approx(np.sin(one["time_s"]), abs=1e-6)
    assert set(one["lean_torque_N_m"]) == {0.0}
    assert set(one["steer_torque_N_m"]) == {1.0}

    def noise(seed, speed=5.0):
        made = record_motion(response(speed), SENSORS, seed)
        return np.array([made[name] - quiet[name] for name in ("roll_rate_rad_s", "steer_rad")])

    assert (noise(7) == noise(7)).all()
    for other in (noise(8), noise(7, 5.1), noise(7)[::-1]):
        assert abs(np.corrcoef(noise(7).ravel(), other.ravel())[0, 1]) < 0.2


def test_a_recording_needs_samples():
    with pytest.raises(InputError, match="19 samples at 50 Hz until 0.379 s are too few for a recording .at least 20"):
        record_motion(response(seconds=0.38), SENSORS)


@given(rate=st.floats(2.5, 2000.0), most=st.floats(1e-4, 0.1))
def test_every_recorded_sample_is_computed(rate, most):
    step = fine_step(Sensors(rate, {}), most)
    assert step <= most * (1 + 1e-9)
    assert 1 / (rate * step) == pytest.approx(round(1 / (rate * step)))
