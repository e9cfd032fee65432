"""Newton on crossings of known roots, from candidates beside them."""

import numpy as np
import pytest

from bicycle.critical.newton import newton_crossings
from bicycle.speed_polynomial import SpeedPolynomial


def crossings(candidate, **roots):
    """Speeds up to 60 m/s that Newton finds, of real ``roots``: coefficients of 1, v, v^2."""
    powers = {power: np.diag([root[power] for root in roots.values()]) for power in range(3)}
    return [found.speed for found in newton_crossings(SpeedPolynomial(powers), 0.0, 60.0, np.array([candidate]))]


def test_a_step_ends_on_the_root_that_it_began_on():
    """10 (v - 5) from 5.2 m/s, where it is 2: beside a root that is 1.9 at all speeds."""
    assert crossings(5.2, crossing=(-50.0, 10.0, 0.0), still=(1.9, 0.0, 0.0)) == pytest.approx([5.0])


@pytest.mark.parametrize("per_second", [1.0, 60.0, 1000.0])
def test_a_root_near_the_axis_is_followed_from_where_it_turns_back_in_any_unit_of_time(per_second):
    """(v - 5)^2 - 0.001^2 from beside 5 m/s, where it is nearly level; another root is -100."""
    level = per_second * np.array([25 - 1e-6, -10.0, 1.0])
    assert crossings(5 + 1e-6, crossing=level, other=(-100 * per_second, 0.0, 0.0)) == pytest.approx([5.001])
