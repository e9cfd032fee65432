"""Derivatives of the matrices times vectors, against differences of whole matrices at every true speed."""

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from studies.missing_effect.motion.candidates import find_candidates
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.motion.phenomenological_terms import feedback_terms
from studies.missing_effect.motion.sensor_errors import speed_errors
from studies.missing_effect.motion.slopes import Slopes

TYRE = {"cornering_stiffness": {"rear": 6000.0, "front": 4500.0}, "relaxation_length": 0.1}
SPEEDS = np.array([3.1, 4.7, 6.5])


@pytest.fixture(scope="module")
def library():
    model = Model(load_bicycle("pista"), (effect_class("relaxation_length")(**TYRE),))
    further = (*speed_errors(SPEEDS), *feedback_terms())
    return model, {c.identifier: c for c in (*find_candidates(model, {}, also=("steer_assist",))[0], *further)}


def family_of(library, names):
    model, known = library
    return Family(model, nuisances(model, {})[0], tuple(known[name] for name in names))


@pytest.mark.parametrize(
    "names", [(), ("speed_offset", "speed_scale"), ("steer_assist", "speed_offset"), ("lean torque from steer rate",)]
)
def test_products_are_those_of_differences_of_the_matrices(library, names):
    """Speeds move the powers of v, a motor fades out at 5.1 m/s, a feedback multiplies two polynomials."""
    family, rng = family_of(library, names), np.random.default_rng(4)
    theta = np.array(
        [u.centre for u in family.nuisances] + [u.centre + 0.1 * u.scale for c in family.candidates for u in c.unknowns]
    )
    bicycle = Slopes(family, theta, SPEEDS)
    batch, steps = family.stencil(theta)
    whole, p, at = family(batch, SPEEDS), len(steps), np.array([2, 0, 0, 1, 2])
    s = rng.normal(size=5) + 1j * rng.normal(size=5)

    def slope(part):
        return np.moveaxis((part[1 : p + 1] - part[p + 1 :]) / (2 * steps[:, None, None, None]), 0, 1)[at]

    def vectors(part):
        return rng.normal(size=(5, part.shape[-1], 2)) + 1j * rng.normal(size=(5, part.shape[-1], 2))

    for name in ("dynamics", "input", "output"):
        part, rows = getattr(whole, name), [1, 0]
        x = vectors(part)
        exact = slope(part) @ x[:, None]
        assert np.abs(exact).max() > 0 or name != "dynamics"
        near = 1e-7 * np.abs(exact).max() + 1e-9 * np.abs(part).max()
        np.testing.assert_allclose(bicycle.applied(name, at, x), exact, rtol=0, atol=near)
        np.testing.assert_allclose(bicycle.applied(name, at, x, rows), exact[:, :, rows], rtol=0, atol=near)
        np.testing.assert_allclose(getattr(bicycle.system, name)[0], part[0], rtol=1e-14)
    x = vectors(whole.mass)
    exact = (slope(whole.dynamics) - s[:, None, None, None] * slope(whole.mass)) @ x[:, None]
    np.testing.assert_allclose(bicycle.force(at, x, s), exact, rtol=0, atol=1e-7 * np.abs(exact).max())
