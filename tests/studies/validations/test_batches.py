"""A fixed small version of the validation ``batches``, and that it would see a difference."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.modal.named_modes import modes
from studies.validations.batches import differing_names, run, same_crossings

needs_numba = pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")


@needs_numba
def test_batches_name_and_cross_as_the_judge(tmp_path):
    found = run(out=tmp_path, seed=3, models=80)
    assert found["different"] == []
    assert found["models"] == 80
    assert found["named"] > 20
    assert found["critical_speeds"] > 20
    assert sum(found["not_sure_of_names"].values()) + found["named"] == 80
    assert sum(found["not_sure_of_critical_speeds"].values()) + found["with_critical_speeds"] + found["refused"] == 80


def test_batches_in_plain_numpy_name_as_the_judge(tmp_path):
    found = run(out=tmp_path, seed=3, models=80, numpy=True)
    assert found["path"] == "lapack"
    assert found["different"] == []
    assert found["named"] > 20
    assert sum(found["not_sure_of_names"].values()) + found["named"] == 80
    assert found["critical_speeds"] == 0


def test_another_name_or_speed_is_seen():
    tyre = effect_class("relaxation_length")(cornering_stiffness=6300.0, relaxation_length=0.1)
    model = Model(load_bicycle("benchmark"), (tyre,)).linear_model()
    found = critical_speeds(model)
    assert same_crossings(found, found)
    moved = (replace(found[0], speed=found[0].speed + 2e-9), *found[1:])
    assert not same_crossings(moved, found)
    assert not same_crossings((found[0].named("wobble"), *found[1:]), found)
    assert not same_crossings(found[:-1], found)
    named = modes(model, [5.0, 6.0])
    called = [["" for _ in row] for row in named.eigenvalues]
    for name, values in named.branches.items():
        for k, row in enumerate(values):
            for z in row[~np.isnan(row)]:
                for i in np.flatnonzero(np.abs(named.eigenvalues[k].real - z.real) < 1e-9):
                    called[k][i] = name
    assert differing_names(named, named.eigenvalues, called) == []
    called[1][-1] = "castering" if called[1][-1] != "castering" else "capsize"
    assert differing_names(named, named.eigenvalues, called) == [1]
