"""The Whipple bicycle of Meijaard, Papadopoulos, Ruina & Schwab (2007), doi 10.1098/rspa.2007.1857."""

import json
from pathlib import Path

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import Bicycle, Model
from bicycle.stability import critical_speeds, modes
from tests.shared.published_bicycle import C1, K0, K2, G, M

TABLE = json.loads((Path(__file__).parent / "meijaard2007.json").read_text())


@pytest.fixture(scope="module")
def whipple():
    return Model(Bicycle("benchmark", TABLE["parameters"])).linear_model()


def test_canonical_matrices(whipple):
    assert whipple.states == ("lean_rate", "steer_rate", "lean", "steer")
    matrices = whipple.ranges[0].matrices
    zero = np.zeros((4, 4))
    constant, linear, square = (matrices.dynamics.get(power, zero) for power in (0, 1, 2))
    for computed, published in (
        (matrices.mass[:2, :2], M),
        (-linear[:2, :2], C1),
        (-constant[:2, 2:] / G, K0),
        (-square[:2, 2:], K2),
    ):
        np.testing.assert_allclose(computed, published, rtol=1e-12, atol=1e-12)
    assert np.abs(constant[:2, :2]).max() == 0
    assert np.abs(linear[:2, 2:]).max() == 0


def test_eigenvalues_at_rest(whipple):
    assert_same_eigenvalues(whipple.eigenvalues(0.0), TABLE["at_zero_speed"], rtol=1e-7, atol=1e-10)


@pytest.mark.parametrize("row", TABLE["eigenvalues"], ids=lambda row: f"{row['speed_m_s']:g}")
def test_named_eigenvalues(whipple, row):
    found = modes(whipple, [row["speed_m_s"]])
    assert set(found.branches) == {"weave", "capsize", "castering"}
    for name in ("weave", "capsize", "castering"):
        (values,) = found.to_dict()[name]
        expected = np.atleast_1d(row[name])
        assert len(values) == 1
        np.testing.assert_allclose(values[0][: len(expected)], expected, atol=1e-10)
    assert found.to_dict()["capsize"][0][0][1] == 0


def test_weave_is_the_two_positive_roots_before_they_meet(whipple):
    found = modes(whipple, [0.0])
    np.testing.assert_allclose(found.branch("weave")[0], TABLE["at_zero_speed"][:1:-1], atol=1e-10)
    np.testing.assert_allclose(found.branch("castering")[0, 0], TABLE["at_zero_speed"][0], atol=1e-10)
    np.testing.assert_allclose(found.branch("capsize")[0, 0], TABLE["at_zero_speed"][1], atol=1e-10)


def test_double_root(whipple):
    (event,) = modes(whipple, np.linspace(0, 10, 11)).events
    assert (event.kind, event.modes) == ("merge", ("weave",))
    assert event.speed == pytest.approx(TABLE["double_root"]["speed_m_s"], abs=1e-10)
    assert event.eigenvalue == pytest.approx(TABLE["double_root"]["eigenvalue"], abs=1e-10)


def test_weave_and_capsize_speed(whipple):
    weave, capsize = critical_speeds(whipple)
    assert (weave.mode, weave.kind, weave.direction) == ("weave", "oscillatory", "stabilising")
    assert weave.speed == pytest.approx(TABLE["weave_speed_m_s"], abs=1e-10)
    assert 2 * np.pi * weave.frequency_hz == pytest.approx(TABLE["weave_frequency_rad_s"], abs=1e-10)
    assert (capsize.mode, capsize.kind, capsize.direction) == ("capsize", "real", "destabilising")
    assert capsize.speed == pytest.approx(TABLE["capsize_speed_m_s"], abs=1e-10)
