"""The effects against limits that must hold and what the literature reports; Kane's equations judge all of them."""

import math

import numpy as np
import pytest
from built import built, linear
from eigenvalue_sets import assert_same_eigenvalues
from scipy.optimize import linear_sum_assignment

from bicycle import critical_speeds, load_bicycle
from tyre.ground import InputError

PER_DEG = 180 / math.pi
STIFFNESS = {"rear": 110 * PER_DEG, "front": 105 * PER_DEG}
RIDER = {"mass": 40.0, "x": 0.35, "z": -1.2, "Ixx": 3.0, "Izz": 1.0, "Ixz": 0.5, "joint_z": -0.9}


def relaxing(length=0.1):
    return {"cornering_stiffness": STIFFNESS, "relaxation_length": length}


def test_aligning_moment_with_the_stiffness_of_a_trail_is_pneumatic_trail():
    trail, length = {"rear": 0.016, "front": 0.019}, {"rear": 0.11, "front": 0.09}
    moment = {"aligning_stiffness": {w: trail[w] * STIFFNESS[w] for w in trail}, "relaxation_length": length}
    with_trail = linear(relaxation_length=relaxing(length), pneumatic_trail={"trail": trail})
    with_moment = linear(relaxation_length=relaxing(length), aligning_moment=moment)
    assert with_moment.states[-2:] == ("rear_lateral_force", "front_lateral_force")
    assert {"rear_aligning_moment", "front_aligning_moment"} < set(with_moment.states)
    for speed in (1.0, 5.0, 12.0, 30.0):
        expected, found = with_trail.eigenvalues(speed), with_moment.eigenvalues(speed)  # two lags more
        missed = np.abs(expected[:, None] - found)
        assert (missed[linear_sum_assignment(missed)] <= 1e-12 * np.maximum(np.abs(expected), 1)).all()


def test_wheel_compliance_is_a_spring_in_series_with_the_tyre():
    """Relaxation length C (1/K_y + 1/K_w); K_y = C / relaxation length of the tyre alone."""
    hub, length, speeds = {"rear": 2e5, "front": 1e5}, 0.08, [0.0, 6.0, 25.0]
    longer = {w: c * (1 / (c / length) + 1 / hub[w]) for w, c in STIFFNESS.items()}
    soft = linear(relaxation_length=relaxing(length), wheel_compliance={"stiffness": hub})
    alone = linear(relaxation_length=relaxing(longer))
    assert_same_eigenvalues(soft.eigenvalues(speeds), alone.eigenvalues(speeds), rtol=1e-10, atol=1e-9)


def test_arms_add_to_the_steering_only():
    """Inertia, damper and spring stand in the steer row and nowhere else."""
    model, bare = linear(rider_arms={"inertia": 0.2, "stiffness": 7.0, "damping": 1.5}), linear()
    steer, rate = model.states.index("steer"), model.states.index("steer_rate")
    mass = model.ranges[0].matrices.mass - bare.ranges[0].matrices.mass
    force = model.ranges[0].matrices.dynamics[0] - bare.ranges[0].matrices.dynamics[0]
    expected = np.zeros((2, *mass.shape))
    expected[0, rate, rate], expected[1, rate, steer], expected[1, rate, rate] = 0.2, -7.0, -1.5
    np.testing.assert_allclose([mass, force], expected, atol=1e-12)
    spring = linear(steer_spring={"stiffness": 7.0}).ranges[0].matrices.dynamics[0]
    np.testing.assert_allclose((spring - bare.ranges[0].matrices.dynamics[0])[rate, steer], -7.0, rtol=1e-12)


def test_steer_assist_follows_its_law_on_each_side_of_the_fade_speed():
    """Torque gain (v_fade - v) d(lean)/dt below, lean_gain (v - v_fade) lean above, nothing at the fade speed."""
    model, bare = linear(steer_assist={"gain": 8.0, "fade_speed": 5.0, "lean_gain": 3.0}), linear()
    row = model.states.index("steer_rate")
    inputs = bare.ranges[0].matrices.mass[:, row]
    assert inputs.any()
    assert [(piece.lower, piece.upper) for piece in model.ranges] == [(0.0, 5.0), (5.0, math.inf)]
    for speed, rate_gain, lean_gain in ((2.0, 24.0, 0.0), (5.0, 0.0, 0.0), (7.0, 0.0, 6.0)):
        change = model.matrices_at(speed)[0] - bare.matrices_at(speed)[0]
        torque = bare.ranges[0].matrices.mass @ change
        expected = np.zeros_like(torque)
        expected[row, model.states.index("lean_rate")] = rate_gain
        expected[row, model.states.index("lean")] = lean_gain
        np.testing.assert_allclose(torque, expected, atol=1e-10)


