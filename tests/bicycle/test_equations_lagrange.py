"""The derivation of small motion against a chain of bodies in full motion, by Newton and Euler, that shares nothing."""

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import Model, available_bicycles, effect_class, load_bicycle
from tests.validation.blind.closing import build

TYRES = {"cornering_stiffness": {"rear": 7000.0, "front": 5500.0}, "relaxation_length": {"rear": 0.09, "front": 0.15}}
HINGE = {"joint_x": 0.75, "joint_z": -0.8, "stiffness": 4000.0, "damping": 12.0}


@pytest.mark.parametrize("effects", [{}, {"front_compliance": HINGE}], ids=["rigid", "flexible"])
@pytest.mark.parametrize("name", available_bicycles())
def test_eigenvalues_of_every_packaged_bicycle(name, effects):
    bicycle, effects = load_bicycle(name), {"relaxation_length": TYRES, **effects}
    model = Model(bicycle, [effect_class(key)(**table) for key, table in effects.items()]).linear_model()
    exact = build(bicycle.values, effects)
    assert bicycle.static_loads == pytest.approx(exact.coefficients.loads, rel=1e-12)
    for speed in (0.5, 4.0, 12.0):
        values = np.linalg.eigvals(exact.space(speed).matrix)
        assert_same_eigenvalues(model.eigenvalues(speed), values, rtol=1e-9, atol=1e-7)
