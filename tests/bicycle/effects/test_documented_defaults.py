"""Defaults that the documentation names."""

import pytest

from bicycle import effect_class


def test_the_air_is_that_of_the_standard_atmosphere():
    """p / (R T) at 101325 Pa and 15 °C, R = 287.05 J/(kg K) (ISO 2533)."""
    drag = effect_class("aerodynamic_drag")(drag_area=0.4, centre_of_pressure_z=-1.0)
    assert drag.air_density == pytest.approx(101325 / (287.05 * 288.15), rel=2e-4)


def test_the_damper_of_a_model_without_a_number():
    assert effect_class("steer_damper")().damping == 0.5
    assert "default 0.5" in " ".join(effect_class("steer_damper").__doc__.split())