@pytest.mark.parametrize(("change", "words"), [
    ({"mass": 125.0}, "mass = 125 kg must be below 125 kg, .* rear frame that contains the moving body"),
    ({"Ixx": 20.0}, "what remains of the rear frame has a negative principal inertia"),
    ({"z": -2.5}, "what remains of the rear frame has a negative principal inertia"),
    ({"Ixz": 2.0}, "the moving body has a negative principal inertia"),
])  # fmt: skip
def test_a_body_that_is_not_in_the_rear_frame_is_refused(change, words):
    frame = {"mB": 125.0, "xB": 0.316, "zB": -0.996, "IBxx": 14.648, "IBzz": 3.868, "IBxz": 3.308}  # holds RIDER
    with pytest.raises(InputError, match=words):
        built(load_bicycle("benchmark").replace(**frame), rider_lean=RIDER | change)


def test_a_crown_wider_than_the_wheel_is_refused():
    with pytest.raises(InputError, match="crown_radius.front = 0.4 m is larger than the wheel .*half the width"):
        built(crown_radius={"crown_radius": {"rear": 0.01, "front": 0.4}})


def test_the_speed_at_which_drag_lifts_the_front_wheel_is_said():
    # benchmark: front load 309.30 N (Meijaard's masses), D h / w = 309.30 N at v = sqrt(309.30 w / (h rho A / 2))
    drag = {"drag_area": 0.4, "air_density": 1.2, "centre_of_pressure_z": -1.1}
    speed = math.sqrt(309.30352941176477 * 1.02 / (1.1 * 1.2 * 0.4 / 2))
    warned = linear(relaxation_length=relaxing(), aerodynamic_drag=drag).warnings[-1]
    assert f"the front wheel lifts off the ground above {speed:.2f} m/s" in warned
    assert not any("lifts off" in text for text in linear(relaxation_length=relaxing()).warnings)


def test_a_rounder_tyre_falls_more_slowly():
    """A wheel that rolls sideways on its crown raises the effective support: Cossalter, Motorcycle Dynamics, ch. 1."""
    fall = [linear(crown_radius={"crown_radius": r}).eigenvalues(0.0).real.max() for r in (0.0, 0.01, 0.03)]
    assert np.all(np.diff(fall) < 0)


ON_TYRES = {"relaxation_length": relaxing()}


@pytest.mark.parametrize(("contact", "identifier", "fixed", "name", "values", "mode", "sign"), [
    (ON_TYRES, "overturning_moment", {}, "overturning_stiffness", (-5.0, 0.0, 5.0), "weave", -1),
    (ON_TYRES, "overturning_moment", {}, "overturning_stiffness", (0.0, 2.0, 5.0), "capsize", -1),
    (ON_TYRES, "rotating_mass", {"inertia": 0.02}, "spin", (-300.0, 0.0, 300.0), "capsize", 1),
    ({}, "twisting_torque", {}, "twisting_stiffness", (0.0, 0.5, 1.0), "capsize", 1),  # Cossalter, ch. 2 and 7
    ({}, "steer_assist", {"fade_speed": 6.0}, "gain", (0.0, 2.0, 4.0), "weave", -1),  # Schwab et al. (2008)
    ({}, "steer_spring", {}, "stiffness", (0.0, 3.0), "weave", -1),
    ({}, "steer_spring", {}, "stiffness", (0.0, 3.0), "capsize", -1),
    ({}, "rider_arms", {"inertia": 0.0, "damping": 0.0}, "stiffness", (0.0, 3.0), "weave", -1),
    ({}, "rider_arms", {"inertia": 0.0, "damping": 0.0}, "stiffness", (0.0, 3.0), "capsize", -1),
])  # fmt: skip
def test_a_critical_speed_goes_where_the_literature_or_the_signature_says(
    contact, identifier, fixed, name, values, mode, sign
):
    tables = [contact | {identifier: fixed | {name: value}} for value in values]
    found = [next(c.speed for c in critical_speeds(linear(**table), 20.0) if c.mode == mode) for table in tables]
    assert (sign * np.diff(found) > 0).all()


CAMBER = {"rear": 900.0, "front": 700.0}


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_the_part_of_the_camber_force_that_lags_does_not_matter_in_the_steady_state(share):
    """Without a lag at all; with one at s = 0, where the product of the roots is the determinant of the system."""

    def roots(share, scale=1.0, **law):
        camber = {"camber_stiffness": {w: scale * c for w, c in CAMBER.items()}, "lag_share": share}
        return linear(**law, camber_thrust=camber).eigenvalues([2.0, 5.0, 9.0, 14.0])

    static = {"side_slip": {"cornering_stiffness": STIFFNESS}}
    np.testing.assert_allclose(roots(share, **static), roots(1.0, **static), rtol=1e-7, atol=1e-7)
    assert not np.allclose(roots(share, **static), roots(share, scale=0.5, **static), rtol=1e-3)
    lagging, other = roots(1.0, **ON_TYRES), roots(share, **ON_TYRES)
    assert not np.allclose(np.sort_complex(other), np.sort_complex(lagging), rtol=1e-3)
    np.testing.assert_allclose(other.prod(-1), lagging.prod(-1), rtol=1e-6)
