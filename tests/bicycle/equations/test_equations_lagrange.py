"""The derivation from a small-motion chain of bodies against Lagrange's equations with exact rotations."""

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from lagrange import LagrangeBicycle

from bicycle import Model, available_bicycles, effect_class, load_bicycle

STIFFNESS, LENGTH = {"rear": 7000.0, "front": 5500.0}, {"rear": 0.09, "front": 0.15}
HINGE = {"x": 0.75, "z": -0.8, "stiffness": 4000.0, "damping": 12.0}


@pytest.mark.parametrize("flexible", [False, True], ids=["rigid", "flexible"])
@pytest.mark.parametrize("name", available_bicycles())
def test_eigenvalues_of_every_packaged_bicycle(name, flexible):
    bicycle = load_bicycle(name)
    effects = [effect_class("relaxation_length")(cornering_stiffness=STIFFNESS, relaxation_length=LENGTH)]
    if flexible:
        place = {"joint_x": HINGE["x"], "joint_z": HINGE["z"]}
        how = {key: HINGE[key] for key in ("stiffness", "damping")}
        effects.append(effect_class("front_compliance")(**place, **how))
    model = Model(bicycle, effects).linear_model()
    exact = LagrangeBicycle(
        bicycle.values, stiffness=tuple(STIFFNESS.values()), length=tuple(LENGTH.values()),
        hinge=HINGE if flexible else None,
    )  # fmt: skip
    assert bicycle.static_loads == pytest.approx(exact.loads, rel=1e-12)
    for speed in (0.5, 4.0, 12.0):
        values = np.linalg.eigvals(exact.state_matrix(speed))
        values = values[np.argsort(np.abs(values))[2:]]  # without lateral place and heading, of which nothing depends
        assert_same_eigenvalues(model.eigenvalues(speed), values, rtol=1e-6, atol=1e-5)
