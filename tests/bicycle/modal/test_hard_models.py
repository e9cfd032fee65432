"""Random models on which batches once named or crossed otherwise than the track: now the same, or not sure.

``hard_models.json`` has their numbers (synthetic, drawn by the validation ``batches``) and what was wrong.
"""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.solvers import compiled, lapack
from bicycle.modal.batch import name_of, name_roots
from bicycle.modal.block import Block
from bicycle.modal.named_modes import modes

CASES = json.loads((Path(__file__).parent / "hard_models.json").read_text())
SPEEDS = np.linspace(0.5, 40.0, 300)
NUMBA = importlib.util.find_spec("numba") is not None


def drawn(case):
    effects = tuple(effect_class(name)(**table) for name, table in case["effects"].items())
    return Model(load_bicycle("benchmark").replace(**case["bicycle"]), effects).linear_model()


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_names_are_those_of_the_track_or_none(case):
    model = drawn(case)
    alone = case.get("at_m_s", [])
    every = np.append(SPEEDS, alone)
    judged = modes(model, every)
    for solver in (lapack, *([compiled] if NUMBA else [])):
        for speeds in (*np.split(SPEEDS, 10), *np.array(alone)[:, None]):  # one that is not sure leaves the others
            found = name_roots(Block.of_models([model]), speeds[None], solver=solver)
            if found.status[0]:
                assert sum(found.unsure.values()) == 1
                continue
            for k, speed in enumerate(speeds):
                at = int(np.flatnonzero(speed == every)[0])
                called = [name_of(int(bits), found.names) for bits in found.bits[0, k]]
                for name in {*called, *judged.branches}:
                    mine = [z for z, own in zip(found.values[0, k], called, strict=True) if own == name and z.imag >= 0]
                    theirs = judged.branches[name][at] if name in judged.branches else np.empty(0)
                    theirs = theirs[~np.isnan(theirs)]
                    assert len(mine) == len(theirs), (name, speed, solver.__name__)
                    far = np.abs(np.sort_complex(np.array(mine, complex)) - np.sort_complex(theirs))
                    assert (far <= 1e-6 * np.abs(found.values[0, k]).max()).all(), (name, speed, solver.__name__)


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_names_do_not_hang_on_what_else_is_asked(case):
    model = drawn(case)
    slow = np.array([0.1, 0.4, 0.7])  # m/s: below the speeds that are tracked whatever is asked for
    for solver in (lapack, *([compiled] if NUMBA else [])):
        alone = name_roots(Block.of_models([model]), slow[None, -1:], solver=solver)
        beside = name_roots(Block.of_models([model, model]), np.array([slow[-1:], slow[:1]]), solver=solver)
        assert (beside.status[0], beside.bits[0].tolist()) == (alone.status[0], alone.bits[0].tolist())
    one, all_ = modes(model, slow[-1:]), modes(model, slow)
    assert set(one.branches) <= set(all_.branches)
    for name, roots in all_.branches.items():
        mine = one.branches[name][0] if name in one.branches else np.empty(0)
        np.testing.assert_array_equal(mine[~np.isnan(mine)], roots[-1][~np.isnan(roots[-1])])


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_critical_speeds_are_those_of_the_pencil_or_none(case):
    pytest.importorskip("numba")
    from bicycle.critical.batch import critical_speeds_of

    model = drawn(case)
    found = critical_speeds_of(Block.of_models([model]), 40.0)
    if found.status[0]:
        assert found.of(0) == ()
        return
    judged = critical_speeds(model, 40.0)
    assert [(c.mode, c.direction) for c in found.of(0)] == [(c.mode, c.direction) for c in judged]
    np.testing.assert_allclose([c.speed for c in found.of(0)], [c.speed for c in judged], rtol=0, atol=1e-9)
