"""Arms between torso and bar: limits that can be written with other parts, and the mass that is felt at a hand."""

from dataclasses import replace

import numpy as np
import pytest
from built import linear
from eigenvalue_sets import assert_same_eigenvalues
from point_mass import enlarged

from bicycle import effect_class, load_bicycle
from bicycle.rider import RigidBody, felt_mass, packaged_geometry, read_geometry, read_rider, rider_on_bicycle
from tests.validation.blind import machine
from tests.validation.blind.chain import Body, Joint
from tests.validation.blind.closing import at_speed, ground

HANDS = {"mass": 4.0, "half_width": 0.25, "x": 0.8, "z": -1.0}
TYRE = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
SPEEDS = (2.0, 5.0, 9.0)


def eigenvalues(bicycle, speed, **effects):
    return linear(bicycle, relaxation_length=TYRE, **effects).eigenvalues(speed)


def moved_to_the_bar(bicycle):
    """Two point masses at (x, +-half_width, z) taken from the rear frame and put on the front frame, by Steiner."""
    (m, width, x, z), new = HANDS.values(), {}
    for part, sign in (("B", -1), ("H", 1)):
        bicycle = enlarged(bicycle, part, sign * m, x, z)
        new |= {f"I{part}{axes}": bicycle[f"I{part}{axes}"] + sign * m * width**2 for axes in ("xx", "zz")}
    return bicycle.replace(**new, allow_unusual=True)


@pytest.mark.parametrize("speed", SPEEDS)
def test_a_stiff_grip_puts_the_hands_on_the_front_frame(speed):
    bicycle, errors = load_bicycle("benchmark"), []
    expected = np.sort_complex(eigenvalues(moved_to_the_bar(bicycle), speed))
    for grip in (1e7, 1e8):
        held = HANDS | {"stiffness": 0.0, "damping": 0.0, "grip_stiffness": grip, "grip_damping": 0.0}
        found = np.sort_complex(eigenvalues(bicycle, speed, rider_hands=held))
        errors.append(np.abs(found[np.abs(found) < 500] - expected).max())
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.05)


@pytest.mark.parametrize("speed", SPEEDS)
def test_stiff_arms_leave_the_grips_as_spring_and_damper_of_the_steering(speed):
    bicycle = load_bicycle("benchmark")
    expected = eigenvalues(bicycle, speed, steer_spring={"stiffness": 90.0}, steer_damper={"damping": 1.5})
    stiff = HANDS | {"stiffness": 1e9, "damping": 0.0, "grip_stiffness": 90.0, "grip_damping": 1.5}
    found = eigenvalues(bicycle, speed, rider_hands=stiff)
    assert_same_eigenvalues(found[np.abs(found) < 5000], expected, rtol=1e-5)


def rod(mass, length):
    """A thin rod along x (forearm) with its middle at (length/2, 0, 0)."""
    return RigidBody(mass, np.array([length / 2, 0, 0]), np.diag([0, 1, 1]) * mass * length**2 / 12)


def test_the_mass_felt_at_a_hand_is_that_of_a_rod_where_the_upper_arm_is_light():
    """Upper arm upright: the elbow cannot go down, so a hand led down turns the rod about its end, m/3; forward, m."""
    points = tuple(map(np.array, ((0.0, 0.0, -0.3), (0.0, 0.0, 0.0), (0.25, 0.0, 0.0))))
    light = RigidBody(1e-9, np.array([0, 0, -0.15]), 1e-12 * np.eye(3))
    arm = (light, rod(1.5, 0.25))
    assert felt_mass(arm, points, np.array([0, 0, 2.0])) == pytest.approx(0.5, rel=1e-6)
    assert felt_mass(arm, points, np.array([3.0, 0, 0])) == pytest.approx(1.5, rel=1e-6)
    point = (light, RigidBody(1.5, points[2], 1e-12 * np.eye(3)))
    assert felt_mass(point, points, np.array([1.0, 2.0, -1.0])) == pytest.approx(1.5, rel=1e-6)


def test_hands_of_a_packaged_rider_are_at_his_bar():
    """In the drops the elbows are bent: each hand feels less than the whole arm; stretched arms feel heavier."""
    frame, rider = load_bicycle("pista"), read_rider("charlie")
    masses = {}
    for posture in ("upright", "hoods", "drops"):
        geometry = read_geometry(packaged_geometry("pista"), posture)
        whole = rider_on_bicycle(frame, rider, posture=posture, geometry=geometry)
        hands = whole.hands
        arm = sum(part.body.mass for part in whole.segments if part.name.startswith("Right") and "arm" in part.name)
        masses[posture] = hands["mass"] / (2 * arm)
        assert (hands["x"], hands["z"]) == pytest.approx(tuple(whole.contacts.hands))
        effect_class("rider_hands")(**hands)
    assert 0.3 < masses["drops"] < 1 < masses["hoods"] < masses["upright"]


@pytest.mark.parametrize("name", ["benchmark", "pista_charlie_drops", "rigid_rider"])
def test_arms_are_point_masses_of_a_nonlinear_chain_linearised_by_numbers(name, monkeypatch):
    """Two masses at (x, +-half_width, z) on a hinge along the steer axis, their like taken out of the rear frame."""
    how = HANDS | {"stiffness": 12.0, "damping": 0.8, "grip_stiffness": 150.0, "grip_damping": 0.6}
    bicycle, plain = load_bicycle(name), machine.plan_bodies
    half, width, point = how["mass"] / 2, how["half_width"], np.zeros((3, 3))

    def with_arms(p, effects, extras):
        plan, rear, front = plain(p, effects, extras)
        frame = plan.names["pitch"]
        axis, foot = (np.sin(p["lam"]), 0, np.cos(p["lam"])), (p["w"] + p["c"], 0, 0)
        hands = plan.join("hands", Joint(frame, axis, foot))
        for side in (-width, width):
            place = (how["x"], side, how["z"])
            plan.bodies += [Body(hands, half, place, point), Body(frame, -half, place, point)]
        plan.sprung["hands"] = (how["stiffness"] + how["grip_stiffness"], how["damping"] + how["grip_damping"])
        return plan, rear, front

    monkeypatch.setattr(machine, "plan_bodies", with_arms)
    effects = {"relaxation_length": TYRE}
    found = machine.coefficients(bicycle.values, effects)
    hands, steer = found.names.index("hands"), found.names.index("steer")
    stiffness, damping = found.stiffness.copy(), found.damping.copy()
    for matrix, grip in ((stiffness, how["grip_stiffness"]), (damping, how["grip_damping"])):
        matrix[steer, steer] += grip
        matrix[hands, steer] -= grip
        matrix[steer, hands] -= grip
    built = replace(found, stiffness=stiffness, damping=damping)
    for speed in SPEEDS:
        expected = np.linalg.eigvals(at_speed(built, ground(effects), speed).matrix)
        assert_same_eigenvalues(eigenvalues(bicycle, speed, rider_hands=how), expected, rtol=1e-8)
