"""Solids of known mass, centre and inertia."""

import math

import numpy as np
import pytest

from bicycle.rider.solids import half_ellipsoid, stadium_solid

FOOT, TOP, AS_IS = np.zeros(3), np.array([0, 0, 0.4]), np.eye(3)


def solid(**changes):
    given = {
        "thickness": (0.0, 0.0), "radius": (0.1, 0.1), "start": FOOT, "end": TOP, "turn": AS_IS, "density": 1000.0
    }  # fmt: skip
    return stadium_solid(**{**given, **changes})


def test_a_cylinder():
    found, mass = solid(), 1000 * math.pi * 0.1**2 * 0.4
    side = mass * (3 * 0.1**2 + 0.4**2) / 12
    assert found.mass == pytest.approx(mass)
    np.testing.assert_allclose(found.centre, [0, 0, 0.2])
    np.testing.assert_allclose(found.inertia, np.diag([side, side, mass * 0.1**2 / 2]))


def test_a_cone_has_its_centre_at_a_quarter_and_the_other_way_round_at_three_quarters():
    for radius, share in (((0.1, 0.0), 0.25), ((0.0, 0.1), 0.75)):
        found = solid(radius=radius)
        assert found.mass == pytest.approx(1000 * math.pi * 0.1**2 * 0.4 / 3)
        np.testing.assert_allclose(found.centre, [0, 0, share * 0.4])
        assert found.inertia[2, 2] == pytest.approx(0.3 * found.mass * 0.1**2)
        assert found.inertia[0, 0] == pytest.approx(3 / 80 * found.mass * (4 * 0.1**2 + 0.4**2))


def test_a_flat_stadium_is_nearly_a_plate_and_its_long_side_turns_with_it():
    wide = solid(thickness=(0.3, 0.3), radius=(0.001, 0.001))
    mass = 1000 * 0.4 * (0.6 * 0.002 + math.pi * 1e-6)
    assert wide.mass == pytest.approx(mass)
    assert wide.inertia[0, 0] == pytest.approx(mass * 0.4**2 / 12, rel=1e-3)
    assert wide.inertia[2, 2] == pytest.approx(mass * 0.6**2 / 12, rel=1e-2)
    forward = solid(thickness=(0.3, 0.3), radius=(0.001, 0.001), long_side_forward=True)
    np.testing.assert_allclose(np.diag(forward.inertia), np.diag(wide.inertia)[[1, 0, 2]])


def test_a_half_sphere_has_its_centre_at_three_eighths():
    found = half_ellipsoid(radius=0.1, start=FOOT, end=TOP / 4, turn=AS_IS, density=1000.0)
    assert found.mass == pytest.approx(1000 * 2 / 3 * math.pi * 0.1**3)
    np.testing.assert_allclose(found.centre, [0, 0, 0.0375])
    assert found.inertia[2, 2] == pytest.approx(0.4 * found.mass * 0.1**2)
    assert found.inertia[0, 0] == pytest.approx((0.4 - 9 / 64) * found.mass * 0.1**2)


def test_turning_keeps_the_principal_inertias_and_gives_the_sign_of_a_leaning_bar():
    c, s = math.cos(0.5), math.sin(0.5)  # the axis leans to +x: turn about y
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    found = solid(turn=turn, end=turn @ TOP)
    np.testing.assert_allclose(np.linalg.eigvalsh(found.inertia), np.sort(np.diag(solid().inertia)))
    assert found.inertia[0, 2] < 0  # mass at x z > 0: the entry is minus the product
