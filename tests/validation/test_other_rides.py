"""Rides of the second kind obey mechanics, and their inputs have the spectra that are said."""

import numpy as np
import pytest

from tests.validation.other_rides import SAMPLE, STEP, coloured, draw_other_rides, holds, march, pulses, von_karman
from tests.validation.ride_bicycle import INPUTS, draw_bicycle
from tests.validation.ride_forces import run
from tests.validation.ride_generator import Rider, close_loop
from tyre.ground import InputError


@pytest.fixture(scope="module")
def taken():
    return draw_other_rides(np.random.default_rng(6411), [6.0], base="benchmark", duration=20.0, spread=0.0)[0]


def test_forces_accelerate_the_whole(taken):
    mass = taken.leg.bicycle.motion(6.0).mass
    forces = sum(taken.truth[name] for name in ("rear_lateral_force", "front_lateral_force", "side_force"))
    np.testing.assert_allclose(forces, mass * taken.truth["mass_centre_acceleration"], atol=1e-6)
    assert np.std(forces) > 1


def test_the_lean_is_the_integral_of_the_roll_rate(taken):
    lean, rate = taken.truth["lean"], taken.truth["roll_rate"]
    summed = SAMPLE * np.cumsum((rate[1:] + rate[:-1]) / 2)
    np.testing.assert_allclose(lean[1:] - lean[0], summed, atol=0.02 * np.ptp(lean))


def test_turbulence_has_the_variance_of_its_spectrum():
    hertz = np.fft.rfftfreq(2**17, STEP)
    assert np.trapezoid(von_karman(hertz, 0.5), hertz) == pytest.approx(1, abs=0.02)
    wind = coloured(von_karman(hertz, 0.5), 2**17, np.random.default_rng(6402))
    assert np.var(wind) == pytest.approx(1, abs=0.2)
    power = np.abs(np.fft.rfft(wind)) ** 2
    low, high = ((hertz > first) & (hertz < 1.5 * first) for first in (5.0, 50.0))
    assert power[low].mean() / power[high].mean() == pytest.approx(10 ** (5 / 3), rel=0.3)


def test_pulses_come_at_their_rate():
    signal = pulses(0.8, round(500 / STEP), np.random.default_rng(6403))
    assert np.mean(signal != 0) == pytest.approx(1 - np.exp(-0.8 * 0.35), abs=0.05)


def test_a_rider_who_hardly_answers_leaves_the_bicycle_as_it_is():
    """Without gains the march is that of the state matrix: x(t) = exp(A t) x(0), here by eigenvalues."""
    motion = draw_bicycle(np.random.default_rng(6404), spread=0.0).motion(6.0)
    nobody = Rider((0.0,) * 4, (0.05, 0.02))
    states, _ = march(motion, nobody, np.zeros((1, len(INPUTS), round(1 / STEP))))
    values, vectors = np.linalg.eig(motion.matrix)
    begin = np.eye(len(motion.matrix))[motion.states.index("lean")]
    later = vectors @ (np.exp(values * SAMPLE * 99) * np.linalg.solve(vectors, begin))
    np.testing.assert_allclose(states[99, 0], later.real, atol=1e-8)


def test_a_rider_answers_after_the_delay():
    """With a short delay the march is the loop of two lags, whose first lag is as short."""
    motion = draw_bicycle(np.random.default_rng(6405), spread=0.0).motion(6.0)
    rider = Rider((8.0, 4.0, 0.0, -1.0), (0.01, 0.05))
    states, _ = march(motion, rider, np.zeros((1, len(INPUTS), round(0.5 / STEP))))
    loop = close_loop(motion, {}, rider)
    once = loop.sampled(0.49)[0]
    begin = np.zeros(len(loop.matrix))
    begin[motion.states.index("lean")] = 1.0
    expected = (once @ begin)[: len(motion.matrix)]
    np.testing.assert_allclose(states[49, 0], expected, atol=0.03 * np.abs(expected).max())


def test_riders_who_do_not_hold_the_bicycle_are_not_drawn(taken):
    motion = taken.leg.bicycle.motion(6.0)
    assert holds(motion, taken.leg.rider)
    assert not holds(motion, Rider((-200.0, 0.0, 0.0, 0.0), (0.05, 0.02)))


def test_an_estimator_that_needs_spectra_refuses_them(tmp_path):
    with pytest.raises(InputError, match="known spectra"):
        run(out=tmp_path, seed=1, rides=1, estimator="ideal", style="other")
