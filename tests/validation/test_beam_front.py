"""The beam model of a front against closed forms and against numbers that another author's programs gave."""

import math

import numpy as np
import pytest

from bicycle.files import load_bicycle
from tests.validation.beam_front import (
    CLAMPED_HEAD,
    DROPOUTS,
    FORK_RANGE,
    HEAD_TUBE_RANGE,
    STEEL,
    Beams,
    Stand,
    TwoJoints,
    beam_modes,
    deflections,
    draw_front,
    fork_compliance,
    fork_figure,
    frame_compliance,
    head_tube_figure,
    hub_compliance,
    scaled,
    two_joint_modes,
)

FRONT = scaled(draw_front(np.random.default_rng(4)), 95.0, 45.0)


@pytest.mark.parametrize("along", [(1, 0, 0), (0.3, -0.4, 0.8), (0, 0, -1)])
def test_a_cantilever_bends_and_twists_as_in_the_textbook(along):
    along = np.array(along) / np.linalg.norm(along)
    length, diameter, wall = 0.4, 0.03, 0.002
    beams = Beams()
    beams.node("root", np.zeros(3))
    beams.node("middle", 0.3 * length * along)
    beams.node("tip", length * along)
    beams.beam("root", "middle", diameter, wall, STEEL)
    beams.beam("middle", "tip", diameter, wall, STEEL)
    beams.hold("root", [1e14] * 6)
    across = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
    across /= np.linalg.norm(across)
    second = math.pi / 64 * (diameter**4 - (diameter - 2 * wall) ** 4)
    area = math.pi / 4 * (diameter**2 - (diameter - 2 * wall) ** 2)
    load = np.zeros(18)
    load[beams.freedoms("tip")] = [*(100 * across + 1000 * along), *(5 * along)]
    tip = np.linalg.solve(beams.matrix(), load)[beams.freedoms("tip")]
    assert tip[:3] @ across == pytest.approx(100 * length**3 / 3 / STEEL / second, rel=1e-6)
    assert tip[:3] @ along == pytest.approx(1000 * length / STEEL / area, rel=1e-6)
    assert tip[3:] @ along == pytest.approx(5 * length / (0.385 * STEEL * 2 * second), rel=1e-6)
    assert tip[3:] @ np.cross(along, across) == pytest.approx(100 * length**2 / 2 / STEEL / second, rel=1e-6)


def test_drawn_fronts_have_the_figures_they_were_drawn_for():
    assert head_tube_figure(FRONT) == pytest.approx(95, rel=1e-4)  # clamps and rear axle are not scaled
    assert fork_figure(FRONT) == pytest.approx(45, rel=1e-4)
    rng = np.random.default_rng(5)
    for _ in range(3):
        front = draw_front(rng)
        assert HEAD_TUBE_RANGE[0] <= head_tube_figure(front) <= HEAD_TUBE_RANGE[1]
        assert FORK_RANGE[0] <= fork_figure(front) <= FORK_RANGE[1]


def test_frame_and_fork_tilt_one_after_the_other():
    whole, frame, fork = hub_compliance(FRONT), frame_compliance(FRONT), fork_compliance(FRONT)
    assert (whole.a, whole.b, whole.c) == pytest.approx(
        (frame.a + fork.a, frame.b + fork.b, frame.c + fork.c), rel=3e-3
    )


def test_the_test_of_the_head_tube_hides_how_far_the_frame_sways():
    """The support forces the pivot to itself."""
    frame = frame_compliance(FRONT, DROPOUTS)
    middle = FRONT.crown + 0.012 + FRONT.head_tube / 2
    tilt = frame.b - middle * frame.c  # under a force at the middle
    shift = frame.a - 2 * middle * frame.b + middle**2 * frame.c
    assert math.radians(1 / (frame.c - tilt**2 / shift)) == pytest.approx(head_tube_figure(FRONT), rel=4e-3)


def test_readings_follow_from_the_compliance_of_the_hub():
    """A side force at the ground: y = F (a + r b) at the hub, F (a + 2 r b + r^2 c) at the ground."""
    hub, reach = hub_compliance(FRONT), 0.33
    read = deflections(FRONT, {("wheel", -reach): 98.1}, [("wheel", 0.0), ("wheel", -reach), ("saddle", 0.0)])
    assert read[0] == pytest.approx(98.1 * (hub.a + reach * hub.b), rel=1e-6)
    assert read[1] == pytest.approx(98.1 * (hub.a + 2 * reach * hub.b + reach**2 * hub.c), rel=1e-6)
    assert abs(read[2]) < 1e-4 * read[0]
    stiffness, pivot = hub.at_ground(reach)
    assert read[0] == pytest.approx(98.1 * (pivot + reach) * pivot / stiffness, rel=1e-6)


@pytest.mark.parametrize("length", [0.1, 0.2])
def test_two_joints_hold_the_whole_compliance(length):
    hub = hub_compliance(FRONT)
    stiffness, height, fork = hub.two_joints(length)
    assert height**2 / stiffness + length**2 / fork == pytest.approx(hub.a, rel=1e-9)
    assert height / stiffness + length / fork == pytest.approx(hub.b, rel=1e-9)
    assert 1 / stiffness + 1 / fork == pytest.approx(hub.c, rel=1e-9)


def test_modes_of_two_joints_are_those_of_another_program():
    """The joints, 11.02 and 44.8 Hz and the stem's ratio +0.47 are those of another author's rigid-body program."""
    p = load_bicycle("pista").values
    joints = TwoJoints(frame=(17410.0, 1.16), fork=(4279.0, 0.1))
    frequencies, ratios = two_joint_modes(p, joints, [0.0, 0.60])
    assert frequencies == pytest.approx([11.02, 44.8], rel=2e-3)
    assert ratios[:, 0] == pytest.approx([1.0, 0.47], abs=0.005)


def test_a_tap_on_the_beams_and_on_the_two_joints_agree_in_the_first_mode():
    p = load_bicycle("pista").values
    stiffness, height, fork = hub_compliance(FRONT).two_joints(0.1)
    simple, _ = two_joint_modes(p, TwoJoints((stiffness, height), (fork, 0.1)), [0.0])
    beams, shapes = beam_modes(FRONT, p, [("wheel", 0.0), ("fork", 0.6), ("frame", 0.45)])
    assert beams[0] == pytest.approx(simple[0], rel=0.1)
    assert shapes[1, 0] / shapes[0, 0] > 0  # the stem moves with the hub


def test_on_a_soft_stand_the_whole_swings_first_and_the_frame_moves():
    p, places = load_bicycle("pista").values, [("wheel", 0.0), ("bottom_bracket", 0.0)]
    held, _ = beam_modes(FRONT, p, places)
    soft, shapes = beam_modes(FRONT, p, places, Stand(roll=1500.0, yaw=1500.0, lateral=3e4))
    assert soft[0] < 0.5 * held[0]
    assert abs(shapes[1, 0]) > 0.05 * abs(shapes[0, 0])
    hard, _ = beam_modes(FRONT, p, places, CLAMPED_HEAD)
    assert hard[0] > held[0]
