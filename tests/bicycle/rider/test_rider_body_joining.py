"""Rigid bodies joined: against point masses, a bar of known inertia, and the packaged bicycle joined elsewhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bicycle import load_bicycle
from bicycle.rider import RigidBody, as_rear_frame, join, rear_frame


def point(mass, x, y, z):
    return RigidBody(mass, np.array([x, y, z]), np.zeros((3, 3)))


@given(arrays(float, (5, 4), elements=st.floats(0.1, 2.0)))
def test_point_masses_give_the_sums_by_definition(rows):
    masses, places = rows[:, 0], rows[:, 1:]
    found = join([point(m, *p) for m, p in zip(masses, places, strict=True)])
    arms = places - masses @ places / masses.sum()
    assert found.mass == pytest.approx(masses.sum())
    assert found.inertia[0, 2] == pytest.approx(-np.sum(masses * arms[:, 0] * arms[:, 2]), abs=1e-12)
    assert found.inertia[1, 1] == pytest.approx(np.sum(masses * (arms[:, 0] ** 2 + arms[:, 2] ** 2)))


def test_a_bar_leaning_forward_and_up_has_a_positive_product_of_inertia():
    """Head before and above the hips (x > 0 where z < 0): Ixz = -sum m x z > 0; thin bar m l^2 / 12."""
    mass, length, lean = 10.0, 1.2, 0.6
    along = np.linspace(-0.5, 0.5, 2001)[:-1] + 1 / 4000
    bar = join([point(mass / 2000, length * s * np.sin(lean), 0, -length * s * np.cos(lean)) for s in along])
    own = mass * length**2 / 12
    assert bar.inertia[0, 2] == pytest.approx(own * np.sin(lean) * np.cos(lean), rel=1e-6)
    assert bar.inertia[0, 0] == pytest.approx(own * np.cos(lean) ** 2, rel=1e-6)


def test_rear_frame_and_rider_of_the_davis_bicycle_join_as_packaged():
    """rigid_rider_joined gives the Whipple coefficients of Moore (2012), which fixes the sign of IBxz."""
    parts = [rear_frame(load_bicycle(name).values) for name in ("rigid", "rigid_rider")]
    expected = load_bicycle("rigid_rider_joined")
    for key, value in as_rear_frame(join(parts)).items():
        assert value == pytest.approx(expected[key], rel=1e-8)
