"""Names of many bicycles at once: those of the full track of each, whoever the neighbours are, or a reason why not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("numba")

from bicycle import Model, effect_class, load_bicycle
from bicycle.modal.batch import WHY, Block, name_of, name_roots
from bicycle.modal.named_modes import modes

SPEEDS = np.linspace(1.0, 30.0, 30)


def built(trail=0.08, mass=85.0, length=0.1, stiffness=6300.0, **effects):
    bicycle = load_bicycle("benchmark").replace(c=trail, mB=mass)
    tyre = effect_class("relaxation_length")(cornering_stiffness=stiffness, relaxation_length=length)
    others = tuple(effect_class(name)(**table) for name, table in effects.items())
    return Model(bicycle, (tyre, *others)).linear_model()


def assert_same_names(model, speeds):
    """The batch is not sure, or names every root as the track does; whether it is sure."""
    found, judged = name_roots(Block.of_models([model]), np.asarray(speeds, float)[None]), modes(model, speeds)
    if found.status[0]:
        return False
    size = np.abs(judged.eigenvalues).max()
    np.testing.assert_allclose(found.values[0], judged.eigenvalues, rtol=0, atol=1e-7 * size)
    assert found.anchor[0] == judged.anchor
    for k, row in enumerate(found.values[0]):
        called = [name_of(int(bits), found.names) for bits in found.bits[0, k]]
        for name in {*called, *judged.branches}:
            mine = sorted((z for z, own in zip(row, called, strict=True) if own == name and z.imag >= 0), key=abs)
            theirs = judged.branches[name][k] if name in judged.branches else np.empty(0)
            theirs = sorted(theirs[~np.isnan(theirs)], key=abs)
            assert len(mine) == len(theirs), (name, speeds[k])
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-6 * size)
    return True


@settings(max_examples=25)
@given(
    st.floats(0.03, 0.12), st.floats(60.0, 120.0), st.floats(0.02, 0.4), st.floats(2000.0, 20000.0),
    st.sampled_from([{}, {"camber_thrust": {"camber_stiffness": 400.0}}, {"steer_damper": {"damping": 3.0}}]),
)  # fmt: skip
def test_names_are_those_of_the_full_track(trail, mass, length, stiffness, effects):
    assert_same_names(built(trail, mass, length, stiffness, **effects), SPEEDS)


def test_a_bicycle_with_tyres_is_named():
    assert assert_same_names(built(), SPEEDS)
    assert assert_same_names(built(), SPEEDS[::-1] + 20.0)


def test_no_bicycle_hangs_on_its_neighbours():
    models = [built(trail) for trail in (0.05, 0.07, 0.09, 0.11)]
    speeds = np.array([SPEEDS, SPEEDS + 0.1, SPEEDS[::-1], SPEEDS + 40.0])
    together = name_roots(Block.of_models(models), speeds)
    assert together.unsure == {}
    for k, model in enumerate(models):
        alone = name_roots(Block.of_models([model]), speeds[k : k + 1])
        np.testing.assert_array_equal(alone.values[0], together.values[k])
        np.testing.assert_array_equal(alone.bits[0], together.bits[k])


def test_speeds_that_cannot_be_tracked_are_not_answered():
    found = name_roots(Block.of_models([built(), built()]), np.array([[5.0, 2000.0], [5.0, 6.0]]))
    assert found.status.tolist() == [12, 0]
    assert found.unsure == {"speeds that cannot be tracked": 1}
    assert all(WHY.values())


def test_a_joint_name_lists_both():
    names = ("weave", "capsize", "castering")
    assert [name_of(bits, names) for bits in (1, 2, 5, 7)] == [
        "weave", "capsize", "castering+weave", "capsize+castering+weave",
    ]  # fmt: skip
