"""Tracking on matrices whose eigenvalues are known functions of speed."""

import importlib.util

import numpy as np
import pytest
from plain_kernels import plain
from scipy.linalg import block_diag

from bicycle.modal.identity import conjugate_index, regions
from bicycle.modal.naming import HIGHEST
from bicycle.modal.tracking import STEP, TrackedRange, given, grid, track


def rotated(*blocks_by_power, seed=0):
    """The same blocks for every power of v, seen in other coordinates."""
    n = len(block_diag(*blocks_by_power[0]))
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(n, n)))[0]
    return {power: turn @ block_diag(*blocks) @ turn.T for power, blocks in enumerate(blocks_by_power)}


def pair(real, frequency):
    return np.array([[real, -frequency], [frequency, real]])


def followed(model, speeds, low=0.0, high=30.0):
    tracked, meetings = track(model, low, high)
    v = np.asarray(speeds, float)
    values = model.eigenvalues(v)
    (own,) = tracked
    return np.take_along_axis(values, own.follow(v, values), 1), meetings, own


def branch_through(ordered, value):
    """Column whose first row is nearest to a value."""
    return ordered[:, np.abs(ordered[0] - value).argmin()]


SPEEDS = np.array([0.0, 0.4, 7.0, 9.99, 10.01, 12.0, 20.0])


def test_pairs_that_cross_in_frequency_keep_their_own_root(synthetic):
    """-1 + i (4 + v) and -3 + i (24 - v) have the same frequency at v = 10, where any sorting swaps them."""
    model = synthetic(rotated((pair(-1, 4), pair(-3, 24)), (pair(0, 1), pair(0, -1))))
    ordered, meetings, _ = followed(model, SPEEDS, high=22.0)
    np.testing.assert_allclose(branch_through(ordered, -1 + 4j), -1 + 1j * (4 + SPEEDS), atol=1e-10)
    np.testing.assert_allclose(branch_through(ordered, -3 + 24j), -3 + 1j * (24 - SPEEDS), atol=1e-10)
    assert meetings == ()


def test_independent_real_roots_cross_without_exchanging(synthetic):
    """-v and -5 are eigenvalues of unconnected parts: they pass through each other at 5."""
    model = synthetic(rotated(([[0]], [[-5]]), ([[-1]], [[0]])))
    ordered, meetings, _ = followed(model, [0.0, 4.9, 5.1, 30.0])
    np.testing.assert_allclose(branch_through(ordered, 0.0), [0, -4.9, -5.1, -30], atol=1e-10)
    assert meetings == ()


def test_coupled_real_roots_veer_and_keep_their_order(synthetic):
    """The symmetric coupling of 0.05 opens a gap of 0.1 at v = 5: continuous roots do not cross."""
    model = synthetic({0: [[0, 0.05], [0.05, -5]], 1: [[-1, 0], [0, 0]]})
    ordered, _, _ = followed(model, [0.0, 4.0, 6.0, 30.0])
    assert (ordered[:, 0] != ordered[:, 1]).all()
    upper = branch_through(ordered, 0.0)
    assert (upper == ordered.max(1)).all()


def test_between_two_nodes_roots_are_followed_along_the_cubic_of_their_ends():
    """Of 40 roots that are cubics of the speed and cross in between."""
    rng = np.random.default_rng(2)
    roots = np.polynomial.Polynomial
    branches = [roots(rng.normal(size=4) + 1j * rng.normal(size=4)) for _ in range(40)]
    ends, places = np.array([1.0, 2.5]), np.array([1.1, 1.6, 1.9, 2.4])
    values, slopes = (np.stack([b(ends) for b in of], 1) for of in (branches, [b.deriv() for b in branches]))
    own = TrackedRange(ends, values, slopes, np.array([True]), np.empty(0))
    seen = np.stack([b(places) for b in branches], 1)
    shuffled = rng.permuted(np.tile(np.arange(40), (4, 1)), axis=1)
    found = own.follow(places, np.take_along_axis(seen, shuffled, 1))
    np.testing.assert_array_equal(np.take_along_axis(shuffled, found, 1), np.tile(np.arange(40), (4, 1)))


@pytest.mark.parametrize(("sign", "kind"), [(1.0, "split"), (-1.0, "merge")])
def test_the_speed_where_real_roots_meet(synthetic, sign, kind):
    """s + sign (v - 7) = x^2 + 2 x: roots -1 +- sqrt(sign (v - 7)) meet at v = 7 in -1."""
    model = synthetic({0: [[-2, -7 * sign - 1], [1, 0]], 1: [[0, sign], [0, 0]]})
    ordered, meetings, _ = followed(model, [6.999, 7.001])
    (meeting,) = meetings
    assert meeting.kind == kind
    assert meeting.speed == pytest.approx(7.0, abs=1e-11)
    assert meeting.eigenvalue == pytest.approx(-1.0, abs=1e-7)
    upper = np.sqrt(sign * (np.array([6.999, 7.001]) - 7) + 0j) - 1
    column = ordered[:, ordered[0].imag.argmax() if sign > 0 else ordered[0].real.argmax()]
    np.testing.assert_allclose(column, upper, atol=1e-9)


