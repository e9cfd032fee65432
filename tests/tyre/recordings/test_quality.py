"""What is seen in the samples of a channel: its step, and values that stay where a live sensor would move."""

import numpy as np
import pytest

from tyre.recordings import quality, resolution


@pytest.mark.parametrize("step", [0.02, 3.0])
def test_the_step_of_a_converter_is_found_and_noise_has_none(step):
    rng = np.random.default_rng(1)
    counts = rng.integers(-400, 400, 500)
    assert resolution(1.7 + step * counts) == pytest.approx(step, rel=1e-6)
    assert resolution(step * rng.normal(size=500)) == 0.0
    assert resolution(step * np.array([0.0, 1.0, 2.0, 3.5, 4.5, 6.0])) == 0.0  # multiples but for a half


def test_a_clipped_channel_is_saturated_at_the_samples_that_it_cuts():
    t = np.arange(2000) / 100.0
    wave = 10.0 * np.sin(t) + np.random.default_rng(2).normal(0.0, 1e-3, t.size)
    found = quality(np.clip(wave, None, 8.0))
    assert found.held_high == np.count_nonzero(wave >= 8.0)
    assert (found.held_low, found.frozen) == (0, 0)
    assert f"{found.held_high} samples stay at its highest value 8: saturated?" in found.remarks


def test_a_slow_sensor_in_a_fast_file_is_neither_saturated_nor_frozen():
    """Every value stands ten times, the extreme ones as well."""
    found = quality(np.repeat(np.random.default_rng(3).normal(size=200), 10))
    assert (found.held_low, found.held_high, found.frozen) == (0, 0, 0)


@pytest.mark.parametrize(("held", "said"), [(400, 400), (600, 0)])
def test_a_value_that_holds_for_most_of_the_time_is_a_set_value(held, said):
    rng = np.random.default_rng(4)
    values = np.concatenate([np.full(held, 2.5), rng.uniform(0.5, 2.0, 1000 - held)])
    assert quality(values).held_high == said


def test_gaps_of_a_hundred_steps_do_not_hide_the_step():
    """The last gap ends half a step beside the grid: noticed up to that many steps, beyond it no longer."""
    steps = 100.0
    grid = np.arange(20.0)
    assert resolution(0.1 * np.append(grid, 19.0 + steps - 0.5)) == 0.0
    assert resolution(0.1 * np.append(grid, 19.0 + steps + 0.5)) == pytest.approx(0.1)


def test_rounding_of_printed_numbers_is_no_step():
    assert resolution(np.append(np.arange(40) / 10, np.arange(40) * 0.1)) == pytest.approx(0.1)


@pytest.mark.parametrize(("places", "length", "value", "words"), [
    ((100, 700, 1500), 5, 0.0, "3 dropouts to 0, 15 samples, the first from sample 101"),
    ((50, 900), 1, -9999.0, "2 dropouts to -9999, 2 samples, the first from sample 51"),
    ((400,), 200, 0.0, "1 dropout to 0, 200 samples, the first from sample 401"),
])  # fmt: skip
def test_dropouts_are_named(places, length, value, words):
    x = 400 + np.random.default_rng(0).normal(0, 2, 2000)
    for place in places:
        x[place : place + length] = value
    assert words in quality(x).remarks


def test_a_signal_that_passes_zero_or_rests_has_no_dropouts():
    rng, time = np.random.default_rng(0), np.arange(2000) / 100
    for x in (
        np.round(5 * np.sin(9 * time) + rng.normal(0, 0.02, 2000), 2),
        np.round(3 * np.sin(60 * time), 1),
        np.clip(np.sin(9 * time), -0.6, 0.6),
        np.where(time < 5, 0.0, 400 + rng.normal(0, 2, 2000)),
    ):
        assert not quality(x).dropouts


def test_spikes_of_one_sample_are_counted():
    """They stay within the range of the wave: a far end of the range would be a dropout."""
    force = 40 * np.sin(np.arange(2000) / 60) + np.random.default_rng(6).normal(0.0, 1.0, 2000)
    force[[188, 565, 942]] += np.array([30.0, -30.0, 25.0])  # where the wave crosses zero
    assert quality(force).spikes == 3
    assert "3 spikes of one sample" in quality(force).remarks
    force[[565, 942]] -= np.array([-30.0, 25.0])
    assert "1 spike of one sample" in quality(force).remarks
