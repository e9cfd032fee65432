"""Physics of the TOY luggage against limits computed by hand, and weight that an effect adds."""

from pathlib import Path

import numpy as np
import pytest

from bicycle import Effect, Model, effect_class, load_bicycle
from bicycle.effects import outside_effects
from bicycle.parameters import Body

PANNIER = Path(__file__).with_name("pannier.py")

BOX = {"mass": 8.0, "x": -0.1, "z": -0.55, "gyration": 0.15, "joint_z": -0.75}
G = 9.81


@pytest.fixture
def pannier():
    with outside_effects([PANNIER]):
        yield effect_class("pannier")


def loaded(bicycle):
    """The bicycle with the box fixed to its rear frame: masses add, inertias by the parallel-axis theorem."""
    p = bicycle.values
    m, k = BOX["mass"], BOX["gyration"]
    total = p["mB"] + m
    x, z = (p["mB"] * p["xB"] + m * BOX["x"]) / total, (p["mB"] * p["zB"] + m * BOX["z"]) / total
    parts = [(p["mB"], p["xB"] - x, p["zB"] - z), (m, BOX["x"] - x, BOX["z"] - z)]
    return bicycle.replace(
        mB=total, xB=x, zB=z,
        IBxx=p["IBxx"] + m * k**2 + sum(mass * dz**2 for mass, _, dz in parts),
        IBzz=p["IBzz"] + m * k**2 + sum(mass * dx**2 for mass, dx, _ in parts),
        IBxz=p["IBxz"] - sum(mass * dx * dz for mass, dx, dz in parts),
    )  # fmt: skip


def test_a_stiff_hinge_is_luggage_fixed_to_the_frame(pannier):
    rigid = loaded(load_bicycle("benchmark"))
    expected = Model(rigid).linear_model().eigenvalues(5.0)
    errors = []
    for stiffness in (1e6, 1e7, 1e8):
        found = Model(rigid, pannier(**BOX, stiffness=stiffness, damping=0.0)).linear_model().eigenvalues(5.0)
        slow = found[np.abs(found) < 100]
        errors.append(np.abs(np.sort_complex(slow) - expected).max())
    assert errors[0] < 1e-3
    np.testing.assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 10, rtol=0.02)  # as 1 / stiffness


def test_a_body_that_an_effect_adds_weighs_on_the_wheels():
    class Rack(Effect):
        """TOY: the box, fixed."""

        identifier = "rack"

        def apply(self, model):
            inertia = BOX["mass"] * BOX["gyration"] ** 2
            model.add_body(Body("box", BOX["mass"], BOX["x"], BOX["z"], inertia, inertia))

    bare = load_bicycle("benchmark")
    tyre = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
    for law in ((), (tyre,)):
        added, expected = Model(bare, (Rack(), *law)).linear_model(), Model(loaded(bare), law).linear_model()
        np.testing.assert_allclose(added.eigenvalues([2.0, 8.0]), expected.eigenvalues([2.0, 8.0]), rtol=1e-9)
        np.testing.assert_allclose(added.static_loads, expected.static_loads, rtol=1e-12)
    front = BOX["mass"] * G * BOX["x"] / bare["w"]  # moments about the rear contact
    assert added.static_loads[1] - bare.static_loads[1] == pytest.approx(front, rel=1e-12)


def test_a_free_hinge_is_a_pendulum(pannier):
    """With the rest held, the row of the hinge alone: (I + m h^2) q'' + c q' + (k + m g h) q = 0."""
    height = BOX["z"] - BOX["joint_z"]
    rigid = loaded(load_bicycle("benchmark"))
    for stiffness in (0.0, 60.0):
        linear = Model(rigid, pannier(**BOX, stiffness=stiffness, damping=0.5)).linear_model()
        rate, angle = linear.states.index("pannier_rate"), linear.states.index("pannier")
        matrices = linear.ranges[0].matrices
        inertia, dynamics = matrices.mass[rate, rate], matrices.dynamics[0][rate]
        assert inertia == pytest.approx(BOX["mass"] * (BOX["gyration"] ** 2 + height**2), rel=1e-12)
        assert -dynamics[angle] == pytest.approx(stiffness + BOX["mass"] * G * height, rel=1e-9)
        assert -dynamics[rate] == pytest.approx(0.5, rel=1e-12)
