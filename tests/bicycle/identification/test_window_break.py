"""Breaks within a window: a second kick, a step of a sensor, a spike; and what is unforeseen, by dense covariances."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle.identification.free_decay import identify
from bicycle.identification.run import Run
from bicycle.identification.window_break import Break, filtered, unforeseen

TIME = np.arange(0, 6, 0.01)
ROOT = complex(-0.8, 5.0)
STEER = 0.55 * np.exp(-0.4j)


def decay(rng, *, start=0.0, amplitude=0.5, phase=1.0):
    """Free motion from a ``start`` (s) on, in both channels."""
    wave = amplitude * np.exp(1j * phase + ROOT * np.clip(TIME - start, 0, None)) * (start <= TIME)
    return wave.real + 0.01 * rng.standard_normal(TIME.size), (STEER * wave).real + 0.005 * rng.standard_normal(
        TIME.size
    )


def run(roll, steer):
    return Run("ride.csv", 5.5, TIME, {"roll_rate_rad_s": roll, "steer_rad": steer}, {})


def test_what_is_unforeseen_is_that_of_the_dense_covariance():
    """Innovations are the samples turned by the inverse of the Cholesky factor of their covariance, in time order."""
    rng, step, n = np.random.default_rng(2), 0.05, 25
    modes, sizes = np.array([[-0.6, 4.0], [-1.5, 9.0]]), np.array([9.0, 4.0])
    seen = rng.standard_normal((2, 4))
    phasors = seen[:, ::2] - 1j * seen[:, 1::2]  # a Re z + b Im z = Re((a - i b) z)
    lag = step * (np.arange(n)[:, None] - np.arange(n))
    covariance = np.zeros((n, 2, n, 2))
    for k, (sigma, omega) in enumerate(modes):
        moved = sizes[k] * np.exp(sigma * np.abs(lag) + 1j * omega * lag)  # E z(t) conj(z(u))
        for a in range(2):
            for b in range(2):
                covariance[:, a, :, b] += (phasors[a, k] * phasors[b, k].conj() * moved).real / 2
    covariance = covariance.reshape(2 * n, 2 * n) + np.eye(2 * n)
    left = rng.multivariate_normal(np.zeros(2 * n), covariance)
    expected = np.linalg.solve(np.linalg.cholesky(covariance), left).reshape(n, 2)
    found = filtered(left.reshape(n, 2), seen, modes, sizes, step)
    assert found[:, 0] == pytest.approx(expected[:, 0], abs=1e-9)  # the first channel has no other before it


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


def test_a_kick_before_which_too_little_lies_is_told_all_the_same():
    rng = np.random.default_rng(6)
    both = np.array(decay(rng)) + np.array(decay(rng, start=0.4, amplitude=0.4, phase=2.2))
    channels = dict(zip(("roll_rate_rad_s", "steer_rad"), both[:, ::2], strict=True))
    found = identify(Run("ride.csv", 5.5, TIME[::2], channels, {}), last_s=3.0)  # 20 samples are needed before it
    assert found.broken.time_s == pytest.approx(0.4, abs=0.1)
    assert set(found.broken.shifts) == {"real part", "imaginary part", "steer_over_lean"}


def test_a_refusal_names_time_channel_and_what_moves():
    found = identify(run(*decay(np.random.default_rng(1))), thorough=False)
    whole = identify(run(*decay(np.random.default_rng(1))))
    assert not whole.rejected
    shifts = dict.fromkeys(("real part", "imaginary part", "steer_over_lean"), 0.0) | {"imaginary part": 0.4}
    broken = Break(2.345, 2.25, "steer_rad", 9.0, shifts, 4.25, "imaginary part", refused=True)
    assert replace(found, broken=broken).rejected == (
        "imaginary part moves by 4.25 sd (at most 3) when the window ends at 2.25 s, before steer_rad jumps: end it "
        "there"
    )
    assert replace(found, broken=replace(broken, refused=False)).rejected == ""


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
