"""The minimiser in a long, curved valley, where straight steps have to be short."""

import numpy as np
import pytest

from studies.inference import minimise

STEEP = 300.0


def valley(z, *, slopes):
    """Residuals 300 (y - x^2) and 3 (x - 2), and their derivative."""
    x, y = z
    residual = np.array([STEEP * (y - x * x), 3 * (x - 2)])
    return residual, np.array([[-2 * STEEP * x, STEEP], [3.0, 0.0]]) if slopes else np.zeros((2, 0))


def test_it_follows_a_curved_valley_to_its_end():
    far = np.full(2, 50.0)
    end = minimise(valley, np.array([-2.0, 4.0]), -far, far, np.ones(2, bool))
    assert end.converged
    # on the floor y = x^2 the objective 9 (x - 2)^2 + x^2 + x^4 is least where 4 x^3 + 20 x - 36 = 0
    roots = np.roots([4, 0, 20, -36])
    x = roots[np.abs(roots.imag) < 1e-9].real[0]
    least = 9 * (x - 2) ** 2 + x**2 + x**4
    assert least - 1e-3 < end.objective < least + 1e-2
    np.testing.assert_allclose(end.z, [x, x * x], atol=0.01)


def test_bounds_hold_on_the_way():
    seen = []

    def watched(z, *, slopes):
        seen.append(z.copy())
        return valley(z, slopes=slopes)

    lower, upper = np.array([-3.0, 0.5]), np.array([1.0, 5.0])
    end = minimise(watched, np.array([0.75, 0.6]), lower, upper, np.ones(2, bool))
    assert np.all((np.array(seen) >= lower) & (np.array(seen) <= upper))
    assert end.z[0] == 1.0  # the valley goes on beyond it


def test_derivatives_taken_with_each_trial_change_nothing_but_the_number_of_calls():
    far, start, calls = np.full(2, 50.0), np.array([-2.0, 4.0]), {True: 0, False: 0}
    ends = {}
    for eager in (False, True):

        def counted(z, *, slopes, eager=eager):
            calls[eager] += 1
            return valley(z, slopes=slopes)

        ends[eager] = minimise(counted, start, -far, far, np.ones(2, bool), eager=eager)
    np.testing.assert_array_equal(ends[True].z, ends[False].z)
    np.testing.assert_array_equal(ends[True].jacobian, ends[False].jacobian)
    assert calls[True] < calls[False]


def test_a_start_that_stalls_far_above_what_another_reached_is_given_up():
    """Slopes 300 times too steep: the objective of 10^4 creeps, by less than a tenth in eight turns."""

    def turns(reached):
        calls = []

        def creeping(z, *, slopes):
            calls.append(slopes)
            return np.array([100.0 - z[0]]), np.array([[-300.0]]) if slopes else np.zeros((1, 0))

        end = minimise(creeping, np.zeros(1), np.full(1, -1e3), np.full(1, 1e3), np.ones(1, bool), reached=reached)
        assert not end.converged
        return sum(calls), end.objective

    whole, lowest = turns(np.inf)
    assert whole > 15  # until the damping forbids all steps
    assert turns(7000.0) == (whole, lowest)  # not far above it
    given_up, objective = turns(50.0)
    assert 8 < given_up < 12
    assert 9e3 < objective < 1e4


def steps_of_a_fit(share, first, **settings):
    """Steps of a fit whose sum of squares, ``first`` of one row, falls by a ``share`` in each: its slopes say so."""
    forecast = 1 - np.sqrt(1 - share)  # what a step takes from the residual
    steep = 100.0
    stiff = np.sqrt(steep**2 / forecast - steep**2 - 1)  # of a second row, which seems to forbid more and never moves
    calls = []

    def falling(z, *, slopes):
        calls.append(slopes)
        residual = np.array([np.sqrt(first) - steep * z[0], 0.0])
        return residual, np.array([[-steep], [stiff]]) if slopes else np.zeros((2, 0))

    minimise(falling, np.zeros(1), np.full(1, -1e3), np.full(1, 1e3), np.ones(2, bool), **settings)
    return sum(calls) - 1


def test_a_fit_that_falls_by_a_tenth_in_eight_turns_is_not_given_up():
    """0.985^8 = 0.886, and 0.99^8 = 0.923; the sum of squares stays far above what another start has reached."""
    assert steps_of_a_fit(0.015, 1e4, reached=50.0) == 60
    assert steps_of_a_fit(0.01, 1e4, reached=50.0) == 8


def test_a_fit_that_is_still_poor_has_fewer_turns_than_one_that_is_not():
    """Of two rows 20 is poor: 1e4 is so for long, 16 never was."""
    assert steps_of_a_fit(0.05, 1e4, turns=(30, 5)) == 5
    assert steps_of_a_fit(0.05, 16.0, turns=(30, 5)) == 30


def test_a_way_that_leads_beyond_all_numbers_is_not_taken_and_gives_no_warning():
    """Beyond x = 1 nothing is finite; the gradient leads there."""

    def broken(z, *, slopes):
        residual = np.array([3.0 - z[0], 0.5]) if z[0] < 1 else np.array([np.inf, -np.inf])
        return residual, np.array([[-1.0], [0.0]]) if slopes else np.zeros((2, 0))

    end = minimise(broken, np.array([0.95]), np.full(1, -9.0), np.full(1, 9.0), np.ones(2, bool))
    assert np.isfinite(end.objective)
    assert 0.95 <= end.z[0] < 1


def test_a_fit_that_creeps_beside_what_is_not_finite_is_given_up():
    """Slopes 300 times too steep: one step promises 10^4, four of them gain a hundredth; beyond lies no number."""

    def turns(low, high):
        calls = []

        def creeping(z, *, slopes):
            calls.append(slopes)
            residual = np.nan if low < z[0] < high else 100.0 - z[0]
            return np.array([residual]), np.array([[-300.0]]) if slopes else np.zeros((1, 0))

        end = minimise(creeping, np.zeros(1), np.full(1, -1e3), np.full(1, 1e3), np.ones(1, bool))
        assert not end.converged
        assert np.isfinite(end.objective)
        return sum(calls)

    assert turns(1e6, 1e7) > 15  # nowhere near
    assert turns(0.2, 0.4) < 8


def test_the_damping_rises_tenfold_until_a_step_lowers_the_objective():
    """(z - 4)^2 + z^2 from 0 without an end beyond 0.5: steps of 2 / (1 + d) for d = 0.001, 0.01, 0.1, 1, 10."""
    asked = []

    def evaluate(z, *, slopes):
        asked.append(float(z[0]))
        return np.where(abs(z) > 0.5, np.inf, z - 4), np.ones((1, 1))

    far = np.full(1, 100.0)
    minimise(evaluate, np.zeros(1), -far, far, np.ones(1, bool), turns=(1, 1))
    tried = [z for z in asked if z > 0.21] + [z for z in asked if z < 0.19][-1:]  # others are a tenth of a way
    assert tried == pytest.approx([2 / (1 + damping) for damping in (0.001, 0.01, 0.1, 1, 10)])
