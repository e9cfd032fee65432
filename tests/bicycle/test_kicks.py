"""Kicks against another integrator, and against the normal form beside the critical speed."""

import numpy as np
import pytest

from bicycle.kicks import kick_thresholds
from bicycle.limit_cycles import find_limit_cycles
from bicycle.model_file import build_model
from bicycle.nonlinear import magic_formula_model
from tyre.errors import InputError

EFFECTS = {
    "relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5},
    "front_compliance": {"stiffness": 4000, "damping": 12, "joint_x": 0.86, "joint_z": -0.65},
}


@pytest.fixture(scope="module")
def faq():
    return find_limit_cycles(build_model({"bicycle": "pista_charlie_drops", "effects": EFFECTS}))


@pytest.mark.parametrize("kind", ["steer_torque", "steer"])
def test_a_little_less_dies_out_and_a_little_more_does_not(faq, kind):
    (kick,) = kick_thresholds(faq, 37.0, kind)
    assert (kick.mode, kick.follows) == ("weave", "lasting motion")
    system = magic_formula_model(faq.model, speed=37.0)
    start = system.input_matrix[:, system.inputs.index(kind)] if kind in system.inputs else None
    swings = []
    for factor in (0.9, 1.1):
        size = kick.least * factor
        if start is None:
            initial = {kind: size}
        else:
            initial = {name: value for name, value in zip(system.states, start * size, strict=True) if value}
        time = np.linspace(0, 12, 2401)
        with np.errstate(all="ignore"):
            response = system.simulate(time=time, initial=initial, tolerance=1e-7)
        swings.append(np.ptp(np.degrees(response.outputs["steer"][time > 11])) / 2)
    assert swings[0] < 1.5  # degrees; the unstable motion has 3.8
    assert swings[1] > 8


def test_beside_the_critical_speed_the_normal_form_holds(faq):
    far, near = kick_thresholds(faq, [37.0, 38.85])
    assert near.least == pytest.approx(near.estimate, rel=0.05)
    assert near.estimate < far.estimate


def test_a_side_force_takes_half_a_second_of_hundreds_of_newtons(faq):
    kicks = kick_thresholds(faq, [35.0, 36.0, 37.0], "lateral_force")
    assert all(100 < one.least < one.estimate < 400 for one in kicks)
    assert all(one.falls_from is None or one.falls_from >= one.least for one in kicks)


def test_where_no_motion_lies_beside(faq):
    assert kick_thresholds(faq, [2.0, 10.0, 33.0, 39.0]) == []


def test_an_unknown_kick(faq):
    with pytest.raises(InputError, match="unknown kick 'steer_torq'"):
        kick_thresholds(faq, 37.0, "steer_torq")
