"""There is one MF6.1 fit: what a tyre map uses between its conditions is what the .tir file of the same data holds."""

import math

import numpy as np
import pytest

from tyre import MeasuredTable, TyreMap
from tyre.magic_formula.tir import read_tir
from tyre.magic_formula.tir_fit import fit_mf61
from tyre.magic_formula.tir_write import write_tir

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
    back = read_tir(tmp_path / "a.tir").file
    trends = tyre_map.cornering_stiffness_trend, tyre_map.lateral_stiffness_trend
    law = trends[0].parameters | trends[1].parameters
    assert {name: back.find(name) for name in NAMES} == {name: law[name] for name in NAMES}
    assert back.find("PKY1") == -law["PKY1"]  # ISO signs
    # the coefficients that the file holds, in the equations of Besselink, Schmeitz & Pacejka (2010)
    c = {name: float(back.find(name)) for name in ("PKY1", "PKY4", "PCFY2", *NAMES)}
    for load, pressure in ((340.0, 3.5e5), (420.0, 6.1e5), (600.0, 2.9e5), (250.0, 8e5)):
        dfz, dpi = load / c["FNOMIN"] - 1, pressure / c["NOMPRES"] - 1
        angle = math.atan(load / (c["PKY2"] * (1 + c["PPY2"] * dpi) * c["FNOMIN"]))
        kya = -c["PKY1"] * c["FNOMIN"] * (1 + c["PPY1"] * dpi) * math.sin(c["PKY4"] * angle)
        cy = c["LATERAL_STIFFNESS"] * (1 + c["PCFY1"] * dfz + c["PCFY2"] * dfz**2) * (1 + c["PCFY3"] * dpi)
        for trend, expected in zip(trends, (kya, cy), strict=True):
            value, _ = trend.evaluate(np.array([load]), np.array([pressure]))
            assert value[0] == pytest.approx(expected, rel=1e-12)


def test_the_fit_is_a_least_sum_of_squares():
    """Against a search that knows no derivatives; its own optimum must not be lower."""
    from scipy.optimize import minimize

    table = rough_table()
    trend = TyreMap(table).cornering_stiffness_trend
    p = trend.parameters

    def squares(x):
        dpi, fz = table.pressure / 5.5e5 - 1, table.load / 400.0
        kya = x[0] * 400 * (1 + x[2] * dpi) * np.sin(2 * np.arctan(fz / (x[1] * (1 + x[3] * dpi))))
        return float(((kya - table.cornering_stiffness) ** 2).sum()) / 1e4

    start = [p[name] for name in ("PKY1", "PKY2", "PPY1", "PPY2")]
    found = minimize(squares, start, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-10, "fatol": 1e-12})
    assert squares(start) <= found.fun * (1 + 1e-9)
    assert trend.misfit == pytest.approx(math.sqrt(1e4 * found.fun / 5), rel=1e-6)
