"""Breaks within a window: a second kick, a step of a sensor, a spike; and what is unforeseen, by dense covariances."""

import numpy as np
import pytest

from bicycle.identification import Run, identify, unforeseen

TIME = np.arange(0, 6, 0.01)
ROOT = complex(-0.8, 5.0)
STEER = 0.55 * np.exp(-0.4j)


def decay(rng, *, start=0.0, amplitude=0.5, phase=1.0):
    """Free motion from a ``start`` (s) on, in both channels."""
    wave = amplitude * np.exp(1j * phase + ROOT * np.clip(TIME - start, 0, None)) * (start <= TIME)
    roll = wave.real + 0.01 * rng.standard_normal(TIME.size)
    return roll, (STEER * wave).real + 0.005 * rng.standard_normal(TIME.size)


def run(roll, steer):
    return Run("ride.csv", 5.5, TIME, {"roll_rate_rad_s": roll, "steer_rad": steer}, {})


@pytest.mark.parametrize("seed", range(3))
def test_a_sound_window_has_no_break(seed):
    found = identify(run(*decay(np.random.default_rng(seed))))
    assert found.broken is None
    left = unforeseen(found.estimate)
    assert left.std() == pytest.approx(1, abs=0.15)
    assert np.abs(left).max() < 4.5


def test_a_second_kick_is_told_and_refused_where_it_moves_the_mode():
    rng = np.random.default_rng(4)
    both = np.array(decay(rng)) + np.array(decay(rng, start=2.3, amplitude=0.4, phase=2.2))
    found = identify(run(*both), first_s=0.5)
    assert found.broken.time_s == pytest.approx(2.3, abs=0.1)
    assert found.broken.size > 5
    assert found.broken.until_s < 2.3
    until = identify(run(*both), first_s=0.5, last_s=found.broken.until_s)
    assert until.broken is None
    assert abs(until.eigenvalue - ROOT) < 3 * max(until.sd)
    far = abs(found.eigenvalue - ROOT)
    assert found.rejected or far < 3 * max(found.sd)


def test_a_spike_before_which_too_little_lies_is_told_all_the_same():
    roll, steer = decay(np.random.default_rng(6))
    roll[36:38] += 0.3
    channels = {"roll_rate_rad_s": roll[::2], "steer_rad": steer[::2]}
    found = identify(Run("ride.csv", 5.5, TIME[::2], channels, {}), last_s=3.0)  # 20 samples are needed before it
    assert found.broken.time_s == pytest.approx(0.36, abs=0.1)
    assert set(found.broken.shifts) == {"real part", "imaginary part", "steer_over_lean"}


def test_a_step_of_a_sensor_widens_the_ratio_to_where_the_truth_is():
    roll, steer = decay(np.random.default_rng(5))
    found = identify(run(roll, steer + 0.03 * (TIME > 1.7)))
    assert found.broken.channel == "steer_rad"
    assert found.broken.time_s == pytest.approx(1.7, abs=0.1)
    sound = identify(run(roll, steer))
    value, sd = found.ratios["steer_over_lean"]
    truth = ROOT * STEER
    assert sd > sound.ratios["steer_over_lean"][1]
    assert max(abs((value - truth).real), abs((value - truth).imag)) < 3 * sd
