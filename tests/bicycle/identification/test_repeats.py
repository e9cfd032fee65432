"""Repeats: what counts as one, the sd they ask for, a law in speed, and one run that is far off."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle.identification import OWN_LINE, about_one_speed, repeats, surprise

NEAR = (4.96, 4.99, 5.01)


def test_speeds_within_five_per_cent_are_repeats():
    assert about_one_speed([5.01, 4.99, 6.0, 4.96]) == ((3, 1, 0), (2,))
    assert about_one_speed([4.0, 4.19, 4.21]) == ((0, 1), (2,))  # 5 % of the slowest, no chain
    assert about_one_speed([]) == ()
    dense = np.arange(4.0, 6.01, 0.1).tolist()  # neighbours differ by less than 3 %: 4.0, 4.3, 4.6, 4.9, 5.2, 5.5, 5.8
    assert [round(dense[group[0]], 1) for group in about_one_speed(dense)] == [4.0, 4.3, 4.6, 4.9, 5.2, 5.5, 5.8]


def test_three_repeats_that_scatter_five_times_as_much_as_their_fits_say():
    found = repeats(NEAR, [-1.25, -1.0, -0.75], [0.05] * 3)
    assert found.freedom == 2
    assert found.count(0) == 3
    assert found.scatter == pytest.approx(0.25)
    assert found.sd == pytest.approx(0.25 * 4.303 / 1.96, rel=0.01)  # Student's t of two degrees of freedom


def test_repeats_that_scatter_as_stated_leave_the_sd_alone():
    assert repeats(NEAR, [-1.05, -1.0, -0.95], [0.05] * 3).sd == pytest.approx(0.05)


def test_repeats_that_agree_within_their_own_sd_say_nothing_of_a_speed_without():
    found = repeats([7.5, 7.5, 8.5], [-2.233, -2.161, -2.189], [0.017, 0.267, 0.015])
    assert found.sd.tolist() == [0.017, 0.267, 0.015]
    assert repeats([7.5, 7.5, 8.5], [-2.233, -2.0, -2.189], [0.017, 0.016, 0.015]).sd[2] > 0.05


def test_what_repeats_leave_is_weighed_by_their_sd():
    total, freedom = surprise([5.0, 5.0, 5.0], [1.0, 1.3, 1.0], [0.1, 0.4, 0.2], tolerance=0.05)
    mean = (1.0 / 0.01 + 1.3 / 0.16 + 1.0 / 0.04) / (1 / 0.01 + 1 / 0.16 + 1 / 0.04)
    assert total == pytest.approx(((1 - mean) / 0.1) ** 2 + ((1.3 - mean) / 0.4) ** 2 + ((1 - mean) / 0.2) ** 2)
    assert freedom == 2


def test_without_repeats_nothing_is_known_of_the_scatter():
    found = repeats([4.0, 5.0, 6.0], [-0.2, -1.0, -2.0], [0.1, 0.2, 0.3])
    assert found.freedom == 0
    assert np.isnan(found.scatter).all()
    assert found.sd == pytest.approx([0.1, 0.2, 0.3])


def test_a_law_in_speed_is_not_scatter():
    speeds = np.array([4.0, 4.1, 5.0, 5.1, 6.0, 6.1])
    assert repeats(speeds, -2.0 * speeds, [0.01] * 6).sd == pytest.approx(0.01)


def test_neighbouring_speeds_with_a_bent_law_between_them_are_not_scatter():
    """Speeds 3 % apart, of which the line between groups says the wrong slope."""
    speeds = np.array([4.7, 5.0, 5.15, 5.7, 7.4, 7.6, 9.0])
    found = repeats(speeds, 20 / (speeds - 4.5), [0.01] * 7)
    assert found.freedom == 0
    assert found.sd == pytest.approx(0.01)


def test_one_kick_far_off_is_widened_alone():
    rng = np.random.default_rng(5)
    speeds = np.repeat([4.0, 5.0, 6.0], 5)
    values = rng.normal(0, 0.1, 15)
    clean = repeats(speeds, values, [0.1] * 15)
    values[7] += 2.0
    found = repeats(speeds, values, [0.1] * 15)
    assert clean.aside == ()
    assert found.aside == (7,)
    assert found.sd[7] > 1.5
    assert np.delete(found.sd, 7) == pytest.approx(np.delete(clean.sd, 7), rel=0.25)


def test_one_run_in_eight_may_be_set_aside():
    values = np.random.default_rng(5).normal(0, 0.1, 16)
    values[[3, 6]] += [3.0, 2.0]
    assert sorted(repeats(np.repeat([4.0, 5.0, 6.0, 7.0], 4), values, [0.1] * 16).aside) == [3, 6]


def test_a_speed_that_scatters_more_has_its_own_sd():
    rng = np.random.default_rng(2)
    speeds = np.repeat([4.0, 6.0], 12)
    values = rng.normal(0, np.repeat([0.05, 0.5], 12))
    found = repeats(speeds, values, [0.05] * 24)
    assert found.sd[0] < 0.6 * found.sd[12]


@settings(max_examples=40)
@given(st.lists(st.floats(-5, 5), min_size=1, max_size=12), st.floats(0.01, 1))
def test_the_sd_never_falls_below_the_stated_one(values, stated):
    speeds = 4 + 0.5 * (np.arange(len(values)) // 3)
    assert (repeats(speeds, values, [stated] * len(values)).sd >= stated * (1 - 1e-9)).all()


def test_intervals_hold_a_law_with_and_without_an_outlier():
    """Three speeds, three runs each (synthetic); sampling error of a share of 1200: 0.6 %."""
    rng = np.random.default_rng(3)
    for far in (0.0, 2.0):
        held = []
        for _ in range(150):
            speeds = np.repeat([4.0, 5.0, 6.0], 3) * rng.uniform(0.99, 1.01, 9)
            truth = -1 - 0.4 * speeds
            values = truth + rng.normal(0, 0.25, 9)
            values[4] += far
            inside = np.abs(values - truth) < 1.96 * repeats(speeds, values, np.full(9, 0.05)).sd
            held += np.delete(inside, 4).tolist()
        assert 0.93 < np.mean(held) < 0.995


@pytest.mark.parametrize(("spread", "alone"), [(0.8 * OWN_LINE, True), (1.8 * OWN_LINE, False)])
def test_a_run_far_off_is_widened_alone_where_four_degrees_of_freedom_show_it(spread, alone):
    """Two speeds of three runs each: four degrees of freedom about levels, two about lines of their own."""
    speeds = np.concatenate([v * (1 + spread * np.array([0.0, 0.5, 1.0])) for v in (4.6, 5.5)])
    values = 2.0 * speeds + 0.01 * np.array([1.0, -1.0, 0.5, 0.3, 0.0, -0.7])
    values[4] += 0.4
    found = repeats(speeds, values, np.full(6, 0.01))
    assert found.aside == ((4,) if alone else ())
    assert found.sd[4] > 0.3
    assert (found.sd[[3, 5]].max() < 0.05) == alone
