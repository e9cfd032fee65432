"""Where a torque jumps, and the functions that let a steer angle follow it. SYNTHETIC."""

import numpy as np
import pytest

from studies.diagnosis import torque_jumps

ASIDE, CLEAR = 6, 6.0  # samples to each side of a step, and the sd of one that is clear
TIME = 0.01 * np.arange(400)
SMOOTH = 2.0 * np.sin(2 * np.pi * 0.9 * TIME) + np.sin(2 * np.pi * 2.3 * TIME + 1)


@pytest.mark.parametrize("seed", range(20))
def test_noise_and_a_smooth_torque_do_not_jump(seed):
    assert torque_jumps(TIME, SMOOTH + 0.05 * np.random.default_rng(seed).standard_normal(400)) == ()


def test_steps_are_found_between_the_samples_also_near_each_other_and_with_either_sign():
    steps = {150: 2.0, 153: -1.5, 300: -0.8}
    torque = SMOOTH + 0.03 * np.random.default_rng(1).standard_normal(400)
    for place, size in steps.items():
        torque[place:] += size
    assert torque_jumps(TIME, torque) == pytest.approx([TIME[k] - 0.005 for k in steps])


def test_a_push_that_a_controller_answers_has_two_steps():
    """Its samples fall by 0.8 N m each, and rise by 0.1 after it: five steps were seen, and the fit went astray."""
    torque = SMOOTH + 0.03 * np.random.default_rng(1).standard_normal(400)
    torque[150:155] += 20 - 0.8 * np.arange(5)
    torque[155:] -= 4 * np.exp(-(np.arange(245) * 0.01) / 0.4)
    assert sorted(torque_jumps(TIME, torque)) == pytest.approx([1.495, 1.545])


def test_without_noise_a_line_does_not_jump_and_a_step_does():
    line = 3.0 - 0.7 * TIME
    assert torque_jumps(TIME, line) == ()
    assert torque_jumps(TIME, line + 0.1 * (TIME > 1.0049)) == pytest.approx([1.005])


def test_a_run_that_is_too_short_has_none_and_a_longer_one_few():
    assert torque_jumps(TIME[: 2 * ASIDE - 1], np.sign(TIME[: 2 * ASIDE - 1] - 0.05)) == ()
    random = np.random.default_rng(3).choice([-1.0, 1.0], 40).repeat(10)
    assert 10 < len(torque_jumps(TIME, random)) <= 400 // 12


def test_a_step_below_the_threshold_is_none():
    """Its sd is that of the step of a cubic and a step, fitted to white noise of known sd by least squares."""
    u = np.linspace(-1, 1, 2 * ASIDE)
    design = np.column_stack([u > 0, *(u**k for k in range(4))])
    sd = 0.05 * np.sqrt(np.linalg.inv(design.T @ design)[0, 0])
    noise = 0.05 * np.random.default_rng(5).standard_normal(400)
    for share, found in ((0.4, 0), (2.0, 1)):
        assert len(torque_jumps(TIME, SMOOTH + noise + share * CLEAR * sd * (TIME > 2.0))) == found
