"""The disturbed slip steps against what is known of their equations, and some of them through the fit."""

import numpy as np
import pytest

from tests.validation.disturbed_steps import RATE, behind_play, lagging_slip, one_step


def test_the_lag_is_that_of_a_step_and_of_a_ramp():
    """1 - exp(-x / length) after a step, and so far behind a ramp as the length says."""
    speed = np.full(2000, 0.5)
    way = 0.5 * np.arange(2000) / RATE
    step = lagging_slip(np.where(way > 0, 1.0, 0.0), speed, 0.1)
    np.testing.assert_allclose(step[1:], 1 - np.exp(-(way[1:] - 0.5 * way[1]) / 0.1), atol=1e-4)
    np.testing.assert_allclose(lagging_slip(way, speed, 0.1)[-1], way[-1] - 0.1, rtol=1e-8)


def test_play_is_taken_up_before_the_wheel_turns():
    driven = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101)])
    wheel = behind_play(driven, 0.2)
    assert (wheel[5], wheel[100], wheel[115], wheel[-1]) == pytest.approx((0, 0.9, 0.9, 0.1))


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_interval_holds_the_length_on_a_disturbed_rig(number):
    row = one_step(2026, number)
    assert row["error"] is None
    assert row["disturbed"]["held"], row
    assert row["clean"]["held"], row
    assert row["disturbed"]["relative_sd"] < 0.1
