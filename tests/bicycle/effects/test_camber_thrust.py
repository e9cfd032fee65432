"""The part of the camber force that lags and the part that does not are one force in the steady state."""

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle

SPEEDS = np.array([2.0, 5.0, 9.0, 14.0])
SLIP = {"cornering_stiffness": {"rear": 6200.0, "front": 5400.0}}
CAMBER = {"rear": 900.0, "front": 700.0}


def roots(law, share, scale=1.0, **tyre):
    camber = effect_class("camber_thrust")(
        camber_stiffness={wheel: scale * value for wheel, value in CAMBER.items()}, lag_share=share
    )
    model = Model(load_bicycle("benchmark"), (effect_class(law)(**SLIP, **tyre), camber)).linear_model()
    return model.eigenvalues(SPEEDS)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_without_a_lag_it_does_not_matter_which_part_lags(share):
    np.testing.assert_allclose(roots("side_slip", share), roots("side_slip", 1.0), rtol=1e-7, atol=1e-7)
    assert not np.allclose(roots("side_slip", share), roots("side_slip", share, scale=0.5), rtol=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_with_a_lag_the_product_of_the_roots_does_not_depend_on_it(share):
    """At s = 0 nothing lags: the determinant of the system, which is the product of its roots, stays."""
    lagging = roots("relaxation_length", 1.0, relaxation_length=0.1)
    other = roots("relaxation_length", share, relaxation_length=0.1)
    assert not np.allclose(np.sort_complex(other), np.sort_complex(lagging), rtol=1e-3)
    np.testing.assert_allclose(other.prod(-1), lagging.prod(-1), rtol=1e-6)
