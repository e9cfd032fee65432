"""One range for a number, wherever it is used."""

import pytest

from bicycle import load_bicycle
from bicycle.model import EFFECT
from studies import main_study
from studies.bicycles import own_bicycle


def test_a_bicycle_of_everyday_numbers_flexes_as_in_the_main_study():
    limits, ranges = own_bicycle.LIMITS, main_study.Ranges()
    assert (limits.stiffness, limits.damping) == (ranges.stiffness, ranges.damping)
    height = main_study.Front().joint_height
    assert limits.height == pytest.approx((height + ranges.hinge[0], height + ranges.hinge[1]))


def test_a_given_number_is_drawn_within_two_of_its_standard_deviations():
    front = main_study.Front(4000.0, 10.0, 0.65, given=True)
    ranges = main_study.Settings(load_bicycle("pista_charlie_drops"), front=front).ranges
    assert ranges.damping == pytest.approx((10 * (1 - 2 * EFFECT), 10 / (1 - 2 * EFFECT)))
    assert ranges.stiffness == pytest.approx((4000 * (1 - 2 * EFFECT), 4000 / (1 - 2 * EFFECT)))
