"""Whether roots meet inside a step, against discriminants that are known in all of it, plain and by the kernel."""

import importlib.util

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plain_kernels import plain, put_roots

from bicycle.modal.apart import keep_apart


def by_kernel(a, z, rise_a, rise_z, free):
    """The same of the kernel, a step of 1 m/s of a bicycle each; all are ``free``."""
    from bicycle.modal import apart_kernel
    from bicycle.modal.track_kernel import SMOOTH, empty_track

    assert free.all()
    look, (count, n) = plain(apart_kernel.keep_apart), a.shape
    t = empty_track(count, 2, n)
    t.v[:, 1] = 1.0
    t.match[:, 0] = np.arange(n)
    put_roots(t, slice(None), 0, a, rise_a)
    put_roots(t, slice(None), 1, z, rise_z)
    return np.array([look(t, k, 0, 1, SMOOTH) for k in range(count)])


needs_numba = pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")
either_way = pytest.mark.parametrize("way", [keep_apart, pytest.param(by_kernel, marks=needs_numba)])
of_any_two = pytest.mark.parametrize("middle", [-2.0, -2.0 + 5.0j])
"""Two real roots, and two upper halves."""


def kept(way, middle, square, slope):
    """Answer for two roots about ``middle`` whose squared distance is ``square`` (s), with that ``slope``, s 0 to 1.

    A third one at -9 keeps away.
    """
    half = [np.sqrt(square(s)) / 2 for s in (0.0, 1.0)]
    rise = [slope(s) / (8 * x) for s, x in zip((0.0, 1.0), half, strict=True)]
    a, z = (np.array([[middle + x, middle - x, -9]], complex) for x in half)
    rise_a, rise_z = (np.array([[x, -x, 0]], complex) for x in rise)
    return bool(way(a, z, rise_a, rise_z, np.ones((1, 3), bool))[0])


@either_way
@given(first=st.floats(0.05, 0.9), lasting=st.floats(0.02, 0.5))
def test_two_real_roots_that_are_a_pair_for_a_moment_do_not_keep_apart(way, first, lasting):
    last = first + lasting * (0.95 - first)
    assert not kept(way, -2.0, lambda s: (s - first) * (s - last), lambda s: 2 * s - first - last)


@either_way
@of_any_two
@given(nearest=st.floats(0.05, 0.95), square=st.floats(0.1, 2.0))
def test_two_roots_that_only_come_near_keep_apart(way, middle, nearest, square):
    assert kept(way, middle, lambda s: (s - nearest) ** 2 + square, lambda s: 2 * (s - nearest))


@either_way
@of_any_two
@given(late=st.floats(0.15, 0.9), side=st.sampled_from([-1, 1]))
def test_a_cubic_between_the_ends_is_not_trusted_farther_than_the_ends_agree(way, middle, late, side):
    """The square 0.6 + cos(2 pi s + late) is below zero for a while; the cubic of its ends is not."""

    def turn(s):
        return 2 * np.pi * s + side * late

    assert not kept(way, middle, lambda s: 0.6 + np.cos(turn(s)), lambda s: -2 * np.pi * np.sin(turn(s)))


@either_way
def test_it_hangs_on_no_unit_of_time(way):
    """Of two real roots and of two upper halves, that swing by about their distance."""
    rng = np.random.default_rng(4)
    for other in (0.0, 1.0j):
        a = np.array([5j, 7j]) * abs(other) - 2 + rng.normal(size=(500, 2)) * (1 + other)
        rise_a, rise_z = rng.normal(size=(2, 500, 2)) * (1 + other)
        z = a + (rise_a + rise_z) / 2
        found = way(a, z, rise_a, rise_z, np.ones(a.shape, bool))
        assert 0.1 < found.mean() < 0.9
        part = 2.0**-10  # no rounding
        scaled = way(a * part, z * part, rise_a * part, rise_z * part, np.ones(a.shape, bool))
        np.testing.assert_array_equal(found, scaled)
