"""How plain weave, capsize and castering are at a speed."""

import importlib.util

import numpy as np
import pytest
from plain_kernels import plain

from bicycle.modal.anchor import BETTER, QUICK, SLOW, Cores, core_at, units_at
from bicycle.modal.identity import conjugate_index


@pytest.mark.parametrize("per_second", [1.0, 60.0])
def test_a_pair_is_as_plain_as_it_is_far_from_splitting_in_any_unit_of_time(per_second):
    """-1 +- 0.2 i is nearer to the real axis than to -3 and -9: its angle to it."""
    values = per_second * np.array([[-1 + 0.2j, -1 - 0.2j, -3, -9]])
    found = Cores.of(np.array([1.5]), values, conjugate_index(values), np.ones(values.shape))
    assert found.core.tolist() == [[True, False, True, True]]
    assert found.plain == pytest.approx(0.2 / np.hypot(1, 0.2))


def capsize_and_castering(values, lean, steer):
    """Branches of two real roots."""
    values = np.array(values, complex)
    units = units_at(values, np.arange(len(values)))
    found = core_at(units, np.ones(len(values), bool), np.array(lean), np.array(steer))
    return found["capsize"] + found["castering"]


def walked(values, grid=()):
    """Nodes of the kernel, 0.025 of the unit of speed apart."""
    from bicycle.modal.identity_kernel import Walked

    values = np.array(values, complex)
    m, n = values.shape
    table, mate = np.zeros((m, n), int), conjugate_index(values)
    v, branch = 1.0 + 0.025 * np.arange(m), np.zeros(n, int)
    return Walked(v, values.real, values.imag, mate, table, branch, branch.copy(), np.array(grid))


def capsize_and_castering_by_kernel(values, lean, steer):
    """The same of the kernel."""
    from bicycle.modal.anchor_kernel import CAPSIZE, CASTERING, own_core
    from bicycle.modal.batch_kind import Roles

    none = np.zeros(0)
    roles = Roles(none, 0, 1, 2, 3, none, none, none, none, none, singular=False)
    w, n, name = walked([values]), len(values), np.zeros(len(values), int)
    share = np.array([[lean, steer, np.zeros(n)]])
    plain(own_core)(w, 0, share, roles, np.ones(n, int), name)
    return tuple(w.owner.tolist().index(name.tolist().index(mode)) for mode in (CAPSIZE, CASTERING))


needs_numba = pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")


@pytest.mark.parametrize(
    "named", [capsize_and_castering, pytest.param(capsize_and_castering_by_kernel, marks=needs_numba)]
)
@pytest.mark.parametrize(
    ("lean", "steer"), [([0.6, 0.5], [0.2, 0.4]), ([0.3, 0.3], [0.1, 0.1]), ([0.0, 0.0], [0.0, 0.0])]
)
def test_capsize_leans_more_and_is_the_slower_where_both_lean_alike(named, lean, steer):
    for slow in (-0.5, 0.5):
        assert named([slow, -4.0], lean, steer) == (0, 1)
        assert named([-4.0, slow], lean[::-1], steer[::-1]) == (1, 0)
    assert named([-4.0, -0.5], lean, steer) == ((0, 1) if lean[0] > lean[1] else (1, 0))


@needs_numba
@pytest.mark.parametrize(
    ("count", "plainness", "more"),
    [
        ([3, 3, 3, 3, 3], [0.5, 0.3, 0.4, 0.3, 0.5], True),
        ([3, 3, 3, 2, 3], [0.5, 0.3, 0.4, 0.9, 0.5], True),
        ([3, 2, 3, 3, 3], [0.5, 0.9, 0.4, 0.3, 0.5], True),
        ([3, 3, 3, 3, 3], [0.5, 0.3, 0.4, 0.9, 0.95], False),
        ([3, 3, 3, 3, 2], [0.5, 0.3, 0.4, 0.45, 0.5], True),
    ],
)
def test_there_may_be_a_plainer_anchor_about_the_plainest_whole_node_inside_a_step(count, plainness, more):
    """Nodes 1 to 3 are inside a step that the full track divides; a neighbour that is not whole is no higher peak."""
    from bicycle.modal.anchor_kernel import _more_between

    w, plain_at = walked([[-1.0]] * 5, grid=[1, 0, 0, 0, 2]), np.array(plainness)
    look = plain(_more_between)
    assert not look(w, 5, 1.0, np.array(count), plain_at, 3, BETTER)
    assert look(w, 5, 1.0, np.array(count), plain_at, 3, 0.41) is more


@needs_numba
@pytest.mark.parametrize(("plainest", "anchor"), [(0, 4), (1, 4), (2, 2), (3, 3), (4, 4), (5, 5), (6, 4)])
def test_the_anchor_is_the_plainest_node_from_slow_to_quick(plainest, anchor):
    """A pair -1 +- q i beside -9 and -30 is the plainer the larger q is; next best is the fifth node."""
    from bicycle.modal.anchor_kernel import find_anchor
    from bicycle.modal.batch_kind import Roles

    speeds, q = np.array([0.55, 0.65, 0.75, 0.85, 1.0, 2.95, 3.05]), np.full(7, 0.3)
    assert ((speeds >= SLOW) & (speeds <= QUICK)).tolist() == [False, False, True, True, True, True, False]
    q[4], q[plainest] = 0.4, 0.5
    values = np.stack([-1 + 1j * q, -1 - 1j * q, np.full(7, -9), np.full(7, -30)], 1)
    none = np.zeros(0)
    roles = Roles(none, 0, 1, 2, 3, none, none, none, none, none, singular=False)
    w, core = walked(values, grid=[2] * 7)._replace(v=3.1 * speeds), np.zeros(4, int)
    assert plain(find_anchor)(w, 7, np.ones((7, 3, 4)), roles, 3.1, core) == anchor
    assert core.tolist() == [1, 0, 1, 1]


@needs_numba
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    ("roots", "least"),
    [
        ([-1, -3, -40], 2 / 4),
        ([-1, 9, -40], 39 / 41),
        ([-3 + 4j, -3 - 4j, -40], 4 / 5),
        ([-3 + 4j, -3 - 4j, -6 + 8j, -6 - 8j], 5 / 15),
        ([-12 + 5j, -12 - 5j, -14], np.hypot(2, 5) / 27),
    ],
)
def test_roots_are_as_plain_as_they_are_far_apart_for_their_size(roots, least, size):
    """The distance of two over the sum of their sizes, or the angle of a pair to the real axis."""
    from bicycle.modal.anchor_kernel import _plainness

    w = walked([size * np.array(roots)])
    assert plain(_plainness)(w, 0, np.ones(len(roots), int) * (w.im[0] >= 0)) == pytest.approx(least)
