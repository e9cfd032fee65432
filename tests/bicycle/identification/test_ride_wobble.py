"""Wobble of a ride: oscillators under coloured noise, whose poles are those of their matrix."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov

from bicycle.identification import Ride, Run, identify_wobble
from tyre.ground import InputError

WOBBLE = complex(-1.2, 2 * np.pi * 6.5)
WEAVE = complex(-2.5, 2 * np.pi * 1.8)
COLUMNS = ("roll_rate_rad_s", "yaw_rate_rad_s", "steer_rate_rad_s")


def sample(poles, *, seconds=200.0, rate=100.0, seed=1, noise=0.05):
    """Channels (3, n) of oscillators with these poles (1/s), moved by noise of first order; sampled exactly.

    x' = A x + B u, u' = -12 u + white. The covariance that a step adds is P - F P F', P the stationary one.
    """
    rng = np.random.default_rng(seed)
    size = 2 * len(poles) + 2
    matrix, drive = np.zeros((size, size)), np.zeros((size, 2))
    for k, pole in enumerate(poles):
        part = slice(2 * k, 2 * k + 2)
        matrix[part, part] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        matrix[part, -2:] = 10 * rng.normal(size=(2, 2))
    matrix[-2:, -2:] = -12 * np.eye(2)
    drive[-2:] = np.eye(2)
    stationary = solve_continuous_lyapunov(matrix, -drive @ drive.T)
    once = expm(matrix / rate)
    added = np.linalg.cholesky(stationary - once @ stationary @ once.T + 1e-13 * np.eye(size))
    count = round(seconds * rate)
    states = np.empty((count, size))
    state = np.linalg.cholesky(stationary) @ rng.normal(size=size)
    for k, kick in enumerate(rng.normal(size=(count, size)) @ added.T):
        states[k] = state
        state = once @ state + kick
    seen = rng.normal(size=(3, size)) @ states.T
    seen /= seen.std(axis=1, keepdims=True)
    return seen + noise * rng.normal(size=seen.shape)


def ride(signals, rate=100.0, cuts=1):
    """A ride at 9 m/s in ``cuts`` segments of one group."""
    runs = [
        Run(f"r#{k}", 9.0, np.arange(part.shape[1]) / rate, dict(zip(COLUMNS, part, strict=True)), {}, "9 m/s")
        for k, part in enumerate(np.array_split(signals, cuts, axis=1))
    ]
    return Ride("r.csv", tuple(runs), (), (), ("",) * cuts, ((9.0, 9.0),) * cuts)


@pytest.mark.parametrize(("rate", "cuts"), [(100.0, 1), (200.0, 3), (40.0, 5)])
def test_the_pole_is_within_its_interval_and_weave_is_not_given(rate, cuts):
    (wobble,) = identify_wobble(ride(sample([WEAVE, WOBBLE], rate=rate), rate, cuts))
    assert wobble.rejected == ""
    assert len(wobble.orders) >= 5
    error = wobble.eigenvalue - WOBBLE
    assert abs(error.real) < 3 * wobble.sd[0]
    assert abs(error.imag) < 3 * wobble.sd[1]
    # the least variance of decay and of frequency is decay / T: Fisher information of z' = pole z + white, z complex
    ideal = np.sqrt(-WOBBLE.real / 200)
    assert 0.5 * ideal < min(wobble.sd) <= max(wobble.sd) < 4 * ideal
    row = wobble.row()
    assert (row["mode"], row["speed_m_s"], row["imag_rad_s"]) == ("wobble", 9.0, wobble.eigenvalue.imag)


@pytest.mark.parametrize("poles", [[WEAVE], [WEAVE, complex(-30, 45)], [complex(-1, 2 * np.pi * 14)]])
def test_no_wobble_no_row(poles):
    (wobble,) = identify_wobble(ride(sample(poles, seed=4)))
    assert wobble.rejected


def test_of_two_poles_a_start_frequency_chooses():
    poles = [complex(-1.5, 2 * np.pi * 5), complex(-1.0, 2 * np.pi * 9)]
    both = ride(sample(poles, seed=5))
    (neither,) = identify_wobble(both)
    assert "--start-hz chooses one" in neither.rejected
    for pole, start_hz in zip(poles, (4.5, 9.5), strict=True):
        (wobble,) = identify_wobble(both, start_hz=start_hz)
        assert abs(wobble.eigenvalue.imag - pole.imag) < 4 * wobble.sd[1]


def test_a_steady_oscillation_is_no_decay():
    signals = sample([WEAVE], seed=6)
    signals[2] += np.sin(2 * np.pi * 7 * np.arange(signals.shape[1]) / 100)
    (wobble,) = identify_wobble(ride(signals))
    assert wobble.rejected


def test_too_short_too_slow_and_a_start_outside_the_band():
    signals = sample([WOBBLE], seconds=50)
    (short,) = identify_wobble(ride(signals))
    assert "50 s together, and 60 s are needed" in short.rejected
    (slow,) = identify_wobble(ride(signals, rate=20.0))
    assert "20 samples per second are recorded, and 30 are needed" in slow.rejected
    with pytest.raises(InputError, match="outside the band of wobble, 4 to 12 Hz"):
        identify_wobble(ride(signals), start_hz=2.0)


def test_speeds_are_identified_apart_and_in_order():
    fast = ride(sample([WOBBLE], seconds=80, seed=7))
    slow = replace(ride(sample([complex(-3, 30)], seconds=80, seed=8)).segments[0], speed=6.0, group="6 m/s")
    both = replace(fast, segments=(*fast.segments, slow))
    wobbles = identify_wobble(both)
    assert [wobble.speed for wobble in wobbles] == [6.0, 9.0]
    assert [round(wobble.eigenvalue.imag / 10) for wobble in wobbles] == [3, 4]