def test_identical_roots_cost_nothing(synthetic):
    """Two equal roots -2 v at all speeds (two wheels with one relaxation length) are not refined without end."""
    model = synthetic(rotated(([[0]], [[0]], pair(-1, 9)), ([[-2]], [[-2]], pair(0, 0.1))))
    _, meetings, own = followed(model, [1.0])
    assert len(own.speeds) < 400
    assert meetings == ()


def test_roots_are_matched_across_a_switch(synthetic):
    """At v = 4 another pair of matrices holds: the roots -1 and -9 become -1.5 and -8."""
    model = synthetic({0: [[-1, 0], [0, -9]]}, {0: [[-8, 0], [0, -1.5]]}, borders=(4.0,))
    (below, above), _ = track(model, 0.0, 10.0)
    for before, after in ((-1, -1.5), (-9, -8)):
        column = np.abs(below.values[-1] - before).argmin()
        assert above.values[0, column] == pytest.approx(after)
    assert below.speeds[-1] == above.speeds[0] == 4.0


def test_the_grid_is_one_sequence_whatever_is_covered():
    wide, narrow = grid(0.0, 60.0, 3.0, singular=False), grid(2.0, 5.0, 3.0, singular=False)
    assert np.isin(narrow, wide).all()
    assert narrow[0] <= 2.0
    assert narrow[-1] >= 5.0
    deep, shallow = grid(1e-3, 10.0, 3.0, singular=True), grid(0.01, 10.0, 3.0, singular=True)
    assert np.isin(shallow, deep).all()
    assert 0 < deep[0] <= 1e-3


def test_nodes_next_to_rest_halve_in_two_steps_and_reach_as_far_down_as_asked():
    for low in (0.2, 0.01, 1e-4):
        nodes = grid(low, 10.0, 3.0, singular=True)
        slow = nodes[nodes <= 0.3 * (1 + 1e-12)]  # the first step of the even part, 0.1 of the unit
        np.testing.assert_allclose(slow[1:] / slow[:-1], np.sqrt(2))
        assert slow[0] <= low * (1 + 1e-12) < np.sqrt(2) * slow[0]


def carried(rows, modes, castering=-1, always=(0.0, 100.0), anchor=0, *, certain=True, step=1.0):
    values = np.array(rows, complex)
    speeds, mate = np.arange(float(len(rows))), conjugate_index(values)
    certain = np.broadcast_to(certain, speeds.shape)
    return regions(speeds, values, mate, modes, castering, anchor, always, certain, step)


def labels(*arguments, **keywords):
    found = carried(*arguments, **keywords)
    return [found.labels[case] for case in found.cases]


def labels_by_kernel(rows, modes, castering=-1, anchor=0):
    """The same of the kernel, at nodes one step of the full track apart."""
    from bicycle.modal import identity_kernel

    values = np.array(rows, complex)
    m, n = values.shape
    owner, double, label = np.full(n, -1), np.zeros(n, int), np.zeros((m, n), int)
    for mode, branches in enumerate(modes):
        owner[list(branches)], double[mode] = mode, len(branches) == 2
    w = identity_kernel.Walked(
        np.arange(float(m)), values.real, values.imag, conjugate_index(values), label, owner, double, np.ones(m, int)
    )
    assert plain(identity_kernel.walk)(w, m, len(modes), castering, anchor, 0.0, HIGHEST / STEP)
    bits = (label & ~identity_kernel.CHANCE).tolist()
    return [tuple(tuple(m for m in range(len(modes)) if one >> m & 1) for one in row) for row in bits]


needs_numba = pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")
either_way = pytest.mark.parametrize("told", [labels, pytest.param(labels_by_kernel, marks=needs_numba)])

MEETING = [  # a real root and a pair that splits and gives one half to it
    [-1, -10 + 5j, -10 - 5j],
    [-2, -8, -13],
    [-3.5, -5, -13],
    [-4.2 + 1j, -4.2 - 1j, -13],
    [-4 + 9j, -4 - 9j, -14],
]


@either_way
def test_a_meeting_leaves_the_pair_to_the_mode_that_is_one(told):
    own, lost, after = ((0,), (1,), (1,)), ((0, 1),) * 3, ((1,), (1,), (0,))
    assert told(MEETING, [(0,), (1, 2)]) == [own, own, lost, after, after]
    assert told(MEETING[::-1], [(0,), (1, 2)], anchor=4) == [after, after, lost, own, own]


