"""One bicycle after another: from some number on by the kernels, the same; where they cannot, by the plain path."""

from functools import cache
from itertools import count

import numpy as np
import pytest
import wobble_onsets

pytest.importorskip("numba")

from bicycle.critical import critical_speeds as module
from bicycle.critical import single
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.critical.pencil import crossings_by_pencil
from tyre.base.errors import InputError

COMPLIANCE = wobble_onsets.COMPLIANCE
TYRE = {"cornering_stiffness": 6300.0, "relaxation_length": 0.1}


@pytest.fixture
def kernels(monkeypatch):
    """As in a program that has asked for many bicycles, where the kernels are compiled."""
    monkeypatch.setattr(single, "_asked", count(single.CALLS + 1))
    monkeypatch.setattr(single, "_compiled_before", cache(lambda: True))


@pytest.fixture
def judged(monkeypatch):
    """How many times the plain path was asked."""
    asked = []

    def by_pencil(model, max_speed):
        asked.append(max_speed)
        return crossings_by_pencil(model, max_speed)

    monkeypatch.setattr(module, "crossings_by_pencil", by_pencil)
    return asked


@pytest.mark.parametrize("bicycle", ["benchmark", "pista_rider", "browser"])
@pytest.mark.parametrize(
    "effects",
    [{}, {"relaxation_length": TYRE}, {"relaxation_length": TYRE, "front_compliance": wobble_onsets.COMPLIANCE}],
)
@pytest.mark.parametrize("max_speed", [4.5, 60.0])
def test_it_is_the_same_bicycle_by_the_kernels(tyred, kernels, judged, bicycle, effects, max_speed):
    model = tyred(bicycle, **effects)
    found, plain = critical_speeds(model, max_speed), crossings_by_pencil(model, max_speed)
    assert judged == []
    assert [(c.mode, c.kind, c.direction) for c in found] == [(c.mode, c.kind, c.direction) for c in plain]
    np.testing.assert_allclose([c.speed for c in found], [c.speed for c in plain], rtol=0, atol=1e-9)
    np.testing.assert_allclose([c.frequency_hz for c in found], [c.frequency_hz for c in plain], rtol=0, atol=1e-8)


def test_one_of_which_they_are_not_sure_is_judged(synthetic, kernels, judged):
    """Roots 0 and -20 at all speeds, and v - 7."""
    model = synthetic({0: np.diag([0.0, -7.0, -20.0]), 1: np.diag([0.0, 1.0, 0.0])})
    assert [c.speed for c in critical_speeds(model, 20.0)] == [pytest.approx(7.0)]
    assert judged == [20.0]


def test_one_whose_equations_switch_is_judged(synthetic, kernels, judged):
    """Root v - 3 below 5 m/s and v - 4 above."""
    below, above = ({0: np.diag([-far, -20.0]), 1: np.diag([1.0, 0.0])} for far in (3.0, 4.0))
    assert [c.speed for c in critical_speeds(synthetic(below, above, borders=(5.0,)), 20.0)] == [pytest.approx(3.0)]
    assert judged == [20.0]


def test_nothing_is_critical_next_to_rest(tyred, kernels):
    assert critical_speeds(tyred(), 1e-9) == ()


def test_too_fast_is_refused_alike(tyred, kernels):
    with pytest.raises(InputError, match="max_speed = 1e\\+06 m/s is not allowed"):
        critical_speeds(tyred(), 1e6)


def test_few_are_not_worth_the_kernels(tyred, monkeypatch, judged):
    monkeypatch.setattr(single, "_asked", count(1))
    monkeypatch.setattr(single, "_compiled_before", cache(lambda: True))
    for _ in range(single.CALLS + 2):
        critical_speeds(tyred(), 10.0)
    assert len(judged) == single.CALLS - 1


def test_a_worker_computes_all_bicycles_alike(tyred, kernels, monkeypatch, judged):
    monkeypatch.setattr(single, "parent_process", lambda: "the main process")
    critical_speeds(tyred(), 10.0)
    assert judged == [10.0]


def test_nothing_is_compiled_for_it(tyred, monkeypatch, judged):
    """Kernels that are not compiled are asked for now and then: another process may compile them."""
    kept = []
    monkeypatch.setattr(single, "_asked", count(1))
    monkeypatch.setattr("bicycle.eigenvalues.compilation.all_kept", lambda: kept.append(len(judged)) or False)
    single._compiled_before.cache_clear()
    for _ in range(2 * single.CALLS + 1):
        critical_speeds(tyred(), 10.0)
    assert len(judged) == 2 * single.CALLS + 1
    assert kept == [single.CALLS - 1, 2 * single.CALLS - 1]
    single._compiled_before.cache_clear()
