"""Decays in loud noise: taken where an oscillation is clear and the rest is noise. All SYNTHETIC."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle.identification import Run, identify, log_odds_of_any

ROOT = complex(-0.8, 5.0)
TIME = np.arange(0, 4.0, 0.01)


def run(rng: np.random.Generator, *, noise: float, kept: float = 0.0, other: np.ndarray | float = 0.0) -> Run:
    """A decay of amplitude 1 in both channels; autoregressive ``noise`` of that sd and coefficient ``kept``."""
    wave = np.exp(ROOT * TIME)
    white = rng.standard_normal((TIME.size, 2))
    for k in range(1, TIME.size):
        white[k] = kept * white[k - 1] + np.sqrt(1 - kept**2) * white[k]
    channels = {
        "roll_rate_rad_s": wave.real + noise * white[:, 0] + other,
        "steer_rate_rad_s": (wave * (1 - 0.5j)).real + noise * white[:, 1] + other,
    }
    return Run("loud.csv", 5.0, TIME, channels, {})


@pytest.mark.parametrize("noise", [0.5, 0.8])
def test_a_clear_decay_is_taken_however_loud_its_noise(noise):
    for seed in range(3):
        found = identify(run(np.random.default_rng(seed), noise=noise), thorough=False)
        assert found.r_squared < 0.8
        assert found.rejected == ""
        assert abs(found.eigenvalue.real - ROOT.real) < 3 * found.sd[0]
        assert abs(found.eigenvalue.imag - ROOT.imag) < 3 * found.sd[1]
        assert max(found.sd) > noise * 0.1  # louder noise is known less well, not refused


@pytest.mark.parametrize("kept", [0.0, 0.9])
def test_noise_alone_is_no_oscillation_though_one_can_be_fitted_to_it(kept):
    for seed in range(4):
        noisy = run(np.random.default_rng(seed), noise=1e4, kept=kept)
        found = identify(noisy, start_hz=2.0, thorough=False)
        assert found.estimate is not None
        assert found.r_squared < 0.8
        assert "an oscillation on top of drift and noise has odds of" in found.rejected
        assert found.rejected.endswith(": 1 (at least 20)")


def test_another_motion_is_no_noise():
    """A steering movement of the rider that no mode and no drift is: a pulse in the middle."""
    found = identify(
        run(np.random.default_rng(1), noise=0.05, other=2 * np.exp(-(((TIME - 2.5) / 0.15) ** 2))), thorough=False
    )
    assert found.r_squared < 0.8
    assert "is below 0.8, and the residuals are not noise (p " in found.rejected
    assert found.rejected.endswith("another or a driven motion is too large")


def test_louder_noise_leaves_smaller_odds_whatever_the_units():
    odds = []
    for noise in (0.5, 1.0, 2.0):
        plain = run(np.random.default_rng(2), noise=noise)
        other = replace(plain, channels={name: 57.3 * x for name, x in plain.channels.items()})
        one, two = (log_odds_of_any(identify(each, thorough=False).estimate) for each in (plain, other))
        assert one == pytest.approx(two, abs=1e-3)
        odds.append(one)
    assert odds[0] > odds[1] + 5 > odds[2] + 10
