"""Boundaries of matrices that are written down: circles, folds, islands, crossings, double zeros are known curves."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from toy_plane import Toy, blocks, oscillator, pair, single

from studies.chart import CLOSED, DOUBLE_ZERO, EDGE, all_boundaries, complete_boundaries

STEP = 1 / 150


def circle(centre, radius, other=-3.0):
    """A pair unstable within a circle, at a frequency that varies along it."""

    def matrices(u):
        away = ((u - centre) ** 2).sum(-1)
        return blocks(pair(radius**2 - away, 5 + u[:, 0]), single(np.full(len(u), other)))

    return Toy(matrices)


@settings(max_examples=12)
@given(st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.floats(1.5e-3, 0.09))
def test_an_island_of_any_size_is_found_and_closed(x, y, radius):
    """The grid of seeds has cells of 0.03: most of these lie between its points."""
    (found,) = all_boundaries(circle(np.array([x, y]), radius), step=STEP)
    assert found.ends == (CLOSED, CLOSED)
    np.testing.assert_allclose(np.hypot(*(found.shares - [x, y]).T), radius, rtol=1e-9)
    np.testing.assert_allclose(found.roots.imag, 5 + found.shares[:, 0], rtol=1e-9)
    turned = np.unwrap(np.arctan2(*(found.shares - [x, y]).T))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi, abs=0.5)  # once around, no more
    outwards = (found.shares - [x, y]) / radius
    np.testing.assert_allclose((found.normals * outwards).sum(1), -1, atol=1e-6)


def test_a_fold_is_passed():
    """Re = x - 0.3 - 2 (y - 0.5)^2: seen along x the curve comes back."""
    toy = Toy(lambda u: blocks(pair(u[:, 0] - 0.3 - 2 * (u[:, 1] - 0.5) ** 2, 4.0), single(u[:, 1] * 0 - 1)))
    (found,) = all_boundaries(toy, step=STEP)
    assert found.ends == (EDGE, EDGE)
    assert sorted(found.shares[[0, -1], 1].tolist()) == pytest.approx([0.0, 1.0], abs=1e-6)
    np.testing.assert_allclose(found.shares[:, 0], 0.3 + 2 * (found.shares[:, 1] - 0.5) ** 2, atol=1e-12)
    assert np.hypot(*np.diff(found.shares, axis=0).T).max() <= 1.1 * STEP


def test_two_pairs_that_cross_at_one_point_keep_their_curves():
    toy = Toy(lambda u: blocks(pair(u[:, 0] - u[:, 1], 4.0), pair(u[:, 0] + u[:, 1] - 1, 7.0)))
    found = all_boundaries(toy, step=STEP)
    assert len(found) == 2
    for boundary in found:
        assert boundary.ends == (EDGE, EDGE)
        assert np.ptp(boundary.roots.imag) < 1e-9
    assert sorted(round(float(b.roots.imag[0])) for b in found) == [4, 7]


def test_a_frequency_that_becomes_zero_ends_a_pair_where_a_real_root_is_zero():
    """x'' + (0.5 - x) x' + (y - 0.4) x = 0: imaginary pair on x = 0.5 above y = 0.4, zero root along y = 0.4."""
    toy = Toy(lambda u: blocks(oscillator(0.5 - u[:, 0], u[:, 1] - 0.4), single(u[:, 0] * 0 - 2)))
    found = all_boundaries(toy, step=STEP)
    real = next(b for b in found if b.real)
    wave = next(b for b in found if not b.real)
    assert len(found) == 2
    np.testing.assert_allclose(real.shares[:, 1], 0.4, atol=1e-12)
    np.testing.assert_allclose(wave.shares[:, 0], 0.5, atol=1e-9)
    assert sorted(wave.ends) == sorted((DOUBLE_ZERO, EDGE))
    assert wave.shares[:, 1].min() == pytest.approx(0.4, abs=1e-4)
    np.testing.assert_allclose(wave.roots.imag, np.sqrt(wave.shares[:, 1] - 0.4), rtol=1e-6)
    # the side of the real boundary that is unstable changes where the pair ends
    turn = np.flatnonzero(np.diff(np.sign(real.normals[:, 1])))
    assert len(turn) == 1
    assert real.shares[turn[0], 0] == pytest.approx(0.5, abs=1e-5)


@settings(max_examples=2)
@example(47)
@example(17965)  # two branches almost meet: the curve bends within 1e-4 of the axes
@given(st.integers(0, 10**6))
def test_the_count_of_unstable_roots_agrees_with_random_curves(seed):
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(4, 6))

    def wave(u, k):
        x, y = 2 * np.pi * u.T
        terms = np.stack([np.ones_like(x), np.sin(x), np.cos(y), np.sin(x + y), np.cos(2 * x), np.sin(2 * y)])
        return a[k] @ terms

    toy = Toy(lambda u: blocks(pair(wave(u, 0), 4 + 0.2 * wave(u, 3)), pair(wave(u, 1), 9.0), single(wave(u, 2))))
    found, check = complete_boundaries(toy, all_boundaries(toy, step=STEP), step=STEP)
    assert check.far.sum() > 5000
    assert not check.wrong.any()
    assert check.sides == 0
    assert all(set(b.ends) <= {EDGE, CLOSED} for b in found)
    shares = np.concatenate([b.shares for b in found])
    roots = np.linalg.eigvals(toy.given(shares))
    assert (np.abs(roots.real).min(1) < 1e-9 * np.abs(roots).max(1)).all()


def test_a_missing_boundary_is_found_by_the_count_and_else_said():
    toy = circle(np.array([0.4, 0.6]), 0.2)
    found, check = complete_boundaries(toy, [], step=STEP)  # as if no seed had led there
    assert len(found) == 1
    assert found[0].closed
    assert not check.wrong.any()
    x, y = np.meshgrid(check.grid, check.grid, indexing="ij")
    inside = np.hypot(x - 0.4, y - 0.6) < 0.2
    np.testing.assert_array_equal(check.predicted[check.far], 2 * inside[check.far])
