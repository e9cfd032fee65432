"""Defaults and usual sizes that the documentation names, and published ones."""

import re

import numpy as np
import pytest
from built import linear

from bicycle import effect_class
from studies.diagnosis import PAIRS, SpeedScale, candidate

SQUARE_FOOT = 0.3048**2  # m^2 in a square foot


def words(identifier):
    return " ".join(effect_class(identifier).description.split())


def test_the_air_is_that_of_the_standard_atmosphere():
    """p / (R T) at 101325 Pa and 15 °C, R = 287.05 J/(kg K) (ISO 2533)."""
    drag = effect_class("aerodynamic_drag")(drag_area=0.4, centre_of_pressure_z=-1.0)
    assert drag.air_density == pytest.approx(101325 / (287.05 * 288.15), rel=2e-4)


@pytest.mark.parametrize(
    ("coefficient", "square_feet", "usual"),
    [(1.1, 5.5, True), (1.0, 4.3, True), (0.88, 3.9, True), (0.83, 3.9, True), (0.70, 4.1, False)],
    ids=["upright commuter", "touring", "racer, crouched", "with aerodynamic components", "behind a fairing"],
)
def test_published_drag_areas_of_riders_without_a_fairing_are_usual(coefficient, square_feet, usual):
    """Gross, Kyle & Malewicki (1983), Scientific American 249(6), table of drag coefficients and frontal areas."""
    area = coefficient * square_feet * SQUARE_FOOT
    drag = effect_class("aerodynamic_drag")(drag_area=area, centre_of_pressure_z=-1.0)
    assert ("drag_area" in drag.doubts()) != usual


def test_a_tyre_without_a_number_is_round_and_as_wide_as_its_description_says():
    (width,) = re.findall(r"Without a number the tyre is (\d+) mm wide", words("crown_radius"))
    crowns = {"crown_radius": float(width) / 2e3}, {}
    told, assumed = (linear(crown_radius=crown).state_matrix(5.0) for crown in crowns)
    np.testing.assert_allclose(assumed, told, rtol=1e-12)


def test_the_prior_of_an_unmodelled_torque_is_of_the_usual_sizes_that_its_description_names():
    """One sd of the constant is the usual size; of change over half the range of speed and of curvature, half of it."""
    text = words("unmodelled_torque")
    steer = re.search(r"steer torque (\d+) N m/rad of lean, (\d+) of steer, (\d+) and (\d+) N m s/rad", text).groups()
    lean = re.search(r"of the lean torque (\d+), (\d+), (\d+) and (\d+);", text).groups()
    found = iter(candidate(dict.fromkeys(PAIRS, 3), SpeedScale(5.0, 2.0, 3)).unknowns)
    for size in map(float, (*steer, *lean)):
        assert [next(found).scale for _ in range(3)] == [size, size / 2, size / 2]
