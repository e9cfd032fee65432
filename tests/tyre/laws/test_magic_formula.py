"""The Magic Formula against its definition, its derivative and its limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tyre import MeasuredTable, TyreMap
from tyre.laws import fit_mf61, normalised_lateral_force, normalised_lateral_force_slope, read_tir, write_tir

coefficients = st.fixed_dictionaries({
    "stiffness_factor": st.floats(1.0, 30.0), "shape_factor": st.floats(0.5, 2.0), "peak_factor": st.floats(0.2, 1.5),
    "curvature_factor": st.floats(-5.0, 1.0), "horizontal_shift": st.floats(-0.02, 0.02),
})  # fmt: skip


def test_one_value_by_hand() -> None:
    """B 10, C 1.3, D 1, E 0.5 at 0.1 rad: B x = 1, argument 1 - 0.5 (1 - pi/4), then sin(1.3 atan(.))."""
    argument = 1 - 0.5 * (1 - math.pi / 4)
    expected = math.sin(1.3 * math.atan(argument)) + 0.02
    force = normalised_lateral_force(
        0.1, stiffness_factor=10, shape_factor=1.3, peak_factor=1, curvature_factor=0.5, vertical_shift=0.02
    )
    assert force == pytest.approx(expected, rel=1e-15)


def test_sine_of_arctangent_closed_form() -> None:
    """C = 2, E = 0: sin(2 atan u) = 2 u / (1 + u^2), with its peak D at u = 1."""
    slip = np.linspace(-0.5, 0.5, 11)
    force = normalised_lateral_force(slip, stiffness_factor=5, shape_factor=2, peak_factor=0.9, curvature_factor=0)
    np.testing.assert_allclose(force, 0.9 * 10 * slip / (1 + 25 * slip**2), rtol=1e-14, atol=1e-16)


@settings(max_examples=60)
@given(coefficients, st.floats(-0.15, 0.15))
def test_slope_is_the_derivative(values: dict[str, float], slip: float) -> None:
    step = 1e-6
    difference = normalised_lateral_force(slip + step, **values) - normalised_lateral_force(slip - step, **values)
    slope = normalised_lateral_force_slope(slip, **values)
    assert difference / (2 * step) == pytest.approx(float(slope), abs=2e-6 * values["stiffness_factor"] ** 2)


NAMES = ("PKY2", "PPY1", "PPY2", "LATERAL_STIFFNESS", "PCFY1", "PCFY3", "FNOMIN", "NOMPRES")


def rough_table():
    rng = np.random.default_rng(8)
    load, pressure = (grid.ravel() for grid in np.meshgrid([340.0, 400.0, 490.0], [3.5e5, 5.5e5, 7.5e5]))
    return MeasuredTable(
        tyre="rough", surface="flat", load=load, pressure=pressure, synthetic=True,
        cornering_stiffness=6000 * (load / 400) ** 0.6 * (1 + 0.03 * rng.standard_normal(9)),
        lateral_stiffness=(4e4 + 4e-2 * pressure) * (1 + 0.1 * rng.standard_normal(9)),
        lateral_stiffness_sd=np.full(9, 1000.0),
    )  # fmt: skip


@pytest.mark.parametrize("tyre", ["Tyre1", "Tyre2", "Tyre3", "rough"])
def test_the_law_of_a_table_is_its_tir_file(tmp_path, tyre):
    tyre_map = TyreMap(rough_table()) if tyre == "rough" else TyreMap.load(tyre)
    m = tyre_map.measured
    model = fit_mf61(
        load=m.load, pressure=m.pressure, cornering_stiffness=m.cornering_stiffness,
        lateral_stiffness=m.lateral_stiffness,
    )  # fmt: skip
    write_tir(model, tmp_path / "a.tir", tyre=tyre, surface="flat", unloaded_radius=0.336)
    back = read_tir(tmp_path / "a.tir").file.values
    trends = tyre_map.cornering_stiffness_trend, tyre_map.lateral_stiffness_trend
    law = trends[0].parameters | trends[1].parameters
    assert {name: back[name] for name in NAMES} == {name: law[name] for name in NAMES}
    assert back["PKY1"] == -law["PKY1"]  # ISO signs
    # the coefficients that the file holds, in the equations of Besselink, Schmeitz & Pacejka (2010)
    c = {name: float(back[name]) for name in ("PKY1", "PKY4", "PCFY2", *NAMES)}
    for load, pressure in ((340.0, 3.5e5), (420.0, 6.1e5), (600.0, 2.9e5), (250.0, 8e5)):
        dfz, dpi = load / c["FNOMIN"] - 1, pressure / c["NOMPRES"] - 1
        angle = math.atan(load / (c["PKY2"] * (1 + c["PPY2"] * dpi) * c["FNOMIN"]))
        kya = -c["PKY1"] * c["FNOMIN"] * (1 + c["PPY1"] * dpi) * math.sin(c["PKY4"] * angle)
        cy = c["LATERAL_STIFFNESS"] * (1 + c["PCFY1"] * dfz + c["PCFY2"] * dfz**2) * (1 + c["PCFY3"] * dpi)
        for trend, expected in zip(trends, (kya, cy), strict=True):
            value, _ = trend.evaluate(np.array([load]), np.array([pressure]))
            assert value[0] == pytest.approx(expected, rel=1e-12)
