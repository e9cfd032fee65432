"""Taps on a front whose hinge rubs: SYNTHETIC, one oscillator with dry friction, exact from turning point to next."""

import math

import numpy as np
import pytest

from bicycle.standing import Place, Readings, TapRecording, identify_taps

OMEGA, RATIO = 2 * math.pi * 16.0, 0.03  # rad/s, 1
PLACES = {"hub_lateral_m_s2": Place(0.0), "stem_lateral_m_s2": Place(0.6, "fork")}


def acceleration(time, friction, amplitude=1.0):
    """Of x'' + 2 zeta w x' + w^2 x = -w^2 f sign(x') from rest at ``amplitude``; ``friction`` f as a displacement."""
    fast = OMEGA * math.sqrt(1 - RATIO**2)
    half = math.pi / fast
    x, sign, moved = amplitude, -1.0, np.zeros_like(time)
    for k in range(math.ceil(time[-1] / half)):
        if abs(x) <= friction:
            break  # it sticks
        off = -sign * friction
        inside = (time >= k * half) & (time < (k + 1) * half)
        t = time[inside] - k * half
        decay = (x - off) * np.exp(-RATIO * OMEGA * t)
        away = decay * (np.cos(fast * t) + RATIO * OMEGA / fast * np.sin(fast * t))
        rate = -decay * OMEGA**2 / fast * np.sin(fast * t)
        moved[inside] = -2 * RATIO * OMEGA * rate - OMEGA**2 * away
        x = off - (x - off) * math.exp(-RATIO * OMEGA * half)
        sign = -sign
    return moved


def tap(friction):
    """What one recorded tap gives."""
    rng = np.random.default_rng([6115, round(1000 * friction)])
    time = np.arange(0.0, 1.2, 1 / 400)
    signal = 3.0 * acceleration(np.maximum(time - 0.15, 0.0), friction) / OMEGA**2
    signal[time < 0.15] = 0.0
    channels = {name: scale * signal + 0.03 * rng.standard_normal(len(time))
                for name, scale in zip(PLACES, (1.0, -0.9), strict=True)}  # fmt: skip
    (found,) = identify_taps([TapRecording("tap", time, channels)], PLACES)
    return found


def test_dry_friction_is_noticed_and_widens_the_damping():
    """Friction f adds 2 f / (pi A) to the damping ratio at the amplitude A."""
    found = tap(0.015)
    change = Readings((), (found,)).change
    assert change is not None
    first, halved = (RATIO + 2 * 0.015 / (math.pi * amplitude) for amplitude in (1.0, 0.5))
    assert first < change.early < halved < change.late
    assert abs(found.damping_ratio - RATIO) < 1.96 * found.damping_ratio_sd


def test_a_viscous_decay_has_one_damping_ratio():
    found = tap(0.0)
    assert Readings((), (found,)).change is None
    assert found.damping_ratio == pytest.approx(RATIO, abs=4 * found.damping_ratio_sd)
    assert found.damping_ratio_sd < 0.05 * RATIO


def test_a_tap_that_has_not_halved_when_the_recording_ends_is_read():
    """20 Hz at a damping ratio of 0.05 % halve in 11 s; whether damping changes after that cannot be told from 4 s."""
    time, turn = np.arange(0, 4, 0.0025), 2 * np.pi * 20
    noise = np.random.default_rng(6406).normal(0, 0.02, (2, len(time)))
    decay = np.exp(-0.0005 * turn * time) * np.sin(turn * time)
    signals = {"hub_lateral_m_s2": 5 * decay + noise[0], "stem_lateral_m_s2": 2 * decay + noise[1]}
    places = {"hub_lateral_m_s2": Place(0.0), "stem_lateral_m_s2": Place(0.6, "fork")}
    (tap,) = identify_taps([TapRecording("tap", time, signals)], places)
    assert tap.change is None
    assert tap.frequency_hz == pytest.approx(20, rel=1e-4)
    assert tap.damping_ratio == pytest.approx(0.0005, rel=0.01)
    assert tap.ratios[0].value == pytest.approx(0.4, rel=0.01)
