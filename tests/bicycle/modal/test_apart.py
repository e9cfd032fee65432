"""Whether roots meet inside a step, against discriminants that are known in all of it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bicycle.modal.apart import keep_apart


def kept(square, slope, width=1.0):
    """Answer for two real roots about -2 whose squared distance is ``square`` (s), with that ``slope``, s from 0 to 1.

    A third one at -9 keeps away.
    """
    half = [np.sqrt(square(s)) / 2 for s in (0.0, 1.0)]
    rise = [slope(s) / (8 * x) for s, x in zip((0.0, 1.0), half, strict=True)]
    a, z = (np.array([[-2 + x, -2 - x, -9]], complex) for x in half)
    rise_a, rise_z = (np.array([[x, -x, 0]], complex) for x in rise)
    return bool(keep_apart(a, z, rise_a, rise_z, np.ones((1, 3), bool))[0])


@given(st.floats(0.05, 0.9), st.floats(0.02, 0.5))
def test_two_real_roots_that_are_a_pair_for_a_moment_do_not_keep_apart(first, lasting):
    last = first + lasting * (0.95 - first)
    assert not kept(lambda s: (s - first) * (s - last), lambda s: 2 * s - first - last)


@given(st.floats(0.05, 0.95), st.floats(0.1, 2.0))
def test_two_real_roots_that_only_come_near_keep_apart(nearest, square):
    assert kept(lambda s: (s - nearest) ** 2 + square, lambda s: 2 * (s - nearest))


@given(st.floats(0.15, 0.9), st.sampled_from([-1, 1]))
def test_a_cubic_between_the_ends_is_not_trusted_farther_than_the_ends_agree(late, side):
    """The square 0.6 + cos(2 pi s + late) is below zero for a while; the cubic of its ends is not."""

    def turn(s):
        return 2 * np.pi * s + side * late

    assert not kept(lambda s: 0.6 + np.cos(turn(s)), lambda s: -2 * np.pi * np.sin(turn(s)))


def test_it_hangs_on_no_unit_of_time():
    """Of two real roots and of two upper halves, that swing by about their distance."""
    rng = np.random.default_rng(4)
    for other in (0.0, 1.0j):
        a = np.array([5j, 7j]) * abs(other) - 2 + rng.normal(size=(2000, 2)) * (1 + other)
        rise_a, rise_z = rng.normal(size=(2, 2000, 2)) * (1 + other)
        z = a + (rise_a + rise_z) / 2
        found = keep_apart(a, z, rise_a, rise_z, np.ones(a.shape, bool))
        assert 0.1 < found.mean() < 0.9
        part = 2.0**-10  # no rounding
        scaled = keep_apart(a * part, z * part, rise_a * part, rise_z * part, np.ones(a.shape, bool))
        np.testing.assert_array_equal(found, scaled)
