"""A height above the front hub in place of the hinge's coordinates."""

import math

import numpy as np
import pytest
from built import effect

from bicycle import Model, load_bicycle
from bicycle.model import build_model
from studies.uncertainty import UncertainModel
from tyre.ground import InputError

PISTA = load_bicycle("pista")
HEIGHT = 0.31  # m


def axis_from_hub(x, z):
    """Place (x, z), m, as distance from the steer axis and height along it over its point nearest to the hub, by hand.

    The axis goes through the ground at w + c and leans back by lam; z is down.
    """
    tilt = PISTA["lam"]
    up = np.array([-math.sin(tilt), -math.cos(tilt)])
    foot = np.array([PISTA["w"] + PISTA["c"], 0.0])
    hub = np.array([PISTA["w"], -PISTA["rF"]])
    along = (np.array([x, z]) - foot) @ up - (hub - foot) @ up
    across = np.array([up[1], -up[0]])
    away = (np.array([x, z]) - foot) @ across
    return away, along


def test_the_hinge_lies_on_the_steer_axis_at_that_height():
    values = effect("front_compliance", stiffness=4000.0, height_above_hub=HEIGHT).values(PISTA.values)
    away, along = axis_from_hub(values["front_compliance.joint_x"], values["front_compliance.joint_z"])
    assert away == pytest.approx(0.0, abs=1e-12)
    assert along == pytest.approx(HEIGHT, abs=1e-12)


def test_a_damping_ratio_is_of_the_hinge_at_that_height():
    by_height = effect("front_compliance", stiffness=4000.0, height_above_hub=HEIGHT, damping_ratio=0.1)
    values = by_height.values(PISTA.values)
    place = {name: values[f"front_compliance.{name}"] for name in ("joint_x", "joint_z")}
    by_place = effect("front_compliance", stiffness=4000.0, **place, damping_ratio=0.1)
    assert values == by_place.values(PISTA.values)
    assert Model(PISTA, (by_height,)).parameters == Model(PISTA, (by_place,)).parameters


def test_a_file_keeps_the_height():
    hinge = effect("front_compliance", stiffness=4000.0, height_above_hub=HEIGHT)
    assert hinge.table == {"stiffness": 4000.0, "damping": 20.0, "height_above_hub": HEIGHT}
    assert hinge == effect("front_compliance", **hinge.table)
    assert hinge != effect("front_compliance", **hinge.table | {"height_above_hub": 0.3})
    assert "height_above_hub=0.31" in repr(hinge)


def test_the_uncertainty_of_a_height_moves_the_hinge_along_the_steer_axis():
    front = {"stiffness": "4000(200)", "damping": 15.0, "height_above_hub": "0.310(20)"}
    model = build_model({"bicycle": "pista", "effects": {"front_compliance": front}})
    names = [f"front_compliance.{name}" for name in ("joint_x", "joint_z", "stiffness")]
    x, z = 0.02 * math.sin(PISTA["lam"]), 0.02 * math.cos(PISTA["lam"])
    expected = [[x * x, x * z, 0], [x * z, z * z, 0], [0, 0, 200.0**2]]
    np.testing.assert_allclose(model.covariance.among(names), expected, rtol=1e-6, atol=1e-12)


def test_a_stated_ratio_shares_the_error_of_stiffness_and_height():
    """c = 2 zeta sqrt(k I): its relative change is half that of the stiffness while zeta is held."""
    front = {"stiffness": "4000(400)", "damping_ratio": 0.1, "height_above_hub": HEIGHT}
    model = build_model({"bicycle": "pista", "effects": {"front_compliance": front}})
    damping = model.parameters["front_compliance.damping"]
    assert model.sd["front_compliance.damping"] == pytest.approx(0.05 * damping, rel=1e-6)
    covariance = model.covariance.among(["front_compliance.stiffness", "front_compliance.damping"])
    assert covariance[0, 1] == pytest.approx(400.0 * 0.05 * damping, rel=1e-6)


def test_random_bicycles_keep_the_hinge_on_the_steer_axis():
    front = {"stiffness": 4000.0, "damping": 15.0, "height_above_hub": "0.310(20)"}
    names, covariance = UncertainModel({"bicycle": "pista", "effects": {"front_compliance": front}}).covariance()
    places = [names.index(f"front_compliance.{name}") for name in ("joint_x", "joint_z")]
    assert covariance[places[1], places[1]] ** 0.5 == pytest.approx(0.02 * math.cos(PISTA["lam"]), rel=1e-6)
    across = np.zeros(len(names))
    across[places] = math.cos(PISTA["lam"]), -math.sin(PISTA["lam"])
    assert across @ covariance @ across == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"height_above_hub": 0.3, "joint_z": -0.6}, "height_above_hub and joint_z say the same; remove one"),
        ({"height_above_hub": 305.0}, "height_above_hub = 305.0 must be between -1.5 and 1.5 m"),
        ({"height_above_hub": True}, "height_above_hub = True must be between -1.5 and 1.5 m"),
        ({}, "missing parameter 'joint_x'.*height_above_hub"),
    ],
)
def test_a_wrong_height_is_refused(values, words):
    with pytest.raises(InputError, match=words):
        effect("front_compliance", stiffness=4000.0, **values)


@pytest.mark.parametrize(
    ("values", "doubted"),
    [
        ({}, set()),
        ({"height_above_hub": -0.2}, {"height_above_hub"}),
        ({"damping_ratio": 1.9}, {"damping_ratio"}),
        ({"height_above_hub": 1.4, "damping_ratio": 1e-4}, {"height_above_hub", "damping_ratio"}),
    ],
)
def test_what_stands_for_parameters_is_doubted_as_they_are(values, doubted):
    hinge = {"stiffness": 4000.0, "height_above_hub": 0.31, "damping_ratio": 0.1} | values
    assert set(effect("front_compliance", **hinge).doubts()) == doubted
