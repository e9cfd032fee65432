"""The Magic Formula against its definition, its derivative and its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tyre.magic_formula.side_force import cornering_stiffness, normalised_side_force, normalised_side_force_slope

coefficients = st.fixed_dictionaries(
    {
        "stiffness_factor": st.floats(1.0, 30.0),
        "shape_factor": st.floats(0.5, 2.0),
        "peak_factor": st.floats(0.2, 1.5),
        "curvature_factor": st.floats(-5.0, 1.0),
        "horizontal_shift": st.floats(-0.02, 0.02),
    }
)


def test_one_value_by_hand() -> None:
    """B 10, C 1.3, D 1, E 0.5 at 0.1 rad: B x = 1, argument 1 - 0.5 (1 - pi/4), then sin(1.3 atan(.))."""
    argument = 1 - 0.5 * (1 - math.pi / 4)
    expected = math.sin(1.3 * math.atan(argument)) + 0.02
    force = normalised_side_force(
        0.1, stiffness_factor=10, shape_factor=1.3, peak_factor=1, curvature_factor=0.5, vertical_shift=0.02
    )
    assert force == pytest.approx(expected, rel=1e-15)


def test_sine_of_arctangent_closed_form() -> None:
    """C = 2, E = 0: sin(2 atan u) = 2 u / (1 + u^2), with its peak D at u = 1."""
    slip = np.linspace(-0.5, 0.5, 11)
    force = normalised_side_force(slip, stiffness_factor=5, shape_factor=2, peak_factor=0.9, curvature_factor=0)
    np.testing.assert_allclose(force, 0.9 * 10 * slip / (1 + 25 * slip**2), rtol=1e-14, atol=1e-16)


@settings(max_examples=60)
@given(coefficients, st.floats(-0.15, 0.15))
def test_slope_is_the_derivative(values: dict[str, float], slip: float) -> None:
    step = 1e-6
    difference = normalised_side_force(slip + step, **values) - normalised_side_force(slip - step, **values)
    slope = normalised_side_force_slope(slip, **values)
    assert difference / (2 * step) == pytest.approx(float(slope), abs=2e-6 * values["stiffness_factor"] ** 2)


@settings(max_examples=40)
@given(coefficients, st.floats(100.0, 1000.0))
def test_cornering_stiffness_is_the_slope_of_the_force(values: dict[str, float], load: float) -> None:
    origin = -values["horizontal_shift"]
    slope = float(normalised_side_force_slope(origin, **values)) * load
    factors = {name: values[name] for name in ("stiffness_factor", "shape_factor", "peak_factor")}
    assert cornering_stiffness(**factors, vertical_load=load) == pytest.approx(slope, rel=1e-9)


def test_odd_without_shifts_and_broadcast_over_coefficients() -> None:
    slip = np.linspace(-0.07, 0.07, 15)
    peaks = np.array([[0.8], [1.0]])
    force = normalised_side_force(slip, stiffness_factor=12, shape_factor=1.2, peak_factor=peaks, curvature_factor=-1)
    assert force.shape == (2, 15)
    np.testing.assert_allclose(force, -force[:, ::-1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(force[0], 0.8 * force[1], rtol=1e-14)
