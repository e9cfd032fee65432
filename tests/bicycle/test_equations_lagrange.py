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


@pytest.mark.parametrize("spin", [0.0, 150.0])
@pytest.mark.parametrize("together", [False, True], ids=["alone", "together"])
@pytest.mark.parametrize("name", ["benchmark", "pista_rider", "balanceassistv1"])
def test_rear_hinge_rotor_and_overturning_moment(name, together, spin):
    """Each by itself, and all of them with a flexible front; a rotor's fixed spin is a ratio at one speed."""
    bicycle, speed = load_bicycle(name), 6.0
    rear = {"x": 0.4, "z": -0.25, "tilt": 0.2, "stiffness": 6000.0, "damping": 8.0}
    ratio = 3.0 + spin * bicycle["rR"] / speed
    law = effect_class("relaxation_length")(cornering_stiffness=STIFFNESS, relaxation_length=LENGTH)
    built = {
        "rear_hinge": effect_class("rear_compliance")(
            joint_x=0.4, joint_z=-0.25, axis_tilt=0.2, stiffness=6000.0, damping=8.0
        ),
        "rotor": effect_class("rotating_mass")(inertia=0.05, ratio=3.0, spin=spin),
        "overturning": effect_class("overturning_moment")(
            overturning_stiffness={"rear": 3.0, "front": -2.0}, arm=0.004
        ),
    }
    exact = {"rear_hinge": {"rear_hinge": rear}, "rotor": {"rotor": (0.05, ratio)},
             "overturning": {"overturning": (3.0, -2.0), "arm": 0.004}}  # fmt: skip
    cases = [tuple(built)] if together else [(key,) for key in built]
    for keys in cases:
        effects, how = [law, *(built[key] for key in keys)], {}
        for key in keys:
            how |= exact[key]
        if together:
            place = {"joint_x": HINGE["x"], "joint_z": HINGE["z"]}
            effects.append(effect_class("front_compliance")(**place, stiffness=4000.0, damping=12.0))
            how |= {"hinge": HINGE}
        expected = LagrangeBicycle(
            bicycle.values, stiffness=tuple(STIFFNESS.values()), length=tuple(LENGTH.values()), **how
        ).state_matrix(speed)
        values = np.linalg.eigvals(expected)
        values = values[np.argsort(np.abs(values))[2:]]
        found = Model(bicycle, effects).linear_model().eigenvalues(speed)
        assert_same_eigenvalues(found, values, rtol=1e-6, atol=1e-5)
