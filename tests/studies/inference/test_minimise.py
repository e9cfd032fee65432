"""The minimiser in a long, curved valley, where straight steps have to be short."""

import numpy as np

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
    given_up, objective = turns(5000.0)
    assert 8 < given_up < 12
    assert 9e3 < objective < 1e4
    soon, objective = turns(50.0)  # more than ten times above it
    assert 5 <= soon < 8
    assert 9e3 < objective < 1e4


def test_a_way_that_leads_beyond_all_numbers_is_not_taken_and_gives_no_warning():
    """Beyond x = 1 nothing is finite; the gradient leads there."""

    def broken(z, *, slopes):
        residual = np.array([3.0 - z[0], 0.5]) if z[0] < 1 else np.array([np.inf, -np.inf])
        return residual, np.array([[-1.0], [0.0]]) if slopes else np.zeros((2, 0))

    end = minimise(broken, np.array([0.95]), np.full(1, -9.0), np.full(1, 9.0), np.ones(2, bool))
    assert np.isfinite(end.objective)
    assert 0.95 <= end.z[0] < 1
