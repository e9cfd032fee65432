"""What is a signal of lines, and the response at its lines, against white noise by hand."""

import numpy as np
import pytest

from bicycle.identification import line_response, lines_of, weights


@pytest.mark.parametrize(("share", "lines"), [(0.0475, [1.37]), (0.0525, [])])
def test_up_to_a_twentieth_of_the_power_may_lie_outside_of_the_lines(share, lines):
    t, v = np.arange(6000) * 0.01, weights(6000)
    sine, noise = np.sin(2 * np.pi * 1.37 * t), np.random.default_rng(1).standard_normal(6000)
    noise *= np.sqrt(share / (1 - share) * (v @ sine**2) / (v @ noise**2))
    assert lines_of(sine + noise, 0.01) == pytest.approx(lines, abs=1e-3)


@pytest.mark.parametrize(("share", "lines"), [(0.97, [1.37]), (1.03, [1.37, 3.9])])
def test_a_line_beside_one_a_hundred_times_as_strong_is_found_down_to_a_ten_thousandth_of_the_power(share, lines):
    least = 1e-4  # of the power: fainter lines are not looked for
    t, v = np.arange(6000) * 0.01, weights(6000)
    strong, faint = (np.sin(2 * np.pi * hertz * t) for hertz in (1.37, 3.9))
    faint *= np.sqrt(share * least / (1 - share * least) * (v @ strong**2) / (v @ faint**2))
    assert lines_of(strong + faint, 0.01) == pytest.approx(lines, abs=1e-4)


def test_the_sd_of_a_line_is_that_of_white_noise_widened_as_students_t_is():
    """Under a Hann window a number of one line has the variance 2 * 1.5 s^2 / k; t of 16 numbers has 16 / 14.

    The sum of squares of 16 numbers has the relative sd sqrt(2 / 16); neighbours two bins apart share a little.
    """
    rng, k, s, hertz = np.random.default_rng(1), 1000, 0.5, np.arange(2.0, 46.0, 2.0)
    angle, variance, error = 2 * np.pi * np.outer(np.arange(k) * 0.01, hertz), [], []
    for _ in range(40):
        u = np.cos(angle + rng.uniform(0, 2 * np.pi, len(hertz))).sum(1)
        found = line_response(hertz, u, 2 * u + s * rng.standard_normal(k), 0.01)
        variance.append(found.variance)
        error.append(found.gain - 2)
    white = 2 * 1.5 * s**2 / k
    assert np.mean(variance) == pytest.approx(white * 16 / 14, rel=0.06)
    assert np.mean(np.abs(error) ** 2) / 2 == pytest.approx(white, rel=0.1)
    assert np.std(variance) / np.mean(variance) == pytest.approx(np.sqrt(2 / 16), rel=0.15)
