"""Critical speeds of many bicycles at once: those of pencil and track of each, or a reason why not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("numba")

from bicycle import Model, effect_class, load_bicycle
from bicycle.critical.batch import critical_speeds_of
from bicycle.critical.pencil import crossings_by_pencil
from bicycle.modal.block import Block


def built(trail=0.08, mass=85.0, **effects):
    bicycle = load_bicycle("benchmark").replace(c=trail, mB=mass)
    return Model(bicycle, tuple(effect_class(name)(**table) for name, table in effects.items())).linear_model()


def tyre(length, stiffness=6300.0):
    return {"relaxation_length": {"cornering_stiffness": stiffness, "relaxation_length": length}}


def assert_same(found, judged):
    assert [(c.mode, c.kind, c.direction) for c in found] == [(c.mode, c.kind, c.direction) for c in judged]
    np.testing.assert_allclose([c.speed for c in found], [c.speed for c in judged], rtol=0, atol=1e-9)
    np.testing.assert_allclose([c.frequency_hz for c in found], [c.frequency_hz for c in judged], rtol=0, atol=1e-8)


@settings(max_examples=10)
@given(st.floats(0.03, 0.12), st.floats(60.0, 120.0), st.floats(0.03, 0.4), st.floats(2000.0, 20000.0))
def test_critical_speeds_are_those_of_pencil_and_track(trail, mass, length, stiffness):
    model = built(trail, mass, **tyre(length, stiffness))
    found = critical_speeds_of(Block.of_models([model]), 60.0)
    assert found.status[0] or assert_same(found.of(0), crossings_by_pencil(model, 60.0)) is None


def test_no_bicycle_hangs_on_its_neighbours():
    models = [built(trail, **tyre(0.1)) for trail in (0.04, 0.06, 0.08, 0.1)]
    together = critical_speeds_of(Block.of_models(models), 40.0)
    assert together.unsure == {}
    for k, model in enumerate(models):
        assert critical_speeds_of(Block.of_models([model]), 40.0).of(0) == together.of(k)


def test_a_bicycle_with_a_root_at_zero_is_left_to_the_plain_path(synthetic):
    """Roots 0 and -20 at all speeds, and v - 7: whether the first crosses is for the pencil to say."""
    model = synthetic({0: np.diag([0.0, -7.0, -20.0]), 1: np.diag([0.0, 1.0, 0.0])})
    found = critical_speeds_of(Block.of_models([model]), 20.0)
    assert found.status[0] != 0
    assert sum(found.unsure.values()) == 1
    assert found.of(0) == ()
    assert [c.speed for c in crossings_by_pencil(model, 20.0)] == [pytest.approx(7.0)]


def test_slip_without_relaxation_is_answered():
    model = built(side_slip={"cornering_stiffness": 6300.0})
    found = critical_speeds_of(Block.of_models([model, model]), 20.0)
    assert found.unsure == {}
    assert_same(found.of(1), crossings_by_pencil(model, 20.0))
