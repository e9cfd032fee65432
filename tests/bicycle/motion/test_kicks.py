"""Kicks against another integrator, and against the normal form beside the critical speed."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bicycle.motion import kick_thresholds
from tests.shared.shooting import own_equations
from tyre.ground import InputError


def swings_after(model, kick, kind, *, friction=0.0):
    """Swing of the bar in degrees, 11 to 12 s after 0.9 and 1.1 times a kick, on equations written in the tests."""
    own, names = own_equations(model, kick.speed)
    linear = model.linear_model()
    inputs, steer, turns = linear.matrices_at(kick.speed)[1], names.index("steer"), names.index("steer_rate")
    torque = inputs[:, linear.inputs.index("steer_torque")]
    start = np.where(np.arange(len(names)) == steer, 1.0, 0.0) if kind == "steer" else torque

    def rate(t, flat):
        x = flat.reshape(len(names), 2)
        rubbing = torque[:, None] * friction * np.tanh(x[turns] / 0.05) if friction else 0.0
        return (own(t, x) - rubbing).ravel()

    begin = np.outer(kick.least * start, (0.9, 1.1)).ravel()
    motion = solve_ivp(rate, (0, 12), begin, "LSODA", rtol=1e-7, atol=1e-10, max_step=0.02)
    return np.degrees(np.ptp(motion.y.reshape(len(names), 2, -1)[steer][:, motion.t > 11], axis=1)) / 2


@pytest.fixture(scope="module")
def torques(faq):
    return kick_thresholds(faq, [37.0, 38.85])


@pytest.mark.parametrize("kind", ["steer_torque", "steer"])
def test_a_little_less_dies_out_and_a_little_more_does_not(faq, torques, kind):
    (kick,) = torques[:1] if kind == "steer_torque" else kick_thresholds(faq, 37.0, kind)
    assert (kick.mode, kick.follows) == ("weave", "stable limit cycle")
    less, more = swings_after(faq.model, kick, kind)
    assert less < 1.5  # degrees; the unstable motion has 3.8
    assert more > 8


def test_dry_friction_holds_a_wobble_until_a_kick_frees_it(faq, rubbing):
    (kick,) = kick_thresholds(rubbing, 10.0)
    assert (kick.mode, kick.follows, kick.within_geometry) == ("wobble", "stable limit cycle", True)
    assert kick.least == pytest.approx(kick.estimate, rel=0.1)
    page = (Path(__file__).parents[3] / "docs" / "amplitude.md").read_text(encoding="utf-8")
    assert f"At 10 m/s an impulse of {kick.least:.3f} N m s starts it" in page
    less, more = swings_after(faq.model, kick, "steer_torque", friction=0.3)
    assert less < 0.1  # degrees; the unstable motion has 0.31
    assert more > 5


def test_beside_the_critical_speed_the_normal_form_holds(torques):
    far, near = torques
    assert near.least == pytest.approx(near.estimate, rel=0.05)
    assert near.estimate < far.estimate


def test_a_lateral_force_takes_half_a_second_of_hundreds_of_newtons(faq):
    kicks = kick_thresholds(faq, [35.0, 36.0, 37.0], "lateral_push")
    assert all(100 < one.least < one.estimate < 400 for one in kicks)
    assert all(one.falls_from is None or one.falls_from >= one.least for one in kicks)


def test_where_no_motion_lies_beside(faq):
    assert kick_thresholds(faq, [2.0, 10.0, 33.0, 39.0]) == []


def test_an_unknown_kick(faq):
    with pytest.raises(InputError, match="unknown kick 'steer_torq'"):
        kick_thresholds(faq, 37.0, "steer_torq")
