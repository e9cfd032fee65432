"""A damping ratio in place of the damping of the front frame's hinge."""

import numpy as np
import pytest
from built import effect

from bicycle import Model, load_bicycle
from bicycle.parameters import critical_damping, front_inertia, height_above_hub, hinge_at
from tyre.ground import InputError

HINGE = {"stiffness": 5000.0, "joint_x": 0.86, "joint_z": -0.65}


@pytest.mark.parametrize(("height", "inertia"), [(0.3, 0.319), (0.4, 0.404), (0.5, 0.566)])
def test_the_inertia_of_a_track_bicycles_front_is_that_of_point_masses_and_tensors(height, inertia):
    """Sum of I + m arm^2 by hand: (arm along the steer axis) over handlebar with fork, and wheel."""
    p = load_bicycle("pista").values
    joint_x, joint_z = hinge_at(p, height)
    axis = np.array([np.cos(p["lam"]), 0, -np.sin(p["lam"])])
    by_hand = 0.0
    for mass, centre, tensor in (
        (p["mH"], (p["xH"], p["zH"]), [[p["IHxx"], 0, p["IHxz"]], [0, 0, 0], [p["IHxz"], 0, p["IHzz"]]]),
        (p["mF"], (p["w"], -p["rF"]), np.diag([p["IFxx"], 0, p["IFxx"]])),
    ):
        arm = np.array([centre[0] - joint_x, 0, centre[1] - joint_z])
        by_hand += axis @ np.array(tensor) @ axis + mass * np.linalg.norm(np.cross(axis, arm)) ** 2
    place = {"joint_x": joint_x, "joint_z": joint_z, "axis_tilt": p["lam"]}
    assert front_inertia(p, **place) == pytest.approx(by_hand, rel=1e-12)
    assert by_hand == pytest.approx(inertia, abs=6e-4)
    assert height_above_hub(p, joint_z) == pytest.approx(height, abs=1e-12)


def test_a_ratio_decays_by_as_much_a_cycle_as_its_definition_says():
    """The front on its hinge with the frame held: s^2 I + c s + k = 0 has the damping ratio that was given."""
    bicycle = load_bicycle("pista")
    values = effect("front_compliance", **HINGE, damping_ratio=0.07).values(bicycle.values)
    inertia = front_inertia(bicycle.values, joint_x=0.86, joint_z=-0.65, axis_tilt=bicycle["lam"])
    root = np.roots([inertia, values["front_compliance.damping"], 5000.0])[0]
    assert -root.real / abs(root) == pytest.approx(0.07, rel=1e-12)


def test_a_model_with_a_ratio_is_the_model_with_its_damping():
    bicycle = load_bicycle("pista")
    inertia = front_inertia(bicycle.values, joint_x=0.86, joint_z=-0.65, axis_tilt=bicycle["lam"])
    damping = float(0.2 * critical_damping(5000.0, inertia))
    by_ratio = Model(bicycle, (effect("front_compliance", **HINGE, damping_ratio=0.2),))
    by_damping = Model(bicycle, (effect("front_compliance", **HINGE, damping=damping),))
    assert by_ratio.parameters == by_damping.parameters
    assert "damping_ratio=0.2" in repr(by_ratio.effects[0])
    assert by_ratio.effects[0] != by_damping.effects[0]


def test_a_ratio_is_no_parameter_that_follows_the_bicycle_and_stays_in_a_file():
    model = Model(load_bicycle("pista"), (effect("front_compliance", **HINGE, damping_ratio=0.2),))
    assert model.tied == {"front_compliance.axis_tilt": "lam"}
    assert model.effects[0].table == {**HINGE, "damping_ratio": 0.2}


@pytest.mark.parametrize(
    ("kind", "values", "words"),
    [
        ("front_compliance", {"damping_ratio": 0.2, "damping": 20.0}, "damping and damping_ratio say the same; remove"),
        ("front_compliance", {"damping_ratio": -0.1}, "damping_ratio = -0.1 must be between 0 and 2"),
        ("front_compliance", {"damping_ratio": "stiff"}, "damping_ratio = 'stiff' must be between 0 and 2"),
        ("rider_lean", {"damping_ratio": 0.2}, "damping_ratio is not possible here; give damping in N m s/rad"),
    ],
)
def test_a_wrong_ratio_is_refused(kind, values, words):
    hinge = HINGE if kind == "front_compliance" else {}
    with pytest.raises(InputError, match=words):
        effect(kind, **hinge, **values)