def test_what_happens_outside_the_speeds_always_tracked_changes_nothing_inside():
    inside = labels(MEETING[:3], [(0,), (1, 2)], always=(0.0, 2.5))
    assert labels(MEETING, [(0,), (1, 2)], always=(0.0, 2.5))[:3] == inside


def test_what_happens_outside_them_changes_nothing_nearer_to_the_anchor():
    slower = labels(MEETING[:3], [(0,), (1, 2)], always=(0.0, 1.5))
    assert labels(MEETING, [(0,), (1, 2)], always=(0.0, 1.5))[:3] == slower


def test_a_pair_of_two_modes_that_no_certain_node_shows_is_in_doubt():
    rows = [[-1, -5], [-2, -3], [-2.4 + 1j, -2.4 - 1j], [-2.5 + 1j, -2.5 - 1j], [-2, -4]]
    modes = [(0,), (1,)]
    assert carried(rows, modes, certain=[True, True, False, True, True]).clear
    assert carried(rows[:4], modes, certain=[True, True, False, False]).clear  # it need not part
    for anchor in (0, 4):
        assert not carried(rows, modes, anchor=anchor, certain=[True, True, False, False, True]).clear


def test_where_a_lost_identity_is_given_back_in_a_wide_step_is_in_doubt():
    rows = [*MEETING[:2], [-3.5, -5, -12], [-4.2 + 1j, -4.2 - 1j, -12]]
    assert carried(rows, [(0,), (1, 2)]).clear
    assert not carried(rows, [(0,), (1, 2)], step=0.5).clear


def test_nodes_of_the_grid_are_told_by_their_speed():
    nodes = grid(0.01, 10.0, 3.0, singular=True) / 3.0
    assert given(nodes, singular=True).all()
    assert not given((nodes[1:] + nodes[:-1]) / 2, singular=True).any()
    assert given(np.array([0.0, 0.05, 0.1, 0.15]), singular=False).tolist() == [True, False, True, False]


@needs_numba
def test_the_kernel_tells_nodes_of_the_full_grid_by_their_speed():
    from bicycle.modal import track_kernel

    full = grid(0.0, 6.0, 3.1, singular=False)
    every = np.sort(np.concatenate([full, (full[1:] + full[:-1]) / 2]))
    t = track_kernel.empty_track(1, len(every), 1)
    t.v[0] = every

    def told():
        return [plain(track_kernel.on_grid)(t, np.array([3.1]), 0, slot) for slot in range(len(every))]

    assert told() == np.isin(every, full).tolist()
    t.grid[:] = 4  # the first were given
    assert told()[:4] == [True] * 4


@either_way
def test_real_modes_that_form_a_pair_for_a_while_get_their_names_back(told):
    rows = [[-1, -5], [-2, -3], [-2.5 + 1j, -2.5 - 1j], [-2, -4]]
    assert told(rows, [(0,), (1,)]) == [((0,), (1,)), ((0,), (1,)), ((0, 1), (0, 1)), ((0,), (1,))]


@either_way
def test_two_pairs_that_mix_their_halves_are_one_until_two_pairs_are_left(told):
    rows = [
        [-5 + 3j, -5 - 3j, -9 + 2j, -9 - 2j],
        [-4, -6.5, -7.5, -12],
        [-3, -7 + 1j, -7 - 1j, -14],
        [-2, -5, -9, -16],
    ]
    own = ((0,), (0,), (1,), (1,))
    assert told(rows, [(0, 1), (2, 3)]) == [own, own, ((0, 1),) * 4, own]


@either_way
def test_castering_and_a_single_tyre_root_are_wobble(told):
    rows = [[-5, -20, -90], [-8, -14, -80], [-10 + 3j, -10 - 3j, -70], [-9, -12, -60]]
    own = ((0,), (1,), (2,))
    assert told(rows, [(0,), (1,), (2,)], castering=0) == [own, own, ((1,), (1,), (2,)), own]


@either_way
def test_two_pairs_and_a_real_root_of_three_modes_go_to_those_that_had_most_of_them(told):
    """Halves of the first and the second mode meet, the other of the second and a real root: the first's is left."""
    rows = [
        [-5 + 3j, -5 - 3j, -9 + 2j, -9 - 2j, -30],
        [-4, -9, -11, -25, -29],
        [-3, -10 + 1j, -10 - 1j, -27 + 1j, -27 - 1j],
        [-3, -10 + 3j, -10 - 3j, -27 + 3j, -27 - 3j],
    ]
    own, after = ((0,), (0,), (1,), (1,), (2,)), ((2,), (0,), (0,), (1,), (1,))
    modes = [(0, 1), (2, 3), (4,)]
    assert told(rows, modes)[0] == own
    assert told(rows, modes)[2:] == [after, after]
