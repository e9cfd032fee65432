"""Joint angles in closed form: the forward kinematics of yeadon put hands and feet where they were asked."""

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bicycle.rider import POSTURES, Contacts, Lengths, fitting_hands, read_rider, shoulder, sit, two_links
from bicycle.rider import rider_body as human
from tyre.ground import InputError

BODY = Lengths.of(read_rider("jason").lengths)
UP = np.array([0.0, 1.0])
HIP, PEDALS = np.array([0.2, -1.0]), np.array([0.4, -0.28])


@given(st.floats(0.2, 0.6), st.floats(0.2, 0.6), st.floats(0.05, 0.99))
def test_two_links_close_the_triangle(first, second, share):
    distance = abs(first - second) + share * (first + second - abs(first - second))
    root, bend = two_links(first, second, distance)
    joint = first * np.exp(1j * root)
    assert joint + second * np.exp(1j * (root - bend)) == pytest.approx(distance)


@settings(max_examples=30)
@given(
    st.floats(0.0, 1.1), st.floats(-0.2, 0.5), st.floats(-0.3, 0.6), st.floats(0.4, 0.8), st.floats(-1.3, -0.7),
    st.floats(0.15, 0.3),
)  # fmt: skip
def test_hands_and_feet_arrive(lean, rounding, elbows, x, z, half):
    pytest.importorskip("yeadon")
    top, _ = shoulder(HIP, BODY, torso_lean=lean, back_rounding=rounding)
    reach = math.hypot(x - top[0], z - top[1], half - BODY.half_shoulders)
    assume(abs(BODY.upper_arm - BODY.forearm) + 0.05 < reach < BODY.upper_arm + BODY.forearm)
    seat = Contacts(HIP, PEDALS, np.array([x, z]), half)
    found = sit(BODY, seat, torso_lean=lean, back_rounding=rounding, elbows_out=elbows)
    rider = read_rider("jason")
    with human.quiet_yeadon():
        person = human.yeadon_module().Human(dict(rider.lengths))
        person.set_CFG_dict(dict(found.configuration))
    to_hand, to_heel = (np.array([0, 0, -length]) for length in (BODY.forearm, BODY.shank))
    for forearm, shank, side in ((person.A2, person.J2, -1), (person.B2, person.K2, 1)):
        for part, link, (px, pz), py in ((forearm, to_hand, (x, z), side * half), (shank, to_heel, PEDALS, None)):
            end = np.ravel(part.pos) + part.rot_mat @ link
            assert HIP[0] - end[1] == pytest.approx(px, abs=1e-9)
            assert HIP[1] - end[2] == pytest.approx(pz, abs=1e-9)
            if py is not None:
                assert -end[0] == pytest.approx(py, abs=1e-9)
    lean_found = math.atan2(-person.A1.pos[1, 0], person.A1.pos[2, 0])
    assert lean_found == pytest.approx(lean, abs=1e-9)
    knee = -person.J1.end_pos[1, 0]
    assert knee > 0  # bends forward
    if elbows == 0:
        assert person.A1.rot_mat[2, 0] == pytest.approx(0, abs=1e-12)  # the hinge is horizontal


@pytest.mark.parametrize("name", POSTURES)
def test_the_fitting_bar_is_reached_with_the_elbows_of_the_posture(name):
    posture = POSTURES[name]
    for level in re.findall(r"torso (\d+) deg from the horizontal", posture.source):  # of its source
        assert math.degrees(posture.torso_lean) == pytest.approx(90 - float(level))
    hands = HIP + fitting_hands(BODY, posture, torso_lean=posture.torso_lean)
    found = sit(BODY, Contacts(HIP, PEDALS, hands, posture.hand_width / 2), torso_lean=posture.torso_lean)
    assert found.elbow_flexion == pytest.approx(posture.elbow_flexion)
    assert found.remarks == ()


def test_short_arms_say_which_lean_would_reach():
    seat = Contacts(HIP, PEDALS, np.array([0.9, -0.95]), 0.25)
    with pytest.raises(InputError, match=r"the arms are too short by \d+ mm: 0.613 m from shoulder to hand") as caught:
        sit(BODY, seat, torso_lean=0.0)
    low = float(str(caught.value).split("torso lean of ")[1].split(" to ")[0])
    sit(BODY, seat, torso_lean=math.radians(low + 0.06))
    with pytest.raises(InputError, match="too short"):
        sit(BODY, seat, torso_lean=math.radians(low - 0.06))
    stretched = sit(BODY, seat, torso_lean=0.0, strict=False)
    assert stretched.elbow_flexion == 0
    far = Contacts(HIP, PEDALS, np.array([1.9, -0.95]), 0.25)
    with pytest.raises(InputError, match="at any torso lean; move the handlebar closer"):
        sit(BODY, far, torso_lean=0.3)


def test_short_legs_say_what_is_missing():
    seat = Contacts(HIP - UP / 2, PEDALS, np.array([0.7, -1.3]), 0.2)
    with pytest.raises(
        InputError, match=r"the legs are too short by \d+ mm: 0.928 m from hip to heel.*lower the saddle"
    ):
        sit(BODY, seat, torso_lean=0.5)


def test_what_no_body_does_is_said():
    near = Contacts(np.array([0.35, -0.45]), PEDALS, np.array([0.45, -0.72]), 0.2)
    said = " ".join(sit(BODY, near, torso_lean=0.6).remarks)
    assert "the knees are bent" in said
    straight = Contacts(PEDALS - 0.9279 * UP, PEDALS, np.array([0.7, -1.3]), 0.2)
    assert "the knees are straight" in " ".join(sit(BODY, straight, torso_lean=0.3).remarks)
    folded = Contacts(HIP, PEDALS, np.array([0.8, -0.7]), 0.2)
    assert "thigh and trunk enclose" in " ".join(sit(BODY, folded, torso_lean=1.55, strict=False).remarks)
