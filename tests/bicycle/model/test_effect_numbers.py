"""Numbers of effects with a standard uncertainty in a model file: ``"5400(300)"``."""

import numpy as np
import pytest

from bicycle.model import build_model, standard_deviations
from studies.uncertainty import UncertainModel
from tyre.ground import InputError

HINGE = {"joint_x": 0.877, "joint_z": -0.614}


def build(**front):
    return build_model({"bicycle": "pista", "effects": {"front_compliance": {**HINGE, **front}}})


@pytest.mark.parametrize(
    ("text", "value", "sd"),
    [
        ("5400(300)", 5400.0, 300.0),
        ("5400 +/- 5 %", 5400.0, 270.0),
        ("5400", 5400.0, None),
        ("90(5) N m/deg", 90 * 180 / np.pi, 5 * 180 / np.pi),
    ],
)
def test_text_is_a_number_with_its_uncertainty(text, value, sd):
    model = build(stiffness=text, damping=20.0)
    assert model.parameters["front_compliance.stiffness"] == pytest.approx(value, rel=1e-12)
    assert model.sd.get("front_compliance.stiffness") == (None if sd is None else pytest.approx(sd, rel=1e-12))
    if sd is not None:
        assert standard_deviations(model)["front_compliance.stiffness"].origin == "model file"


def test_the_uncertainty_of_a_ratio_is_that_of_the_damping():
    model = build(stiffness=4200.0, damping_ratio="0.2(5)")
    damping = model.parameters["front_compliance.damping"]
    assert model.sd == {"front_compliance.damping": pytest.approx(damping * 0.5 / 0.2, rel=1e-12)}


def test_a_ratio_leaves_the_uncertainty_of_the_numbers_behind_it():
    front = {**HINGE, "stiffness": 4200.0, "damping_ratio": "0.2(5)"}
    law = {"cornering_stiffness": 6000.0, "relaxation_length": "0.1(1)"}
    model = build_model({"bicycle": "pista", "effects": {"front_compliance": front, "relaxation_length": law}})
    lengths = {f"relaxation_length.relaxation_length.{wheel}" for wheel in ("rear", "front")}
    assert set(model.sd) == {"front_compliance.damping", *lengths}


def test_one_number_of_both_wheels_has_one_error():
    law = {"cornering_stiffness": "6000(300)", "relaxation_length": {"rear": "0.1(1)", "front": 0.12}}
    model = build_model({"bicycle": "pista", "effects": {"relaxation_length": law}})
    names = [f"relaxation_length.cornering_stiffness.{wheel}" for wheel in ("rear", "front")]
    np.testing.assert_allclose(model.covariance.among(names), [[9e4, 9e4], [9e4, 9e4]])
    assert model.sd["relaxation_length.relaxation_length.rear"] == pytest.approx(0.1)
    assert "relaxation_length.relaxation_length.front" not in model.sd


def test_random_bicycles_and_a_covariance_of_other_numbers_have_it():
    content = {
        "bicycle": "pista",
        "effects": {"front_compliance": {**HINGE, "stiffness": "4200(100)", "damping": 17.0}},
        "covariance": {"parameters": ["front_compliance.damping"], "matrix": [[4.0]]},
    }
    names, covariance = UncertainModel(content).covariance()
    for name, variance in (("front_compliance.stiffness", 1e4), ("front_compliance.damping", 4.0)):
        place = names.index(name)
        assert covariance[place, place] == pytest.approx(variance, rel=1e-6)


@pytest.mark.parametrize(
    ("front", "words"),
    [
        ({"stiffness": "about 5400"}, "effect 'front_compliance': stiffness = 'about 5400' is not a finite number"),
        ({"stiffness": "5400(300) N"}, "stiffness"),
        ({"stiffness": "5400 +/- -3"}, "the standard deviation of stiffness is -3; it must be >= 0"),
        ({"stiffness": "-5400(300)"}, "stiffness = -5400 N m/rad is outside 0 .. inf"),
    ],
)
def test_what_is_no_number_is_refused(front, words):
    with pytest.raises(InputError, match=words):
        build(**front)


def test_an_uncertainty_is_stated_once():
    content = {
        "bicycle": "pista",
        "effects": {"front_compliance": {**HINGE, "stiffness": "4200(100)", "damping": 17.0}},
        "covariance": {"parameters": ["front_compliance.stiffness"], "matrix": [[4.0]]},
    }
    with pytest.raises(InputError, match=r"\[effects\] state an sd of front_compliance.stiffness already; keep one"):
        build_model(content)
