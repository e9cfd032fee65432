"""A case as a model: the one put together by hand, and numbers computed elsewhere."""

import numpy as np
import pytest
import wobble_onsets
from eigenvalue_sets import assert_same_eigenvalues
from small_study import exactly_known, small

from bicycle.critical.critical_speed import CrossingIdentity
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.effect import effect_class
from bicycle.model import Model
from studies.main_study.assemble import build, follow
from studies.main_study.decompose import named_speeds
from studies.main_study.settings import Arms, Front, Setup

CONTACT = [6300.0, 0.14, 6000.0, 0.12]


def by_hand(bicycle, **effects):
    """The tyre of CONTACT with camber thrust of 0.65 of the load, and effects."""
    rear, front = bicycle.static_loads
    tables = {
        "relaxation_length": {
            "cornering_stiffness": {"rear": 6300.0, "front": 6000.0}, "relaxation_length": {"rear": 0.14, "front": 0.12}
        },
        "camber_thrust": {"camber_stiffness": {"rear": 0.65 * rear, "front": 0.65 * front}},
    } | effects  # fmt: skip
    return Model(bicycle, tuple(effect_class(name)(**table) for name, table in tables.items())).linear_model()


@pytest.mark.parametrize(("length", "speed"), wobble_onsets.RIGID)
def test_rigid_wobble_onset_of_the_benchmark_bicycle(length, speed):
    rear, front = wobble_onsets.RIGID_STIFFNESS.values()
    model = build(small("benchmark"), Setup(None, None, 0.0), [rear, length, front, length])
    found = named_speeds(critical_speeds(model))
    assert found[CrossingIdentity("wobble", destabilising=True)] == pytest.approx(speed, abs=1e-4)


@pytest.mark.parametrize("number", range(4))
def test_every_world_is_the_model_put_together_by_hand(number):
    settings = small()
    v = settings.bicycle.values
    front = {"front_compliance": {
        "stiffness": 5000.0, "damping": 20.0, "axis_tilt": v["lam"], "joint_z": -0.65,
        "joint_x": v["w"] + v["c"] - 0.65 * np.tan(v["lam"]),
    }}  # fmt: skip
    arms = {"rider_arms": {"inertia": 0.1, "stiffness": 5.0, "damping": 1.0}}
    effects = [front, front | arms, {}, arms][number]
    expected = by_hand(settings.bicycle, **effects).eigenvalues(7.0)
    found = build(settings, settings.setups[number], CONTACT).eigenvalues(7.0)
    assert_same_eigenvalues(found, expected, rtol=1e-9, atol=1e-9)


def test_friction_of_the_steering_is_a_damper_beside_the_one_of_the_file():
    settings = small(further={"steer_damper": {"damping": 0.7}}, front=Front(friction=0.5))
    front = {"front_compliance": {"stiffness": 5000.0, "damping": 20.0, "joint_z": -0.65,
             "joint_x": Front().hinge_x(settings.bicycle.values)}}  # fmt: skip
    expected = by_hand(settings.bicycle, **front, steer_damper={"damping": 1.2}).eigenvalues(7.0)
    assert_same_eigenvalues(build(settings, settings.reference, CONTACT).eigenvalues(7.0), expected, rtol=1e-9)
    rigid = by_hand(settings.bicycle, steer_damper={"damping": 0.7}).eigenvalues(7.0)
    assert_same_eigenvalues(build(settings, settings.setups[2], CONTACT).eigenvalues(7.0), rigid, rtol=1e-9)


def test_own_hinge_axis_and_effects_are_in_the_model():
    settings = small(
        front=Front(4000.0, 8.0, 0.7, 0.95, 0.1, given=True), arms=Arms(0.2, 12.0, 2.0, given=True),
        further={"crown_radius": {"crown_radius": 0.014}, "camber_thrust": {"camber_stiffness": 210.0}},
    )  # fmt: skip
    expected = by_hand(
        settings.bicycle,
        front_compliance={"stiffness": 4000, "damping": 8, "joint_x": 0.95, "joint_z": -0.7, "axis_tilt": 0.1},
        rider_arms={"inertia": 0.2, "stiffness": 12, "damping": 2}, crown_radius={"crown_radius": 0.014},
        camber_thrust={"camber_stiffness": 210.0},
    ).eigenvalues(7.0)  # fmt: skip
    assert_same_eigenvalues(build(settings, settings.setups[1], CONTACT).eigenvalues(7.0), expected, rtol=1e-9)


def test_what_is_assumed_hangs_on_the_bicycle_and_what_is_given_does_not():
    assumed = small("benchmark")
    heavier = dict(exactly_known("benchmark").values) | {"mB": 95.0, "lam": 0.3}
    found = follow(assumed, assumed.reference, heavier)
    by_balance = 0.65 * 9.81 * (heavier["mR"] + sum(
        heavier[f"m{body}"] * (1 - heavier[f"x{body}"] / heavier["w"]) for body in "BH"
    ))  # fmt: skip
    assert found["camber_thrust.camber_stiffness.rear"] == pytest.approx(by_balance)
    assert found["front_compliance.joint_x"] == pytest.approx(heavier["w"] + heavier["c"] - 0.65 * np.tan(0.3))
    given = small(front=Front(joint_x=0.9, given=True), further={"camber_thrust": {"camber_stiffness": 210.0}})
    assert follow(given, given.reference, heavier) == {}
    assert set(follow(assumed, assumed.setups[2], heavier)) == {
        "camber_thrust.camber_stiffness.rear", "camber_thrust.camber_stiffness.front"
    }  # fmt: skip
