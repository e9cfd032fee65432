"""What place and damping of the front hinges mean: height above the hub and damping ratio."""

import math

import numpy as np
import pytest

from bicycle.effects import effect_class
from bicycle.files import available_bicycles, load_bicycle
from bicycle.model import Model
from bicycle.parameters import front_line, front_words, hinge_at

PISTA = load_bicycle("pista_charlie_drops")


def model(**front):
    joint_x, joint_z = hinge_at(PISTA.values, 0.31)
    hinge = effect_class("front_compliance")(**{"joint_x": joint_x, "joint_z": joint_z, "stiffness": 4000.0} | front)
    return Model(PISTA, (hinge,))


@pytest.mark.parametrize("ratio", [0.02, 0.25, 0.6])
def test_the_ratio_that_was_given_is_said(ratio):
    words = front_words(model(damping_ratio=ratio).parameters)
    assert words["front_compliance.damping"] == f"damping ratio {ratio:.2g}"
    assert words["front_compliance.joint_z"] == "0.31 m above the front hub"


def test_the_height_is_along_the_steer_axis_from_the_foot_of_the_hub():
    """By plane geometry: the foot of the hub on the steer axis, then up the axis."""
    p = PISTA.values
    up = np.array([-math.sin(p["lam"]), math.cos(p["lam"])])  # forward, up
    ground = np.array([p["w"] + p["c"], 0.0])  # where the axis meets the ground
    hub = np.array([p["w"], p["rF"]])
    foot = ground + up * (up @ (hub - ground))
    x, height = foot + 0.47 * up
    words = front_words(model(joint_x=x, joint_z=-height).parameters)
    assert words["front_compliance.joint_z"] == "0.47 m above the front hub"


def test_the_wheel_on_its_fork_hinge():
    fork = effect_class("fork_bending")(stiffness=5000.0, damping=3.0, length=0.2)
    inertia = PISTA["IFxx"] + PISTA["mF"] * 0.2**2
    said = front_line(Model(PISTA, (fork,)).parameters)
    assert said == f"fork_bending.damping: damping ratio {3.0 / 2 / math.sqrt(5000 * inertia):.2g}"


def test_without_a_front_hinge_nothing_is_said():
    assert front_words(Model(PISTA).parameters) == {}
    assert front_line(Model(PISTA).parameters) == ""


def test_the_declared_evidence_is_true_of_the_packaged_bicycles():
    """20 N m s/rad at 5000 N m/rad, hinge 0.33 m above the hub."""
    ratios = []
    for name in available_bicycles():
        bicycle = load_bicycle(name)
        joint_x, joint_z = hinge_at(bicycle.values, 0.33)
        hinge = effect_class("front_compliance")(stiffness=5000.0, damping=20.0, joint_x=joint_x, joint_z=joint_z)
        text = front_words(Model(bicycle, (hinge,)).parameters)["front_compliance.damping"]
        ratios.append(float(text.rpartition(" ")[2]))
    damping = next(p for p in effect_class("front_compliance").parameters if p.name == "damping")
    assert f"a damping ratio of {min(ratios):.2g} to {max(ratios):.2g}" in damping.evidence
