"""Eigenvalues and critical speeds of bicycles on tyres from two independent formulations that agree to 1e-13."""

import json
from pathlib import Path

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import Bicycle, Model, effect_class
from bicycle.stability import critical_speeds, modes

CASES = json.loads((Path(__file__).parent / "tyre_eigenvalues.json").read_text())["cases"]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: case["name"])
def case(request):
    effects = tuple(effect_class(name)(**table) for name, table in request.param["effects"].items())
    return request.param, Model(Bicycle(request.param["name"], request.param["bicycle"]), effects).linear_model()


def test_static_loads(case):
    expected, model = case
    np.testing.assert_allclose(
        model.static_loads, [expected["static_loads_N"][wheel] for wheel in ("rear", "front")], rtol=1e-12
    )


def test_eigenvalues_one_to_one(case):
    expected, model = case
    for speed, rows in expected["eigenvalues_by_speed_m_s"].items():
        reference = np.array([complex(*row) for row in rows])
        shown = [row[0][~np.isnan(row[0])] for row in modes(model, [float(speed)]).branches.values()]
        named = np.concatenate([np.concatenate([values, values[values.imag > 0].conj()]) for values in shown])
        for computed in (model.eigenvalues(float(speed)), named):
            assert_same_eigenvalues(computed, reference, rtol=5e-10, atol=5e-10, where=f"{speed} m/s")


def test_crossings_none_missing_none_extra(case):
    expected, model = case
    found = critical_speeds(model, float(expected["crossings_searched_up_to_m_s"]))
    oscillatory = [(c.speed, 2 * np.pi * c.frequency_hz) for c in found if c.kind == "oscillatory"]
    reference = sorted((c["speed_m_s"], c["frequency_rad_s"]) for c in expected["oscillatory_crossings"])
    assert len(oscillatory) == len(reference)
    np.testing.assert_allclose(np.ravel(oscillatory), np.ravel(reference), rtol=1e-9)
    real = [c.speed for c in found if c.kind == "real"]
    assert len(real) == len(expected["real_crossings_m_s"])
    np.testing.assert_allclose(real, sorted(expected["real_crossings_m_s"]), rtol=1e-9)
