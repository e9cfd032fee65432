"""What a study is asked: four worlds, and how far what nobody measured may be off."""

import numpy as np
import pytest
from small_study import exactly_known, small

from studies.main_study.settings import CAMBER_RANGE, CAMBER_SHARE, Arms, Front, Ranges, Settings


def test_four_worlds_and_the_first_is_the_one_of_the_question():
    settings = small()
    assert [setup.label for setup in settings.setups] == [
        "hands off, flexible front", "hands on, flexible front", "hands off, rigid front", "hands on, rigid front"
    ]  # fmt: skip
    assert settings.setups[0] == settings.reference
    assert {setup.camber_share for setup in settings.setups} == {0.65}
    assert [setup.words for setup in settings.setups][1] == "hands on and a flexible front"


def test_camber_stiffness_is_what_dressel_measured():
    """0.0075 to 0.015 of the load per degree (abstract of Dressel, 2013)."""
    per_radian = np.array([0.0075, 0.015]) * 180 / np.pi
    assert pytest.approx(per_radian, abs=0.005) == CAMBER_RANGE
    assert CAMBER_RANGE[0] < CAMBER_SHARE < CAMBER_RANGE[1]
    assert pytest.approx(per_radian.mean(), abs=0.01) == CAMBER_SHARE


def test_ranges_are_those_of_the_plausible_fronts():
    found = small().ranges
    assert (found.stiffness, found.damping) == ((2500, 10000), (5, 40))
    assert (found.hinge, found.friction) == ((-0.1, 0.1), (0, 1))
    assert found.camber_share == CAMBER_RANGE


def test_what_a_model_file_gives_narrows_its_own_range_and_no_other():
    assumed = Ranges()
    front = small(front=Front(4000.0, 10.0, 0.7, given=True)).ranges
    assert (front.stiffness, front.damping, front.hinge) == ((3200, 5000), (8, 12.5), (-0.02, 0.02))
    assert (front.friction, front.camber_share, front.arm_damping) == (
        assumed.friction, assumed.camber_share, assumed.arm_damping,
    )  # fmt: skip
    arms = small(arms=Arms(0.2, 10.0, 2.0, given=True)).ranges
    assert arms.arm_inertia == pytest.approx((0.16, 0.25))
    assert (arms.arm_stiffness, arms.arm_damping) == ((8, 12.5), (1.6, 2.5))
    assert (arms.stiffness, arms.hinge) == (assumed.stiffness, assumed.hinge)
    camber = small(further={"camber_thrust": {"camber_stiffness": 300.0}}).ranges
    assert camber.camber_share == (0.8, 1.25)  # of what the file gives
    damper = small(further={"steer_damper": {"damping": 2.0}}).ranges
    assert damper.friction == (0.0, 0.0)
    assert damper.damping == assumed.damping  # of the front


@pytest.mark.parametrize("name", ["benchmark", "pista_charlie_drops", "rigid"])
def test_an_assumed_hinge_lies_on_the_steer_axis(name):
    p = exactly_known(name).values
    for height in (0.0, 0.5, 0.75):
        front = Front(joint_height=height)
        from_ground = np.array([front.hinge_x(p) - (p["w"] + p["c"]), -height])  # from where the axis meets the ground
        axis = np.array([np.sin(p["lam"]), np.cos(p["lam"])])
        assert abs(from_ground[0] * axis[1] - from_ground[1] * axis[0]) < 1e-12
    assert Front(joint_x=0.9).hinge_x(p) == 0.9


def test_the_fastest_speed_is_the_last_one_looked_at():
    assert small(speeds=np.linspace(0, 21, 4)).fastest == 21.0
    assert Settings(exactly_known("benchmark")).fastest == 30.0
