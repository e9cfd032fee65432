"""Spectra of a ride against what is known of white noise, a resonator and a sine."""

import numpy as np
import pytest
from scipy import signal

from bicycle.identification import Run, bands_between, narrowest_band, ride_spectrum
from tyre.ground import InputError

STEP = 0.01  # s
A, B = "roll_rate_rad_s", "steer_rate_rad_s"


def run(**channels):
    length = len(next(iter(channels.values())))
    return Run("ride.csv", 6.0, STEP * np.arange(length), channels, {})


def spectrum(*runs, channels=(A, B), lowest=0.2, highest=15.0):
    durations = [r.step * len(r.time) for r in runs]
    bands = bands_between(lowest, highest, narrowest_band(durations))
    return ride_spectrum("ride", runs, channels, bands, speed=6.0)


def test_white_noise_has_twice_its_variance_times_the_step():
    rng = np.random.default_rng(62301)
    first, second = rng.normal(size=(2, 30_000))
    found = spectrum(run(**{A: first, B: 0.5 * first + second}))
    expected = 2 * STEP * np.array([[1.0, 0.5], [0.5, 1.25]])
    mean = np.average(found.values, axis=0, weights=found.averages)
    scatter = expected.max() / np.sqrt(found.averages.sum())
    assert np.abs(mean - expected).max() < 4 * scatter
    assert found.averages.min() >= 24


def test_a_resonator_shows_the_square_of_its_gain_times_the_noise():
    """x'' + 2 z w x' + w^2 x = u, sampled finely, driven by white noise; the model is averaged over each band."""
    w, z = 2 * np.pi * 5.0, 0.02
    rng = np.random.default_rng(62302)
    discrete = signal.cont2discrete(([1.0], [1.0, 2 * z * w, w**2]), STEP, "zoh")
    drive = rng.normal(size=200_000)
    x = signal.lfilter(discrete[0].ravel(), discrete[1], drive)
    found = spectrum(run(**{A: x, B: rng.normal(size=x.size)}), highest=12.0)
    turn = np.exp(2j * np.pi * found.nodes * STEP)
    gain = np.polyval(discrete[0].ravel(), turn) / np.polyval(discrete[1], turn)
    expected = 2 * STEP * (np.abs(gain) ** 2 @ found.weights)
    ratio = found.values[:, 0, 0].real / expected
    assert np.mean(found.averages * (ratio - 1) ** 2) < 1.6  # 1 +- 0.2 for independent averages


@pytest.mark.parametrize("place", np.linspace(5.9, 6.1, 5))
def test_the_mean_over_a_band_is_that_of_a_sharp_resonance(place):
    """A damping ratio of 0.5 % wherever in its band, against a sum over 20,001 frequencies."""
    noise = np.random.default_rng(62304).normal(size=(2, 30_000))
    found = spectrum(run(**{A: noise[0], B: noise[1]}))

    def density(hertz):
        return 1 / ((1 - (hertz / place) ** 2) ** 2 + (0.01 * hertz / place) ** 2)

    reach = (found.nodes[:, -1] - found.nodes[:, 0]) / 2 / np.polynomial.legendre.leggauss(found.nodes.shape[1])[0][-1]
    even = found.hertz[:, None] + reach[:, None] * np.linspace(-1, 1, 20_001)
    np.testing.assert_allclose(density(found.nodes) @ found.weights, density(even).mean(1), rtol=0.03)


def test_pieces_are_averaged_and_a_trend_is_no_motion():
    rng = np.random.default_rng(62303)
    pieces = [run(**{A: rng.normal(size=800) + 0.01 * np.arange(800), B: rng.normal(size=800)}) for _ in range(20)]
    found = spectrum(*pieces)
    assert found.duration == pytest.approx(160.0)
    assert np.average(found.values[:, 0, 0].real, weights=found.averages) == pytest.approx(2 * STEP, rel=0.1)


def test_too_few_averages_for_the_channels_are_refused():
    short = run(**{A: np.random.default_rng(1).normal(size=400), B: np.random.default_rng(2).normal(size=400)})
    bands = bands_between(1.0, 10.0, 0.5)
    with pytest.raises(InputError, match="1 averages of a band are too few for 2 channels, which need 4"):
        ride_spectrum("ride", [short], (A, B), bands, speed=6.0)


def test_bands_leave_no_gap():
    bands = bands_between(0.2, 15.0, 0.1)
    edges = bands.middle - bands.width / 2
    assert edges[0] == pytest.approx(0.2)
    assert edges[1:] == pytest.approx((bands.middle + bands.width / 2)[:-1])
    assert (bands.middle + bands.width / 2)[-1] <= 15.0
